//! Sessions that are zip files: sigrok and PulseView (`.sr`), DSView (`.dsl`).
//!
//! Both begin with a list of keys and values that names the channels and the sample rate. sigrok's samples follow in
//! chunks of all channels together, DSView's in blocks of one channel each, one bit per sample.

use std::io::{self, Read, SeekFrom, Take};

use flate2::Crc;
use flate2::bufread::DeflateDecoder;
use zip::{CompressionMethod, ZipArchive};

use super::input::{Input, SeekRead};
use super::kinds::Capture;
use super::raw::{Raw, Unit};
use super::recording::{Change, Line};
use crate::fault::{At, Fault};
use crate::time::{self, Clock, Time};

/// A longer file is not a list of keys.
const MOST_KEYS: u64 = 1 << 20;

type Archive = ZipArchive<Box<dyn SeekRead>>;

/// Opens a session.
pub(super) fn open(input: Input) -> Result<Capture, Fault> {
    let name = input.name().to_owned();
    let fault = |what: String| Fault::new(&name, At::File, what);
    let mut archive = ZipArchive::new(input.seekable()?).map_err(|e| fault(format!("not a whole zip file: {e}")))?;
    let has = |archive: &Archive, name: &str| archive.index_for_name(name).is_some();
    if has(&archive, "metadata") {
        sigrok(&name, archive)
    } else if has(&archive, "header") {
        let header = text(&mut archive, "header").map_err(fault)?;
        Ok(Capture::Edges(Box::new(Dsview::new(&name, archive, &header)?)))
    } else if has(&archive, "meta.json") {
        Err(fault(
            "a Logic 2 capture (.sal): export its raw data as CSV or binary, this format is not published".into(),
        ))
    } else {
        Err(fault("a zip file, but neither a sigrok nor a DSView session: unpack it".into()))
    }
}

/// Reads a small entry as text.
fn text(archive: &mut Archive, name: &str) -> Result<String, String> {
    let mut bytes = Vec::new();
    let entry = archive.by_name(name).map_err(|e| format!("its {name} cannot be read: {e}"))?;
    entry.take(MOST_KEYS).read_to_end(&mut bytes).map_err(|e| format!("its {name} cannot be read: {e}"))?;
    Ok(String::from_utf8_lossy(&bytes).into_owned())
}

/// Reads `key=value` lines; blanks around both are ignored.
fn keys(text: &str) -> impl Iterator<Item = (&str, &str)> {
    text.split(['\n', '\r']).filter(|line| !line.starts_with('#')).filter_map(|line| {
        let (key, value) = line.split_once('=')?;
        Some((key.trim(), value.trim()))
    })
}

fn value<'a>(text: &'a str, key: &str) -> Option<&'a str> {
    keys(text).find(|(known, _)| *known == key).map(|(_, value)| value)
}

/// A sample rate above 0.
fn sample_rate(text: &str) -> Option<u64> {
    let rate = time::frequency(value(text, "samplerate")?)?.round();
    (1.0..=1e12).contains(&rate).then_some(rate as u64)
}

const NO_RATE: &str = "the session does not give its sample rate: export it with -O binary and use --rate";

/// A sigrok session, version 1 or 2.
fn sigrok(name: &str, mut archive: Archive) -> Result<Capture, Fault> {
    let fault = |what: &str| Fault::new(name, At::File, what);
    let version = text(&mut archive, "version").unwrap_or_default();
    if !matches!(version.trim(), "1" | "2") {
        return Err(fault(&format!("a sigrok session of version {:?}: only 1 and 2 are known", version.trim())));
    }
    let metadata = text(&mut archive, "metadata").map_err(|what| fault(&what))?;
    let Some(base) = value(&metadata, "capturefile").map(str::to_owned) else {
        return Err(fault("the session has no logic channels: export the analog ones as CSV"));
    };
    if archive.index_for_name(&base).is_none() && archive.index_for_name(&format!("{base}-1")).is_none() {
        return Err(fault("the session holds no samples"));
    }
    let rate = sample_rate(&metadata).ok_or_else(|| fault(NO_RATE))?;
    let unit = value(&metadata, "unitsize").and_then(|size| size.parse().ok()).unwrap_or(1_usize);
    if !(1..=8).contains(&unit) {
        return Err(fault("more than 64 logic channels are not read"));
    }
    let probe = |(key, name): (&str, &str)| {
        let bit: u16 = key.strip_prefix("probe")?.parse().ok()?;
        Some((bit.checked_sub(1).filter(|bit| usize::from(*bit) < 8 * unit)?, unescaped(name)))
    };
    let channels: Vec<(u16, String)> = keys(&metadata).filter_map(probe).collect();
    if channels.is_empty() {
        return Err(fault("no logic channel was switched on"));
    }
    let input = Input::over(name, Chunks::new(archive, &base));
    Ok(Capture::Samples(Raw::with_channels(input, rate, Unit::Bytes(unit), channels)))
}

