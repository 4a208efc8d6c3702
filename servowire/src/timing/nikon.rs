//! A-format: one encoder, or the encoders of a bus one after the other.
//!
//! The encoders and the master are those of the crate, each given the times at its own end of the cable, so the plan shows
//! what they do.

use std::error::Error;

use clap::Args;
use nikon_aformat::bus::Addresses;
use nikon_aformat::device::{Behaviour, Device};
use nikon_aformat::master::{BusTransaction, Line, Progress, Transaction};
use nikon_aformat::{
    BitRate, Command, EncoderAddress, EncoderId, FRAME_BITS, Operation, Request, Resolution, UserAddress,
};

use super::{Bar, LATE, Plan, SOON};
use crate::units::one_of;

/// Nikon A-format encoders, one or several on a bus.
#[derive(Debug, Args)]
pub(super) struct Arguments {
    /// Bits per second, 2.5M, 4M, 6.67M, 8M or 16M.
    #[arg(long, value_name = "HZ", default_value = "4M", value_parser = rate)]
    rate: BitRate,
    /// What to ask for, by name (ABS24_LOW) or code; ABS40 by default, ABS40_MT for several encoders.
    #[arg(long, value_name = "COMMAND", value_parser = command)]
    command: Option<Command>,
    /// The addresses of the encoders.
    #[arg(long, value_name = "LIST", default_value = "0", value_delimiter = ',', value_parser = clap::value_parser!(u8).range(0..=7))]
    addresses: Vec<u8>,
    /// Responses follow each other without a gap where an address is missing; by default each keeps the place of its address. No document says which.
    #[arg(long)]
    closed_up: bool,
    /// Length of the cable in metres, 5 ns a metre each way.
    #[arg(long, value_name = "M", default_value_t = 0)]
    cable: u16,
    /// From the end of the request to the first response, at the encoder, in ns. No document gives it; one vendor's simulated
    /// encoder waits 2800.
    #[arg(long, value_name = "NS", default_value_t = 2_800)]
    turn_around: u32,
    /// How long the controller waits for the start of the first response, in ns: 1000 bits by default.
    #[arg(long, value_name = "NS")]
    timeout: Option<u32>,
    /// From the end of the last response to its hand-over to the program, in ns.
    #[arg(long, value_name = "NS", default_value_t = 0)]
    latency: u32,
}

const ENCODERS: [&str; 8] =
    ["encoder 0", "encoder 1", "encoder 2", "encoder 3", "encoder 4", "encoder 5", "encoder 6", "encoder 7"];

fn rate(text: &str) -> Result<BitRate, String> {
    one_of(text, BitRate::ALL.into_iter().map(|rate| (rate, rate.bits_per_second())))
}

fn command(text: &str) -> Result<Command, String> {
    let named = Command::ALL.into_iter().find(|command| command.name().eq_ignore_ascii_case(text));
    let coded = text.parse().ok().and_then(Command::from_code);
    named.or(coded).ok_or_else(|| "a name such as ABS40 or STATUS_MT, or a code from 0 to 30".to_owned())
}

/// Returns any request with this command: arguments do not change the times.
fn operation(command: Command) -> Operation {
    let id = EncoderId::truncate(0);
    Operation::without_arguments(command).unwrap_or(match command {
        Command::EepromRead => Operation::EepromRead { address: 0 },
        Command::EepromWrite => Operation::EepromWrite { address: UserAddress::default(), data: 0 },
        Command::IdWrite1 => Operation::IdWrite1 { id },
        Command::IdWrite2 => Operation::IdWrite2 { id },
        _ => Operation::SetAddress2 { id },
    })
}

/// A response as the controller hears it.
struct Heard {
    who: &'static str,
    contents: Vec<u16>,
    start_ns: u64,
    end_ns: u64,
}

