//! Times of transactions, by hand: 4 Mbit/s, 18 bits are 4.5 us; by default 500 ns of latency, 500 ns of idle time in a response,
//! 250 us of waiting, 4 us between two responses, 10 us up to the next request.

use nikon_aformat::bus::{Addresses, Outcome};
use nikon_aformat::master::{BusTransaction, Cycle, Exchange, Line, PeriodTooShort, Progress, Transaction};
use nikon_aformat::{
    BitRate, Command, Data, Doubt, EncoderAddress, EncoderStatus, Error, Operation, Policy, Request, Resolution,
    Response, Sample, U40,
};

pub(crate) const LINE: Line = Line::new(BitRate::Mbit4);
pub(crate) const FRAME_NS: u64 = 4_500;
/// 4.5 us of request, 250 us, a response of 18 us with three pauses of 500 ns, 500 ns of latency.
const UNTIL_NS: u64 = 4_500 + 250_000 + 19_500 + 500;
/// The same with seven more responses and 4 us after each.
const BUS_UNTIL_NS: u64 = UNTIL_NS + 7 * (19_500 + 4_000);

pub(crate) fn ea(address: u8) -> EncoderAddress {
    EncoderAddress::truncate(address)
}

pub(crate) fn response(command: Command, address: u8, abs: u64) -> Response {
    Response::new(ea(address), command, EncoderStatus::empty(), Data::Abs40 { abs: U40::truncate(abs) })
}

/// The frames of a response to command 0 or 4. None but the first begins with a response's sync code.
fn frames(command: Command, address: u8) -> Vec<u16> {
    let contents = response(command, address, 0).emit().contents().to_vec();
    assert_eq!(contents.iter().map(|content| content & 7 == 4).collect::<Vec<_>>(), [true, false, false, false]);
    contents
}

pub(crate) fn start(line: Line) -> Transaction {
    Transaction::start(Request::new(ea(3), Operation::Abs40), Resolution::default(), line, 0)
}

/// Frames one by one, the first start bit at `begin_ns`.
fn feed(transaction: &mut Transaction, contents: &[u16], begin_ns: u64) -> Progress<Exchange> {
    for (k, content) in (1..).zip(contents) {
        let _ = transaction.hear(&[Some(*content)], begin_ns + k * FRAME_NS);
    }
    transaction.progress()
}

pub(crate) fn ended(mut transaction: Transaction) -> Result<Response, Error> {
    match transaction.poll(u64::MAX) {
        Progress::Done { value, .. } => Ok(value.response),
        Progress::Failed { error, .. } => Err(error),
        Progress::Pending { .. } => panic!("the time is over"),
    }
}

/// Not sooner than the latency budget, or the least turn-around time, after the request.
#[test]
fn when_a_response_may_begin() {
    for (line, first_ns) in [
        (LINE, 5_000),
        (LINE.with_hand_over_ns(0), 4_500),
        (LINE.with_turn_around_ns(2_000), 6_500),
        (LINE.with_turn_around_ns(200), 5_000),
    ] {
        for (begin_ns, taken) in [(first_ns, true), (first_ns - 1, false)] {
            let mut transaction = start(line);
            let _ = feed(&mut transaction, &frames(Command::Abs40, 3), begin_ns);
            let want = if taken { Ok(response(Command::Abs40, 3, 0)) } else { Err(Error::NoResponse) };
            assert_eq!(ended(transaction), want, "{begin_ns}");
            // In one block, with the time of its end only.
            let mut transaction = start(line);
            let block: Vec<_> = frames(Command::Abs40, 3).into_iter().map(Some).collect();
            let _ = transaction.hear(&block, begin_ns + 4 * FRAME_NS);
            assert_eq!(ended(transaction), want, "{begin_ns} in a block");
            // Of a response that is cut off.
            let mut transaction = start(line);
            let _ = feed(&mut transaction, &frames(Command::Abs40, 3)[..2], begin_ns);
            let cut = if taken { Error::Truncated { got: 36, want: 72 } } else { Error::NoResponse };
            assert_eq!(ended(transaction), Err(cut), "{begin_ns} and cut off");
        }
    }
}

