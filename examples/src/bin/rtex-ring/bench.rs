//! The ring: a master, 32 modelled drives, and a line that can be cut.

use core::f64::consts::TAU;

use rtex_block::device::{Drive, DriveConfig, OpenCodes};
use rtex_block::master::{
    ActiveCode, Axis, AxisConfig, Limits, Received, Ring, SameMacId, SetpointError, Slave, StopReason,
};
use rtex_block::{Alarm, MacId, Response, TypeCode};

pub(crate) const AXES: usize = 32;
pub(crate) const UPDATE_NS: u32 = 500_000;

/// Update periods in which the master sends invalid data before the first valid commands.
const INVALID: u32 = 10;

/// Stroke of the motion, command units, and its period, update periods.
const STROKE: f64 = 100_000.0;
const PERIOD: f64 = 1_600.0;

/// Numbers that the documents at hand do not confirm; a model needs some.
const CODES: OpenCodes = OpenCodes {
    profile_absolute: 0x10,
    parameter_read: TypeCode::short(0x10),
    parameter_store: TypeCode::short(0x21),
    alarm_active: TypeCode::short(0x01),
    alarm_history: TypeCode::short(0x02),
    alarm_clear: TypeCode::short(0x03),
    alarm_attributes: TypeCode::short(0x76),
    parameter_initial: TypeCode::short(0x77),
    latch_arm: 0x78,
    homing: 0x79,
    communication_lost: Alarm { main: 80, sub: 0 },
};

/// The positions of all axes in one update period.
pub(crate) type Sample = (u64, [i32; AXES]);

pub(crate) struct Bench {
    pub(crate) ring: Ring<AXES>,
    pub(crate) now: u64,
    pub(crate) history: Vec<Sample>,
    drives: [Drive; AXES],
    silent: [bool; AXES],
    /// When each servo went off.
    off_at: [Option<u64>; AXES],
    responses: [Received; AXES],
}

/// Time of an update period.
pub(crate) fn time_ms(update: u64) -> f64 {
    update as f64 * f64::from(UPDATE_NS) / 1e6
}

fn mac_id(place: usize) -> MacId {
    u8::try_from(place).ok().and_then(MacId::new).unwrap_or_default()
}

impl Bench {
    pub(crate) fn new(mode: ActiveCode, limits: Limits) -> Result<Self, SameMacId> {
        let axis = |place| Axis::new(AxisConfig::new(mac_id(place), mode, UPDATE_NS, limits));
        // Drives do not get ready at the same moment.
        let drive = |place: usize| {
            let sync_exchanges = 20 + u16::try_from(place).unwrap_or(0) * 3;
            Drive::new(DriveConfig::new(mac_id(place), CODES).with_sync_exchanges(sync_exchanges))
        };
        Ok(Self {
            ring: Ring::new(core::array::from_fn(axis), INVALID)?,
            now: 0,
            history: Vec::new(),
            drives: core::array::from_fn(drive),
            silent: [false; AXES],
            off_at: [None; AXES],
            responses: [Received::Nothing; AXES],
        })
    }

    /// What the ring configuration finds.
    pub(crate) fn slaves(&self) -> impl Iterator<Item = Slave> {
        self.drives.iter().map(|drive| Slave { mac_id: drive.config().mac_id, kind: 1 })
    }

    /// One update period: the master reads and writes, then the frame goes round.
    pub(crate) fn update(&mut self) {
        let commands = self.ring.update(&self.responses);
        self.now += 1;
        for (place, drive) in self.drives.iter_mut().enumerate() {
            let was_active = drive.is_active();
            let silent = self.silent.get(place) == Some(&true);
            let received = match commands.get(place) {
                Some(command) if !silent => Response::parse(&drive.exchange(&command.main.emit())).into(),
                _ => {
                    drive.miss();
                    Received::Nothing
                }
            };
            if let Some(response) = self.responses.get_mut(place) {
                *response = received;
            }
            if let (true, false, Some(at)) = (was_active, drive.is_active(), self.off_at.get_mut(place)) {
                *at = Some(self.now);
            }
        }
        self.history.push((self.now, self.drives.each_ref().map(Drive::position)));
    }

    /// Updates until `done`, and says so.
    pub(crate) fn until(&mut self, what: &str, limit: u64, done: impl Fn(&Self) -> bool) -> Result<(), String> {
        let end = self.now + limit;
        while !done(self) {
            if self.now == end {
                return Err(format!("{what}: not reached after {limit} update periods, {:?}", self.ring.failure()));
            }
            self.update();
        }
        println!("{:9.1} ms  {what}", time_ms(self.now));
        Ok(())
    }

    /// A wave that runs along the axes: each does the same as its neighbour, a little later.
    pub(crate) fn command_wave(&mut self, begin: u64) -> Result<(), SetpointError> {
        let phase = (self.now - begin) as f64 / PERIOD;
        for (place, axis) in self.ring.axes_mut().iter_mut().enumerate() {
            let own = (phase - place as f64 / AXES as f64).max(0.0);
            axis.set_position((STROKE / 2.0 * (1.0 - (TAU * own).cos())).round() as i32)?;
        }
        Ok(())
    }

    /// Takes a drive off the ring.
    pub(crate) fn silence(&mut self, place: usize) {
        if let Some(silent) = self.silent.get_mut(place) {
            *silent = true;
        }
    }

    pub(crate) fn all_off(&self) -> bool {
        self.drives.iter().all(|drive| !drive.is_active())
    }

    /// Where every axis came to rest, and why.
    pub(crate) fn print_table(&self) {
        println!("\naxis   farthest    at rest   servo off  alarm     stopped by");
        for (place, drive) in self.drives.iter().enumerate() {
            let farthest = self.history.iter().filter_map(|(_, at)| at.get(place)).max().copied().unwrap_or(0);
            let off = self.off_at.get(place).copied().flatten().map_or(f64::NAN, time_ms);
            let alarm = drive.alarm().map_or("-".to_owned(), |alarm| alarm.to_string());
            let reason = match self.ring.axes().get(place).map(Axis::state) {
                Some(rtex_block::master::AxisState::Stopped(StopReason::OtherAxis(other))) => format!("axis {other}"),
                Some(state) => state.to_string(),
                None => String::new(),
            };
            println!("{place:4} {farthest:10} {:10} {off:8.1} ms  {alarm:8}  {reason}", drive.position());
        }
        println!();
    }
}
