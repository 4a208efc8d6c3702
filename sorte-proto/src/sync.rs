use crate::error::Error;
use crate::frame::{LongFrame, emit};
use crate::frame_type::FrameType;
use crate::place::Place;
use crate::status::Status;

/// Time from the trigger of a SYNC frame to the capture of its start at the receiver, without the cable: 280 ns, which is
/// 3.5 byte times of preamble (coded as 100 + 180 in the published master).
pub(crate) const TRIGGER_TO_CAPTURE_NS: u32 = 280;

/// When the master frame, the first device's frame and the first SYNC frame are triggered within their periods, in ns.
pub const TRIGGER_NS: u32 = 500;

/// The delay that one device adds to a SYNC frame besides the cable: 320 ns until its port starts to send, and 35 ns
/// of hardware latency.
pub const TRANSIT_NS: u16 = 355;

/// A SYNC frame in a buffer.
///
/// ```text
///  byte 0    1   2   3       4           8      10
///       255  SA  5   STATUS  time stamp  delay  FCS
///                            u32         u16
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct SyncView<'a> {
    frame: LongFrame<'a>,
    fields: &'a [u8; 6],
}

impl<'a> SyncView<'a> {
    /// Checks as [`LongFrame::parse`], then that TYPE is 5.
    ///
    /// # Errors
    /// As [`LongFrame::parse`]; [`Error::UnexpectedType`].
    pub fn parse(bytes: &'a [u8]) -> Result<Self, Error> {
        Self::of(LongFrame::parse(bytes)?)
    }

    /// Takes the frame if its TYPE is 5.
    ///
    /// # Errors
    /// [`Error::UnexpectedType`]
    pub fn of(frame: LongFrame<'a>) -> Result<Self, Error> {
        Ok(Self { frame, fields: frame.of_type(FrameType::Sync)? })
    }

    /// SA.
    pub const fn source(self) -> u8 {
        self.frame.source()
    }

    /// STATUS.
    pub const fn status(self) -> Status {
        self.frame.status()
    }

    /// Master time in ns at which the start of this frame is expected at the receiver.
    pub const fn time_stamp_ns(self) -> u32 {
        let &[t0, t1, t2, t3, ..] = self.fields;
        u32::from_le_bytes([t0, t1, t2, t3])
    }

    /// Delay from the master to the receiver in ns.
    pub const fn delay_ns(self) -> u16 {
        let &[_, _, _, _, d0, d1] = self.fields;
        u16::from_le_bytes([d0, d1])
    }
}

/// Returns the values of the frame.
#[cfg(feature = "serde")]
#[cfg_attr(docsrs, doc(cfg(feature = "serde")))]
impl serde::Serialize for SyncView<'_> {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serde::Serialize::serialize(
            &Sync {
                source: self.source(),
                status: self.status(),
                time_stamp_ns: self.time_stamp_ns(),
                delay_ns: self.delay_ns(),
            },
            serializer,
        )
    }
}

/// The values of a SYNC frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
pub struct Sync {
    /// SA, 0 in everything the published firmware sends.
    pub source: u8,
    /// STATUS.
    pub status: Status,
    /// Master time in ns at which the start of this frame is expected at the receiver.
    pub time_stamp_ns: u32,
    /// Delay from the master to the receiver in ns.
    pub delay_ns: u16,
}

impl Sync {
    /// Number of bytes from DA to FCS.
    pub const LEN: usize = 6 + LongFrame::OVERHEAD;

    /// Creates the frame that the master sends: triggered at `trigger_ns` of its time, over a line of `line_delay_ns` to
    /// the first device.
    pub const fn of_master(trigger_ns: u32, line_delay_ns: u16, place: Place) -> Self {
        Self {
            source: 0,
            status: place.choose(Status::FINAL, Status::SYNC),
            time_stamp_ns: trigger_ns.wrapping_add(line_delay_ns as u32).wrapping_add(TRIGGER_TO_CAPTURE_NS),
            delay_ns: line_delay_ns,
        }
    }

