//! Describes in words what the machine has done.

use std::io::{self, Write};

use sorte_proto::Tally;
use sorte_proto::master::State;
use sorte_proto::timing::Limit;

use super::host::Host;
use super::line::Line;
use super::node::Node;

/// Maximum number of axes listed one by one.
const LISTED: usize = 16;

/// Describes the start-up: what was sent, what was found, and whether the cycle is long enough.
pub(super) fn start_up(out: &mut dyn Write, line: &Line) -> io::Result<()> {
    let [discovery, param, delay, sync] = line.sent;
    let ready = line.first_cycle_ns.map_or(0.0, |ns| ns as f64 / 1e6);
    writeln!(
        out,
        "start-up    DISCOVERY {discovery}, PARAM {param}, DELAY_REQ {delay}, SYNC {sync}; first cycle after {ready:.2} ms"
    )?;
    let cables_ns = &line.setup.cables_ns;
    let measured = line.master.line_delay().measured();
    for (k, node) in line.nodes.iter().enumerate().take(LISTED) {
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
            "  device {}  address {}, output bytes {}..{}, cable {cable} ns, measured {measured}, sends at {} ns",
            k + 1,
            place.address,
            place.out_offset,
            place.out_offset + 4,
            node.device.send_time_ns().unwrap_or_default(),
        )?;
    }
    if line.nodes.len() > LISTED {
        writeln!(out, "  and {} more", line.nodes.len() - LISTED)?;
    }
    let budget = line.setup.timing().budget();
    let limit = match budget.limit() {
        Limit::MasterFrame => "the master frame's way out",
        _ => "the device frames' way back",
    };
    writeln!(
        out,
        "timing      master frame {} bytes, at the last device after {} ns; last device frame at the master after {} ns",
        budget.master_frame_bytes, budget.master_frame_at_last_ns, budget.device_frames_at_master_ns
    )?;
    let cycle_ns = line.setup.cycle_ns();
    let fits = line.setup.timing().misfit(cycle_ns).map_or("fits", |_| "does not fit");
    writeln!(out, "            shortest cycle {} ns, limited by {limit}: {fits} {cycle_ns} ns", budget.min_cycle_ns())?;
    if line.setup.is_long() {
        writeln!(out, "            the line is longer than the delay field of SYNC: with this project's extension")?;
    }
    Ok(())
}

/// Describes the run: steps, clocks, errors.
pub(super) fn end(out: &mut dyn Write, line: &Line, host: &Host) -> io::Result<()> {
    let counters = line.master.counters();
    let seconds = counters.cycles as f64 * f64::from(line.setup.cycle_ns()) * 1e-9;
    writeln!(out, "exchange    {} cycles, {seconds:.3} s of machine time", counters.cycles)?;
    axes(out, line)?;
    errors(out, line)?;
    if host.program.off > 0 {
        writeln!(out, "drivers     {} words of axes at rest switched their drivers off", host.program.off)?;
    }
    for event in &line.events {
        writeln!(out, "event       {event}")?;
    }
    let more = line.event_count - line.events.len() as u64;
    if more > 0 {
        writeln!(out, "event       and {more} more")?;
    }
    Ok(())
}

/// Writes one line per axis: for the first ones, those with a fault, and the last one.
fn axes(out: &mut dyn Write, line: &Line) -> io::Result<()> {
    writeln!(
        out,
        "  axis       asked        made     on time      late      lost  caught up    position  clock error  pulse error"
    )?;
    for (k, node) in line.nodes.iter().enumerate() {
        let t = node.axis.tally;
        let troubled = t.late > 0 || t.lost > 0 || node.axis.position != node.asked.asked();
        if k >= LISTED && !troubled && k + 1 < line.nodes.len() {
            continue;
        }
        writeln!(
            out,
            "  {:4}  {:10}  {:10}  {:10}  {:8}  {:8}  {:9}  {:10}  {:8.0} ns  {:8.0} ns",
            k + 1,
            t.asked,
            t.on_time + t.late + t.extra,
            t.on_time,
            t.late,
            t.lost,
            t.caught_up,
            node.axis.position,
            node.clock_error_ns,
            t.worst_ns,
        )?;
    }
    let ordered = sum(line, |n| n.axis.tally.ordered);
    let bad = sum(line, |n| n.axis.tally.late + n.axis.tally.lost);
    if bad > 0 {
        writeln!(
            out,
            "            {:.2} % of the steps were late or lost",
            100.0 * bad as f64 / ordered.max(1) as f64
        )?;
    }
    Ok(())
}

