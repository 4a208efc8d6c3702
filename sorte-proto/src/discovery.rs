use crate::address::DeviceAddress;
use crate::error::Error;
use crate::frame::{LongFrame, MULTICAST, count, emit, refresh_fcs};
use crate::frame_type::FrameType;
use crate::place::Place;
use crate::status::Status;

/// Number of devices for which a discovery frame has room.
pub(crate) const MAX_DEVICES: usize = 254;
const TABLE: usize = MAX_DEVICES * 4;
const PAYLOAD: usize = 6 + TABLE;

/// Process data of one device: its entry in the table of a discovery frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
pub struct Entry {
    /// Number of bytes from the device to the master.
    pub input: u16,
    /// Number of bytes from the master to the device.
    pub output: u16,
}

impl Entry {
    /// What the published device announces: 4 bytes each way.
    pub const STOCK: Self = Self { input: 4, output: 4 };

    const fn parse([i0, i1, o0, o1]: [u8; 4]) -> Self {
        Self { input: u16::from_le_bytes([i0, i1]), output: u16::from_le_bytes([o0, o1]) }
    }

    const fn emit(self) -> [u8; 4] {
        let ([i0, i1], [o0, o1]) = (self.input.to_le_bytes(), self.output.to_le_bytes());
        [i0, i1, o0, o1]
    }
}

/// A discovery frame in a buffer.
///
/// ```text
///  byte 0    1   2   3       4      6            8             10 + 4 (a-1)           1026
///       255  SA  1   STATUS  count  input total  output total  entry of device a      FCS
///                            u16    u16          u16           input u16, output u16
/// ```
///
/// Only the first `count` entries are valid. The other entries hold what the master filled in: the published master sends a
/// debug pattern there.
///
/// A device takes the next address and the present totals as its offsets, adds its lengths, and sets LAST and ERROR in
/// STATUS if they apply: see [`Rewriter::discovery`](crate::cut_through::Rewriter::discovery).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct DiscoveryView<'a> {
    frame: LongFrame<'a>,
    fields: &'a [u8; PAYLOAD],
}

impl<'a> DiscoveryView<'a> {
    /// Checks as [`LongFrame::parse`], then that TYPE is 1.
    ///
    /// # Errors
    /// As [`LongFrame::parse`]; [`Error::UnexpectedType`].
    pub fn parse(bytes: &'a [u8]) -> Result<Self, Error> {
        Self::of(LongFrame::parse(bytes)?)
    }

    /// Takes the frame if its TYPE is 1.
    ///
    /// # Errors
    /// [`Error::UnexpectedType`]
    pub fn of(frame: LongFrame<'a>) -> Result<Self, Error> {
        Ok(Self { frame, fields: frame.of_type(FrameType::Discovery)? })
    }

    /// SA.
    pub const fn source(self) -> u8 {
        self.frame.source()
    }

    /// STATUS.
    pub const fn status(self) -> Status {
        self.frame.status()
    }

    /// Number of devices that the frame has passed; above 254 the line is too long.
    pub const fn count(self) -> u16 {
        let [c0, c1, ..] = self.fields;
        u16::from_le_bytes([*c0, *c1])
    }

    /// Number of input bytes of these devices.
    pub const fn input_total(self) -> u16 {
        let [_, _, i0, i1, ..] = self.fields;
        u16::from_le_bytes([*i0, *i1])
    }

    /// Number of output bytes of these devices.
    pub const fn output_total(self) -> u16 {
        let [_, _, _, _, o0, o1, ..] = self.fields;
        u16::from_le_bytes([*o0, *o1])
    }

