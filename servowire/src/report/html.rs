//! Writes a report as a page: one self-contained file, for a screen and for paper.

use std::fmt::Write as _;
use std::time::{Duration, UNIX_EPOCH};

use servowire_decode::event::{Place, Verdict};
use servowire_decode::output::stats::Table;
use servowire_decode::time::{SECOND, Time};

use super::Report;
use crate::drawing::{Drawn, Sheet, Wave};
use crate::explain::heading;

/// An instant from the year 2000 onwards is counted from 1970.
const DATED: i128 = 946_684_800 * SECOND as i128;

const STYLE: &str = "
:root { color-scheme: light dark }
body { font: 15px/1.45 sans-serif; color: #191919; background: #fff; margin: 2em auto; max-width: 1040px; padding: 0 1em }
h1 { font-size: 1.5em } h2 { font-size: 1.2em; margin-top: 2em; border-bottom: 1px solid #999 } h3 { font-size: 1em }
table { border-collapse: collapse; width: 100%; font-size: 0.93em }
td, th { text-align: left; vertical-align: top; padding: 0.15em 0.8em 0.15em 0; border-bottom: 1px solid #ddd }
th { white-space: nowrap; font-weight: 600 } td { overflow-wrap: anywhere }
.at { white-space: nowrap; text-align: right } thead { display: table-header-group }
figure { margin: 0 0 1.5em } svg { max-width: 100%; height: auto } code { overflow-wrap: anywhere }
.bad { color: #b00020 } .good { color: #006b3a }
@media screen and (prefers-color-scheme: dark) {
  body { color: #e4e4e4; background: #16191d } td, th { border-color: #3a4048 } .bad { color: #ff7a85 } .good { color: #5bd69a }
}
@media print {
  body { margin: 0; max-width: none; font-size: 11px } h2 { break-after: avoid } figure, svg, tr { break-inside: avoid }
}
";

/// Writes the whole page.
pub(super) fn page(report: &Report) -> Drawn<String> {
    let mut out = String::new();
    let title = format!("Report of {}", report.file);
    // A String takes everything.
    let _ = write!(
        out,
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n<title>{0}</title>\n<style>{STYLE}</style>\n\
         </head>\n<body>\n<h1>{0}</h1>\n",
        escaped(&title)
    );
    verdict(report, &mut out);
    rows("The capture", &about(report), &mut out);
    found(report, &mut out);
    figures(report, &mut out);
    let _ = write!(out, "<h2>Position, delays and errors</h2>\n<figure>{}</figure>\n", report.picture);
    damage(report, &mut out)?;
    events(report, &mut out);
    out.push_str("</body>\n</html>\n");
    Ok(out)
}

/// Writes the summary for a reader who reads nothing else.
fn verdict(report: &Report, out: &mut String) {
    let sentences: Vec<&String> = report.read.fault.iter().chain(&report.read.refusals).collect();
    if sentences.is_empty() {
        out.push_str("<p class=\"good\">All frames hold.</p>\n");
    }
    for sentence in sentences {
        let _ = writeln!(out, "<p class=\"bad\">{}</p>", escaped(sentence));
    }
}

fn about(report: &Report) -> Vec<(&'static str, String)> {
    let mut rows = vec![
        ("file", report.file.clone()),
        ("size", format!("{} bytes", report.bytes)),
        ("SHA-256", report.sha256.clone()),
    ];
    if let Some(date) = &report.read.date {
        rows.push(("recorded", format!("{date} (as the file says, which names no time zone unless it stands there)")));
    }
    if let Some((first, last)) = report.extent {
        if let Some(date) = dated(first) {
            rows.push(("first frame", date));
            rows.push(("last frame", dated(last).unwrap_or_default()));
        } else {
            rows.push(("first frame", format!("{:.3} us of the capture, which has no date", first.us())));
        }
        rows.push(("length", format!("{:.6} s", (last - first) as f64 / SECOND as f64)));
    }
    rows.push(("read by", format!("servowire {}", env!("CARGO_PKG_VERSION"))));
    rows.push(("called as", report.call.clone()));
    rows
}

/// Returns the instant in UTC, if it is counted from 1970.
fn dated(time: Time) -> Option<String> {
    let seconds = u64::try_from(time.ps() / i128::from(SECOND)).ok().filter(|_| time.ps() >= DATED)?;
    let instant = UNIX_EPOCH.checked_add(Duration::from_secs(seconds))?;
    Some(format!("{} (UTC)", humantime::format_rfc3339_seconds(instant)))
}

fn rows(title: &str, rows: &[(&str, String)], out: &mut String) {
    let _ = writeln!(out, "<h2>{}</h2>\n<table>", escaped(title));
    for (what, text) in rows {
        let _ = writeln!(out, "<tr><th>{}</th><td>{}</td></tr>", escaped(what), escaped(text));
    }
    out.push_str("</table>\n");
}

/// Writes the lines, and the sentences of the recognition: wiring, rate, polarity.
fn found(report: &Report, out: &mut String) {
    rows("What was found", &report.lines, out);
    for note in &report.read.notes {
        let _ = writeln!(out, "<p>{}</p>", escaped(note));
    }
}

fn figures(report: &Report, out: &mut String) {
    for Table { speaker, rows: figures } in &report.tables {
        let title = if speaker.is_empty() { "Figures".to_owned() } else { format!("Figures of {speaker}") };
        rows(&title, figures, out);
    }
}

/// Draws each kind of damage once, as it looks on the line.
fn damage(report: &Report, out: &mut String) -> Drawn {
    if report.refused == 0 {
        return Ok(());
    }
    out.push_str("<h2>Each kind of damage, once</h2>\n");
    let mut any = false;
    for clip in report.scope.clips() {
        any = true;
        let wave = Wave::new(clip.clone());
        let title = clip.refusal().map_or("", |refusal| refusal.class);
        let mut sheet = Sheet::new(title, wave.width());
        sheet.panel(wave.height(), wave);
        let _ = writeln!(out, "<figure>{}<figcaption>{}</figcaption></figure>", sheet.svg()?, escaped(&heading(clip)));
    }
    if !any {
        out.push_str("<p>The capture has no levels that could be drawn.</p>\n");
    }
    Ok(())
}

fn events(report: &Report, out: &mut String) {
    if report.refused == 0 {
        return;
    }
    let _ = write!(
        out,
        "<h2>What was refused</h2>\n<table>\n<thead><tr><th class=\"at\">at</th><th>encoder</th><th>frame</th><th>class</th>\
         <th>reason</th></tr></thead>\n"
    );
    for listed in &report.listed {
        let Verdict::Refused(refusal) = &listed.event.verdict else { continue };
        let at = match listed.event.place {
            Place::Time { start, .. } => format!("{:.3} us", start.us()),
            Place::Line(line) => format!("line {line}"),
        };
        let place = refusal.field.as_ref().map_or(String::new(), |field| format!(" in {field}"));
        let cause = refusal.cause.as_ref().map_or(String::new(), |cause| format!(" ({cause})"));
        let reason = format!("{}{cause}", refusal.reason);
        let _ = writeln!(
            out,
            "<tr><td class=\"at\">{at}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td></tr>",
            escaped(&listed.encoder),
            escaped(&listed.event.kind),
            escaped(&format!("{}{place}", refusal.class)),
            escaped(&reason)
        );
    }
    out.push_str("</table>\n");
    let more = report.refused - report.listed.len();
    if more > 0 {
        let _ = writeln!(out, "<p>And {more} more.</p>");
    }
}

/// Escapes text for HTML.
fn escaped(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '&' => out.push_str("&amp;"),
            '"' => out.push_str("&quot;"),
            c if c.is_control() => out.push(' '),
            c => out.push(c),
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dates_are_those_of_utc() {
        assert_eq!(dated(Time::from_ps(1_700_000_000 * i128::from(SECOND))).unwrap(), "2023-11-14T22:13:20Z (UTC)");
        assert_eq!(dated(Time::from_ps(5)), None);
    }

    #[test]
    fn nothing_of_a_capture_is_taken_for_the_page() {
        assert_eq!(escaped("<a href=\"x\">&\u{1b}</a>"), "&lt;a href=&quot;x&quot;&gt;&amp; &lt;/a&gt;");
    }
}
