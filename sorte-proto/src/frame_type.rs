/// TYPE of a long-header frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
#[repr(u8)]
pub enum FrameType {
    /// DISCOV_MC
    Discovery = 1,
    /// PARAM_MC
    Param = 2,
    /// LD_REQ_P2P
    DelayReq = 3,
    /// LD_RESP_P2P: defined by the vendor; the request itself comes back instead.
    DelayResp = 4,
    /// SYNC_MC
    Sync = 5,
    /// OUT_MC: only the code is known.
    Out = 6,
    /// IN_UC: only the code is known.
    In = 7,
    /// ALARM_UC: only the code is known.
    Alarm = 8,
    /// DIAG_UC: only the code is known.
    Diag = 9,
    /// RECON_UC: only the code is known.
    Recon = 10,
}

impl FrameType {
    /// The vendor's name.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Discovery => "DISCOVERY",
            Self::Param => "PARAM",
            Self::DelayReq => "DELAY_REQ",
            Self::DelayResp => "DELAY_RESP",
            Self::Sync => "SYNC",
            Self::Out => "OUT",
            Self::In => "IN",
            Self::Alarm => "ALARM",
            Self::Diag => "DIAG",
            Self::Recon => "RECON",
        }
    }

    /// The type of this code, 1..=10.
    pub const fn from_code(code: u8) -> Option<Self> {
        Some(match code {
            1 => Self::Discovery,
            2 => Self::Param,
            3 => Self::DelayReq,
            4 => Self::DelayResp,
            5 => Self::Sync,
            6 => Self::Out,
            7 => Self::In,
            8 => Self::Alarm,
            9 => Self::Diag,
            10 => Self::Recon,
            _ => return None,
        })
    }

    /// The code.
    pub const fn code(self) -> u8 {
        self as u8
    }

    /// Bytes from DA to FCS; `None` where no layout is published.
    pub const fn frame_len(self) -> Option<usize> {
        match self {
            Self::Discovery => Some(1030),
            Self::Param => Some(40),
            Self::DelayReq | Self::DelayResp => Some(8),
            Self::Sync => Some(14),
            Self::Out | Self::In | Self::Alarm | Self::Diag | Self::Recon => None,
        }
    }
}

impl core::fmt::Display for FrameType {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.pad(self.name())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ten_type_codes_are_known() {
        for code in 0..=u8::MAX {
            assert_eq!(FrameType::from_code(code).map(FrameType::code), (1..=10).contains(&code).then_some(code));
        }
    }
}
