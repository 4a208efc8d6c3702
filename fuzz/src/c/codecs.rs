//! The decoders of all protocols, called as C calls them: with every length from 0, each in a buffer of just that size, and compared
//! with what the crates say.

use core::mem::MaybeUninit;

use hdsl::message::{LongRequest, ShortRequest};
use nikon_aformat::{Abs40, Expected, Layout};
use rtex_block::{Command32, Response32, pack};
use servowire_c::aformat::{sw_aformat_parse_abs40, sw_aformat_parse_as, sw_aformat_parse_line};
use servowire_c::hdsl::{sw_hdsl_crc16, sw_hdsl_parse_long, sw_hdsl_parse_short};
use servowire_c::rtex::{
    sw_rtex_from_words16, sw_rtex_parse_command, sw_rtex_parse_command_strict, sw_rtex_parse_command32,
    sw_rtex_parse_response, sw_rtex_parse_response32, sw_rtex_to_words16, sw_rtex_to_words32,
};
use servowire_c::sorte::{
    sw_sorte_crc8, sw_sorte_parse_device_frame, sw_sorte_parse_header, sw_sorte_parse_master_frame,
    sw_sorte_parse_param, sw_sorte_parse_payload, sw_sorte_parse_sync, sw_sorte_strip_preamble,
};
use servowire_c::tformat::{
    sw_tformat_crc, sw_tformat_parse_all, sw_tformat_parse_encoder_id, sw_tformat_parse_multi_turn,
    sw_tformat_parse_request, sw_tformat_parse_single_turn, sw_tformat_parse_spi10, sw_tformat_parse_spi16,
    sw_tformat_request_t,
};
use sorte_proto::{DeviceFrameView, LongFrame, MasterFrameView, ParamView, Sync, strip_preamble};
use tformat::spi::{parse_spi10, parse_spi16};
use tformat::{BitOrder, Request, Response, Window};

/// A result of C, and what it should be.
type Pair = (i32, i32);
/// A decoder over bytes, and one over 16-bit words.
type OfBytes = unsafe fn(*const u8, usize, &[u8]) -> Pair;
type OfWords = unsafe fn(*const u16, usize, &[u16]) -> Pair;

const ARGUMENT: i32 = -2;

/// The result for a protocol's class.
fn code<T, E>(protocol: i32, result: Result<T, E>, class: impl FnOnce(E) -> u8) -> i32 {
    result.map_or_else(|error| -(protocol << 8 | i32::from(class(error))), |_| 0)
}

/// `c` is called with the block, its length and room for a value; `rust` says what comes of the same bytes.
macro_rules! of_bytes {
    ($protocol:literal: $($c:path $([$($argument:expr),+])? => $rust:expr;)+) => {
        &[$(
            |start, len, bytes| {
                let mut out = MaybeUninit::uninit();
                // SAFETY: the block has this length, see `codecs`.
                let said = unsafe { $c(start, len, $($($argument,)+)? Some(&mut out)) };
                (said, code($protocol, $rust(bytes), |error| error.class().number()))
            },
        )+]
    };
}

const TFORMAT: &[OfBytes] = of_bytes! { 1:
    sw_tformat_parse_single_turn => |bytes| Response::parse(Request::ReadSingleTurn, bytes);
    sw_tformat_parse_multi_turn => |bytes| Response::parse(Request::ReadMultiTurn, bytes);
    sw_tformat_parse_encoder_id => |bytes| Response::parse(Request::ReadEncoderId, bytes);
    sw_tformat_parse_all => |bytes| Response::parse(Request::ReadAll, bytes);
    sw_tformat_parse_request => Request::parse;
};

const HDSL: &[OfBytes] = of_bytes! { 3:
    sw_hdsl_parse_short => ShortRequest::parse;
    sw_hdsl_parse_long => LongRequest::parse;
};

