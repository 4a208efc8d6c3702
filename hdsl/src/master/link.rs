//! The running link: what is done with every answer and every V-frame.

use super::{Cause, Master};
use crate::message::{Finished, ShortAnswer};
use crate::registers::{Event, EventS, Interrupts, Online1, Online2, OnlineD, Register};
use crate::symbol::{Control, Reading};
use crate::{
    Answer, EncoderByte, EncoderSymbol, Error, Phase, PositionBits, PositionTracker, Profile, QualityEvent,
    QualityMonitor, QualityRule, SafeBlock, VFrame,
};

/// What belongs to one link between its lock and its loss.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub(super) struct Link {
    quality: QualityMonitor,
    tracker: PositionTracker,
    vframe: VFrame,
    /// Place in the V-frame, 0..=7.
    at: u8,
    msync: bool,
    /// At least one V-frame is complete: messages may be sent.
    settled: bool,
    /// A V-frame whose results are shown one frame later.
    pending: Option<VFrame>,
    /// The last good safe position, or none because the encoder had none.
    last_safe: Option<u64>,
    /// The penalty for a bad word in the secondary channel was given in this V-frame.
    secondary_counted: bool,
    news: Interrupts,
}

impl Link {
    pub(super) fn new(profile: &Profile, bits: PositionBits) -> Self {
        let mut tracker = PositionTracker::with_rule(bits, profile.position);
        if profile.doubt_at_lock {
            tracker.doubt();
        }
        Self {
            quality: QualityMonitor::new(profile.quality),
            tracker,
            vframe: VFrame::default(),
            at: 0,
            msync: true,
            settled: false,
            pending: None,
            last_safe: Some(0),
            secondary_counted: false,
            news: Interrupts::default(),
        }
    }

    pub(super) const fn at(&self) -> u8 {
        self.at
    }

    pub(super) const fn msync(&self) -> bool {
        self.msync
    }

    pub(super) const fn is_settled(&self) -> bool {
        self.settled
    }

    pub(super) const fn phase(&self) -> Phase {
        self.tracker.phase()
    }

    /// New safe positions, for the interrupts.
    pub(super) const fn news(&self) -> Interrupts {
        self.news
    }
}

impl Master {
    /// One H-frame of RX0..RX7.
    pub(super) fn run(&mut self, samples: &[u8], finished: &mut Finished) -> Result<(), Cause> {
        let answer = Answer::from_bits(self.bits(samples), self.profile.rule);
        self.link.news = Interrupts::default();
        self.show_delay(samples);
        self.show_v_frame();
        self.link.vframe.put(self.link.at, answer, self.profile.rule);
        self.count_words(answer);
        self.take_symbol(answer, finished);
        self.take_acceleration(answer);
        self.count_vsync(answer);
        if self.link.at == 7 {
            self.end_v_frame();
        }
        self.link.at = self.link.at.wrapping_add(1) & 7;
        self.show_quality();
        if self.link.quality.is_lost() {
            return Err(Cause::Quality);
        }
        let [threshold] = self.registers.get(Register::AccErrCntThresh);
        if self.profile.restart_on_acceleration_errors && self.link.tracker.errors() >= u32::from(threshold) {
            return Err(Cause::AccelerationErrors);
        }
        Ok(())
    }