/// A block that is known to have begun after the request may be told to end too early, and may go on after the response.
#[test]
fn what_is_known_of_the_begin_of_a_block() {
    let whole: Vec<_> = frames(Command::Abs40, 3).into_iter().map(Some).collect();
    let more = [&whole[..], &[Some(0)]].concat();
    for (block, since_ns, end_ns, taken) in [
        (&whole, 4_500, 22_500, true),
        (&whole, 4_499, 22_999, false),
        (&more, 4_500, 200_000, true),
        (&more, 4_499, 200_000, false),
    ] {
        let mut transaction = start(LINE);
        let _ = transaction.hear_since(block, since_ns, end_ns);
        assert_eq!(ended(transaction).is_ok(), taken, "{since_ns} {end_ns} {}", block.len());
    }
}

/// Of two responses in a block nobody knows which one answers; of several encoders that all answer the first is taken.
#[test]
fn two_responses_in_a_block() {
    let (first, second) = (response(Command::Abs40, 3, 1), response(Command::Abs40, 3, 2));
    let block: Vec<_> = [first, second].iter().flat_map(|r| r.emit().contents().to_vec()).map(Some).collect();
    let mut transaction = start(LINE);
    let _ = transaction.hear_since(&block, 4_500, 100_000);
    assert_eq!(ended(transaction), Err(Error::TwoResponses));

    let all = [response(Command::Abs40Mt, 0, 7), response(Command::Abs40Mt, 1, 8)];
    let block: Vec<_> = all.iter().flat_map(|r| r.emit().contents().to_vec()).map(Some).collect();
    let request = Request::new(EncoderAddress::MAX, Operation::Abs40Mt);
    let mut first = Transaction::start(request, Resolution::default(), LINE, 0);
    let _ = first.hear_since(&block, 4_500, 100_000);
    assert_eq!(ended(first), Ok(all[0]));
}

/// Two frames belong together if the stamps leave at most the idle time in a response and the latency between them.
#[test]
fn pauses_in_a_response() {
    let contents = frames(Command::Abs40, 3);
    for (pause_ns, fault) in [(1_000, None), (1_001, Some(Error::Truncated { got: 36, want: 72 }))] {
        for blocks in [false, true] {
            let mut transaction = start(LINE);
            let _ = feed(&mut transaction, &contents[..2], 8_000);
            let rest_ns = 8_000 + 2 * FRAME_NS + pause_ns;
            if blocks {
                let _ = transaction.hear(&[Some(contents[2]), Some(contents[3])], rest_ns + 2 * FRAME_NS);
            } else {
                let _ = feed(&mut transaction, &contents[2..], rest_ns);
            }
            assert_eq!(ended(transaction).err(), fault, "{pause_ns}");
        }
    }
    // 2 us are allowed.
    let mut transaction = start(LINE.with_idle_in_response_ns(2_000));
    let _ = feed(&mut transaction, &contents[..1], 8_000);
    assert!(matches!(feed(&mut transaction, &contents[1..], 8_000 + FRAME_NS + 2_500), Progress::Done { .. }));
}

/// 274.5 us after its start a transaction is over; the line is free 10 us later.
#[test]
fn when_it_is_over() {
    let mut silent = start(LINE);
    let pending = Progress::Pending { until_ns: UNTIL_NS + 1 };
    assert_eq!((silent.progress(), silent.poll(UNTIL_NS)), (pending, pending));
    let failed = Progress::Failed { error: Error::NoResponse, ready_ns: UNTIL_NS + 10_000 };
    assert_eq!((silent.poll(UNTIL_NS + 1), silent.progress()), (failed, failed));
    // What has ended stays so.
    assert_eq!(feed(&mut silent, &frames(Command::Abs40, 3), 8_000), failed);

    let value = Exchange { response: response(Command::Abs40, 3, 0), sampled_ns: 4_500, began_ns: 8_000 };
    let done = Progress::Done { value, ready_ns: 8_000 + 18_000 + 10_000 };
    let mut answered = start(LINE);
    assert_eq!(feed(&mut answered, &frames(Command::Abs40, 3), 8_000), done);
    assert_eq!((answered.poll(u64::MAX), feed(&mut answered, &frames(Command::Abs40, 3), 90_000)), (done, done));

    // Of several encoders it takes the first; the others may still speak.
    let request = Request::new(EncoderAddress::MAX, Operation::Abs40Mt);
    let mut first = Transaction::start(request, Resolution::default(), LINE, 0);
    let end = feed(&mut first, &frames(Command::Abs40Mt, 3), 8_000);
    // 26 us, seven turns of 23.5 us, 500 ns of latency.
    assert!(matches!(end, Progress::Done { ready_ns: 201_000, .. }), "{end:?}");
    let mut late = Transaction::start(request, Resolution::default(), LINE, 0);
    let end = feed(&mut late, &frames(Command::Abs40Mt, 3), 900_000);
    assert!(matches!(end, Progress::Done { ready_ns: 928_000, .. }), "{end:?}");
}

