//! A plan as a drawing: a row for each who, time to the right.

use std::fmt::Write;

use super::Plan;

const WIDTH: f64 = 900.0;
const LEFT: f64 = 110.0;
const ROW: f64 = 46.0;
const TOP: f64 = 50.0;

/// The plan as SVG.
pub(super) fn svg(plan: &Plan) -> String {
    let mut rows: Vec<&str> = Vec::new();
    for bar in &plan.bars {
        if !rows.contains(&bar.who) {
            rows.push(bar.who);
        }
    }
    let begin = plan.bars.iter().map(|bar| bar.start_ns).min().unwrap_or(0);
    let end = plan.bars.iter().map(|bar| bar.end_ns).max().unwrap_or(1).max(begin + 1);
    let x = |ns: i64| LEFT + (ns - begin) as f64 * (WIDTH - LEFT - 20.0) / (end - begin) as f64;
    let height = TOP + ROW * rows.len() as f64 + 40.0;
    let mut out = String::new();
    let mut line = |text: String| {
        // Writing to a string does not fail.
        let _ = writeln!(out, "{text}");
    };
    line(format!(
        r#"<svg xmlns="http://www.w3.org/2000/svg" width="{WIDTH}" height="{height}" font-family="sans-serif" font-size="12">"#
    ));
    line(format!(r#"<text x="10" y="22" font-size="15">{}</text>"#, plan.title));
    for (at, who) in rows.iter().enumerate() {
        let y = TOP + ROW * at as f64;
        line(format!(r#"<text x="10" y="{:.1}">{who}</text>"#, y + 18.0));
        for bar in plan.bars.iter().filter(|bar| bar.who == *who && bar.end_ns > bar.start_ns) {
            let (from, to) = (x(bar.start_ns), x(bar.end_ns));
            let (width, colour) = (to - from, if *who == "line" { "#dddddd" } else { "#9fc5e8" });
            line(format!(
                r##"<rect x="{from:.1}" y="{y:.1}" width="{width:.1}" height="26" fill="{colour}" stroke="#333333"><title>{}: {:.2} to {:.2} us</title></rect>"##,
                bar.what,
                bar.start_ns as f64 / 1000.0,
                bar.end_ns as f64 / 1000.0
            ));
            line(format!(r#"<text x="{from:.1}" y="{:.1}" font-size="10">{}</text>"#, y + 38.0, bar.what));
        }
    }
    let axis = TOP + ROW * rows.len() as f64 + 10.0;
    for ns in [begin, 0, end] {
        let at = x(ns);
        line(format!(
            r#"<text x="{at:.1}" y="{:.1}" text-anchor="middle">{:.1} us</text>"#,
            axis + 18.0,
            ns as f64 / 1000.0
        ));
    }
    line("</svg>".to_owned());
    out
}

#[cfg(test)]
mod tests {
    use super::super::Bar;
    use super::*;

    #[test]
    fn every_bar_is_drawn_in_its_place() {
        let bar = |who, start_ns, end_ns| Bar { who, what: format!("{who} {start_ns}"), start_ns, end_ns };
        let bars = vec![bar("controller", 0, 4_000), bar("encoder", 7_000, 11_000), bar("controller", 11_000, 11_000)];
        let plan = Plan { title: "a plan".to_owned(), bars, cycle_ns: 12_000, fault_ns: 20_000 };
        let svg = svg(&plan);
        assert!(svg.starts_with("<svg") && svg.ends_with("</svg>\n"), "{svg}");
        // An empty bar is not drawn; 7 of 11 us lie left of the encoder's.
        assert_eq!(svg.matches("<rect").count(), 2);
        assert!(svg.contains(r#"<rect x="600.0" y="96.0" width="280.0""#), "{svg}");
    }
}
