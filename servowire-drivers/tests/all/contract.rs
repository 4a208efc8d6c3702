//! One contract for all drivers, call by call, blocking and as futures: over ports that do all that the documents of the HAL traits
//! allow, with encoders that share nothing with the crates under test.

/// Each test of a contract, for the driver that spins and for the one that waits.
macro_rules! contract {
    ($($name:ident),+) => {
        $(
            #[test]
            fn $name() {
                of_all::$name::<Spinning>();
                #[cfg(feature = "async")]
                of_all::$name::<asynch::Waiting>();
            }
        )+
    };
}

/// Calls of a driver that are made as they are; what is then done with the result of each is `$end`.
macro_rules! forward {
    ($driver:ty, |$call:ident| $end:expr, $($name:ident($($argument:ident: $type:ty),*) -> $value:ty),+) => {
        $(
            fn $name(&mut self $(, $argument: $type)*) -> Called<$value> {
                let $call = <$driver>::$name(self $(, $argument)*);
                $end
            }
        )+
    };
}

#[cfg(feature = "nikon")]
mod nikon;
#[cfg(feature = "tformat")]
mod tformat;

use embedded_io::ErrorKind;

/// What a port may report; a HAL chooses.
const KINDS: [ErrorKind; 4] = [ErrorKind::Other, ErrorKind::InvalidData, ErrorKind::TimedOut, ErrorKind::Interrupted];

/// A method of a port.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Op {
    Write,
    Flush,
    Ready,
    Read,
}

/// Faults of a port: which method reports what when it is called for this time, counted from 0.
#[derive(Debug, Clone, Default)]
struct Faults {
    plan: Vec<(Op, usize, ErrorKind)>,
    calls: Vec<Op>,
}

impl Faults {
    fn one(op: Op, call: usize, kind: ErrorKind) -> Self {
        Self { plan: vec![(op, call, kind)], calls: Vec::new() }
    }

    fn strike(&mut self, op: Op) -> Result<(), ErrorKind> {
        if self.plan.is_empty() {
            return Ok(());
        }
        let at = self.calls.iter().filter(|other| **other == op).count();
        self.calls.push(op);
        let fault = self.plan.iter().position(|(other, call, _)| (*other, *call) == (op, at));
        fault.map_or(Ok(()), |fault| Err(self.plan.remove(fault).2))
    }

    /// Whether all has happened.
    fn are_over(&self) -> bool {
        self.plan.is_empty()
    }
}
