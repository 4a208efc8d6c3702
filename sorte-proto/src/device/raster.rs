//! Where a device is in the cycles of the IO exchange: which cycle a frame belongs to, when the device sends its own frame,
//! and when a frame that has not come is lost.

use crate::sync::TRIGGER_NS;

/// From the first bit of a frame of the exchange to the capture of its start: 3.5 byte times, minus the 4 byte times by which
/// its preamble is shorter than that of SYNC.
const CAPTURE_NS: u32 = crate::preamble::Preamble::Short.capture_ns();
/// The range of cycles that make sense, in ns; within it, differences of 32-bit times are unambiguous.
const SHORTEST_NS: u32 = 1000;
const LONGEST_NS: u32 = 1_000_000_000;

/// A cycle, and the common time at its start.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub(super) struct Start {
    pub(super) number: u64,
    pub(super) ns: u32,
}

impl Start {
    const fn after(self, cycles: u32, cycle_ns: u32) -> Self {
        let ns = self.ns.wrapping_add(cycles.wrapping_mul(cycle_ns));
        Self { number: self.number.saturating_add(cycles as u64), ns }
    }
}

/// The event that is due next.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Due {
    Nothing {
        until_ns: u32,
    },
    /// The frame of the awaited cycle cannot come any more.
    Close,
    Begin(Start),
    Send(Start),
}

/// Where the device is. All times are those of its counter, which shows the master's time, modulo 2^32.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub(super) struct Raster {
    cycle_ns: u32,
    /// From the start of a cycle to the capture of its master frame at this device.
    arrives_ns: u32,
    /// From the start of a cycle until its master frame can no longer be handed over.
    closes_ns: u32,
    /// From the start of a cycle to the device's own frame, and how long before that the send action is returned.
    sends_ns: Option<u32>,
    lead_ns: u32,
    /// The cycle that begins next, the one whose master frame is awaited, and the one in which the device next sends its
    /// own frame.
    begins: Start,
    awaited: Start,
    sends: Start,
    /// What has come in the awaited cycle.
    pub(super) received: bool,
    pub(super) good: bool,
    /// A master frame of this exchange has come, so the device may send.
    pub(super) running: bool,
}

/// The parameters of a raster.
#[expect(clippy::struct_field_names, reason = "times, all of them")]
pub(super) struct Plan {
    /// Common time at the start of cycle 0.
    pub(super) first_ns: u32,
    pub(super) cycle_ns: u32,
    /// Delay from the master.
    pub(super) delay_ns: u32,
    /// Length of a master frame on the wire, and how late it may be handed over.
    pub(super) frame_ns: u32,
    pub(super) hand_over_ns: u32,
    pub(super) sends_ns: Option<u32>,
    pub(super) lead_ns: u32,
}

/// Returns how far `at` is after `from`, both modulo 2^32.
const fn since(at: u32, from: u32) -> i32 {
    i32::from_le_bytes(at.wrapping_sub(from).to_le_bytes())
}

impl Raster {
    pub(super) const fn new(plan: &Plan) -> Self {
        let cycle_ns = if plan.cycle_ns < SHORTEST_NS {
            SHORTEST_NS
        } else if plan.cycle_ns > LONGEST_NS {
            LONGEST_NS
        } else {
            plan.cycle_ns
        };
        let first = Start { number: 0, ns: plan.first_ns };
        let begins_ns = plan.delay_ns.saturating_add(TRIGGER_NS);
        Self {
            cycle_ns,
            arrives_ns: begins_ns.saturating_add(CAPTURE_NS),
            closes_ns: begins_ns.saturating_add(plan.frame_ns).saturating_add(plan.hand_over_ns),
            sends_ns: plan.sends_ns,
            lead_ns: plan.lead_ns,
            begins: first,
            awaited: first,
            sends: first,
            received: false,
            good: false,
            running: false,
        }
    }

    pub(super) const fn cycle_ns(&self) -> u32 {
        self.cycle_ns
    }

    /// The cycle whose master frame is awaited, or has come last.
    pub(super) const fn awaited(&self) -> Start {
        self.awaited
    }

    /// The master's time at the trigger of the awaited frame.
    pub(super) const fn trigger_ns(&self) -> u32 {
        self.awaited.ns.wrapping_add(TRIGGER_NS)
    }

    /// When the awaited frame is expected to be captured.
    pub(super) const fn expected_ns(&self) -> u32 {
        self.awaited.ns.wrapping_add(self.arrives_ns)
    }

    /// How many cycles after the awaited one a frame captured at `sof_ns` belongs to, and how far it is from its time there.
    pub(super) const fn place(&self, sof_ns: u32) -> (i32, i32) {
        let off = since(sof_ns, self.expected_ns());
        // At most a second, so neither is negative.
        let (half, cycle) = (since(self.cycle_ns >> 1, 0), since(self.cycle_ns, 0));
        let cycles = match off.saturating_add(half).checked_div_euclid(cycle) {
            Some(cycles) => cycles,
            None => 0,
        };
        (cycles, off.saturating_sub(cycles.saturating_mul(cycle)))
    }

    /// Ends the awaited cycle and waits for the next one's frame.
    pub(super) const fn close(&mut self) {
        self.awaited = self.awaited.after(1, self.cycle_ns);
        (self.received, self.good) = (false, false);
    }

    /// Takes the first good frame: the device sends its own frame from the next cycle onwards.
    pub(super) const fn run(&mut self) {
        if !self.running {
            self.running = true;
            self.sends = self.awaited.after(1, self.cycle_ns);
        }
    }

    /// The next event. Takes the next event; the following call returns the one after it. No cycle and no frame of the
    /// device is returned after its time.
    pub(super) fn next(&mut self, now_ns: u32) -> Due {
        let closes = self.awaited.ns.wrapping_add(self.closes_ns);
        // What has passed is left out.
        if let Some(passed) = self.passed(now_ns, self.begins.ns).checked_sub(1) {
            self.begins = self.begins.after(passed, self.cycle_ns);
        }
        let speaks = self.sends_ns.filter(|_| self.running);
        if let Some(sends_ns) = speaks {
            // Just now is not too late.
            let passed = self.passed(now_ns.wrapping_sub(1), self.sends.ns.wrapping_add(sends_ns));
            self.sends = self.sends.after(passed, self.cycle_ns);
        }
        let hands_out = match speaks {
            Some(sends_ns) => self.sends.ns.wrapping_add(sends_ns).wrapping_sub(self.lead_ns),
            None => closes,
        };
        let [close, begin, send] = [closes, self.begins.ns, hands_out].map(|at| since(at, now_ns));
        let first = close.min(begin).min(send);
        if first > 0 {
            return Due::Nothing { until_ns: now_ns.wrapping_add(first.unsigned_abs()) };
        }
        if close == first {
            return Due::Close;
        }
        if begin == first {
            let began = self.begins;
            self.begins = began.after(1, self.cycle_ns);
            return Due::Begin(began);
        }
        let sent = Start { ns: self.sends.ns.wrapping_add(speaks.unwrap_or_default()), ..self.sends };
        self.sends = self.sends.after(1, self.cycle_ns);
        Due::Send(sent)
    }

    /// Returns how many points of a raster that starts at `at_ns` are not later than now.
    fn passed(&self, now_ns: u32, at_ns: u32) -> u32 {
        match u32::try_from(since(now_ns, at_ns)) {
            Ok(late) => late.checked_div(self.cycle_ns).unwrap_or_default().saturating_add(1),
            Err(_) => 0,
        }
    }
}
