//! TI SORTE: frames of the start-up and of the IO exchange, and PTO words.

mod startup;

use core::mem::MaybeUninit;

use sorte_proto::{
    DeviceAddress, DeviceFrame, DeviceFrameView, Direction, Error, MasterFrameView, MotorMask, Payload, Pto, Status,
    emit_master_frame_into,
};

use crate::border::{OK, Refused, border, cleared, filled, in_range, parsed, read, there};
use crate::result::{Protocol, refused, sw_result_t};

pub use startup::*;

/// Where the data of a frame begin, from its first byte, the source address: the output of a master frame, the payload of a device
/// frame.
pub const SW_SORTE_DATA_AT: usize = 2;

/// Refusals of SORTE frames, in the order of their numbers.
#[repr(i32)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum sw_sorte_error_t {
    /// The frame is too short.
    SW_E_SORTE_TRUNCATED = -0x501,
    /// The frame check sequence is wrong.
    SW_E_SORTE_BAD_FCS = -0x502,
    /// The destination is not the one for all devices.
    SW_E_SORTE_WRONG_DESTINATION = -0x503,
    /// The type is not defined, or its layout is not published.
    SW_E_SORTE_UNKNOWN_TYPE = -0x504,
    /// The type is not the expected one.
    SW_E_SORTE_UNEXPECTED_TYPE = -0x505,
    /// The frame is too long.
    SW_E_SORTE_TOO_LONG = -0x506,
    /// The CRC-8 is wrong.
    SW_E_SORTE_BAD_CRC8 = -0x507,
    /// The source is not the expected one.
    SW_E_SORTE_WRONG_SOURCE = -0x508,
    /// The preamble is wrong.
    SW_E_SORTE_BAD_PREAMBLE = -0x509,
    /// More devices than there are addresses.
    SW_E_SORTE_TOO_MANY_DEVICES = -0x50a,
    /// The table does not agree with its totals.
    SW_E_SORTE_TABLE_MISMATCH = -0x50b,
    /// The buffer is too small.
    SW_E_SORTE_BUFFER_TOO_SMALL = -0x50e,
    /// A PTO word that is reserved.
    SW_E_SORTE_RESERVED_PTO_VALUE = -0x50f,
}

/// The content of a PTO word.
#[repr(u8)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum sw_sorte_pto_kind_t {
    /// No pulse in this cycle.
    SW_SORTE_NO_PULSE = 0,
    /// A pulse.
    SW_SORTE_PULSE = 1,
    /// The driver is switched off.
    SW_SORTE_DRIVER_OFF = 2,
    /// A reserved value.
    SW_SORTE_RESERVED = 3,
}

/// A frame from the master: its output begins at SW_SORTE_DATA_AT.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct sw_sorte_master_frame_t {
    /// Time stamp of its transmission, ns.
    pub time_stamp: u16,
    /// STATUS.
    pub status: u8,
}

/// A frame from a device: its payload begins at SW_SORTE_DATA_AT.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct sw_sorte_device_frame_t {
    /// Address of the sender.
    pub address: u8,
    /// STATUS: LAST and ERROR.
    pub status: u8,
}

/// A PTO word.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct sw_sorte_pto_t {
    /// Start of the pulse in the cycle, ns; 0 without one. Of a reserved word: its time, which must not be used.
    pub start_ns: u16,
    /// sw_sorte_pto_kind_t.
    pub kind: u8,
    /// DIR, 0 or 1; 0 if the driver is off.
    pub direction: u8,
}

fn error(error: Error) -> Refused {
    refused(Protocol::Sorte, error.class().number())
}

/// The frame of a master with this many bytes of output, from its source address to its time stamp, without preamble.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_sorte_parse_master_frame(
    bytes: *const u8,
    len: usize,
    output_len: usize,
    frame: Option<&mut MaybeUninit<sw_sorte_master_frame_t>>,
) -> sw_result_t {
    border(|| {
        // SAFETY: the caller of the C function vouches for his memory.
        let bytes = unsafe { read(bytes, len)? };
        let frame = there(frame)?;
        let view = MasterFrameView::parse(output_len, bytes).map_err(error)?;
        frame.write(sw_sorte_master_frame_t { time_stamp: view.time_stamp(), status: view.status().bits() });
        OK
    })
}

/// The frame of the IO exchange with this output: 5 bytes more.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_sorte_build_master_frame(
    output: *const u8,
    output_len: usize,
    time_stamp: u16,
    bytes: *mut u8,
    size: usize,
    len: Option<&mut MaybeUninit<usize>>,
) -> sw_result_t {
    border(|| {
        // SAFETY: the caller of the C function vouches for his memory.
        let (output, len) = (unsafe { read(output, output_len)? }, there(len)?);
        // SAFETY: as above; only what the frame takes is touched.
        let bytes = unsafe { cleared(bytes, size, output_len.saturating_add(MasterFrameView::OVERHEAD))? };
        len.write(emit_master_frame_into(output, time_stamp, bytes).map_err(error)?);
        OK
    })
}