    /// Bad words and special characters without a meaning.
    fn count_words(&mut self, answer: Answer) {
        let quality = &mut self.link.quality;
        let mut unknown = |word: Reading, known: Option<Control>| {
            if word.is_special() && !word.is_byte_error() && known.is_none_or(|known| word.raw() != known as u8) {
                quality.count(QualityEvent::UnknownSpecial);
            }
        };
        unknown(answer.vertical(), Some(Control::K29_7));
        unknown(answer.parameter_word(), None);
        for word in answer.acceleration_words() {
            unknown(word, Some(Control::K29_7));
        }
        for word in [answer.parameter_word(), answer.pipe()] {
            if word.is_byte_error() {
                quality.count(QualityEvent::ParameterOrPipeWord);
            }
        }
        if answer.acceleration_words().iter().any(|word| word.is_byte_error()) {
            quality.count(QualityEvent::AccelerationWord);
        }
        if self.link.at == 0 {
            self.link.secondary_counted = false;
        }
        if answer.secondary().is_byte_error() && !self.link.secondary_counted {
            self.link.secondary_counted = true;
            quality.count(QualityEvent::Safe2Error);
        }
        let [delay] = self.registers.get(Register::Delay);
        if self.profile.quality == QualityRule::Sick && delay >> 4 < 2 {
            quality.count(QualityEvent::LowRssi);
        }
        let bad = answer.words().iter().filter(|word| word.is_byte_error()).count();
        self.counters.words = self.counters.words.wrapping_add(u32::try_from(bad).unwrap_or(0));
        self.counters.switch_bits = self.counters.switch_bits.wrapping_add(u32::from(!answer.switch_ok()));
        self.registers.put(Register::PipeD, [answer.pipe().raw()]);
    }

    fn take_symbol(&mut self, answer: Answer, finished: &mut Finished) {
        let symbol = answer.parameter().ok().and_then(|byte| byte.symbol().ok());
        let init = symbol == Some(EncoderSymbol::Init);
        self.registers.set_d(OnlineD::MIN, init);
        self.registers.set_1(Online1::MIN, init);
        if init {
            self.registers.raise(Event::MIN);
            self.registers.raise_s(EventS::MIN);
        }
        let done = self.requester.receive(symbol);
        if let Some(result) = &done.short {
            self.show_short(*result);
        }
        if let Some(result) = &done.long {
            self.show_long(result);
        }
        *finished = done;
    }

    fn show_short(&mut self, result: Result<ShortAnswer, Error>) {
        if let Ok(ShortAnswer { data: Some(data), .. }) = result {
            self.registers.put(Register::SPcData, [data]);
        }
        self.registers.put(Register::SlaveRegCtrl, [0x3f]);
        self.registers.set_1(Online1::FRES, true);
        self.registers.raise_s(EventS::FRES);
    }

    fn take_acceleration(&mut self, answer: Answer) {
        let value = answer.delta_delta().ok();
        if value.is_none() {
            self.counters.acceleration = self.counters.acceleration.wrapping_add(1);
        }
        let tracker = &mut self.link.tracker;
        tracker.step(value);
        self.registers.put40(Register::Pos, tracker.position());
        let [_, high, middle, low] = tracker.velocity().to_be_bytes();
        self.registers.put(Register::Vel, [high, middle, low]);
        let most = if self.profile.restart_on_acceleration_errors { 255 } else { 31 };
        let errors = u8::try_from(tracker.errors().min(most)).unwrap_or(u8::MAX);
        self.registers.put(Register::AccErrCnt, [errors]);
        self.registers.put(Register::PosTx, [2]);
        self.show_doubt();
    }

    fn show_doubt(&mut self) {
        let doubt = self.link.tracker.is_unreliable();
        self.registers.set_d(OnlineD::POS, doubt);
        if doubt {
            self.registers.raise(Event::POS);
        }
    }

    fn count_vsync(&mut self, answer: Answer) {
        let Ok(vsync) = answer.parameter().map(EncoderByte::vsync) else { return };
        let event = match (self.link.at, vsync) {
            (7, true) => QualityEvent::VsyncOk,
            (7, false) => QualityEvent::VsyncMissing,
            (_, true) => QualityEvent::VsyncEarly,
            (_, false) => return,
        };
        self.link.quality.count(event);
    }

