//! What a part program says, as straight lines.

use gcode::{Block, Code, Value};
use step_motion::{Arc, Turning};

use super::AXES;
use servowire_decode::fault::{At, Fault};

/// A straight line of a part program.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Line {
    /// Where it ends, in mm.
    pub(super) to: [f64; AXES],
    /// In um/s; `None` for as fast as the machine can.
    pub(super) feed: Option<u32>,
}

/// Farther than this from 0 no axis goes, in mm.
const FAR: f64 = 50_000.0;

/// Chords of arcs are computed in 0.1 um, and are off by this many at most.
const CHORD: u32 = 20;

/// What stays as it is until a line says something else.
struct State<'t> {
    text: &'t str,
    at: [f64; AXES],
    /// Mode of motion, 0 to 3.
    motion: Option<u32>,
    /// In mm/min.
    feed: Option<f64>,
    /// Millimetres in a unit.
    unit: f64,
    relative: bool,
    lines: Vec<Line>,
}

/// The numbers of a line.
#[derive(Default)]
struct Words {
    axes: [Option<f64>; AXES],
    center: [Option<f64>; 2],
    feed: Option<f64>,
}

/// All lines of the program, or what is wrong with it.
pub(super) fn read(file: &str, text: &str) -> Result<Vec<Line>, Fault> {
    let fault = |line: usize, what: String| Fault::new(file, At::Line(line as u64 + 1), what);
    let program = gcode::parse(text).map_err(|diagnostics| {
        let first = diagnostics.iter().next();
        let (line, what) = first.map_or((0, String::new()), |d| (d.span.line, d.kind.to_string()));
        fault(line, format!("this is no G-code ({what}); comments are in parentheses or begin with ;, and values are numbers, not variables"))
    })?;
    let (at, lines) = ([0.0; AXES], Vec::new());
    let mut state = State { text, at, motion: None, feed: None, unit: 1.0, relative: false, lines };
    for block in &program.blocks {
        let line = block.span.line;
        if state.block(block).map_err(|what| fault(line, what))? {
            break;
        }
    }
    if state.lines.is_empty() {
        return Err(Fault::new(file, At::File, "no motion in it: a line with G0 or G1 and X, Y or Z begins one"));
    }
    Ok(state.lines)
}