impl Arguments {
    pub(super) fn plan(&self) -> Result<Plan, Box<dyn Error>> {
        let rate = self.rate;
        let on_line = self.addresses.iter().fold(Addresses::NONE, |all, ea| all.with(EncoderAddress::truncate(*ea)));
        let highest = on_line.highest().ok_or("no address")?;
        let several = on_line.len() > 1;
        let command = self.command.unwrap_or(if several { Command::Abs40Mt } else { Command::Abs40 });
        if several && !command.is_multi_response() {
            return Err(format!("{command} addresses one encoder, but {} are named", on_line.len()).into());
        }
        let request = Request::new(highest, operation(command));
        let line = Line::new(rate).with_highest(highest);
        let line = line.with_response_timeout_ns(self.timeout.unwrap_or(line.response_timeout_ns));
        let asked_ns = u64::from(line.request_ns(request));
        let responses = self.responses(request, on_line, asked_ns);
        let (first, last) = (responses.first().ok_or("nobody answers")?, responses.last().ok_or("nobody answers")?);
        let handed_ns = last.end_ns + u64::from(self.latency);
        let (ready_ns, fault_ns) = free(request, on_line, line, &responses)?;

        let bar = |who, what: String, start_ns: u64, end_ns: u64| Bar {
            who,
            what,
            start_ns: start_ns.try_into().unwrap_or(i64::MAX),
            end_ns: end_ns.try_into().unwrap_or(i64::MAX),
        };
        let turn = format!("turn-around, {} m of cable there and back", self.cable);
        let mut bars = vec![
            bar("controller", format!("request, {} x 18 bits", request.emit().as_slice().len()), 0, asked_ns),
            bar("line", turn, asked_ns, first.start_ns),
        ];
        let layout = request.layout(Resolution::default());
        bars.extend(responses.iter().map(|response| {
            let what = format!("response {layout}, {} x 18 bits", response.contents.len());
            bar(response.who, what, response.start_ns, response.end_ns)
        }));
        bars.push(bar("controller", "hand-over".to_owned(), last.end_ns, handed_ns));
        let megabits = f64::from(rate.bits_per_second()) / 1e6;
        let title = format!("A-format, {command} at {} Mbit/s", (megabits * 100.0).round() / 100.0);
        Ok(Plan { title, bars, cycle_ns: ready_ns.max(handed_ns), fault_ns })
    }

    /// Returns the encoders' answers, in the order of time.
    fn responses(&self, request: Request, on_line: Addresses, asked_ns: u64) -> Vec<Heard> {
        let way_ns = 5 * u64::from(self.cable);
        let behaviour = Behaviour::new().with_response_delay_ns(self.turn_around);
        let mut heard: Vec<_> = (0..)
            .zip(on_line.iter())
            .filter_map(|(place, ea)| {
                let mut encoder = Device::<1>::new(ea, Resolution::default(), self.rate);
                encoder.set_behaviour(if self.closed_up { behaviour.with_place(Some(place)) } else { behaviour });
                let answer = encoder.hear(request.emit().units().as_slice(), asked_ns + way_ns)?;
                let contents = answer.frames.contents().to_vec();
                let (start_ns, end_ns) = (answer.start_ns + way_ns, answer.end_ns + way_ns);
                let who = ENCODERS.get(usize::from(ea.get())).copied()?;
                Some(Heard { who, contents, start_ns, end_ns })
            })
            .collect();
        heard.sort_by_key(|response| response.start_ns);
        heard
    }
}

