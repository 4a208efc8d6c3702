use crate::block::{BlockSize, LEN, exact};
use crate::code::{CyclicCode, NonCyclicCode};
use crate::command::CommandBlock;
use crate::error_code::{Alarm, ErrorCode};
use crate::header::MacId;
use crate::sub::{SubCode, split32};

/// What a drive finds wrong with the header, the codes and the sub block of a command.
///
/// Type code, index, data and the pairing of the codes come later, when the command is executed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Verdict {
    /// Error_Code of the main block.
    pub error: Option<ErrorCode>,
    /// Sub_Error_Code.
    pub sub_error: Option<ErrorCode>,
    /// The alarm that comes if the fault lasts.
    pub alarm: Option<Alarm>,
}

impl Verdict {
    /// Whether the block is thrown away and the one before it stays in force.
    pub fn is_discarded(&self) -> bool {
        self.alarm.is_some()
    }
}

/// The checks of a drive with address `mac_id`, in this order: C/R (0012h), MAC-ID (0011h), cyclic code (0021h),
/// non-cyclic code (0022h); in 32-byte mode also Sub_Chk (0012h) and the sub-command code (0022h).
///
/// Errors and alarms are those of SX-DSV02310, "Command error"; the order between several faults is not documented
/// and is this crate's. A block of the wrong size cannot happen on the ring; it counts as not addressed to
/// this drive.
pub fn check(bytes: &[u8], size: BlockSize, mac_id: MacId) -> Verdict {
    let fault = |error, alarm| Verdict { error: Some(error), sub_error: None, alarm };
    let (main, sub): (&[u8; LEN], Option<&[u8; LEN]>) = match size {
        BlockSize::Bytes16 => match exact(bytes) {
            Ok(main) => (main, None),
            Err(_) => return fault(ErrorCode::MAC_ID, Some(Alarm::CYCLIC_DATA)),
        },
        BlockSize::Bytes32 => match split32(bytes) {
            Ok((main, sub)) => (main, Some(sub)),
            Err(_) => return fault(ErrorCode::MAC_ID, Some(Alarm::CYCLIC_DATA)),
        },
    };
    let Ok(block) = CommandBlock::of(main) else { return fault(ErrorCode::DIRECTION, Some(Alarm::CYCLIC_DATA)) };
    if block.mac_id() != mac_id {
        return fault(ErrorCode::MAC_ID, Some(Alarm::CYCLIC_DATA));
    }
    let code = block.code();
    if CyclicCode::new(code.cyclic_bits()).is_none() {
        return fault(ErrorCode::CYCLIC_CODE, Some(Alarm::CYCLIC_CODE));
    }
    let mut verdict = Verdict::default();
    if NonCyclicCode::new(code.noncyclic_bits()).is_none() {
        verdict.error = Some(ErrorCode::NON_CYCLIC_CODE);
    }
    match sub {
        Some(sub) if sub[0] & 0x80 == 0 => {
            verdict.sub_error = Some(ErrorCode::DIRECTION);
            verdict.alarm = Some(Alarm::CYCLIC_DATA);
        }
        Some(sub) if SubCode::new(sub[0] & 15).is_none() => verdict.sub_error = Some(ErrorCode::NON_CYCLIC_CODE),
        _ => {}
    }
    verdict
}
