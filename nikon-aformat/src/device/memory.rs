/// The longest times of "Nikon Protocol Design", in ns.
const READ_BUSY_NS: u32 = 300_000;
const WRITE_BUSY_NS: u32 = 30_000_000;

/// The EEPROM of an encoder and the time for which it is busy.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Memory<const BANKS: usize> {
    words: [[u16; 256]; BANKS],
    busy_until_ns: u64,
    /// The word being fetched.
    reading: Option<(u8, u8)>,
}

impl<const BANKS: usize> Memory<BANKS> {
    pub(super) const fn new() -> Self {
        Self { words: [[0xffff; 256]; BANKS], busy_until_ns: 0, reading: None }
    }

    pub(super) const fn has(bank: u8) -> bool {
        (bank as usize) < BANKS
    }

    #[expect(clippy::indexing_slicing, reason = "the bank is checked, and a byte indexes 256 words")]
    pub(super) const fn get(&self, bank: u8, address: u8) -> Option<u16> {
        if Self::has(bank) { Some(self.words[bank as usize][address as usize]) } else { None }
    }

    #[expect(clippy::indexing_slicing, reason = "the bank is checked, and a byte indexes 256 words")]
    pub(super) const fn set(&mut self, bank: u8, address: u8, data: u16) {
        if Self::has(bank) {
            self.words[bank as usize][address as usize] = data;
        }
    }

    pub(super) const fn is_busy(&self, now_ns: u64) -> bool {
        now_ns < self.busy_until_ns
    }

    pub(super) const fn busy(&mut self, now_ns: u64, time_ns: u32) {
        self.busy_until_ns = now_ns.saturating_add(time_ns as u64);
    }

    /// Returns the word, if it was requested before and has been fetched since; otherwise starts fetching it.
    pub(super) fn read(&mut self, bank: u8, address: u8, now_ns: u64) -> Option<u16> {
        if self.is_busy(now_ns) || !Self::has(bank) {
            return None;
        }
        if self.reading == Some((bank, address)) {
            self.reading = None;
            return self.get(bank, address);
        }
        self.reading = Some((bank, address));
        self.busy(now_ns, READ_BUSY_NS);
        None
    }

    /// Writes, unless the memory is busy.
    pub(super) fn write(&mut self, bank: u8, address: u8, data: u16, now_ns: u64) {
        if self.is_busy(now_ns) || !Self::has(bank) {
            return;
        }
        self.reading = None;
        self.set(bank, address, data);
        self.busy(now_ns, WRITE_BUSY_NS);
    }
}