const RTEX: &[OfBytes] = of_bytes! { 4:
    sw_rtex_parse_response => rtex_block::Response::parse;
    sw_rtex_parse_command => rtex_block::Command::parse;
    sw_rtex_parse_command_strict => rtex_block::Command::parse_strict;
};

const SORTE: &[OfBytes] = of_bytes! { 5:
    sw_sorte_parse_device_frame[3] => |bytes| DeviceFrameView::parse(3, bytes);
    sw_sorte_parse_master_frame[16] => |bytes| MasterFrameView::parse(16, bytes);
    sw_sorte_parse_header => LongFrame::parse;
    sw_sorte_parse_param => ParamView::parse;
    sw_sorte_parse_sync => Sync::parse;
    sw_sorte_strip_preamble => strip_preamble;
};

/// What does not fit the table: two values, or none.
const MORE: &[OfBytes] = &[
    |start, len, bytes| {
        let (mut command, mut sub) = (MaybeUninit::uninit(), MaybeUninit::uninit());
        // SAFETY: the block has this length, see `codecs`.
        let said = unsafe { sw_rtex_parse_command32(start, len, Some(&mut command), Some(&mut sub)) };
        (said, code(4, Command32::parse(bytes), |error| error.class().number()))
    },
    |start, len, bytes| {
        let (mut response, mut sub) = (MaybeUninit::uninit(), MaybeUninit::uninit());
        // SAFETY: as above.
        let said = unsafe { sw_rtex_parse_response32(start, len, Some(&mut response), Some(&mut sub)) };
        (said, code(4, Response32::parse(bytes), |error| error.class().number()))
    },
    |start, len, bytes| {
        let mut words = MaybeUninit::uninit();
        // SAFETY: as above.
        let said = unsafe { sw_sorte_parse_payload(start, len, Some(&mut words)) };
        (said, if bytes.len() == 16 { 0 } else { ARGUMENT })
    },
    |start, len, bytes| {
        let mut crc = MaybeUninit::new(0);
        // SAFETY: as above.
        let said = unsafe { sw_sorte_crc8(start, len, Some(crc.assume_init_mut())) };
        // SAFETY: it began as 0.
        (said | i32::from(unsafe { crc.assume_init() }), i32::from(sorte_proto::crc8(bytes)))
    },
    |start, len, bytes| {
        let mut crc = MaybeUninit::uninit();
        // SAFETY: as above.
        let said = unsafe { sw_hdsl_crc16(start, len, Some(&mut crc)) };
        // SAFETY: it was written, for the pointers are there.
        (said | i32::from(unsafe { crc.assume_init() }), i32::from(hdsl::crc16(bytes)))
    },
    // SAFETY: as above.
    |start, len, bytes| (i32::from(unsafe { sw_tformat_crc(start, len) }), i32::from(tformat::crc(bytes))),
    |start, len, bytes| {
        let (mut wide, mut narrow) = (vec![0_u32; len / 4], vec![0_u16; len / 2]);
        // SAFETY: as above, and the words are as many as said.
        let wides = unsafe { sw_rtex_to_words32(start, len, wide.as_mut_ptr(), wide.len()) };
        assert_eq!(wides == 0, bytes.len() % 4 == 0, "of {len} bytes");
        // SAFETY: as above.
        let said = unsafe { sw_rtex_to_words16(start, len, narrow.as_mut_ptr(), narrow.len()) };
        let mut rust = vec![0_u16; len / 2];
        let packed = pack::to_words(bytes, &mut rust);
        assert_eq!(narrow, rust);
        (said, if packed.is_ok() { 0 } else { ARGUMENT })
    },
    |start, len, bytes| {
        let mut response = MaybeUninit::uninit();
        let expected = Expected::new(Layout::Abs40, nikon_aformat::Command::Abs40);
        let mut pair = (0, 0);
        for bits in (len * 8).saturating_sub(7)..=len * 8 {
            // SAFETY: no more bits than there are.
            pair.0 = unsafe { sw_aformat_parse_line(0, 0, 255, start, bits, 1, Some(&mut response)) };
            let line = Window::read(bytes, 0, bits.min(128) as u32, BitOrder::MsbFirst).expect("there are as many");
            pair.1 = code(2, nikon_aformat::Response::parse_line(&expected, line), |error| error.class().number());
            if pair.0 != pair.1 {
                break;
            }
        }
        pair
    },
];

