//! Parameters of a drive: read all, write all and read back.

use super::Ask;
use crate::master::axis::Axis;
use crate::master::progress::{Failure, Progress};
use crate::noncyclic_command::{Arguments, NonCyclicCommand};
use crate::type_code::{Pr, TypeCode, parameter};

/// A parameter with its value.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
pub struct ParameterValue {
    /// Which one.
    pub pr: Pr,
    /// Its value.
    pub value: i32,
}

impl ParameterValue {
    /// A value of a parameter.
    pub const fn new(pr: Pr, value: i32) -> Self {
        Self { pr, value }
    }
}

servowire_core::one_line!(ParameterValue { Self { pr, value } => "{} = {}", pr, value; });

/// Reads a list of parameters.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Backup {
    ask: Ask,
    read: TypeCode,
    place: usize,
}

impl Backup {
    /// With the type code for reading as the drive's manual gives it.
    pub const fn new(read: TypeCode) -> Self {
        Self { ask: Ask { asked: false }, read, place: 0 }
    }

    /// To be called once in every update period; fills in the values.
    pub fn receive(&mut self, axis: &mut Axis, list: &mut [ParameterValue]) -> Progress<()> {
        let Some(ParameterValue { pr, value }) = list.get_mut(self.place) else { return Progress::Done { value: () } };
        let request = NonCyclicCommand::Parameter(Arguments { type_code: self.read, index: pr.index(), data: 0 });
        match self.ask.receive(axis, request) {
            Progress::Done { value: response } => {
                *value = response.data().unwrap_or(0);
                self.place = self.place.saturating_add(1);
                Progress::Pending { left: axis.answer_left() }
            }
            Progress::Pending { left } => Progress::Pending { left },
            Progress::Failed { error } => Progress::Failed { error },
        }
    }
}

/// Writes a list of parameters, each one read back and compared. Nothing is written twice.
///
/// Writing is not storing: what must survive a power cycle is stored with a command of its own, and some parameters are
/// valid only after a reset.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Restore {
    ask: Ask,
    read: TypeCode,
    place: usize,
    written: bool,
    end: Option<Progress<()>>,
}

impl Restore {
    /// With the type code for reading as the drive's manual gives it.
    pub const fn new(read: TypeCode) -> Self {
        Self { ask: Ask { asked: false }, read, place: 0, written: false, end: None }
    }

    /// To be called once in every update period. [`Failure::Differs`] names the parameter that did not take its value;
    /// after any other failure the parameter at [`place`](Self::place) may have either value. Once done or failed it stays so.
    pub fn receive(&mut self, axis: &mut Axis, list: &[ParameterValue]) -> Progress<()> {
        let progress = self.end.unwrap_or_else(|| self.next(axis, list));
        self.end = progress.ended();
        progress
    }

    fn next(&mut self, axis: &mut Axis, list: &[ParameterValue]) -> Progress<()> {
        let Some(ParameterValue { pr, value }) = list.get(self.place).copied() else {
            return Progress::Done { value: () };
        };
        let (type_code, data) = if self.written { (self.read, 0) } else { (parameter::WRITE, value) };
        let request = NonCyclicCommand::Parameter(Arguments { type_code, index: pr.index(), data });
        match self.ask.receive(axis, request) {
            Progress::Done { value: response } => {
                if self.written {
                    if response.data() != Some(value) {
                        return Progress::Failed { error: Failure::Differs(pr) };
                    }
                    self.place = self.place.saturating_add(1);
                }
                self.written = !self.written;
                Progress::Pending { left: axis.answer_left() }
            }
            Progress::Pending { left } => Progress::Pending { left },
            Progress::Failed { error } => Progress::Failed { error },
        }
    }

    /// Place in the list of the parameter that is written at present.
    pub const fn place(&self) -> usize {
        self.place
    }
}
