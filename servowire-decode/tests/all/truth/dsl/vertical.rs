//! V-frames.

use super::super::rng::Rng;
use super::super::{Said, Shown};
use super::code::sealed;
use super::link::Link;

/// What goes over the vertical and the secondary channel in eight frames.
pub(super) struct Vertical {
    pub(super) toggle: bool,
    pub(super) blocks: [Vec<u8>; 2],
    fields: Vec<(&'static str, Shown)>,
    position: i64,
    pub(super) damaged: bool,
}

impl Vertical {
    /// `position`: that of the sampling before it.
    pub(super) fn new(link: &Link, position: i64, toggle: bool, rng: &mut Rng) -> Self {
        let summary = rng.pick(&[0, 0, 0x01, 0x40]);
        let status = 0x1c | u8::from(toggle) << 7;
        let first = link.forty(position);
        let second = !first & 0xff_ffff_ffff;
        let block = |head: u8, value: u64| sealed(&[&[head][..], &value.to_be_bytes()[3..]].concat());
        let fields = vec![
            ("SUMMARY", Shown::Number(summary.into())),
            ("VPOS", Shown::Number(first as i64)),
            ("STATUS2", Shown::Number(status.into())),
            ("VPOS2", Shown::Number(second as i64)),
        ];
        let blocks = [block(summary, first), block(status, second)];
        Self { toggle, blocks, fields, position: link.counts(position), damaged: false }
    }

    pub(super) fn said(&self, start: f64, quality: Shown) -> Said {
        let fields = [self.fields.clone(), vec![("QM", quality)]].concat();
        Said { kind: "V-frame".into(), start, fields, position: Some(("VPOS", self.position)), damaged: self.damaged }
    }
}
