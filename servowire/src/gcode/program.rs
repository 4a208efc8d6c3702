//! What a part program says, as straight lines and rests, a line of it after the other.

use std::collections::VecDeque;
use std::io::BufRead;

use servowire_decode::fault::{At, Fault};
use step_motion::{Arc, Turning};

use super::AXES;
use super::words::{Word, words};

/// A straight line of a part program.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Line {
    /// Where it ends, in mm.
    pub(super) to: [f64; AXES],
    /// In um/s; `None` for as fast as the machine can.
    pub(super) feed: Option<u32>,
}

/// What a machine is to do next.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Item {
    Line(Line),
    /// Come to rest, for this many ns.
    Rest(u64),
    /// From here on corners may be rounded by this many um; `None`: by the machine's setting.
    Deviation(Option<u32>),
}

/// Farther than this from 0 no axis goes, in mm.
const FAR: f64 = 50_000.0;

/// Chords of arcs are computed in 0.1 um, and are off by this many at most.
const CHORD: u32 = 20;

const NAMES: [char; AXES] = ['X', 'Y', 'Z'];

/// A part program that is read line by line.
pub(super) struct Program<R> {
    name: String,
    text: R,
    number: u64,
    /// Lines that begin with a slash are left out.
    block_delete: bool,
    over: bool,
    state: State,
    items: VecDeque<Item>,
}

impl<R: BufRead> Program<R> {
    pub(super) fn new(name: &str, text: R, block_delete: bool) -> Self {
        let (state, items) = (State::default(), VecDeque::new());
        Self { name: name.to_owned(), text, number: 0, block_delete, over: false, state, items }
    }

    /// What has been read and not been taken.
    #[cfg(test)]
    pub(super) fn waiting(&self) -> usize {
        self.items.len()
    }

    fn line(&mut self) -> Result<(), Fault> {
        let mut line = Vec::new();
        let fault = |number, what| Fault::new(&self.name, number, what);
        let got = self.text.read_until(b'\n', &mut line).map_err(|e| fault(At::File, e.to_string()))?;
        self.number += 1;
        let line = String::from_utf8_lossy(&line);
        let done = words(&line).and_then(|words| {
            if words.optional && self.block_delete {
                return Ok(false);
            }
            self.state.block(&words.words, &mut self.items)
        });
        self.over = done.map_err(|what| fault(At::Line(self.number), what))? || got == 0;
        Ok(())
    }
}

impl<R: BufRead> Iterator for Program<R> {
    type Item = Result<Item, Fault>;

    fn next(&mut self) -> Option<Self::Item> {
        while self.items.is_empty() && !self.over {
            if let Err(fault) = self.line() {
                self.over = true;
                return Some(Err(fault));
            }
        }
        self.items.pop_front().map(Ok)
    }
}

/// What a line with X, Y or Z means.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Motion {
    /// Nothing has been said yet.
    None,
    Straight {
        rapid: bool,
    },
    Arc(Turning),
    /// After G80.
    Cancelled,
}

/// What a word without mode does, in its line alone.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Once {
    Dwell,
    /// To a reference, or keep it: which.
    Reference(usize),
    Keep(usize),
    Machine,
    Shift,
    Unshift,
}

/// What stays as it is until a line says something else.
struct State {
    /// In mm, of the machine.
    at: [f64; AXES],
    /// What G92 has added to what the program says.
    shift: [f64; AXES],
    /// Of G28 and G30.
    references: [[f64; AXES]; 2],
    motion: Motion,
    /// The axes of the plane of arcs, and the one along which they are seen.
    plane: [usize; AXES],
    /// In mm/min.
    feed: Option<f64>,
    /// Millimetres in a unit.
    unit: f64,
    relative: bool,
    /// G61.1: rest behind each line.
    stops: bool,
}

impl Default for State {
    fn default() -> Self {
        Self {
            at: [0.0; AXES],
            shift: [0.0; AXES],
            references: [[0.0; AXES]; 2],
            motion: Motion::None,
            plane: [0, 1, 2],
            feed: None,
            unit: 1.0,
            relative: false,
            stops: false,
        }
    }
}

/// The numbers of a line.
#[derive(Default)]
struct Numbers {
    axes: [Option<f64>; AXES],
    center: [Option<f64>; AXES],
    radius: Option<f64>,
    feed: Option<f64>,
    p: Option<f64>,
}

/// The group of G80, which posts write beside G0.
const CYCLES: usize = 9;

const SUBSET: &str = "G0 to G4, G17 to G21, G28, G30, G40, G43, G49, G53 to G59, G61, G64, G80, G90 to G92, G94";

