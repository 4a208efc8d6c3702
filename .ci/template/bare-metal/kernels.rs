//! Frames.

use @snake@::{Error, Frame, LEN};

use super::kernels;

kernels! {
    /// A frame as received.
    fn @snake@_parse(bytes: &[u8; LEN]) -> Result<Frame, Error> {
        Frame::parse(bytes)
    } over [[0x5a, 0x01, 0x89], [0x5a, 0x01, 0x88]];

    /// A frame to be sent.
    fn @snake@_emit(frame: &Frame) -> [u8; LEN] {
        frame.emit()
    } over [Frame { value: 1 }];
}
