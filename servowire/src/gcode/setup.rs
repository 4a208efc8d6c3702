//! An axis of a machine, as given on the command line.

use std::str::FromStr;

use step_motion::{AxisSetup, Limits};

use super::AXES;
use super::limit::{ACCELERATION, JERK, LAST_BITS, SPEED, down};

/// `X:steps-per-mm=80,speed=6000,acceleration=500,jerk=10000,low=0,high=300,pause=0.5`: the settings of one axis, in mm, with
/// minutes for the speed, milliseconds for the pause and seconds for the rest.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct Setup {
    pub(super) axis: usize,
    steps_per_mm: Option<f64>,
    speed: Option<f64>,
    acceleration: Option<f64>,
    jerk: Option<f64>,
    /// The soft limits, and the pause before each change of direction.
    low: Option<f64>,
    high: Option<f64>,
    pause: Option<f64>,
}

/// A setting: its place, and the least value.
type Place<'a> = (&'a mut Option<f64>, Least);

/// What a value has to be.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Least {
    Above0,
    From0,
    Any,
}

impl Least {
    fn allows(self, value: f64) -> bool {
        match self {
            Self::Above0 => value > 0.0,
            Self::From0 => value >= 0.0,
            Self::Any => true,
        }
    }

    const fn name(self) -> &'static str {
        match self {
            Self::Above0 => "a number above 0",
            Self::From0 => "a number from 0 on",
            Self::Any => "a number",
        }
    }
}

/// The farthest soft limit, in mm, and the longest pause, in ms.
const FARTHEST: f64 = 100_000.0;
const LONGEST: f64 = 1000.0;

const AXIS_NAMES: [&str; AXES] = ["X", "Y", "Z"];

impl FromStr for Setup {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (name, settings) =
            text.split_once(':').ok_or("X, Y or Z, a colon, and settings: X:steps-per-mm=80,speed=6000")?;
        let axis = AXIS_NAMES.iter().position(|axis| axis.eq_ignore_ascii_case(name.trim()));
        let axis = axis.ok_or_else(|| format!("\"{name}\" is not an axis: X, Y or Z"))?;
        let mut new = Self::new(axis);
        for setting in settings.split(',') {
            let (key, value) =
                setting.split_once('=').ok_or_else(|| format!("\"{setting}\" is not a setting, such as speed=6000"))?;
            let (place, least) = new.place(key.trim())?;
            let value = value.trim().parse().ok().filter(|value: &f64| least.allows(*value) && value.is_finite());
            if place.replace(value.ok_or_else(|| format!("\"{setting}\": {}", least.name()))?).is_some() {
                return Err(format!("{} is there twice", key.trim()));
            }
        }
        new.check()?;
        Ok(new)
    }
}

impl Setup {
    /// An axis of which nothing is said.
    pub(super) fn new(axis: usize) -> Self {
        Self { axis, ..Self::default() }
    }

