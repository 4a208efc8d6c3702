//! The master's side of one drive.

mod asking;
mod service;
mod setpoint;
mod stop;
mod supervise;

use asking::{Main, Sub};

use super::config::{AxisConfig, StopCategory};
use super::counter::Turn;
use super::counters::Counters;
use super::echo::{Arrival, EchoWatch, TURN};
use super::heard::Heard;
use super::profile_move::ProfileMove;
use super::servo_off::{ActiveCode, ServoOff};
use super::state::{AxisState, SwitchOnError};
use crate::command::Command;
use crate::control::ControlBits;
use crate::error::Error;
use crate::evidence::Evidence;
use crate::position::{max_step, max_step_at, step};
use crate::response::Response;
use crate::status::StatusFlags;
use crate::sub::Command32;

/// The master's side of one drive: start-up, servo-on, set-points, requests, servo-off.
///
/// ```text
///  Starting ──Servo_Ready──► Off ──switch_on──► SwitchingOn ──Servo_Active──► On
///     ▲ not ready             │▲                                              │ switch_off
///     └───────────────────────┘└─────Servo_Active = 0──── SwitchingOff ◄──────┘
///  any ──alarm, time-out, not ready──► Stopped ──clear──► Starting
///  On ──stop of category 1 or 2──► Stopping ──stands──► Stopped, Held
/// ```
/// Call [`hear`](Self::hear) and then [`transmission`](Self::transmission) once in every update period. While the servo is off the
/// command position follows the actual position, and Servo_On first goes out in an update period that brought a position, so
/// switching on causes no jump. In every state but SwitchingOn, On, Stopping and Held the command is a [`ServoOff`]: Servo_On = 0 with a code that makes the drive evaluate it, whatever the
/// caller does. SX-DSV02310, "Servo_On"; any further waiting times of the vendor are not known.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Axis {
    config: AxisConfig,
    /// Largest step of the command position.
    max_step: u32,
    state: AxisState,
    /// Number of update periods left in the present state.
    left: u32,
    /// Category of the stop in progress.
    category: StopCategory,
    /// What the caller has requested: the mode, and the position, speed or torque in it.
    mode: ActiveCode,
    setpoint: i32,
    /// The content of the last block.
    wire: Wire,
    evidence: Evidence,
    watch: EchoWatch,
    arrival: Arrival,
    /// Number of update periods without an exchange before the last one.
    missed: u8,
    /// The low half of the end of the last update period, ns.
    heard_ns: u32,
    control: ControlBits,
    /// Command_Data3, Sub_Command_Data2 and 3.
    feed_forward: [i32; 3],
    counters: Counters,
    /// Why the last block was refused; `None` after a good one.
    last_refusal: Option<Error>,
    /// Number of consecutive responses with CMD_Error.
    refused: u16,
    /// Number of responses with Servo_Active = 1 since the servo was commanded off.
    active_off: u32,
    /// Number of consecutive responses on time with Servo_Active = 0 since the servo was last switched off; as many as are
    /// needed if it never was on.
    passive: u8,
    disobeys: bool,
    main: Main,
    sub: Sub,
    profile: Option<ProfileMove>,
}

/// The content of the last block, without later requests of the caller.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
struct Wire {
    mode: ActiveCode,
    /// Command_Data1.
    value: i32,
    /// In CP with the servo on, the step from the previous value to this one; otherwise, the distance that the motor has moved
    /// since the last block.
    step: i32,
    /// Servo_On.
    on: bool,
    /// Number of later blocks that were not sent.
    stands: u8,
}

/// What an axis has sent last, to go back to if its next block is not written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Sent(Wire);

/// Number of missed update periods after which a motor without a new command position is at rest; no more than these are
/// counted.
const MANY: u8 = 3;

impl Axis {
    /// Creates an axis whose drive has not answered yet.
    pub const fn new(config: AxisConfig) -> Self {
        let by_gear = max_step(config.update_ns, config.gear);
        let max_step = match config.over_speed {
            Some(level) => {
                let by_speed = max_step_at(level, config.update_ns);
                if by_speed < by_gear { by_speed } else { by_gear }
            }
            None => by_gear,
        };
        Self {
            config,
            max_step,
            state: AxisState::Starting,
            left: match config.limits.ready {
                Some(ready) => ready,
                None => 0,
            },
            category: StopCategory::Zero,
            mode: config.mode,
            setpoint: 0,
            wire: Wire { mode: config.mode, value: 0, step: 0, on: false, stands: 0 },
            evidence: Evidence::NEVER,
            watch: EchoWatch::new(config.limits.echo),
            arrival: Arrival::Missing,
            missed: 0,
            heard_ns: 0,
            control: ControlBits::empty(),
            feed_forward: [0; 3],
            counters: Counters::new(),
            last_refusal: None,
            refused: 0,
            active_off: 0,
            passive: u8::MAX,
            disobeys: false,
            main: Main::NONE,
            sub: Sub::NONE,
            profile: None,
        }
    }

