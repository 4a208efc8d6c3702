//! The drivers exist twice, for those who wait by spinning and for those who give the time back, with one text: it is pasted with one
//! of these for the calls that wait. What is decided is decided elsewhere, by functions that do not wait.

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
