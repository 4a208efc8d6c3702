//! The memory of an encoder as a service tool treats it: backups that can be trusted, nothing written before all was checked,
//! and the page register as it was.

use std::cell::RefCell;
use std::io::{self, Read, Write};
use std::rc::Rc;
use std::time::{Duration, UNIX_EPOCH};

use servowire::talk::backup::{Backup, PAGE_LEN};
use servowire::talk::encoder::{Encoder, Restore};
use servowire::talk::fault::Fault;
use servowire::talk::port::Port;
use servowire::talk::record::Recorded;
use tformat::device::Device;
use tformat::{Abm, Abs, BitRate, Error};

/// An encoder at an adapter that answers at once. Each request takes 5 ms of its time.
struct Bench {
    device: Device<6>,
    coming: Vec<u8>,
    asked: u64,
    /// Requests from which on it is silent.
    silent_from: u64,
    /// Addresses that were written, 127 is the page register.
    written: Vec<u8>,
}

#[derive(Clone)]
struct Adapter(Rc<RefCell<Bench>>);

impl Adapter {
    fn new(enid: u8) -> Self {
        let device = Device::new(enid, BitRate::Mbit2_5);
        Self(Rc::new(RefCell::new(Bench { device, coming: vec![], asked: 0, silent_from: u64::MAX, written: vec![] })))
    }

    fn encoder(&self) -> Encoder<Self> {
        Encoder::open(self.clone(), Duration::from_millis(1)).unwrap()
    }

    /// Selects a page and fills the memory with bytes below 80h that tell their place.
    fn filled(self, page: u8) -> Self {
        let mut bench = self.0.borrow_mut();
        for (number, page) in (0_u8..).zip(bench.device.eeprom_mut()) {
            for (at, byte) in (0_u8..).zip(page) {
                *byte = (at.wrapping_mul(7) ^ number.wrapping_mul(37)) & 0x7f;
            }
        }
        // Write EEPROM, address 127; the check field is the XOR.
        assert!(bench.device.hear(&[0x32, 127, page, 0x32 ^ 127 ^ page], 1_000_000).is_some());
        drop(bench);
        self
    }

    fn page(&self) -> u8 {
        self.0.borrow().device.page()
    }

    fn memory(&self) -> [[u8; 127]; 6] {
        *self.0.borrow_mut().device.eeprom_mut()
    }

    /// Cells that were written, without the page register.
    fn cells_written(&self) -> usize {
        self.0.borrow().written.iter().filter(|address| **address != 127).count()
    }
}

impl Read for Adapter {
    fn read(&mut self, bytes: &mut [u8]) -> io::Result<usize> {
        let mut bench = self.0.borrow_mut();
        let count = bench.coming.len();
        if count == 0 {
            return Err(io::ErrorKind::TimedOut.into());
        }
        bytes[..count].copy_from_slice(&bench.coming);
        bench.coming.clear();
        Ok(count)
    }
}

