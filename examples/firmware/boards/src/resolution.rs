//! The encoder of the T-Format images.

use tformat::Resolution;

/// That of your encoder; one that says by its identification that it has another one gives no position.
pub const RESOLUTION: Resolution = match Resolution::new(23, 16) {
    Ok(resolution) => resolution,
    Err(_) => panic!("possible widths"),
};
