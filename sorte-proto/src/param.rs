use crate::error::Error;
use crate::frame::{LongFrame, emit};
use crate::frame_type::FrameType;
use crate::place::Place;
use crate::status::Status;

servowire_core::codes! {
    /// Shape of the network, a byte of PARAM. Only the line is implemented by the vendor.
    #[derive(Default)]
    pub enum Topology: u8 {
        /// A line.
        #[default]
        Line = 0 => "line",
        /// A ring.
        Ring = 1 => "ring",
        /// A redundant ring.
        RedundantRing = 2 => "redundant ring",
    }
}

servowire_core::codes! {
    /// The check of the IO-exchange frames, a nibble of `crc_mode`.
    pub enum CrcKind: u8 {
        /// No check.
        None = 0 => "none",
        /// CRC-32.
        Crc32 = 1 => "CRC-32",
        /// CRC-16; the polynomial is not published.
        Crc16 = 2 => "CRC-16",
        /// CRC-8, the only one the vendor implements.
        Crc8 = 3 => "CRC-8",
        /// CRC-32 with the Castagnoli polynomial.
        Castagnoli = 4 => "CRC-32C",
    }
}

/// `crc_mode` of PARAM: low nibble for master frames, high nibble for device frames.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
pub struct CrcMode(u8);

impl CrcMode {
    /// CRC-8 both ways.
    pub const CRC8: Self = Self(0x33);

    /// Creates the mode from the byte of PARAM; every byte is a mode.
    pub const fn from_byte(byte: u8) -> Self {
        Self(byte)
    }

    /// The byte of PARAM.
    pub const fn byte(self) -> u8 {
        self.0
    }

    /// Check of master frames; `None` for an undefined code.
    pub const fn out(self) -> Option<CrcKind> {
        CrcKind::from_code(self.0 & 15)
    }

    /// Check of device frames; `None` for an undefined code.
    pub const fn input(self) -> Option<CrcKind> {
        CrcKind::from_code(self.0 >> 4)
    }
}

/// The parameters that PARAM carries to the devices. The published device stores the 32 bytes and acts on none of them.
///
/// ```text
///  byte 0 ...  4           8           12            14           15         16
///       header cycle_time  sync_cycle  delay_period  delay_burst  delay_gap  delay_fwd_time ...
///              u32         u32         u16           u8           u8         u32
///  byte 20   24    28     32        33           34     35        36
///       ipg  t_in  t_out  topology  diagnostics  alarm  crc_mode  FCS
///       u32  u32   u32    u8        u8           u8     u8
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Parameters {
    /// Cycle time in ns.
    pub cycle_time_ns: u32,
    /// 0: no synchronisation; 1..=1000: once in this many cycles; above: a separate period in units of 5 ns.
    pub sync_cycle: u32,
    /// Time between line-delay measurements in ms.
    pub delay_period_ms: u16,
    /// Number of measurements in a burst.
    pub delay_burst: u8,
    /// Time between the measurements of a burst in ms.
    pub delay_gap_ms: u8,
    /// Time from the reception of a delay request to its reflection in ns.
    pub delay_fwd_time_ns: u32,
    /// Inter-packet gap in units of 5 ns.
    pub ipg_5ns: u32,
    /// Application input time before the cycle start in ns.
    pub t_in_ns: u32,
    /// Application output time in ns.
    pub t_out_ns: u32,
    /// Shape of the network, the code of a [`Topology`].
    pub topology: u8,
    /// 0: diagnostics in the payload; 1: in separate frames.
    pub diagnostics: u8,
    /// 1: an alarm resets the network.
    pub alarm: u8,
    /// Checks of the IO-exchange frames.
    pub crc_mode: CrcMode,
}

impl Default for Parameters {
    fn default() -> Self {
        Self::STOCK
    }
}

impl Parameters {
    /// Length in bytes.
    pub const LEN: usize = 32;

    /// What the published master sends. Its cycle time says 10 us although it exchanges data every 4 us.
    pub const STOCK: Self = Self {
        cycle_time_ns: 10_000,
        sync_cycle: 0,
        delay_period_ms: 1000,
        delay_burst: 16,
        delay_gap_ms: 1,
        delay_fwd_time_ns: 320,
        ipg_5ns: 52,
        t_in_ns: 0,
        t_out_ns: 0,
        topology: Topology::Line.code(),
        diagnostics: 0,
        alarm: 0,
        crc_mode: CrcMode::CRC8,
    };

