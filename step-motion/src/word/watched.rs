//! A word that lets the interrupt come before it is read or written.

use core::cell::RefCell;
use core::sync::atomic::{AtomicU32, Ordering};
use std::boxed::Box;

std::thread_local! {
    static INTERRUPT: RefCell<Option<Box<dyn FnMut()>>> = const { RefCell::new(None) };
}

/// Has a function called before each access of this thread, but for those that it makes itself.
pub(super) fn interrupt(come: Option<Box<dyn FnMut()>>) {
    INTERRUPT.set(come);
}

#[derive(Debug)]
pub(crate) struct Word(AtomicU32);

impl Word {
    pub(crate) const fn new(value: u32) -> Self {
        Self(AtomicU32::new(value))
    }

    #[inline]
    pub(crate) fn load(&self, order: Ordering) -> u32 {
        come();
        self.0.load(order)
    }

    #[inline]
    pub(crate) fn store(&self, value: u32, order: Ordering) {
        come();
        self.0.store(value, order);
    }
}

fn come() {
    let interrupt = INTERRUPT.take();
    if let Some(mut come) = interrupt {
        come();
        INTERRUPT.set(Some(come));
    }
}