/// The own request is no response, whenever it is heard; a damaged one does not end it, and is told if nothing better comes.
#[test]
fn what_is_passed_over() {
    let own = Request::new(ea(3), Operation::Abs40).emit().as_slice()[0].content();
    let contents = frames(Command::Abs40, 3);
    for echo_ns in [4_500, 9_000, 100_000] {
        let mut transaction = start(LINE);
        let _ = transaction.hear(&[Some(own)], echo_ns);
        assert_eq!(ended(transaction), Err(Error::NoResponse));
        let _ = feed(&mut transaction, &contents, echo_ns + 3_000);
        assert!(ended(transaction).is_ok());
    }
    let damaged = [contents[0], contents[1] ^ 0x10, contents[2], contents[3]];
    let mut transaction = start(LINE);
    let _ = feed(&mut transaction, &damaged, 8_000);
    let pending = Progress::Pending { until_ns: UNTIL_NS + 1 };
    assert_eq!(transaction.progress(), pending);
    let mut hopeless = transaction;
    let end = hopeless.poll(UNTIL_NS + 1);
    assert!(matches!(end, Progress::Failed { error: Error::Crc { .. }, ready_ns } if ready_ns == UNTIL_NS + 10_000));
    let _ = feed(&mut transaction, &frames(Command::Abs40, 5), 60_000);
    // The first fault is told.
    assert!(matches!(ended(transaction), Err(Error::Crc { .. })));
    assert!(matches!(feed(&mut transaction, &contents, 100_000), Progress::Done { .. }));

    let mut other = start(LINE);
    let _ = feed(&mut other, &frames(Command::Abs40, 5), 60_000);
    assert_eq!(ended(other), Err(Error::AddressMismatch { got: 5, want: 3 }));
}

/// A delimiter that reads 0 is a fault of the response if its frame began after the request; it ends what had begun.
#[test]
fn framing_errors() {
    let contents = frames(Command::Abs40, 3);
    for (end_ns, fault) in [(9_499, Error::NoResponse), (9_500, Error::Delimiter { frame: 0 })] {
        let mut transaction = start(LINE);
        let _ = transaction.framing_error(end_ns);
        assert_eq!(ended(transaction), Err(fault));
        let mut transaction = start(LINE);
        let since_ns = end_ns - 5_000;
        let _ = transaction.hear_since(&[None, Some(0)], since_ns, 200_000);
        assert_eq!(ended(transaction), Err(fault));
    }
    for whole in 0..4 {
        let mut transaction = start(LINE);
        let _ = feed(&mut transaction, &contents[..whole], 8_000);
        let _ = transaction.framing_error(8_000 + (whole as u64 + 1) * FRAME_NS);
        // What comes after it is no continuation.
        let _ = feed(&mut transaction, &contents[whole..], 8_000 + (whole as u64 + 1) * FRAME_NS);
        let end = ended(transaction);
        match whole {
            0 => assert!(end.is_ok()),
            _ => assert_eq!(end, Err(Error::Delimiter { frame: whole as u8 })),
        }
    }
}

/// Commands of version 3.0 are not sent to an encoder of version 2.1.
#[test]
fn a_request_of_another_version_is_not_sent() {
    let request = Request::new(EncoderAddress::MAX, Operation::Abs24VelMt);
    let resolution = Resolution::new(20, 16).unwrap();
    let mut one = Transaction::start(request, resolution, LINE, 77);
    assert!(matches!(one.poll(u64::MAX), Progress::Failed { error: Error::UnsupportedInVersion { .. }, ready_ns: 77 }));
    let mut bus = BusTransaction::start(request, resolution, Addresses::ALL, LINE, 77);
    assert!(matches!(bus.poll(u64::MAX), Progress::Failed { error: Error::UnsupportedInVersion { .. }, ready_ns: 77 }));
}

pub(crate) fn bus(asked: u8, line: Line) -> BusTransaction {
    let request = Request::new(EncoderAddress::MAX, Operation::Abs40Mt);
    BusTransaction::start(request, Resolution::default(), Addresses::from_bits(asked), line, 0)
}

