//! Records what a logic analyser and a network tap would have seen, as VCD and pcapng.

use std::borrow::Cow;
use std::io::{self, BufWriter};
use std::path::Path;
use std::time::Duration;

use pcap_file::pcapng::PcapNgWriter;
use pcap_file::pcapng::blocks::enhanced_packet::{EnhancedPacketBlock, EnhancedPacketOption};
use pcap_file::pcapng::blocks::interface_description::{InterfaceDescriptionBlock, InterfaceDescriptionOption};
use pcap_file::{DataLink, PcapError};
use sorte_proto::{FrameType, Preamble};
use vcd::{IdCode, TimescaleUnit, VarType, Writer};

use crate::files::{Written, create};

use super::axis::Seen;

/// A byte at 100 Mbit/s.
const BYTE_NS: u64 = 80;
/// Preamble of the frames of the IO exchange.
const SHORT: usize = Preamble::Short.bytes().len();

/// Margin for the difference between the devices' clocks, and for an axis running through a whole cycle at once.
const SETTLED_NS: u64 = 20_000;

/// Interface of the start-up frames, which are Ethernet frames, and interface of all others.
const ETHERNET: u32 = 0;
const EXCHANGE: u32 = 1;

/// Takes events, if they are to be recorded.
#[derive(Default)]
pub(super) struct Recorder {
    vcd: Option<Trace>,
    packets: Option<PcapNgWriter<BufWriter<Written>>>,
    /// Cycles still to be recorded, including the present one.
    cycles: u64,
    /// Notes that a cycle has begun.
    running: bool,
    /// Nothing is reported later than this after it happened.
    settled_ns: u64,
    /// The first write error.
    failure: Option<io::Error>,
}

impl Recorder {
    /// `cycles`: number of recorded cycles of the IO exchange, each of `cycle_ns`.
    pub(super) fn new(
        devices: usize,
        vcd: Option<&Path>,
        pcapng: Option<&Path>,
        cycles: u64,
        cycle_ns: u32,
    ) -> io::Result<Self> {
        let vcd = vcd.map(|path| Trace::create(path, devices)).transpose()?;
        let packets = pcapng.map(open).transpose()?;
        let settled_ns = SETTLED_NS + 2 * u64::from(cycle_ns);
        Ok(Self { vcd, packets, cycles, running: false, settled_ns, failure: None })
    }

    fn wants(&self) -> bool {
        self.cycles > 0 && (self.vcd.is_some() || self.packets.is_some())
    }

    fn keep(&mut self, result: io::Result<()>) {
        if let (Err(error), None) = (result, &self.failure) {
            self.failure = Some(error);
        }
    }

    /// Records a start-up frame at the master.
    pub(super) fn start_up(&mut self, at_ns: u64, preamble: Preamble, frame: &[u8], answer: bool) {
        if !self.wants() {
            return;
        }
        let name = frame.get(2).copied().and_then(FrameType::from_code).map_or("?", FrameType::name);
        self.frame(at_ns, preamble.bytes().len(), frame, answer, name, ETHERNET);
    }

    /// Records a frame of the IO exchange at the master. The master's own frame begins a cycle.
    pub(super) fn exchange(&mut self, at_ns: u64, frame: &[u8], answer: bool) {
        if !answer {
            self.cycles = self.cycles.saturating_sub(u64::from(self.running));
            self.running = true;
        }
        if !self.wants() {
            return;
        }
        self.frame(at_ns, SHORT, frame, answer, if answer { "device" } else { "master" }, EXCHANGE);
    }

    fn frame(&mut self, at_ns: u64, preamble: usize, frame: &[u8], answer: bool, name: &'static str, interface: u32) {
        let wire_ns = (preamble + frame.len()) as u64 * BYTE_NS;
        if let Some(trace) = &mut self.vcd {
            let result = if answer { Ok(()) } else { trace.flush(at_ns.saturating_sub(self.settled_ns)) };
            trace.frame(at_ns, wire_ns, answer, name);
            self.keep(result);
        }
        if let Some(packets) = &mut self.packets {
            let result = packets.write_pcapng_block(EnhancedPacketBlock {
                interface_id: interface,
                timestamp: Duration::from_nanos(at_ns),
                original_len: frame.len() as u32,
                data: Cow::Borrowed(frame),
                // Bits 0 and 1: inbound, outbound.
                options: vec![EnhancedPacketOption::Flags(if answer { 1 } else { 2 })],
            });
            self.keep(result.map(|_| ()).map_err(cause));
        }
    }

    /// Records a cycle of an axis.
    pub(super) fn axis(&mut self, device: usize, run: impl FnOnce(Option<&mut Vec<(u64, Seen)>>)) {
        let Some(trace) = self.vcd.as_mut().filter(|_| self.cycles > 0) else { return run(None) };
        let mut seen = Vec::new();
        run(Some(&mut seen));
        trace.axis(device, &seen);
    }

    /// Writes everything that is left.
    pub(super) fn finish(mut self) -> io::Result<()> {
        if let Some(trace) = &mut self.vcd {
            let result = trace.flush(u64::MAX).and_then(|()| trace.writer.flush());
            self.keep(result);
        }
        if let Some(packets) = &mut self.packets {
            let result = io::Write::flush(packets.get_mut());
            self.keep(result);
        }
        self.failure.map_or(Ok(()), Err)
    }
}

/// The library's own text about a failed write says only that bytes could not be read.
fn cause(error: PcapError) -> io::Error {
    match error {
        PcapError::IoError(error) => error,
        other => io::Error::other(other),
    }
}

