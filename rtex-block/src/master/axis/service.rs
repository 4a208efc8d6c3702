//! Requests of an axis, in the main and in the sub block.

use super::Axis;
use super::asking::{Quiet, Slot};
use crate::control::ControlBits;
use crate::error_code::ErrorCode;
use crate::execution::Execution;
use crate::header::MacId;
use crate::master::echo::TURN;
use crate::master::handshake::Handshake;
use crate::master::profile_move::MoveStage;
use crate::master::progress::Progress;
use crate::master::servo_off::ActiveCode;
use crate::master::state::{AskError, StopReason};
use crate::master::sub_handshake::SubHandshake;
use crate::noncyclic_command::NonCyclicCommand;
use crate::noncyclic_response::NonCyclicResponse;
use crate::response::Response;
use crate::status::StatusFlags;
use crate::sub::{SubCode, SubCommand, SubResponse};
use crate::type_code::{Nibble, TypeCode, homing};

/// Whether the request is a reset, or a homing type that sets a position. With `unknown`, this includes the other homing types,
/// except the one that only reads.
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

/// The drive continues with the previous block, so this is not an answer: the request is in the next block again, and may
/// already be in progress.
fn is_thrown_away(response: &Response) -> bool {
    response.cmd_error && matches!(response.noncyclic(), NonCyclicResponse::CommandError(code) if code.discards_block())
}

/// Whether the drive generates the position command, or executes the command whose answer this is.
fn is_at_work(response: &Response) -> bool {
    let execution = response.noncyclic().execution().unwrap_or(Execution::empty());
    response.status.contains(StatusFlags::IN_PROGRESS) || execution.contains(Execution::BUSY)
}

impl Axis {
    /// Sends a non-cyclic command and holds it until it is answered; see [`take_outcome`](Self::take_outcome).
    ///
    /// Between two requests the normal command is sent until it has come back for a whole turn of the counter, so that an
    /// old block cannot be taken for the answer to the next request. Until then the axis is busy.
    ///
    /// A homing type that is not confirmed may set new coordinates. In CP the set-point would stay in the old
    /// ones, so such a type is refused there with the servo on; for latches use [`ask_latch`](Self::ask_latch).
    ///
    /// # Errors
    /// [`AskError`]; nothing is sent.
    pub fn ask(&mut self, request: NonCyclicCommand) -> Result<(), AskError> {
        let servo_off = needs_servo_off(&request, self.mode == ActiveCode::CyclicPosition);
        self.begin(self.handshake(request)?, servo_off)
    }

    /// Sends a homing command with which the drive moves the axis, in PP. The drive may be Busy for as long as it likes; a stop
    /// withdraws the command.
    pub(in crate::master) fn ask_homing(&mut self, request: NonCyclicCommand) -> Result<(), AskError> {
        self.begin(self.handshake(request)?.patient(), needs_servo_off(&request, false))
    }

    fn handshake(&self, request: NonCyclicCommand) -> Result<Handshake, AskError> {
        let (mac_id, limit) = (self.config.mac_id, self.config.limits.answer);
        Handshake::new(mac_id, self.mode.cyclic(), request, limit).ok_or(AskError::NotARequest)
    }

