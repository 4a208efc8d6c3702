//! The ring: a master, 32 modelled drives, and the memory of the ASIC between them.

use core::f64::consts::TAU;

use rtex_block::device::{Drive, DriveConfig, Fault, OpenCodes};
use rtex_block::master::{
    ActiveCode, Asic, Axis, AxisConfig, AxisState, Limits, Master, MasterConfig, SetpointError, SetupError, Slave,
    StopReason,
};
use rtex_block::pack::SizeMismatch;
use rtex_block::timing::{Periods, TimerSystem};
use rtex_block::{BlockSize, MacId, pack};

pub(crate) const AXES: usize = 32;

/// 32-bit words of a block of 16 bytes.
const WORDS: usize = 4;

/// Stroke of the motion, command units, and its period, update periods.
const STROKE: f64 = 100_000.0;
const PERIOD: f64 = 1_600.0;

/// When the ASIC gets to each of its states, ms.
pub(crate) const ASIC: [(u64, Asic); 4] =
    [(20, Asic::Initial), (140, Asic::RingConfig), (1_300, Asic::Ready), (2_100, Asic::Running)];

/// Kinds of drives; the vendor's numbers are not published.
const ROTARY: u16 = 1;
const LINEAR: u16 = 2;

/// The slave table of the machine, as its drawing lists the drives along the ring.
fn slave_table() -> [Slave; AXES] {
    core::array::from_fn(|place| Slave { mac_id: mac_id(place), kind: if place < 24 { ROTARY } else { LINEAR } })
}

/// A drive as it was fitted: what its switches say, and what it is.
struct Fitted {
    drive: Drive,
    kind: u16,
    /// When its servo went off.
    off_at: Option<u64>,
}

/// The positions of all axes at a time, ms.
pub(crate) type Sample = (f64, [i32; AXES]);

pub(crate) struct Bench {
    pub(crate) master: Master<AXES>,
    pub(crate) history: Vec<Sample>,
    /// Update periods since PH_RUNNING.
    pub(crate) now: u64,
    periods: Periods,
    drives: Vec<Fitted>,
    /// Transmission and reception memory of the ASIC.
    tx: [u32; AXES * WORDS],
    rx: [u32; AXES * WORDS],
}

fn mac_id(place: usize) -> MacId {
    u8::try_from(place).ok().and_then(MacId::new).unwrap_or_default()
}

impl Bench {
    /// `swapped`: two drives stand in each other's place.
    pub(crate) fn new(periods: Periods, limits: Limits, swapped: bool) -> Result<Self, SetupError> {
        let config = MasterConfig::new(BlockSize::Bytes16, periods, TimerSystem::Internal).with_invalid(10);
        let axis =
            |place| Axis::new(AxisConfig::new(mac_id(place), ActiveCode::CyclicPosition, periods.update_ns, limits));
        let mut drives: Vec<Fitted> = (0_u16..)
            .zip(core::iter::repeat_n(ROTARY, 24).chain(core::iter::repeat_n(LINEAR, 8)))
            .map(|(switches, kind)| {
                // Drives do not get ready at the same moment.
                let config = DriveConfig::new(mac_id(switches.into()), OpenCodes::INVENTED)
                    .with_sync_exchanges(20 + switches * 3);
                Fitted { drive: Drive::new(config), kind, off_at: None }
            })
            .collect();
        if swapped {
            drives.swap(3, 4);
        }
        Ok(Self {
            master: Master::new(config, slave_table(), core::array::from_fn(axis))?,
            history: Vec::new(),
            now: 0,
            periods,
            drives,
            tx: [0; AXES * WORDS],
            rx: [0; AXES * WORDS],
        })
    }

    /// What the ring configuration finds.
    pub(crate) fn found(&self) -> Vec<Slave> {
        self.drives.iter().map(|fitted| Slave { mac_id: fitted.drive.config().mac_id, kind: fitted.kind }).collect()
    }

    /// Time since the start of the program: the update periods begin when the ASIC is RUNNING.
    pub(crate) fn time_ms(&self, update: u64) -> f64 {
        let [.., (running, _)] = ASIC;
        running as f64 + update as f64 * f64::from(self.periods.update_ns) / 1e6
    }

    /// The NC interrupt: reads the reception memory and writes the transmission memory.
    pub(crate) fn exchange(&mut self) -> Result<(), SizeMismatch> {
        self.master.exchange_words(&self.rx, &mut self.tx, self.now * u64::from(self.periods.update_ns))
    }

    /// An update period: the exchange, then the frame goes round. What a silent drive has said last stays in the memory.
    pub(crate) fn update(&mut self) -> Result<(), SizeMismatch> {
        self.exchange()?;
        self.now += 1;
        for (fitted, (tx, rx)) in
            self.drives.iter_mut().zip(self.tx.chunks_exact(WORDS).zip(self.rx.chunks_exact_mut(WORDS)))
        {
            let was_active = fitted.drive.is_active();
            let mut block = [0; 16];
            pack::from_words(tx, &mut block)?;
            if let Some(response) = fitted.drive.hear(&block) {
                pack::to_words(&response, rx)?;
            }
            if was_active && !fitted.drive.is_active() {
                fitted.off_at = Some(self.now);
            }
        }
        let mut positions = [0; AXES];
        for (position, fitted) in positions.iter_mut().zip(&self.drives) {
            *position = fitted.drive.position();
        }
        self.history.push((self.time_ms(self.now), positions));
        Ok(())
    }

    /// A wave that runs along the axes: each does the same as its neighbour, a little later.
    pub(crate) fn command_wave(&mut self, begin: u64) -> Result<(), SetpointError> {
        let phase = (self.now - begin) as f64 / PERIOD;
        for (place, axis) in self.master.ring_mut().axes_mut().iter_mut().enumerate() {
            let own = (phase - place as f64 / AXES as f64).max(0.0);
            axis.set_position((STROKE / 2.0 * (1.0 - (TAU * own).cos())).round() as i32)?;
        }
        Ok(())
    }

    /// Takes a drive off the ring.
    pub(crate) fn silence(&mut self, place: usize) {
        if let Some(fitted) = self.drives.get_mut(place) {
            fitted.drive.set_fault(Fault::Silent);
        }
    }

    pub(crate) fn all_off(&self) -> bool {
        self.drives.iter().all(|fitted| !fitted.drive.is_active())
    }

    /// Where every axis came to rest, and why.
    pub(crate) fn print_table(&self) {
        println!("\naxis   farthest    at rest   servo off  alarm     stopped by");
        for (place, fitted) in self.drives.iter().enumerate() {
            let farthest = self.history.iter().filter_map(|(_, at)| at.get(place)).max().copied().unwrap_or(0);
            let off = fitted.off_at.map_or(f64::NAN, |at| self.time_ms(at));
            let alarm = fitted.drive.alarm().map_or("-".to_owned(), |alarm| alarm.to_string());
            let reason = match self.master.ring().axes().get(place).map(Axis::state) {
                Some(AxisState::Stopped(StopReason::OtherAxis { place: other })) => format!("axis {other}"),
                Some(state) => state.to_string(),
                None => String::new(),
            };
            println!("{place:4} {farthest:10} {:10} {off:8.1} ms  {alarm:8}  {reason}", fitted.drive.position());
        }
        println!();
    }
}
