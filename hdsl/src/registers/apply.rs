//! Updates the registers from the data of an H-frame.

use super::{Event, EventS, Interrupts, Online1, Online2, OnlineD, Register, RegisterRule, Registers};
use crate::encoder_id::PositionBits;
use crate::error::Error;
use crate::fast::FastPosition;
use crate::master::{HFrame, State};
use crate::message::LongAnswer;
use crate::position::PositionTracker;
use crate::vframe::{SafeBlock, VFrame};

/// The events of the drive whose bits are in the same places as their status.
const STATUS_EVENTS: u16 = OnlineD::POS.bits() | OnlineD::QMLW.bits();

impl Registers {
    /// Takes the data of an H-frame; returns the interrupt lines that are then active.
    pub fn apply(&mut self, h_frame: &HFrame) -> Interrupts {
        if h_frame.restarted.is_some() {
            self.messages(h_frame);
            self.restart();
            return self.masked_events();
        }
        let mut news = Interrupts::empty();
        let before = core::mem::replace(&mut self.v_frame, h_frame.v_frame);
        if let Some(frame) = &before {
            news = match self.dialect.registers {
                RegisterRule::Sick => self.v_frame(frame),
                RegisterRule::Ti => self.v_frame_ti(frame),
            };
        }
        self.positions(h_frame);
        self.numbers(h_frame);
        self.messages(h_frame);
        self.status(h_frame);
        if h_frame.state == State::Running {
            // The sampling instant's frame is over; safe positions come once a V-frame.
            self.put(Register::PosTx, [if before.is_some() { 3 } else { 2 }]);
            news.insert(Interrupts::H_FRAME);
        }
        news | self.masked_events()
    }

    /// Sets POSTX to 0, because the head of the next H-frame is on the line.
    ///
    /// ```
    /// use hdsl::Dialect;
    /// use hdsl::registers::{Register, Registers};
    /// let mut memory = [0; Registers::LEN];
    /// // The safe positions of a V-frame are there.
    /// memory[0x4e] = 3;
    /// let mut map = Registers::from_bytes(&Dialect::SICK, memory);
    /// map.request_sent();
    /// assert_eq!(map.get(Register::PosTx), [0]);
    /// ```
    pub fn request_sent(&mut self) {
        self.put(Register::PosTx, [0]);
    }

    /// Sets the map as it is when the link restarts.
    pub(super) fn restart(&mut self) {
        for status in [Register::OnlineStatusD, Register::OnlineStatus1, Register::OnlineStatus2] {
            self.put(status, [0x11, 0x04]);
        }
        self.put(Register::MasterQm, [0]);
        self.put(Register::AccErrCnt, [0]);
        self.put(Register::Pos, [0; 5]);
        self.put(Register::Vel, [0; 3]);
        self.put(Register::SlaveRegCtrl, [0x3f]);
        self.put(Register::PcCtrl, [0]);
        self.put(Register::SysCtrl, [0]);
        self.put(Register::SafeCtrl, [0]);
        self.put(Register::PosTx, [0]);
        self.pipe = super::PipeFifo::new();
        self.tracker = PositionTracker::new(PositionBits::MAX);
        (self.fast, self.v_frame, self.last_safe) = (None, None, Some(0));
        self.raise(Event::PRST | Event::QMLW);
        self.raise_s(EventS::PRST | EventS::QMLW);
    }

    fn raise(&mut self, events: Event) {
        self.put(Register::EventH, (self.event() | events).bits().to_be_bytes());
    }

    fn raise_s(&mut self, events: EventS) {
        self.put(Register::EventS, [(self.event_s() | events).bits()]);
    }

    /// Updates POS and VEL by the rule of the dialect, and whether they may be used.
    fn positions(&mut self, h_frame: &HFrame) {
        if let Some((id, bits)) = h_frame.encoder.and_then(|id| Some((id, id.check().ok()?))) {
            self.tracker = PositionTracker::with_rule(bits, self.dialect.position);
            if self.dialect.doubt_at_lock {
                self.tracker.doubt();
            }
            self.fast = Some(FastPosition::start(id, bits));
        }
        if h_frame.was != State::Running {
            return;
        }
        if h_frame.gap {
            self.interrupt();
        }
        self.tracker.step(h_frame.acceleration);
        // What the alignment changes is shown with the next frame.
        let shown = self.tracker.registers();
        self.put40(Register::Pos, shown.pos);
        let [_, velocity @ ..] = shown.vel.to_be_bytes();
        self.put::<3>(Register::Vel, velocity);
        let position = h_frame.v_frame.map(|frame| frame.safe1.vpos());
        if let Some(fast) = &mut self.fast {
            fast.step(h_frame.acceleration);
            if let Some(position) = position {
                fast.align(position.ok());
            }
        }
        let safe = match position {
            None => return,
            Some(Ok(position)) => {
                self.last_safe = Some(position);
                Some(position)
            }
            Some(Err(Error::PositionInvalid { .. })) => {
                self.last_safe = None;
                None
            }
            Some(Err(_)) if self.dialect.stale_position => self.last_safe,
            Some(Err(_)) => None,
        };
        match safe {
            Some(position) => self.tracker.align(position),
            None => self.tracker.no_safe_position(),
        }
    }

