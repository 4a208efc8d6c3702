//! Rules that hold from frame to frame of a link. What all heads so far have in common is a rule, and a head that breaks it was
//! damaged.

use nrz_line::Window;

use super::disparity::Chain;
use super::head::{HeadFault, ends_with_trailer, head_fault, is_coded_for_balance};
use crate::frame::ParsedHead;
use crate::parameter::MasterSymbol;
use crate::symbol::RunningDisparity;

/// The number of heads that have to agree before their behaviour becomes a rule.
const RULE: u8 = 16;

/// The faults of a head, judged by the heads before it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum BrokenRule {
    /// The head itself is wrong.
    Fault(HeadFault),
    /// No byte is coded in this way on a balanced line.
    Balance,
    /// FIRST.
    First,
    /// MSYNC.
    Msync,
}

servowire_core::one_line!(BrokenRule {
    Self::Fault(fault) => "{}", fault;
    Self::Balance => "no byte is coded like this on a balanced line: bits of the head were flipped";
    Self::First => "FIRST does not go with the symbol, or with the frames before";
    Self::Msync => "MSYNC changes within a V-frame, or does not from one to the next";
});

impl BrokenRule {
    /// The class of the check, for statistics.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Fault(HeadFault::UndefinedSymbol { .. }) => "undefined_symbol",
            Self::Fault(HeadFault::Reserved) => "reserved",
            Self::Balance => "disparity",
            Self::First => "first",
            Self::Msync => "msync",
        }
    }
}

/// How many times a rule was kept.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Hash)]
struct Kept(u8);

impl Kept {
    /// Returns whether the rule holds; until it has become a rule, everything is accepted.
    fn holds(&mut self, kept: bool) -> bool {
        if kept {
            self.0 = self.0.saturating_add(1).min(2 * RULE);
            return true;
        }
        let rule = self.0 >= RULE;
        // What breaks it three times in a row makes it none.
        self.0 = if rule { self.0.saturating_sub(RULE / 2) } else { 0 };
        !rule
    }
}

/// How the heads of a link have behaved so far.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Hash)]
pub struct HeadRules {
    /// Number of heads in a row that were coded for a balanced line.
    balanced: Kept,
    /// Whether the previous frame was answered; if so, its TRAILER has reset the line disparity.
    answered: bool,
    /// Number of frames in a row with FIRST.
    first: Kept,
    /// Number of frames in a row that end with TRAILER and stuffing.
    ended: Kept,
    /// MSYNC of this V-frame, and the number of frames for which it has followed the rule.
    msync: Option<bool>,
    steady: Kept,
}

impl HeadRules {
    /// Number of heads from which a rule is learned; one in this many may break it.
    const LESSON: usize = 8;

    /// Learns the rules from the first heads of a link, which are consecutive, each given with the line that it begins.
    pub fn learn(&mut self, heads: &[(ParsedHead, Window)]) {
        let rule = |kept: usize, all: usize| all >= Self::LESSON && all.saturating_sub(kept) <= all / Self::LESSON;
        let of = |head: &ParsedHead| head.byte.symbol().ok();
        let answered = heads.windows(2).filter_map(|pair| match pair {
            [(before, _), next] => of(before).is_some_and(MasterSymbol::is_answered).then_some(*next),
            _ => None,
        });
        let balanced = || answered.clone().filter(|(head, _)| head.extra_bits == 0);
        let kept = balanced().filter(|(head, line)| is_coded_for_balance(*head, *line)).count();
        if rule(kept, balanced().count()) {
            self.balanced = Kept(RULE);
        }
        let running = || heads.iter().filter(|(head, _)| of(head).is_some_and(may_be_first));
        let kept = running().filter(|(head, _)| head.byte.first()).count();
        if rule(kept, running().count()) {
            self.first = Kept(RULE);
        }
    }

    /// Returns what is wrong with the head at the start of `line`; `at` is its place in the V-frame, 0..=7, if known.
    pub fn check(&mut self, head: ParsedHead, line: Window, at: Option<u8>) -> Option<BrokenRule> {
        let symbol = head.byte.symbol().ok();
        let (balanced, first, msync) =
            (self.is_balanced(head, line), self.is_first(head, symbol), self.goes_with_v_frame(head, at));
        self.answered = symbol.is_some_and(MasterSymbol::is_answered);
        let broken = [(balanced, BrokenRule::Balance), (first, BrokenRule::First), (msync, BrokenRule::Msync)];
        let broken = broken.into_iter().find(|(holds, _)| !holds).map(|(_, rule)| rule);
        head_fault(head).map(BrokenRule::Fault).or(broken)
    }