    /// The entries of the devices counted, in the order of their addresses.
    pub fn entries(self) -> impl Iterator<Item = Entry> + Clone + 'a {
        self.table().take(usize::from(self.count()))
    }

    /// Returns the entry of one of the devices counted.
    pub fn entry(self, address: DeviceAddress) -> Option<Entry> {
        self.entries().nth(usize::from(address.hops_before()))
    }

    fn table(self) -> impl Iterator<Item = Entry> + Clone + 'a {
        let (_, table) = self.fields.split_at(6);
        table.chunks_exact(4).map(|e| e.first_chunk().map_or(Entry::default(), |e| Entry::parse(*e)))
    }

    /// The values.
    pub fn to_owned(self) -> Discovery {
        let mut entries = [Entry::default(); MAX_DEVICES];
        entries.iter_mut().zip(self.table()).for_each(|(to, from)| *to = from);
        Discovery {
            source: self.source(),
            status: self.status(),
            count: self.count(),
            input_total: self.input_total(),
            output_total: self.output_total(),
            entries,
        }
    }
}

/// The head and the entries of the devices counted.
#[cfg(feature = "serde")]
#[cfg_attr(docsrs, doc(cfg(feature = "serde")))]
impl serde::Serialize for DiscoveryView<'_> {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        use serde::ser::{SerializeSeq, SerializeStruct};

        struct Entries<'a>(DiscoveryView<'a>);

        impl serde::Serialize for Entries<'_> {
            fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
                let mut entries = serializer.serialize_seq(None)?;
                self.0.entries().try_for_each(|entry| entries.serialize_element(&entry))?;
                entries.end()
            }
        }

        let mut frame = serializer.serialize_struct("Discovery", 6)?;
        frame.serialize_field("source", &self.source())?;
        frame.serialize_field("status", &self.status())?;
        frame.serialize_field("count", &self.count())?;
        frame.serialize_field("input_total", &self.input_total())?;
        frame.serialize_field("output_total", &self.output_total())?;
        frame.serialize_field("entries", &Entries(*self))?;
        frame.end()
    }
}

/// The values of a discovery frame, including the content of all 254 entries.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
pub struct Discovery {
    /// SA, 0 in everything the published firmware sends.
    pub source: u8,
    /// STATUS.
    pub status: Status,
    /// Number of devices that the frame has passed.
    pub count: u16,
    /// Number of input bytes of these devices.
    pub input_total: u16,
    /// Number of output bytes of these devices.
    pub output_total: u16,
    /// Entries of the devices 1 to 254.
    #[cfg_attr(feature = "serde", serde(with = "crate::table"))]
    pub entries: [Entry; MAX_DEVICES],
}

impl Discovery {
    /// Number of bytes from DA to FCS.
    pub const LEN: usize = PAYLOAD + LongFrame::OVERHEAD;

    /// Creates the frame that a master sends, with zeros where the devices will write.
    pub const fn request(place: Place) -> Self {
        Self {
            source: 0,
            status: place.choose(Status::FINAL, Status::DISCOVERY),
            count: 0,
            input_total: 0,
            output_total: 0,
            entries: [Entry { input: 0, output: 0 }; MAX_DEVICES],
        }
    }

    /// Writes [`request`](Self::request) into a buffer without a copy on the stack and returns its length.
    ///
    /// # Errors
    /// [`Error::BufferTooSmall`]
    pub fn emit_request_into(place: Place, into: &mut [u8]) -> Result<usize, Error> {
        let frame = room(into, Self::LEN)?;
        frame.fill(0);
        let status = place.choose(Status::FINAL, Status::DISCOVERY);
        if let [da, _, code, flags, ..] = frame {
            (*da, *code, *flags) = (MULTICAST, FrameType::Discovery.code(), status.bits());
        }
        refresh_fcs(frame);
        Ok(Self::LEN)
    }

    /// Creates the frame that the published master sends: its table is filled with a debug pattern, 31 blocks of 32 bytes
    /// holding the words 16, 48, 80, ... and then 0xBEEF.
    pub fn published_request(place: Place) -> Self {
        let mut frame = Self::request(place);
        for (index, entry) in (0u16..).zip(&mut frame.entries) {
            // The pattern starts with the frame's table, eight entries a block.
            let word = if index < 248 { (index >> 3 << 5).saturating_add(16) } else { 0xbeef };
            *entry = Entry { input: word, output: word };
        }
        frame
    }