/// Decodes a value of a key file with its escapes, such as `\s`.
fn unescaped(text: &str) -> String {
    let mut out = String::new();
    let mut letters = text.chars();
    while let Some(letter) = letters.next() {
        match letter {
            '\\' => match letters.next() {
                Some('s') => out.push(' '),
                Some('t') => out.push('\t'),
                Some('n' | 'r') | None => {}
                Some(other) => out.push(other),
            },
            other => out.push(other),
        }
    }
    out
}

/// Where a chunk is in the archive.
struct Chunk {
    start: u64,
    packed: u64,
    method: CompressionMethod,
    crc: u32,
}

/// A chunk being unpacked.
enum Open {
    Stored(Take<Box<dyn SeekRead>>),
    Deflated(Box<DeflateDecoder<Take<Box<dyn SeekRead>>>>),
}

impl Open {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        match self {
            Self::Stored(reader) => reader.read(buffer),
            Self::Deflated(reader) => reader.read(buffer),
        }
    }

    fn close(self) -> Box<dyn SeekRead> {
        match self {
            Self::Stored(reader) => reader.into_inner(),
            Self::Deflated(reader) => reader.into_inner().into_inner(),
        }
    }
}

/// The chunks of a session, one after another.
struct Chunks {
    /// The remaining chunks; a chunk that cannot be read is the last.
    left: std::vec::IntoIter<io::Result<Chunk>>,
    /// Between two chunks.
    file: Option<Box<dyn SeekRead>>,
    /// With its checksum, and the checksum of the bytes read so far.
    open: Option<(Open, u32, Crc)>,
}

impl Chunks {
    fn new(mut archive: Archive, base: &str) -> Self {
        // One file, or chunks counted from 1.
        let names: Box<dyn Iterator<Item = String>> = match archive.index_for_name(base) {
            Some(_) => Box::new(std::iter::once(base.to_owned())),
            None => Box::new((1_u32..).map(|chunk| format!("{base}-{chunk}"))),
        };
        let mut chunks = Vec::new();
        for name in names {
            if archive.index_for_name(&name).is_none() {
                break;
            }
            let chunk = archive.by_name(&name).map(|entry| Chunk {
                start: entry.data_start(),
                packed: entry.compressed_size(),
                method: entry.compression(),
                crc: entry.crc32(),
            });
            chunks.push(chunk.map_err(io::Error::other));
            if chunks.last().is_some_and(Result::is_err) {
                break;
            }
        }
        Self { left: chunks.into_iter(), file: Some(archive.into_inner()), open: None }
    }

    /// Returns the next chunk; `None` after the last.
    fn next(&mut self) -> io::Result<Option<(Open, u32, Crc)>> {
        let (Some(chunk), Some(mut file)) = (self.left.next().transpose()?, self.file.take()) else { return Ok(None) };
        file.seek(SeekFrom::Start(chunk.start))?;
        let packed = file.take(chunk.packed);
        let open = match chunk.method {
            CompressionMethod::Stored => Open::Stored(packed),
            _ => Open::Deflated(Box::new(DeflateDecoder::new(packed))),
        };
        Ok(Some((open, chunk.crc, Crc::new())))
    }
}

impl Read for Chunks {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        while let Some((mut open, due, mut crc)) =
            self.open.take().map_or_else(|| self.next(), |open| Ok(Some(open)))?
        {
            let count = open.read(buffer)?;
            if count > 0 || buffer.is_empty() {
                crc.update(buffer.get(..count).unwrap_or_default());
                self.open = Some((open, due, crc));
                return Ok(count);
            }
            if crc.sum() != due {
                return Err(io::Error::new(io::ErrorKind::InvalidData, "Invalid checksum"));
            }
            self.file = Some(open.close());
        }
        Ok(0)
    }
}

/// Maximum number of samples in a block of a DSView channel; blocks are shorter at the beginning and at the end.
const DSVIEW_BLOCK: u64 = 1 << 24;
/// Bytes of all channels that are searched for changes at once.
const PIECE: usize = 1 << 12;