    /// Returns whether the bits before a head, as [`ends_with_trailer`] takes them, are damaged.
    pub fn is_end_damaged(&mut self, front: Window) -> bool {
        !self.ended.holds(ends_with_trailer(front))
    }

    /// Checks whether the head is coded for a balanced line: in a free-running link the line disparity is 0 before each head
    /// that follows an answered frame.
    fn is_balanced(&mut self, head: ParsedHead, line: Window) -> bool {
        head.extra_bits > 0 || !self.answered || self.balanced.holds(is_coded_for_balance(head, line))
    }

    /// Checks FIRST, which is 0 during start-up, then 1, except with masters that send it only in the frames after a pulse.
    fn is_first(&mut self, head: ParsedHead, symbol: Option<MasterSymbol>) -> bool {
        match symbol {
            None => true,
            Some(symbol) if may_be_first(symbol) => self.first.holds(head.byte.first()),
            Some(_) => !head.byte.first(),
        }
    }

    /// Checks MSYNC, which is constant within the eight frames of a V-frame and changes from one V-frame to the next.
    fn goes_with_v_frame(&mut self, head: ParsedHead, at: Option<u8>) -> bool {
        let said = head.byte.msync();
        let Some(at) = at else {
            self.msync = None;
            return true;
        };
        let due = self.msync.map_or(said, |before| before != (at == 0));
        let holds = self.steady.holds(said == due);
        // A stray one does not change what is due.
        self.msync = Some(if holds { said } else { due });
        holds
    }
}

/// Whether FIRST may be 1 in a frame with this symbol.
const fn may_be_first(symbol: MasterSymbol) -> bool {
    matches!(symbol, MasterSymbol::Data(_) | MasterSymbol::Idle | MasterSymbol::Init)
}

/// Learns from the line with which running disparity the answers of an encoder begin, because no document says so.
///
/// An answer that begins with + after one that ended with + has carried the disparity on; one that begins with - in that place
/// has restarted it. After an answer that ended with -, the next one begins with - in either case, which proves nothing.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Hash)]
pub struct Beginnings {
    carried: u32,
    anew: u32,
}

impl Beginnings {
    /// The number of answers that have to agree before this is taken as a rule.
    const LEAST: u32 = 4;
    /// One answer in this many may disagree.
    const OF: u32 = 8;

    /// Takes two answers that followed each other.
    pub fn note(&mut self, before: Chain, next: Chain) {
        let count = match (before.after(), next.before()) {
            (Some(RunningDisparity::Plus), Some(RunningDisparity::Plus)) => &mut self.carried,
            (Some(RunningDisparity::Plus), Some(RunningDisparity::Minus)) => &mut self.anew,
            _ => return,
        };
        *count = count.saturating_add(1);
        if self.carried.saturating_add(self.anew) > 4096 {
            (self.carried, self.anew) = (self.carried / 2, self.anew / 2);
        }
    }

    /// Returns whether nearly all answers so far began with the disparity with which the previous one ended.
    pub const fn are_carried(self) -> bool {
        Self::is_rule(self.carried, self.anew)
    }

    /// Returns whether nearly all answers so far began with -, however the previous one ended.
    pub const fn are_anew(self) -> bool {
        Self::is_rule(self.anew, self.carried)
    }

