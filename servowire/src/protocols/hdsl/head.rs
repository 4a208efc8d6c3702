//! Heads of H-frames: where they are, and whether what they say goes on from the heads before.

use hdsl::frame::{Head, ParsedHead};
use hdsl::{LineDisparity, MasterSymbol, Window};

use super::Refused;
use super::bits::Bits;

/// SYNC and the two ones of SAMPLE, the first bit in bit 0.
const PATTERN: u128 = 0b1111_0100;
/// Heads after which what all of them did is a rule.
const RULE: u8 = 16;

/// A head at bit `at`; the partly high last bit of an EXTRA window can have been rounded to one bit more in all.
pub(super) fn find(bits: &Bits, at: u64) -> Option<(ParsedHead, u64)> {
    let raw = bits.load(at);
    if raw & 0xff != PATTERN {
        return None;
    }
    let line = bits.window(at);
    if let Ok(head) = Head::parse(line) {
        return Some((head, head.len.into()));
    }
    let ones = (raw >> 8).trailing_ones();
    if !(3..=10).contains(&ones) || (raw >> (8 + ones)).trailing_zeros() != 2 {
        return None;
    }
    let low = raw & ((1 << (8 + ones)) - 1);
    let shorter = Window::from_bits(low | raw >> (9 + ones) << (8 + ones), line.len().checked_sub(1)?)?;
    Head::parse(shorter).ok().map(|head| (head, u64::from(head.len) + 1))
}

/// What there is where the head of a frame was due, within three bits.
pub(super) fn damage(line: u128) -> Refused {
    // 0 0 1 0 1 1, 1 1 0, 1 1 0
    const WHOLE: u128 = 0b0110_1111_0100;
    let near = (0..=6).map(|at| ((line >> at & 0xfff) ^ WHOLE).count_ones()).min().unwrap_or(12);
    match near {
        0 => ("invalid_word", "the parameter word of the head is in no table".to_owned()),
        1 => ("head", "a bit of the frame's head is wrong".to_owned()),
        2 => ("head", "two bits of the frame's head are wrong".to_owned()),
        _ => ("missing", "a frame is missing".to_owned()),
    }
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
    /// What is wrong with a head that stands by itself. `coded`: its EQUALISATION and PARA, the first bit in bit 0;
    /// `at`: its place in the V-frame.
    pub(super) fn check(&mut self, head: ParsedHead, coded: u16, at: Option<u8>) -> Option<Refused> {
        let symbol = head.byte.symbol();
        let (balanced, first, msync) =
            (self.is_balanced(head, coded), self.is_first(head, symbol.ok()), self.goes_with_v_frame(head, at));
        self.answered = symbol.is_ok_and(MasterSymbol::is_answered);
        let refused = |class, text: &str| Some((class, text.to_owned()));
        if let Err(error) = symbol {
            return Some(super::refusal(error));
        }
        if head.byte.raw() & 0x20 != 0 {
            return refused("reserved", "bit 5 of the parameter byte is 1, and it is reserved");
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

    /// Whether what stands in front of a head is damaged, against the rule of the frames before: TRAILER, then blocks of
    /// stuffing. `front`: 120 bits, the last of them before the head.
    pub(super) fn trailer(&mut self, front: u128) -> bool {
        // 0 0 1 0 1 1 and what the master drives of TRAILER, 0 0 0 0 1 1, the first bit in bit 0.
        const STUFFING: u128 = 0b11_0100;
        const TRAILER: u128 = 0b11_0000;
        let last = (0..20).map(|k| front >> (114 - 6 * k) & 0x3f).find(|block| *block != STUFFING);
        !keeps(&mut self.ended, last.is_none_or(|block| block == TRAILER))
    }

    /// In a free-running link the count of the line is 0 before each head that follows an answered frame.
    fn is_balanced(&mut self, head: ParsedHead, coded: u16) -> bool {
        if head.extra_bits > 0 || !self.answered {
            return true;
        }
        let (due, _) = Head::new(head.byte, None, LineDisparity::ZERO);
        keeps(&mut self.balanced, coded == u16::from(due.equalisation()) | due.para().get() << 4)
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