    fn place(&mut self, key: &str) -> Result<Place<'_>, String> {
        Ok(match key {
            "steps-per-mm" => (&mut self.steps_per_mm, Least::Above0),
            "speed" => (&mut self.speed, Least::Above0),
            "acceleration" => (&mut self.acceleration, Least::Above0),
            "jerk" => (&mut self.jerk, Least::Above0),
            "low" => (&mut self.low, Least::Any),
            "high" => (&mut self.high, Least::Any),
            "pause" => (&mut self.pause, Least::From0),
            other => {
                return Err(format!(
                    "\"{other}\": steps-per-mm, speed (mm/min), acceleration (mm/s²), jerk (mm/s³), low or high (mm), or pause (ms)"
                ));
            }
        })
    }

    /// Returns what two options say of one axis.
    pub(super) fn join(self, other: Self) -> Result<Self, String> {
        let mut both = self;
        for (key, value) in other.settings() {
            let Some(value) = value else { continue };
            let (place, _) = both.place(key)?;
            if place.replace(value).is_some() {
                return Err(format!("{}: {key} is there twice", self.name()));
            }
        }
        Ok(both)
    }

    const fn settings(&self) -> [(&'static str, Option<f64>); 7] {
        [
            ("steps-per-mm", self.steps_per_mm),
            ("speed", self.speed),
            ("acceleration", self.acceleration),
            ("jerk", self.jerk),
            ("low", self.low),
            ("high", self.high),
            ("pause", self.pause),
        ]
    }

    fn name(&self) -> &'static str {
        AXIS_NAMES.get(self.axis).copied().unwrap_or_default()
    }

    fn check(&self) -> Result<(), String> {
        if self.steps_per_mm.is_some_and(|n| !(0.001..=10_000.0).contains(&n)) {
            return Err("steps-per-mm: 0.001 to 10000".to_owned());
        }
        if self.low.into_iter().chain(self.high).any(|limit| limit.abs() > FARTHEST) {
            return Err(format!("low, high: -{FARTHEST} to {FARTHEST} mm"));
        }
        // Every program begins at 0.
        if self.low.is_some_and(|low| low > 0.0) || self.high.is_some_and(|high| high < 0.0) {
            return Err("low is at most 0, and high at least 0: the program begins there".to_owned());
        }
        if self.pause.is_some_and(|pause| pause > LONGEST) {
            return Err(format!("pause: 0 to {LONGEST} ms"));
        }
        Ok(())
    }

    /// Returns an axis that takes what is not given here from `other`; ticks are ns.
    pub(super) fn over(&self, other: AxisSetup) -> Result<AxisSetup, String> {
        let mut axis = other;
        axis.steps_per_m = self.steps_per_mm.map_or(other.steps_per_m, |n| (n * 1000.0).round() as u32);
        let per_mm = f64::from(axis.steps_per_m) / 1000.0;
        let (steps, name) = (|mm: f64| mm * per_mm, self.name());
        let speed = SPEED.steps(name, self.speed, per_mm)?;
        let acceleration = ACCELERATION.steps(name, self.acceleration, per_mm)?;
        let jerk = JERK.steps(name, self.jerk, per_mm)?.map(|jerk| jerk as u64).or(other.limits.jerk());
        let speed = speed.map_or(other.limits.speed(), |speed| speed as u32);
        let acceleration = acceleration.map_or(other.limits.acceleration(), |a| a as u32);
        let limits = Limits::new(speed, acceleration).map_err(|e| e.to_string())?;
        axis.limits = jerk.map_or(Ok(limits), |jerk| limits.with_jerk(jerk)).map_err(|e| e.to_string())?;
        if self.low.is_some() || self.high.is_some() {
            // A limit is the last step that is within it.
            let low = self.low.map_or(i64::MIN, |mm| -down(steps(-mm)) as i64);
            let high = self.high.map_or(i64::MAX, |mm| down(steps(mm)) as i64);
            axis = axis.with_soft_limits(low, high);
        }
        if let Some(ms) = self.pause {
            axis = axis.with_reversal_pause((ms * 1e6 * (1.0 - LAST_BITS)).ceil() as u32);
        }
        Ok(axis)
    }

    /// Refuses a speed of more than this many steps/s.
    pub(super) fn within(&self, axis: &AxisSetup, most: u32) -> Result<(), String> {
        let per_mm = f64::from(axis.steps_per_m) / 1000.0;
        SPEED.up_to(most.into()).steps(self.name(), self.speed, per_mm).map(|_| ())
    }
}

/// The position of an axis in steps.
pub(super) fn in_steps(mm: f64, axis: &AxisSetup) -> i64 {
    (mm * f64::from(axis.steps_per_m) / 1000.0).round() as i64
}