    /// Returns its configuration.
    pub const fn config(&self) -> &AxisConfig {
        &self.config
    }

    /// The present state.
    pub const fn state(&self) -> AxisState {
        self.state
    }

    /// Returns whether the block of the last update period was on time, by its counter echo.
    pub const fn arrival(&self) -> Arrival {
        self.arrival
    }

    /// Returns what is known about the actual position (Response_Data1), speed and torque. Its instant is that of the last
    /// block on time, as passed to [`hear`](Self::hear). The first block after update periods without an exchange may have
    /// come in any of them, so it has the earliest instant: an update period after the block before.
    pub const fn evidence(&self) -> Evidence {
        let refused = match self.last_refusal {
            Some(error) => Some(error.class()),
            None => None,
        };
        let known = if self.watch.is_sure() { self.evidence } else { Evidence::NEVER };
        known.refused(refused)
    }

    /// Status_Flags of the last response on time.
    pub const fn status(&self) -> StatusFlags {
        self.evidence.status()
    }

    /// Returns the counts of good blocks of the drive and of refused blocks, by class.
    pub const fn counters(&self) -> &Counters {
        &self.counters
    }

    /// Returns whether Servo_Active was still 1 at the end of [`Limits::inactive`](super::Limits::inactive), with Servo_On
    /// = 0: remove the power by other means. Stays until [`clear`](Self::clear).
    pub const fn disobeys(&self) -> bool {
        self.disobeys
    }

    /// Checks whether the servo can be switched on: it is off, the drive is ready according to a block of this update
    /// period that is on time, and no request is pending that would change its position or its state. The command position
    /// then equals the actual one.
    ///
    /// # Errors
    /// [`SwitchOnError`]: the first reason why not.
    pub const fn can_switch_on(&self) -> Result<(), SwitchOnError> {
        let status = self.evidence.status();
        if !matches!(self.state, AxisState::Off) {
            Err(SwitchOnError::State(self.state))
        } else if !self.is_current() || !self.watch.is_sure() {
            Err(SwitchOnError::OldPosition)
        } else if status.contains(StatusFlags::ALARM) {
            Err(SwitchOnError::Alarm)
        } else if !status.contains(StatusFlags::SERVO_READY) {
            Err(SwitchOnError::NotReady)
        } else if self.passive <= TURN
            || self.main.needs_servo_off && (self.main.slot.asking().is_some() || !self.main.quiet.is_kept())
        {
            Err(SwitchOnError::Busy)
        } else {
            Ok(())
        }
    }

    /// Switches the servo on, from `Off`.
    ///
    /// # Errors
    /// [`SwitchOnError`]; nothing is changed.
    pub fn switch_on(&mut self) -> Result<(), SwitchOnError> {
        self.can_switch_on()?;
        self.passive = 0;
        self.enter(AxisState::SwitchingOn, self.config.limits.active);
        Ok(())
    }

    /// Takes the result of an update period, heard until `end_ns`: the drive's response to what was `sent`. No limit runs
    /// while invalid data are sent.
    pub fn hear(&mut self, sent: Turn, heard: &Heard, end_ns: u64) {
        let response = self.sound(heard);
        self.missed = self.missed(end_ns);
        let Turn::Valid(sent) = sent else {
            self.arrival = Arrival::Missing;
            if let Some(response) = response {
                // The counter stands still in invalid data, so nothing says when this is from.
                self.watch.note(response.update_counter_echo);
                self.evidence = Evidence::of(response, 0);
            }
            return self.rest();
        };
        let echo = response.map(|response| response.update_counter_echo);
        self.arrival = self.watch.judge(sent, echo, self.missed, !self.state.is_servo_on());
        let on_time = response.filter(|_| self.arrival == Arrival::OnTime);
        self.supervise(response, on_time);
        self.serve(on_time);
        self.serve_sub(on_time.and(heard.sub()));
        if let Some(response) = on_time {
            if self.wire.mode != ActiveCode::CyclicPosition {
                self.wire.step = step(self.evidence.last().position(), response.response_data1);
            }
            let known_ns = if self.missed == 0 { end_ns } else { self.first_ns() };
            self.evidence = Evidence::of(response, known_ns);
        } else if let Some(response) = response {
            self.evidence = self.evidence.alarmed(response.status);
        }
        match self.state {
            AxisState::On | AxisState::Held(_) => {}
            AxisState::Stopping(reason) => self.slow_down(reason),
            _ => self.rest(),
        }
    }

