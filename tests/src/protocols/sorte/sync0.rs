//! The SYNC0 generator: event by event, and in closed loop with an ideal timer.

use serde::Deserialize;
use sorte_proto::iep::{Activity, Channel, Edge, Events};
use sorte_proto::sync0::{Flags, PULSE_NS, Register, Sync0, Variant, Write, Writes};
use sorte_proto::{Pto, StartTime};

use super::Origin;
use crate::row::{Fault, Row, Verdict, each, same};

#[derive(Deserialize, Clone, Copy)]
#[serde(rename_all = "snake_case")]
enum VariantName {
    Published,
    Lossless,
}

impl From<VariantName> for Variant {
    fn from(name: VariantName) -> Self {
        match name {
            VariantName::Published => Self::Published,
            VariantName::Lossless => Self::Lossless,
        }
    }
}

#[derive(Deserialize, Clone, Copy, PartialEq)]
#[serde(rename_all = "UPPERCASE")]
enum Event {
    Cmp6,
    Cmp0,
    Cmp7,
}

#[derive(Deserialize, Debug, Clone, Copy, PartialEq)]
#[serde(rename_all = "SCREAMING_SNAKE_CASE")]
enum RegisterName {
    CmpCfg,
    Cmp1,
    Cmp6,
    SyncStart,
    SyncCtrl,
}

impl From<Register> for RegisterName {
    fn from(register: Register) -> Self {
        match register {
            Register::CmpCfg => Self::CmpCfg,
            Register::Cmp1 => Self::Cmp1,
            Register::Cmp6 => Self::Cmp6,
            Register::SyncStart => Self::SyncStart,
            Register::SyncCtrl => Self::SyncCtrl,
        }
    }
}

/// A word as the buffer holds it, to what CMP7 is told.
fn start(word: u16) -> Option<StartTime> {
    Pto::from_word(word).start()
}

