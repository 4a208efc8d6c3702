//! Ctrl-C: what runs ends in order and prints its figures; the second one ends the program at once.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, LazyLock};

use signal_hook::consts::{SIGINT, SIGTERM};
use signal_hook::flag::{register, register_conditional_shutdown};

/// What a shell expects of a program that Ctrl-C has ended.
const ENDED: i32 = 128 + SIGINT;

static ASKED: LazyLock<Arc<AtomicBool>> = LazyLock::new(Arc::default);

/// From now on Ctrl-C is only noted. Where the system does not let that be, it ends the program as ever.
pub(crate) fn note() {
    for signal in [SIGINT, SIGTERM] {
        let _ = register_conditional_shutdown(signal, ENDED, Arc::clone(&ASKED))
            .and_then(|_| register(signal, Arc::clone(&ASKED)));
    }
}

/// Whether the program was asked to end.
pub(crate) fn asked() -> bool {
    ASKED.load(Ordering::Relaxed)
}