/// The response of one encoder, its first start bit at `begin_ns`.
fn speaks(bus: &mut BusTransaction, address: u8, begin_ns: u64) -> Progress<()> {
    for (k, content) in (1..).zip(frames(Command::Abs40Mt, address)) {
        let _ = bus.hear(&[Some(content)], begin_ns + k * FRAME_NS);
    }
    bus.progress()
}

/// A bus is done when all that were asked have been heard, whoever else speaks; each of the others may have its turn of 23.5 us
/// after that, and 500 ns until it is handed over.
#[test]
fn a_bus_ends_by_its_addresses() {
    let pending = |until_ns| Progress::Pending { until_ns };
    let done = |ready_ns| Progress::Done { value: (), ready_ns };
    let mut all = bus(0b110, LINE);
    assert_eq!(speaks(&mut all, 0, 8_000), pending(26_000 + 7 * 23_500 + 501));
    assert_eq!(speaks(&mut all, 1, 30_000), pending(48_000 + 6 * 23_500 + 501));
    // Each is there as soon as it has come.
    assert_eq!(all.exchange(ea(1)).map(|exchange| exchange.began_ns), Some(30_000));
    let mut lost = all;
    assert_eq!(speaks(&mut all, 2, 52_000), done(70_000 + 5 * 23_500 + 10_500));
    let read = |bus: &BusTransaction, address| {
        bus.exchange(ea(address)).map(|exchange| (exchange.sampled_ns, exchange.began_ns))
    };
    assert_eq!(read(&all, 1), Some((4_500, 30_000)));
    assert_eq!(read(&all, 2), Some((4_500, 52_000)));
    assert_eq!((read(&all, 0), all.bus().of(ea(0))), (None, Outcome::Extra(response(Command::Abs40Mt, 0, 0))));
    // It has ended: nothing is taken any more.
    assert_eq!(speaks(&mut all, 2, 80_000), done(198_000));
    assert!(all.bus().duplicates().is_empty());

    assert_eq!(lost.poll(189_500), pending(189_501));
    assert_eq!((lost.poll(189_501), lost.bus().missing().bits()), (done(199_500), 0b100));
    // Nobody is asked.
    assert_eq!(bus(0, LINE).progress(), Progress::Done { value: (), ready_ns: 0 });
}

/// Eight encoders at 16 Mbit/s, 1.5 us between two of them: when the last has spoken the line is free but for the pause before
/// the next request, and a cycle lasts 60 us. Of four at 2.5 Mbit/s one is dead: the others do not wait for its time-out.
#[test]
fn a_cycle_ends_when_all_have_spoken() {
    let frames = |ea| response(Command::Abs40Mt, ea, 5).emit().contents().to_vec();
    let run = |rate: BitRate, line: Line, asked: Addresses, there: &[u8], gap_ns: u64| {
        let request = Request::new(asked.highest().unwrap(), Operation::Abs40Mt);
        let mut bus = BusTransaction::start(request, Resolution::default(), asked, line, 0);
        let mut at_ns = bus.transmission().end_ns + 3_000;
        for ea in there {
            for content in frames(*ea) {
                at_ns += u64::from(rate.bits_ns(18));
                let _ = bus.hear(&[Some(content)], at_ns);
            }
            at_ns += gap_ns;
        }
        let Progress::Done { ready_ns, .. } = (match bus.progress() {
            Progress::Pending { until_ns } => bus.poll(until_ns),
            end => end,
        }) else {
            panic!("{bus:?}")
        };
        (at_ns - gap_ns, ready_ns, bus.bus().missing().bits())
    };
    let fast = Line::new(BitRate::Mbit16);
    let all = run(BitRate::Mbit16, fast, Addresses::ALL, &[0, 1, 2, 3, 4, 5, 6, 7], 1_500);
    // 1.125 us of request, 3 us, eight responses of 4.5 us, seven pauses; 10 us.
    assert_eq!(all, (50_625, 60_625, 0));
    let slow = Line::new(BitRate::Mbit2_5).with_highest(ea(3));
    let (last_ns, ready_ns, missing) = run(BitRate::Mbit2_5, slow, Addresses::first(4), &[0, 1, 3], 3_000);
    // One turn: four frames of 7.2 us with three pauses of 0.75 us, 6 us before it; 0.75 us of latency, 10 us.
    assert_eq!((ready_ns - last_ns, missing), (28_800 + 2_250 + 6_000 + 750 + 10_000, 0b100));
}