    /// Checks as [`SyncView::parse`].
    ///
    /// # Errors
    /// As [`SyncView::parse`].
    pub fn parse(bytes: &[u8]) -> Result<Self, Error> {
        Self::of(LongFrame::parse(bytes)?)
    }

    /// Takes the frame if its TYPE is 5.
    ///
    /// # Errors
    /// [`Error::UnexpectedType`]
    pub fn of(frame: LongFrame<'_>) -> Result<Self, Error> {
        let view = SyncView::of(frame)?;
        Ok(Self {
            source: view.source(),
            status: view.status(),
            time_stamp_ns: view.time_stamp_ns(),
            delay_ns: view.delay_ns(),
        })
    }

    /// The frame from DA to FCS.
    pub fn emit(&self) -> [u8; Self::LEN] {
        let ([t0, t1, t2, t3], [d0, d1]) = (self.time_stamp_ns.to_le_bytes(), self.delay_ns.to_le_bytes());
        emit(self.source, FrameType::Sync, self.status, &[t0, t1, t2, t3, d0, d1])
    }

    /// Returns when the master triggered the frame, in its time, as seen by a device that is `delay_ns` away.
    pub(crate) const fn trigger_ns(self, delay_ns: u32) -> u32 {
        self.time_stamp_ns.wrapping_sub(TRIGGER_TO_CAPTURE_NS).wrapping_sub(delay_ns)
    }

    /// Returns the full delay from the master, for lines longer than 65,535 ns. **An extension of this crate, not TI's.**
    ///
    /// The master sends SYNC at 500 ns of each period of `period_ns`, and both times of the frame grow by the same hops, so the
    /// time stamp reveals the bits that the delay field lost when it wrapped. `None` if no delay below 600 us fits, or if
    /// several could with this period.
    pub fn long_delay_ns(&self, period_ns: u32) -> Option<u32> {
        let since_sof = self.time_stamp_ns.checked_sub(TRIGGER_NS.saturating_add(TRIGGER_TO_CAPTURE_NS))?;
        let fits = |delay: &u32| since_sof.checked_sub(*delay).and_then(|sent| sent.checked_rem(period_ns)) == Some(0);
        let mut fitting = (0..=8_u32).map(|wraps| wraps << 16 | u32::from(self.delay_ns)).filter(fits);
        fitting.next().filter(|_| fitting.next().is_none())
    }
}

/// Time from one device's receiver to the next one's in ns.
pub(crate) const fn hop_ns(line_delay_next_ns: u16) -> u32 {
    // Two 16-bit numbers: the sum cannot pass u32.
    (line_delay_next_ns as u32).saturating_add(TRANSIT_NS as u32)
}

servowire_core::one_line!(Sync {
    Self { time_stamp_ns, delay_ns, status, .. } => "SYNC at {} ns, delay {} ns, STATUS {}", time_stamp_ns, delay_ns, status;
});
servowire_core::one_line!(SyncView<'_> {
    view => "SYNC at {} ns, delay {} ns, STATUS {}", view.time_stamp_ns(), view.delay_ns(), view.status();
});

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn what_was_emitted_is_parsed_and_back(source: u8, status: u8, time_stamp_ns: u32, delay_ns: u16) {
            let frame = Sync { source, status: Status::from_bits_retain(status), time_stamp_ns, delay_ns };
            let bytes = frame.emit();
            prop_assert_eq!(Sync::parse(&bytes), Ok(frame));
            prop_assert_eq!(Sync::parse(&bytes).unwrap().emit(), bytes);
        }

        #[test]
        fn the_long_delay_is_the_sum_of_the_hops(round in 0u32..1024, hops in proptest::collection::vec(0u16..1000, 0..254)) {
            let mut frame = Sync::of_master(500 + 10_000 * round, 85, Place::Inner);
            let mut delay = 85;
            for line in hops {
                prop_assert_eq!(frame.long_delay_ns(10_000), Some(delay));
                frame.time_stamp_ns += 355 + u32::from(line);
                frame.delay_ns = frame.delay_ns.wrapping_add(355 + line);
                delay += 355 + u32::from(line);
            }
        }
    }
}