    /// Handles unheard frames: the position shown may be wrong until it is aligned again.
    #[cold]
    fn interrupt(&mut self) {
        self.tracker.no_safe_position();
        if let Some(fast) = &mut self.fast {
            fast.interrupt();
        }
    }

    /// Updates the registers that show values unchanged.
    fn numbers(&mut self, h_frame: &HFrame) {
        if let Some(id) = h_frame.encoder {
            let [_, high, middle, low] = id.get().to_be_bytes();
            self.put(Register::EncId, [high << 4 | high, middle, low]);
        }
        let linked = h_frame.state > State::IdReq;
        self.put(Register::MasterQm, [if linked { 0x80 | h_frame.quality } else { 0 }]);
        if let Some(signal) = h_frame.signal {
            self.put(Register::Edges, [signal.edges, signal.rssi.get() << 4 | signal.delay.get()]);
        }
        if h_frame.was != State::Running {
            return;
        }
        let most = if self.dialect.registers == RegisterRule::Sick { 31 } else { 255 };
        let errors = u8::try_from(h_frame.acceleration_errors.min(most)).unwrap_or(u8::MAX);
        self.put(Register::AccErrCnt, [errors]);
        if let Some(word) = h_frame.pipe {
            match self.dialect.registers {
                RegisterRule::Sick => self.pipe.put(word),
                RegisterRule::Ti => self.put(Register::PipeD, [word.raw()]),
            }
        }
    }

    /// Updates the online status and the events that belong to it.
    fn status(&mut self, h_frame: &HFrame) {
        let (before, mut d) = (self.online_d(), self.online_d());
        let [mut one, mut two] = [self.online_1().bits(), self.online_2().bits()];
        let was_free = one & Online1::FRES.bits() != 0;
        let low = h_frame.quality < crate::quality::QualityMonitor::LOW;
        for (flag, on) in [
            (OnlineD::PRST, h_frame.state <= State::Check),
            (OnlineD::POS, h_frame.state == State::Running && self.tracker.registers().pos_flag),
            (OnlineD::QMLW, low),
            (OnlineD::MIN, h_frame.init),
            (OnlineD::FREL, h_frame.long_free),
        ] {
            d.set(flag, on);
        }
        // These three have the same places in all, and QMLW, PRST in channel 2.
        let common = (OnlineD::PRST | OnlineD::QMLW | OnlineD::MIN).bits();
        one = one & !common & !Online1::FRES.bits() | d.bits() & common | u16::from(h_frame.short_free);
        let common = (OnlineD::PRST | OnlineD::QMLW).bits();
        two = two & !common | d.bits() & common;
        self.put(Register::OnlineStatus1, one.to_be_bytes());
        self.put(Register::OnlineStatus2, two.to_be_bytes());
        // Messages that a restart has dropped do not come here.
        match &h_frame.finished.long {
            Some(Ok(_)) => d.remove(OnlineD::ANS),
            Some(Err(_)) => d.insert(OnlineD::ANS),
            None => {}
        }
        self.put(Register::OnlineStatusD, d.bits().to_be_bytes());

        let arisen = match self.dialect.registers {
            RegisterRule::Sick => d.difference(before),
            RegisterRule::Ti => d,
        };
        let mut events = Event::from_bits_retain(arisen.bits() & STATUS_EVENTS);
        events.set(Event::MIN, h_frame.init);
        events.set(Event::FREL, d.difference(before).contains(OnlineD::FREL) || h_frame.finished.long.is_some());
        events.set(Event::ANS, matches!(h_frame.finished.long, Some(Err(_))));
        let mut safe = EventS::empty();
        safe.set(EventS::QMLW, arisen.contains(OnlineD::QMLW));
        safe.set(EventS::MIN, h_frame.init);
        // A message reset frees the channel too.
        safe.set(EventS::FRES, h_frame.short_free && !was_free || h_frame.finished.short.is_some());
        if !events.is_empty() {
            self.raise(events);
        }
        if !safe.is_empty() {
            self.raise_s(safe);
        }
    }

    /// Handles the ends of messages.
    fn messages(&mut self, h_frame: &HFrame) {
        if let Some(result) = &h_frame.finished.short {
            if let Ok(answer) = result {
                if let Some(data) = answer.data {
                    self.put(Register::SPcData, [data]);
                    if self.dialect.registers == RegisterRule::Sick {
                        self.put(Register::PcData, [data]);
                    }
                }
            }
            self.put(Register::SlaveRegCtrl, [0x3f]);
        }
        if let Some(result) = &h_frame.finished.long {
            if let Ok(answer) = result {
                self.long_answer(answer);
            }
            self.put(Register::PcCtrl, [0]);
        }
    }

