/// A number that does not fit its field.
///
/// This error refuses only numbers passed in by a caller; a wrong number from the wire is an `Error` of the crate.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, thiserror::Error)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[error("{got} is out of range, the limit is {max}")]
pub struct OutOfRange {
    /// The number, or the nearest one that an `i64` can hold.
    pub got: i64,
    /// The limit that it exceeds: the largest value, or the smallest if the number lies below it.
    pub max: i64,
}

impl OutOfRange {
    /// Reports that `got` is above `max`.
    #[cold]
    pub const fn above(got: u64, max: u64) -> Self {
        Self { got: clamp(got), max: clamp(max) }
    }
}

#[expect(clippy::cast_possible_wrap, reason = "the number is compared before")]
const fn clamp(value: u64) -> i64 {
    if value > i64::MAX as u64 { i64::MAX } else { value as i64 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::string::ToString;

    #[test]
    fn names_the_number_and_the_limit() {
        assert_eq!(OutOfRange::above(32, 31).to_string(), "32 is out of range, the limit is 31");
        assert_eq!(OutOfRange::above(u64::MAX, 31), OutOfRange { got: i64::MAX, max: 31 });
    }
}
