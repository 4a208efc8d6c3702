//! The kernels: one function for each public entry point that firmware calls.
//!
//! Each is a symbol of its own, so that `run.sh` finds it in the image and walks what it calls. A protocol is one file
//! here, one line in [`ALL`], and its figures in `budget.toml` (`run.sh --record` adds them).

#[cfg(feature = "servowire-core")]
mod core_feedback;
pub(crate) mod core_time;
#[cfg(feature = "deliberate-panic")]
mod deliberate_panic;
#[cfg(feature = "servowire-drivers")]
mod drivers;
#[cfg(feature = "servowire-drivers")]
mod drv8711;
#[cfg(feature = "hdsl")]
mod hdsl;
#[cfg(feature = "hdsl")]
#[path = "../../../hdsl/tests/all/cable.rs"]
mod hdsl_cable;
#[cfg(feature = "hdsl")]
mod hdsl_frame;
#[cfg(feature = "nikon-aformat")]
mod nikon;
#[cfg(feature = "nikon-aformat")]
mod nikon_ends;
#[cfg(feature = "nrz-line")]
pub(crate) mod nrz_line;
#[cfg(feature = "rtex-block")]
mod rtex;
#[cfg(feature = "sorte-proto")]
mod sorte;
#[cfg(feature = "step-motion")]
mod step_motion;
#[cfg(feature = "step-profile")]
mod step_profile;
#[cfg(feature = "step-motion")]
mod step_timer;
#[cfg(feature = "tformat")]
mod tformat;
#[cfg(feature = "tformat")]
mod tformat_ends;

/// An entry point that is measured and walked.
pub(crate) struct Kernel {
    /// Its symbol.
    pub(crate) name: &'static str,
    /// Instructions of one call, in tenths.
    pub(crate) tenths: fn() -> u32,
}

pub(crate) const ALL: &[&[Kernel]] = &[
    #[cfg(feature = "servowire-core")]
    core_time::KERNELS,
    #[cfg(feature = "servowire-core")]
    core_feedback::KERNELS,
    #[cfg(feature = "nrz-line")]
    nrz_line::KERNELS,
    #[cfg(feature = "hdsl")]
    hdsl::KERNELS,
    #[cfg(feature = "hdsl")]
    hdsl_frame::KERNELS,
    #[cfg(feature = "nikon-aformat")]
    nikon::KERNELS,
    #[cfg(feature = "nikon-aformat")]
    nikon_ends::KERNELS,
    #[cfg(feature = "rtex-block")]
    rtex::KERNELS,
    #[cfg(feature = "sorte-proto")]
    sorte::KERNELS,
    #[cfg(feature = "step-motion")]
    step_timer::KERNELS,
    #[cfg(feature = "step-motion")]
    step_motion::KERNELS,
    #[cfg(feature = "step-profile")]
    step_profile::KERNELS,
    #[cfg(feature = "tformat")]
    tformat::KERNELS,
    #[cfg(feature = "tformat")]
    tformat_ends::KERNELS,
    #[cfg(feature = "servowire-drivers")]
    drivers::KERNELS,
    #[cfg(feature = "servowire-drivers")]
    drv8711::KERNELS,
    #[cfg(feature = "deliberate-panic")]
    deliberate_panic::KERNELS,
];

/// Defines `KERNELS`: functions that stay functions under their own names, with the inputs they are measured over.
///
/// ```text
/// kernels! {
///     /// What it does.
///     fn protocol_name(input: &Input) -> Output { ... } over INPUTS;
/// }
/// ```
macro_rules! kernels {
    ($($(#[$doc:meta])* fn $name:ident($input:tt: &$from:ty) -> $to:ty $body:block over $inputs:expr;)*) => {
        $(
            $(#[$doc])*
            #[expect(unsafe_code, reason = "the symbol is how run.sh finds the kernel")]
            #[inline(never)]
            #[unsafe(no_mangle)]
            fn $name($input: &'static $from) -> $to $body
        )*

        pub(crate) const KERNELS: &[$crate::kernels::Kernel] = &[
            $($crate::kernels::Kernel {
                name: stringify!($name),
                tenths: || $crate::count::tenths($name, const { &$inputs }),
            },)*
        ];
    };
}
use kernels;

/// As [`kernels`], for kernels that work on a state, each with how it is measured.
#[cfg(any(feature = "servowire-core", feature = "servowire-drivers", feature = "step-motion"))]
macro_rules! kernels_on_states {
    ($($(#[$doc:meta])* fn $name:ident($state:tt: &mut $of:ty, $input:tt: &$from:ty) -> $to:ty $body:block as $tenths:block)*) => {
        $(
            $(#[$doc])*
            #[expect(unsafe_code, reason = "the symbol is how run.sh finds the kernel")]
            #[inline(never)]
            #[unsafe(no_mangle)]
            fn $name($state: &mut $of, $input: &'static $from) -> $to $body
        )*

        pub(crate) const KERNELS: &[$crate::kernels::Kernel] = &[$($crate::kernels::Kernel { name: stringify!($name), tenths: || $tenths },)*];
    };
}
#[cfg(any(feature = "servowire-core", feature = "servowire-drivers", feature = "step-motion"))]
use kernels_on_states;