fn open(path: &Path) -> io::Result<PcapNgWriter<BufWriter<Written>>> {
    let mut packets = PcapNgWriter::new(create(path)?).map_err(cause)?;
    let interface = |linktype, name: &'static str, note: &'static str, fcs_bits: Option<u8>| {
        let mut options = vec![
            InterfaceDescriptionOption::IfName(Cow::Borrowed(name)),
            InterfaceDescriptionOption::IfDescription(Cow::Borrowed(note)),
            InterfaceDescriptionOption::IfSpeed(100_000_000),
            InterfaceDescriptionOption::IfTsResol(9),
        ];
        options.extend(fcs_bits.map(InterfaceDescriptionOption::IfFcsLen));
        InterfaceDescriptionBlock { linktype, snaplen: 0, options }
    };
    let start_up =
        interface(DataLink::ETHERNET, "sorte", "SORTE frames with long header: DA, SA, TYPE, STATUS, FCS", Some(32));
    let exchange = interface(
        DataLink::USER0,
        "sorte-io",
        "SORTE IO exchange: SA, STATUS, data, CRC-8; SA 0 is the master, with a time stamp after the CRC-8",
        None,
    );
    for block in [start_up, exchange] {
        packets.write_pcapng_block(block).map_err(cause)?;
    }
    Ok(packets)
}

/// Signals of a device.
struct Signals {
    sync0: IdCode,
    dir: IdCode,
    enable: IdCode,
    position: IdCode,
}

/// A wire of the master, and the frames on it: a duplicate may overlap with its frame.
struct Line {
    id: IdCode,
    frames: u32,
}

#[derive(Clone, Copy)]
enum Level {
    /// A frame begins or ends on `rx`, or on `tx`.
    Frame {
        rx: bool,
        begins: bool,
    },
    Wire(IdCode, bool),
    Number(IdCode, i64),
    Text(IdCode, &'static str),
}

struct Trace {
    writer: Writer<BufWriter<Written>>,
    tx: Line,
    rx: Line,
    frame: IdCode,
    devices: Vec<Signals>,
    waiting: Vec<(u64, Level)>,
    written: Option<u64>,
}

impl Trace {
    fn create(path: &Path, devices: usize) -> io::Result<Self> {
        let mut writer = Writer::new(create(path)?);
        writer.timescale(1, TimescaleUnit::NS)?;
        writer.add_module("sorte")?;
        writer.add_module("master")?;
        let tx = writer.add_wire(1, "tx")?;
        let rx = writer.add_wire(1, "rx")?;
        let frame = writer.add_var(VarType::String, 0, "frame", None)?;
        writer.upscope()?;
        let mut signals = Vec::new();
        for k in 1..=devices {
            writer.add_module(&format!("device{k}"))?;
            signals.push(Signals {
                sync0: writer.add_wire(1, "SYNC0")?,
                dir: writer.add_wire(1, "DIR")?,
                enable: writer.add_wire(1, "ENABLE")?,
                position: writer.add_var(VarType::Integer, 64, "position", None)?,
            });
            writer.upscope()?;
        }
        writer.upscope()?;
        writer.enddefinitions()?;
        let [tx_line, rx_line] = [tx, rx].map(|id| Line { id, frames: 0 });
        let mut trace =
            Self { writer, tx: tx_line, rx: rx_line, frame, devices: signals, waiting: Vec::new(), written: None };
        trace.waiting.extend([(0, Level::Wire(tx, false)), (0, Level::Wire(rx, false)), (0, Level::Text(frame, "-"))]);
        for k in &trace.devices {
            let start = [Level::Wire(k.sync0, false), Level::Wire(k.dir, false), Level::Wire(k.enable, true)];
            trace.waiting.extend(start.map(|level| (0, level)));
            trace.waiting.push((0, Level::Number(k.position, 0)));
        }
        Ok(trace)
    }

    fn frame(&mut self, at_ns: u64, wire_ns: u64, answer: bool, name: &'static str) {
        self.waiting.push((at_ns, Level::Frame { rx: answer, begins: true }));
        self.waiting.push((at_ns + wire_ns, Level::Frame { rx: answer, begins: false }));
        if !answer {
            self.waiting.push((at_ns, Level::Text(self.frame, name)));
        }
    }

    fn axis(&mut self, device: usize, seen: &[(u64, Seen)]) {
        let Some(signals) = self.devices.get(device) else { return };
        self.waiting.extend(seen.iter().map(|(ns, change)| {
            let level = match *change {
                Seen::Step(high) => Level::Wire(signals.sync0, high),
                Seen::Dir(high) => Level::Wire(signals.dir, high),
                Seen::Enable(on) => Level::Wire(signals.enable, on),
                Seen::Position(position) => Level::Number(signals.position, position),
            };
            (*ns, level)
        }));
    }

    /// Writes everything before `until_ns`.
    fn flush(&mut self, until_ns: u64) -> io::Result<()> {
        self.waiting.sort_by_key(|(ns, _)| *ns);
        let ready = self.waiting.partition_point(|(ns, _)| *ns < until_ns);
        for (ns, level) in self.waiting.drain(..ready) {
            if self.written != Some(ns) {
                self.writer.timestamp(ns)?;
                self.written = Some(ns);
            }
            match level {
                Level::Frame { rx, begins } => {
                    let line = if rx { &mut self.rx } else { &mut self.tx };
                    let before = line.frames;
                    line.frames = if begins { before + 1 } else { before.saturating_sub(1) };
                    if before == 0 || line.frames == 0 {
                        self.writer.change_scalar(line.id, begins)?;
                    }
                }
                Level::Wire(id, high) => self.writer.change_scalar(id, high)?,
                Level::Number(id, value) => {
                    let bits = (0..64).rev().map(|bit| vcd::Value::from(value >> bit & 1 == 1));
                    self.writer.change_vector(id, bits)?;
                }
                Level::Text(id, text) => self.writer.change_string(id, text)?,
            }
        }
        Ok(())
    }
}
