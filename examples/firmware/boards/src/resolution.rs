//! The encoder of the T-Format images.

use tformat::Resolution;

/// The resolution of your encoder; an encoder whose identification says otherwise gives no position.
pub const RESOLUTION: Resolution = match Resolution::new(23, 16) {
    Ok(resolution) => resolution,
    Err(_) => panic!("possible widths"),
};