impl State {
    /// Does what a line says; `true` at the end of the program.
    fn block(&mut self, words: &[Word], items: &mut VecDeque<Item>) -> Result<bool, String> {
        let mut numbers = Numbers::default();
        let (mut once, mut over, mut pause, mut smooth) = (None, false, false, false);
        let mut groups: [Option<f64>; 14] = [None; 14];
        for word in words {
            match word.letter {
                'G' => {
                    let (group, what) = self.general(word.value, items)?;
                    let place = groups.get_mut(group).ok_or("no such group")?;
                    if let Some(other) = place.replace(word.value) {
                        return Err(format!("G{other} and G{} in one line: only one of them can apply", word.value));
                    }
                    smooth |= tenths(word.value) == 640;
                    once = what.or(once);
                }
                'M' => match tenths(word.value) {
                    20 | 300 => over = true,
                    0 | 10 | 60 | 600 => pause = true,
                    // Spindle, coolant and overrides move no axis.
                    30 | 40 | 50 | 70 | 80 | 90 | 480 | 490 => {}
                    _ => {
                        let number = word.value;
                        return Err(format!("M{number} is not in the subset: M0 to M9, M30, M48, M49, M60"));
                    }
                },
                _ => numbers.add(*word)?,
            }
        }
        if groups[1].is_none() && groups[CYCLES].is_some() {
            self.motion = Motion::Cancelled;
        }
        if let Some(feed) = numbers.feed {
            let feed = feed * self.unit;
            if !(0.06..=60_000_000.0).contains(&feed) {
                return Err(format!("F: a feed of {feed} mm/min: from 0.06 to 60000000"));
            }
            self.feed = Some(feed);
        }
        if smooth {
            let most = numbers.p.map(|p| (p * self.unit * 1000.0).round() as u32);
            items.push_back(Item::Deviation(most));
        } else if numbers.p.is_some() && once != Some(Once::Dwell) {
            return Err("P belongs to G4 and G64".to_owned());
        }
        self.act(once, &numbers, items)?;
        if pause {
            items.push_back(Item::Rest(0));
        }
        Ok(over)
    }

    /// A G word: its group, no two of which go together, and what it does in its line alone.
    fn general(&mut self, number: f64, items: &mut VecDeque<Item>) -> Result<(usize, Option<Once>), String> {
        let arc = |turning| (1, Motion::Arc(turning));
        let tenths = tenths(number);
        let (group, motion) = match tenths {
            0 => (1, Motion::Straight { rapid: true }),
            10 => (1, Motion::Straight { rapid: false }),
            20 => arc(Turning::Clockwise),
            30 => arc(Turning::Counterclockwise),
            _ => (0, self.motion),
        };
        self.motion = motion;
        let once = match tenths {
            40 => Once::Dwell,
            280 => Once::Reference(0),
            300 => Once::Reference(1),
            281 => Once::Keep(0),
            301 => Once::Keep(1),
            530 => Once::Machine,
            920 => Once::Shift,
            921 | 922 => Once::Unshift,
            _ if group == 1 => return Ok((1, None)),
            _ => return self.mode(number, tenths, items).map(|group| (group, None)),
        };
        Ok((0, Some(once)))
    }

    /// A mode other than that of motion: its group.
    fn mode(&mut self, number: f64, tenths: i64, items: &mut VecDeque<Item>) -> Result<usize, String> {
        Ok(match tenths {
            170 | 180 | 190 => {
                self.plane = if tenths == 170 {
                    [0, 1, 2]
                } else if tenths == 180 {
                    [2, 0, 1]
                } else {
                    [1, 2, 0]
                };
                2
            }
            200 | 210 => {
                self.unit = if tenths == 200 { 25.4 } else { 1.0 };
                6
            }
            900 | 910 => {
                self.relative = tenths == 910;
                3
            }
            610 | 611 | 640 => {
                self.stops = tenths == 611;
                if tenths != 640 {
                    items.push_back(Item::Deviation(Some(0)));
                }
                13
            }
            // Centers of arcs from where they begin; feeds by the minute; no radius of a tool; a tool of length 0; offsets of 0.
            911 => 4,
            940 => 5,
            800 => CYCLES,
            400 => 7,
            430 | 490 => 8,
            540 | 550 | 560 | 570 | 580 | 590 | 591 | 592 | 593 => 12,
            _ => return Err(format!("G{number} is not in the subset: {SUBSET}")),
        })
    }

