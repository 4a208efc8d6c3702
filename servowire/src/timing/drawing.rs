//! Draws a plan: one row per action, with time to the right.

use super::{Bar, Plan};
use crate::drawing::{Drawn, Row, Rows, Sheet};

/// Returns the plan as SVG.
pub(super) fn svg(plan: &Plan) -> Drawn<String> {
    let us = |ns: i64| ns as f64 / 1000.0;
    let begin = plan.bars.iter().map(|bar| bar.start_ns).min().unwrap_or(0);
    let end = plan.bars.iter().map(|bar| bar.end_ns).max().unwrap_or(1).max(begin + 1);
    let mut rows = Rows {
        title: format!(
            "shortest cycle {:.2} us; after the worst fault the line is free {:.2} us after the start of the request",
            us(plan.cycle_ns as i64),
            us(plan.fault_ns as i64)
        ),
        along: "time from the start of the request in us".to_owned(),
        x: us(begin)..us(end),
        each: Vec::new(),
    };
    for Bar { who, what, start_ns, end_ns } in plan.bars.iter().filter(|bar| bar.end_ns > bar.start_ns) {
        let (start, end) = (us(*start_ns), us(*end_ns));
        let row = Row { name: (*who).to_owned(), note: what.clone(), ..Row::default() };
        rows.each.push(Row { bars: vec![start..end], ..row });
    }
    let mut sheet = Sheet::new(&plan.title, 1000);
    sheet.panel(rows.height(), rows);
    sheet.svg()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::drawing::geometry::{nothing_is_covered, texts};

    #[test]
    fn every_bar_is_drawn_in_its_row() {
        let bar = |who, start_ns, end_ns| Bar { who, what: format!("what {who} does"), start_ns, end_ns };
        let bars = vec![bar("controller", 0, 4_000), bar("encoder", 7_000, 11_000), bar("controller", 11_000, 11_000)];
        let plan = Plan { title: "a plan".to_owned(), bars, cycle_ns: 12_000, fault_ns: 20_000 };
        let svg = svg(&plan).unwrap();
        nothing_is_covered(&svg);
        // An empty bar is not drawn.
        assert_eq!(svg.matches("fill=\"#CDDCF0\" stroke").count(), 2);
        let place = |what: &str| texts(&svg).into_iter().find(|(words, _)| words == what).unwrap().1;
        let (controller, encoder, note) = (place("controller"), place("encoder"), place("what encoder does"));
        assert!(controller[3] < encoder[1] && (encoder[1] - note[1]).abs() < 1e-9 && encoder[2] < note[0]);
    }
}
