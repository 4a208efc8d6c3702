use core::sync::atomic::{AtomicU32, Ordering};

/// What the receive interrupt (XINTRX) tells the exchange: that a frame has come. A `static` for both.
///
/// ```
/// use servowire_drivers::rtex::Reception;
///
/// static RECEPTION: Reception = Reception::new();
///
/// fn on_xintrx(switch_bank: impl FnOnce()) {
///     RECEPTION.frame();
///     switch_bank(); // in the external-timer system
/// }
/// # on_xintrx(|| ());
/// # assert_eq!(RECEPTION.frames(), 1);
/// ```
#[derive(Debug, Default)]
pub struct Reception {
    frames: AtomicU32,
}

impl Reception {
    /// No frame yet.
    pub const fn new() -> Self {
        Self { frames: AtomicU32::new(0) }
    }

    /// A frame has come. To be called by the receive interrupt and nothing else, before it switches the bank.
    pub fn frame(&self) {
        // One writer, so no read-modify-write is needed, which small processors do not have.
        self.frames.store(self.frames().wrapping_add(1), Ordering::Release);
    }

    /// Frames so far, modulo 2^32.
    pub fn frames(&self) -> u32 {
        self.frames.load(Ordering::Acquire)
    }
}
