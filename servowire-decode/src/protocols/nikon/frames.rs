//! Frames that make up a request or a reply.

use nikon_aformat::inspect::Kind;
use nikon_aformat::{Error, RawResponse, Request, RequestFrame};

use crate::protocols::group::Group;

/// Frames that belong together.
pub(super) type Frames = Group<u16, { RawResponse::MAX_FRAMES }>;

impl Frames {
    /// Returns the kind, judged by the first frame.
    pub(super) fn kind(&self) -> Kind {
        self.contents().first().map_or(Kind::Other, |first| Kind::of(*first))
    }

    /// Parses the frames of the request received so far.
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

    /// Returns the number of frames in the whole request, according to its first frame.
    pub(super) fn request_frames(&self) -> usize {
        let first = self.contents().first().map(|content| RequestFrame::from_content(*content));
        let expected = first.and_then(Result::ok).map(Request::expected_frames);
        expected.and_then(Result::ok).map_or(1, usize::from)
    }
}