/// A time-out that is over before a response can begin by its stamp.
#[test]
fn absurd_lines_are_refused() {
    let request = Request::new(ea(3), Operation::Abs40);
    for (line, refused) in [
        (LINE.with_response_timeout_ns(499), true),
        (LINE.with_response_timeout_ns(500), false),
        (LINE.with_turn_around_ns(250_001), true),
        (LINE.with_turn_around_ns(250_000), false),
        (LINE.with_hand_over_ns(250_001), true),
    ] {
        let one = Transaction::start(request, Resolution::default(), line, 77);
        let want = Progress::Failed { error: Error::Line, ready_ns: 77 };
        assert_eq!(one.progress() == want, refused, "{line:?}");
        let all = BusTransaction::start(request, Resolution::default(), Addresses::ALL, line, 77);
        assert_eq!(all.progress() == Progress::Failed { error: Error::Line, ready_ns: 77 }, refused, "{line:?}");
    }
}

/// The wait is sized for the highest address on the line, and for that of those who are asked.
#[test]
fn how_long_a_bus_waits() {
    let until = |asked, line| match bus(asked, line).progress() {
        Progress::Pending { until_ns } => until_ns - 1,
        end => panic!("{end:?}"),
    };
    assert_eq!(until(1, LINE), BUS_UNTIL_NS);
    let short = LINE.with_highest(ea(1));
    assert_eq!((until(1, short), until(0b11, short)), (UNTIL_NS + 23_500, UNTIL_NS + 23_500));
    assert_eq!(until(0b10_0001, short), UNTIL_NS + 5 * 23_500);
}

/// Damaged responses and pieces cost one response each, also the last one, which the time-out ends.
#[test]
fn a_bus_counts_what_is_damaged() {
    let mut bus = bus(0b111, LINE);
    let _ = bus.hear(&[Some(frames(Command::Abs40Mt, 0)[0])], 20_000);
    let _ = bus.framing_error(20_000 + FRAME_NS);
    assert_eq!(bus.bus().damaged(), 1);
    let _ = speaks(&mut bus, 1, 40_000);
    let _ = bus.hear(&[Some(frames(Command::Abs40Mt, 2)[0])], 80_000);
    let _ = bus.poll(u64::MAX);
    assert_eq!((bus.bus().damaged(), bus.bus().missing().bits()), (2, 0b101));
}

/// The second frame of this response looks like the first one of another: what follows it after a pause, damaged or not, does not
/// make it the beginning of a damaged response.
#[test]
fn what_a_good_response_holds_is_not_damaged() {
    let first = response(Command::Abs40Mt, 0, 4).emit().contents().to_vec();
    assert_eq!(first.iter().map(|content| content & 7 == 4).collect::<Vec<_>>(), [true, true, false, false]);
    let second = frames(Command::Abs40Mt, 1);
    for broken in [false, true] {
        let request = Request::new(ea(1), Operation::Abs40Mt);
        let mut bus = BusTransaction::start(request, Resolution::default(), Addresses::first(2), LINE, 0);
        let hear = |bus: &mut BusTransaction, contents: &[u16], begin_ns: u64| {
            for (k, content) in (1..).zip(contents) {
                let _ = bus.hear(&[Some(*content)], begin_ns + k * FRAME_NS);
            }
        };
        hear(&mut bus, &first, 10_000);
        let behind_ns = 10_000 + 4 * FRAME_NS + 4_000;
        if broken {
            let _ = bus.framing_error(behind_ns + FRAME_NS);
            let _ = bus.poll(u64::MAX);
        } else {
            hear(&mut bus, &second, behind_ns);
        }
        assert_eq!((bus.bus().damaged(), bus.exchange(ea(0)).is_some()), (u8::from(broken), true), "{broken}");
        assert_eq!(bus.exchange(ea(1)).is_some(), !broken);
    }
}

/// Two responses in one block that began after the request; the first of them follows a piece of another one.
#[test]
fn several_responses_in_a_block() {
    let piece = frames(Command::Abs40Mt, 0)[..2].to_vec();
    let block: Vec<_> =
        [piece, frames(Command::Abs40Mt, 1), frames(Command::Abs40Mt, 2)].concat().into_iter().map(Some).collect();
    let mut bus = bus(0b110, LINE);
    let end = bus.hear_since(&block, 4_500, 100_000);
    assert!(matches!(end, Progress::Done { .. }), "{end:?}");
}

