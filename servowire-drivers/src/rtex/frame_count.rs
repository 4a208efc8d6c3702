use core::sync::atomic::{AtomicU32, Ordering};

/// Tells the exchange that a frame has arrived; the receive interrupt (XINTRX) sets it. Make it a `static` that both use.
///
/// ```
/// use servowire_drivers::rtex::FrameCount;
///
/// static FRAMES: FrameCount = FrameCount::new();
///
/// fn on_xintrx(switch_bank: impl FnOnce()) {
///     FRAMES.add();
///     switch_bank(); // in the external-timer system
/// }
/// # on_xintrx(|| ());
/// # assert_eq!(FRAMES.get(), 1);
/// ```
#[derive(Debug, Default)]
pub struct FrameCount {
    frames: AtomicU32,
}

impl FrameCount {
    /// Creates a count of no frames.
    pub const fn new() -> Self {
        Self { frames: AtomicU32::new(0) }
    }

    /// Counts a frame. Call this only from the receive interrupt, before it switches the bank.
    pub fn add(&self) {
        // One writer, so no read-modify-write is needed, which small processors do not have.
        self.frames.store(self.get().wrapping_add(1), Ordering::Release);
    }

    /// Number of frames so far, modulo 2^32.
    pub fn get(&self) -> u32 {
        self.frames.load(Ordering::Acquire)
    }
}
