use super::eeprom::{READY_POLLING, is_busy};
use super::verified::apart;
use super::{Reset, Step};
use crate::error::Error;
use crate::response::Response;
use crate::status::Alm;
use crate::timing::REQUEST_GAP_NS;

/// A [`Reset`] that ends as done, not done, or with an unknown effect.
///
/// An encoder counts equal requests, no matter who sends them and when: after seven requests of an interrupted reset, the first
/// request of a new one takes effect. So another command, which restarts the count, is sent first until it is answered and ES0
/// is clear. Then the eight requests follow, as one operation that is never repeated in part. Before a zero preset, MEMERR has
/// to be clear too, so that afterwards it refers to this preset.
///
/// `Done` rests on the eight responses. An encoder that hears something else in between, such as noise at its end of the line,
/// may restart its count and still answer. If a wrong zero is dangerous, compare the position before and after.
///
/// | it ends with | the encoder |
/// |---|---|
/// | `Done`, with the response to STATUS | has done it |
/// | [`Error::NotDone`] | has **not** done it: it had begun to count anew, and fewer than eight requests were sent |
/// | [`Error::Busy`], [`Error::MemoryFault`], [`Error::NoResponse`] and other faults of the first response | was not asked to |
/// | [`Error::EffectUnknown`] | may have done it; it may be busy until `ready_ns` |
///
/// It may therefore follow any history, such as an abandoned attempt or a controller that has restarted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct GuardedReset {
    reset: Reset,
    started: bool,
    tries: u16,
    end: Option<Step<Response>>,
}

impl GuardedReset {
    /// Creates the guard for this reset.
    pub const fn new(reset: Reset) -> Self {
        Self { reset, started: false, tries: 0, end: None }
    }

    /// Returns the first request, to be sent at once.
    pub const fn start(&mut self, now_ns: u64) -> Step<Response> {
        self.started = false;
        self.tries = 0;
        self.end = None;
        let (request, _) = apart(self.reset.request());
        Step::Send { request, not_before_ns: now_ns }
    }

    servowire_core::receive! { Response }

    fn next(&mut self, outcome: Result<Response, Error>, ready_ns: u64) -> Step<Response> {
        let soon_ns = ready_ns.saturating_add(REQUEST_GAP_NS.into());
        if self.started {
            return match self.reset.receive(outcome, ready_ns) {
                Step::Failed { error: Error::Interrupted { .. }, .. } => {
                    Step::Failed { error: Error::NotDone, ready_ns: soon_ns }
                }
                step => step,
            };
        }
        let (request, ea) = apart(self.reset.request());
        let error = match outcome {
            Ok(response) if response.command() != Some(request.command()) => Error::NotCarried,
            Ok(response) if ea.is_some_and(|ea| ea != response.ea) => Error::NotCarried,
            Ok(response) if is_busy(response) => Error::Busy { tries: self.tries.saturating_add(1) },
            Ok(response) if self.reset.is_stored() && response.alm().is_some_and(|alm| alm.contains(Alm::MEMERR)) => {
                return Step::Failed { error: Error::MemoryFault, ready_ns: soon_ns };
            }
            Ok(_) => {
                self.started = true;
                return self.reset.start(soon_ns);
            }
            Err(error) => error,
        };
        self.tries = self.tries.saturating_add(1);
        let not_before_ns = ready_ns.saturating_add(READY_POLLING.interval_ns.into());
        if self.tries >= READY_POLLING.max_tries {
            return Step::Failed { error, ready_ns: not_before_ns };
        }
        Step::Send { request, not_before_ns }
    }
}
