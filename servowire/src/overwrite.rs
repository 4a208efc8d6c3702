//! Refuses to write over a file that a command reads, or twice into one file.

use std::fs;
use std::path::{Path, PathBuf};

/// A file that is read: what it is, such as "the capture", and where.
pub(crate) type Source<'a> = (&'a str, &'a Path);

/// A file that is written, if it is asked for: by which option, and where.
pub(crate) type Target<'a> = (&'a str, Option<&'a Path>);

/// Returns what to say if an output is a file that is read, that of another output, or no file.
pub(crate) fn refusal(sources: &[Source], targets: &[Target]) -> Option<String> {
    let asked = targets.iter().filter_map(|(option, path)| path.map(|path| (*option, path)));
    let mut before: Vec<(&str, &Path)> = Vec::new();
    for (option, path) in asked {
        if path.as_os_str() == "-" {
            return Some(format!(
                "{option} writes a file, and not the standard output: name one, or ./- for that name"
            ));
        }
        let place = Place::of(path);
        let same = |other: &Path| place.is_some() && Place::of(other) == place;
        if let Some((what, _)) = sources.iter().find(|(_, source)| same(source)) {
            return Some(format!("{option} would overwrite {what} {}", path.display()));
        }
        if let Some((other, _)) = before.iter().find(|(_, other)| same(other)) {
            return Some(format!("{other} and {option} would both write {}", path.display()));
        }
        before.push((option, path));
    }
    None
}

/// A file, by whatever name.
#[derive(Debug, PartialEq, Eq)]
enum Place {
    /// The numbers of device and file.
    #[cfg(unix)]
    Numbers(u64, u64),
    Path(PathBuf),
}

impl Place {
    /// `None` for what is no file, such as a terminal, and where no file can be.
    fn of(path: &Path) -> Option<Self> {
        // Where a file is redirected to the standard input.
        let path = if path.as_os_str() == "-" { Path::new("/dev/stdin") } else { path };
        match fs::metadata(path) {
            Ok(data) if !data.is_file() => None,
            #[cfg(unix)]
            Ok(data) => {
                use std::os::unix::fs::MetadataExt as _;
                Some(Self::Numbers(data.dev(), data.ino()))
            }
            #[cfg(not(unix))]
            Ok(_) => path.canonicalize().ok().map(Self::Path),
            Err(_) => yet_to_be(path).map(Self::Path),
        }
    }
}

/// Returns the full path of a file that does not exist yet, perhaps behind a link.
fn yet_to_be(path: &Path) -> Option<PathBuf> {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let path = match path.read_link() {
        Ok(link) => folder.join(link),
        Err(_) => path.to_owned(),
    };
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    Some(folder.canonicalize().ok()?.join(path.file_name()?))
}