impl Write for Adapter {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let bench = &mut *self.0.borrow_mut();
        bench.asked += 1;
        if bench.asked < bench.silent_from {
            if let [0x32, address, ..] = bytes {
                bench.written.push(*address);
            }
            let answer = bench.device.hear(bytes, bench.asked * 5_000_000);
            bench.coming = answer.map_or(vec![], |answer| answer.frame.as_bytes().to_vec());
        }
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl Port for Adapter {
    fn wait(&mut self, _: Duration) -> io::Result<()> {
        Ok(())
    }

    fn forget(&mut self) -> io::Result<()> {
        self.0.borrow_mut().coming.clear();
        Ok(())
    }
}

/// CRC-32 as zip has it, bit by bit; over "123456789" it is cbf43926.
fn crc32(bytes: &[u8]) -> u32 {
    !bytes.iter().fold(u32::MAX, |crc, byte| {
        (0..8).fold(crc ^ u32::from(*byte), |crc, _| if crc & 1 == 1 { crc >> 1 ^ 0xedb8_8320 } else { crc >> 1 })
    })
}

#[test]
fn a_backup_says_whose_it_is_and_when_and_has_a_check_sum() {
    let adapter = Adapter::new(0x17).filled(0);
    let backup = adapter.encoder().backup(2).unwrap();
    let file: serde_json::Value = serde_json::from_str(&backup.emit()).unwrap();
    let memory = adapter.memory();
    let date = file["date"].as_str().unwrap();
    assert_eq!((date.len(), &date[10..11], &date[19..]), (20, "T", "Z"));
    let summed = [date.as_bytes(), &[23, 23, 16], &memory[0], &memory[1]].concat();
    assert_eq!(crc32(b"123456789"), 0xcbf4_3926);
    assert_eq!(file["crc32"], format!("{:08x}", crc32(&summed)));
    assert_eq!((&file["encoder_id"], &file["abs_bits"], &file["abm_bits"]), (&23.into(), &23.into(), &16.into()));
    assert_eq!(file["pages"].as_array().unwrap().len(), 2);
    assert!(file["pages"][1].as_str().unwrap().starts_with("25 22 2b "), "37, 37 ^ 7, 37 ^ 14");
    assert_eq!(Backup::parse(&backup.emit()), Ok(backup));
}

/// Whatever is changed in a file, it is refused, or it says the same as before.
#[test]
fn a_changed_file_is_no_backup() {
    let mut page = [0; PAGE_LEN];
    page[3] = 0xa5;
    let text = Backup::new(UNIX_EPOCH, 0x11, vec![page]).emit();
    assert!(text.contains("\"date\": \"1970-01-01T00:00:00Z\""), "{text}");
    let whole = Backup::parse(&text).unwrap();
    for at in 0..text.len() {
        for other in ["0", "1", "5", "9", "a", " ", "\"", ",", "x", "}", "+"] {
            let mut changed = text.clone();
            changed.replace_range(at..=at, other);
            if let Ok(read) = Backup::parse(&changed) {
                assert_eq!(read, whole, "{at}: {other:?}");
            }
        }
        assert!(at + 2 >= text.len() || Backup::parse(&text[..=at]).is_err(), "cut after {at}");
    }
    for wrong in ["", "0: ff ff", "{}", "[]"] {
        assert!(Backup::parse(wrong).is_err(), "{wrong}");
    }
    assert!(Backup::parse(&Backup::new(UNIX_EPOCH, 0x11, vec![]).emit()).unwrap_err().starts_with("0 pages"));
    assert!(Backup::parse(&Backup::new(UNIX_EPOCH, 0x11, vec![page; 9]).emit()).unwrap_err().starts_with("9 pages"));
}

#[test]
fn the_page_register_is_put_back() {
    for page in [0, 3, 5] {
        let adapter = Adapter::new(0x17).filled(page);
        let mut encoder = adapter.encoder();
        let backup = encoder.backup(6).unwrap();
        assert_eq!((adapter.page(), adapter.cells_written()), (page, 0));
        assert_eq!(backup.pages(), adapter.memory());
        // There are six pages; the seventh is missed after reading all others.
        let fault = encoder.backup(7).unwrap_err();
        assert!(fault.to_string().ends_with("it has no page 6"), "{fault}");
        assert_eq!(adapter.page(), page);
        adapter.0.borrow_mut().device.eeprom_mut()[4][9] ^= 1;
        let restore = encoder.plan(&backup).unwrap();
        assert_eq!(adapter.page(), page);
        let written = encoder.write(&restore, |_| Ok(()));
        assert!(written.end.is_ok() && written.bytes == 1, "{written:?}");
        assert_eq!((adapter.page(), adapter.cells_written()), (page, 1));
        assert_eq!(backup.pages(), adapter.memory());
    }
}

/// A backup of a 23-bit encoder is not for one of 17 bits: nothing at all is written, not even the page register.
#[test]
fn another_encoders_backup_is_refused() {
    let backup = Adapter::new(0x17).filled(0).encoder().backup(1).unwrap();
    let other = Adapter::new(0x11).filled(0);
    let fault = other.encoder().plan(&backup).unwrap_err();
    assert_eq!(
        fault.to_string(),
        "the backup is of encoder ID 0x17, 23 + 16 bits, the encoder is encoder ID 0x11, 17 + 16 bits: nothing was written"
    );
    assert_eq!(other.0.borrow().written, [0; 0]);
}

/// Between the comparison and the writing another encoder may have come: of another kind, or with another memory.
#[test]
fn the_encoder_that_was_compared_is_the_one_that_is_written() {
    let adapter = Adapter::new(0x17).filled(2);
    let mut encoder = adapter.encoder();
    let backup = encoder.backup(6).unwrap();
    adapter.0.borrow_mut().device.eeprom_mut()[1][1] = 0xee;
    let restore = encoder.plan(&backup).unwrap();
    adapter.0.borrow_mut().device.eeprom_mut()[1][1] = 0xdd;
    let written = encoder.write(&restore, |_| Ok(()));
    assert!(written.end.unwrap_err().to_string().contains("no longer holds"));
    assert_eq!((written.bytes, adapter.cells_written(), adapter.page()), (0, 0, 2));
    adapter.0.borrow_mut().device = Device::new(0x11, BitRate::Mbit2_5);
    let written = encoder.write(&restore, |_| Ok(()));
    assert!(written.end.unwrap_err().to_string().starts_with("the backup is of encoder ID 0x17"));
    assert_eq!((written.bytes, adapter.cells_written()), (0, 0));
}

/// A plan with three bytes to write, on two pages.
fn planned(adapter: &Adapter) -> (Encoder<Adapter>, Restore) {
    let mut encoder = adapter.encoder();
    let backup = encoder.backup(6).unwrap();
    for (page, at) in [(0, 0), (0, 126), (5, 64)] {
        adapter.0.borrow_mut().device.eeprom_mut()[page][at] = 0xee;
    }
    let restore = encoder.plan(&backup).unwrap();
    assert_eq!(restore.changes().len(), 3);
    (encoder, restore)
}

#[test]
fn nothing_is_written_before_the_memory_is_safe() {
    let adapter = Adapter::new(0x17).filled(1);
    let (mut encoder, restore) = planned(&adapter);
    let held = adapter.memory();
    let no = |_: &Backup| Err(Fault::File("the disk is full".to_owned()));
    let written = encoder.write(&restore, no);
    assert_eq!((written.bytes, written.end.unwrap_err().to_string().as_str()), (0, "the disk is full"));
    assert_eq!((adapter.memory(), adapter.cells_written(), adapter.page()), (held, 0, 1));
    let written = encoder.write(&restore, |before| {
        assert_eq!((before.pages(), adapter.cells_written()), (&held[..], 0));
        Ok(())
    });
    assert!(written.end.is_ok() && written.bytes == 3);
    assert!(adapter.memory().iter().flatten().all(|byte| *byte != 0xee));
}

/// The line breaks after any request: what is said to be written is written, at most one byte more is, and a page register that
/// was left elsewhere is named. When the encoder is back the same plan can be made again and comes to its end.
#[test]
fn a_restore_that_is_broken_off_can_be_finished() {
    let mut broken = 0;
    for after in 1.. {
        let adapter = Adapter::new(0x17).filled(3);
        let (mut encoder, restore) = planned(&adapter);
        let begin = adapter.0.borrow().asked;
        adapter.0.borrow_mut().silent_from = begin + after;
        let written = encoder.write(&restore, |_| Ok(()));
        let wrong = adapter.memory().iter().flatten().filter(|byte| **byte == 0xee).count();
        let Err(fault) = written.end else {
            assert_eq!((written.bytes, wrong, adapter.page()), (3, 0, 3));
            break;
        };
        broken += 1;
        let done = 3 - wrong;
        assert!(
            done == written.bytes || done == written.bytes + 1,
            "after {after}: {} said, {done} done",
            written.bytes
        );
        if done > written.bytes {
            let unknown = matches!(&fault, Fault::Encoder(Error::EffectUnknown { .. }));
            let left = matches!(&fault, Fault::PageLeft { because, .. }
                if matches!(**because, Fault::Encoder(Error::EffectUnknown { .. })));
            assert!(unknown || left, "after {after}: {fault}");
        }
        if adapter.page() != 3 {
            assert!(matches!(&fault, Fault::PageLeft { page: 3, .. }), "after {after}: {fault}");
            assert!(fault.to_string().ends_with("the page register could not be restored; it held 3"), "{fault}");
        }
    }
    assert!(broken > 20, "{broken}");
}

/// Resets are read back, and what became of them is never guessed.
#[test]
fn resets_are_read_back() {
    let adapter = Adapter::new(0x11);
    let shaft = |abs, abm| adapter.0.borrow_mut().device.set_position(Abs::truncate(abs), Abm::truncate(abm));
    let mut encoder = adapter.encoder();
    shaft(5_000, 700);
    let changed = encoder.zero_single_turn_and_shift_commutation_angle(0).unwrap();
    assert_eq!((changed.before.abs.get(), changed.after.abs.get(), changed.after.abm.get()), (5_000, 0, 700));
    // The simulated encoder's turns are zeroed by ID C.
    let changed = encoder.zero_turns_and_lose_multi_turn_reference(0).unwrap();
    assert_eq!((changed.before.abm.get(), changed.after.abm.get()), (700, 0));
    shaft(9_000, 3);
    let silent_from = adapter.0.borrow().asked + 8;
    adapter.0.borrow_mut().silent_from = silent_from;
    let fault = encoder.zero_single_turn_and_shift_commutation_angle(0).unwrap_err();
    assert!(matches!(fault, Fault::Encoder(Error::EffectUnknown { .. })), "{fault}");
    // An ID that tells no widths: its position cannot be judged.
    let unknown = Adapter::new(0x33);
    let fault = unknown.encoder().zero_turns_and_lose_multi_turn_reference(0).unwrap_err();
    assert_eq!(fault.to_string(), "encoder ID 0x33 does not tell its widths: nothing was sent");
    // ID 3 by `open`, which tries twice with an echo first, and once more.
    assert!(unknown.0.borrow().asked <= 4);
}

#[test]
fn all_bytes_are_written_down() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("log");
    let mut port = Recorded::new(Adapter::new(0x11), Some(&file)).unwrap();
    let mut buffer = [0; 64];
    for _ in 0..2 {
        port.write_all(&[0x92]).unwrap();
        assert_eq!(port.read(&mut buffer).unwrap(), 4);
        assert!(port.read(&mut buffer).is_err());
    }
    let text = std::fs::read_to_string(&file).unwrap();
    let words: Vec<_> = text.lines().map(|line| line.split_once(' ').unwrap()).collect();
    assert!(words.iter().all(|(time, _)| time.parse::<f64>().is_ok_and(|time| time < 60.0)), "{text}");
    let said: Vec<_> = words.iter().map(|(_, said)| *said).collect();
    assert_eq!(said, ["TX: 92", "RX: 92 00 11 83", "TX: 92", "RX: 92 00 11 83"]);
}
