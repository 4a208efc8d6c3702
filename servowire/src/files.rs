//! Opens files and the standard input for reading captures, and files to be written.

use std::fs::File;
use std::io::{self, BufReader, BufWriter, IsTerminal, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::time::Duration;

use servowire_decode::capture::Input;
use servowire_decode::fault::{At, Fault};

use crate::pipe::Pipe;

/// How long a pipe may be silent if `-` was not given.
const PATIENCE: Duration = Duration::from_millis(400);

/// The state of the standard input if `-` was not given.
pub(crate) enum Piped {
    /// A terminal, or `/dev/null`.
    Nothing,
    /// A file without content.
    EmptyFile,
    /// A pipe that has ended without content.
    EmptyPipe,
    /// A pipe that is open but delivers nothing for the moment.
    Silence,
    /// There is something to read.
    Content(Input),
}

/// The name of the standard input.
pub(crate) const STDIN: &str = "standard input";

/// Opens `path`, or the standard input for `-`. `grows`: wait for more data at its end.
pub(crate) fn open(path: &Path, grows: bool) -> Result<Input, Fault> {
    let name = path.display().to_string();
    if path.as_os_str() == "-" {
        return Ok(Input::live(STDIN, Pipe::over(io::stdin(), false)));
    }
    let file = open_file(path)?;
    if grows || !file.metadata().is_ok_and(|data| data.is_file()) {
        return Ok(Input::live(&name, Pipe::over(file, grows)));
    }
    Ok(Input::seeking(&name, BufReader::new(file)))
}

/// Opens a file to read, which is no folder.
pub(crate) fn open_file(path: &Path) -> Result<File, Fault> {
    let fault = |what: &str| Fault::new(&path.display().to_string(), At::File, what);
    let file = File::open(path).map_err(|e| fault(&format!("cannot be opened: {}", plain(&e))))?;
    if file.metadata().is_ok_and(|data| data.is_dir()) {
        return Err(fault("is a folder: name a file in it"));
    }
    Ok(file)
}

/// Returns what a standard input is that has ended at once.
#[cfg(unix)]
fn without_content() -> Piped {
    use std::os::fd::AsFd as _;
    use std::os::unix::fs::FileTypeExt as _;
    let input = io::stdin().as_fd().try_clone_to_owned();
    match input.and_then(|input| File::from(input).metadata()).map(|data| data.file_type()) {
        Ok(kind) if kind.is_file() => Piped::EmptyFile,
        Ok(kind) if kind.is_fifo() => Piped::EmptyPipe,
        _ => Piped::Nothing,
    }
}

/// Returns what a standard input is that has ended at once, which cannot be told here.
#[cfg(not(unix))]
fn without_content() -> Piped {
    Piped::Nothing
}

/// Returns the input from a pipe or a redirected file. `wanted`: wait for it, however long it takes.
pub(crate) fn piped(wanted: bool) -> Piped {
    if io::stdin().is_terminal() {
        return Piped::Nothing;
    }
    let mut pipe = Pipe::over(io::stdin(), false);
    loop {
        match (pipe.gives_within(PATIENCE), pipe.is_over()) {
            (true, true) => return without_content(),
            (true, false) => return Piped::Content(Input::live(STDIN, pipe)),
            (false, _) if wanted => {}
            (false, _) => return Piped::Silence,
        }
    }
}

/// Creates a file to write into; every error names it.
pub(crate) fn create(path: &Path) -> io::Result<BufWriter<Written>> {
    File::create(path).map(|file| written(path, file)).map_err(|e| named(path, &e))
}

/// A new file at that path; errors of writing name it.
pub(crate) fn written(path: &Path, file: File) -> BufWriter<Written> {
    BufWriter::new(Written { file, path: path.to_owned() })
}

/// A file that is named when it cannot be written.
#[derive(Debug)]
pub(crate) struct Written {
    file: File,
    path: PathBuf,
}

impl Write for Written {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.file.write(bytes).map_err(|e| named(&self.path, &e))
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.flush().map_err(|e| named(&self.path, &e))
    }
}

impl Seek for Written {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        self.file.seek(to).map_err(|e| named(&self.path, &e))
    }
}

fn named(path: &Path, error: &io::Error) -> io::Error {
    io::Error::new(error.kind(), format!("{}: {error}", path.display()))
}

/// Returns the system's message without its error number.
fn plain(error: &io::Error) -> String {
    let text = error.to_string();
    text.split(" (os error").next().unwrap_or(&text).to_lowercase()
}
