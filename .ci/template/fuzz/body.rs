//! @Title@.

use @snake@::Frame;

/// What is accepted is what would be sent.
pub fn frame(data: &[u8]) {
    if let Ok(frame) = Frame::parse(data) {
        assert_eq!(frame.emit(), data);
    }
}
