//! An axis of a machine, as given on the command line.

use std::str::FromStr;

use step_motion::{AxisSetup, Limits};

/// `X:steps-per-mm=80,speed=6000,acceleration=500,jerk=10000`: the settings of one axis, in mm, with minutes for the speed
/// and seconds for the rest.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Setup {
    pub(super) axis: usize,
    steps_per_mm: Option<f64>,
    speed: Option<f64>,
    acceleration: Option<f64>,
    jerk: Option<f64>,
}

impl FromStr for Setup {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (name, settings) =
            text.split_once(':').ok_or("X, Y or Z, a colon, and settings: X:steps-per-mm=80,speed=6000")?;
        let axis = ["X", "Y", "Z"].iter().position(|axis| axis.eq_ignore_ascii_case(name.trim()));
        let axis = axis.ok_or_else(|| format!("\"{name}\" is not an axis: X, Y or Z"))?;
        let mut new = Self { axis, steps_per_mm: None, speed: None, acceleration: None, jerk: None };
        for setting in settings.split(',') {
            let (key, value) =
                setting.split_once('=').ok_or_else(|| format!("\"{setting}\" is not a setting, such as speed=6000"))?;
            let place = match key.trim() {
                "steps-per-mm" => &mut new.steps_per_mm,
                "speed" => &mut new.speed,
                "acceleration" => &mut new.acceleration,
                "jerk" => &mut new.jerk,
                other => {
                    return Err(format!(
                        "\"{other}\": steps-per-mm, speed (mm/min), acceleration (mm/s²) or jerk (mm/s³)"
                    ));
                }
            };
            let value = value.trim().parse().ok().filter(|value: &f64| *value > 0.0 && value.is_finite());
            *place = Some(value.ok_or_else(|| format!("\"{setting}\": a number above 0"))?);
        }
        if new.steps_per_mm.is_some_and(|n| !(0.001..=10_000.0).contains(&n)) {
            return Err("steps-per-mm: 0.001 to 10000".to_owned());
        }
        Ok(new)
    }
}

impl Setup {
    /// Returns an axis that takes what is not given here from `other`.
    pub(super) fn over(&self, other: AxisSetup) -> Result<AxisSetup, String> {
        let steps_per_m = self.steps_per_mm.map_or(other.steps_per_m, |n| (n * 1000.0).round() as u32);
        let per_mm = f64::from(steps_per_m) / 1000.0;
        let steps = |mm: f64| (mm * per_mm).round().max(1.0);
        let speed = self.speed.map_or(other.limits.speed(), |speed| steps(speed / 60.0) as u32);
        let acceleration = self.acceleration.map_or(other.limits.acceleration(), |a| steps(a) as u32);
        let limits = Limits::new(speed, acceleration).map_err(|e| e.to_string())?;
        let jerk = self.jerk.map(|jerk| steps(jerk) as u64).or(other.limits.jerk());
        let limits = jerk.map_or(Ok(limits), |jerk| limits.with_jerk(jerk)).map_err(|e| e.to_string())?;
        Ok(AxisSetup::new(limits, steps_per_m))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_axis_in_its_own_units() {
        let machine = AxisSetup::new(Limits::new(100_000, 400_000).unwrap(), 80_000);
        let setup: Setup = "z:steps-per-mm=400,speed=600,acceleration=50,jerk=1000".parse().unwrap();
        let limits = Limits::new(4000, 20_000).unwrap().with_jerk(400_000).unwrap();
        assert_eq!((setup.axis, setup.over(machine)), (2, Ok(AxisSetup::new(limits, 400_000))));
        let setup: Setup = "X:speed=6000".parse().unwrap();
        assert_eq!(setup.over(machine), Ok(AxisSetup::new(Limits::new(8000, 400_000).unwrap(), 80_000)));
        for (text, want) in [
            ("X", "a colon"),
            ("A:speed=1", "\"A\" is not an axis"),
            ("X:feed=1", "\"feed\": steps-per-mm, speed"),
            ("X:speed", "is not a setting"),
            ("X:speed=0", "above 0"),
            ("X:steps-per-mm=20000", "0.001 to 10000"),
        ] {
            let error = text.parse::<Setup>().unwrap_err();
            assert!(error.contains(want), "{text}: {error}");
        }
    }
}