    /// Returns the block of this update period, which counts as sent; in the 16-byte mode only its `main` half is used.
    pub fn transmission(&mut self, turn: Turn) -> Command32 {
        let mac_id = self.config.mac_id;
        let counter = match turn {
            Turn::Invalid => return Command32 { main: Command::nop(mac_id), sub: self.sub_command([0; 2]) },
            Turn::Valid(counter) => counter,
        };
        let begins = self.wire.mode != ActiveCode::CyclicPosition && self.mode == ActiveCode::CyclicPosition;
        if begins && self.is_energised() {
            self.begin_positions();
        }
        let value = match &self.profile {
            Some(profile) if profile.progress().is_pending() => profile.target_position(),
            _ => self.setpoint,
        };
        let step = match self.wire.mode {
            ActiveCode::CyclicPosition if self.is_energised() => step(self.wire.value, value),
            ActiveCode::CyclicPosition => 0,
            _ if self.mode == ActiveCode::CyclicPosition => 0,
            _ => self.wire.step,
        };
        let on = match self.state {
            AxisState::SwitchingOn => self.wire.on || self.is_current(),
            state => state.is_servo_on(),
        };
        self.wire = Wire { mode: self.mode, value, step, on, stands: 0 };
        let off = *ServoOff::new(mac_id, counter, self.mode).command();
        let [data3, sub2, sub3] = self.feed_forward;
        let control = if on { self.control.union(self.servo_bits()) } else { self.control };
        let main = Command { control, command_data1: value, noncyclic: self.noncyclic(data3), ..off };
        Command32 { main, sub: self.sub_command([sub2, sub3]) }
    }

    /// Returns what was sent last, to be kept while the next block is written.
    pub const fn sent(&self) -> Sent {
        Sent(self.wire)
    }

    /// Takes back what was sent after `last`: it was not written, so the drive still has the block before. The next step, a
    /// stop, a change of the mode and Servo_On begin at that one. After three blocks in a row that were not written the command
    /// position has stopped.
    pub const fn not_sent(&mut self, last: Sent) {
        let Sent(wire) = last;
        let stands = wire.stands.saturating_add(1);
        let is_still = stands >= MANY && matches!(wire.mode, ActiveCode::CyclicPosition);
        self.wire = Wire { stands, step: if is_still { 0 } else { wire.step }, ..wire };
    }

    /// Returns when the first block after the last one on time can have come.
    #[cold]
    fn first_ns(&self) -> u64 {
        self.evidence.last().sampled_ns().saturating_add(self.config.update_ns.into())
    }

    /// Whether the last update period brought a position that is known to be from that period.
    pub(super) const fn is_current(&self) -> bool {
        matches!(self.arrival, Arrival::OnTime) && self.missed == 0
    }

    /// Returns the number of update periods without an exchange since the last one, by the clock; at most three, because
    /// the counter goes no further. Whether the gap was longer than four seconds does not matter: by then no block is on time,
    /// or none has been for a long time.
    #[expect(clippy::cast_possible_truncation, reason = "the difference counts")]
    fn missed(&mut self, end_ns: u64) -> u8 {
        let gap_ns = (end_ns as u32).wrapping_sub(self.heard_ns);
        self.heard_ns = end_ns as u32;
        let most_ns = self.config.update_ns.saturating_add(self.config.update_ns >> 1);
        if gap_ns <= most_ns { 0 } else { self.after_gap(gap_ns.wrapping_sub(most_ns)) }
    }

    /// Takes note of a gap between two exchanges that is `over_ns` longer than the longest one between neighbouring exchanges.
    #[cold]
    fn after_gap(&mut self, over_ns: u32) -> u8 {
        let missed = periods(over_ns, self.config.update_ns);
        if missed >= MANY && self.wire.mode == ActiveCode::CyclicPosition {
            // The command position has stood still on the wire, and so does the motor by now.
            self.wire.step = 0;
        }
        missed
    }

    /// Returns the response, if it is sound and comes from this drive; every block is counted.
    fn sound<'a>(&mut self, heard: &'a Heard) -> Option<&'a Response> {
        let outcome = match (heard, heard.response()) {
            (Heard::Refused(error), _) => Err(*error),
            (_, Some(response)) if response.mac_id == self.config.mac_id => Ok(response),
            (_, Some(response)) => Err(Error::MacId { got: response.mac_id.get(), want: self.config.mac_id.get() }),
            (_, None) => return None,
        };
        self.counters.record(&outcome);
        self.last_refusal = outcome.err();
        outcome.ok()
    }
}

/// Returns the number of whole and started update periods in this time, at most three.
fn periods(over_ns: u32, update_ns: u32) -> u8 {
    let more = over_ns.saturating_sub(1).checked_div(update_ns).unwrap_or(2).min(2);
    u8::try_from(more).unwrap_or(2).saturating_add(1)
}
