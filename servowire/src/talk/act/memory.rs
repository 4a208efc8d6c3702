//! Backs up and restores the memory.

use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use serde_json::json;

use super::{Done, Print, confirm};
use crate::talk::backup::Backup;
use crate::talk::encoder::{Encoder, Written};
use crate::talk::fault::Fault;
use crate::talk::port::Port;
use crate::terminal;

pub(in crate::talk) fn backup<P: Port>(encoder: &mut Encoder<P>, file: Option<&Path>, pages: u8, print: Print) -> Done {
    let Some(file) = file else {
        let backup = encoder.backup(pages)?;
        terminal::say(format_args!("{}", backup.emit())).map_err(Fault::Output)?;
        return Ok(ExitCode::SUCCESS);
    };
    // Before minutes of reading.
    if file.exists() {
        return Err(exists(file));
    }
    let backup = encoder.backup(pages)?;
    store(&backup, file)?;
    let said = format!("{pages} pages of encoder ID {:#04x} are in {}", backup.encoder_id(), file.display());
    print.say(said, || json!({ "encoder_id": backup.encoder_id(), "pages": pages, "backup": file }))?;
    Ok(ExitCode::SUCCESS)
}

/// Writes a backup into a new file and flushes it to disk.
fn store(backup: &Backup, file: &Path) -> Result<(), Fault> {
    let mut out = match fs::File::create_new(file) {
        Err(error) if error.kind() == std::io::ErrorKind::AlreadyExists => return Err(exists(file)),
        opened => opened.map_err(Fault::file(file))?,
    };
    out.write_all(backup.emit().as_bytes()).and_then(|()| out.sync_all()).map_err(Fault::file(file))
}

fn exists(file: &Path) -> Fault {
    Fault::File(format!("{}: the file already exists; backups are not overwritten", file.display()))
}

pub(in crate::talk) fn restore<P: Port>(
    encoder: &mut Encoder<P>,
    file: &Path,
    before: Option<&Path>,
    yes: bool,
    print: Print,
) -> Done {
    let wrong = |what| Fault::File(format!("{}: {what}", file.display()));
    let text = fs::read_to_string(file).map_err(Fault::file(file))?;
    let want = Backup::parse(&text).map_err(|error| wrong(format!("this is not a backup: {error}")))?;
    let restore = encoder.plan(&want)?;
    let count = restore.changes().len();
    if count == 0 {
        print.say("the memory already holds this: nothing was written", || json!({ "written": 0 }))?;
        return Ok(ExitCode::SUCCESS);
    }
    let before = before.map_or_else(|| beside(file, restore.before()), Path::to_owned);
    let question = format!(
        "The EEPROM of encoder ID {:#04x} will be overwritten, {count} bytes of it. What it holds goes into {} first.",
        want.encoder_id(),
        before.display()
    );
    confirm(yes, &question)?;
    let mut kept = false;
    let Written { bytes, end } = encoder.write(&restore, |backup| {
        store(backup, &before)?;
        kept = true;
        Ok(())
    });
    let broken_off = if end.is_err() { "broken off: " } else { "" };
    let text = format!(
        "{broken_off}{bytes} of {count} bytes that differed were written and read back; the previous content is in {}",
        before.display()
    );
    if kept {
        print.say(text, || json!({ "written": bytes, "differed": count, "backup": before }))?;
    }
    end.map(|()| ExitCode::SUCCESS)
}

/// Returns where the memory is saved before it is overwritten: beside the file, with the time.
fn beside(file: &Path, before: &Backup) -> PathBuf {
    let name = file.file_stem().unwrap_or_default().to_string_lossy();
    file.with_file_name(format!("{name}.before-{}.json", before.date().replace(':', "-")))
}
