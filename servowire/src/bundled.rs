//! The captures that are decoded when no file is named: published hardware logs, rendered as lines.

/// Name and content. Where they come from is told in `captures/README.md`.
pub const CAPTURES: [(&str, &[u8]); 4] = [
    ("captures/hpm-sei-master-log.vcd", include_bytes!("../captures/hpm-sei-master-log.vcd")),
    ("captures/hpm-uart-readme.vcd", include_bytes!("../captures/hpm-uart-readme.vcd")),
    ("captures/ti-sample-output.vcd", include_bytes!("../captures/ti-sample-output.vcd")),
    ("captures/ti-uart-example.vcd", include_bytes!("../captures/ti-uart-example.vcd")),
];
