//! SORTE rows: master frames good and bad, words, the step pulse generator.

use sorte_proto::sync0::{Register, Sync0, Variant, Write};
use sorte_proto::{Error, ErrorClass, MasterFrameView, Pto, Slice, StartTime, emit_master_frame_into};

use super::{Tally, Topic, each};

include!(concat!(env!("OUT_DIR"), "/sorte.rs"));

/// A master frame of 16 output bytes.
pub(crate) struct Master {
    pub(crate) output: [u8; 16],
    pub(crate) time_stamp: u16,
    pub(crate) frame: [u8; 21],
}

/// What a step of the generator is told, and what it writes.
pub(crate) struct Step {
    pub(crate) cmp6: bool,
    pub(crate) cmp0: bool,
    pub(crate) cmp7: Option<u16>,
    pub(crate) writes: &'static [Write],
}

pub(crate) const TOPICS: &[Topic] = &[
    ("sorte/ioex_master", ioex_master),
    ("sorte/ioex_master_negative", ioex_master_negative),
    ("sorte/process_data_slice", process_data_slice),
    ("sorte/sync0_fsm", sync0_fsm),
];

fn ioex_master() -> Tally {
    each(
        MASTERS,
        |_| "of ioex_master",
        |row| {
            let mut frame = [0; 21];
            emit_master_frame_into(&row.output, row.time_stamp, &mut frame) == Ok(21)
                && frame == row.frame
                && MasterFrameView::parse(16, &frame).is_ok_and(|view| view.output() == row.output)
        },
    )
}

fn ioex_master_negative() -> Tally {
    each(
        REFUSED,
        |_| "of ioex_master_negative",
        |(frame, want)| MasterFrameView::parse(16, frame).map(|_| ()).map_err(Error::class) == want.map_or(Ok(()), Err),
    )
}

fn process_data_slice() -> Tally {
    each(
        SLICES,
        |_| "of process_data_slice",
        |(bytes, start)| {
            let slice = Slice::parse(*bytes);
            slice.emit() == *bytes && slice.pto.start().map(StartTime::ns) == *start
        },
    )
}

fn sync0_fsm() -> Tally {
    each(
        RUNS,
        |_| "of sync0_fsm",
        |(variant, steps)| {
            let mut sync0 = Sync0::new(*variant);
            steps.iter().all(|step| {
                let mut want = step.writes.iter().copied();
                let six = !step.cmp6 || sync0.cmp6().into_iter().all(|write| want.next() == Some(write));
                let zero = !step.cmp0 || sync0.cmp0().into_iter().all(|write| want.next() == Some(write));
                let start =
                    |word| sync0.cmp7(Pto::from_word(word).start()).into_iter().all(|write| want.next() == Some(write));
                let seven = step.cmp7.is_none_or(start);
                six && zero && seven && want.next().is_none()
            })
        },
    )
}
