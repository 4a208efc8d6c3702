//! Shows cycle time against devices, cable and payload, as a table and as a picture.

use std::io::{self, Write};

use sorte_proto::timing::{Limit, Timing};

use crate::drawing::{Chart, Drawn, Sheet, Stroke};

/// Device counts of the table.
const DEVICES: [u8; 14] = [1, 2, 3, 4, 5, 8, 10, 16, 32, 64, 100, 128, 200, 254];
/// Cable between neighbouring devices in ns, at about 5 ns per metre; and bytes of process data to and from each device.
const LINES: [(u16, u16, u16); 5] = [(10, 4, 3), (85, 4, 3), (500, 4, 3), (85, 8, 8), (85, 32, 32)];

fn cycle_ns(devices: u8, (cable, output, input): (u16, u16, u16)) -> (u32, Limit, u32) {
    let output_len = (u16::from(devices) * output).max(16);
    let cables = [cable];
    let line = Timing::new(&cables, devices).with_output_len(output_len).with_payload_len(input);
    let budget = line.budget();
    (budget.min_cycle_ns(), budget.limit(), line.cnc_cycle_ns())
}

/// The table.
pub(super) fn table(out: &mut dyn Write) -> io::Result<()> {
    writeln!(out, "shortest cycle in us; < limited by the master frame's way out, > by the device frames' way back")?;
    writeln!(out, "in brackets: whole periods of the step pulse generator, which is the cycle of a CNC line")?;
    write!(out, "{:8}", "devices")?;
    for (cable, output, input) in LINES {
        write!(out, "{:>22}", format!("{cable} ns, {output}/{input} bytes"))?;
    }
    writeln!(out)?;
    for devices in DEVICES {
        write!(out, "{devices:7} ")?;
        for line in LINES {
            let (min, limit, cnc) = cycle_ns(devices, line);
            let mark = if limit == Limit::MasterFrame { '<' } else { '>' };
            write!(out, "{:>22}", format!("{mark} {:.2} ({})", f64::from(min) / 1e3, cnc / 1000))?;
        }
        writeln!(out)?;
    }
    write!(out, "jitter: what each port may add to a frame, in ns rms, before two frames meet:")?;
    for devices in [4, 7, 16, 64, 254] {
        let (mut good, mut bad) = (0, 1_000_000);
        while good + 1 < bad {
            let jitter = u32::midpoint(good, bad);
            let fits = Timing::new(&[85], devices).with_jitter_ps(jitter).misfit(u32::MAX).is_none();
            *(if fits { &mut good } else { &mut bad }) = jitter;
        }
        write!(out, " {:.1} for {devices} devices{}", f64::from(good) / 1e3, if devices == 254 { "\n" } else { "," })?;
    }
    writeln!(out, "a port that samples at 200 MHz adds 1.4, one that re-times to the 25 MHz of its PHY 11.5")?;
    Ok(())
}

/// The picture.
pub(super) fn draw() -> Drawn<String> {
    let mut sheet = Sheet::new("SORTE: shortest cycle against devices", 900);
    let mut chart = Chart::new("cycle in us", "devices", 0.0..254.0);
    for (k, line) in LINES.into_iter().enumerate() {
        let points = (1..=254).map(|devices| (f64::from(devices), f64::from(cycle_ns(devices, line).0) / 1e3));
        let (cable, output, input) = line;
        chart = chart.with(Stroke::number(k), points.collect());
        sheet.explain(Stroke::number(k), format!("{cable} ns of cable, {output} bytes out, {input} in"));
    }
    sheet.panel(480, chart);
    sheet.svg()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::drawing::geometry::nothing_is_covered;

    #[test]
    fn the_legend_stands_beside_the_curves() {
        nothing_is_covered(&draw().unwrap());
    }
}
