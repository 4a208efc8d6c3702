//! The captures that are decoded when no file is named: published hardware logs and a firmware's trace,
//! rendered as lines.

use crate::protocols::Protocol;

/// Name and content. Where they come from is told in `captures/README.md`.
type Capture = (&'static str, &'static [u8]);

/// The captures of a protocol.
pub fn of(protocol: Protocol) -> &'static [Capture] {
    match protocol {
        Protocol::Auto | Protocol::Tformat => &CAPTURES,
        Protocol::Nikon => &NIKON,
        Protocol::Hdsl => &HDSL,
        Protocol::Rtex | Protocol::Sorte => &[],
    }
}

/// T-Format.
pub const CAPTURES: [Capture; 4] = [
    ("captures/hpm-sei-master-log.vcd", include_bytes!("../captures/hpm-sei-master-log.vcd")),
    ("captures/hpm-uart-readme.vcd", include_bytes!("../captures/hpm-uart-readme.vcd")),
    ("captures/ti-sample-output.vcd", include_bytes!("../captures/ti-sample-output.vcd")),
    ("captures/ti-uart-example.vcd", include_bytes!("../captures/ti-uart-example.vcd")),
];

/// A-format.
pub const NIKON: [Capture; 3] = [
    ("captures/nikon-hpm-sei-log.vcd", include_bytes!("../captures/nikon-hpm-sei-log.vcd")),
    ("captures/nikon-ti-console.vcd", include_bytes!("../captures/nikon-ti-console.vcd")),
    ("captures/nikon-artinchip-crc.vcd", include_bytes!("../captures/nikon-artinchip-crc.vcd")),
];

/// HIPERFACE DSL: not hardware, but the vendor's firmware on a model of its core.
pub const HDSL: [Capture; 1] = [("captures/hdsl-fw-startup.vcd", include_bytes!("../captures/hdsl-fw-startup.vcd"))];
