//! A master at a simulated line of two devices.

use crate::common::{EXCHANGE_CAPTURE_NS, answer, capture_ns, device_frame};
use sorte_proto::master::{Action, Config, Master, Outgoing, State};
use sorte_proto::{Error, Link};

pub(crate) const FOREVER: Action = Action::Wait { until_ns: u64::MAX };
/// 76 ns of cable and 320 ns in the device.
pub(crate) const ROUND_TRIP: u64 = 472;

/// A simulated line: `reply` says what comes back for a frame, if anything.
pub(crate) struct Bench {
    pub(crate) master: Master,
    pub(crate) now_ns: u64,
    pub(crate) sent: Vec<(u64, Outgoing)>,
}

impl Bench {
    pub(crate) fn new(config: Config) -> Self {
        let mut master = Master::new(config);
        master.set_link(Link::Up);
        Self { master, now_ns: 0, sent: Vec::new() }
    }

    /// Until the master exchanges data, gives up, or waits for ever.
    pub(crate) fn run(
        &mut self,
        mut reply: impl FnMut(usize, Outgoing) -> Option<Vec<u8>>,
    ) -> Result<u64, Option<Error>> {
        loop {
            match self.master.poll(self.now_ns) {
                FOREVER => return Err(None),
                Action::Wait { until_ns } => self.now_ns = until_ns,
                Action::Send { at_ns, frame } => {
                    self.sent.push((at_ns, frame));
                    if let Some(bytes) = reply(self.sent.len() - 1, frame) {
                        let _: Result<_, _> = self.master.hear(&bytes, at_ns + capture_ns(&frame) + ROUND_TRIP);
                    }
                }
                Action::Exchange { at_ns, .. } => return Ok(at_ns),
                Action::Restart { error } => return Err(Some(error)),
            }
        }
    }

    /// Until it is in this state and has sent a frame there.
    pub(crate) fn until(config: Config, state: State) -> Self {
        let mut bench = Self::new(config);
        while bench.master.state() != state || !bench.sent.iter().any(|(_, frame)| kind(*frame) == state) {
            match bench.master.poll(bench.now_ns) {
                Action::Wait { until_ns } => bench.now_ns = until_ns,
                Action::Send { at_ns, frame } => {
                    bench.sent.push((at_ns, frame));
                    if kind(frame) != state {
                        bench.master.hear(&answer(frame, 2), at_ns + capture_ns(&frame) + ROUND_TRIP).unwrap();
                    }
                }
                other => panic!("{other:?}"),
            }
        }
        bench
    }

    /// A device frame of the cycle that began last, at its published time: two devices 76 ns apart.
    pub(crate) fn hear(&mut self, bytes: &[u8]) -> Result<(), Error> {
        let slot = if bytes[0] == 1 { 576 } else { 900 + 76 + 355 };
        self.master.hear(bytes, self.now_ns - 500 + slot + EXCHANGE_CAPTURE_NS).map(|_| ())
    }

    /// So many cycles with both devices heard; the last is still open.
    pub(crate) fn cycles(&mut self, count: u32) {
        for _ in 0..count {
            for address in [1, 2] {
                self.hear(&device_frame(address)).unwrap();
            }
            self.now_ns += 4000;
            assert!(matches!(self.master.poll(self.now_ns), Action::Exchange { stop: false, .. }));
        }
    }
}

fn kind(frame: Outgoing) -> State {
    match frame {
        Outgoing::Discovery { .. } => State::Discovery,
        Outgoing::Param(_) => State::Param,
        Outgoing::DelayReq(_) => State::LineDelay,
        Outgoing::Sync(_) => State::Sync,
    }
}

pub(crate) fn running(config: Config) -> Bench {
    let mut bench = Bench::new(config);
    bench.now_ns = bench.run(|_, frame| Some(answer(frame, 2))).unwrap();
    bench
}
