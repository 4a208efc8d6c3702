//! Tests of part programs in the dialects of five post-processors, and of refusals.

use std::io::BufReader;

use super::AXES;
use super::item::{Item, Line};
use super::program::Program;

fn items(text: &str) -> Vec<Item> {
    Program::new("part.nc", text.as_bytes(), false).collect::<Result<_, _>>().unwrap()
}

fn ends(text: &str) -> Vec<[f64; AXES]> {
    lines(text).iter().map(|line| line.to).collect()
}

fn lines(text: &str) -> Vec<Line> {
    let line = |item| if let Item::Line(line) = item { Some(line) } else { None };
    items(text).into_iter().filter_map(line).collect()
}

fn refused(text: &str) -> String {
    let end = Program::new("part.nc", text.as_bytes(), false).last();
    end.map_or_else(|| "taken".to_owned(), |end| end.map_or_else(|fault| fault.to_string(), |item| format!("{item:?}")))
}

fn near(got: [f64; AXES], want: [f64; AXES]) -> bool {
    got.iter().zip(want).all(|(got, want)| (got - want).abs() < 2e-3)
}

/// Returns the last position, and the rests in ns.
fn follow(text: &str) -> ([f64; AXES], Vec<u64>) {
    let rest = |item: &Item| if let Item::Rest(ns) = item { Some(*ns) } else { None };
    let end = *ends(text).last().unwrap();
    (end, items(text).iter().filter_map(rest).collect())
}

