//! All outputs of a capture as one text, natively and on wasm32.
//!
//! The interface of the wasm module is plain C: [`reserve`] says where the capture is to be written, [`decode`] decodes it and
//! says where the text is, [`length`] how long that is.
#![allow(
    unsafe_code,
    reason = "a function is exported under its own name by an unsafe attribute; there is no unsafe block"
)]

use std::cell::RefCell;
use std::fmt::Write as _;
use std::io;
use std::rc::Rc;
use std::sync::Mutex;

use servowire_decode::capture::{self, Hints, Input};
use servowire_decode::output::Output;
use servowire_decode::output::json::JsonLines;
use servowire_decode::output::printer::Printer;
use servowire_decode::output::stats::Stats;
use servowire_decode::output::table::Csv;
use servowire_decode::output::text::Text;
use servowire_decode::output::vcd::VcdOut;
use servowire_decode::recognition::Note;
use servowire_decode::settings::Settings;

/// A buffer that its writer and its reader share.
#[derive(Clone, Default)]
struct Shared(Rc<RefCell<Vec<u8>>>);

impl io::Write for Shared {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.0.borrow_mut().extend_from_slice(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// What every output says of a capture called `name`, with what is said beside it and how it ends.
#[must_use]
pub fn outputs(name: &str, bytes: &[u8]) -> String {
    let mut all = String::new();
    let printed = [
        ("text", |out| Box::new(Text::new(out).with_headings()) as Box<dyn Printer>),
        ("json", |out| Box::new(JsonLines::new(out))),
        ("csv", |out| Box::new(Csv::new(out))),
        ("stats", |out| Box::new(Stats::new(out, Some(100)))),
        ("stats json", |out| Box::new(Stats::new(out, None).in_json())),
    ] as [(&str, fn(Shared) -> Box<dyn Printer>); 5];
    for (what, printer) in printed {
        let out = Shared::default();
        let end = one(name, bytes, printer(out.clone()).as_mut(), None);
        let _ = write!(all, "=== {what}: {end}\n{}", String::from_utf8_lossy(&out.0.borrow()));
    }
    let (out, beside) = (Shared::default(), Shared::default());
    let end = one(name, bytes, &mut JsonLines::new(out), Some(&mut VcdOut::new(beside.clone())));
    let _ = write!(all, "=== vcd: {end}\n{}", String::from_utf8_lossy(&beside.0.borrow()));
    all
}

/// Decodes once; notes and fault.
fn one(name: &str, bytes: &[u8], printer: &mut dyn Printer, vcd: Option<&mut dyn Printer>) -> String {
    let said = RefCell::new(String::new());
    let notes = |note: &Note| {
        let _ = writeln!(said.borrow_mut(), "{note}");
    };
    let end = capture::open(Input::seeking(name, io::Cursor::new(bytes.to_vec())), Hints::default()).map(|capture| {
        let mut out = Output::new(name, printer).with_notes(&notes).with_beside(vcd.map(|vcd| vcd as &mut dyn Printer));
        let end = servowire_decode::decode(name, capture, None, &Settings::default(), &mut out);
        (out.end().is_ok(), end.map_err(|stop| stop.to_string()), out.refusals())
    });
    format!("{end:?}\n{}", said.borrow())
}

static CAPTURE: Mutex<Vec<u8>> = Mutex::new(Vec::new());
static TEXT: Mutex<String> = Mutex::new(String::new());

/// Room for a name and a capture of `length` bytes.
#[unsafe(no_mangle)]
pub extern "C" fn reserve(length: usize) -> *mut u8 {
    let mut capture = CAPTURE.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
    *capture = vec![0; length];
    capture.as_mut_ptr()
}

/// Decodes what was written; the first `name` bytes are its name. Where the text is.
#[unsafe(no_mangle)]
pub extern "C" fn decode(name: usize) -> *const u8 {
    let capture = std::mem::take(&mut *CAPTURE.lock().unwrap_or_else(std::sync::PoisonError::into_inner));
    let (name, bytes) = capture.split_at_checked(name).unwrap_or_default();
    let mut text = TEXT.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
    *text = outputs(&String::from_utf8_lossy(name), bytes);
    text.as_ptr()
}

/// Bytes of the text.
#[unsafe(no_mangle)]
pub extern "C" fn length() -> usize {
    TEXT.lock().unwrap_or_else(std::sync::PoisonError::into_inner).len()
}
