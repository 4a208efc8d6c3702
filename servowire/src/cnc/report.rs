//! What the machine has done, in words.

use std::io::{self, Write};

use sorte_proto::timing::{CNC_CYCLE_NS, Limit, Timing};

use super::line::Line;

/// The start-up: what was sent, what was found, and whether a cycle of 4 us is long enough.
pub(super) fn start_up(out: &mut dyn Write, line: &Line, cables_ns: &[u16]) -> io::Result<()> {
    let [discovery, param, delay, sync] = line.sent;
    let ready = line.first_cycle_ns.map_or(0.0, |ns| ns as f64 / 1e6);
    writeln!(
        out,
        "start-up    DISCOVERY {discovery}, PARAM {param}, DELAY_REQ {delay}, SYNC {sync}; first cycle after {ready:.2} ms"
    )?;
    let measured = line.master.line_delay().checked();
    for (k, node) in line.nodes.iter().enumerate() {
        let Some(place) = node.device.assignment() else {
            writeln!(out, "  device {}  not found", k + 1)?;
            continue;
        };
        let cable = cables_ns.get(k).copied().unwrap_or_default();
        let before = match k.checked_sub(1).and_then(|before| line.nodes.get(before)) {
            None => measured,
            Some(before) => before.device.line_delay_next_ns(),
        };
        let measured = before.map_or_else(|error| error.to_string(), |ns| format!("{ns} ns"));
        writeln!(
            out,
            "  device {}  address {}, output bytes {}..{}, cable {cable} ns, measured {measured}",
            k + 1,
            place.address.get(),
            place.out_offset,
            place.out_offset + 4,
        )?;
    }
    let devices = line.master.network().devices();
    let timing = Timing { line_delays_ns: cables_ns, devices, output_len: line.master.output_len(), payload_len: 3 };
    let budget = timing.budget();
    let limit = match budget.limit() {
        Limit::MasterFrame => "the master frame's way out",
        Limit::DeviceFrames => "the device frames' way back",
    };
    writeln!(
        out,
        "timing      master frame {} bytes, at the last device after {} ns; last device frame at the master after {} ns",
        budget.master_frame_bytes, budget.master_frame_at_last_ns, budget.device_frames_at_master_ns
    )?;
    let fits = if budget.fits(CNC_CYCLE_NS) { "fits" } else { "does not fit" };
    writeln!(
        out,
        "            shortest cycle {} ns, limited by {limit}: {fits} {CNC_CYCLE_NS} ns",
        budget.min_cycle_ns()
    )
}

/// The run: steps, clocks, errors.
pub(super) fn end(out: &mut dyn Write, line: &Line) -> io::Result<()> {
    let counters = line.master.counters();
    writeln!(out, "exchange    {} cycles, {:.3} s of machine time", counters.cycles, counters.cycles as f64 * 4e-6)?;
    writeln!(out, "  axis       asked     carried     on time      late      lost    position  clock error")?;
    for (k, node) in line.nodes.iter().enumerate() {
        let t = node.axis.tally;
        writeln!(
            out,
            "  {:4}  {:10}  {:10}  {:10}  {:8}  {:8}  {:10}  {:8.0} ns",
            k + 1,
            t.asked,
            t.carried,
            t.on_time,
            t.late,
            t.lost,
            node.axis.position,
            node.clock_error_ns
        )?;
    }
    let (asked, bad) = line.nodes.iter().fold((0, 0), |(asked, bad), node| {
        (asked + node.axis.tally.carried, bad + node.axis.tally.late + node.axis.tally.lost)
    });
    if bad > 0 {
        writeln!(
            out,
            "            {:.2} % of the steps carried were late or lost",
            100.0 * bad as f64 / asked.max(1) as f64
        )?;
    }
    let refused: u64 = line.nodes.iter().map(|node| node.device.counters().crc_errors).sum();
    let stamps: u64 = line.nodes.iter().map(|node| node.bad_stamps).sum();
    let undetected: u64 = line.nodes.iter().map(|node| node.undetected).sum();
    writeln!(
        out,
        "errors      {} bits flipped; devices refused {refused} frames, the master {}; {} cycles with a frame missing",
        line.noise.flips, counters.crc_errors, counters.timing_errors
    )?;
    if stamps > 0 {
        writeln!(
            out,
            "            {stamps} accepted with a wrong time stamp: no check covers it, and no data depend on it"
        )?;
    }
    if undetected > 0 {
        writeln!(
            out,
            "            {undetected} accepted with wrong data: a CRC-8 lets 1 of 256 random errors pass, and 25 of the 11476 double flips"
        )?;
    }
    for event in &line.events {
        writeln!(out, "event       {event}")?;
    }
    Ok(())
}
