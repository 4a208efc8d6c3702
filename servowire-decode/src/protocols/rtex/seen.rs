//! Which drives a log shows, and which of them only where it was misread.

use rtex_block::MacId;

/// Drives, a bit for each MAC-ID.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Seen {
    /// In blocks that were read as they are.
    sound: u32,
    /// In blocks that may have been misread: since the shape was last known to hold, and in the window before.
    now: u32,
    before: u32,
    /// In blocks that were misread.
    misread: u32,
}

impl Seen {
    pub(super) fn see(&mut self, mac_id: MacId) {
        self.now |= 1 << mac_id.get();
    }

    /// The shape still holds. Bytes may have been lost just now, so the last window waits for the next one.
    pub(super) fn holds(&mut self) {
        self.sound |= self.before;
        (self.before, self.now) = (self.now, 0);
    }

    /// The log goes on in another shape, so what came last was misread.
    pub(super) fn changes(&mut self) {
        self.misread |= self.before | self.now;
        (self.before, self.now) = (0, 0);
    }

    /// Returns the drives of misread blocks that are in no other ones.
    pub(super) fn phantoms(&self) -> impl Iterator<Item = MacId> + use<> {
        let phantoms = self.misread & !(self.sound | self.before | self.now);
        (0..).take(MacId::COUNT).filter(move |number| phantoms >> number & 1 == 1).map(MacId::truncate)
    }
}
