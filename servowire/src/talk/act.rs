//! The commands.

use std::fmt;
use std::fs;
use std::io::{self, BufRead, IsTerminal, Write};
use std::path::Path;
use std::process::ExitCode;
use std::thread;
use std::time::{Duration, Instant};

use tformat::master::{EEPROM_POLLING, EepromAccess, Reset};
use tformat::{
    Address, AllData, Almc, BitRate, Evidence, Hint, Page, Policy, Request, Resolution, Response, Tolerated,
};

use super::Watch;
use super::fault::Fault;
use super::link::Link;
use super::port::{self, Port};
use super::relay::{self, Said};
use crate::terminal;

/// Bytes of a page; the address after them selects the page.
const PAGE_LEN: u8 = 127;

type Done = Result<ExitCode, Fault>;

/// Says something to the user. Who reads no further has read enough.
fn say(text: fmt::Arguments) -> Result<(), Fault> {
    terminal::say(text).map_err(Fault::Output)
}

fn read_data<P: Port>(link: &mut Link<P>) -> Result<AllData, Fault> {
    match link.exchange(Request::ReadAll)? {
        Response::ReadAll(all) => Ok(all),
        _ => Err(Fault::Input("the answer is to another request".to_owned())),
    }
}

pub(super) fn read<P: Port>(link: &mut Link<P>) -> Done {
    say(format_args!("{}\n", line(&read_data(link)?)))?;
    Ok(ExitCode::SUCCESS)
}

/// It was read just now, and the alarms stand beside it.
const SHOWN: Policy = Policy::new(0).tolerating(Tolerated::NOTHING.alarms(Almc::all()));

/// Position, turns and alarms in words.
fn line(all: &AllData) -> String {
    let place = match Resolution::from_enid(all.enid) {
        Some(Hint { resolution, .. }) => match Evidence::of(Response::ReadAll(*all), resolution, 0).at(0, SHOWN) {
            Ok(sample) => {
                let (counts, turns) = (sample.single_turn(), sample.turns().unwrap_or(0));
                let degrees = f64::from(counts) * 360.0 / f64::from(resolution.counts_per_turn());
                format!("{degrees:>10.5} deg  {counts:>8} counts  turn {turns}")
            }
            Err(doubt) => format!("ABS {} ABM {}: {doubt}", all.abs, all.abm),
        },
        None => format!("ABS {} ABM {} (encoder ID {:#04x} says nothing of their widths)", all.abs, all.abm, all.enid),
    };
    let alarms = if all.almc.is_empty() { "no alarms".to_owned() } else { format!("alarms {}", all.almc) };
    format!("{place}  {alarms}")
}

pub(super) fn watch<P: Port>(link: &mut Link<P>, watch: &Watch) -> Done {
    let mut csv = table(watch.csv.as_deref(), &["time_s", "abs", "abm", "almc", "fault"])?;
    let (mut good, mut bad, begin) = (0_u64, 0_u64, Instant::now());
    let (mut gone, mut out) = (None, io::stdout());
    // Over the line before, to the end of the line; in a file or pipe a line each.
    let (from, to) = if out.is_terminal() { ("\r", "\x1b[K") } else { ("", "\n") };
    while watch.count.is_none_or(|count| good + bad < count) {
        let reading = match read_data(link) {
            Err(fault @ (Fault::Io(_) | Fault::Port(_))) => {
                gone = Some(fault);
                break;
            }
            reading => reading,
        };
        let time = begin.elapsed().as_secs_f64();
        let (text, record) = match &reading {
            Ok(all) => {
                good += 1;
                (
                    line(all),
                    [all.abs.to_string(), all.abm.to_string(), format!("{:#04x}", all.almc.bits()), String::new()],
                )
            }
            Err(fault) => {
                bad += 1;
                (fault.to_string(), [String::new(), String::new(), String::new(), fault.to_string()])
            }
        };
        if let Some((csv, path)) = &mut csv {
            let record = std::iter::once(format!("{time:.6}")).chain(record);
            csv.write_record(record).map_err(io::Error::from).map_err(Fault::file(path))?;
        }
        let errors = bad as f64 * 100.0 / (good + bad) as f64;
        match write!(out, "{from}{text}  {errors:.1} % errors{to}").and_then(|()| out.flush()) {
            Err(error) if error.kind() == io::ErrorKind::BrokenPipe => break,
            written => written.map_err(Fault::Output)?,
        }
        thread::sleep(Duration::from_millis(watch.period));
    }
    let end = if from.is_empty() { "" } else { "\n" };
    say(format_args!("{end}{good} good, {bad} refused or missing\n"))?;
    if let Some((mut csv, path)) = csv {
        csv.flush().map_err(Fault::file(path))?;
    }
    match gone {
        Some(fault) => Err(fault),
        None if bad == 0 => Ok(ExitCode::SUCCESS),
        None => Ok(ExitCode::FAILURE),
    }
}

