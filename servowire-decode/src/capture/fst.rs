//! FST, the packed waveforms of GTKWave and Verilator. Channels are the variables of one bit.

mod blocks;

use std::collections::HashMap;

use flate2::read::GzDecoder;
use fst_reader::{FstFilter, FstHierarchyEntry, FstReader, FstSignalHandle, FstSignalValue, FstVarType};

use super::hints::Guard;
use super::input::{Input, SeekRead};
use super::recording::{Change, Line};
use crate::fault::{At, Fault};
use crate::time::Time;

/// Number of parts in which the file is read, so that it is never held in memory as a whole.
const PARTS: u64 = 64;
/// Maximum number of channels.
const CHANNELS: usize = 65_535;

/// The type of a block that holds a whole file packed by gzip; its own length and the length of the file follow.
const WRAPPED: u8 = 254;

const DAMAGED: &str = "not valid FST: the file is damaged";

/// The library panics on some damaged files. `guard` catches the panic and returns no result, and the file is reported as
/// faulty.
fn guarded<T>(guard: Option<Guard>, call: impl FnOnce() -> T) -> Option<T> {
    let Some(guard) = guard else { return Some(call()) };
    let (mut call, mut result) = (Some(call), None);
    guard(&mut || result = call.take().map(|call| call()));
    result
}

/// Unpacks a file that is packed as a whole. The library would trust the length stated in the file.
fn unwrapped(mut input: Input) -> Result<Input, Fault> {
    if input.peek()?.first() != Some(&WRAPPED) {
        return Ok(input);
    }
    let name = input.name().to_owned();
    let mut lengths = [0; 1 + 8 + 8];
    input.read_full(&mut lengths, 1).map_err(|e| input.io_fault(At::File, &e))?;
    Ok(Input::over(&name, GzDecoder::new(input)))
}

/// An FST file after its hierarchy.
pub struct Fst {
    name: String,
    date: Option<String>,
    guard: Option<Guard>,
    reader: FstReader<Box<dyn SeekRead>>,
    channels: Vec<String>,
    /// The channel for each handle index.
    of_handle: HashMap<usize, u16>,
    last: Vec<Option<bool>>,
    /// Power of ten of the unit of time, in seconds.
    exponent: i32,
    next: u64,
    end: u64,
    step: u64,
    reached: Time,
}

impl Fst {
    /// Reads header and hierarchy. The library is called by `guard`.
    pub fn new(input: Input, guard: Option<Guard>) -> Result<Self, Fault> {
        let name = input.name().to_owned();
        let fault = |what: String| Fault::new(&name, At::File, what);
        let broken = |e: fst_reader::ReaderError| fault(format!("not valid FST: {e}"));
        let mut source = unwrapped(input)?.seekable()?;
        blocks::check(source.as_mut()).map_err(fault)?;
        let opened = guarded(guard, || FstReader::open(source));
        let mut reader = opened.ok_or_else(|| fault(DAMAGED.into()))?.map_err(broken)?;
        let header = reader.get_header();
        let (mut scopes, mut found): (Vec<String>, Vec<(String, String, FstSignalHandle)>) = (Vec::new(), Vec::new());
        let hierarchy = |entry| match entry {
            FstHierarchyEntry::Scope { name, .. } => scopes.push(name),
            FstHierarchyEntry::UpScope => drop(scopes.pop()),
            FstHierarchyEntry::Var { tpe, name, length: 1, handle, is_alias: false, .. }
                if !tpe.is_real() && tpe != FstVarType::GenericString && tpe != FstVarType::Event =>
            {
                found.push((scopes.join("."), name, handle));
            }
            _ => {}
        };
        guarded(guard, || reader.read_hierarchy(hierarchy)).ok_or_else(|| fault(DAMAGED.into()))?.map_err(broken)?;
        if found.is_empty() {
            return Err(fault("no variable of one bit in this file, so no line to decode".into()));
        }
        if found.len() > CHANNELS {
            return Err(fault(format!("more than {CHANNELS} variables of one bit")));
        }
        let mut names: HashMap<&str, usize> = HashMap::new();
        for (_, own, _) in &found {
            *names.entry(own.as_str()).or_default() += 1;
        }
        let full = |(scope, own, _): &(String, String, FstSignalHandle)| {
            let own = own.trim_end().to_owned();
            if names.get(own.as_str()) == Some(&1) || scope.is_empty() { own } else { format!("{scope}.{own}") }
        };
        let channels: Vec<String> = found.iter().map(full).collect();
        let of_handle = (0..).zip(&found).map(|(channel, (.., handle))| (handle.get_index(), channel)).collect();
        let step = (header.end_time.saturating_sub(header.start_time) / PARTS).max(1);
        let date = Some(header.date.trim().to_owned()).filter(|date| !date.is_empty());
        Ok(Self {
            name,
            guard,
            date,
            reader,
            last: vec![None; channels.len()],
            channels,
            of_handle,
            exponent: header.timescale_exponent.into(),
            next: header.start_time,
            end: header.end_time,
            step,
            reached: Time::ZERO,
        })
    }
}