/// The frame of a device with this many bytes of payload, from its source address to its CRC.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_sorte_parse_device_frame(
    bytes: *const u8,
    len: usize,
    payload_len: usize,
    frame: Option<&mut MaybeUninit<sw_sorte_device_frame_t>>,
) -> sw_result_t {
    border(|| {
        // SAFETY: the caller of the C function vouches for his memory.
        let bytes = unsafe { read(bytes, len)? };
        let frame = there(frame)?;
        let view = DeviceFrameView::parse(payload_len, bytes).map_err(error)?;
        frame.write(sw_sorte_device_frame_t { address: view.address().get(), status: view.status().bits() });
        OK
    })
}

/// The frame of a device with the three bytes of payload of the published application: 6 bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_sorte_build_device_frame(
    frame: Option<&sw_sorte_device_frame_t>,
    payload: *const u8,
    bytes: *mut u8,
    size: usize,
) -> sw_result_t {
    border(|| {
        let it = there(frame)?;
        // SAFETY: the caller of the C function vouches for his memory.
        let payload = unsafe { read(payload, 3)? };
        let address = in_range(DeviceAddress::try_from(it.address).ok())?;
        let payload = *in_range(payload.first_chunk())?;
        let frame = DeviceFrame::<3> { address, status: Status::from_bits_retain(it.status), payload };
        // SAFETY: as above.
        let bytes = unsafe { cleared(bytes, size, DeviceFrame::<3>::LEN)? };
        frame.emit_into(bytes).map_err(error)?;
        OK
    })
}

/// The word for a pulse that starts `sync_ns` into the cycle, 0..3990; 0 and 1 are sent as 1 ns.
#[unsafe(no_mangle)]
pub extern "C" fn sw_sorte_pto_of_step(
    sync_ns: u32,
    direction: u8,
    word: Option<&mut MaybeUninit<u16>>,
) -> sw_result_t {
    border(|| {
        let word = there(word)?;
        let direction = in_range(Direction::from_code(direction))?;
        word.write(in_range(Pto::from_step(sync_ns, direction).ok())?.word());
        OK
    })
}

/// Decodes a PTO word. A reserved one is refused with SW_E_SORTE_RESERVED_PTO_VALUE, but `pto` is filled in for inspection.
#[unsafe(no_mangle)]
pub extern "C" fn sw_sorte_parse_pto(word: u16, pto: Option<&mut MaybeUninit<sw_sorte_pto_t>>) -> sw_result_t {
    border(|| {
        let out = there(pto)?;
        let pto = Pto::from_word(word);
        let (kind, start_ns) = match pto {
            Pto::NoPulse { .. } => (sw_sorte_pto_kind_t::SW_SORTE_NO_PULSE, 0),
            Pto::Pulse { start, .. } => (sw_sorte_pto_kind_t::SW_SORTE_PULSE, start.ns()),
            Pto::DriverOff => (sw_sorte_pto_kind_t::SW_SORTE_DRIVER_OFF, 0),
            Pto::Reserved(reserved) => (sw_sorte_pto_kind_t::SW_SORTE_RESERVED, reserved.time()),
        };
        let direction = pto.direction().is_some_and(Direction::is_high).into();
        out.write(sw_sorte_pto_t { start_ns, kind: kind as u8, direction });
        match Pto::checked(word) {
            Ok(_) => OK,
            Err(refusal) => Err(error(refusal)),
        }
    })
}

/// Length of the output for the four devices of the published application, in bytes.
pub const SW_SORTE_PAYLOAD: usize = 16;
const _: () = assert!(SW_SORTE_PAYLOAD == Payload::LEN);

/// The output for four axes, SW_SORTE_PAYLOAD bytes: a PTO word for each, commands 0. `count` is 4.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_sorte_build_payload(
    words: *const u16,
    count: usize,
    bytes: *mut u8,
    size: usize,
) -> sw_result_t {
    let make = || {
        // SAFETY: the caller of the C function vouches for his memory.
        let words: [u16; 4] = in_range(unsafe { read(words, count)? }.try_into().ok())?;
        Ok(Payload::independent(words.map(Pto::from_word)).emit())
    };
    // SAFETY: as above.
    unsafe { filled(bytes, size, make) }
}

/// The output for one word, sent to the motors whose bit is set in `motors` (bit 0 is device 1). The others hold with the direction of
/// the word; without any motor all drivers are off.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_sorte_build_shared_payload(
    word: u16,
    motors: u8,
    bytes: *mut u8,
    size: usize,
) -> sw_result_t {
    let make = || Ok(Payload::shared(Pto::from_word(word), in_range(MotorMask::from_bits(motors))?).emit());
    // SAFETY: the caller of the C function vouches for his memory.
    unsafe { filled(bytes, size, make) }
}

/// The PTO words of an output of SW_SORTE_PAYLOAD bytes; reserved words are not refused.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_sorte_parse_payload(
    bytes: *const u8,
    len: usize,
    words: Option<&mut MaybeUninit<[u16; 4]>>,
) -> sw_result_t {
    let parse = |bytes: &[u8]| {
        let payload = Payload::parse(in_range(bytes.try_into().ok())?);
        Ok(payload.0.map(|slice| slice.pto.word()))
    };
    // SAFETY: the caller of the C function vouches for his memory.
    unsafe { parsed(bytes, len, words, parse) }
}
