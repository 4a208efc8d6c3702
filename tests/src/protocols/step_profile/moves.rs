//! Whole moves.

use serde::Deserialize;
use sha2::{Digest, Sha256};
use sorte_proto::Pto;
use step_profile::{Arithmetic, Axis, Command, Direction, Parameters, Profile, RampStep, RampTable, Shape, Speed};

use super::tables::profile as checked;
use super::words;
use crate::hex::{Bytes, Hex};
use crate::row::{Fault, Row, Verdict, each, same};

/// Ramp index, step time, cycle, sync_time.
type Line = (u8, u32, u64, u32);

fn line(step: RampStep) -> Line {
    (step.entry, step.t_step, step.cycle, step.sync_time)
}

/// Both hashes over a byte stream.
struct Hashes {
    fnv1a64: u64,
    sha256: Sha256,
}

impl Hashes {
    fn new() -> Self {
        Self { fnv1a64: 0xcbf2_9ce4_8422_2325, sha256: Sha256::new() }
    }

    fn add(&mut self, bytes: &[u8]) {
        for &byte in bytes {
            self.fnv1a64 = (self.fnv1a64 ^ u64::from(byte)).wrapping_mul(0x100_0000_01b3);
        }
        self.sha256.update(bytes);
    }

    fn check(self, fnv1a64: Hex, sha256: &Bytes) -> Verdict {
        same("fnv1a64", &fnv1a64.0, &self.fnv1a64)?;
        same("sha256", &sha256.0, &self.sha256.finalize().to_vec())
    }
}

/// What all rows about a whole move say.
struct Move<'r> {
    head: &'r [Line],
    tail: &'r [Line],
    last: Option<(u64, u32)>,
    total_ns: u64,
    fnv1a64: Hex,
    sha256: &'r Bytes,
}

