//! Heads of H-frames: whether what they say goes on from the heads before.

use hdsl::frame::ParsedHead;
use hdsl::inspect::{FoundHead, HeadDamage, HeadFault, ends_with_trailer, find_head, head_fault, is_coded_for_balance};
use hdsl::{MasterSymbol, Window};

use super::bits::Bits;
use super::refused::Refused;

/// Heads after which what all of them did is a rule.
const RULE: u8 = 16;

/// A head at bit `at`.
pub(super) fn find(bits: &Bits, at: u64) -> Option<FoundHead> {
    find_head(bits.window(at))
}

/// What there is where the head of a frame was due.
pub(super) fn damage(what: HeadDamage) -> Refused {
    let class = match what {
        HeadDamage::Parameter => "invalid_word",
        HeadDamage::OneBit | HeadDamage::TwoBits => "head",
        HeadDamage::Missing => "missing",
    };
    (class, what.to_string())
}

/// What the heads of a link did so far.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Heads {
    /// Heads in a row that were coded for a balanced line.
    balanced: u8,
    /// Whether the frame before was answered: with its TRAILER the count of the line begins anew.
    answered: bool,
    /// Frames in a row with FIRST.
    first: u8,
    /// Frames in a row that end with TRAILER and stuffing.
    ended: u8,
    /// MSYNC of this V-frame, and for how many frames it went by the rule.
    msync: Option<bool>,
    steady: u8,
}

impl Heads {
    /// What is wrong with the head at the beginning of `line`; `at`: its place in the V-frame.
    pub(super) fn check(&mut self, head: ParsedHead, line: Window, at: Option<u8>) -> Option<Refused> {
        let symbol = head.byte.symbol();
        let (balanced, first, msync) =
            (self.is_balanced(head, line), self.is_first(head, symbol.ok()), self.goes_with_v_frame(head, at));
        self.answered = symbol.is_ok_and(MasterSymbol::is_answered);
        let refused = |class, text: &str| Some((class, text.to_owned()));
        if let Some(fault) = head_fault(head) {
            let class = match fault {
                HeadFault::UndefinedSymbol { .. } => "undefined_symbol",
                HeadFault::Reserved => "reserved",
            };
            return Some((class, fault.to_string()));
        }
        if !balanced {
            return refused(
                "disparity",
                "no byte is coded like this on a balanced line: bits of the head were flipped",
            );
        }
        if !first {
            return refused("first", "FIRST does not go with the symbol, or with the frames before");
        }
        if !msync {
            return refused("msync", "MSYNC changes within a V-frame, or does not from one to the next");
        }
        None
    }

    /// Whether what stands in front of a head is damaged, against the rule of the frames before.
    pub(super) fn trailer(&mut self, front: Window) -> bool {
        !keeps(&mut self.ended, ends_with_trailer(front))
    }

    /// In a free-running link the count of the line is 0 before each head that follows an answered frame.
    fn is_balanced(&mut self, head: ParsedHead, line: Window) -> bool {
        if head.extra_bits > 0 || !self.answered {
            return true;
        }
        keeps(&mut self.balanced, is_coded_for_balance(head, line))
    }

    /// FIRST is 0 during start-up, then 1, but for masters that send it in the frames after a pulse only.
    fn is_first(&mut self, head: ParsedHead, symbol: Option<MasterSymbol>) -> bool {
        match symbol {
            None => true,
            Some(MasterSymbol::Data(_) | MasterSymbol::Idle | MasterSymbol::Init) => {
                keeps(&mut self.first, head.byte.first())
            }
            Some(_) => !head.byte.first(),
        }
    }

    /// MSYNC is the same in the eight frames of a V-frame and changes from one to the next.
    fn goes_with_v_frame(&mut self, head: ParsedHead, at: Option<u8>) -> bool {
        let said = head.byte.msync();
        let Some(at) = at else {
            self.msync = None;
            return true;
        };
        let due = self.msync.map_or(said, |before| before != (at == 0));
        let holds = keeps(&mut self.steady, said == due);
        // A stray one does not change what is due.
        self.msync = Some(if holds { said } else { due });
        holds
    }
}

/// Whether a rule holds that was kept `so_far` times: until it is one, everything does.
fn keeps(so_far: &mut u8, kept: bool) -> bool {
    if kept {
        *so_far = (*so_far + 1).min(2 * RULE);
        return true;
    }
    let rule = *so_far >= RULE;
    // What breaks it three times in a row makes it none.
    *so_far = if rule { *so_far - RULE / 2 } else { 0 };
    !rule
}