/// Converts a stamp to picoseconds.
fn picoseconds(stamp: u64, exponent: i32) -> Option<Time> {
    let power = exponent + 12;
    let factor = 10_u128.checked_pow(power.unsigned_abs())?;
    let time =
        if power >= 0 { u128::from(stamp).checked_mul(factor)? } else { (u128::from(stamp) + factor / 2) / factor };
    i128::try_from(time).ok().map(Time::from_ps)
}

impl Line for Fst {
    fn channels(&self) -> &[String] {
        &self.channels
    }

    fn date(&self) -> Option<&str> {
        self.date.as_deref()
    }

    fn read(&mut self, changes: &mut Vec<Change>) -> Result<bool, Fault> {
        if self.next > self.end {
            return Ok(false);
        }
        let until = self.next.saturating_add(self.step - 1).min(self.end);
        let handles = self.of_handle.keys().map(|index| FstSignalHandle::from_index(*index)).collect();
        let filter = FstFilter::new(self.next, until, handles);
        let (first, exponent) = (changes.len(), self.exponent);
        let (of_handle, from) = (&self.of_handle, self.next);
        let mut too_large = false;
        let reader = &mut self.reader;
        let take = |stamp: u64, handle: FstSignalHandle, value: FstSignalValue<'_>| {
            let FstSignalValue::String(&[digit]) = value else { return };
            let level = match digit {
                b'0' | b'L' | b'l' => false,
                b'1' | b'H' | b'h' | b'z' | b'Z' => true,
                // Unknown: the line keeps the level it had.
                _ => return,
            };
            // A part is given with the whole of the blocks it touches.
            if stamp > until || stamp < from {
                return;
            }
            let Some(channel) = of_handle.get(&handle.get_index()).copied() else { return };
            match picoseconds(stamp, exponent) {
                Some(time) => changes.push(Change { time, channel, level }),
                None => too_large = true,
            }
        };
        let read = guarded(self.guard, || reader.read_signals(&filter, take));
        let read = read.ok_or_else(|| Fault::new(&self.name, At::File, DAMAGED))?;
        read.map_err(|e| Fault::new(&self.name, At::File, format!("not valid FST: {e}")))?;
        if too_large {
            return Err(Fault::new(&self.name, At::File, "its times are too large"));
        }
        // In a block they come signal by signal; a part may begin with the levels that are known already.
        let mut new = changes.split_off(first);
        new.sort_by_key(|change| change.time);
        let last = &mut self.last;
        new.retain(|change| match last.get_mut(usize::from(change.channel)) {
            Some(last) if *last != Some(change.level) => {
                *last = Some(change.level);
                true
            }
            _ => false,
        });
        changes.append(&mut new);
        self.next = until.saturating_add(1);
        self.reached = picoseconds(until, exponent).unwrap_or(Time::MAX);
        Ok(self.next <= self.end)
    }

    fn reached(&self) -> Time {
        self.reached
    }
}
