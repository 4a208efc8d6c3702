//! Fields that make up a frame, and the request that waits for one.

use tformat::{ControlField, DataId, Error, Request, Response, Window};

use crate::event::Place;
use crate::line::start_stop::LineField;
use crate::protocols::group::Group;
use crate::protocols::plausible;
use crate::time::Time;

/// More fields than this without a pause are not a frame.
pub(super) const MOST_FIELDS: usize = 16;

/// Twice the nominal time, in picoseconds: a frame that begins later and looks like a request is one.
pub(super) const LATE_ANSWER: i64 = 6_000_000;

/// An answer begins within this time, in picoseconds; nominally after 3 us.
pub(super) const ANSWER_TIMEOUT: i64 = 20_000_000;

/// Fields that followed each other.
pub(super) type Frame = Group<u8, MOST_FIELDS>;

impl Frame {
    /// Creates a frame from bytes without times.
    pub(super) fn of_log(line: u64, bytes: &[u8]) -> Self {
        let mut frame = Self::default();
        frame.line = Some(line);
        for &byte in bytes {
            let field = LineField {
                content: byte.into(),
                delimiter: true,
                start: Time::ZERO,
                end: Time::ZERO,
                spikes: 0,
                bits: 0,
            };
            frame.push(byte, &field, 0);
        }
        frame
    }

    /// Returns what would make the bits on the line a sound answer: one bit more at some place, or one less.
    pub(super) fn slipped_bit(&self, request: Request) -> Option<&'static str> {
        let len = 10 * u32::from(request.data_id().response_fields());
        plausible::slipped_bit(self.raw, len, |bits| {
            Window::from_bits(bits, len).is_some_and(|line| Response::parse_line(request, line).is_ok())
        })
    }

    /// Returns the bits of the line over the length of the whole answer to `request`.
    fn answer_line(&self, request: Request) -> Option<(u128, u32)> {
        let len = 10 * u32::from(request.data_id().response_fields());
        let mask = 1_u128.checked_shl(len)?.wrapping_sub(1);
        (self.raw != 0).then_some((self.raw & mask, len))
    }

    /// Returns whether flipping one bit would make a sound answer.
    pub(super) fn is_one_bit_off(&self, request: Request) -> bool {
        self.answer_line(request).is_some_and(|(bits, len)| {
            let sound =
                |bits| Window::from_bits(bits, len).is_some_and(|line| Response::parse_line(request, line).is_ok());
            (0..len).any(|at| sound(bits ^ 1 << at))
        })
    }

    /// Returns whether the line looks idle where the answer should end.
    pub(super) fn ends_idle(&self, request: Request) -> bool {
        let ones = |(bits, len): (u128, u32)| (bits << (128 - len)).leading_ones();
        // The delimiter is always a one.
        self.answer_line(request).map_or(0, ones) > plausible::CUT_BITS
    }

    /// Returns the data ID that the first field requests or answers.
    pub(super) fn data_id(&self) -> Result<DataId, Error> {
        ControlField::parse(self.first())?.data_id()
    }

    /// Returns the first field, or 0 if it is missing.
    pub(super) fn first(&self) -> u8 {
        self.contents().first().copied().unwrap_or_default()
    }

    /// Returns the bits of the line from the first start bit, rebuilt from the fields, with idle line between them.
    pub(super) fn line(&self, bit: i64) -> Option<Window> {
        let mut bits = u128::MAX;
        for (byte, start) in self.contents().iter().zip(self.starts()) {
            let at = (*start - self.start() + bit / 2) / bit.max(1);
            let ten = 1 << 9 | u128::from(*byte) << 1;
            let clear = u32::try_from(at).ok().and_then(|at| 0x3ff_u128.checked_shl(at));
            if let (Some(clear), Ok(at)) = (clear, u32::try_from(at)) {
                bits = bits & !clear | ten << at;
            }
        }
        if let Some(at) = self.broken.and_then(|field| self.starts().get(usize::from(field))) {
            let at = (*at - self.start() + bit / 2) / bit.max(1) + 9;
            bits &= !u32::try_from(at).ok().and_then(|at| 1_u128.checked_shl(at)).unwrap_or(0);
        }
        let len = ((self.end - self.start()) / bit.max(1)).clamp(0, 128);
        Window::from_bits(bits, u32::try_from(len).ok()?)
    }
}

/// A request that is waiting for its answer.
#[derive(Debug, Clone, Copy)]
pub(super) struct Pending {
    /// `None` if the request was damaged.
    pub(super) request: Option<Request>,
    pub(super) place: Place,
}

impl Pending {
    /// Returns whether a frame is not the answer but the next request: it is a request, and either begins too late for an
    /// answer or asks for something else.
    pub(super) fn is_asked_again(&self, frame: &Frame) -> bool {
        let late = self.place.end().is_some_and(|end| frame.start() - end > LATE_ANSWER);
        let other = self.request.is_some_and(|request| frame.data_id().is_ok_and(|id| id != request.data_id()));
        (late || other)
            && frame.broken.is_none()
            && frame.len() < self.answer_fields(frame.first())
            && frame.data_id().is_ok_and(|id| frame.len() == usize::from(id.request_fields()))
    }

    /// Returns the number of fields in the answer that begins with these bytes.
    pub(super) fn answer_fields_of(&self, bytes: &[u8]) -> usize {
        self.answer_fields(bytes.first().copied().unwrap_or_default())
    }

    /// Returns the answer alone, if these bytes are the request followed by it: a receiver that is always on hears the
    /// request first.
    pub(super) fn without_echo<'a>(&self, bytes: &'a [u8]) -> &'a [u8] {
        let echo = self.request.map(Request::emit);
        let rest = echo.and_then(|echo| bytes.strip_prefix(echo.as_bytes()));
        rest.filter(|rest| rest.len() == self.answer_fields_of(rest)).unwrap_or(bytes)
    }

    /// Returns the number of fields in the answer that begins with `cf`: as `cf` says or, if it is damaged, as requested.
    pub(super) fn answer_fields(&self, cf: u8) -> usize {
        match ANSWER_FIELDS.get(usize::from(cf)) {
            Some(said @ 1..) => usize::from(*said),
            _ => usize::from(self.request.map_or(DataId::ReadAll, Request::data_id).response_fields()),
        }
    }
}

/// Fields of the answer that begins with each byte; 0: none does.
const ANSWER_FIELDS: [u8; 256] = {
    let mut fields = [0; 256];
    let mut ids = DataId::ALL.as_slice();
    while let [id, rest @ ..] = ids {
        let [.., place] = fields.split_at_mut(id.control_field().get() as usize + 1).0 else { break };
        *place = id.response_fields();
        ids = rest;
    }
    fields
};
