//! The ten toolpaths, in steps.

use crate::ten::{AHEAD, AXES, DEVIATION, N, on_steps, toolpaths};

/// The axes as `[steps/m, steps/s, steps/s², steps/s³]`, and the lines of each path with their feeds in um/s.
pub(super) fn tables() -> String {
    let axes = AXES.map(|[per_mm, rest @ ..]| {
        let [v, a, j] = rest.map(|limit| (limit * per_mm) as u32);
        [(per_mm * 1000.0) as u32, v, a, j]
    });
    let paths: String = toolpaths().iter().map(|path| format!("&{:?},\n", lines(&path.lines))).collect();
    let deviation = (DEVIATION * 1000.0) as u32;
    format!(
        "pub(crate) const AHEAD: usize = {AHEAD};\npub(crate) const DEVIATION: u32 = {deviation};\n\
         pub(crate) static AXES: [[u32; 4]; {N}] = {axes:?};\n\
         pub(crate) static TOOLPATHS: &[&[([i32; {N}], u32)]] = &[\n{paths}];\n"
    )
}

fn lines(lines: &[([f64; N], f64)]) -> Vec<([i64; N], u32)> {
    lines.iter().map(|(to, feed)| (on_steps(*to), (feed * 1000.0) as u32)).collect()
}