    /// After RX7: judges the safe channels and aligns the fast position.
    fn end_v_frame(&mut self) {
        let VFrame { safe1, safe2 } = self.link.vframe;
        let quality = &mut self.link.quality;
        match safe1.position() {
            Ok(_) | Err(Error::PositionInvalid { .. }) => quality.count(QualityEvent::Safe1Ok),
            Err(_) => {
                quality.count(QualityEvent::Safe1Error);
                self.counters.safe1 = self.counters.safe1.wrapping_add(1);
            }
        }
        if !is_sound(safe2) {
            self.counters.safe2 = self.counters.safe2.wrapping_add(1);
            // Bad words were counted when they came.
            if self.profile.quality == QualityRule::Sick && !self.link.secondary_counted {
                quality.count(QualityEvent::Safe2Error);
            }
        }
        let safe = match safe1.position() {
            Ok(position) => {
                self.link.last_safe = Some(position);
                Some(position)
            }
            Err(Error::PositionInvalid { .. }) => {
                self.link.last_safe = None;
                None
            }
            Err(_) if self.profile.stale_position => self.link.last_safe,
            Err(_) => None,
        };
        match safe {
            Some(position) => self.link.tracker.align(position),
            None => self.link.tracker.no_safe_position(),
        }
        self.show_doubt();
        self.link.pending = Some(self.link.vframe);
        self.link.msync = !self.link.msync;
        self.link.settled = true;
    }

    /// The results of a V-frame, one H-frame after its end.
    fn show_v_frame(&mut self) {
        let Some(VFrame { safe1, safe2 }) = self.link.pending.take() else { return };
        let map = &mut self.registers;
        map.put(Register::PosTx, [3]);
        map.put(Register::SafeSum, [safe1.status()]);
        map.put(Register::VPosCrc, safe1.raw_crc().to_be_bytes());
        let summary = safe1.status();
        map.set_d(OnlineD::SUM, summary != 0);
        map.set_1(Online1::SSUM, summary != 0);
        if summary != 0 {
            map.raise_s(EventS::SSUM);
        }
        let [mask] = map.get(Register::MaskSum);
        if summary & mask != 0 {
            map.raise(Event::SUM);
        }
        match safe1.position() {
            Ok(position) => {
                map.put40(Register::VPos, position);
                map.set_1(Online1::SCE.with(Online1::VPOS), false);
                self.link.news = self.link.news.with(Interrupts::VPOS);
            }
            Err(Error::PositionInvalid { .. }) => {
                map.set_1(Online1::SCE, false);
                map.set_1(Online1::VPOS, true);
                map.raise_s(EventS::VPOS);
            }
            Err(Error::Crc { .. }) => {
                map.set_1(Online1::SCE, true);
                map.raise_s(EventS::SCE);
            }
            // A block with a bad word leaves the flags as they are.
            Err(_) => {}
        }
        if is_sound(safe1) {
            self.show_safe_2(safe2);
        }
    }

    /// Safe channel 2 is shown only with a good channel 1, and judged by its CRC alone.
    fn show_safe_2(&mut self, safe2: SafeBlock) {
        let map = &mut self.registers;
        let status = safe2.status();
        map.put(Register::Status2, [status]);
        map.put40(Register::VPos2, safe2.raw_position());
        map.put(Register::VPosCrc2, safe2.raw_crc().to_be_bytes());
        map.set_2(Online2::SUM2, status & 0x60 != 0);
        map.set_2(Online2::SCE2, !safe2.crc_ok());
        map.set_2(Online2::VPOS2, matches!(safe2.position(), Err(Error::PositionInvalid { .. })));
        self.link.news = self.link.news.with(Interrupts::VPOS2);
        if status & 0x40 != 0 {
            self.link.quality.count(QualityEvent::Test2);
        }
    }

    fn show_quality(&mut self) {
        let low = self.link.quality.is_low();
        let map = &mut self.registers;
        map.put(Register::MasterQm, [0x80 | self.link.quality.value()]);
        map.set_d(OnlineD::QMLW, low);
        map.set_1(Online1::QMLW, low);
        map.set_2(Online2::QMLW, low);
        if low {
            map.raise(Event::QMLW);
            map.raise_s(EventS::QMLW);
        }
    }
}

/// Words and CRC are good; whether there is a position is another matter.
fn is_sound(block: SafeBlock) -> bool {
    matches!(block.position(), Ok(_) | Err(Error::PositionInvalid { .. }))
}
