//! The content of an encoder's memory, with the encoder's identity and the date, in a file protected by a checksum.

use std::time::SystemTime;

use crc::{CRC_32_ISO_HDLC, Crc, Table};
use serde::{Deserialize, Serialize};
use tformat::{Address, Page, Resolution};

use super::fault::Fault;

/// Bytes of a page; the address after them selects the page.
pub const PAGE_LEN: usize = 127;

/// A page.
pub type PageData = [u8; PAGE_LEN];

/// The memory of an encoder.
///
/// It is kept as JSON. The checksum is the CRC-32 of zip over the characters of `date`, one byte each for `encoder_id`,
/// `abs_bits` and `abm_bits` (0 if the ID does not imply them), and the bytes of all pages.
///
/// ```text
/// {
///   "format": "servowire T-Format EEPROM 1",
///   "date": "2026-01-31T12:00:00Z",
///   "encoder_id": 23,
///   "abs_bits": 23,
///   "abm_bits": 16,
///   "pages": [
///     "ff ff ...",
///   ],
///   "crc32": "00c0ffee"
/// }
/// ```
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "File", into = "File")]
pub struct Backup {
    date: String,
    encoder_id: u8,
    widths: [u8; 2],
    pages: Vec<PageData>,
}

const FORMAT: &str = "servowire T-Format EEPROM 1";

/// The largest number of pages that any encoder is known to have.
const MOST_PAGES: usize = 8;

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    format: String,
    date: String,
    encoder_id: u8,
    abs_bits: u8,
    abm_bits: u8,
    pages: Vec<String>,
    crc32: String,
}

impl Backup {
    /// Creates a backup of the pages, from page 0 onwards, of an encoder with this ID, read at this time.
    pub fn new(date: SystemTime, encoder_id: u8, pages: Vec<PageData>) -> Self {
        let date = humantime::format_rfc3339_seconds(date).to_string();
        Self { date, encoder_id, widths: widths(encoder_id), pages }
    }

    /// When it was read, as `2026-01-31T12:00:00Z`.
    pub fn date(&self) -> &str {
        &self.date
    }

    /// The encoder's ID.
    pub const fn encoder_id(&self) -> u8 {
        self.encoder_id
    }

    /// Pages, from page 0 onwards.
    pub fn pages(&self) -> &[PageData] {
        &self.pages
    }

    /// Returns all bytes, with their places.
    pub fn cells(&self) -> impl Iterator<Item = (Page, Address, u8)> + '_ {
        let page = |(number, data): (u8, &PageData)| {
            let data = *data;
            (0..).zip(data).map(move |(at, byte)| (Page::truncate(number), Address::truncate(at), byte))
        };
        (0..).zip(&self.pages).flat_map(page)
    }

    /// Checks whether it may be written to an encoder with this ID.
    ///
    /// # Errors
    /// [`Fault::Input`]: the encoder is of another kind.
    pub fn fits(&self, encoder_id: u8) -> Result<(), Fault> {
        let (ours, its) = (self.widths, widths(encoder_id));
        if (self.encoder_id, ours) == (encoder_id, its) {
            return Ok(());
        }
        let named = |id: u8, [abs, abm]: [u8; 2]| format!("encoder ID {id:#04x}, {abs} + {abm} bits");
        Err(Fault::Input(format!(
            "the backup is of {}, the encoder is {}: nothing was written",
            named(self.encoder_id, ours),
            named(encoder_id, its)
        )))
    }

    /// Reads a file.
    ///
    /// # Errors
    /// What is wrong with it, in words.
    pub fn parse(text: &str) -> Result<Self, String> {
        serde_json::from_str(text).map_err(|error| error.to_string())
    }

    /// The file.
    pub fn emit(&self) -> String {
        format!("{:#}\n", serde_json::json!(self))
    }

    fn crc32(&self) -> u32 {
        const CRC32: Crc<u32, Table<1>> = Crc::<u32, Table<1>>::new(&CRC_32_ISO_HDLC);
        let mut digest = CRC32.digest();
        digest.update(self.date.as_bytes());
        digest.update(&[self.encoder_id]);
        digest.update(&self.widths);
        self.pages.iter().for_each(|page| digest.update(page));
        digest.finalize()
    }
}

/// Returns the bits of a turn and of the turn count that an encoder ID implies; 0 if it implies none.
fn widths(encoder_id: u8) -> [u8; 2] {
    let known = Resolution::from_enid(encoder_id).map(|hint| hint.resolution);
    known.map_or([0; 2], |resolution| [resolution.abs_bits(), resolution.abm_bits()])
}

impl From<Backup> for File {
    fn from(backup: Backup) -> Self {
        let crc32 = format!("{:08x}", backup.crc32());
        let Backup { date, encoder_id, widths: [abs_bits, abm_bits], pages } = backup;
        let hex = |page: &PageData| page.map(|byte| format!("{byte:02x}")).join(" ");
        let pages = pages.iter().map(hex).collect();
        Self { format: FORMAT.to_owned(), date, encoder_id, abs_bits, abm_bits, pages, crc32 }
    }
}

impl TryFrom<File> for Backup {
    type Error = String;

    fn try_from(file: File) -> Result<Self, String> {
        let File { format, date, encoder_id, abs_bits, abm_bits, pages, crc32 } = file;
        if format != FORMAT {
            return Err(format!("its format is {format:?}, not {FORMAT:?}"));
        }
        if !(1..=MOST_PAGES).contains(&pages.len()) {
            return Err(format!("{} pages; an encoder has 1 to {MOST_PAGES}", pages.len()));
        }
        let pages = pages.iter().enumerate().map(|(number, text)| page(number, text)).collect::<Result<_, _>>()?;
        let backup = Self { date, encoder_id, widths: [abs_bits, abm_bits], pages };
        let want = format!("{:08x}", backup.crc32());
        if crc32 != want {
            return Err(format!("its checksum is {crc32}, but its content gives {want}: it was changed or damaged"));
        }
        Ok(backup)
    }
}

fn page(number: usize, text: &str) -> Result<PageData, String> {
    let byte =
        |word: &str| u8::from_str_radix(word, 16).map_err(|_| format!("page {number}: {word:?} is not a byte in hex"));
    let bytes = text.split(' ').map(byte).collect::<Result<Vec<_>, _>>()?;
    let count = bytes.len();
    bytes.try_into().map_err(|_| format!("page {number} has {count} bytes instead of {PAGE_LEN}"))
}
