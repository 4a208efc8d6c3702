//! From folders of vector files to counted verdicts.

use std::fmt;
use std::fs;
use std::path::{Path, PathBuf};

use serde_json::{Map, Value};

use crate::protocols;
use crate::row::{Fault, Row, Verdict};

/// What came of one vector file.
#[derive(Debug, Clone)]
pub struct Topic {
    /// Folder name of the protocol.
    pub protocol: &'static str,
    /// File name without `.jsonl`.
    pub topic: String,
    /// Rows that passed.
    pub passed: usize,
    /// Rows that failed.
    pub failures: Vec<Failure>,
}

impl fmt::Display for Topic {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}: {} passed, {} failed", self.protocol, self.topic, self.passed, self.failures.len())
    }
}

/// A row that failed.
#[derive(Debug, Clone)]
pub struct Failure {
    /// Line in the file, from 1.
    pub line: usize,
    /// The row's name; empty if it has none.
    pub name: String,
    fault: Fault,
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "line {}", self.line)?;
        if !self.name.is_empty() {
            write!(f, ", {}", self.name)?;
        }
        f.write_str(": ")?;
        match &self.fault {
            Fault::Unreadable(why) => write!(f, "row cannot be read: {why}"),
            Fault::Differs { what, expected, real } => {
                write!(f, "{what} differs\n      expected: {expected}\n      real:     {real}")
            }
        }
    }
}

/// Why a folder or a file could not be run at all.
#[derive(Debug)]
pub enum RunError {
    /// A file or folder cannot be read.
    Io(PathBuf, std::io::Error),
    /// There is nothing to run: a run without rows proves nothing.
    NoFiles(PathBuf),
    /// No protocol of this name is known.
    UnknownProtocol(String),
    /// The protocol has no topic of this name.
    UnknownTopic(PathBuf, &'static str),
    /// The file has no row beside its `about` line.
    NoRows(PathBuf),
    /// A line is not a JSON object, or its name is not a string.
    Line(PathBuf, usize, String),
}

impl std::error::Error for RunError {}

impl fmt::Display for RunError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Io(path, e) => write!(f, "{}: {e}", path.display()),
            Self::NoFiles(path) => write!(f, "{}: no vector files (*.jsonl) here", path.display()),
            Self::UnknownProtocol(name) => {
                write!(f, "protocol {name:?} is not known; known are: {}", protocols::names().join(", "))
            }
            Self::UnknownTopic(path, protocol) => {
                write!(
                    f,
                    "{}: {protocol} has no topic of this name; it has: {}",
                    path.display(),
                    protocols::topics(protocol).join(", ")
                )
            }
            Self::NoRows(path) => write!(f, "{}: no rows", path.display()),
            Self::Line(path, line, why) => write!(f, "{}, line {line}: {why}", path.display()),
        }
    }
}

/// All that a run found.
#[derive(Debug, Default)]
pub struct Report {
    /// A file each.
    pub topics: Vec<Topic>,
    /// Files and folders that could not be run.
    pub errors: Vec<RunError>,
}

impl Report {
    /// Whether every row of every file passed, and there was at least one.
    pub fn passed(&self) -> bool {
        self.errors.is_empty() && !self.topics.is_empty() && self.topics.iter().all(|t| t.failures.is_empty())
    }
}

/// Runs `dir/<protocol>/*.jsonl` for every folder in `dir`.
pub fn run_all(dir: &Path) -> Report {
    let mut report = Report::default();
    match entries(dir) {
        Err(e) => report.errors.push(e),
        Ok(paths) => {
            for path in paths.iter().filter(|p| p.is_dir()) {
                let name = path.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
                report.add(run_protocol(&name, path));
            }
            if report.topics.is_empty() && report.errors.is_empty() {
                report.errors.push(RunError::NoFiles(dir.to_owned()));
            }
        }
    }
    report
}

/// Runs `dir/*.jsonl` as vectors of `protocol`.
pub fn run_protocol(protocol: &str, dir: &Path) -> Report {
    let mut report = Report::default();
    let Some(&name) = protocols::names().iter().find(|n| **n == protocol) else {
        report.errors.push(RunError::UnknownProtocol(protocol.to_owned()));
        return report;
    };
    let files = match entries(dir) {
        Ok(paths) => paths.into_iter().filter(|p| p.extension().is_some_and(|e| e == "jsonl")).collect::<Vec<_>>(),
        Err(e) => {
            report.errors.push(e);
            return report;
        }
    };
    if files.is_empty() {
        report.errors.push(RunError::NoFiles(dir.to_owned()));
    }
    for file in files {
        match run_file(name, &file) {
            Ok(topic) => report.topics.push(topic),
            Err(e) => report.errors.push(e),
        }
    }
    report
}

impl Report {
    fn add(&mut self, mut other: Self) {
        self.topics.append(&mut other.topics);
        self.errors.append(&mut other.errors);
    }
}

/// Keys that any row may have and that state nothing to check.
const PROSE: [&str; 2] = ["note", "source"];

fn entries(dir: &Path) -> Result<Vec<PathBuf>, RunError> {
    let fault = |e| RunError::Io(dir.to_owned(), e);
    let mut paths = Vec::new();
    for entry in fs::read_dir(dir).map_err(fault)? {
        paths.push(entry.map_err(fault)?.path());
    }
    paths.sort();
    Ok(paths)
}

fn run_file(protocol: &'static str, path: &Path) -> Result<Topic, RunError> {
    let topic = path.file_stem().map(|s| s.to_string_lossy().into_owned()).unwrap_or_default();
    let Some(check) = protocols::check(protocol, &topic) else {
        return Err(RunError::UnknownTopic(path.to_owned(), protocol));
    };
    let text = fs::read_to_string(path).map_err(|e| RunError::Io(path.to_owned(), e))?;
    let mut rows = Vec::new();
    for (line, text) in (1..).zip(text.lines()).filter(|(_, text)| !text.trim().is_empty()) {
        rows.extend(parse(path, line, text)?);
    }
    if rows.is_empty() {
        return Err(RunError::NoRows(path.to_owned()));
    }
    let verdicts = check(&rows);
    assert_eq!(verdicts.len(), rows.len(), "{protocol}/{topic}: a verdict a row");
    Ok(count(protocol, topic, rows, verdicts))
}

/// One line of a file; `None` for the `about` line.
fn parse(path: &Path, line: usize, text: &str) -> Result<Option<Row>, RunError> {
    let fault = |why: String| RunError::Line(path.to_owned(), line, why);
    let mut keys: Map<String, Value> =
        serde_json::from_str(text).map_err(|e| fault(format!("not a JSON object: {e}")))?;
    if keys.contains_key("about") {
        return Ok(None);
    }
    for prose in PROSE {
        keys.remove(prose);
    }
    match keys.remove("name").or_else(|| keys.remove("id")) {
        Some(Value::String(name)) => Ok(Some(Row { line, name, keys })),
        None => Ok(Some(Row { line, name: String::new(), keys })),
        Some(other) => Err(fault(format!("the name {other} is not a string"))),
    }
}

fn count(protocol: &'static str, topic: String, rows: Vec<Row>, verdicts: Vec<Verdict>) -> Topic {
    let mut result = Topic { protocol, topic, passed: 0, failures: Vec::new() };
    for (row, verdict) in rows.into_iter().zip(verdicts) {
        match verdict {
            Ok(()) => result.passed += 1,
            Err(fault) => result.failures.push(Failure { line: row.line, name: row.name, fault }),
        }
    }
    result
}