/// Names of the flags in the order of their bits, spelt here once more, so that a wrong name in the crate is found.
fn names(flags: Flags) -> Vec<&'static str> {
    let all = [
        (0, "PENDING_PULSE"),
        (1, "ACTIVE_PULSE"),
        (3, "DELAYED_CMP6_ACTIVATED"),
        (7, "SYNC_PULSE_OVERLAP"),
        (8, "PREV_SYNC_PULSE_OVERLAP"),
    ];
    all.into_iter().filter(|(bit, _)| flags.bits() >> bit & 1 == 1).map(|(_, name)| name).collect()
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct FsmRow {
    #[serde(rename = "origin")]
    _origin: Origin,
    variant: VariantName,
    steps: Vec<Step>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Step {
    ev: Vec<Event>,
    pto: Option<u16>,
    writes: Vec<(RegisterName, u16)>,
    flags: Vec<String>,
    cmp1: u16,
    cmp6: u16,
    start: u16,
    cmp1_en: u8,
    cmp6_en: u8,
}

/// The registers as the writes leave them.
#[derive(Default)]
struct Registers {
    cmp1: u16,
    cmp6: u16,
    start: u16,
    cfg: u16,
}

impl Registers {
    fn take(&mut self, Write { register, value }: Write) {
        match register {
            Register::CmpCfg => self.cfg = value,
            Register::Cmp1 => self.cmp1 = value,
            Register::Cmp6 => self.cmp6 = value,
            Register::SyncStart => self.start = value,
            Register::SyncCtrl => {}
        }
    }

    fn check(&self, cmp1: u16, cmp6: u16, start: u16, cmp1_en: u8, cmp6_en: u8) -> Verdict {
        same("cmp1", &cmp1, &self.cmp1)?;
        same("cmp6", &cmp6, &self.cmp6)?;
        same("start", &start, &self.start)?;
        same("cmp1_en", &u16::from(cmp1_en), &(self.cfg >> 2 & 1))?;
        same("cmp6_en", &u16::from(cmp6_en), &(self.cfg >> 7 & 1))
    }
}

fn listed(writes: impl IntoIterator<Item = Write>) -> Vec<(RegisterName, u16)> {
    writes.into_iter().map(|write| (write.register.into(), write.value)).collect()
}

pub(super) fn fsm(rows: &[Row]) -> Vec<Verdict> {
    each(rows, |row: FsmRow| {
        let mut sync0 = Sync0::new(row.variant.into());
        let mut registers = Registers::default();
        for step in row.steps {
            let mut writes: Vec<Write> = Vec::new();
            if step.ev.contains(&Event::Cmp6) {
                writes.extend(sync0.cmp6());
            }
            if step.ev.contains(&Event::Cmp0) {
                writes.extend(sync0.cmp0());
            }
            if step.ev.contains(&Event::Cmp7) {
                let word = step.pto.ok_or_else(|| Fault::Unreadable("CMP7 without pto".to_owned()))?;
                writes.extend(sync0.cmp7(start(word)));
            }
            for &write in &writes {
                registers.take(write);
            }
            same("writes", &step.writes, &listed(writes))?;
            same("flags", &step.flags.iter().map(String::as_str).collect(), &names(sync0.flags()))?;
            registers.check(step.cmp1, step.cmp6, step.start, step.cmp1_en, step.cmp6_en)?;
        }
        Ok(())
    })
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct FigureRow {
    #[serde(rename = "origin")]
    _origin: Origin,
    pto_in_cycle: Vec<u16>,
    cmp7_ns: u16,
    handler_latency_ns: u16,
    trace: Vec<Traced>,
    pulses_ns: Vec<(u64, u64)>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Traced {
    t_ns: u64,
    cycle: u64,
    ev: Vec<Event>,
    pto: Option<u16>,
    writes: Vec<(RegisterName, u16)>,
    flags: Vec<String>,
    cmp1: u16,
    cmp6: u16,
    start: u16,
    cmp1_en: u8,
    cmp6_en: u8,
}

pub(super) fn figures(rows: &[Row]) -> Vec<Verdict> {
    each(rows, |row: FigureRow| {
        let axis = Channel::new(Variant::Published, row.cmp7_ns, row.handler_latency_ns);
        let mut trace = row.trace.iter();
        let pulses = run(axis, &row.pto_in_cycle, |axis, word, happening| match happening {
            Activity::Edge(_) => Ok(()),
            Activity::Served(served) => {
                let Some(traced) = trace.next() else {
                    return Err(Fault::Unreadable("the trace is too short".to_owned()));
                };
                same("t_ns", &traced.t_ns, &served.ns)?;
                same("cycle", &traced.cycle, &(served.ns / 4000))?;
                let events = Events {
                    cmp6: traced.ev.contains(&Event::Cmp6),
                    cmp0: traced.ev.contains(&Event::Cmp0),
                    cmp7: traced.ev.contains(&Event::Cmp7),
                };
                same("ev", &events, &served.events)?;
                same("pto", &traced.pto, &events.cmp7.then_some(word))?;
                let writes = served.writes.into_iter().flatten().flat_map(Writes::into_iter);
                same("writes", &traced.writes, &listed(writes))?;
                same("flags", &traced.flags.iter().map(String::as_str).collect(), &names(axis.sync0().flags()))?;
                let registers = Registers {
                    cmp1: axis.register(Register::Cmp1),
                    cmp6: axis.register(Register::Cmp6),
                    start: axis.register(Register::SyncStart),
                    cfg: axis.register(Register::CmpCfg),
                };
                registers.check(traced.cmp1, traced.cmp6, traced.start, traced.cmp1_en, traced.cmp6_en)
            }
        })?;
        same("trace", &0, &trace.count())?;
        same("pulses_ns", &row.pulses_ns, &pulses)
    })
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct LoopRow {
    #[serde(rename = "origin")]
    _origin: Origin,
    variant: VariantName,
    pto_in_cycle: Vec<u16>,
    cmp7_ns: u16,
    handler_latency_ns: u16,
    requested_ns: Option<Vec<u64>>,
    pulses_ns: Vec<(u64, u64)>,
}

pub(super) fn closed_loop(rows: &[Row]) -> Vec<Verdict> {
    each(rows, |row: LoopRow| {
        let axis = Channel::new(row.variant.into(), row.cmp7_ns, row.handler_latency_ns);
        let pulses = run(axis, &row.pto_in_cycle, |_, _, _| Ok(()))?;
        same("pulses_ns", &row.pulses_ns, &pulses)?;
        let Some(requested) = row.requested_ns else { return Ok(()) };
        let words = (1..).zip(&row.pto_in_cycle);
        let asked: Vec<_> = words.filter_map(|(n, &w)| start(w).map(|s| n * 4000 + u64::from(s.ns()))).collect();
        same("requested_ns", &requested, &asked)?;
        same("as many pulses as requested", &requested.len(), &pulses.len())?;
        let good = |(want, (rise, fall)): (&u64, &(u64, u64))| {
            want.abs_diff(*rise) <= 10 && fall - rise == u64::from(PULSE_NS)
        };
        same("width, time", &true, &requested.iter().zip(&pulses).all(good))
    })
}

/// Runs the words and three more cycles, and gives the pulses.
fn run(
    mut axis: Channel,
    words: &[u16],
    mut watch: impl FnMut(&Channel, u16, Activity) -> Verdict,
) -> Result<Vec<(u64, u64)>, Fault> {
    let mut pulses = Vec::new();
    let mut up = None;
    for (end, &word) in (1..).map(|n| n * 4000).zip(words.iter().chain(&[0; 3])) {
        axis.set_start(start(word));
        while let Some(happening) = axis.next(end) {
            watch(&axis, word, happening)?;
            match happening {
                Activity::Edge(Edge { ns, high: true }) => up = Some(ns),
                Activity::Edge(Edge { ns, high: false }) => pulses.extend(up.take().map(|rise| (rise, ns))),
                Activity::Served(_) => {}
            }
        }
    }
    Ok(pulses)
}