/// A table in this file, if there is one.
fn table<'p>(path: Option<&'p Path>, head: &[&str]) -> Result<Option<(csv::Writer<fs::File>, &'p Path)>, Fault> {
    let Some(path) = path else { return Ok(None) };
    let mut csv = csv::Writer::from_writer(fs::File::create(path).map_err(Fault::file(path))?);
    csv.write_record(head).map_err(io::Error::from).map_err(Fault::file(path))?;
    Ok(Some((csv, path)))
}

/// Between a master and its encoder, for ever.
pub(super) fn relay<M: Port, E: Port>(
    master: M,
    encoder: &mut Link<E>,
    hears_itself: bool,
    csv: Option<&Path>,
) -> Result<(), Fault> {
    let mut csv = table(csv, &["time_s", "request", "answer", "fault"])?;
    let begin = Instant::now();
    let log = |said: &Said| {
        let (request, answer, fault) = match said {
            Said::Request(request, Ok(answer)) => (request.to_string(), answer.to_string(), String::new()),
            Said::Request(request, Err(fault)) => (request.to_string(), String::new(), fault.to_string()),
            Said::Junk(bytes) => (String::new(), String::new(), format!("no request: {bytes:02x?}")),
        };
        let time = format!("{:.6}", begin.elapsed().as_secs_f64());
        say(format_args!("{time}  {request}  {answer}{fault}\n"))?;
        if let Some((csv, path)) = &mut csv {
            csv.write_record([time, request, answer, fault]).map_err(io::Error::from).map_err(Fault::file(path))?;
            csv.flush().map_err(Fault::file(path))?;
        }
        Ok(())
    };
    relay::run(master, encoder, hears_itself, log, None)
}

pub(super) fn info<P: Port>(link: &mut Link<P>, name: &str, rate: BitRate) -> Done {
    let all = read_data(link)?;
    let widths = match Resolution::from_enid(all.enid) {
        Some(hint) if hint.documented => {
            format!("{} bits a turn, {} of turns", hint.resolution.abs_bits(), hint.resolution.abm_bits())
        }
        Some(hint) => {
            format!("probably {} bits a turn, {} of turns", hint.resolution.abs_bits(), hint.resolution.abm_bits())
        }
        None => "not documented".to_owned(),
    };
    say(format_args!("encoder ID {:#04x}: {widths}\n", all.enid))?;
    say(format_args!("{}\n", line(&all)))?;
    say(format_args!("the adapter {}\n", if link.echo() { "hears itself" } else { "does not hear itself" }))?;
    for line in port::about(name, rate) {
        say(format_args!("{line}\n"))?;
    }
    Ok(ExitCode::SUCCESS)
}

