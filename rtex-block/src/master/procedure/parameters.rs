//! Parameters of a drive: read all, write all and read back.

use super::ask::{Ask, procedure, read_back};
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
    /// Creates a value of a parameter.
    pub const fn new(pr: Pr, value: i32) -> Self {
        Self { pr, value }
    }
}

servowire_core::one_line!(ParameterValue { Self { pr, value } => "{} = {}", pr, value; });

/// Reads a list of parameters.
#[derive(Debug)]
pub struct Backup<'a> {
    ask: Ask,
    read: TypeCode,
    list: &'a mut [ParameterValue],
    place: usize,
    end: Option<Progress<()>>,
}

procedure!(Backup<'a>, ());

impl<'a> Backup<'a> {
    /// Creates the procedure with the type code for reading given in the drive's manual; it fills in the values of the list.
    pub const fn new(read: TypeCode, list: &'a mut [ParameterValue]) -> Self {
        Self { ask: Ask::NEW, read, list, place: 0, end: None }
    }

    const fn reset(&mut self) {
        (self.ask, self.place) = (Ask::NEW, 0);
    }

    fn next(&mut self, axis: &mut Axis) -> Progress<()> {
        let Some(parameter) = self.list.get_mut(self.place) else { return Progress::Done { value: () } };
        self.ask.receive(axis, request(self.read, parameter.pr, 0)).and_then(|response| {
            // A parameter request is done with a parameter response, which has data.
            parameter.value = response.data().unwrap_or(parameter.value);
            self.place = self.place.saturating_add(1);
            Progress::Pending { left: axis.answer_left() }
        })
    }
}

const fn request(type_code: TypeCode, pr: Pr, data: i32) -> NonCyclicCommand {
    NonCyclicCommand::Parameter(Arguments { type_code, index: pr.index(), data })
}

/// Writes a list of parameters and reads each one back to compare it. Nothing is written twice: if the answer to a write is
/// missing, the outcome depends on the value that is read back.
///
/// Writing is not storing: a value that must survive a power cycle is stored with a separate command, and some parameters
/// take effect only after a reset. [`Failure::Differs`] names the parameter that did not accept its value; after any other
/// failure the parameter at [`place`](Self::place) may have the old or the new value.
#[derive(Debug)]
pub struct Restore<'a> {
    ask: Ask,
    read: TypeCode,
    list: &'a [ParameterValue],
    place: usize,
    /// How the write of the present parameter was answered.
    written: Option<Result<(), Failure>>,
    end: Option<Progress<()>>,
}

procedure!(Restore<'a>, ());

impl<'a> Restore<'a> {
    /// Creates the procedure with the type code for reading given in the drive's manual.
    pub const fn new(read: TypeCode, list: &'a [ParameterValue]) -> Self {
        Self { ask: Ask::NEW, read, list, place: 0, written: None, end: None }
    }

    const fn reset(&mut self) {
        (self.ask, self.place, self.written) = (Ask::NEW, 0, None);
    }

    fn next(&mut self, axis: &mut Axis) -> Progress<()> {
        let Some(&ParameterValue { pr, value }) = self.list.get(self.place) else {
            return Progress::Done { value: () };
        };
        let pending = Progress::Pending { left: axis.answer_left() };
        let Some(written) = self.written else {
            match self.ask.receive(axis, request(parameter::WRITE, pr, value)) {
                Progress::Done { .. } => self.written = Some(Ok(())),
                Progress::Failed { error: Failure::TimedOut } => {
                    (self.written, self.ask) = (Some(Err(Failure::TimedOut)), Ask::NEW);
                }
                Progress::Failed { error } => return Progress::Failed { error },
                Progress::Pending { .. } => {}
            }
            return pending;
        };
        read_back(self.ask.receive(axis, request(self.read, pr, 0)), written, |response| {
            if response.data() != Some(value) {
                return Progress::Failed { error: written.err().unwrap_or(Failure::Differs(pr)) };
            }
            (self.place, self.written) = (self.place.saturating_add(1), None);
            pending
        })
    }

    /// Returns the place in the list of the parameter being written.
    pub const fn place(&self) -> usize {
        self.place
    }
}
