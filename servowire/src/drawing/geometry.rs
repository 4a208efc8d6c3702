//! Finds where things are in an SVG.

use std::collections::BTreeSet;

use plotters::prelude::Color;

use super::Stroke;

/// Left, top, right, bottom.
type Room = [f64; 4];

fn attribute<'a>(tag: &'a str, name: &str) -> Option<&'a str> {
    let from = tag.find(&format!(" {name}=\""))? + name.len() + 3;
    tag[from..].split('"').next()
}

fn number(tag: &str, name: &str) -> f64 {
    attribute(tag, name).and_then(|text| text.parse().ok()).unwrap_or(0.0)
}

/// The space that a text takes: letters are 0.64 times as wide as high, like the digits of wide fonts.
pub(crate) fn texts(svg: &str) -> Vec<(String, Room)> {
    let elements = svg.split("<text").skip(1);
    let room = |element: &str| {
        let (tag, rest) = element.split_once('>').unwrap();
        let words = rest.split("</text").next().unwrap().trim().to_owned();
        let size = number(tag, "font-size");
        let (x, y, wide) = (number(tag, "x"), number(tag, "y"), words.chars().count() as f64 * size * 0.64);
        let left = match attribute(tag, "text-anchor") {
            Some("middle") => x - wide / 2.0,
            Some("end") => x - wide,
            _ => x,
        };
        let top = match attribute(tag, "dy") {
            Some("0.76em") => y,
            Some("0.5ex") => y - size / 2.0,
            _ => y - size,
        };
        let flat = [left, top, left + wide, top + size];
        // Turned by 90° around its place.
        let turned = [x + top - y, y - (left + wide - x), x + top + size - y, y - (left - x)];
        (words, if tag.contains("rotate(") { turned } else { flat })
    };
    elements.map(room).collect()
}

/// Returns the lines of these colours.
fn lines(svg: &str, colours: &BTreeSet<String>) -> Vec<Vec<(f64, f64)>> {
    let elements = svg.split("<polyline").skip(1).map(|element| element.split('>').next().unwrap());
    let own = elements.filter(|tag| colours.contains(attribute(tag, "stroke").unwrap_or("")));
    let point = |text: &str| {
        let (x, y) = text.split_once(',')?;
        Some((x.parse().ok()?, y.parse().ok()?))
    };
    own.map(|tag| attribute(tag, "points").unwrap().split_whitespace().filter_map(point).collect()).collect()
}

/// Checks that no text covers another one or a curve or leaves the sheet, and that the picture can be displayed.
pub(crate) fn nothing_is_covered(svg: &str) {
    assert!(svg.starts_with("<svg") && svg.trim_end().ends_with("</svg>") && svg.contains("<style>"), "{svg}");
    assert!(!svg.contains("NaN") && !svg.contains("\"inf"));
    let colours: BTreeSet<String> = Stroke::ALL
        .iter()
        .chain([&Stroke::ONLY, &super::ALARM])
        .map(|stroke| {
            let (r, g, b) = stroke.style().color.to_backend_color().rgb;
            format!("#{r:02X}{g:02X}{b:02X}")
        })
        .collect();
    let (texts, lines) = (texts(svg), lines(svg, &colours));
    assert!(texts.len() > 3, "{} texts", texts.len());
    let (width, height) = (number(svg, "width"), number(svg, "height"));
    for (at, (words, room)) in texts.iter().enumerate() {
        let [left, top, right, bottom] = room;
        let inside = *left >= 0.0 && *top >= 0.0 && *right <= width && *bottom <= height;
        assert!(inside, "\"{words}\" stands beyond the sheet of {width} x {height}: {room:?}");
        for (other, room) in texts.iter().skip(at + 1) {
            let apart = room[0] >= *right || room[2] <= *left || room[1] >= *bottom || room[3] <= *top;
            assert!(apart, "\"{words}\" covers \"{other}\": {:?} {room:?}", [left, top, right, bottom]);
        }
        for line in &lines {
            for pair in line.windows(2) {
                // Points a pixel apart along the line.
                let (dx, dy) = (pair[1].0 - pair[0].0, pair[1].1 - pair[0].1);
                let parts = dx.abs().max(dy.abs()).ceil().max(1.0);
                let mut part = 0.0;
                while part <= parts {
                    let (x, y) = (pair[0].0 + dx * part / parts, pair[0].1 + dy * part / parts);
                    let off = x < *left || x > *right || y < *top || y > *bottom;
                    assert!(off, "\"{words}\" covers a curve at {x}, {y}");
                    part += 1.0;
                }
            }
        }
    }
}

#[test]
fn what_is_covered_is_seen() {
    use super::{Chart, Sheet};
    let mut sheet = Sheet::new("a line through a text", 400);
    sheet.panel(200, Chart::new("up", "along", 0.0..1.0).with(Stroke::ONLY, vec![(0.0, 0.0), (1.0, 1.0)]));
    let svg = sheet.svg().unwrap();
    nothing_is_covered(&svg);
    let caught = |svg: &str| std::panic::catch_unwind(|| nothing_is_covered(svg)).is_err();
    let text =
        |x: i32, y: i32| format!("<text x=\"{x}\" y=\"{y}\" dy=\"0.76em\" font-size=\"10\">\nword\n</text>\n</svg>");
    for (x, y) in [(380, 100), (-5, 100), (10, 195), (14, 14)] {
        assert!(caught(&svg.replace("</svg>", &text(x, y))), "{x}, {y}");
    }
    let curve = &lines(&svg, &["#005AB4".to_owned()].into())[0];
    let (x, y) = (f64::midpoint(curve[0].0, curve[1].0), f64::midpoint(curve[0].1, curve[1].1));
    assert!(caught(&svg.replace("</svg>", &text(x as i32 - 5, y as i32 - 5))));
    assert!(!caught(&svg.replace("</svg>", &text(x as i32 + 20, y as i32 + 10))));
}

/// Checks that every colour in use has one for dark screens.
#[test]
fn each_colour_has_a_dark_one() {
    let own = |stroke: &Stroke| {
        let (r, g, b) = stroke.style().color.to_backend_color().rgb;
        format!("[stroke=\"#{r:02X}{g:02X}{b:02X}\"]")
    };
    for stroke in Stroke::ALL.iter().chain([&Stroke::ONLY, &super::ALARM, &Stroke::number(9)]) {
        assert!(super::DARK.contains(&own(stroke)), "{}", own(stroke));
    }
}