    /// Checks as [`DiscoveryView::parse`].
    ///
    /// # Errors
    /// As [`DiscoveryView::parse`].
    pub fn parse(bytes: &[u8]) -> Result<Self, Error> {
        Ok(DiscoveryView::parse(bytes)?.to_owned())
    }

    /// The frame from DA to FCS.
    pub fn emit(&self) -> [u8; Self::LEN] {
        let mut payload = [0; PAYLOAD];
        let (head, table) = payload.split_at_mut(6);
        let ([c0, c1], [i0, i1]) = (self.count.to_le_bytes(), self.input_total.to_le_bytes());
        let [o0, o1] = self.output_total.to_le_bytes();
        head.iter_mut().zip([c0, c1, i0, i1, o0, o1]).for_each(|(to, from)| *to = from);
        for (to, entry) in table.chunks_exact_mut(4).zip(&self.entries) {
            to.iter_mut().zip(entry.emit()).for_each(|(to, from)| *to = from);
        }
        emit(self.source, FrameType::Discovery, self.status, &payload)
    }
}

/// What a device knows about itself after DISCOVERY.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Assignment {
    /// Its place in the line.
    pub address: DeviceAddress,
    /// Number of input bytes of the devices before it.
    pub in_offset: u16,
    /// Number of output bytes of the devices before it: where its own output bytes begin.
    pub out_offset: u16,
}

/// A device of a line, as its master knows it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Member {
    /// Its place in the line and in the process data.
    pub assignment: Assignment,
    /// The lengths of its process data.
    pub lengths: Entry,
}

/// Returns the device count after one more device. The low byte of a passing frame comes first, so a carry cannot reach the
/// high one: 254 and 255 both become 255.
pub(crate) fn count_after(before: u16) -> u16 {
    let [low, high] = before.to_le_bytes();
    u16::from_le_bytes([low.saturating_add(1), high])
}

pub(crate) fn next_address(devices_before: u16) -> Option<DeviceAddress> {
    u8::try_from(devices_before.checked_add(1)?).ok().and_then(DeviceAddress::new)
}

/// The line as the master knows it from the last discovery answer.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(try_from = "Unchecked"))]
pub struct Network {
    devices: u8,
    input_total: u16,
    output_total: u16,
    #[cfg_attr(feature = "serde", serde(with = "crate::table"))]
    entries: [Entry; MAX_DEVICES],
}

/// A network as it is stored in a file.
#[cfg(feature = "serde")]
#[derive(serde::Deserialize)]
struct Unchecked {
    devices: u16,
    input_total: u16,
    output_total: u16,
    #[serde(with = "crate::table")]
    entries: [Entry; MAX_DEVICES],
}

#[cfg(feature = "serde")]
impl TryFrom<Unchecked> for Network {
    type Error = Error;

    fn try_from(told: Unchecked) -> Result<Self, Error> {
        let mut network = Self::EMPTY;
        let entries = told.entries.iter().copied();
        network.set(told.devices, (told.input_total, told.output_total), entries)?;
        Ok(network)
    }
}

impl Network {
    /// A line without devices.
    pub(crate) const EMPTY: Self =
        Self { devices: 0, input_total: 0, output_total: 0, entries: [Entry { input: 0, output: 0 }; MAX_DEVICES] };

    /// Checks that there are at most 254 devices and that the totals are the sums of the entries.
    ///
    /// # Errors
    /// [`Error::TooManyDevices`], [`Error::TableMismatch`]
    pub fn new(answer: DiscoveryView<'_>) -> Result<Self, Error> {
        let mut network = Self::EMPTY;
        network.take(answer)?;
        Ok(network)
    }

