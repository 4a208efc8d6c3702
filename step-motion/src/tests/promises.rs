//! A motion that is planned again wherever it is: what was promised to the lines ahead is kept.

use super::path::{Lines, To, limits, lines, near, path, second};
use super::{float, real};
use crate::limits::Bounds;
use crate::path::Course;
use crate::planner::Motion;
use crate::real::Real;
use proptest::prelude::*;
use std::string::String;
use std::vec::Vec;

/// A path under way.
struct Way {
    path: Lines,
    course: Course,
    bounds: Bounds,
    /// How far the motion has come on its curve, and where its first line begins there.
    done: f64,
    begin: f64,
    /// The fraction of the requested speeds.
    part: Real,
    braking: bool,
}

impl Way {
    fn corner(&self, at: usize) -> f64 {
        self.path.line(at).map_or(0.0, |line| float(line.corner) * second())
    }

    fn is_over(&self) -> bool {
        self.path.is_empty() || self.braking && self.course.exit.is_zero()
    }

    /// Goes on along the curve, by a part of what is left of it.
    fn go(&mut self, by: f64) {
        self.done += (float(self.course.curve.way()) - self.done) * by;
        while self.course.more > 0 {
            let length = float(self.path.line(0).unwrap().length);
            if self.begin + length > self.done {
                break;
            }
            self.begin += length;
            self.course.more -= 1;
            self.path.pass();
        }
    }

    fn motion(&self) -> Motion {
        let piece = self.course.curve.after(real(self.done)).unwrap();
        Motion { v: piece.v, a: piece.a, up: piece.up }
    }

    /// Plans again. What is asked for may not fit on what is left of the line: then the curve stays.
    fn plan(&mut self, better: bool) -> Result<(), String> {
        let (motion, from) = (self.motion(), (real(self.done - self.begin), Real::ZERO));
        let planned = if self.braking {
            self.path.brake(0, motion, from, (Some(self.bounds), false))
        } else if better {
            self.path.better_course(0, motion, from, (self.part, Some(self.bounds)))
        } else {
            self.path.course(0, motion, from, (self.part, Some(self.bounds)))
        };
        planned.map_or(Ok(()), |course| self.adopt(course, self.done - self.begin))
    }

    /// Begins the next line.
    fn next(&mut self) -> Result<(), String> {
        for _ in 0..=self.course.more {
            self.path.pass();
        }
        let start = Motion::steady(self.course.exit);
        if self.path.is_empty() {
            return if start.v.is_zero() { Ok(()) } else { Err("the last line is left at speed".into()) };
        }
        let planned =
            if self.braking { self.path.begin_to_brake(0, start.v) } else { self.path.begin(0, start.v, self.part) };
        self.adopt(planned.ok_or("no course")?, 0.0)
    }

    fn adopt(&mut self, (course, bounds): (Course, Bounds), place: f64) -> Result<(), String> {
        (self.course, self.bounds, self.done, self.begin) = (course, bounds, 0.0, -place);
        self.judge(&course, &bounds, place)
    }

    /// Each joint is passed no faster than its corner allows, and each line within its limits.
    fn judge(&self, course: &Course, bounds: &Bounds, place: f64) -> Result<(), String> {
        let (got, way, mut joint) = (limits(bounds), float(course.curve.way()), -place);
        for at in 0..=course.more {
            let line = self.path.line(at).ok_or("no line")?;
            let own = limits(&line.bounds);
            if got.a > own.a * 1.000_001 || got.j > own.j.map(|j| j * 1.000_001) {
                return Err(std::format!("{got:?} on a line with {own:?}"));
            }
            joint += float(line.length);
            if at < course.more {
                let v = float(course.curve.after(real(joint)).unwrap().v) * second();
                if v > self.corner(at + 1) * 1.000_01 + 1e-3 {
                    return Err(std::format!("{v} at joint {at} of a run with {}", self.corner(at + 1)));
                }
            }
        }
        let exit = float(course.exit) * second();
        if exit > self.corner(course.more + 1) * 1.000_01 {
            return Err(std::format!("{exit} at its end with {}", self.corner(course.more + 1)));
        }
        if course.whole != near(way, joint) && (way - joint).abs() > 1e-3 {
            return Err(std::format!("{way} in place of {joint}"));
        }
        Ok(())
    }
}

#[derive(Debug, Clone, Copy)]
enum Ask {
    Push,
    Override(usize),
    Brake,
    Next,
}

fn ask() -> impl Strategy<Value = (f64, Ask, bool)> {
    let asked = prop_oneof![
        6 => Just(Ask::Push),
        3 => Just(Ask::Next),
        1 => (0..4_usize).prop_map(Ask::Override),
        1 => Just(Ask::Brake),
    ];
    (0.0..0.999_f64, asked, any::<bool>())
}

/// Runs a path whose lines come one after another; returns what is wrong.
fn travel(all: &[To], first: usize, asked: &[(f64, Ask, bool)]) -> Result<(), String> {
    let (now, mut later) = all.split_at(first.min(all.len()));
    let mut path = path(now);
    let (course, bounds) = path
        .course(0, Motion::steady(Real::ZERO), (Real::ZERO, Real::ZERO), (Real::ONE, None))
        .ok_or("it does not begin")?;
    let mut way = Way { path, course, bounds, done: 0.0, begin: 0.0, part: Real::ONE, braking: false };
    way.judge(&course, &bounds, 0.0)?;
    for (by, ask, better) in asked {
        if way.is_over() {
            break;
        }
        match ask {
            Ask::Next => way.next()?,
            Ask::Push => {
                let Some(((line, feed), rest)) = later.split_first() else { continue };
                way.go(*by);
                let at = way.path.target();
                if way.path.push([0, 1, 2].map(|axis: usize| at[axis] + line[axis]), *feed).is_ok() {
                    later = rest;
                    way.plan(*better)?;
                }
            }
            Ask::Override(part) => {
                way.go(*by);
                way.part = Real::new([100, 40, 250, 15][*part]) / Real::new(100);
                way.plan(false)?;
            }
            Ask::Brake if way.braking => {}
            Ask::Brake => {
                way.go(*by);
                way.braking = true;
                way.plan(false)?;
            }
        }
    }
    while !way.is_over() {
        way.next()?;
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(if cfg!(miri) { 1 } else { 2000 }))]

    /// Also where every other line is asked for at a higher feed, so that which lines are one run depends on the override.
    #[test]
    fn what_was_promised_is_kept(
        lines in lines(), higher in 1..4_u32, first in 1..4_usize, asked in prop::collection::vec(ask(), 1..12),
    ) {
        let feed = |(at, (by, feed)): (usize, To)| (by, if at % 2 == 0 { feed } else { feed * higher });
        let lines: Vec<To> = lines.into_iter().enumerate().map(feed).collect();
        if let Err(wrong) = travel(&lines, first, &asked) {
            prop_assert!(false, "{wrong}: {lines:?}");
        }
    }
}
