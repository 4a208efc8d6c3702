//! The beginning of a capture, looked at before decoding starts.

use super::{Options, StartStop, Survey, survey};
use crate::capture::{Change, Line};
use crate::fault::{At, Fault};

/// Changes looked at before decoding begins, if every channel that moves has enough of them by then.
const PREVIEW: usize = 1 << 16;
/// Enough changes of a channel to judge it.
const ENOUGH: usize = 1 << 8;
/// Changes looked at when a channel moves seldom beside a busy one.
const LONGEST_PREVIEW: usize = 1 << 20;

/// The beginning of a capture, and whether it went wrong there.
pub(super) struct Preview {
    pub(super) changes: Vec<Change>,
    pub(super) more: bool,
    pub(super) fault: Option<Fault>,
    reached: i64,
}

impl Preview {
    /// Time of the first change of any channel.
    pub(super) fn begin(&self) -> i64 {
        self.changes.first().map_or(0, |change| change.time)
    }

    pub(super) fn read(line: &mut dyn Line) -> Self {
        let mut changes: Vec<Change> = Vec::new();
        let (mut more, mut fault) = (true, None);
        let mut counts = vec![0_usize; line.channels().len()];
        let mut counted = 0;
        loop {
            for change in changes.iter().skip(counted) {
                if let Some(count) = counts.get_mut(usize::from(change.channel)) {
                    *count += 1;
                }
            }
            counted = changes.len();
            // The first change of a channel is only its level at the beginning.
            let judged = counts.iter().all(|count| *count <= 1 || *count >= ENOUGH);
            if !more || counted >= if judged { PREVIEW } else { LONGEST_PREVIEW } {
                break;
            }
            match line.read(&mut changes) {
                Ok(again) => more = again,
                Err(e) => (more, fault) = (false, Some(e)),
            }
        }
        Self { changes, more, fault, reached: line.reached() }
    }

    /// With nothing to decode, the fault of the file is the better message.
    pub(super) fn survey<P: StartStop>(
        &self,
        file: &str,
        channels: &[String],
        options: &Options,
        make: &dyn Fn(i64) -> P,
    ) -> Result<Survey, Fault> {
        let found = survey(&self.changes, self.reached, channels, options, make);
        found.map_err(|what| match &self.fault {
            Some(fault) => fault.clone(),
            None => Fault::new(file, At::File, what),
        })
    }
}