    /// [`STOCK`](Self::STOCK) with the cycle time of the CNC machine, 4 us.
    pub const CNC: Self = Self { cycle_time_ns: 4000, ..Self::STOCK };

    /// Cycle times listed in the vendor's header, in ns: 1 ms, 100, 62.5, 31.25, 10 and 4 us.
    pub const CYCLE_TIMES_NS: [u32; 6] = [1_000_000, 100_000, 62_500, 31_250, 10_000, 4000];
    /// Inter-packet gaps listed in the vendor's header, in ns. The IO exchange is laid out for 240 ns, see
    /// [`GAP_NS`](crate::timing::GAP_NS).
    pub const GAPS_NS: [u32; 5] = [200, 260, 500, 640, 960];

    /// Inter-packet gap in ns.
    pub const fn gap_ns(&self) -> u32 {
        self.ipg_5ns.saturating_mul(5)
    }

    /// Reads the parameters; any 32 bytes are valid.
    #[rustfmt::skip]
    pub fn parse(bytes: &[u8; Self::LEN]) -> Self {
        let [
            c0, c1, c2, c3, s0, s1, s2, s3, p0, p1, delay_burst, delay_gap_ms, f0, f1, f2, f3,
            g0, g1, g2, g3, i0, i1, i2, i3, o0, o1, o2, o3, topology, diagnostics, alarm, crc_mode,
        ] = *bytes;
        Self {
            cycle_time_ns: u32::from_le_bytes([c0, c1, c2, c3]),
            sync_cycle: u32::from_le_bytes([s0, s1, s2, s3]),
            delay_period_ms: u16::from_le_bytes([p0, p1]),
            delay_burst,
            delay_gap_ms,
            delay_fwd_time_ns: u32::from_le_bytes([f0, f1, f2, f3]),
            ipg_5ns: u32::from_le_bytes([g0, g1, g2, g3]),
            t_in_ns: u32::from_le_bytes([i0, i1, i2, i3]),
            t_out_ns: u32::from_le_bytes([o0, o1, o2, o3]),
            topology,
            diagnostics,
            alarm,
            crc_mode: CrcMode::from_byte(crc_mode),
        }
    }

    /// The bytes in wire order.
    #[rustfmt::skip]
    pub fn emit(&self) -> [u8; Self::LEN] {
        let [c0, c1, c2, c3] = self.cycle_time_ns.to_le_bytes();
        let [s0, s1, s2, s3] = self.sync_cycle.to_le_bytes();
        let [p0, p1] = self.delay_period_ms.to_le_bytes();
        let [f0, f1, f2, f3] = self.delay_fwd_time_ns.to_le_bytes();
        let [g0, g1, g2, g3] = self.ipg_5ns.to_le_bytes();
        let [i0, i1, i2, i3] = self.t_in_ns.to_le_bytes();
        let [o0, o1, o2, o3] = self.t_out_ns.to_le_bytes();
        let (burst, gap) = (self.delay_burst, self.delay_gap_ms);
        [
            c0, c1, c2, c3, s0, s1, s2, s3, p0, p1, burst, gap, f0, f1, f2, f3, g0, g1, g2, g3, i0, i1, i2, i3, o0, o1,
            o2, o3, self.topology, self.diagnostics, self.alarm, self.crc_mode.byte(),
        ]
    }
}

/// A PARAM frame in a buffer.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct ParamView<'a> {
    frame: LongFrame<'a>,
    bytes: &'a [u8; Parameters::LEN],
}

impl<'a> ParamView<'a> {
    /// Checks as [`LongFrame::parse`], then that TYPE is 2.
    ///
    /// # Errors
    /// As [`LongFrame::parse`]; [`Error::UnexpectedType`].
    pub fn parse(bytes: &'a [u8]) -> Result<Self, Error> {
        Self::of(LongFrame::parse(bytes)?)
    }