pub(super) fn clear_errors<P: Port>(link: &mut Link<P>) -> Done {
    let before = read_data(link)?.almc;
    link.run(Reset::clear_errors())?;
    let after = read_data(link)?.almc;
    say(format_args!("alarms before: {}; after: {}\n", name(before), name(after)))?;
    Ok(if after.is_empty() { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}

fn name(almc: tformat::Almc) -> String {
    if almc.is_empty() { "none".to_owned() } else { almc.to_string() }
}

fn page(number: u8) -> Result<Page, Fault> {
    Page::new(number).ok_or_else(|| Fault::Input(format!("there is no page {number}")))
}

/// The bytes of a page. The procedure looks at the selection before and after each.
fn read_page<P: Port>(link: &mut Link<P>, number: u8) -> Result<Vec<u8>, Fault> {
    let page = page(number)?;
    let read = |address| {
        link.run(EepromAccess::read(page, Address::truncate(address), EEPROM_POLLING)).map_err(|fault| match fault {
            Fault::Encoder(tformat::Error::DataMismatch { got, .. }) => {
                Fault::Input(format!("the encoder stays on page {got}: it has no page {number}"))
            }
            fault => fault,
        })
    };
    (0..PAGE_LEN).map(read).collect()
}

pub(super) fn dump<P: Port>(link: &mut Link<P>, file: Option<&Path>, pages: u8) -> Done {
    let mut lines = Vec::new();
    for number in 0..pages {
        let bytes = read_page(link, number)?;
        let hex: Vec<_> = bytes.iter().map(|byte| format!("{byte:02x}")).collect();
        lines.push(format!("{number}: {}\n", hex.join(" ")));
    }
    let text = lines.concat();
    match file {
        Some(file) => fs::write(file, text).map_err(Fault::file(file))?,
        None => say(format_args!("{text}"))?,
    }
    Ok(ExitCode::SUCCESS)
}

/// The pages of a dump.
fn parse(text: &str) -> Result<Vec<(u8, Vec<u8>)>, Fault> {
    let page = |(at, line): (usize, &str)| {
        let wrong = |what: &str| Fault::Input(format!("line {}: {what}", at + 1));
        let (number, bytes) = line.split_once(": ").ok_or_else(|| wrong("no page number"))?;
        let number = number.parse().map_err(|_| wrong("no page number"))?;
        let bytes: Result<Vec<u8>, _> = bytes.split_whitespace().map(|byte| u8::from_str_radix(byte, 16)).collect();
        let bytes = bytes.map_err(|_| wrong("not a byte in hex"))?;
        if bytes.len() != usize::from(PAGE_LEN) {
            return Err(wrong(&format!("{} bytes instead of {}", bytes.len(), PAGE_LEN)));
        }
        Ok((number, bytes))
    };
    let pages: Vec<_> = text.lines().enumerate().map(page).collect::<Result<_, Fault>>()?;
    if pages.is_empty() { Err(Fault::Input("there is no page in it".to_owned())) } else { Ok(pages) }
}

pub(super) fn restore<P: Port>(link: &mut Link<P>, file: &Path, yes: bool) -> Done {
    let text = fs::read_to_string(file).map_err(Fault::file(file))?;
    let pages = parse(&text).map_err(|fault| Fault::File(format!("{}: {fault}", file.display())))?;
    let all = read_data(link)?;
    if !yes && !confirmed(all.enid)? {
        return Err(Fault::Input("nothing was written".to_owned()));
    }
    let mut written = 0;
    let done = pages.into_iter().try_for_each(|page| write_page(link, page, &mut written));
    let plural = if written == 1 { " was" } else { "s were" };
    let said = if done.is_err() {
        say(format_args!("broken off: {written} byte{plural} written and read back, one more may be; restore again\n"))
    } else {
        say(format_args!("{written} byte{plural} different, written and read back\n"))
    };
    done.and(said).map(|()| ExitCode::SUCCESS)
}

/// Writes the bytes of a page that differ, and counts them.
fn write_page<P: Port>(link: &mut Link<P>, (number, want): (u8, Vec<u8>), written: &mut u32) -> Result<(), Fault> {
    let (have, page) = (read_page(link, number)?, page(number)?);
    for ((address, want), have) in (0..PAGE_LEN).zip(want).zip(have) {
        if want != have {
            let _ = link.run(EepromAccess::write(page, Address::truncate(address), want, EEPROM_POLLING))?;
            *written += 1;
        }
    }
    Ok(())
}

fn confirmed(enid: u8) -> Result<bool, Fault> {
    say(format_args!("The EEPROM of encoder ID {enid:#04x} will be overwritten. Type yes: "))?;
    let mut answer = String::new();
    io::stdin()
        .lock()
        .read_line(&mut answer)
        .map_err(|error| Fault::Input(format!("no answer can be read: {error}")))?;
    Ok(answer.trim() == "yes")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dumps_are_read_back() {
        let bytes: Vec<_> = (0..127_u8).map(|byte| format!("{byte:02x}")).collect();
        let text = format!("3: {}\n", bytes.join(" "));
        assert_eq!(parse(&text).unwrap(), [(3, (0..127).collect())]);
        for wrong in ["", "3 00", "x: 00", "3: 0g", "3: 00 01"] {
            assert!(parse(wrong).is_err(), "{wrong}");
        }
    }
}
