//! Requests of an axis, in the main and in the sub block.

use super::Axis;
use crate::error_code::ErrorCode;
use crate::header::MacId;
use crate::master::handshake::Handshake;
use crate::master::progress::Progress;
use crate::master::servo_off::ActiveCode;
use crate::master::state::AskError;
use crate::master::sub_handshake::SubHandshake;
use crate::noncyclic_command::NonCyclicCommand;
use crate::noncyclic_response::NonCyclicResponse;
use crate::response::Response;
use crate::status::StatusFlags;
use crate::sub::{SubCode, SubCommand, SubResponse};
use crate::type_code::{Nibble, TypeCode, homing};

/// A request on its way.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub(super) enum Service {
    Idle,
    Asking {
        handshake: Handshake,
        /// It must be over before the servo is switched on.
        servo_off: bool,
    },
    /// The outcome is known; the normal command is out until its echo is seen.
    Releasing {
        left: u32,
    },
}

/// The same for the sub block.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub(super) enum SubService {
    Idle,
    Asking(SubHandshake),
    Releasing { left: u32 },
}

impl Service {
    /// What is asked at present.
    pub(super) const fn request(&self) -> Option<NonCyclicCommand> {
        match self {
            Self::Asking { handshake, .. } => Some(handshake.request()),
            Self::Idle | Self::Releasing { .. } => None,
        }
    }

    pub(super) const fn is_busy(&self) -> bool {
        !matches!(self, Self::Idle)
    }

    /// Whether what is asked must be over before the servo is switched on.
    pub(super) const fn needs_servo_off(&self) -> bool {
        matches!(self, Self::Asking { servo_off: true, .. })
    }
}

/// Resets, and the homing types that set a position. `unknown`: the other homing types too, but for the one that reads.
const fn needs_servo_off(request: &NonCyclicCommand, unknown: bool) -> bool {
    match request {
        NonCyclicCommand::Reset(_) => true,
        NonCyclicCommand::Homing { type_code, .. } => match *type_code {
            homing::SET_ACTUAL_POSITION | homing::SET_COMMAND_POSITION => true,
            homing::LATCH_STATE => false,
            _ => unknown,
        },
        _ => false,
    }
}

/// The drive goes on with the block before, so this is no answer: the request is in the next block again, and may be under way
/// already.
fn is_thrown_away(response: &Response) -> bool {
    matches!(response.noncyclic(), NonCyclicResponse::CommandError(code) if code.discards_block())
}

impl Axis {
    /// Sends a non-cyclic command and holds it until it is answered; see [`take_outcome`](Self::take_outcome).
    ///
    /// In between the normal command goes out, until its echo is seen or the time for an answer is over. Where the echo was not
    /// seen, the drive may not have noticed that there is a new request: its answers do not count until it was, and the
    /// request times out.
    ///
    /// A homing type other than those that are confirmed may give the axis new coordinates. In CP the set-point would stay in
    /// the old ones, so with the servo on it is refused there; latches have [`ask_latch`](Self::ask_latch).
    ///
    /// # Errors
    /// [`AskError`]; nothing is sent then.
    pub fn ask(&mut self, request: NonCyclicCommand) -> Result<(), AskError> {
        let handshake = Handshake::new(self.config.mac_id, self.mode.cyclic(), request, self.config.limits.answer);
        let servo_off = needs_servo_off(&request, self.mode == ActiveCode::CyclicPosition);
        self.begin(handshake.ok_or(AskError::NotARequest)?, servo_off)
    }

    /// Sends a homing command of the latch mode, in any mode and with the servo on or off. `type_code` arms the latches, or
    /// disarms them, or reads their state ([`homing::LATCH_STATE`]); it must be one that leaves the coordinates alone. Then
    /// follow Latch_Sel1, Latch_Sel2 and Monitor_Sel. SX-DSV02310, "Latch mode".
    ///
    /// # Errors
    /// [`AskError::Busy`]; [`AskError::ServoOn`] for the types 21h and 22h, which set a position.
    pub fn ask_latch(
        &mut self,
        type_code: u8,
        [latch_sel1, latch_sel2]: [Nibble; 2],
        monitor_sel: u8,
    ) -> Result<(), AskError> {
        let request = NonCyclicCommand::Homing { type_code, latch_sel1, latch_sel2, monitor_sel, setting_data: 0 };
        let handshake = Handshake::new(self.config.mac_id, self.mode.cyclic(), request, self.config.limits.answer);
        self.begin(handshake.ok_or(AskError::NotARequest)?, needs_servo_off(&request, false))
    }

