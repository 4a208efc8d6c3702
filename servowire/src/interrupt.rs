//! Ctrl-C: the first one ends the program in an orderly way, with its figures printed; the second ends it at once.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, LazyLock};

use signal_hook::consts::{SIGINT, SIGTERM};
use signal_hook::flag::{register, register_conditional_shutdown};

/// The exit code that a shell expects of a program ended by Ctrl-C.
const ENDED: i32 = 128 + SIGINT;

static ASKED: LazyLock<Arc<AtomicBool>> = LazyLock::new(Arc::default);

/// Makes Ctrl-C only set a flag from now on. If the system does not allow that, it ends the program as usual.
pub(crate) fn note() {
    for signal in [SIGINT, SIGTERM] {
        let _ = register_conditional_shutdown(signal, ENDED, Arc::clone(&ASKED))
            .and_then(|_| register(signal, Arc::clone(&ASKED)));
    }
}

/// Returns whether the program was asked to end.
pub(crate) fn asked() -> bool {
    ASKED.load(Ordering::Relaxed)
}