/// A millisecond old may be used where a millisecond is allowed.
#[test]
fn the_age_of_a_position() {
    let resolution = Resolution::default();
    let exchange = Exchange { response: response(Command::Abs40, 3, 77), sampled_ns: 4_500, began_ns: 8_000 };
    let policy = Policy::new(1_000_000);
    let evidence = exchange.evidence(resolution);
    let at = |now_ns| evidence.at(now_ns, policy).map(Sample::single_turn);
    assert_eq!((at(0), at(1_004_500), at(1_004_501)), (Ok(77), Ok(77), Err(Doubt::Old { age_ns: 1_000_001 })));
    assert_eq!(evidence.at(1_004_500, policy).map(Sample::sampled_ns), Ok(4_500));
}

/// The grid of a period stands still.
#[test]
fn cycles() {
    assert_eq!(Cycle::new(99, 100, 0), Err(PeriodTooShort { period_ns: 99, min_ns: 100 }));
    assert_eq!(Cycle::new(0, 0, 0), Err(PeriodTooShort { period_ns: 0, min_ns: 0 }));
    let mut cycle = Cycle::new(100, 100, 1_000).unwrap();
    assert!(!cycle.is_due(999));
    assert_eq!((cycle.next_ns(), cycle.missed()), (1_000, 0));
    assert!(cycle.is_due(1_000));
    assert_eq!((cycle.next_ns(), cycle.missed()), (1_100, 0));
    // Late by less than a period: the next start is on the grid.
    assert!(cycle.is_due(1_199));
    assert_eq!((cycle.next_ns(), cycle.missed()), (1_200, 0));
    assert!(cycle.is_due(1_450));
    assert_eq!((cycle.next_ns(), cycle.missed()), (1_500, 2));
    assert!(cycle.is_due(1_700));
    assert_eq!((cycle.next_ns(), cycle.missed()), (1_800, 4));
}

/// In the same place as in a new one, after whatever was before; nobody was asked before the first.
#[test]
fn a_transaction_begins_anew_in_its_place() {
    let (resolution, line) = (Resolution::default(), Line::new(BitRate::Mbit4));
    let one = Request::new(ea(0), Operation::Abs40);
    let mut place = Transaction::idle();
    assert_eq!(place.poll(u64::MAX), Progress::Failed { error: Error::NoResponse, ready_ns: 0 });
    let data = Data::Abs40 { abs: U40::truncate(77) };
    let answer = Response::new(ea(0), Command::Abs40, EncoderStatus::empty(), data).emit().units();
    for start_ns in [0, 1_000_000] {
        place.restart(one, resolution, line, start_ns);
        let mut new = Transaction::start(one, resolution, line, start_ns);
        assert_eq!(place, new);
        assert_eq!((place.outcome(), Progress::Pending { until_ns: place.until_ns() }), (None, new.progress()));
        let heard = place.push(answer.as_slice(), start_ns + 100_000).copied();
        let Progress::Done { value, ready_ns } = new.hear(answer.as_slice(), start_ns + 100_000) else { panic!() };
        assert_eq!((heard, place.until_ns(), place), (Some(Ok(value)), ready_ns, new));
    }
    let all = Request::new(EncoderAddress::truncate(1), Operation::Abs40Mt);
    let mut place = BusTransaction::idle();
    assert_eq!(place.poll(u64::MAX), Progress::Done { value: (), ready_ns: 0 });
    for start_ns in [0, 1_000_000] {
        place.restart(all, resolution, Addresses::first(2), line, start_ns);
        let mut new = BusTransaction::start(all, resolution, Addresses::first(2), line, start_ns);
        assert_eq!((place, place.outcome()), (new, None));
        for (k, ea) in [(1, 0), (2, 1)] {
            let response = Response::new(EncoderAddress::truncate(ea), Command::Abs40Mt, EncoderStatus::empty(), data);
            let units = response.emit().units();
            let heard = place.push(units.as_slice(), start_ns + 100_000 * k);
            let progress = new.hear(units.as_slice(), start_ns + 100_000 * k);
            assert_eq!((place, heard), (new, (k == 2).then_some(Ok(()))));
            assert!(match progress {
                Progress::Pending { until_ns } => heard.is_none() && until_ns == place.until_ns(),
                Progress::Done { ready_ns, .. } => heard.is_some() && ready_ns == place.until_ns(),
                Progress::Failed { .. } => false,
            });
        }
    }
}