    fn long_answer(&mut self, answer: &LongAnswer) {
        self.put(Register::PcAdd, answer.header());
        match (answer.result, self.dialect.registers) {
            (Ok(data), _) => self.put_buffer(data.as_bytes()),
            (Err(error), RegisterRule::Sick) => self.put_buffer(&[error.detail(), error.class_code()]),
            (Err(error), RegisterRule::Ti) => self.put_buffer(&[error.class_code(), error.detail()]),
        }
    }

    /// Sets the first bytes of PC_BUFFER; the others keep their value.
    pub(super) fn put_buffer(&mut self, bytes: &[u8]) {
        for (at, byte) in (Register::PcBuffer as u8..).zip(bytes) {
            self.set_byte(at, *byte);
        }
    }

    /// Updates both channels by the manual: each keeps its last valid block.
    fn v_frame(&mut self, frame: &VFrame) -> Interrupts {
        let VFrame { safe1, safe2 } = *frame;
        let mut one = self.online_1();
        let mut news = Interrupts::empty();
        let before = one;
        one.set(Online1::SCE, !safe1.is_sound());
        if safe1.is_sound() {
            let withheld = safe1.vpos().is_err();
            one.set(Online1::VPOS, withheld);
            self.summary(safe1.status(), &mut one);
            self.put40(Register::VPos, safe1.raw_vpos());
            self.put(Register::VPosCrc, safe1.raw_crc().to_be_bytes());
            news.set(Interrupts::VPOS, !withheld);
        }
        self.put(Register::OnlineStatus1, one.bits().to_be_bytes());
        let arisen = one.difference(before);
        let mut events = EventS::empty();
        events.set(EventS::SSUM, arisen.contains(Online1::SSUM));
        events.set(EventS::SCE, arisen.contains(Online1::SCE));
        events.set(EventS::VPOS, arisen.contains(Online1::VPOS));
        self.raise_s(events);

        let mut two = self.online_2();
        two.set(Online2::SCE2, !safe2.is_sound());
        if safe2.is_sound() {
            self.safe_2(safe2, &mut two);
            news.insert(Interrupts::VPOS2);
        }
        self.put(Register::OnlineStatus2, two.bits().to_be_bytes());
        news
    }

    /// Updates both channels as the firmware of the SDK shows them.
    fn v_frame_ti(&mut self, frame: &VFrame) -> Interrupts {
        let VFrame { safe1, safe2 } = *frame;
        let mut one = self.online_1();
        let mut news = Interrupts::empty();
        self.summary(safe1.status(), &mut one);
        self.put(Register::VPosCrc, safe1.raw_crc().to_be_bytes());
        match safe1.vpos() {
            Ok(position) => {
                self.put40(Register::VPos, position);
                one.remove(Online1::SCE | Online1::VPOS);
                news.insert(Interrupts::VPOS);
            }
            Err(Error::PositionInvalid { .. }) => {
                one.remove(Online1::SCE);
                one.insert(Online1::VPOS);
                self.raise_s(EventS::VPOS);
            }
            Err(Error::Crc { .. }) => {
                one.insert(Online1::SCE);
                self.raise_s(EventS::SCE);
            }
            // A block with a bad word leaves the flags as they are.
            Err(_) => {}
        }
        if one.contains(Online1::SSUM) {
            self.raise_s(EventS::SSUM);
        }
        self.put(Register::OnlineStatus1, one.bits().to_be_bytes());
        if safe1.is_sound() {
            let mut two = self.online_2();
            if !safe2.has_byte_error() {
                two.set(Online2::SCE2, !safe2.crc_ok());
            }
            self.safe_2(safe2, &mut two);
            self.put(Register::OnlineStatus2, two.bits().to_be_bytes());
            news.insert(Interrupts::VPOS2);
        }
        news
    }

    /// Updates SUMMARY, with its flags and the event SUM.
    fn summary(&mut self, summary: u8, one: &mut Online1) {
        let ([mask], [before]) = (self.get(Register::MaskSum), self.get(Register::SafeSum));
        let mut d = self.online_d();
        d.set(OnlineD::SUM, summary != 0);
        one.set(Online1::SSUM, summary != 0);
        self.put(Register::OnlineStatusD, d.bits().to_be_bytes());
        self.put(Register::SafeSum, [summary]);
        let known = self.dialect.registers == RegisterRule::Sick && before & mask != 0;
        if summary & mask != 0 && !known {
            self.raise(Event::SUM);
        }
    }

    fn safe_2(&mut self, safe2: SafeBlock, two: &mut Online2) {
        let status = safe2.status();
        self.put(Register::Status2, [status]);
        self.put40(Register::VPos2, safe2.raw_vpos());
        self.put(Register::VPosCrc2, safe2.raw_crc().to_be_bytes());
        two.set(Online2::SUM2, status & 0x60 != 0);
        two.set(Online2::VPOS2, matches!(safe2.vpos(), Err(Error::PositionInvalid { .. })));
    }
}