    /// Sends a homing command of the latch mode, in any mode and with the servo on or off. `type_code` arms the latches,
    /// disarms them or reads their state ([`homing::LATCH_STATE`]); it must be one that leaves the coordinates alone. The
    /// other arguments are Latch_Sel1, Latch_Sel2 and Monitor_Sel. SX-DSV02310, "Latch mode".
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
        self.begin(self.handshake(request)?, needs_servo_off(&request, false))
    }

    /// Reads the attributes of the present alarm, with the type code given in the drive's manual.
    /// The answer carries the alarm as its index and the attributes as its data; the manual also says which bit means that
    /// the alarm can be cleared ([`Attributes::is_clearable`](crate::master::procedure::Attributes::is_clearable)).
    ///
    /// # Errors
    /// [`AskError::Busy`]
    pub fn ask_alarm_attributes(&mut self, type_code: TypeCode) -> Result<(), AskError> {
        let (mac_id, limit): (MacId, u32) = (self.config.mac_id, self.config.limits.answer);
        let cyclic = ActiveCode::cyclic(self.mode);
        self.begin(Handshake::alarm_attributes(mac_id, cyclic, type_code, limit), false)
    }

    /// Sends a homing command in CV at speed 0 with the servo on, a state in which no position is commanded.
    pub(in crate::master) fn ask_rebasing(&mut self, request: NonCyclicCommand) -> Result<(), AskError> {
        let still = self.wire.mode == ActiveCode::CyclicVelocity && (self.wire.value, self.setpoint) == (0, 0);
        if self.mode != ActiveCode::CyclicVelocity || !still {
            return Err(AskError::ServoOn);
        }
        self.begin(self.handshake(request)?, false)
    }

    /// Returns whether a request can be sent now.
    pub fn can_ask(&self) -> bool {
        self.main.slot.asking().is_none() && self.main.quiet.is_kept() && !self.is_moving()
    }

    /// Number of update periods until the present request times out; the whole limit if none is pending.
    pub(in crate::master) const fn answer_left(&self) -> u32 {
        match self.main.slot.asking() {
            Some(handshake) => handshake.left(),
            None => self.config.limits.answer,
        }
    }

    /// Returns the outcome of the last request, once.
    pub const fn take_outcome(&mut self) -> Option<Progress<NonCyclicResponse>> {
        self.main.slot.take()
    }

    /// Sends a sub-command (32-byte mode) and holds it until it is answered; it runs in parallel with everything else.
    ///
    /// # Errors
    /// [`AskError::Busy`], or [`AskError::NotARequest`] for the normal sub-command.
    pub fn ask_sub(&mut self, code: SubCode, type_code: u8, index: u16) -> Result<(), AskError> {
        if self.sub.slot.asking().is_some() || !self.sub.quiet.is_kept() {
            return Err(AskError::Busy);
        }
        let handshake = SubHandshake::new(code, type_code, index, self.config.limits.answer);
        self.sub.slot = Slot::Asking(handshake.ok_or(AskError::NotARequest)?);
        Ok(())
    }

    /// Returns the outcome of the last sub-command, once.
    pub const fn take_sub_outcome(&mut self) -> Option<Progress<SubResponse>> {
        self.sub.slot.take()
    }

    fn begin(&mut self, handshake: Handshake, servo_off: bool) -> Result<(), AskError> {
        if !self.can_ask() {
            return Err(AskError::Busy);
        }
        let active = self.state.is_servo_on() || self.status().contains(StatusFlags::SERVO_ACTIVE);
        if active && servo_off {
            return Err(AskError::ServoOn);
        }
        (self.main.slot, self.main.needs_servo_off) = (Slot::Asking(handshake), servo_off);
        Ok(())
    }

    /// Handles requests and profile motion.
    pub(super) fn serve(&mut self, on_time: Option<&Response>) {
        let response = on_time.filter(|response| !is_thrown_away(response));
        if let Some(response) = response {
            self.main.quiet.hear(response.code.noncyclic_bits() == 0);
        }
        if self.is_moving() {
            self.serve_motion(response);
        }
        if let Slot::Asking(handshake) = &mut self.main.slot {
            let progress = handshake.receive(response);
            if !progress.is_pending() {
                (self.main.slot, self.main.quiet) = (Slot::Ended(progress), Quiet::BROKEN);
            }
        }
    }

    /// Like a request, a motion begins after a whole turn of the normal code.
    fn serve_motion(&mut self, response: Option<&Response>) {
        let Some(profile) = &mut self.profile else { return };
        if self.control.intersects(ControlBits::HARD_STOP.union(ControlBits::SMOOTH_STOP)) {
            profile.break_off(Some(StopReason::Requested), true, true);
        }
        // Old blocks tell neither the beginning nor the end, and Busy may fall before In_Progress rises.
        let moves = response.is_none_or(is_at_work);
        let counts = match profile.stage() {
            MoveStage::Preparing => self.main.quiet.is_kept(),
            MoveStage::Moving => moves || self.main.falls >= TURN,
            MoveStage::Starting | MoveStage::Ended => true,
        };
        if response.is_some() {
            let falls = !moves && profile.is_moving();
            self.main.falls = if falls { self.main.falls.saturating_add(1) } else { 0 };
        }
        let heard = response.filter(|_| counts);
        if !profile.receive(heard).is_pending() {
            self.main.quiet = Quiet::BROKEN;
        }
    }

    /// Handles the sub-command; it stays pending if the drive answers without a sub block.
    pub(super) fn serve_sub(&mut self, response: Option<&SubResponse>) {
        let response = response.filter(|sub| !sub.error_code().is_some_and(ErrorCode::discards_block));
        if let Some(response) = response {
            self.sub.quiet.hear(response.code.get() == 0);
        }
        if let Slot::Asking(handshake) = &mut self.sub.slot {
            let progress = handshake.receive(response);
            if !progress.is_pending() {
                (self.sub.slot, self.sub.quiet) = (Slot::Ended(progress), Quiet::BROKEN);
            }
        }
    }

    /// Bytes 8-15: the request, the motion, or the normal command with its feed-forward.
    pub(super) fn noncyclic(&self, feed_forward: i32) -> NonCyclicCommand {
        let command = match (self.main.slot.asking(), &self.profile) {
            (Some(handshake), _) => handshake.request(),
            (None, Some(profile)) => profile.request(),
            (None, None) => NonCyclicCommand::IDLE,
        };
        command.with_feed_forward(feed_forward)
    }

    /// Bytes 16-31, with Sub_Command_Data2 and 3.
    pub(super) fn sub_command(&self, [data2, data3]: [i32; 2]) -> SubCommand {
        let asked = match self.sub.slot.asking() {
            Some(handshake) => handshake.command(),
            None => SubCommand::IDLE,
        };
        SubCommand { data2, data3, ..asked }
    }
}
