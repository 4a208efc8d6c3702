//! The running link: handling of every answer and every V-frame.

use super::{Master, RestartReason};
use crate::acceleration::DeltaDelta;
use crate::answer::Answer;
use crate::dialect::Dialect;
use crate::doubt::Doubt;
use crate::encoder_id::{EncoderId, PositionBits};
use crate::error::Error;
use crate::evidence::{Evidence, SafeEvidence, SafeSample};
use crate::fast::FastPosition;
use crate::parameter::{EncoderByte, EncoderSymbol};
use crate::quality::{QualityEvent, QualityMonitor, QualityRule};
use crate::symbol::Reading;
use crate::vframe::VFrame;

/// The state of one link between its lock and its loss.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub(super) struct Link {
    quality: QualityMonitor,
    fast: FastPosition,
    vframe: VFrame,
    /// Place in the V-frame, 0..=7.
    at: u8,
    msync: bool,
    /// At least one V-frame is complete: messages may be sent.
    settled: bool,
    /// The safe position of the last V-frame, with SUMMARY.
    safe: Result<(u64, u8), Doubt>,
    /// TEST2 of the last V-frame is still to be counted.
    test2: bool,
    /// When the safe positions of the last V-frame and of the present one were sampled.
    last_sampled_ns: u64,
    sampled_ns: u64,
}

