//! Frames that make a request or a reply.

use nikon_aformat::inspect::Kind;
use nikon_aformat::{Error, RawResponse, Request, RequestFrame};

use crate::protocols::group::Group;

/// Frames that belong together.
pub(super) type Frames = Group<u16, { RawResponse::MAX_FRAMES }>;

impl Frames {
    /// By its first frame.
    pub(super) fn kind(&self) -> Kind {
        self.contents().first().map_or(Kind::Other, |first| Kind::of(*first))
    }

    /// The frames of the request, as far as they are there.
    pub(super) fn request(&self) -> Result<Request, Error> {
        let mut frames = Vec::with_capacity(self.len());
        for (frame, content) in (0..).zip(self.contents()) {
            if self.broken == Some(frame) {
                return Err(Error::Delimiter { frame });
            }
            frames.push(RequestFrame::from_content(*content)?);
        }
        Request::parse(&frames)
    }

    /// Frames of the whole request, as its first frame has it.
    pub(super) fn request_frames(&self) -> usize {
        let first = self.contents().first().map(|content| RequestFrame::from_content(*content));
        let expected = first.and_then(Result::ok).map(Request::expected_frames);
        expected.and_then(Result::ok).map_or(1, usize::from)
    }
}