impl State<'_> {
    /// Does what a line says; `true` at the end of the program.
    fn block(&mut self, block: &Block) -> Result<bool, String> {
        let mut words = Words::default();
        let mut over = false;
        for word in &block.word_addresses {
            self.word(&mut words, word.letter, &word.value, word.span.start..word.span.end())?;
        }
        for code in &block.codes {
            let args = match code {
                Code::General(g) => {
                    self.general(&g.number.to_string())?;
                    &g.args
                }
                Code::Miscellaneous(m) => {
                    match m.number.major() {
                        2 | 30 => over = true,
                        // Spindle and coolant move no axis.
                        3..=5 | 7..=9 => {}
                        other => {
                            return Err(format!(
                                "M{other} is not in the subset: M2, M30, and M3 to M9 without M6 (which are passed over)"
                            ));
                        }
                    }
                    &m.args
                }
                // A tool moves no axis.
                _ => continue,
            };
            for word in args {
                self.word(&mut words, word.letter, &word.value, word.span.start..word.span.end())?;
            }
        }
        if let Some(feed) = words.feed {
            let feed = feed * self.unit;
            if !(0.06..=60_000_000.0).contains(&feed) {
                return Err(format!("a feed of {feed} mm/min: from 0.06 to 60000000"));
            }
            self.feed = Some(feed);
        }
        if words.axes.iter().any(Option::is_some) || words.center.iter().any(Option::is_some) {
            self.go(&words)?;
        }
        Ok(over)
    }

    fn general(&mut self, number: &str) -> Result<(), String> {
        match number {
            "0" | "1" | "2" | "3" => self.motion = number.parse().ok(),
            "17" | "94" | "40" | "49" | "80" | "54" => {}
            "20" => self.unit = 25.4,
            "21" => self.unit = 1.0,
            "90" => self.relative = false,
            "91" => self.relative = true,
            _ => return Err(format!("G{number} is not in the subset: G0 to G3, G17, G20, G21, G90, G91, G94")),
        }
        Ok(())
    }

    /// A number as it is written, for the parser's own has 24 bits.
    fn word(&self, words: &mut Words, letter: char, value: &Value, span: std::ops::Range<usize>) -> Result<(), String> {
        let text = self.text.get(span).unwrap_or_default();
        let number = match value {
            Value::Literal(rough) => {
                let digits = text.trim_start_matches(|c: char| c.is_ascii_alphabetic() || c.is_whitespace()).trim();
                digits.parse().unwrap_or_else(|_| f64::from(*rough))
            }
            _ => return Err(format!("{text}: variables are not in the subset; write the number")),
        };
        let place = match letter.to_ascii_uppercase() {
            'X' => &mut words.axes[0],
            'Y' => &mut words.axes[1],
            'Z' => &mut words.axes[2],
            'I' => &mut words.center[0],
            'J' => &mut words.center[1],
            'F' => &mut words.feed,
            // Spindle and tool move no axis.
            'S' | 'T' | 'H' | 'D' => return Ok(()),
            'R' => return Err("R is not in the subset: give the center of the arc by I and J".to_owned()),
            other => return Err(format!("{other} is not in the subset: X, Y, Z, I, J and F")),
        };
        if place.replace(number).is_some() {
            return Err(format!("{letter} is there twice"));
        }
        Ok(())
    }

    fn go(&mut self, words: &Words) -> Result<(), String> {
        let motion = self.motion.ok_or("no G0 to G3 before it")?;
        let mut to = self.at;
        for (to, word) in to.iter_mut().zip(words.axes) {
            if let Some(word) = word {
                *to = word * self.unit + if self.relative { *to } else { 0.0 };
            }
            if to.abs() > FAR {
                return Err(format!("{to} mm is farther than {FAR} mm from 0"));
            }
        }
        let feed = match (motion, self.feed) {
            (0, _) => None,
            (_, Some(feed)) => Some((feed * 1000.0 / 60.0).round() as u32),
            _ => return Err("no feed yet: add F, in mm/min".to_owned()),
        };
        if motion < 2 {
            if words.center.iter().any(Option::is_some) {
                return Err("I and J belong to G2 and G3".to_owned());
            }
            self.lines.push(Line { to, feed });
        } else {
            let turning = if motion == 2 { Turning::Clockwise } else { Turning::Counterclockwise };
            self.arc(to, words, turning, feed)?;
        }
        self.at = to;
        Ok(())
    }

    /// Chords; Z goes with them.
    fn arc(&mut self, to: [f64; AXES], words: &Words, turning: Turning, feed: Option<u32>) -> Result<(), String> {
        if words.center.iter().all(Option::is_none) {
            return Err("an arc needs its center: I and J, from where it begins".to_owned());
        }
        let from = self.at;
        let [i, j] = words.center.map(|away| away.unwrap_or(0.0) * self.unit);
        let center = [from[0] + i, from[1] + j];
        let units = |[x, y]: [f64; 2]| [(x * 1e4).round() as i32, (y * 1e4).round() as i32];
        let arc = Arc::new(units([from[0], from[1]]), units([to[0], to[1]]), units(center), turning, CHORD);
        let chords: Vec<_> = arc
            .map_err(|e| {
                format!("{e}, in 0.1 um: start and end are not on one circle around I and J, or the circle is not one")
            })?
            .collect();
        // Z rises with the angle, for chords differ in that.
        let mut before = [from[0], from[1]];
        let angles = chords.iter().map(|chord| {
            let here = chord.map(|part| f64::from(part) / 1e4);
            angle(std::mem::replace(&mut before, here), here, center)
        });
        let angles: Vec<f64> = angles.collect();
        let whole: f64 = angles.iter().sum();
        let mut swept = 0.0;
        for (k, ([x, y], angle)) in chords.iter().zip(&angles).enumerate() {
            swept += angle;
            let part = swept / whole;
            let point = [f64::from(*x) / 1e4, f64::from(*y) / 1e4, from[2] + (to[2] - from[2]) * part];
            self.lines.push(Line { to: if k + 1 == chords.len() { to } else { point }, feed });
        }
        Ok(())
    }
}

