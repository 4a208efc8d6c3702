use crate::data_id::DataId;

/// The two bit rates of T-Format encoders.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
pub enum BitRate {
    /// 2.5 Mbit/s, 400 ns per bit: all encoders of TIDM-1011.
    Mbit2_5,
    /// 5 Mbit/s, 200 ns per bit: a faster variant that some encoders have.
    Mbit5,
}

servowire_core::one_line!(BitRate {
    Self::Mbit2_5 => "2.5 Mbit/s";
    Self::Mbit5 => "5 Mbit/s";
});

/// Nominal time from the end of a request to the start bit of the response.
///
/// Not in TIDM-1011; 3 us in the notes of one driver, 3.2 us in the log of another.
pub const RESPONSE_DELAY_NS: u32 = 3_000;

impl BitRate {
    /// Both rates, the common one first.
    pub const ALL: [Self; 2] = [Self::Mbit2_5, Self::Mbit5];

    /// Duration of one bit in ns.
    pub const fn bit_ns(self) -> u32 {
        match self {
            Self::Mbit2_5 => 400,
            Self::Mbit5 => 200,
        }
    }

    /// Bits per second.
    pub const fn bits_per_second(self) -> u32 {
        match self {
            Self::Mbit2_5 => 2_500_000,
            Self::Mbit5 => 5_000_000,
        }
    }

    /// Duration of `fields` fields in ns: 4.0 or 2.0 us each.
    pub const fn fields_ns(self, fields: u8) -> u32 {
        self.bit_ns().wrapping_mul(10).wrapping_mul(fields as u32)
    }

    /// Duration of request, [`RESPONSE_DELAY_NS`] and response in ns, without the cable (5 ns per metre each way).
    pub const fn transaction_ns(self, id: DataId) -> u32 {
        self.fields_ns(id.request_fields())
            .wrapping_add(RESPONSE_DELAY_NS)
            .wrapping_add(self.fields_ns(id.response_fields()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The table of transaction times at a delay of 3 us.
    #[test]
    fn transaction_times() {
        let us = |rate: BitRate| DataId::ALL.map(|id| rate.transaction_ns(id) / 1000);
        assert_eq!(us(BitRate::Mbit2_5), [31, 31, 23, 51, 35, 31, 31, 31, 31]);
        assert_eq!(us(BitRate::Mbit5), [17, 17, 13, 27, 19, 17, 17, 17, 17]);
    }
}
