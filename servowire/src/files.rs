//! Opens files and the standard input for reading captures.

use std::fs::File;
use std::io::{self, BufReader, IsTerminal};
use std::path::Path;
use std::time::Duration;

use servowire_decode::capture::Input;
use servowire_decode::fault::{At, Fault};

use crate::pipe::Pipe;

/// How long a pipe may be silent if `-` was not given.
const PATIENCE: Duration = Duration::from_millis(400);

/// The state of the standard input if `-` was not given.
pub(crate) enum Piped {
    /// A terminal, or at its end.
    Nothing,
    /// A pipe that is open but delivers nothing for the moment.
    Silence,
    /// There is something to read.
    Content(Input),
}

/// The name of the standard input.
const STDIN: &str = "standard input";

/// Opens `path`, or the standard input for `-`. `grows`: wait for more data at its end.
pub(crate) fn open(path: &Path, grows: bool) -> Result<Input, Fault> {
    let name = path.display().to_string();
    if path.as_os_str() == "-" {
        return Ok(Input::live(STDIN, Pipe::over(io::stdin(), false)));
    }
    let fault = |e: &io::Error| Fault::new(&name, At::File, format!("cannot be opened: {}", plain(e)));
    let file = File::open(path).map_err(|e| fault(&e))?;
    let data = file.metadata().map_err(|e| fault(&e))?;
    if data.is_dir() {
        return Err(Fault::new(&name, At::File, "is a folder; name the capture files in it"));
    }
    if grows || !data.is_file() {
        return Ok(Input::live(&name, Pipe::over(file, grows)));
    }
    Ok(Input::seeking(&name, BufReader::new(file)))
}

/// Returns the input from a pipe or a redirected file. `wanted`: wait for it, however long it takes.
pub(crate) fn piped(wanted: bool) -> Piped {
    if io::stdin().is_terminal() {
        return Piped::Nothing;
    }
    let mut pipe = Pipe::over(io::stdin(), false);
    loop {
        match (pipe.gives_within(PATIENCE), pipe.is_over()) {
            (true, true) => return Piped::Nothing,
            (true, false) => return Piped::Content(Input::live(STDIN, pipe)),
            (false, _) if wanted => {}
            (false, _) => return Piped::Silence,
        }
    }
}

/// Returns the system's message without its error number.
fn plain(error: &io::Error) -> String {
    let text = error.to_string();
    text.split(" (os error").next().unwrap_or(&text).to_lowercase()
}
