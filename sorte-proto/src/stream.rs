//! The decoders as `nom` streaming parsers, for frames that arrive as a stream of bytes.
//!
//! If bytes are missing, they return `Incomplete` with the number needed; every other fault is an `Error`. With
//! [`sorte_proto::Error`](crate::error::Error) as the error type the reason is kept; any other type that implements
//! `FromExternalError` works too.

use nom::error::{FromExternalError, ParseError};
use nom::{IResult, Parser};
use servowire_core::stream::{missing, refused, unit};

use crate::error::Error;
use crate::exchange::{DeviceFrameView, MasterFrameView};
use crate::frame::LongFrame;
use crate::frame_type::FrameType;
use crate::preamble::{Scan, scan};

/// Removes preamble and start delimiter from the front, as [`strip_preamble`](crate::strip_preamble).
///
/// # Errors
/// [`Error::BadPreamble`]; `Incomplete` while only preamble bytes have come.
pub fn preamble<'a, E>(wire: &'a [u8]) -> IResult<&'a [u8], (), E>
where
    E: ParseError<&'a [u8]> + FromExternalError<&'a [u8], Error>,
{
    match scan(wire) {
        Scan::Frame(frame) => Ok((frame, ())),
        Scan::Bad { at } => Err(refused(wire, Error::BadPreamble { at })),
        Scan::Ended => Err(missing(1)),
    }
}

/// Reads a long-header frame from the front, as [`LongFrame::parse`]. The length follows from TYPE.
///
/// ```
/// use nom::Parser;
/// use sorte_proto::{DelayReq, Error, FrameType, Place, Preamble, stream};
/// let mut wire = Preamble::Middle.bytes().to_vec();
/// wire.extend(DelayReq::of_device(Place::Inner).emit());
/// let (rest, ((), frame)) = (stream::preamble::<Error>, stream::long_frame).parse(&wire[..]).unwrap();
/// assert!(rest.is_empty());
/// assert_eq!(frame.frame_type(), FrameType::DelayReq);
/// ```
///
/// # Errors
/// As [`LongFrame::parse`], with `Incomplete` in place of [`Error::Truncated`]; [`Error::UnknownType`] also for the types
/// without a published layout, whose length is unknown.
pub fn long_frame<'a, E>(input: &'a [u8]) -> IResult<&'a [u8], LongFrame<'a>, E>
where
    E: ParseError<&'a [u8]> + FromExternalError<&'a [u8], Error>,
{
    let &[_, _, code, ..] = input else { return Err(missing(3_usize.saturating_sub(input.len()))) };
    let unknown = Error::UnknownType { got: code };
    let len = FrameType::from_code(code).and_then(FrameType::frame_len).ok_or_else(|| refused(input, unknown))?;
    unit(input, len, LongFrame::parse)
}

/// Reads a master frame of the IO exchange with `output_len` output bytes from the front.
///
/// # Errors
/// As [`MasterFrameView::parse`], with `Incomplete` in place of [`Error::Truncated`].
pub fn master_frame<'a, E>(output_len: usize) -> impl Parser<&'a [u8], Output = MasterFrameView<'a>, Error = E>
where
    E: ParseError<&'a [u8]> + FromExternalError<&'a [u8], Error>,
{
    let len = output_len.saturating_add(MasterFrameView::OVERHEAD);
    move |input: &'a [u8]| unit(input, len, |frame| MasterFrameView::parse(output_len, frame))
}

/// Reads a device frame of the IO exchange with `payload_len` payload bytes from the front.
///
/// # Errors
/// As [`DeviceFrameView::parse`], with `Incomplete` in place of [`Error::Truncated`].
pub fn device_frame<'a, E>(payload_len: usize) -> impl Parser<&'a [u8], Output = DeviceFrameView<'a>, Error = E>
where
    E: ParseError<&'a [u8]> + FromExternalError<&'a [u8], Error>,
{
    let len = payload_len.saturating_add(DeviceFrameView::OVERHEAD);
    move |input: &'a [u8]| unit(input, len, |frame| DeviceFrameView::parse(payload_len, frame))
}

#[cfg(test)]
mod tests {
    use nom::{Err, Needed};
    use std::vec::Vec;

    use super::*;
    use crate::delay_req::DelayReq;
    use crate::discovery::Discovery;
    use crate::exchange::emit_master_frame_into;
    use crate::param::{Param, Parameters};
    use crate::place::Place;
    use crate::preamble::{Preamble, strip_preamble};
    use crate::status::Status;
    use crate::sync::Sync;

    fn stream() -> Vec<u8> {
        let frames: [(Preamble, Vec<u8>); 4] = [
            (Preamble::Long, Discovery::request(Place::Inner).emit().to_vec()),
            (Preamble::Long, Param::request(Parameters::STOCK, Place::Last).emit().to_vec()),
            (Preamble::Middle, DelayReq::of_device(Place::Last).emit().to_vec()),
            (Preamble::Middle, Sync::of_master(500, 76, Place::Last).emit().to_vec()),
        ];
        frames.iter().flat_map(|(preamble, frame)| preamble.bytes().iter().chain(frame)).copied().collect()
    }

    #[test]
    fn a_stream_of_frames_may_be_split_anywhere() {
        let wire = stream();
        let mut whole = Vec::new();
        let mut rest = &wire[..];
        while !rest.is_empty() {
            let (after, ((), frame)) = (preamble::<Error>, long_frame).parse(rest).unwrap();
            whole.push(frame.frame_type());
            for cut in 0..rest.len() - after.len() {
                let part = (preamble::<Error>, long_frame).parse(&rest[..cut]);
                assert!(part.is_err_and(|e| e.is_incomplete()), "{cut}");
            }
            rest = after;
        }
        assert_eq!(whole, [FrameType::Discovery, FrameType::Param, FrameType::DelayReq, FrameType::Sync]);
    }

    #[test]
    fn the_exchange_is_a_stream_too() {
        let mut wire = [0; 24];
        let len = emit_master_frame_into(&[0x11; 16], 0x2233, &mut wire).unwrap();
        let (rest, view) = master_frame::<Error>(16).parse(&wire).unwrap();
        assert_eq!((rest, view.output(), view.status()), (&[0; 3][..], &[0x11; 16][..], Status::EXCHANGE));
        for cut in 0..len {
            let needed = Err::Incomplete(Needed::new(len - cut));
            assert_eq!(master_frame::<Error>(16).parse(&wire[..cut]).map(|_| ()), Err(needed));
        }
        let refusal = Err::Error(Error::WrongSource { got: 0 });
        assert_eq!(device_frame::<Error>(0).parse(&[0, 0, 0]).map(|_| ()), Err(refusal));
    }

    #[test]
    fn the_reason_is_kept() {
        assert_eq!(preamble::<Error>(&[0x55, 0x54]), Err(Err::Error(Error::BadPreamble { at: 1 })));
        assert_eq!(strip_preamble(&[0x55, 0x54]), Err(Error::BadPreamble { at: 1 }));
        let alarm = long_frame::<Error>(&[255, 0, 8, 0]).map(|_| ());
        assert_eq!(alarm, Err(Err::Error(Error::UnknownType { got: 8 })));
    }
}