    /// Does the same in place, which avoids copying a kilobyte. A refusal leaves the network as it was.
    ///
    /// # Errors
    /// As [`new`](Self::new).
    pub fn take(&mut self, answer: DiscoveryView<'_>) -> Result<(), Error> {
        self.set(answer.count(), (answer.input_total(), answer.output_total()), answer.entries())
    }

    fn set(
        &mut self,
        count: u16,
        (input_total, output_total): (u16, u16),
        entries: impl Iterator<Item = Entry> + Clone,
    ) -> Result<(), Error> {
        let devices = match u8::try_from(count) {
            Ok(n) if usize::from(n) <= MAX_DEVICES => n,
            _ => return Err(Error::TooManyDevices { count }),
        };
        let entries = entries.take(devices.into());
        let (mut input, mut output) = (0u16, 0u16);
        for entry in entries.clone() {
            (input, output) = (input.saturating_add(entry.input), output.saturating_add(entry.output));
        }
        for (got, want) in [(input_total, input), (output_total, output)] {
            // A sum that reached the end of u16 is not a sum any more.
            if got != want || want == u16::MAX {
                return Err(Error::TableMismatch { got, want });
            }
        }
        self.entries.iter_mut().zip(entries).for_each(|(to, entry)| *to = entry);
        (self.devices, self.input_total, self.output_total) = (devices, input, output);
        Ok(())
    }

    /// Returns whether an answer describes this line.
    pub(crate) fn is_told_by(&self, answer: DiscoveryView<'_>) -> bool {
        let mut told = answer.entries();
        answer.count() == u16::from(self.devices) && self.entries().iter().all(|entry| told.next() == Some(*entry))
    }

    /// Number of devices in the line, 0..=254.
    pub const fn devices(&self) -> u8 {
        self.devices
    }

    /// Number of input bytes of all devices.
    pub const fn input_total(&self) -> u16 {
        self.input_total
    }

    /// Number of output bytes of all devices.
    pub const fn output_total(&self) -> u16 {
        self.output_total
    }

    /// The devices' lengths in the order of their addresses.
    pub fn entries(&self) -> &[Entry] {
        self.entries.get(..usize::from(self.devices)).unwrap_or(&[])
    }

    /// Address, lengths and offsets of each device.
    pub fn members(&self) -> impl Iterator<Item = Member> + '_ {
        let start = (0u16, 0u16);
        self.entries().iter().zip(1..=u8::MAX).scan(start, |(input, output), (&entry, address)| {
            let assignment =
                Assignment { address: DeviceAddress::new(address)?, in_offset: *input, out_offset: *output };
            *input = input.saturating_add(entry.input);
            *output = output.saturating_add(entry.output);
            Some(Member { assignment, lengths: entry })
        })
    }
}

/// Checks the length of a buffer that a frame is to be written into.
pub(crate) fn room(into: &mut [u8], want: usize) -> Result<&mut [u8], Error> {
    let got = count(into.len());
    into.get_mut(..want).ok_or(Error::BufferTooSmall { got, want: count(want) })
}

servowire_core::one_line!(Discovery {
    Self { count, input_total, output_total, status, .. } =>
        "DISCOVERY {} devices, in {}, out {}, STATUS {}", count, input_total, output_total, status;
});
servowire_core::one_line!(DiscoveryView<'_> {
    view => "DISCOVERY {} devices, in {}, out {}, STATUS {}",
        view.count(), view.input_total(), view.output_total(), view.status();
});
servowire_core::one_line!(Network {
    Self { devices, input_total, output_total, .. } => "{} devices, in {}, out {}", devices, input_total, output_total;
});
servowire_core::one_line!(Entry { Self { input, output } => "in {}, out {}", input, output; });
servowire_core::one_line!(Assignment {
    Self { address, in_offset, out_offset } => "device {}, in at {}, out at {}", address, in_offset, out_offset;
});
servowire_core::one_line!(Member { Self { assignment, lengths } => "{}; {}", assignment, lengths; });

#[cfg(test)]
mod tests;