#[test]
fn straight_lines_in_all_modes() {
    let text = "%\nN10 G21 G90 (absolute)\nG0 X10 Y-5.5\nG1 Z-1 F60 ; down\nX20\nG91 X1 Y1\nG20 G1 X1\nM30\nX9";
    assert_eq!(
        ends(text),
        [[10.0, -5.5, 0.0], [10.0, -5.5, -1.0], [20.0, -5.5, -1.0], [21.0, -4.5, -1.0], [46.4, -4.5, -1.0]]
    );
    assert_eq!(lines("G1 X2 F60")[0].feed, Some(1000));
    assert_eq!(lines("G0 X1234.56789")[0], Line { to: [1234.56789, 0.0, 0.0], feed: None, bends: false });
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

/// However the arc is split into chords, Z follows its angle.
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

/// A quarter circle of 10 mm radius from (10, 0) to (0, 10): its middle is at 45 degrees, or at 225 degrees the long way
/// round.
#[test]
fn arcs_by_their_radius() {
    let far = 10.0 * std::f64::consts::FRAC_1_SQRT_2;
    for (text, middle, center) in [
        ("G0 X10\nG3 X0 Y10 R10 F600", [far, far], [0.0, 0.0]),
        ("G0 X10\nG2 X0 Y10 R10 F600", [10.0 - far, 10.0 - far], [10.0, 10.0]),
        ("G0 X10\nG3 X0 Y10 R-10 F600", [10.0 + far, 10.0 + far], [10.0, 10.0]),
        ("G0 X10\nG2 X0 Y10 R-10 F600", [-far, -far], [0.0, 0.0]),
    ] {
        let ends = ends(text);
        assert_eq!(ends.last(), Some(&[0.0, 10.0, 0.0]));
        let [x, y] = center;
        assert!(ends.iter().all(|p| ((p[0] - x).hypot(p[1] - y) - 10.0).abs() < 1e-3), "{text}");
        let nearest = ends.iter().map(|p| (p[0] - middle[0]).hypot(p[1] - middle[1])).fold(f64::MAX, f64::min);
        assert!(nearest < 0.7, "{text}: {nearest}");
    }
}

/// Viewed against the third axis: in G18, left of X is -Z.
#[test]
fn arcs_in_three_planes() {
    // Z first, then X: from Z = 5 counter-clockwise a quarter to X = 5.
    let turn = ends("G18 G0 Z5\nG3 X5 Z0 I0 K-5 F600");
    assert!(turn[1..].iter().all(|[x, _, z]| (x.hypot(*z) - 5.0).abs() < 1e-3 && *x >= 0.0 && *z >= 0.0), "{turn:?}");
    // Y, then Z.
    let turn = ends("G19 G0 Y5\nG3 Y0 Z5 X1 J-5 K0 F600");
    assert!(turn[1..].iter().all(|[_, y, z]| (y.hypot(*z) - 5.0).abs() < 1e-3 && *y >= 0.0 && *z >= 0.0), "{turn:?}");
    assert_eq!(turn.last(), Some(&[1.0, 0.0, 5.0]));
}

#[test]
fn references_shifts_and_machine_coordinates() {
    assert_eq!(
        ends("G0 X10 Y20 Z5\nG91 G28 Z0\nG28"),
        [[10.0, 20.0, 5.0], [10.0, 20.0, 5.0], [10.0, 20.0, 0.0], [0.0; 3]]
    );
    assert_eq!(ends("G0 X10\nG30.1\nG0 X1 Y1\nG30 X5")[2..], [[5.0, 1.0, 0.0], [10.0, 1.0, 0.0]]);
    // What is 10 is called 0, and G53 still calls it 10.
    assert_eq!(
        ends("G0 X10\nG92 X0 Y5\nG0 X1 Y6\nG53 G0 X1 Y1\nG0 X0 Y5\nG92.1\nG0 X1 Y1"),
        [[10.0, 0.0, 0.0], [11.0, 1.0, 0.0], [1.0, 1.0, 0.0], [10.0, 0.0, 0.0], [1.0, 1.0, 0.0]]
    );
}

#[test]
fn rests_stops_and_modes_of_the_path() {
    let rest = items("G0 X1\nG4 P0.25\nM0\nG61.1 X2\nG64 P0.05\nX3\nG61\nG64");
    let line = |x| Item::Line(Line { to: [x, 0.0, 0.0], feed: None, bends: false });
    assert_eq!(
        rest,
        [
            line(1.0),
            Item::Rest(250_000_000),
            Item::Rest(0),
            Item::Deviation(Some(0)),
            line(2.0),
            Item::Rest(0),
            Item::Deviation(Some(50)),
            line(3.0),
            Item::Deviation(Some(0)),
            Item::Deviation(None),
        ]
    );
    let with = |block_delete| Program::new("", "G0 X1\n/G0 X2\n".as_bytes(), block_delete).count();
    assert_eq!((with(false), with(true)), (2, 1));
}

/// No corner is rounded by more than it says, in whole um; 1.001 mm are as many, though a little less in floating point.
#[test]
fn corners_are_rounded_by_no_more_than_asked() {
    for (text, um) in [("G64 P0.0015", 1), ("G20 G64 P0.00011", 2), ("G64 P0.0009", 0), ("G64 P1.001", 1001)] {
        assert_eq!(items(text), [Item::Deviation(Some(um))], "{text}");
    }
}

/// With the metric headers and footers of a hobby router's post-processor.
#[test]
fn a_post_of_a_hobby_router() {
    let text = "(Pocket, 6 mm)\nG21\nG90\nG17\nM3 S12000\nG0 Z5.000\nG0 X10.000 Y10.000\nG1 Z-1.500 F300\nG2 X20.000 Y20.000 I10.000 J0.000 F900\n\
                G1 X30.000\nG0 Z5.000\nM5\nG0 X0 Y0\nM30\n";
    assert_eq!(follow(text), ([0.0, 0.0, 5.0], vec![]));
    assert!(lines(text).iter().any(|line| line.feed == Some(15_000)));
}

/// With program number, line numbers, tool change, tool length and a reference in the style of a machining centre.
#[test]
fn a_post_of_a_machining_centre() {
    let text = "%\nO1001 (PLATE)\nN10 G00 G17 G21 G40 G49 G80 G90\nN20 G91 G28 Z0.\nN30 T1 M06\nN40 G90 G54\nN50 S8000 M03\n\
                N60 G00 X25. Y-12.5\nN70 G43 H01 Z15. M08\nN80 G01 Z-2. F400.\nN90 G03 X37.5 Y0. R12.5\nN100 G01 Y10.\n\
                N110 G00 Z15.\nN120 M09\nN130 M05\nN140 G91 G28 Z0.\nN150 G28 X0. Y0.\nN160 M30\n%\n";
    let (end, rests) = follow(text);
    assert!(near(end, [0.0; 3]) && rests == [0], "{end:?} {rests:?}");
}

/// With inches, planes and an exact path.
#[test]
fn a_post_in_inches() {
    let text = "%\nG20 G90 G94 G17 G54\nG64 P0.001\nT2 M6\nS5000 M3\nG0 X1. Y.5\nZ.1\nG1 Z-.05 F10.\nG18\nG2 X1.5 Z-.05 I.25 K0.\nG17\nG61\n\
                G1 X2.\nG4 P.5\nG0 Z1.\nG53 G0 Z0.\nM2\n%\n";
    let (end, rests) = follow(text);
    assert!(near(end, [50.8, 12.7, 0.0]) && rests == [0, 500_000_000], "{end:?} {rests:?}");
    assert!(items(text).contains(&Item::Deviation(Some(25))));
}

/// With the checksums of a 3D printer host.
#[test]
fn a_post_with_checksums() {
    let sum = |line: &str| format!("{line}*{}\n", line.bytes().fold(0, |sum, byte| sum ^ byte));
    let text: String = ["N1 G90", "N2 G21", "N3 G28", "N4 G1 X10 Y5 F3000", "N5 G92 X0 Y0", "N6 G1 X5 F3000", "N7 M2"]
        .iter()
        .map(|line| sum(line))
        .collect();
    assert_eq!(follow(&text), ([15.0, 5.0, 0.0], vec![]));
    assert!(refused(&text.replace("Y5", "Y6")).contains("part.nc, line 4: its checksum"));
    // As a host sends the lines of a slicer, and as a slicer writes them.
    let noted = text.replace('\n', " ; at 50*2\n") + "; sizes: 10*20\n";
    assert_eq!(follow(&noted), follow(&text));
    let mut program = Program::new("part.nc", noted.as_bytes(), false);
    assert_eq!(program.by_ref().map(Result::unwrap).count(), items(&text).len());
    assert_eq!(program.behind_the_end(), Ok(None));
}

/// With a spiral down in relative mode, lower case and no blanks.
#[test]
fn a_post_of_a_laser_cutter() {
    let text = "; cut\ng21g90\nm4s0\ng0x50y50\ng91\ng1x10f1200s800\ng2x0y-20i0j-10\ng1x-10\ny20\ng90\nm5\ng0x0y0\nm2\n";
    let (end, rests) = follow(text);
    assert!(near(end, [0.0; 3]) && rests.is_empty());
    let arc: Vec<_> = ends(text).into_iter().filter(|[x, ..]| *x > 60.001).collect();
    assert!(arc.len() > 10 && arc.iter().all(|[x, y, _]| ((x - 60.0).hypot(y - 40.0) - 10.0).abs() < 1e-3), "{arc:?}");
}

/// A million lines are read one by one, and none is kept.
#[test]
fn a_long_program_is_not_kept() {
    struct Endless(u64);
    impl std::io::Read for Endless {
        fn read(&mut self, to: &mut [u8]) -> std::io::Result<usize> {
            self.0 += 1;
            let line = format!("G1 X{} Y{} F600\n", self.0 % 100, self.0 % 7);
            to.get_mut(..line.len()).unwrap().copy_from_slice(line.as_bytes());
            Ok(line.len())
        }
    }
    let mut program = Program::new("", std::io::BufReader::with_capacity(64, Endless(0)), false);
    for _ in 0..1_000_000 {
        program.next().unwrap().unwrap();
    }
    assert!(program.waiting() == 0);
}

#[test]
fn refusals_name_the_line_and_what_to_do() {
    for (text, want) in [
        ("G0 X1\nG1 X2", "part.nc, line 2: no feed yet: add F"),
        ("G0 X1\n\nG33 X2", "part.nc, line 3: G33 is not in the subset"),
        ("G1 F10\nG2 X1 Y1", "line 2: an arc needs its center"),
        ("G0 X10\nG2 X-5 I-10 F10", "line 2: an arc from a radius of"),
        ("G2 X10 R4 F10", "R4: two places 10.0000 mm apart"),
        ("G2 R4 F10", "needs I, J or K"),
        ("G2 X1 R5 I1 F10", "R together with I, J or K"),
        ("G2 X1 K1 F10", "a center of I and J in G17"),
        ("X5", "line 1: no G0 to G3 before it"),
        ("G0 X1\nG80\nX5", "line 3: G80 has cancelled the motion"),
        ("G0 G1 X5 F10", "G0 and G1 in one line"),
        ("G90 G91", "G90 and G91 in one line"),
        ("G28 G92 X0", "G28 and G92 in one line"),
        ("S900 M3 M4", "M3 and M4 in one line"),
        ("M0 M30", "M0 and M30 in one line"),
        ("M48 M49", "M48 and M49 in one line"),
        ("G1 X5 I1 F10", "belong to G2 and G3"),
        ("G1 X5 P1 F10", "P belongs to G4 and G64"),
        ("G4", "G4 needs P"),
        ("G4 P-1", "a rest of 0 to 86400 s"),
        ("G92", "G92 needs X, Y or Z"),
        ("G28 I5", "I, J, K and R belong to G2 and G3"),
        ("G92 X1 R5", "I, J, K and R belong to G2 and G3"),
        ("G4 P1 K0", "I, J, K and R belong to G2 and G3"),
        ("G92.1 X1", "X, Y and Z do not belong to G28.1, G30.1, G92.1 and G92.2"),
        ("G28.1 Z2", "X, Y and Z do not belong to G28.1, G30.1, G92.1 and G92.2"),
        ("G0 X5 X6", "X is there twice"),
        ("G0 X60000", "X: 60000 mm is farther than 50000 mm"),
        ("G1 X5 F0", "a feed of 0 mm/min"),
        ("G0 X5 E2", "E is not in the subset"),
        ("G81 X1 R1 Z-5 F10", "G81 is not in the subset"),
        ("G41 D1", "G41 is not in the subset"),
        ("M98 P1", "M98 is not in the subset"),
        ("G0 X#1", "values are numbers, not variables"),
        ("hello world", "line 1"),
        ("G1.04 X1 F100", "line 1: G1.04 is not in the subset"),
        ("G0 X1\nM30.04", "line 2: M30.04 is not in the subset"),
        ("G64 P-1", "corners rounded by -1 mm"),
        ("G64 P1001", "from 0 to 1000"),
        ("G28 G1 X5", "line 1: G28 and G1 in one line: both take X, Y and Z"),
        ("G0 X1\nG2 G30 X5", "line 2: G30 and G2 in one line: both take X, Y and Z"),
        ("G92 G0 X1", "line 1: G92 and G0 in one line: both take X, Y and Z"),
        ("G0 X1 G80", "line 1: X, Y and Z in one line with G80"),
        ("M8 M9", "line 1: M8 and M9 in one line"),
        ("M9 M7", "line 1: M9 and M7 in one line"),
        ("S1 M3 S2", "line 1: S is there twice"),
        ("T1 T1 M6", "line 1: T is there twice"),
        ("N1 N2 G0 X1", "line 1: N is there twice"),
        ("G1 F1 X1 F1", "line 1: F is there twice"),
        ("S-900 M3", "line 1: S-900: a number from 0 on"),
        ("T-1 M6", "line 1: T-1: a whole number from 0 on"),
        ("T1.5 M6", "line 1: T1.5: a whole number from 0 on"),
        ("N-1 G0 X1", "line 1: N-1: a whole number from 0 on"),
        ("N1.5 G0 X1", "line 1: N1.5: a whole number from 0 on"),
        ("G2 X10 R1000000 F10", "line 1: a radius of 1000000 mm is too large: at most 107374 mm"),
        ("G3 I-200000 F10", "line 1: a radius of 200000 mm is too large"),
    ] {
        assert!(refused(text).contains(want), "{text}: {}", refused(text));
    }
}

/// Lines end as on any system, and keep their numbers.
#[test]
fn ends_of_lines() {
    let text = "G0 X1\nX2\n\nG1 X3 F60\nX9 F0";
    for (end, last) in [("\n", ""), ("\r\n", ""), ("\r", ""), ("\n", "\n"), ("\r\n", "\r\n"), ("\r", "\r")] {
        let text = text.replace('\n', end) + last;
        for size in [1, 2, 3, 100] {
            let mut program = Program::new("part.nc", BufReader::with_capacity(size, text.as_bytes()), false);
            let lines = program.by_ref().take_while(Result::is_ok).count();
            assert_eq!(lines, 3, "{text:?}");
            let fault = program.refuse(String::new()).to_string();
            assert!(fault.starts_with("part.nc, line 5"), "{text:?}: {fault}");
        }
    }
}

/// Coolant may be mist and flood, and the spindle may be started in the same line.
#[test]
fn machine_words_of_other_groups_go_together() {
    assert_eq!(ends("S900 M3 M7 M8\nG0 X1 M9 M5 M48").len(), 1);
}

/// A reference is approached as by G0, and G80 stands among other modes; both are what posts write.
#[test]
fn words_that_go_together() {
    for text in
        ["G91 G28 Z0", "G0 G91 G28 Z0", "G0 G17 G80 G90\nX1", "G80 G91 G28 Z0", "G53 G0 X1", "N7 T2 S0 M6\nG0 X1"]
    {
        assert!(!ends(text).is_empty(), "{text}");
    }
}

/// Whatever is in a line that is left out.
#[test]
fn a_line_that_is_left_out_is_not_read() {
    for line in ["/G0 X[#1]", "/garbage #@!", "/ (c", "/N3 G28*17", "/\0\x1b", " /2 G99", "\u{feff}/?"] {
        let program = |block_delete, text: &str| {
            Program::new("part.nc", text.as_bytes(), block_delete).collect::<Result<Vec<_>, _>>()
        };
        let text = format!("{line}\nG0 X1\n");
        assert_eq!(program(true, &text).map(|items| items.len()), Ok(1), "{line:?}");
        assert!(program(false, &text).is_err(), "{line:?}");
    }
    let mut program = Program::new("part.nc", "G0 X1\nM2\n/G0 X2\n".as_bytes(), true);
    assert_eq!((program.by_ref().count(), program.behind_the_end()), (1, Ok(None)));
}

/// ^Z ends a file, as under DOS, and fills its last block.
#[test]
fn the_mark_at_the_end_of_a_file() {
    for (text, lines, behind) in [
        ("G0 X1\r\nG0 X2\r\n\x1a", 2, None),
        ("G0 X1\nG0 X2 \x1a\x1a \n\x1a", 2, None),
        ("G0 X1\nM2\n\x1a", 1, None),
        ("/G0 X9\x1a", 0, None),
        ("G0 X1\n\x1a\nG0 X2", 1, Some("part.nc, line 3: not run, nor is what follows: the program ends in line 2")),
    ] {
        let mut program = Program::new("part.nc", text.as_bytes(), true);
        assert_eq!(program.by_ref().map(Result::unwrap).count(), lines, "{text:?}");
        let said = program.behind_the_end().unwrap().map(|fault| fault.to_string());
        assert_eq!(said.as_deref(), behind, "{text:?}");
    }
    assert!(refused("G0 X1\n\x1aG0 X2").contains("line 2: text after ^Z (\\x1a)"), "{}", refused("G0 X1\n\x1aG0 X2"));
}

/// What a terminal would obey is shown as its number.
#[test]
fn control_characters_are_named() {
    for (text, want) in
        [("G0 \x1b[31mX1", "\"\\x1b\" is not G-code"), ("G0 X1*\x07", "\\x07"), ("G0 \u{9b}", "\"\\x9b\"")]
    {
        let said = refused(text);
        assert!(said.contains(want) && !said.contains(char::is_control), "{said:?}");
    }
}

/// As in RS274/NGC: nothing is run after M2, M30, or a percent sign after the first words.
#[test]
fn a_program_ends_before_its_file() {
    for (text, lines, behind) in [
        ("G0 X1\nM2\nG0 X5\n", 1, Some("part.nc, line 3: not run, nor is what follows: the program ends in line 2")),
        ("G0 X1\nM30\n\n(a note)\nBLAH\n", 1, Some("part.nc, line 5: ")),
        ("%\nO7\nG0 X1\n%\nG0 X5\n", 1, Some("part.nc, line 5: ")),
        ("%\n\n(two signs)\n%\nG0 X1\nX2\n", 2, None),
        ("%\nG0 X1\nM30\n%\n\n; no more\n", 1, None),
        ("G0 X1\nX2", 2, None),
    ] {
        let mut program = Program::new("part.nc", text.as_bytes(), false);
        assert_eq!(program.by_ref().map(Result::unwrap).count(), lines, "{text}");
        let said = program.behind_the_end().unwrap().map(|fault| fault.to_string());
        assert!(said.is_some() == behind.is_some(), "{text}: {said:?}");
        assert!(said.unwrap_or_default().starts_with(behind.unwrap_or_default()), "{text}");
    }
}
