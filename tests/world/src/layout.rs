use crate::bits::Bits;
use crate::{Fault, Framing, Message};

/// The bits of a transmission on the line, and where the units were put.
pub(crate) struct Layout {
    pub(crate) image: Bits,
    /// First bit, number of bits, number of the unit, whether it left.
    placed: Vec<(usize, usize, usize, bool)>,
}

impl Layout {
    pub(crate) fn of(message: &Message, faults: &[(usize, Fault)]) -> Self {
        let mut layout = Self { image: Bits::new(), placed: Vec::new() };
        for (index, unit) in message.units.iter().enumerate() {
            layout.image.idle(if index > 0 { message.gap_bits } else { 0 });
            let (mut bits, mut times, mut leaves) = (unit.clone(), 1, true);
            for (_, fault) in faults.iter().filter(|(unit, _)| *unit == index) {
                match fault {
                    Fault::Cut => return layout,
                    Fault::Drop => leaves = false,
                    Fault::Repeat => times += 1,
                    Fault::Flip { bit } => bits.flip(usize::from(*bit)),
                    Fault::Idle { bits } => layout.image.idle(usize::from(*bits)),
                    _ => {}
                }
            }
            for _ in 0..times {
                layout.placed.push((layout.image.len(), bits.len(), index, leaves));
                if leaves {
                    layout.image.extend(&bits);
                } else {
                    layout.image.idle(bits.len());
                }
            }
        }
        layout
    }

    /// First bit and number of bits of each unit that a receiver finds.
    pub(crate) fn units(&self, framing: Framing) -> Vec<(usize, usize)> {
        let Framing::StartStop { width } = framing else {
            return self.placed.iter().filter(|place| place.3).map(|place| (place.0, place.1)).collect();
        };
        let len = width as usize + 2;
        let (mut found, mut at, mut before) = (Vec::new(), 0, true);
        while at < self.image.len() {
            let level = self.image.get(at);
            if before && !level {
                found.push((at, len));
                at += len;
                before = self.image.get(at - 1);
            } else {
                before = level;
                at += 1;
            }
        }
        found
    }

    /// Which unit was sent at this bit.
    pub(crate) fn index(&self, at: usize) -> usize {
        self.placed.iter().rev().find(|place| place.0 <= at).map_or(0, |place| place.2)
    }

    /// Begin of the last copy of the first unit that left.
    pub(crate) fn again(&self) -> usize {
        let mut left = self.placed.iter().filter(|place| place.3);
        let first = left.next().map_or((0, 0), |place| (place.0, place.2));
        left.take_while(|place| place.2 == first.1).last().map_or(first.0, |place| place.0)
    }

    /// Begin of the first unit that left, end of the last, and the same for its first copy if it was repeated.
    pub(crate) fn ends(&self) -> (usize, usize, usize) {
        let mut left = self.placed.iter().filter(|place| place.3);
        let first = left.next().map_or(0, |place| place.0);
        let last = self.placed.iter().rev().find(|place| place.3);
        let end = |place: &(usize, usize, usize, bool)| place.0 + place.1;
        let copy = last.and_then(|last| self.placed.iter().find(|place| place.2 == last.2));
        (first, last.map_or(first, end), copy.map_or(first, end))
    }
}
