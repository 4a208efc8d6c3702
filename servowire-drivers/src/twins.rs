//! The drivers exist twice, as blocking drivers that spin and as async ones that yield, from one source text. The text is
//! expanded with one of these macros for the calls that wait. All decisions are made elsewhere, by functions that do not wait.

macro_rules! spun {
    ($call:expr) => {
        $call
    };
}

#[cfg(feature = "async")]
macro_rules! awaited {
    ($call:expr) => {
        $call.await
    };
}