    /// Motion and what stands in its place.
    fn act(&mut self, once: Option<Once>, numbers: &Numbers, items: &mut VecDeque<Item>) -> Result<(), String> {
        let moves = numbers.axes.iter().any(Option::is_some);
        match once {
            Some(Once::Dwell) => {
                let seconds = numbers.p.ok_or("G4 needs P, in seconds")?;
                if moves || !(0.0..=86_400.0).contains(&seconds) {
                    return Err(format!("G4 P{seconds}: a rest of 0 to 86400 s, without X, Y and Z"));
                }
                items.push_back(Item::Rest((seconds * 1e9) as u64));
            }
            Some(Once::Reference(which)) => {
                let home = self.references.get(which).copied().unwrap_or_default();
                let chosen = |axis: Option<f64>| !moves || axis.is_some();
                if moves {
                    let by = self.target(numbers, false)?;
                    self.go(by, None, items);
                }
                let mut to = self.at;
                for ((to, home), axis) in to.iter_mut().zip(home).zip(numbers.axes) {
                    if chosen(axis) {
                        *to = home;
                    }
                }
                self.go(to, None, items);
            }
            Some(Once::Keep(which)) => {
                if let Some(place) = self.references.get_mut(which) {
                    *place = self.at;
                }
            }
            Some(Once::Shift) => {
                if !moves {
                    return Err("G92 needs X, Y or Z: the coordinates that this place has from here on".to_owned());
                }
                for ((shift, at), axis) in self.shift.iter_mut().zip(self.at).zip(numbers.axes) {
                    if let Some(word) = axis {
                        *shift = at - word * self.unit;
                    }
                }
            }
            Some(Once::Unshift) => self.shift = [0.0; AXES],
            None | Some(Once::Machine) => {
                if moves || numbers.center.iter().any(Option::is_some) || numbers.radius.is_some() {
                    return self.run(numbers, once.is_some(), items);
                }
            }
        }
        Ok(())
    }

    /// Where X, Y and Z lead, in mm of the machine.
    fn target(&self, numbers: &Numbers, machine: bool) -> Result<[f64; AXES], String> {
        let mut to = self.at;
        for (((to, word), shift), name) in to.iter_mut().zip(numbers.axes).zip(self.shift).zip(NAMES) {
            if let Some(word) = word {
                let from = match (machine, self.relative) {
                    (true, _) => 0.0,
                    (_, true) => *to,
                    _ => shift,
                };
                *to = word * self.unit + from;
            }
            if to.abs() > FAR {
                return Err(format!("{name}: {to} mm is farther than {FAR} mm from 0"));
            }
        }
        Ok(to)
    }

    fn run(&mut self, numbers: &Numbers, machine: bool, items: &mut VecDeque<Item>) -> Result<(), String> {
        let to = self.target(numbers, machine)?;
        let feed = match (self.motion, self.feed) {
            (Motion::None, _) => return Err("no G0 to G3 before it".to_owned()),
            (Motion::Cancelled, _) => {
                return Err("G80 has cancelled the motion mode: G0 to G3 sets it again".to_owned());
            }
            (Motion::Straight { rapid: true }, _) => None,
            (_, Some(feed)) => Some((feed * 1000.0 / 60.0).round() as u32),
            _ => return Err("no feed yet: add F, in mm/min".to_owned()),
        };
        let Motion::Arc(turning) = self.motion else {
            if numbers.center.iter().any(Option::is_some) || numbers.radius.is_some() {
                return Err("I, J, K and R belong to G2 and G3".to_owned());
            }
            self.go(to, feed, items);
            return Ok(());
        };
        if machine {
            return Err("G53 goes with G0 and G1".to_owned());
        }
        let center = self.center(to, numbers, turning)?;
        self.arc(to, center, turning, feed, items)
    }

    fn go(&mut self, to: [f64; AXES], feed: Option<u32>, items: &mut VecDeque<Item>) {
        items.push_back(Item::Line(Line { to, feed }));
        if self.stops {
            items.push_back(Item::Rest(0));
        }
        self.at = to;
    }

    /// Of the axes of the plane.
    fn flat(&self, place: [f64; AXES]) -> [f64; 2] {
        let [a, b, _] = self.plane;
        [a, b].map(|axis| place.get(axis).copied().unwrap_or_default())
    }