/// The first axis of a place in mm that is beyond its soft limits.
pub(super) fn outside(to: [f64; AXES], axes: &[AxisSetup; AXES]) -> Option<String> {
    for ((name, mm), axis) in AXIS_NAMES.into_iter().zip(to).zip(axes) {
        let Some((low, high)) = axis.soft_limits else { continue };
        let (at, per_mm) = (in_steps(mm, axis), f64::from(axis.steps_per_m) / 1000.0);
        let (side, limit) = match at {
            at if at < low => ("below the low", low),
            at if at > high => ("above the high", high),
            _ => continue,
        };
        return Some(format!("{name}{mm:.3} is {side} soft limit, {:.3} mm", limit as f64 / per_mm));
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An axis of X with 1 step/mm, a limit on its own.
    fn limits(text: &str) -> Result<Limits, String> {
        let machine = AxisSetup::new(Limits::new(100_000, 400_000).unwrap(), 1000);
        text.parse::<Setup>().and_then(|setup| setup.over(machine)).map(|axis| axis.limits)
    }

    /// 90 mm/min are 1.5 steps/s, and at 240 steps/mm 4.35 mm/min are 17.4. What is whole stays so, though 4.35 times 100 is
    /// below 435 in floating point.
    #[test]
    fn an_axis_never_exceeds_its_limits() {
        let new = |speed, acceleration| Limits::new(speed, acceleration).unwrap();
        for (text, want) in [
            ("X:speed=90", new(1, 400_000)),
            ("X:speed=119.999", new(1, 400_000)),
            ("X:speed=120", new(2, 400_000)),
            ("X:acceleration=1.5", new(100_000, 1)),
            ("X:acceleration=2.999", new(100_000, 2)),
            ("X:steps-per-mm=100,acceleration=4.35", new(100_000, 435)),
            ("X:steps-per-mm=240,speed=4.35", new(17, 400_000)),
            ("X:jerk=1.5", new(100_000, 400_000).with_jerk(1).unwrap()),
            ("X:steps-per-mm=100,jerk=4.35", new(100_000, 400_000).with_jerk(435).unwrap()),
        ] {
            assert_eq!(limits(text), Ok(want), "{text}");
        }
        for (text, want) in [
            ("X:speed=59", "X:speed=59 is below 1 step/s, the least for an axis"),
            ("Y:speed=0.001", "Y:speed=0.001 is below 1 step/s, the least for an axis"),
            ("X:steps-per-mm=80,acceleration=0.001", "X:acceleration=0.001 is below 1 step/s², the least"),
            ("X:jerk=0.5", "X:jerk=0.5 is below 1 step/s³, the least for an axis"),
        ] {
            let error = limits(text).unwrap_err();
            assert!(error.contains(want), "{text}: {error}");
        }
    }

    /// In the user's units: 2^31 - 1 steps/s² at 10000 steps/mm are 214748.3647 mm/s²; a step in 2 ns are 3 km/min.
    #[test]
    fn what_is_above_the_greatest_limit() {
        for (text, want) in [
            (
                "X:steps-per-mm=10000,acceleration=2000000",
                "X:acceleration=2000000 is above 214748.364 mm/s², the greatest",
            ),
            ("Y:steps-per-mm=80,jerk=1e30", "Y:jerk=1e30 is above 219902325555.187 mm/s³, the greatest"),
            ("Z:steps-per-mm=10000,speed=1e8", "Z:speed=100000000 is above 3000000 mm/min, the greatest"),
        ] {
            let error = limits(text).unwrap_err();
            assert!(error.contains(want), "{text}: {error}");
        }
        assert!(limits("X:steps-per-mm=10000,acceleration=214748.364,speed=3000000").is_ok());
    }

    /// Over all that is said of an axis, in whatever order.
    #[test]
    fn an_axis_in_several_options() {
        let join = |texts: [&str; 2]| {
            let [first, second] = texts.map(|text| text.parse::<Setup>().unwrap());
            first.join(second)
        };
        let whole = "X:steps-per-mm=160,speed=6000,low=-1".parse();
        assert_eq!(join(["X:speed=6000", "X:low=-1,steps-per-mm=160"]), whole);
        assert_eq!(join(["X:low=-1,steps-per-mm=160", "X:speed=6000"]), whole);
        assert_eq!(join(["X:speed=100", "X:low=0,speed=200"]), Err("X: speed is there twice".to_owned()));
    }

    /// A soft limit is reached, though 4.35 times 100 is below 435 in floating point; a pause is at least as long as asked for.
    #[test]
    fn soft_limits_and_pauses_are_what_they_say() {
        let machine = AxisSetup::new(Limits::new(100_000, 400_000).unwrap(), 100_000);
        let axis = |text: &str| text.parse::<Setup>().unwrap().over(machine).unwrap();
        assert_eq!(axis("X:low=-4.35,high=4.35").soft_limits, Some((-435, 435)));
        assert_eq!(axis("X:low=-4.359,high=4.359").soft_limits, Some((-435, 435)));
        for (text, ns) in
            [("0.0000001", 1), ("0.0000011", 2), ("0.00435", 4350), ("0.0011", 1100), ("1000", 1_000_000_000)]
        {
            assert_eq!(axis(&format!("X:pause={text}")).reversal_pause, ns, "{text}");
        }
    }

    #[test]
    fn an_axis_in_its_own_units() {
        let machine = AxisSetup::new(Limits::new(100_000, 400_000).unwrap(), 80_000);
        let setup: Setup = "z:steps-per-mm=400,speed=600,acceleration=50,jerk=1000".parse().unwrap();
        let limits = Limits::new(4000, 20_000).unwrap().with_jerk(400_000).unwrap();
        assert_eq!((setup.axis, setup.over(machine)), (2, Ok(AxisSetup::new(limits, 400_000))));
        let setup: Setup = "X:speed=6000".parse().unwrap();
        assert_eq!(setup.over(machine), Ok(AxisSetup::new(Limits::new(8000, 400_000).unwrap(), 80_000)));
        let setup: Setup = "Y:low=-2.51,high=300,pause=0.5".parse().unwrap();
        let axis = machine.with_soft_limits(-200, 24_000).with_reversal_pause(500_000);
        assert_eq!(setup.over(machine), Ok(axis));
        let setup: Setup = "Y:high=1,pause=0".parse().unwrap();
        assert_eq!(setup.over(machine), Ok(machine.with_soft_limits(i64::MIN, 80)));
        for (text, want) in [
            ("X", "a colon"),
            ("A:speed=1", "\"A\" is not an axis"),
            ("X:feed=1", "\"feed\": steps-per-mm, speed"),
            ("X:speed", "is not a setting"),
            ("X:speed=1, speed=2", "speed is there twice"),
            ("X:speed=0", "above 0"),
            ("X:steps-per-mm=20000", "0.001 to 10000"),
            ("X:low=NaN", "a number"),
            ("X:low=1", "at most 0"),
            ("X:high=-1", "at least 0"),
            ("X:high=200000", "-100000 to 100000 mm"),
            ("X:pause=-1", "from 0 on"),
            ("X:pause=2000", "0 to 1000 ms"),
        ] {
            let error = text.parse::<Setup>().unwrap_err();
            assert!(error.contains(want), "{text}: {error}");
        }
    }
}
