//! Stores the 254 entries of DISCOVERY in a file without the empty ones at the end.

use core::fmt;

use serde::de::{Error, SeqAccess, Visitor};
use serde::{Deserializer, Serializer};

use crate::discovery::{Entry, MAX_DEVICES};

pub(crate) fn serialize<S: Serializer>(entries: &[Entry; MAX_DEVICES], serializer: S) -> Result<S::Ok, S::Error> {
    let used = entries.iter().rposition(|entry| *entry != Entry::default()).map_or(0, |last| last.saturating_add(1));
    serializer.collect_seq(entries.iter().take(used))
}

pub(crate) fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<[Entry; MAX_DEVICES], D::Error> {
    struct Table;

    impl<'de> Visitor<'de> for Table {
        type Value = [Entry; MAX_DEVICES];

        fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
            f.write_str("254 entries at most")
        }

        fn visit_seq<A: SeqAccess<'de>>(self, mut seq: A) -> Result<Self::Value, A::Error> {
            let mut entries = [Entry::default(); MAX_DEVICES];
            for entry in &mut entries {
                match seq.next_element()? {
                    Some(next) => *entry = next,
                    None => return Ok(entries),
                }
            }
            match seq.next_element::<Entry>()? {
                Some(_) => Err(A::Error::invalid_length(MAX_DEVICES.saturating_add(1), &self)),
                None => Ok(entries),
            }
        }
    }

    deserializer.deserialize_seq(Table)
}