impl Link {
    pub(super) fn new(dialect: &Dialect, id: EncoderId, bits: PositionBits) -> Self {
        Self {
            quality: QualityMonitor::new(dialect.quality),
            fast: FastPosition::start(id, bits),
            vframe: VFrame::default(),
            at: 0,
            msync: true,
            settled: false,
            safe: Err(Doubt::NoVFrame),
            test2: false,
            last_sampled_ns: 0,
            sampled_ns: 0,
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

    /// Notes that a V-frame begins after the H-frame that was sampled at this time.
    pub(super) const fn latch(&mut self, sampled_ns: u64) {
        (self.last_sampled_ns, self.sampled_ns) = (self.sampled_ns, sampled_ns);
    }

    pub(super) const fn fast(&self, frame: u32, sampled_ns: u64) -> Evidence {
        self.fast.evidence(frame, sampled_ns)
    }

    /// The safe position of the last V-frame.
    pub(super) fn safe(&self, id: EncoderId) -> SafeEvidence {
        let sampled_ns = self.last_sampled_ns;
        SafeEvidence(self.safe.map(|(raw, summary)| SafeSample { position: id.position(raw), summary, sampled_ns }))
    }

    /// Handles a frame whose answer is not heard: its word is missing, and so is a byte of each safe block. Returns whether
    /// another V-frame begins after it.
    pub(super) fn skip(&mut self) -> bool {
        self.fast.step(None);
        // What comes later in this V-frame is not in order any more.
        self.vframe = VFrame::default();
        let last = self.at == 7;
        if last {
            self.fast.align(None);
            self.safe = Err(Doubt::Stale);
            self.msync = !self.msync;
        }
        self.at = self.at.wrapping_add(1) & 7;
        last
    }

    /// Handles an unknown number of unheard frames: the next frame may not belong to the V-frame under way. The last unheard
    /// frame was sampled at `before_ns`.
    pub(super) fn interrupt(&mut self, before_ns: u64) {
        self.fast.interrupt();
        self.vframe = VFrame::default();
        self.sampled_ns = before_ns;
    }
}

impl Master {
    /// Handles one H-frame of RX0..RX7.
    pub(super) fn run(&mut self, bits: u64) -> Result<(), RestartReason> {
        let answer = Answer::from_bits(self.dialect.rule, bits);
        self.count_test();
        self.link.vframe.put(self.dialect.rule, self.link.at, answer);
        self.h_frame.pipe = Some(answer.pipe());
        self.count_words(answer);
        let parameter = answer.parameter().ok();
        self.take_symbol(parameter);
        self.take_acceleration(answer);
        if let Some(parameter) = parameter {
            self.link.quality.count_vsync(self.link.at, parameter.vsync());
        }
        if self.link.at == 7 {
            self.end_v_frame();
        }
        self.link.at = self.link.at.wrapping_add(1) & 7;
        self.h_frame.quality = self.link.quality.value();
        if self.link.quality.is_lost() {
            return Err(RestartReason::Quality);
        }
        let errors = self.h_frame.acceleration_errors;
        if self.dialect.restart_on_acceleration_errors && errors > 0 && errors >= u32::from(self.threshold) {
            return Err(RestartReason::AccelerationErrors);
        }
        Ok(())
    }

    /// The firmware of the SDK counts TEST2 one H-frame after the V-frame.
    #[inline]
    fn count_test(&mut self) {
        if self.link.test2 {
            self.link.test2 = false;
            self.link.quality.count(QualityEvent::Test2);
        }
    }

    /// Counts the faults of the words; mostly there are none.
    #[inline]
    fn count_words(&mut self, answer: Answer) {
        let weak = self.h_frame.signal.is_some_and(|signal| signal.rssi.get() < 2);
        if weak && self.dialect.quality == QualityRule::Sick {
            self.link.quality.count(QualityEvent::LowRssi);
        }
        let bad = self.link.quality.count_words(self.link.at, &answer);
        if bad != 0 {
            self.counters.words = self.counters.words.wrapping_add(bad.into());
        }
        if !answer.switch_ok() {
            self.counters.switch_bits = self.counters.switch_bits.wrapping_add(1);
        }
    }

    fn take_symbol(&mut self, parameter: Option<EncoderByte>) {
        let symbol = parameter.and_then(|byte| byte.symbol().ok());
        self.h_frame.init = symbol == Some(EncoderSymbol::Init);
        self.requester.take(symbol, &mut self.h_frame.finished);
    }

    #[inline(always)]
    fn take_acceleration(&mut self, answer: Answer) {
        let value = match answer.delta_delta() {
            Ok(value) => Some(value),
            Err(error) => self.unusable(&answer, error),
        };
        self.link.fast.step(value);
        self.h_frame.acceleration = value;
        self.h_frame.acceleration_errors = self.link.fast.missing_in_a_row();
    }

    /// Handles a faulty acceleration word: counts it, and uses it anyway if the dialect does so.
    #[cold]
    fn unusable(&mut self, answer: &Answer, error: Error) -> Option<DeltaDelta> {
        if self.dialect.damaged_acceleration && matches!(error, Error::InvalidWord { .. }) {
            if let Ok(value) = DeltaDelta::from_word(u16::from_be_bytes(answer.acceleration_words().map(Reading::raw)))
            {
                return Some(value);
            }
        }
        self.counters.acceleration = self.counters.acceleration.wrapping_add(1);
        if answer.is_silence() {
            self.link.fast.unanswered();
        }
        None
    }

    /// Judges the safe channels and aligns the fast position, after RX7.
    fn end_v_frame(&mut self) {
        let link = &mut self.link;
        let VFrame { safe1, safe2 } = &link.vframe;
        let (sound1, heard, safe) = match safe1.vpos() {
            Ok(raw) => (true, true, Ok((raw, safe1.status()))),
            Err(Error::PositionInvalid { .. }) => (true, true, Err(Doubt::Withheld)),
            // What the host has not heard says nothing about the line.
            Err(Error::Truncated { .. }) => (false, false, Err(Doubt::Stale)),
            Err(_) => (false, true, Err(Doubt::Stale)),
        };
        let sound2 = safe2.is_sound();
        if heard {
            link.quality.count_blocks(sound1, sound2);
        }
        if !sound1 {
            self.counters.safe1 = self.counters.safe1.wrapping_add(1);
        }
        if !sound2 {
            self.counters.safe2 = self.counters.safe2.wrapping_add(1);
        }
        // The firmware of the SDK looks at channel 2 only with a good channel 1.
        link.test2 = self.dialect.quality == QualityRule::Ti && sound1 && safe2.status() & 0x40 != 0;
        link.fast.align(safe.ok().map(|(raw, _)| raw));
        link.safe = safe;
        self.h_frame.v_frame = Some(link.vframe);
        link.msync = !link.msync;
        link.settled = true;
        self.latch();
    }
}