const WORDS: &[OfWords] = &[
    |start, count, words| {
        let mut data = MaybeUninit::uninit();
        // SAFETY: the block has this length, see `codecs`.
        let said = unsafe { sw_aformat_parse_abs40(0, 255, start, count, 0, Some(&mut data)) };
        let expected = Expected::new(Layout::Abs40, nikon_aformat::Command::Abs40);
        let parsed = Abs40::parse_words(&expected, words, BitOrder::LsbFirst);
        (said, code(2, parsed, |error| error.class().number()))
    },
    |start, count, words| {
        let mut pair = (0, 0);
        for (layout, number) in Layout::ALL.iter().zip(0..) {
            let mut response = MaybeUninit::uninit();
            // SAFETY: as above.
            pair.0 = unsafe { sw_aformat_parse_as(0, number, 255, start, count, 1, Some(&mut response)) };
            let expected = Expected::new(*layout, nikon_aformat::Command::Abs40);
            let parsed = nikon_aformat::Response::parse_words(&expected, words, BitOrder::MsbFirst);
            pair.1 = code(2, parsed, |error| error.class().number());
            if pair.0 != pair.1 {
                break;
            }
        }
        pair
    },
    |start, count, words| {
        let (asked, mut response) = (sw_tformat_request_t { id: 3, adf: 0, edf: 0 }, MaybeUninit::uninit());
        // SAFETY: as above.
        let said = unsafe { sw_tformat_parse_spi10(Some(&asked), start, count, Some(&mut response)) };
        (said, code(1, parse_spi10(Request::ReadAll, words), |error| error.class().number()))
    },
    |start, count, words| {
        let (asked, mut response) = (sw_tformat_request_t { id: 0, adf: 0, edf: 0 }, MaybeUninit::uninit());
        // SAFETY: as above.
        let said = unsafe { sw_tformat_parse_spi16(Some(&asked), start, count, Some(&mut response)) };
        (said, code(1, parse_spi16(Request::ReadSingleTurn, words), |error| error.class().number()))
    },
    |start, count, words| {
        let mut bytes = vec![0_u8; words.len() * 2];
        // SAFETY: as above.
        let said = unsafe { sw_rtex_from_words16(start, count, bytes.as_mut_ptr(), bytes.len()) };
        let want: Vec<u8> = words.iter().flat_map(|word| word.to_le_bytes()).collect();
        assert_eq!(bytes, want);
        (said, 0)
    },
];

/// Every decoder with the first 0, 1, 2 ... bytes, and with all of them; then with words.
pub fn codecs(data: &[u8]) {
    for len in (0..=data.len().min(48)).chain([data.len()]) {
        let block: Box<[u8]> = data[..len].into();
        for (group, calls) in [TFORMAT, HDSL, RTEX, SORTE, MORE].iter().enumerate() {
            for (at, call) in calls.iter().enumerate() {
                // SAFETY: a pointer to the block, and its length.
                let (said, want) = unsafe { call(block.as_ptr(), block.len(), &block) };
                assert_eq!(said, want, "call {at} of group {group} with {len} bytes");
            }
        }
    }
    let words: Vec<u16> = data.chunks_exact(2).map(|two| u16::from_le_bytes([two[0], two[1]])).collect();
    for count in 0..=words.len().min(24) {
        let block: Box<[u16]> = words[..count].into();
        for (at, call) in WORDS.iter().enumerate() {
            // SAFETY: a pointer to the block, and its length.
            let (said, want) = unsafe { call(block.as_ptr(), block.len(), &block) };
            assert_eq!(said, want, "call {at} with {count} words");
        }
    }
}
