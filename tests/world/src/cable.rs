use crate::{Fault, Scenario, Script, Tally};

/// A frame at the other end of a [`Cable`].
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Arrival {
    /// Number of the frame that was sent, from 0.
    pub sent: u64,
    /// Its bytes now.
    pub bytes: Vec<u8>,
    /// When it arrives, by the same point of the frame as the time of sending.
    pub at_ns: u64,
    /// Whether a bit is wrong or bytes are missing.
    pub damaged: bool,
}

/// One direction of a line between two ports: blocks or Ethernet frames go in, and come out late, twice, damaged, as the
/// frame before, or not at all. Chains and rings are built of many.
///
/// A frame is one transmission of one unit. [`Fault::Cut`] leaves the first half of it; a [`Fault::Foreign`] that replays
/// gives the frame before in its place, one that does not, and [`Fault::Noise`], a short frame of random bytes after it;
/// [`Fault::Repeat`] lets it come again after one more cable delay. The other faults mean nothing here.
#[derive(Debug)]
pub struct Cable {
    delay_ns: u64,
    script: Script,
    before: Option<(u64, Vec<u8>)>,
    /// Random bit errors in a thousand million bits, besides those of the script.
    pub bit_errors: u32,
    /// What was counted.
    pub tally: Tally,
}

impl Cable {
    /// A cable of this delay.
    pub fn new(delay_ns: u64, scenario: Scenario) -> Self {
        Self { delay_ns, script: scenario.script, before: None, bit_errors: 0, tally: Tally::default() }
    }

    /// A frame is sent at `sent_ns`; what comes of it.
    pub fn carry(&mut self, frame: &[u8], sent_ns: u64) -> Vec<Arrival> {
        let sent = self.tally.sent;
        let faults = self.script.strike(sent, 1);
        self.tally.sent += 1;
        let mut at_ns = sent_ns + self.delay_ns;
        let mut here = Arrival { sent, bytes: frame.to_vec(), at_ns, damaged: false };
        let (mut times, mut junk) = (1, Vec::new());
        for (_, fault) in &faults {
            self.tally.faults[fault.kind() as usize] += 1;
            match fault {
                Fault::Drop => times = 0,
                Fault::Repeat => times *= 2,
                Fault::Flip { bit } => flip(&mut here, usize::from(*bit)),
                Fault::Cut => here.bytes.truncate(frame.len() / 2),
                Fault::Delay { ns } => at_ns += u64::from(*ns),
                Fault::Foreign { replay: true, .. } => {
                    if let Some((sent, bytes)) = self.before.clone() {
                        (here.sent, here.bytes) = (sent, bytes);
                    }
                }
                Fault::Foreign { after_ns, .. } | Fault::Noise { after_ns } => junk.push(u64::from(*after_ns)),
                _ => {}
            }
        }
        self.random_errors(&mut here);
        self.before = Some((sent, frame.to_vec()));
        here.at_ns = at_ns;
        here.damaged |= here.sent == sent && here.bytes != frame;
        let again = |k| Arrival { at_ns: at_ns + k * self.delay_ns.max(1), ..here.clone() };
        let mut arrivals: Vec<_> = (0..times).map(again).collect();
        for after_ns in junk {
            let bytes = self.script.noise().to_le_bytes().to_vec();
            arrivals.push(Arrival { sent, bytes, at_ns: at_ns + after_ns, damaged: true });
            self.tally.spurious += 1;
        }
        self.tally.for_host += arrivals.len() as u64;
        self.tally.delivered += arrivals.len() as u64;
        arrivals.sort_by_key(|arrival| arrival.at_ns);
        arrivals
    }

    fn random_errors(&mut self, here: &mut Arrival) {
        if self.bit_errors == 0 {
            return;
        }
        for bit in 0..here.bytes.len() * 8 {
            if (self.script.noise() >> 1) % 1_000_000_000 < u64::from(self.bit_errors) {
                flip(here, bit);
            }
        }
    }
}

fn flip(arrival: &mut Arrival, bit: usize) {
    let bits = arrival.bytes.len() * 8;
    if bits > 0 {
        arrival.bytes[bit % bits / 8] ^= 1 << (bit % 8);
        arrival.damaged = true;
    }
}
