//! The register map of a receiver, as the vendors' documents lay it out, and the FIFO of the pipe channel.

use core::mem::MaybeUninit;

use hdsl::registers::{PipeFifo, Registers};
use hdsl::symbol::Word;

use super::error;
use super::names::{dialect as dialect_of, rule as rule_of};
use super::receiver::sw_hdsl_t;
use crate::border::{OK, border, in_range, state, there};
use crate::result::sw_result_t;

/// Registers of a receiver. Its content is private; it may be copied. Only one context at a time may use it.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct sw_hdsl_registers_t {
    pub(crate) _private: [MaybeUninit<u64>; 64],
}
state!(sw_hdsl_registers_t, Registers, 0x35);

/// The FIFO of eight bytes that PIPE_S and PIPE_D read. Its content is private; it may be copied.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct sw_hdsl_pipe_t {
    pub(crate) _private: [MaybeUninit<u64>; 5],
}
state!(sw_hdsl_pipe_t, PipeFifo, 0x36);

/// The registers of a receiver of this dialect (sw_hdsl_dialect_t) before its first frame.
#[unsafe(no_mangle)]
pub extern "C" fn sw_hdsl_registers_start(
    map: Option<&mut MaybeUninit<sw_hdsl_registers_t>>,
    dialect: u8,
) -> sw_result_t {
    border(|| {
        let dialect = dialect_of(dialect)?;
        sw_hdsl_registers_t::start(map, Registers::new(&dialect))?;
        OK
    })
}

/// Takes over what the receiver heard last: call it once after each sw_hdsl_hear().
#[unsafe(no_mangle)]
pub extern "C" fn sw_hdsl_registers_apply(map: Option<&mut sw_hdsl_registers_t>, m: Option<&sw_hdsl_t>) -> sw_result_t {
    border(|| {
        let (map, m) = (sw_hdsl_registers_t::get(map)?, sw_hdsl_t::look(m)?);
        let _ = map.apply(m.h_frame());
        OK
    })
}

/// Reads a register as an application does: reading PIPE_S takes an entry. SW_E_HDSL_NO_REGISTER.
#[unsafe(no_mangle)]
pub extern "C" fn sw_hdsl_registers_read(
    map: Option<&mut sw_hdsl_registers_t>,
    address: u8,
    value: Option<&mut MaybeUninit<u8>>,
) -> sw_result_t {
    border(|| {
        let (map, value) = (sw_hdsl_registers_t::get(map)?, there(value)?);
        value.write(map.read(address).ok_or_else(|| error(hdsl::Error::NoRegister { address }))?);
        OK
    })
}

/// Reads a register without taking an entry.
#[unsafe(no_mangle)]
pub extern "C" fn sw_hdsl_registers_look(
    map: Option<&sw_hdsl_registers_t>,
    address: u8,
    value: Option<&mut MaybeUninit<u8>>,
) -> sw_result_t {
    border(|| {
        let (map, value) = (sw_hdsl_registers_t::look(map)?, there(value)?);
        value.write(map.byte(address).ok_or_else(|| error(hdsl::Error::NoRegister { address }))?);
        OK
    })
}

/// Writes a register as an application does, which starts what it stands for in the receiver: messages,
/// resets, synchronisation. A refused write leaves the value unchanged.
#[unsafe(no_mangle)]
pub extern "C" fn sw_hdsl_registers_write(
    map: Option<&mut sw_hdsl_registers_t>,
    m: Option<&mut sw_hdsl_t>,
    address: u8,
    value: u8,
) -> sw_result_t {
    border(|| {
        let (map, m) = (sw_hdsl_registers_t::get(map)?, sw_hdsl_t::get(m)?);
        map.write(m, address, value).map_err(error)?;
        OK
    })
}

/// How far the fast position is aligned with the safe one: sw_hdsl_stage_t, or a refusal.
#[unsafe(no_mangle)]
pub extern "C" fn sw_hdsl_registers_stage(map: Option<&sw_hdsl_registers_t>) -> sw_result_t {
    border(|| Ok(sw_hdsl_registers_t::look(map)?.stage() as sw_result_t))
}

/// An empty FIFO.
#[unsafe(no_mangle)]
pub extern "C" fn sw_hdsl_pipe_start(pipe: Option<&mut MaybeUninit<sw_hdsl_pipe_t>>) -> sw_result_t {
    border(|| {
        sw_hdsl_pipe_t::start(pipe, PipeFifo::new())?;
        OK
    })
}

/// A word of the pipe channel by the rules of a dialect (sw_hdsl_dialect_t): the oldest one goes if there is no room.
#[unsafe(no_mangle)]
pub extern "C" fn sw_hdsl_pipe_put(pipe: Option<&mut sw_hdsl_pipe_t>, word: u16, dialect: u8) -> sw_result_t {
    border(|| {
        let (it, rule) = (sw_hdsl_pipe_t::get(pipe)?, rule_of(dialect)?);
        it.put(in_range(Word::new(word))?.read(rule));
        OK
    })
}

/// Takes the oldest entry: PIPE_S and PIPE_D.
#[unsafe(no_mangle)]
pub extern "C" fn sw_hdsl_pipe_take(
    pipe: Option<&mut sw_hdsl_pipe_t>,
    status: Option<&mut MaybeUninit<u8>>,
    data: Option<&mut MaybeUninit<u8>>,
) -> sw_result_t {
    border(|| {
        let (it, status, data) = (sw_hdsl_pipe_t::get(pipe)?, there(status)?, there(data)?);
        let entry = it.take();
        status.write(entry.status);
        data.write(entry.data);
        OK
    })
}
