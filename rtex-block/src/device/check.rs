use super::literals::{
    ERR86_0, ERR86_1, NON_CYCLIC, SUB, WRONG_CYCLIC, WRONG_DIRECTION, WRONG_MAC_ID, WRONG_NON_CYCLIC,
};
use crate::block::BlockSize;
use crate::error_code::{Alarm, ErrorCode};
use crate::header::MacId;

/// The faults that a drive finds in the header, the codes and the sub block of a command.
///
/// Type code, index, data and the pairing of the codes come later, when the command is executed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Verdict {
    /// Error_Code of the main block.
    pub error: Option<ErrorCode>,
    /// Sub_Error_Code.
    pub sub_error: Option<ErrorCode>,
    /// The alarm raised if the fault lasts.
    pub alarm: Option<Alarm>,
}

impl Verdict {
    /// Returns whether the block is discarded and the previous one stays in force.
    ///
    /// ```
    /// use rtex_block::{BlockSize, MacId, device::check};
    /// let block = [0x85, 0x20, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0];
    /// assert!(check(&block, BlockSize::Bytes16, MacId::new(5).unwrap()).is_discarded());
    /// ```
    pub fn is_discarded(&self) -> bool {
        self.alarm.is_some()
    }

    const fn discard(error: u16, (main, sub): (u8, u8)) -> Self {
        Self { error: Some(ErrorCode(error)), sub_error: None, alarm: Some(Alarm { main, sub }) }
    }
}

/// Makes the checks of a drive with address `mac_id`, in this order: C/R (0012h), MAC-ID (0011h), cyclic code (0021h),
/// non-cyclic code (0022h); in 32-byte mode also Sub_Chk (0012h) and the sub-command code (0022h).
///
/// Errors and alarms are those of SX-DSV02310, "Command error"; the order in which several faults are reported is not
/// documented and was chosen for this crate. A block of the wrong size cannot occur on the ring; it is treated as not
/// addressed to this drive.
pub fn check(bytes: &[u8], size: BlockSize, mac_id: MacId) -> Verdict {
    let &[byte0, byte1, ..] = bytes else { return Verdict::discard(WRONG_MAC_ID, ERR86_0) };
    let len = match size {
        BlockSize::Bytes16 => 16,
        BlockSize::Bytes32 => 32,
    };
    if bytes.len() != len {
        return Verdict::discard(WRONG_MAC_ID, ERR86_0);
    }
    if byte0 & 0x80 != 0 {
        return Verdict::discard(WRONG_DIRECTION, ERR86_0);
    }
    if byte0 & 0x1f != mac_id.get() {
        return Verdict::discard(WRONG_MAC_ID, ERR86_0);
    }
    if byte1 >> 4 & 7 > 4 {
        return Verdict::discard(WRONG_CYCLIC, ERR86_1);
    }
    let mut verdict = Verdict::default();
    if !NON_CYCLIC.contains(&(byte1 & 0x0f)) {
        verdict.error = Some(ErrorCode(WRONG_NON_CYCLIC));
    }
    match bytes.get(16) {
        Some(byte16) if byte16 & 0x80 == 0 => {
            verdict.sub_error = Some(ErrorCode(WRONG_DIRECTION));
            let (main, sub) = ERR86_0;
            verdict.alarm = Some(Alarm { main, sub });
        }
        Some(byte16) if !SUB.contains(&(byte16 & 0x0f)) => verdict.sub_error = Some(ErrorCode(WRONG_NON_CYCLIC)),
        _ => {}
    }
    verdict
}