/// A DSView session, version 2 or 3.
struct Dsview {
    name: String,
    archive: Archive,
    channels: Vec<String>,
    /// Numbers of the channels in the entries' names.
    numbers: Vec<u16>,
    clock: Clock,
    total: u64,
    block: u32,
    data: Vec<Vec<u8>>,
    at: usize,
    /// Samples before this block.
    before: u64,
    last: Vec<Option<bool>>,
    reached: u64,
}

impl Dsview {
    fn new(name: &str, archive: Archive, header: &str) -> Result<Self, Fault> {
        let fault = |what: &str| Fault::new(name, At::File, what);
        match value(header, "version") {
            Some("2" | "3") => {}
            other => {
                let version = other.unwrap_or("1");
                return Err(fault(&format!(
                    "a DSView session of version {version}: only 2 and 3 are known; export it as CSV"
                )));
            }
        }
        if value(header, "device mode").is_some_and(|mode| mode != "0") {
            return Err(fault("not a logic analyser session: export it as CSV"));
        }
        let clock = Clock::new(sample_rate(header).ok_or_else(|| fault(NO_RATE))?);
        let total = value(header, "total samples").and_then(|total| total.parse().ok()).unwrap_or(u64::MAX);
        let probe =
            |(key, name): (&str, &str)| Some((key.strip_prefix("probe")?.parse::<u16>().ok()?, name.to_owned()));
        let probes = keys(header).filter_map(probe);
        let (numbers, channels): (Vec<u16>, Vec<String>) =
            probes.filter(|(number, _)| archive.index_for_name(&format!("L-{number}/0")).is_some()).unzip();
        if channels.is_empty() || channels.len() > 64 {
            return Err(fault("no samples of a logic channel in it"));
        }
        Ok(Self {
            name: name.to_owned(),
            archive,
            last: vec![None; channels.len()],
            data: Vec::new(),
            channels,
            numbers,
            clock,
            total,
            block: 0,
            at: 0,
            before: 0,
            reached: 0,
        })
    }

    /// Reads the next block of all channels; returns whether there is one.
    fn load(&mut self) -> Result<bool, Fault> {
        self.before += 8 * self.data.first().map_or(0, |data| data.len() as u64);
        self.data.clear();
        self.at = 0;
        for number in &self.numbers {
            let entry = format!("L-{number}/{}", self.block);
            if self.archive.index_for_name(&entry).is_none() {
                self.data.clear();
                return Ok(false);
            }
            let mut bytes = Vec::new();
            let fault = |what: String| Fault::new(&self.name, At::File, format!("{entry} cannot be read: {what}"));
            let file = self.archive.by_name(&entry).map_err(|e| fault(e.to_string()))?;
            file.take(DSVIEW_BLOCK / 8).read_to_end(&mut bytes).map_err(|e| fault(e.to_string()))?;
            self.data.push(bytes);
        }
        self.block += 1;
        Ok(self.data.iter().any(|data| !data.is_empty()))
    }
}

impl Line for Dsview {
    fn channels(&self) -> &[String] {
        &self.channels
    }

    fn read(&mut self, changes: &mut Vec<Change>) -> Result<bool, Fault> {
        let longest = |data: &[Vec<u8>]| data.iter().map(Vec::len).max().unwrap_or(0);
        if self.at >= longest(&self.data) && !self.load()? {
            return Ok(false);
        }
        let new = changes.len();
        for ((channel, data), last) in (0_u16..).zip(&self.data).zip(&mut self.last) {
            let piece = data.get(self.at..).unwrap_or_default();
            for (byte, bits) in (self.at..).zip(piece.iter().take(PIECE)) {
                let same = if *last == Some(true) { 0xff } else { 0x00 };
                if last.is_some() && *bits == same {
                    continue;
                }
                for bit in 0..8 {
                    let (index, level) = (self.before + 8 * byte as u64 + bit, bits >> bit & 1 == 1);
                    if *last != Some(level) && index < self.total {
                        *last = Some(level);
                        changes.push(Change { time: self.clock.time(index), channel, level });
                    }
                }
            }
        }
        if let Some(new) = changes.get_mut(new..) {
            new.sort_by_key(|change| change.time);
        }
        self.at += PIECE;
        let here = self.before + 8 * self.at.min(longest(&self.data)) as u64;
        self.reached = here.min(self.total);
        Ok(true)
    }

    fn reached(&self) -> Time {
        self.clock.time(self.reached)
    }
}
