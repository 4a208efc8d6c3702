//! The captures that are decoded when no file is named: published hardware logs and the trace of a firmware, converted to
//! line levels.

/// Name and content. `captures/README.md` says where they come from.
type Capture = (&'static str, &'static [u8]);

/// T-Format.
pub(crate) const TFORMAT: [Capture; 4] = [
    ("captures/hpm-sei-master-log.vcd", include_bytes!("../captures/hpm-sei-master-log.vcd")),
    ("captures/hpm-uart-readme.vcd", include_bytes!("../captures/hpm-uart-readme.vcd")),
    ("captures/ti-sample-output.vcd", include_bytes!("../captures/ti-sample-output.vcd")),
    ("captures/ti-uart-example.vcd", include_bytes!("../captures/ti-uart-example.vcd")),
];

/// A-format.
pub(crate) const NIKON: [Capture; 3] = [
    ("captures/nikon-hpm-sei-log.vcd", include_bytes!("../captures/nikon-hpm-sei-log.vcd")),
    ("captures/nikon-ti-console.vcd", include_bytes!("../captures/nikon-ti-console.vcd")),
    ("captures/nikon-artinchip-crc.vcd", include_bytes!("../captures/nikon-artinchip-crc.vcd")),
];

/// HIPERFACE DSL: not recorded from hardware, but from the vendor's firmware running on a model of its core.
pub(crate) const HDSL: [Capture; 1] =
    [("captures/hdsl-fw-startup.vcd", include_bytes!("../captures/hdsl-fw-startup.vcd"))];
