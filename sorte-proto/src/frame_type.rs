servowire_core::codes! {
    /// TYPE of a long-header frame.
    pub enum FrameType: u8 {
        /// DISCOV_MC
        Discovery = 1 => "DISCOVERY",
        /// PARAM_MC
        Param = 2 => "PARAM",
        /// LD_REQ_P2P
        DelayReq = 3 => "DELAY_REQ",
        /// LD_RESP_P2P: defined by the vendor; the request itself comes back instead.
        DelayResp = 4 => "DELAY_RESP",
        /// SYNC_MC
        Sync = 5 => "SYNC",
        /// OUT_MC: only the code is known.
        Out = 6 => "OUT",
        /// IN_UC: only the code is known.
        In = 7 => "IN",
        /// ALARM_UC: only the code is known.
        Alarm = 8 => "ALARM",
        /// DIAG_UC: only the code is known.
        Diag = 9 => "DIAG",
        /// RECON_UC: only the code is known.
        Recon = 10 => "RECON",
    }
}

impl FrameType {
    /// Number of bytes from DA to FCS; `None` if no layout is published.
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