/// Describes what the line did to the frames.
fn errors(out: &mut dyn Write, line: &Line) -> io::Result<()> {
    let counters = line.master.counters();
    writeln!(
        out,
        "errors      {} bits flipped; devices refused {} frames, the master {}; {} cycles with a frame missing",
        line.wires.noise.flips,
        sum(line, |n| n.device.counters().crc_errors),
        counters.crc_errors,
        counters.timing_errors
    )?;
    let at_devices = tally(line.nodes.iter().map(|node| node.device.counters().master));
    writeln!(
        out,
        "            master frames at the devices: {at_devices}; device frames at the master: {}",
        counters.frames
    )?;
    if line.gap_ns.is_finite() {
        writeln!(
            out,
            "            {} frames met another one; smallest gap between two device frames {:.0} ns",
            line.wires.collisions, line.gap_ns
        )?;
    }
    let (stamps, undetected) = (sum(line, |n| n.bad_stamps), sum(line, |n| n.undetected));
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
    Ok(())
}

/// Returns the tallies of all devices together.
fn tally(of: impl Iterator<Item = Tally>) -> Tally {
    of.fold(Tally::default(), |mut all, one| {
        all.missed += one.missed;
        all.doubled += one.doubled;
        all.late += one.late;
        all.stale += one.stale;
        all
    })
}

fn sum(line: &Line, of: fn(&Node) -> u64) -> u64 {
    line.nodes.iter().map(of).sum()
}

/// Returns the faults, the most serious first; `None` if every step was made on time.
pub(super) fn verdict(line: &Line, host: &Host) -> Option<String> {
    if line.master.state() == State::Error || line.first_cycle_ns.is_none() {
        let last = line.why.as_deref().unwrap_or("no device answers");
        return Some(format!("the machine did not run: {last}"));
    }
    if let Some(why) = &line.unmeasured {
        return Some(format!("not all devices take part: {why}"));
    }
    if let Some(why) = &host.ended {
        return Some(format!("the motion was stopped: {why}"));
    }
    if let Some(fault) = host.program.fault() {
        return Some(fault.to_string());
    }
    if !host.is_done() {
        let last = line.why.as_deref().unwrap_or("the master waits for ever");
        return Some(format!("the motion was not finished: {last}"));
    }
    if let Some(what) = line.still_to_come() {
        return Some(format!("the motion was over before {what}"));
    }
    if line.nodes.iter().all(|node| node.axis.tally.asked == 0) {
        return Some("no axis was asked to move".to_owned());
    }
    for (k, node) in line.nodes.iter().enumerate() {
        let (axis, t, asked) = (k + 1, node.axis.tally, node.asked.asked());
        if t.asked > 0 && t.moved == 0 {
            return Some(format!(
                "axis {axis} never moved: {} steps were asked, {} pulses made",
                t.asked,
                t.on_time + t.late
            ));
        }
        if node.axis.position != asked {
            return Some(format!("axis {axis} was asked to {asked} and is at {}", node.axis.position));
        }
        if t.late + t.lost + t.extra > 0 {
            return Some(format!(
                "axis {axis}: {} steps late, {} lost, {} made twice, {:.0} ns off at worst",
                t.late, t.lost, t.extra, t.worst_ns
            ));
        }
        if t.dir_faults > 0 {
            return Some(format!("axis {axis}: DIR changed within 200 ns of a step {} times", t.dir_faults));
        }
        if t.step_faults > 0 {
            return Some(format!("axis {axis}: {} pulses too short or too close for the driver", t.step_faults));
        }
        if t.wake_faults > 0 {
            return Some(format!("axis {axis}: {} steps before its driver was awake", t.wake_faults));
        }
        if node.axis.under_way() > 0 {
            return Some(format!("axis {axis}: {} steps are still to come", node.axis.under_way()));
        }
    }
    let (collisions, frames) = (line.wires.collisions, line.master.counters().frames);
    if collisions > 0 || frames.late + frames.stale > 0 && line.setup.physics.duplicates == 0.0 {
        return Some(format!("{collisions} frames met another one; device frames at the master: {frames}"));
    }
    None
}