/// The angle between two places, seen from a center.
fn angle(from: [f64; 2], to: [f64; 2], center: [f64; 2]) -> f64 {
    let [[x0, y0], [x1, y1]] = [from, to].map(|[x, y]| [x - center[0], y - center[1]]);
    (x0 * y1 - y0 * x1).atan2(x0 * x1 + y0 * y1).abs()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ends(text: &str) -> Vec<[f64; AXES]> {
        read("part.nc", text).unwrap().iter().map(|line| line.to).collect()
    }

    fn refused(text: &str) -> String {
        read("part.nc", text).unwrap_err().to_string()
    }

    #[test]
    fn straight_lines_in_all_modes() {
        let text = "%\nN10 G21 G90 (absolute)\nG0 X10 Y-5.5\nG1 Z-1 F60 ; down\nX20\nG91 X1 Y1\nG20 G1 X1\nM30\nX9";
        assert_eq!(
            ends(text.trim_start_matches("%\n")),
            [[10.0, -5.5, 0.0], [10.0, -5.5, -1.0], [20.0, -5.5, -1.0], [21.0, -4.5, -1.0], [46.4, -4.5, -1.0]]
        );
        let lines = read("part.nc", "G0 X1\nG1 X2 F60\nG1 X123456.789e-3 F6000").unwrap_or_default();
        assert!(lines.is_empty() || lines[1].feed == Some(1000));
        assert_eq!(read("part.nc", "G0 X1234.56789").unwrap()[0], Line { to: [1234.56789, 0.0, 0.0], feed: None });
    }

    #[test]
    fn arcs_end_where_they_say() {
        let half = ends("G0 X10\nG3 X-10 I-10 J0 F600");
        assert!(half.len() > 30 && half.last() == Some(&[-10.0, 0.0, 0.0]));
        assert!(half[1..].iter().all(|[x, y, _]| (x.hypot(*y) - 10.0).abs() < 1e-3 && *y >= 0.0));
        let turn = ends("G0 X10\nG2 I-10 Z-2 F600");
        let low = turn.iter().map(|p| p[1]).fold(0.0, f64::min);
        assert!((low + 10.0).abs() < 1e-3 && turn.last() == Some(&[10.0, 0.0, -2.0]));
    }

    /// However the arc is cut into chords, Z is where its angle has it.
    #[test]
    fn a_helix_rises_with_the_angle() {
        for (text, whole) in [
            ("G0 X10\nG3 X-9.396926 Y-3.420201 Z-10 I-10 J0 F600", 200.0_f64),
            ("G0 X10\nG3 X9.998477 Y-0.174524 Z-10 I-10 J0 F600", 359.0),
            ("G0 X10\nG3 X9.238795 Y3.826834 Z-10 I-10 J0 F600", 22.5),
        ] {
            for [x, y, z] in &ends(text)[1..] {
                let angle = y.atan2(*x).to_degrees().rem_euclid(360.0);
                assert!((z + 10.0 * angle / whole).abs() < 2e-3, "{z} at {angle} of {whole}");
            }
        }
    }

    #[test]
    fn refusals_name_the_line_and_what_to_do() {
        for (text, want) in [
            ("G0 X1\nG1 X2", "part.nc, line 2: no feed yet: add F"),
            ("G0 X1\n\nG33 X2", "part.nc, line 3: G33 is not in the subset"),
            ("G2 X1 R5 F10", "give the center of the arc by I and J"),
            ("G2 X1 Y1 F10", "line 1: an arc needs its center"),
            ("G0 X10\nG2 X-5 I-10 F10", "line 2: an arc from a radius of"),
            ("X5", "line 1: no G0 to G3 before it"),
            ("G0 X5 X6", "X is there twice"),
            ("G0 X60000", "farther than 50000 mm"),
            ("G1 X5 F0", "a feed of 0 mm/min"),
            ("G0 X5 E2", "E is not in the subset"),
            ("M6", "M6 is not in the subset"),
            ("G90", "no motion in it"),
            ("", "part.nc: no motion in it"),
            ("G0 X#1", "values are numbers, not variables"),
            ("hello world", "line 1"),
        ] {
            assert!(refused(text).contains(want), "{text}: {}", refused(text));
        }
    }
}