    /// Takes the frame if its TYPE is 2.
    ///
    /// # Errors
    /// [`Error::UnexpectedType`]
    pub fn of(frame: LongFrame<'a>) -> Result<Self, Error> {
        Ok(Self { frame, bytes: frame.of_type(FrameType::Param)? })
    }

    /// SA.
    pub const fn source(self) -> u8 {
        self.frame.source()
    }

    /// STATUS.
    pub const fn status(self) -> Status {
        self.frame.status()
    }

    /// The 32 bytes that a device stores.
    pub const fn bytes(self) -> &'a [u8; Parameters::LEN] {
        self.bytes
    }

    /// The parameters.
    pub fn parameters(self) -> Parameters {
        Parameters::parse(self.bytes)
    }
}

/// Returns the values of the frame.
#[cfg(feature = "serde")]
#[cfg_attr(docsrs, doc(cfg(feature = "serde")))]
impl serde::Serialize for ParamView<'_> {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serde::Serialize::serialize(
            &Param { source: self.source(), status: self.status(), parameters: self.parameters() },
            serializer,
        )
    }
}

/// The values of a PARAM frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Param {
    /// SA, 0 in everything the published firmware sends.
    pub source: u8,
    /// STATUS.
    pub status: Status,
    /// Parameters sent to the devices.
    pub parameters: Parameters,
}

impl Param {
    /// Number of bytes from DA to FCS.
    pub const LEN: usize = Parameters::LEN + LongFrame::OVERHEAD;

    /// Creates the frame that a master sends.
    pub const fn request(parameters: Parameters, place: Place) -> Self {
        Self { source: 0, status: place.choose(Status::FINAL_PARAM, Status::PARAM), parameters }
    }

    /// Checks as [`ParamView::parse`].
    ///
    /// # Errors
    /// As [`ParamView::parse`].
    pub fn parse(bytes: &[u8]) -> Result<Self, Error> {
        Self::of(LongFrame::parse(bytes)?)
    }

    /// Takes the frame if its TYPE is 2.
    ///
    /// # Errors
    /// [`Error::UnexpectedType`]
    pub fn of(frame: LongFrame<'_>) -> Result<Self, Error> {
        let view = ParamView::of(frame)?;
        Ok(Self { source: view.source(), status: view.status(), parameters: view.parameters() })
    }

    /// The frame from DA to FCS.
    pub fn emit(&self) -> [u8; Self::LEN] {
        emit(self.source, FrameType::Param, self.status, &self.parameters.emit())
    }
}

servowire_core::one_line!(Parameters {
    Self { cycle_time_ns, ipg_5ns, delay_fwd_time_ns, crc_mode, .. } =>
        "cycle {} ns, ipg {} x 5 ns, forward {} ns, CRC {:02X}h", cycle_time_ns, ipg_5ns, delay_fwd_time_ns, crc_mode.byte();
});
servowire_core::one_line!(Param { Self { parameters, status, .. } => "PARAM {}, STATUS {}", parameters, status; });
servowire_core::one_line!(ParamView<'_> { view => "PARAM {}, STATUS {}", view.parameters(), view.status(); });

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn any_32_bytes_give_themselves_back(bytes: [u8; 32]) {
            prop_assert_eq!(Parameters::parse(&bytes).emit(), bytes);
        }

        #[test]
        fn what_was_emitted_is_parsed_and_back(source: u8, status: u8, bytes: [u8; 32]) {
            let frame = Param { source, status: Status::from_bits_retain(status), parameters: Parameters::parse(&bytes) };
            let wire = frame.emit();
            prop_assert_eq!(&wire[4..36], &bytes);
            prop_assert_eq!(Param::parse(&wire), Ok(frame));
        }
    }

    #[test]
    fn every_crc_mode_splits_into_two_kinds() {
        for raw in 0..=u8::MAX {
            let (out, input) = (CrcMode(raw).out(), CrcMode(raw).input());
            assert_eq!(out == Some(CrcKind::Crc8), raw & 15 == 3);
            assert_eq!(input, CrcMode(raw >> 4).out());
            assert_eq!(out, CrcMode(raw & 15).out());
        }
        assert_eq!(Topology::from_code(2), Some(Topology::RedundantRing));
        assert_eq!((CrcKind::from_code(5), Topology::from_code(3)), (None, None));
    }
}