    /// Reads the attributes of the alarm that is being issued, with the type code that the drive's manual gives for them.
    /// The answer carries the alarm as its index and the attributes as its data; which bit tells that the alarm can be
    /// cleared is in the manual too ([`Attributes::is_clearable`](crate::master::procedure::Attributes::is_clearable)).
    ///
    /// # Errors
    /// [`AskError::Busy`]
    pub fn ask_alarm_attributes(&mut self, type_code: TypeCode) -> Result<(), AskError> {
        let (mac_id, limit): (MacId, u32) = (self.config.mac_id, self.config.limits.answer);
        let cyclic = ActiveCode::cyclic(self.mode);
        self.begin(Handshake::alarm_attributes(mac_id, cyclic, type_code, limit), false)
    }

    /// Whether a request can be sent now.
    pub fn can_ask(&self) -> bool {
        !self.service.is_busy() && !self.is_moving()
    }

    /// Update periods until the present request times out; the whole limit if none is under way.
    pub(in crate::master) const fn answer_left(&self) -> u32 {
        match &self.service {
            Service::Asking { handshake, .. } => handshake.left(),
            Service::Idle | Service::Releasing { .. } => self.config.limits.answer,
        }
    }

    /// The outcome of the last request, once.
    pub const fn take_outcome(&mut self) -> Option<Progress<NonCyclicResponse>> {
        self.outcome.take()
    }

    /// Sends a sub-command (32-byte mode) and holds it until it is answered; it runs beside everything else.
    ///
    /// # Errors
    /// [`AskError::Busy`], or [`AskError::NotARequest`] for the normal sub-command.
    pub fn ask_sub(&mut self, code: SubCode, type_code: u8, index: u16) -> Result<(), AskError> {
        if self.sub != SubService::Idle {
            return Err(AskError::Busy);
        }
        let handshake = SubHandshake::new(code, type_code, index, self.config.limits.answer);
        self.sub = SubService::Asking(handshake.ok_or(AskError::NotARequest)?);
        self.sub_outcome = None;
        Ok(())
    }

    /// The outcome of the last sub-command, once.
    pub const fn take_sub_outcome(&mut self) -> Option<Progress<SubResponse>> {
        self.sub_outcome.take()
    }

    fn begin(&mut self, handshake: Handshake, servo_off: bool) -> Result<(), AskError> {
        if !self.can_ask() {
            return Err(AskError::Busy);
        }
        let active = self.state.is_servo_on() || self.status().contains(StatusFlags::SERVO_ACTIVE);
        if active && servo_off {
            return Err(AskError::ServoOn);
        }
        self.service = Service::Asking { handshake, servo_off };
        self.outcome = None;
        Ok(())
    }

    /// Requests and profile motion.
    pub(super) fn serve(&mut self, response: Option<&Response>) {
        let response = response.filter(|response| !is_thrown_away(response));
        if let Some(profile) = &mut self.profile {
            let _ = profile.receive(response);
        }
        let released = response.is_some_and(|r| r.code.noncyclic_bits() == 0);
        self.unreleased &= !released;
        // Echoes tell requests of one kind apart by their index, and not by their data.
        let heard = response.filter(|_| !self.unreleased);
        match &mut self.service {
            Service::Idle => {}
            Service::Asking { handshake, .. } => {
                let progress = handshake.receive(heard);
                if !progress.is_pending() {
                    self.outcome = Some(progress);
                    self.service = Service::Releasing { left: self.config.limits.answer };
                }
            }
            Service::Releasing { left } => match left.checked_sub(1) {
                Some(less) if !released => *left = less,
                _ => {
                    self.unreleased = !released;
                    self.service = Service::Idle;
                }
            },
        }
    }

    /// The sub-command; a drive that answers without sub block leaves it pending.
    pub(super) fn serve_sub(&mut self, response: Option<&SubResponse>) {
        let response = response.filter(|sub| !sub.error_code().is_some_and(ErrorCode::discards_block));
        let released = response.is_some_and(|r| r.code.get() == 0);
        self.sub_unreleased &= !released;
        let heard = response.filter(|_| !self.sub_unreleased);
        match &mut self.sub {
            SubService::Idle => {}
            SubService::Asking(handshake) => {
                let progress = handshake.receive(heard);
                if !progress.is_pending() {
                    self.sub_outcome = Some(progress);
                    self.sub = SubService::Releasing { left: self.config.limits.answer };
                }
            }
            SubService::Releasing { left } => match left.checked_sub(1) {
                Some(less) if !released => *left = less,
                _ => {
                    self.sub_unreleased = !released;
                    self.sub = SubService::Idle;
                }
            },
        }
    }

    /// Bytes 16-31, with Sub_Command_Data2 and 3.
    pub(super) fn sub_command(&self, [data2, data3]: [i32; 2]) -> SubCommand {
        let asked = match &self.sub {
            SubService::Asking(handshake) => handshake.command(),
            SubService::Idle | SubService::Releasing { .. } => SubCommand::IDLE,
        };
        SubCommand { data2, data3, ..asked }
    }
}
