//! The effect of a line of a part program, given the modes set by earlier lines.

use std::collections::VecDeque;

use step_motion::Turning;

use super::AXES;
use super::item::{Item, Line};
use super::limit::down;
use super::numbers::Numbers;
use super::words::Word;

/// Largest distance of an axis from 0, in mm.
const FAR: f64 = 50_000.0;

const NAMES: [char; AXES] = ['X', 'Y', 'Z'];

/// The meaning of a line with X, Y or Z.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Motion {
    /// No mode has been set yet.
    None,
    Straight {
        rapid: bool,
    },
    Arc(Turning),
    /// After G80.
    Cancelled,
}

/// The effect of a word without a mode, limited to its line.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Once {
    Dwell,
    /// Go to a reference, or store it; and which one.
    Reference(usize),
    Keep(usize),
    Machine,
    Shift,
    Unshift,
}

/// The modes that stay until a line changes them.
pub(super) struct State {
    /// Position in mm, in machine coordinates.
    pub(super) at: [f64; AXES],
    /// The offset that G92 adds to the program's coordinates.
    shift: [f64; AXES],
    /// Reference positions of G28 and G30.
    references: [[f64; AXES]; 2],
    motion: Motion,
    /// The axes of the arc plane, and the axis along which it is viewed.
    pub(super) plane: [usize; AXES],
    /// In mm/min.
    feed: Option<f64>,
    /// Millimetres per unit.
    pub(super) unit: f64,
    relative: bool,
    /// G61.1: stop after each line.
    stops: bool,
    /// Half a step of each axis, in 0.1 um.
    pub(super) half_steps: [u32; AXES],
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
            half_steps: [0; AXES],
        }
    }
}

/// The group of G80, which post-processors write in one line with G0.
const CYCLES: usize = 9;

const SUBSET: &str = "G0 to G4, G17 to G21, G28, G30, G40, G43, G49, G53 to G59, G61, G64, G80, G90 to G92, G94";

const ARCS: &str = "I, J, K and R belong to G2 and G3";

/// Refuses a second word of a modal group in a line.
fn only_one(groups: &mut [Option<f64>], group: usize, Word { letter, value }: Word) -> Result<(), String> {
    match groups.get_mut(group).and_then(|place| place.replace(value)) {
        Some(other) => Err(format!("{letter}{other} and {letter}{value} in one line: only one of them can apply")),
        None => Ok(()),
    }
}

/// The groups of an M word, of each of which a line may have one.
fn machine_groups(code: i64, number: f64) -> Result<&'static [usize], String> {
    Ok(match code {
        0 | 10 | 20 | 300 | 600 => &[4],
        60 => &[6],
        // Spindle, coolant (mist and flood may run at once) and overrides move no axis.
        30 | 40 | 50 => &[7],
        70 => &[8],
        80 => &[5],
        90 => &[8, 5],
        480 | 490 => &[9],
        _ => return Err(format!("M{number} is not in the subset: M0 to M9, M30, M48, M49, M60")),
    })
}

/// Refuses a motion that is not alone in taking the axes of its line. G0 before G28 or G30 is usual: a reference is approached as fast.
fn one_taker(once: Option<(Once, f64)>, motion: f64, cancels: bool) -> Result<(), String> {
    match once {
        Some((Once::Reference(_), _)) if tenths(motion) == 0 => Ok(()),
        Some((Once::Reference(_) | Once::Shift, word)) => {
            Err(format!("G{word} and G{motion} in one line: both take X, Y and Z"))
        }
        None | Some((Once::Machine, _)) if cancels => {
            Err(format!("X, Y and Z in one line with G80, which ends G{motion}: give each a line"))
        }
        _ => Ok(()),
    }
}

impl State {
    /// Executes a line; returns `true` at the end of the program.
    pub(super) fn block(&mut self, words: &[Word], items: &mut VecDeque<Item>) -> Result<bool, String> {
        let mut numbers = Numbers::default();
        let (mut once, mut over, mut pause, mut smooth) = (None, false, false, false);
        let (mut groups, mut machine) = ([None; 14], [None; 10]);
        for word in words {
            match word.letter {
                'G' => {
                    let (group, what) = self.general(word.value, items)?;
                    only_one(&mut groups, group, *word)?;
                    smooth |= tenths(word.value) == 640;
                    once = what.or(once);
                }
                'M' => {
                    let code = tenths(word.value);
                    for group in machine_groups(code, word.value)? {
                        only_one(&mut machine, *group, *word)?;
                    }
                    over |= matches!(code, 20 | 300);
                    pause |= matches!(code, 0 | 10 | 60 | 600);
                }
                _ => numbers.add(*word)?,
            }
        }
        if groups[1].is_none() && groups[CYCLES].is_some() {
            self.motion = Motion::Cancelled;
        }
        if let Some(motion) = groups[1] {
            let cancels = groups[CYCLES].is_some() && (numbers.moves() || numbers.bend());
            one_taker(once.zip(groups[0]), motion, cancels)?;
        }
        if let Some(feed) = numbers.feed {
            let feed = feed * self.unit;
            if !(0.06..=60_000_000.0).contains(&feed) {
                return Err(format!("F: a feed of {feed} mm/min: from 0.06 to 60000000"));
            }
            self.feed = Some(feed);
        }
        if smooth {
            let most = numbers.p.map(|p| p * self.unit);
            if let Some(most) = most.filter(|most| !(0.0..=1000.0).contains(most)) {
                return Err(format!("G64 P: corners rounded by {most} mm: from 0 to 1000"));
            }
            let most = most.map(|most| down(most * 1000.0) as u32);
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

    /// Executes a G word; returns its group, of which a line may have only one word, and any effect limited to this line.
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

    /// Sets a mode other than the motion mode; returns its group.
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

    /// Executes a motion, or what takes its place.
    fn act(&mut self, once: Option<Once>, numbers: &Numbers, items: &mut VecDeque<Item>) -> Result<(), String> {
        let moves = numbers.moves();
        if numbers.bend() && !matches!(once, None | Some(Once::Machine)) {
            return Err(ARCS.to_owned());
        }
        match once {
            Some(Once::Keep(_) | Once::Unshift) if moves => {
                return Err("X, Y and Z do not belong to G28.1, G30.1, G92.1 and G92.2".to_owned());
            }
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
                if moves || numbers.bend() {
                    return self.run(numbers, once.is_some(), items);
                }
            }
        }
        Ok(())
    }

    /// Returns the target of X, Y and Z in machine coordinates, in mm.
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
            if numbers.bend() {
                return Err(ARCS.to_owned());
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
        self.end(Line { to, feed, bends: false }, items);
    }

    /// Adds the last line of a block.
    pub(super) fn end(&mut self, line: Line, items: &mut VecDeque<Item>) {
        items.push_back(Item::Line(line));
        if self.stops {
            items.push_back(Item::Rest(0));
        }
        self.at = line.to;
    }
}

/// Codes have at most one digit after the point: G28.1 is 281, and a number with more digits is no code.
fn tenths(number: f64) -> i64 {
    let tenths = (number * 10.0).round();
    if (number * 10.0 - tenths).abs() < 1e-6 { tenths as i64 } else { i64::MIN }
}
