//! The common design of all pictures: a sheet with a title and one panel per axis or encoder.
//!
//! Nothing covers the data: names of rows are to the left of them, notes to the right, the legend above the panels. Each
//! curve has a colour and a dash of its own, so that it can be told apart in black and white too. Dark screens get other
//! colours; prints use those for paper.

mod chart;
#[cfg(test)]
pub(crate) mod geometry;
mod rows;
mod stroke;
mod wave;

use std::error::Error;

use plotters::coord::Shift;
use plotters::prelude::*;

pub(crate) use chart::Chart;
pub(crate) use rows::{Row, Rows};
pub(crate) use stroke::{ALARM, Stroke};
pub(crate) use wave::Wave;

/// Colours of the background, of text, of guide lines, and of areas behind the data.
pub(crate) const PAPER: RGBColor = RGBColor(255, 255, 255);
pub(crate) const INK: RGBColor = RGBColor(25, 25, 25);
pub(crate) const GRID: RGBColor = RGBColor(215, 215, 215);
pub(crate) const SHADE: RGBColor = RGBColor(205, 220, 240);

/// The same for a dark screen, with brighter strokes; selected by the colours in the attributes of the elements.
pub(crate) const DARK: &str = "@media screen and (prefers-color-scheme: dark) {
[fill=\"#FFFFFF\"] { fill: #16191D } [fill=\"#191919\"] { fill: #E4E4E4 } [stroke=\"#191919\"] { stroke: #E4E4E4 }
[stroke=\"#D7D7D7\"] { stroke: #3A4048 } [fill=\"#CDDCF0\"] { fill: #2A3B52 }
[stroke=\"#005AB4\"] { stroke: #6DB3FF } [fill=\"#005AB4\"] { fill: #6DB3FF } [stroke=\"#C85A00\"] { stroke: #FFA552 }
[stroke=\"#008246\"] { stroke: #5BD69A } [stroke=\"#7A3CA0\"] { stroke: #C99BEB } [stroke=\"#B00020\"] { stroke: #FF7A85 }
[fill=\"#B00020\"] { fill: #FF7A85 } }";

pub(crate) type Drawn<T = ()> = Result<T, Box<dyn Error>>;
pub(crate) type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;

/// Maximum width of a letter, as a fraction of the size passed to plotters.
const LETTER: f64 = 0.53;
/// Sizes of letters.
pub(crate) const SMALL: u32 = 13;
const TITLE: u32 = 19;
/// Space for a line of the legend, and for its samples.
const LEGEND: u32 = 22;
const SAMPLE: i32 = 44;
/// Margin around everything.
const MARGIN: i32 = 10;

/// Returns the maximum number of pixels that a text takes.
pub(crate) fn width_of(text: &str, size: u32) -> i32 {
    (text.chars().count() as f64 * f64::from(size) * LETTER).ceil() as i32
}

/// Returns a style for text in the ink colour.
pub(crate) fn ink(size: u32) -> TextStyle<'static> {
    ("sans-serif", size).into_font().color(&INK)
}

/// Something that fills an area of a sheet.
pub(crate) trait Panel {
    /// Draws itself.
    fn draw(&self, area: &Area<'_>) -> Drawn;
}

/// A panel with its share of the width.
pub(crate) type Share = (u32, Box<dyn Panel>);

/// A picture: panels below each other, or side by side.
pub(crate) struct Sheet {
    title: String,
    width: u32,
    legend: Vec<(Stroke, String)>,
    /// Rows of panels, each with its height.
    rows: Vec<(u32, Vec<Share>)>,
}

impl Sheet {
    pub(crate) fn new(title: &str, width: u32) -> Self {
        Self { title: title.to_owned(), width, legend: Vec::new(), rows: Vec::new() }
    }

    /// Adds the meaning of a stroke to the legend.
    pub(crate) fn explain(&mut self, stroke: Stroke, what: impl Into<String>) {
        self.legend.push((stroke, what.into()));
    }

    /// Adds a panel over the whole width.
    pub(crate) fn panel(&mut self, height: u32, panel: impl Panel + 'static) {
        self.beside(height, vec![(1, Box::new(panel))]);
    }

    /// Adds panels side by side, with their shares of the width.
    pub(crate) fn beside(&mut self, height: u32, panels: Vec<Share>) {
        self.rows.push((height, panels));
    }

    /// Returns the picture as SVG.
    pub(crate) fn svg(&self) -> Drawn<String> {
        let lines = self.title_lines();
        let legend = self.legend_places();
        let legend_lines = legend.last().map_or(0, |(line, _)| line + 1);
        let head = lines.len() as u32 * (TITLE + 5) + legend_lines * LEGEND + 2 * MARGIN as u32;
        let height = head + self.rows.iter().map(|(height, _)| height).sum::<u32>() + MARGIN as u32;
        let mut svg = String::new();
        let root = SVGBackend::with_string(&mut svg, (self.width, height)).into_drawing_area();
        root.fill(&PAPER)?;
        let mut y = MARGIN;
        for line in lines {
            root.draw(&Text::new(line, (MARGIN, y), ink(TITLE)))?;
            y += TITLE as i32 + 5;
        }
        for ((stroke, what), (line, x)) in self.legend.iter().zip(&legend) {
            stroke.sample(&root, (*x, y + (line * LEGEND) as i32 + 9), SAMPLE, what)?;
        }
        let mut rest = root.split_vertically(head as i32).1;
        for (height, panels) in &self.rows {
            let (row, below) = rest.split_vertically(*height as i32);
            self.row(row, panels)?;
            rest = below;
        }
        root.present()?;
        drop((root, rest));
        Ok(finished(&svg))
    }

    fn row(&self, mut area: Area<'_>, panels: &[Share]) -> Drawn {
        let all: u32 = panels.iter().map(|(share, _)| share).sum();
        for (share, panel) in panels {
            let (own, right) = area.split_horizontally((self.width * share / all.max(1)) as i32);
            panel.draw(&own)?;
            area = right;
        }
        Ok(())
    }

    /// Breaks the title into lines no wider than the sheet.
    fn title_lines(&self) -> Vec<String> {
        let room = self.width as i32 - 2 * MARGIN;
        let mut lines: Vec<String> = Vec::new();
        for word in self.title.split_whitespace() {
            match lines.last_mut().filter(|line| width_of(line, TITLE) + width_of(word, TITLE) + 10 < room) {
                Some(line) => *line = format!("{line} {word}"),
                None => lines.push(shortened(word, TITLE, room)),
            }
        }
        lines
    }

    /// Returns the line and the column of each entry of the legend.
    fn legend_places(&self) -> Vec<(u32, i32)> {
        let (mut line, mut x) = (0, MARGIN);
        let place = |(_, what): &(Stroke, String)| {
            let wide = SAMPLE + 8 + width_of(what, SMALL) + 24;
            if x > MARGIN && x + wide > self.width as i32 {
                (line, x) = (line + 1, MARGIN);
            }
            x += wide;
            (line, x - wide)
        };
        self.legend.iter().map(place).collect()
    }
}

/// Cuts a text to the available pixels.
pub(crate) fn shortened(text: &str, size: u32, room: i32) -> String {
    let printable = || text.chars().map(|c| if c.is_control() { ' ' } else { c });
    if width_of(text, size) <= room {
        return printable().collect();
    }
    let most = (f64::from(room.max(0)) / f64::from(size) / LETTER) as usize;
    printable().take(most.saturating_sub(1)).chain(['…']).collect()
}

/// Adds the colours for dark screens.
fn finished(svg: &str) -> String {
    svg.replacen(">\n", &format!(">\n<style>{DARK}</style>\n"), 1)
}
