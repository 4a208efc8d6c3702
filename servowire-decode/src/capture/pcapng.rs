//! Packets of a network capture (pcapng, and pcap before it), as Wireshark and `servowire cnc` write them.

use std::borrow::Cow;

use pcap_file::pcap::PcapReader;
use pcap_file::pcapng::blocks::Block;
use pcap_file::pcapng::blocks::enhanced_packet::EnhancedPacketOption;
use pcap_file::pcapng::blocks::interface_description::InterfaceDescriptionOption;
use pcap_file::pcapng::{PcapNgReader, blocks::interface_description::InterfaceDescriptionBlock};
use pcap_file::{DataLink, PcapError};

use super::input::Input;
use crate::fault::{At, Fault};
use crate::time::Time;

/// The first bytes of a pcapng file.
pub(super) const MAGIC: &[u8] = b"\x0a\x0d\x0d\x0a";

/// The first bytes of a pcap file: stamps in microseconds or nanoseconds, in either order of bytes.
pub(super) const CLASSIC: [&[u8]; 4] =
    [b"\xd4\xc3\xb2\xa1", b"\xa1\xb2\xc3\xd4", b"\x4d\x3c\xb2\xa1", b"\xa1\xb2\x3c\x4d"];

/// Units of time in a second, as a power of ten, if the interface does not give them.
const MICROSECONDS: u8 = 6;

/// A network capture.
pub struct Pcapng {
    name: String,
    reader: Reader,
    packets: u64,
    live: bool,
}

enum Reader {
    Blocks(Box<PcapNgReader<Input>>),
    Classic(Box<PcapReader<Input>>),
}

/// A packet as it was on the network.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Packet {
    /// When it was captured, in picoseconds.
    pub time: Time,
    /// Link type of its interface.
    pub link: DataLink,
    /// Whether it went to the capturing side (`Some(true)`) or came from it, if the file says so.
    pub inbound: Option<bool>,
    /// Whether the file says that its bytes end with their frame check sequence. Most network cards strip it, and most files do
    /// not say.
    pub has_fcs: bool,
    /// Its bytes.
    pub bytes: Vec<u8>,
}

impl Packet {
    /// Returns its kind by EtherType, if it is ordinary network traffic. Frames of a drive bus without an EtherType are not
    /// ordinary traffic.
    pub fn traffic(&self) -> Option<&'static str> {
        if self.link != DataLink::ETHERNET {
            return None;
        }
        match *self.bytes.get(12..14)?.first_chunk()? {
            [0x08, 0x00] => Some("IPv4"),
            [0x08, 0x06] => Some("ARP"),
            [0x86, 0xdd] => Some("IPv6"),
            [0x81, 0x00] => Some("VLAN"),
            [0x88, 0xcc] => Some("LLDP"),
            [0x88, 0xf7] => Some("PTP"),
            [0x88, 0xa4] => Some("EtherCAT"),
            [0x88, 0x92] => Some("PROFINET"),
            // IEEE 802.3 has a length there, and bridges speak so.
            _ if self.bytes.starts_with(&[0x01, 0x80, 0xc2, 0x00, 0x00]) => Some("bridges"),
            _ => None,
        }
    }
}

impl Pcapng {
    /// Reads a capture from its beginning.
    pub fn new(mut input: Input) -> Result<Self, Fault> {
        let (name, live) = (input.name().to_owned(), input.is_live());
        let classic = !input.peek()?.starts_with(MAGIC);
        let reader = if classic {
            PcapReader::new(input).map(|reader| Reader::Classic(Box::new(reader)))
        } else {
            PcapNgReader::new(input).map(|reader| Reader::Blocks(Box::new(reader)))
        };
        let reader = reader.map_err(|e| Fault::new(&name, At::File, say(&e)))?;
        Ok(Self { name, reader, packets: 0, live })
    }

    /// Returns whether packets may come one by one.
    pub(crate) fn is_live(&self) -> bool {
        self.live
    }

    /// Returns the next packet; `None` at the end.
    pub fn packet(&mut self) -> Result<Option<Packet>, Fault> {
        loop {
            let reader = match &mut self.reader {
                Reader::Classic(_) => return self.classic(),
                Reader::Blocks(reader) => reader,
            };
            let packet = match reader.next_block() {
                None => return Ok(None),
                Some(Err(error)) => return Err(self.fault(&say(&error))),
                Some(Ok(Block::EnhancedPacket(packet))) => packet.into_owned(),
                Some(Ok(_)) => continue,
            };
            self.packets += 1;
            let Some(interface) = reader.packet_interface(&packet) else {
                return Err(self.fault("its interface is not described"));
            };
            let inbound = packet.options.iter().find_map(|option| match option {
                EnhancedPacketOption::Flags(flags) if flags & 3 != 0 => Some(flags & 3 == 1),
                _ => None,
            });
            // The reader gives the file's units of time as if they were nanoseconds.
            let units = packet.timestamp.as_nanos();
            let (time, link) = (picoseconds(units, interface), interface.linktype);
            let has_fcs = |option: &_| matches!(option, InterfaceDescriptionOption::IfFcsLen(length) if *length > 0);
            let has_fcs = interface.options.iter().any(has_fcs);
            let time = time.ok_or_else(|| self.fault("its time cannot be"))?;
            let bytes = match packet.data {
                Cow::Owned(bytes) => bytes,
                Cow::Borrowed(bytes) => bytes.to_vec(),
            };
            return Ok(Some(Packet { time, link, inbound, has_fcs, bytes }));
        }
    }

    /// A packet of a file that has one interface and no options.
    fn classic(&mut self) -> Result<Option<Packet>, Fault> {
        let Reader::Classic(reader) = &mut self.reader else { return Ok(None) };
        let link = reader.header().datalink;
        let packet = match reader.next_packet() {
            None => return Ok(None),
            Some(Err(error)) => return Err(self.fault(&say(&error))),
            Some(Ok(packet)) => packet.into_owned(),
        };
        self.packets += 1;
        let time =
            packet.timestamp.as_nanos().checked_mul(1000).and_then(|time| i128::try_from(time).ok().map(Time::from_ps));
        let time = time.ok_or_else(|| self.fault("its time cannot be"))?;
        Ok(Some(Packet { time, link, inbound: None, has_fcs: false, bytes: packet.data.into_owned() }))
    }

    fn fault(&self, what: &str) -> Fault {
        Fault::new(&self.name, At::File, format!("after packet {}: {what}", self.packets))
    }
}

fn picoseconds(units: u128, interface: &InterfaceDescriptionBlock<'_>) -> Option<Time> {
    let resolution = interface.options.iter().find_map(|option| match option {
        InterfaceDescriptionOption::IfTsResol(resolution) => Some(*resolution),
        _ => None,
    });
    let resolution = resolution.unwrap_or(MICROSECONDS);
    let exponent = u32::from(resolution & 0x7f);
    let second = 1_000_000_000_000u128;
    let per_second =
        if resolution & 0x80 == 0 { 10u128.checked_pow(exponent)? } else { 1u128.checked_shl(exponent)? };
    i128::try_from(units.checked_mul(second)?.checked_div(per_second)?).ok().map(Time::from_ps)
}

fn say(error: &PcapError) -> String {
    match error {
        PcapError::IncompleteBuffer => "the file ends inside a block".to_owned(),
        PcapError::IoError(error) => format!("cannot be read: {error}"),
        other => format!("not valid pcapng: {other}"),
    }
}
