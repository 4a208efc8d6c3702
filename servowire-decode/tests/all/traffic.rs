//! Network captures of a machine beside which other things talk.

use std::cell::RefCell;
use std::io::Cursor;

use servowire_decode::capture::{self, Hints, Input};
use servowire_decode::output::Output;
use servowire_decode::settings::Settings;

use crate::Keep;

/// ARP as a network card gives it: to all, who is at 192.168.0.1.
const ARP: [u8; 42] = [
    0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0x02, 0, 0, 0, 0, 1, 0x08, 0x06, 0, 1, 0x08, 0, 6, 4, 0, 1, 0x02, 0, 0, 0, 0,
    1, 192, 168, 0, 2, 0, 0, 0, 0, 0, 0, 192, 168, 0, 1,
];
/// SYNC of SORTE without its FCS: to all, of the master, type 5, STATUS 40h, 856 ns, 76 ns.
const SYNC: [u8; 10] = [0xff, 0x00, 0x05, 0x40, 0x58, 0x03, 0, 0, 0x4c, 0x00];

/// A pcap of Ethernet packets.
fn pcap(packets: &[&[u8]]) -> Vec<u8> {
    let mut file = vec![0xd4, 0xc3, 0xb2, 0xa1, 2, 0, 4, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0xff, 0xff, 0, 0, 1, 0, 0, 0];
    for (k, packet) in (0_u32..).zip(packets) {
        let len = packet.len() as u32;
        file.extend([1_767_225_600, k, len, len].map(u32::to_le_bytes).concat());
        file.extend(*packet);
    }
    file
}

/// Frames that hold and do not, what was noted, and the fault.
fn decode(packets: &[&[u8]]) -> (u64, u64, String, Option<String>) {
    let capture = capture::open(Input::over("net", Cursor::new(pcap(packets))), Hints::default()).unwrap();
    let mut keep = Keep::default();
    let said = RefCell::new(String::new());
    let note = |note: &servowire_decode::recognition::Note| said.borrow_mut().push_str(&note.to_string());
    let mut out = Output::new("net", &mut keep).with_notes(&note);
    let fault = servowire_decode::decode("net", capture, None, &Settings::default(), &mut out).err();
    (out.tally.ok, out.tally.refused, said.take(), fault.map(|fault| fault.to_string()))
}

#[test]
fn ordinary_traffic_is_named_once() {
    let mut ip = ARP;
    ip[13] = 0x00;
    let (ok, refused, said, fault) = decode(&[&ARP, &SYNC, &ip, &ARP, &SYNC]);
    assert_eq!((ok, refused, fault), (2, 0, None));
    assert_eq!(said, "net: 3 packets of ordinary network traffic (ARP 2, IPv4 1) were skipped");
    let (ok, refused, said, fault) = decode(&[&ARP, &ip]);
    assert_eq!((ok, refused, said.as_str()), (0, 0, ""));
    assert!(fault.unwrap().contains("2 packets of ordinary network traffic (ARP 1, IPv4 1), and nothing else"));
}
