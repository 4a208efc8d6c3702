//! Names of the rows against the types of the crate.

use std::collections::BTreeMap;

use rtex_block::{BlockSize, Code, ControlBits, CyclicCode, MacId, NonCyclicCode, StatusFlags, SubCode, UpdateCounter};

use crate::row::Fault;

pub(super) fn unreadable(what: impl Into<String>) -> Fault {
    Fault::Unreadable(what.into())
}

pub(super) fn mac_id(number: u8) -> Result<MacId, Fault> {
    MacId::new(number).ok_or_else(|| unreadable(format!("{number} is not a MAC-ID")))
}

pub(super) fn counter(number: u8) -> Result<UpdateCounter, Fault> {
    UpdateCounter::new(number).ok_or_else(|| unreadable(format!("{number} is not an update counter")))
}

pub(super) fn code(number: u64) -> Result<Code, Fault> {
    let code = u8::try_from(number).ok().and_then(Code::new);
    code.ok_or_else(|| unreadable(format!("{number:x} is not a code")))
}

pub(super) fn size(mode: u8) -> Result<BlockSize, Fault> {
    match mode {
        16 => Ok(BlockSize::Bytes16),
        32 => Ok(BlockSize::Bytes32),
        other => Err(unreadable(format!("{other} is not a block size"))),
    }
}

pub(super) fn cyclic(name: &str) -> Result<CyclicCode, Fault> {
    let found = CyclicCode::ALL.into_iter().find(|c| c.name() == name);
    found.ok_or_else(|| unreadable(format!("{name} is not a cyclic code")))
}

/// `system_id` in the rows is `system ID` in the documents.
pub(super) fn noncyclic_name(code: NonCyclicCode) -> String {
    code.name().replace(' ', "_").to_lowercase()
}

pub(super) fn noncyclic(name: &str) -> Result<NonCyclicCode, Fault> {
    let found = NonCyclicCode::ALL.into_iter().find(|c| noncyclic_name(*c) == name);
    found.ok_or_else(|| unreadable(format!("{name} is not a non-cyclic code")))
}

pub(super) fn sub_code(name: &str) -> Result<SubCode, Fault> {
    match name {
        "normal" => Ok(SubCode::Normal),
        "system_id" => Ok(SubCode::SystemId),
        "monitor" => Ok(SubCode::Monitor),
        other => Err(unreadable(format!("{other} is not a sub-command"))),
    }
}

/// Bits by the names of the rows.
pub(super) type Bits = BTreeMap<String, u8>;

fn key(name: &str) -> String {
    name.to_lowercase()
}

pub(super) fn control(bits: ControlBits) -> Bits {
    ControlBits::all().iter_names().map(|(name, bit)| (key(name), u8::from(bits.contains(bit)))).collect()
}

pub(super) fn status(flags: StatusFlags) -> Bits {
    StatusFlags::all().iter_names().map(|(name, bit)| (key(name), u8::from(flags.contains(bit)))).collect()
}

pub(super) fn control_from(bits: &Bits) -> Result<ControlBits, Fault> {
    bits.iter().filter(|(_, set)| **set != 0).try_fold(ControlBits::empty(), |all, (name, _)| {
        let found = ControlBits::all().iter_names().find(|(n, _)| key(n) == *name);
        found.map(|(_, bit)| all | bit).ok_or_else(|| unreadable(format!("{name} is not a control bit")))
    })
}

pub(super) fn status_from(bits: &Bits) -> Result<StatusFlags, Fault> {
    bits.iter().filter(|(_, set)| **set != 0).try_fold(StatusFlags::empty(), |all, (name, _)| {
        let found = StatusFlags::all().iter_names().find(|(n, _)| key(n) == *name);
        found.map(|(_, bit)| all | bit).ok_or_else(|| unreadable(format!("{name} is not a status flag")))
    })
}