    /// The center of an arc, in the plane.
    fn center(&self, to: [f64; AXES], numbers: &Numbers, turning: Turning) -> Result<[f64; 2], String> {
        let (from, to) = (self.flat(self.at), self.flat(to));
        let [_, _, axis] = self.plane;
        if numbers.center.get(axis).copied().flatten().is_some() {
            return Err("a center of I and J in G17, I and K in G18, J and K in G19".to_owned());
        }
        let Some(radius) = numbers.radius.map(|radius| radius * self.unit) else {
            if numbers.center.iter().all(Option::is_none) {
                return Err("an arc needs its center (I, J, K, from where it begins) or its radius R".to_owned());
            }
            let [i, j] = self.flat(numbers.center.map(|away| away.unwrap_or(0.0) * self.unit));
            return Ok([from[0] + i, from[1] + j]);
        };
        if numbers.center.iter().any(Option::is_some) {
            return Err("R together with I, J or K: an arc takes one or the other".to_owned());
        }
        let [x, y] = [to[0] - from[0], to[1] - from[1]];
        let chord = x.hypot(y);
        if chord < 1e-4 {
            return Err("R: an arc that ends where it begins needs I, J or K".to_owned());
        }
        // From the middle of the chord to the center, to the left for less than half a turn counter-clockwise.
        let square = radius * radius - chord * chord / 4.0;
        if chord / 2.0 > radius.abs() + 2e-3 {
            return Err(format!("R{radius}: two places {chord:.4} mm apart are on no circle of that radius"));
        }
        let left = (turning == Turning::Counterclockwise) == (radius > 0.0);
        let away = square.max(0.0).sqrt() / chord * if left { 1.0 } else { -1.0 };
        Ok([f64::midpoint(from[0], to[0]) - y * away, f64::midpoint(from[1], to[1]) + x * away])
    }

    /// Chords; the third axis goes with the angle, for chords differ in that.
    fn arc(
        &mut self,
        to: [f64; AXES],
        center: [f64; 2],
        turning: Turning,
        feed: Option<u32>,
        items: &mut VecDeque<Item>,
    ) -> Result<(), String> {
        let (from, end) = (self.flat(self.at), self.flat(to));
        let units = |place: [f64; 2]| place.map(|mm| (mm * 1e4).round() as i32);
        let chords: Vec<_> = Arc::new(units(from), units(end), units(center), turning, CHORD)
            .map_err(|e| {
                format!("{e}, in 0.1 um: start and end are not on one circle around the center, or its radius is 0")
            })?
            .map(|chord| chord.map(|part| f64::from(part) / 1e4))
            .collect();
        let mut before = from;
        let angles: Vec<f64> =
            chords.iter().map(|chord| angle(std::mem::replace(&mut before, *chord), *chord, center)).collect();
        let (whole, mut swept) = (angles.iter().sum::<f64>(), 0.0);
        let begin = self.at;
        for (chord, angle) in chords.iter().zip(&angles).take(chords.len().saturating_sub(1)) {
            swept += angle;
            let mut place = begin;
            let [a, b, c] = self.plane;
            for (axis, place) in place.iter_mut().enumerate() {
                let (from, to) =
                    (begin.get(axis).copied().unwrap_or_default(), to.get(axis).copied().unwrap_or_default());
                if axis == a {
                    *place = chord[0];
                } else if axis == b {
                    *place = chord[1];
                } else if axis == c {
                    *place = from + (to - from) * swept / whole;
                }
            }
            items.push_back(Item::Line(Line { to: place, feed }));
        }
        self.go(to, feed, items);
        Ok(())
    }
}

impl Numbers {
    fn add(&mut self, word: Word) -> Result<(), String> {
        let place = match word.letter {
            'X' => &mut self.axes[0],
            'Y' => &mut self.axes[1],
            'Z' => &mut self.axes[2],
            'I' => &mut self.center[0],
            'J' => &mut self.center[1],
            'K' => &mut self.center[2],
            'R' => &mut self.radius,
            'F' => &mut self.feed,
            'P' => &mut self.p,
            // Spindle and tool move no axis.
            'S' | 'T' | 'H' | 'D' => return Ok(()),
            other => return Err(format!("{other} is not in the subset: X, Y, Z, I, J, K, R, F and P")),
        };
        match place.replace(word.value) {
            Some(_) => Err(format!("{} is there twice", word.letter)),
            None => Ok(()),
        }
    }
}

/// Codes have one digit behind the point at most: G28.1 is 281.
fn tenths(number: f64) -> i64 {
    (number * 10.0).round() as i64
}

/// The angle between two places, seen from a center.
fn angle(from: [f64; 2], to: [f64; 2], center: [f64; 2]) -> f64 {
    let [[x0, y0], [x1, y1]] = [from, to].map(|[x, y]| [x - center[0], y - center[1]]);
    (x0 * y1 - y0 * x1).atan2(x0 * x1 + y0 * y1).abs()
}