    const fn is_rule(told: u32, other: u32) -> bool {
        told >= Self::LEAST && told >= other.saturating_mul(Self::OF)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::Head;
    use crate::line_code::LineDisparity;
    use crate::parameter::ParameterByte;

    /// An answer that begins and ends so: D16.0 in the column of its beginning, then D3.0, which changes the disparity, or
    /// D21.5, which does not.
    fn answer(begins: char, ends: char) -> Chain {
        let first = if begins == '-' { "0110110100" } else { "1001001011" };
        let last = match (begins, ends) {
            ('-', '+') => "1100011011",
            ('+', '-') => "1100010100",
            _ => "1010101010",
        };
        let text = [first, "1010101010", "1010101010", "1010101010", "1010101010", "1", last].concat();
        let chain = Chain::of(text.bytes().rev().fold(0, |bits, bit| bits << 1 | u64::from(bit == b'1')));
        assert!(chain.holds());
        chain
    }

    #[test]
    fn answers_tell_whether_they_are_carried_on_or_begin_anew() {
        let noted = |pairs: &[(&str, &str)]| {
            let mut beginnings = Beginnings::default();
            for (before, next) in pairs {
                let [before, next] = [before, next].map(|it| answer(it.as_bytes()[0].into(), it.as_bytes()[1].into()));
                beginnings.note(before, next);
            }
            (beginnings.are_carried(), beginnings.are_anew())
        };
        // After - both begin with -: as many as one likes are no rule.
        assert_eq!(noted(&[("+-", "-+"); 20]), (false, false));
        assert_eq!(noted(&[("-+", "+-"); 3]), (false, false));
        assert_eq!(noted(&[("-+", "+-"); 4]), (true, false));
        assert_eq!(noted(&[("-+", "-+"); 3]), (false, false));
        assert_eq!(noted(&[("-+", "-+"); 4]), (false, true));
        // One of eight may be damaged.
        assert_eq!(noted(&[&[("-+", "+-"); 8][..], &[("-+", "-+")]].concat()), (true, false));
        assert_eq!(noted(&[&[("-+", "+-"); 7][..], &[("-+", "-+")]].concat()), (false, false));
    }

    #[test]
    fn a_rule_is_broken_after_sixteen_that_kept_it_and_given_up_after_three_that_did_not() {
        let mut kept = Kept::default();
        assert!((0..15).all(|_| kept.holds(true)));
        assert!(kept.holds(false), "15 are no rule");
        assert!((0..16).all(|_| kept.holds(true)));
        assert!(!kept.holds(false) && kept.holds(false), "16 are one, and only just");
        assert!((0..100).all(|_| kept.holds(true)));
        assert_eq!([false; 4].map(|it| kept.holds(it)), [false, false, false, true]);
    }

    /// A head as a master sends it on a balanced line.
    fn head(symbol: MasterSymbol, first: bool, msync: bool) -> (ParsedHead, Window) {
        let byte = ParameterByte::of(symbol);
        let byte = if first { byte.with_first() } else { byte };
        let byte = if msync { byte.with_msync() } else { byte };
        let line = Head::new(byte, None, LineDisparity::ZERO).bits();
        (Head::parse(line).unwrap(), line)
    }

    #[test]
    fn first_msync_and_balance_are_followed() {
        let mut rules = HeadRules::default();
        let mut check = |first: bool, msync: bool, at: u8| {
            let (head, line) = head(MasterSymbol::Idle, first, msync);
            rules.check(head, line, Some(at))
        };
        for frame in 0..40_u8 {
            assert_eq!(check(true, frame / 8 % 2 == 1, frame % 8), None);
        }
        assert_eq!(check(true, false, 0), Some(BrokenRule::Msync), "the sixth V-frame has MSYNC 1");
        assert_eq!(check(true, true, 1), None);
        assert_eq!(check(false, true, 2), Some(BrokenRule::First));
        // The same byte, coded as after a line that was not balanced: a head with all fixed bits in place.
        let byte = ParameterByte::of(MasterSymbol::Idle).with_first().with_msync();
        let other = [2, -2, 6].map(LineDisparity::new);
        let strange = other.map(|before| Head::new(byte, None, before).bits());
        let strange: std::vec::Vec<_> =
            strange.into_iter().filter(|line| *line != Head::new(byte, None, LineDisparity::ZERO).bits()).collect();
        assert!(!strange.is_empty(), "another count of the line is coded in another way");
        for line in strange {
            assert_eq!(rules.check(Head::parse(line).unwrap(), line, Some(3)), Some(BrokenRule::Balance));
        }
    }

    /// FIRST is 0 during the start-up, whatever the frames after it do.
    #[test]
    fn first_in_the_start_up() {
        for symbol in (0..32).filter_map(MasterSymbol::from_code) {
            let mut rules = HeadRules::default();
            let mut check = |first| {
                let (head, line) = head(symbol, first, false);
                rules.check(head, line, None)
            };
            let running = may_be_first(symbol);
            assert_eq!((check(true), check(false)), ((!running).then_some(BrokenRule::First), None), "{symbol:?}");
        }
        // And heads of the start-up teach nothing about FIRST.
        let mut rules = HeadRules::default();
        rules.learn(&[head(MasterSymbol::Check, true, false); 12]);
        let (head, line) = head(MasterSymbol::Idle, false, false);
        assert_eq!(rules.check(head, line, None), None);
    }

    /// In sync mode the line is not balanced before EQUALISATION, and each head is coded for its own window.
    #[test]
    fn heads_with_a_window_are_not_judged_by_their_code() {
        let mut rules = HeadRules::default();
        for _ in 0..40 {
            let (head, line) = head(MasterSymbol::Idle, true, false);
            assert_eq!(rules.check(head, line, None), None);
        }
        let byte = ParameterByte::of(MasterSymbol::Idle).with_first();
        let line = Head::new(byte, crate::frame::Extra::new(48), LineDisparity::new(6)).bits();
        let head = Head::parse(line).unwrap();
        assert!(head.extra_bits == 6 && !is_coded_for_balance(head, line));
        assert_eq!(rules.check(head, line, None), None);
    }

    #[test]
    fn classes_of_rules() {
        let fault = [HeadFault::UndefinedSymbol { symbol: 0x12 }, HeadFault::Reserved].map(BrokenRule::Fault);
        assert_eq!(fault.map(BrokenRule::name), ["undefined_symbol", "reserved"]);
        let rules = [BrokenRule::Balance, BrokenRule::First, BrokenRule::Msync];
        assert_eq!(rules.map(BrokenRule::name), ["disparity", "first", "msync"]);
    }

    /// What was seen long ago weighs less: after 10,000 answers that were carried on, some 6,500 that begin anew are the rule, not
    /// 80,000.
    #[test]
    fn an_encoder_that_changes_its_mind() {
        let [carried, anew] = ['+', '-'].map(|begins| answer(begins, if begins == '+' { '-' } else { '+' }));
        let (before, mut beginnings) = (answer('-', '+'), Beginnings::default());
        (0..10_000).for_each(|_| beginnings.note(before, carried));
        assert!(beginnings.are_carried());
        let until = (1..80_000).find(|_| {
            beginnings.note(before, anew);
            beginnings.are_anew()
        });
        assert!(until.is_some_and(|until| (6_000..7_000).contains(&until)), "{until:?}");
    }

    /// A head with FIRST 0 among others is damage at once if the first heads had it.
    #[test]
    fn what_the_first_heads_do_is_learned() {
        let lesson = |odd: &[usize], count: usize| -> std::vec::Vec<_> {
            (0..count).map(|at| head(MasterSymbol::Idle, !odd.contains(&at), false)).collect()
        };
        let refuses = |heads: &[(ParsedHead, Window)]| {
            let mut rules = HeadRules::default();
            rules.learn(heads);
            let (head, line) = head(MasterSymbol::Idle, false, false);
            rules.check(head, line, None) == Some(BrokenRule::First)
        };
        assert!(refuses(&lesson(&[], 8)) && refuses(&lesson(&[3], 8)));
        assert!(!refuses(&lesson(&[], 7)) && !refuses(&lesson(&[3, 5], 12)));
        // Coded as after a line that was not balanced.
        let byte = ParameterByte::of(MasterSymbol::Idle).with_first();
        let strange = Head::new(byte, None, LineDisparity::new(6)).bits();
        let strange = (Head::parse(strange).unwrap(), strange);
        let balance = |heads: &[(ParsedHead, Window)]| {
            let mut rules = HeadRules::default();
            rules.learn(heads);
            let (head, line) = head(MasterSymbol::Idle, true, false);
            assert_eq!(rules.check(head, line, None), None);
            rules.check(strange.0, strange.1, None) == Some(BrokenRule::Balance)
        };
        assert!(balance(&lesson(&[], 9)) && !balance(&lesson(&[], 8)) && !balance(&[strange; 12]));
    }

    #[test]
    fn a_trailer_that_is_missing_after_many_is_damage() {
        let mut rules = HeadRules::default();
        let good = Window::from_bits(0b11_0000, 6).unwrap();
        let bad = Window::from_bits(0b10_0000, 6).unwrap();
        assert!(!rules.is_end_damaged(bad));
        assert!((0..16).all(|_| !rules.is_end_damaged(good)));
        assert!(rules.is_end_damaged(bad));
    }
}