impl Move<'_> {
    fn check(&self, profile: Profile<'_>, n: u32) -> Verdict {
        let mut hashes = Hashes::new();
        let (mut head, mut tail, mut last) = (Vec::new(), Vec::new(), None);
        let tail_from = (n as usize).saturating_sub(self.tail.len());
        for step in profile.steps(n) {
            let index = step.index as usize;
            if index < self.head.len() {
                head.push(line(step));
            }
            if index >= tail_from {
                tail.push(line(step));
            }
            last = Some((step.cycle, step.sync_time));
            hashes.add(&(step.cycle as u32).to_le_bytes());
            hashes.add(&(step.sync_time as u16).to_le_bytes());
        }
        same("head", &self.head, &head.as_slice())?;
        same("tail", &self.tail, &tail.as_slice())?;
        same("last", &self.last, &last)?;
        same("total_ns", &self.total_ns, &profile.duration_ns(n))?;
        hashes.check(self.fnv1a64, self.sha256)
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ProfileRow {
    n: u32,
    k: u32,
    speed: u32,
    init_sync: u32,
    accel_steps: u32,
    const_steps: u32,
    decel_steps: u32,
    exact: bool,
    total_ns: u64,
    last: Option<(u64, u32)>,
    zero_sync: usize,
    above_3990: usize,
    head: Vec<Line>,
    tail: Vec<Line>,
    sha256: Bytes,
    fnv1a64: Hex,
}

pub(super) fn profile(rows: &[Row]) -> Vec<Verdict> {
    each(rows, |row: ProfileRow| {
        let parameters = Parameters::at(Speed::from_raw(row.speed))
            .with_steps_per_entry(row.k)
            .with_init_sync(row.init_sync)
            .with_arithmetic(Arithmetic::PruExact);
        let pru = checked(parameters)?;
        let ProfileRow { ref head, ref tail, last, total_ns, fnv1a64, ref sha256, .. } = row;
        Move { head, tail, last, total_ns, fnv1a64, sha256 }.check(pru, row.n)?;
        let shape = Shape { accelerating: row.accel_steps, constant: row.const_steps, decelerating: row.decel_steps };
        same("shape", &shape, &pru.shape(row.n))?;
        let count = |what: fn(&RampStep) -> bool| pru.steps(row.n).filter(what).count();
        same("zero_sync", &row.zero_sync, &count(|step| step.sync_time == 0))?;
        same("above_3990", &row.above_3990, &count(|step| step.sync_time > 3990))?;
        let corrected = checked(parameters.with_arithmetic(Arithmetic::Corrected))?;
        let exact = pru.steps(row.n).eq(corrected.steps(row.n));
        same("exact", &row.exact, &exact)?;
        same("exact, by the flag of the profile", &true, &(exact || !pru.pru_is_exact()))
    })
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct TableRow {
    #[serde(rename = "table_name")]
    _table_name: String,
    table: [u32; RampTable::LEN],
    n: u32,
    k: u32,
    speed: u32,
    init_sync: u32,
    total_ns: u64,
    head: Vec<Line>,
    last: Option<(u64, u32)>,
    sha256: Bytes,
    fnv1a64: Hex,
}

pub(super) fn profile_alt_table(rows: &[Row]) -> Vec<Verdict> {
    each(rows, |row: TableRow| {
        let table = RampTable::new(row.table).map_err(|e| Fault::Unreadable(format!("the table is refused: {e}")))?;
        let profile = checked(
            Parameters::at(Speed::from_raw(row.speed))
                .with_steps_per_entry(row.k)
                .with_init_sync(row.init_sync)
                .with_arithmetic(Arithmetic::PruExact)
                .with_table(&table),
        )?;
        let TableRow { ref head, last, total_ns, fnv1a64, ref sha256, .. } = row;
        Move { head, tail: &[], last, total_ns, fnv1a64, sha256 }.check(profile, row.n)
    })
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct InexactRow {
    n: u32,
    k: u32,
    speed: u32,
    init_sync: u32,
    pru: Vec<Line>,
    corrected: Vec<Line>,
}

/// Every step is listed, in both arithmetics.
pub(super) fn profile_inexact(rows: &[Row]) -> Vec<Verdict> {
    each(rows, |row: InexactRow| {
        for (what, arithmetic, want) in
            [("pru", Arithmetic::PruExact, &row.pru), ("corrected", Arithmetic::Corrected, &row.corrected)]
        {
            let profile = checked(
                Parameters::at(Speed::from_raw(row.speed))
                    .with_steps_per_entry(row.k)
                    .with_init_sync(row.init_sync)
                    .with_arithmetic(arithmetic),
            )?;
            same("inside the proved domain", &false, &profile.pru_is_exact())?;
            same(what, want, &profile.steps(row.n).map(line).collect())?;
        }
        Ok(())
    })
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct StreamRow {
    n: u32,
    k: u32,
    speed: u32,
    init_sync: u32,
    dir: u8,
    cycles: u64,
    guard: bool,
    idle_word: Hex,
    pulses: Vec<(u64, Hex)>,
    first_64_words_le: Bytes,
    sha256: Bytes,
    fnv1a64: Hex,
}

pub(super) fn cycle_stream(rows: &[Row]) -> Vec<Verdict> {
    each(rows, |row: StreamRow| {
        let parameters =
            Parameters::at(Speed::from_raw(row.speed)).with_steps_per_entry(row.k).with_init_sync(row.init_sync);
        // Executed by the PRU; the corrected arithmetic is the same in its domain.
        stream(&row, checked(parameters.with_arithmetic(Arithmetic::PruExact))?)?;
        let corrected = checked(parameters)?;
        if corrected.pru_is_exact() { stream(&row, corrected) } else { Ok(()) }
    })
}

fn stream(row: &StreamRow, profile: Profile<'_>) -> Verdict {
    let mut axis = Axis::new();
    let direction = Direction::from_code(row.dir).ok_or_else(|| Fault::Unreadable("dir".to_owned()))?;
    axis.start(profile, row.n, direction).map_err(|e| Fault::Unreadable(format!("the start is refused: {e}")))?;
    let mut hashes = Hashes::new();
    let (mut first, mut pulses) = (Vec::new(), Vec::new());
    for cycle in 0..row.cycles {
        let command = match axis.tick() {
            // No step of the move: DIR comes from the row alone.
            Command::Hold { .. } if row.n == 0 => Command::Hold { direction },
            command => command,
        };
        let word = word(command, row.guard)?;
        if cycle < 64 {
            first.extend(word.to_le_bytes());
        }
        if u64::from(word) != row.idle_word.0 {
            pulses.push((cycle, Hex(word.into())));
        }
        hashes.add(&word.to_le_bytes());
    }
    same("idle_word", &row.idle_word, &Hex(word(Command::Hold { direction }, row.guard)?.into()))?;
    same("pulses", &row.pulses, &pulses)?;
    same("first_64_words_le", &row.first_64_words_le, &Bytes(first))?;
    hashes.check(row.fnv1a64, &row.sha256)
}

/// The PTO word; without the guard the sync_time goes into it as it is.
fn word(command: Command, guard: bool) -> Result<u16, Fault> {
    match command {
        Command::Pulse { direction, sync_time } if !guard => Ok(u16::from(direction.dir()) << 15 | sync_time as u16),
        command => words::pto(command).map(Pto::word).map_err(|e| Fault::Unreadable(format!("no PTO word: {e}"))),
    }
}