/// Returns when the next request may be sent, after these responses and if nobody answers.
fn free(request: Request, on_line: Addresses, line: Line, responses: &[Heard]) -> Result<(u64, u64), Box<dyn Error>> {
    let frame_ns = u64::from(line.rate.bits_ns(FRAME_BITS));
    let frames = || {
        responses.iter().flat_map(move |heard| {
            (1..).zip(&heard.contents).map(move |(k, content)| (*content, heard.start_ns + k * frame_ns))
        })
    };
    // A controller looks at its clock until the first frame has come.
    let waited_ns = responses.first().map_or(0, |heard| heard.start_ns + frame_ns - 1);
    if request.command().is_multi_response() {
        let start = || BusTransaction::start(request, Resolution::default(), on_line, line, 0);
        let (mut heard, mut lost) = (start(), start());
        if !matches!(heard.poll(waited_ns), Progress::Pending { .. }) {
            return Err(LATE.into());
        }
        for (content, end_ns) in frames() {
            let _ = heard.hear(&[Some(content)], end_ns);
        }
        match (heard.progress(), lost.poll(u64::MAX)) {
            (Progress::Done { ready_ns, .. }, Progress::Done { ready_ns: fault_ns, .. }) => Ok((ready_ns, fault_ns)),
            _ => Err(SOON.into()),
        }
    } else {
        let start = || Transaction::start(request, Resolution::default(), line, 0);
        let (mut heard, mut lost) = (start(), start());
        if !matches!(heard.poll(waited_ns), Progress::Pending { .. }) {
            return Err(LATE.into());
        }
        for (content, end_ns) in frames() {
            let _ = heard.hear(&[Some(content)], end_ns);
        }
        match (heard.progress(), lost.poll(u64::MAX)) {
            (Progress::Done { ready_ns, .. }, Progress::Failed { ready_ns: fault_ns, .. }) => Ok((ready_ns, fault_ns)),
            _ => Err(SOON.into()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn arguments(rate: BitRate, addresses: &[u8]) -> Arguments {
        Arguments {
            rate,
            command: None,
            addresses: addresses.to_vec(),
            closed_up: false,
            cable: 0,
            turn_around: 2_800,
            timeout: None,
            latency: 0,
        }
    }

    fn spans(plan: &Plan, who: &str) -> Vec<(i64, i64)> {
        plan.bars.iter().filter(|bar| bar.who == who).map(|bar| (bar.start_ns, bar.end_ns)).collect()
    }

    /// Request and ABS40 on the line, 36 us at 2.5 Mbit/s and 5.625 us at 16, with 2.8 us between them, then 10 us of pause.
    #[test]
    fn one_encoder() {
        for (rate, asked, on_line) in [(BitRate::Mbit2_5, 7_200, 36_000), (BitRate::Mbit16, 1_125, 5_625)] {
            let plan = arguments(rate, &[0]).plan().unwrap();
            assert_eq!(spans(&plan, "encoder 0"), [(asked + 2_800, on_line + 2_800)]);
            assert_eq!(plan.cycle_ns, on_line as u64 + 2_800 + 10_000);
        }
        let far = Arguments { cable: 100, ..arguments(BitRate::Mbit2_5, &[0]) };
        assert_eq!(spans(&far.plan().unwrap(), "encoder 0"), [(11_000, 39_800)]);
        // 1000 bits of waiting and a response with idle time in it and 0.75 us of latency: 7.2 + 400 + 28.8 + 3 x 0.75 + 0.75 + 10.
        assert_eq!(far.plan().unwrap().fault_ns, 449_000);
        // Late, but not later than the pause.
        let slow = Arguments { latency: 30_000, ..arguments(BitRate::Mbit2_5, &[0]) };
        assert_eq!(slow.plan().unwrap().cycle_ns, 36_000 + 2_800 + 30_000);
    }

    /// A place of 72 bits and 1.5 us for each address at 16 Mbit/s, or only for those that are there.
    #[test]
    fn who_answers_when_on_a_bus() {
        let bus = arguments(BitRate::Mbit16, &[0, 2, 7]);
        let starts = |plan: &Plan| [0, 2, 7].map(|ea| spans(plan, ENCODERS[ea])[0].0);
        assert_eq!(starts(&bus.plan().unwrap()), [3_925, 15_925, 45_925]);
        let closed_up = Arguments { closed_up: true, ..bus };
        assert_eq!(starts(&closed_up.plan().unwrap()), [3_925, 9_925, 15_925]);
    }

    #[test]
    fn wrong_use_is_refused() {
        assert!(rate("4").is_err() && command("31").is_err() && command("ABS").is_err());
        assert_eq!(
            (rate("6.67M"), command("status_mt"), command("12")),
            (Ok(BitRate::Mbit6_67), Ok(Command::StatusMt), Ok(Command::ZeroPreset))
        );
        let one = Arguments { command: Some(Command::Abs40), ..arguments(BitRate::Mbit4, &[0, 1]) };
        assert!(one.plan().unwrap_err().to_string().contains("addresses one encoder"));
        let early = Arguments { turn_around: 100, ..arguments(BitRate::Mbit4, &[0]) };
        assert_eq!(early.plan().unwrap_err().to_string(), SOON);
        // 1000 bits at 4 Mbit/s are 250 us, and a response with idle time in it 20 us.
        for command in [Command::Abs40, Command::Abs40Mt] {
            let after = |turn_around| {
                let command = Some(command);
                Arguments { command, turn_around, ..arguments(BitRate::Mbit4, &[0]) }.plan()
            };
            assert!(after(249_000).is_ok() && after(300_000).unwrap_err().to_string() == LATE, "{command}");
        }
    }

    /// Every command has a plan, those with arguments too.
    #[test]
    fn every_command() {
        for command in Command::ALL {
            let plan = Arguments { command: Some(command), ..arguments(BitRate::Mbit8, &[0]) }.plan().unwrap();
            assert!(plan.title.contains(command.name()), "{}", plan.title);
            let frames = request_frames(command);
            assert!(plan.bars[0].what.contains(&format!("{frames} x 18")), "{plan}");
        }
    }

    fn request_frames(command: Command) -> u8 {
        match command.code() {
            13 => 2,
            14 | 18..=20 => 4,
            _ => 1,
        }
    }
}
