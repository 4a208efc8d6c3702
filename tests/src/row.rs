//! Rows of a vector file and the verdict on each.

use std::fmt::Debug;

use serde::de::DeserializeOwned;
use serde_json::{Map, Value};

/// One case: a line of a vector file, without its `name`.
#[derive(Debug, Clone)]
pub(crate) struct Row {
    /// Line in the file, from 1.
    pub(crate) line: usize,
    /// The row's own name; empty if it has none.
    pub(crate) name: String,
    /// All other keys.
    pub(crate) keys: Map<String, Value>,
}

/// Why a row failed.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Fault {
    /// The row cannot be read: a key is missing, unknown or of the wrong kind.
    Unreadable(String),
    /// The crate gave something else.
    Differs {
        /// Which of the row's statements.
        what: &'static str,
        /// What the row says.
        expected: String,
        /// What the crate gave.
        real: String,
    },
}

pub(crate) type Verdict = Result<(), Fault>;

/// How the rows of one topic are checked: a verdict a row, in the order of the rows.
pub(crate) type Check = fn(&[Row]) -> Vec<Verdict>;

impl Row {
    /// The row as a struct; derive it with `deny_unknown_fields`.
    pub(crate) fn read<T: DeserializeOwned>(&self) -> Result<T, Fault> {
        serde_json::from_value(Value::Object(self.keys.clone())).map_err(|e| Fault::Unreadable(e.to_string()))
    }

    /// The row as two structs: the keys in `first` make up the one, all others the other. (Flattening one into the
    /// other would let unknown keys pass.)
    pub(crate) fn read_parts<A: DeserializeOwned, B: DeserializeOwned>(&self, first: &[&str]) -> Result<(A, B), Fault> {
        let (mut these, mut others) = (self.clone(), self.clone());
        these.keys.retain(|key, _| first.contains(&key.as_str()));
        others.keys.retain(|key, _| !first.contains(&key.as_str()));
        Ok((these.read()?, others.read()?))
    }
}

/// Checks rows that do not depend on each other.
pub(crate) fn each<T: DeserializeOwned>(rows: &[Row], check: impl Fn(T) -> Verdict) -> Vec<Verdict> {
    rows.iter().map(|row| row.read().and_then(&check)).collect()
}

/// One statement of a row against what the crate gave.
pub(crate) fn same<T: PartialEq + Debug + ?Sized>(what: &'static str, expected: &T, real: &T) -> Verdict {
    if expected == real {
        return Ok(());
    }
    Err(Fault::Differs { what, expected: format!("{expected:?}"), real: format!("{real:?}") })
}
