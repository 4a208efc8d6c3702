//! Facts about the world itself: what must hold whatever is sent through it.

use proptest::prelude::*;
use servowire_world::*;

const UART: Wire = Wire { bit_ps: 400_000, framing: Framing::StartStop { width: 8 }, devices: 2 };

fn planned(faults: &[(u16, u8, Fault)]) -> Scenario {
    let planned = faults.iter().map(|&(transmission, unit, fault)| Planned { transmission, unit, fault });
    Scenario { host: Host::IDEAL, script: Script::planned(planned.collect()) }
}

/// All events up to `until_ns`; device 0 answers every byte 0x55 with `answer` after 3 us.
fn run(world: &mut World, answer: &[u8], until_ns: u64) -> Vec<(u64, Event)> {
    let mut events = Vec::new();
    loop {
        let event = world.next(until_ns);
        if let Event::Heard { device: 0, unit } = &event {
            if unit.bits.content() == (0x55, true) && unit.origin.speaker == Speaker::Host {
                let message = Message::bytes(answer).tagged(7);
                world.answer(0, unit.origin.transmission, &message, unit.end_ns + 3_000);
            }
        }
        events.push((world.now_ns(), event));
        if let Some((_, Event::Time { .. })) = events.last() {
            return events;
        }
    }
}

fn given(events: &[(u64, Event)]) -> Vec<u8> {
    let blocks = events.iter().filter_map(|(_, e)| if let Event::Delivered(block) = e { Some(block) } else { None });
    blocks.flat_map(|block| block.bytes().map(|(byte, _)| byte).collect::<Vec<_>>()).collect()
}

/// An exchange on a line with these faults: what the host was given, and the world after it.
fn exchange(scenario: Scenario, answer: &[u8]) -> (Vec<u8>, World, Id) {
    let mut world = World::new(UART, scenario);
    let request = world.send(&Message::bytes(&[0x55]), 1_000);
    let events = run(&mut world, answer, 1_000_000);
    (given(&events), world, request)
}

#[test]
fn a_good_line_carries_everything_on_time() {
    let mut world = World::new(UART, Scenario::quiet());
    let request = world.send(&Message::bytes(&[0x55]), 1_000);
    let events = run(&mut world, &[1, 2], 100_000);
    let times: Vec<_> = events.iter().map(|(at, event)| (*at, matches!(event, Event::Delivered(_)))).collect();
    // ten bits of 400 ns to both devices, 3 us, then two bytes to the other device and to the host
    let want = [(5_000, false), (5_000, false), (12_000, false), (12_000, true), (16_000, false), (16_000, true)];
    assert_eq!(times, [&want[..], &[(100_000, false)]].concat());
    assert_eq!(given(&events), [1, 2]);
    let truth = world.truth();
    assert_eq!((truth.intact_answers(request).count(), truth.undisturbed(request)), (1, true));
    assert_eq!(truth.verdict(request, 7), Verdict::Fresh);
    assert_eq!(truth.verdict(request, 8), Verdict::Unknown);
    assert_eq!(truth.speaking_from(15_999).count(), 1);
    assert_eq!(truth.speaking_from(16_000).count(), 0);
}

#[test]
fn each_fault_does_what_it_says() {
    let hit = |fault| exchange(planned(&[(1, 1, fault)]), &[1, 2, 3]).0;
    assert_eq!(hit(Fault::Drop), [1, 3]);
    assert_eq!(hit(Fault::Repeat), [1, 2, 2, 3]);
    assert_eq!(hit(Fault::Flip { bit: 1 }), [1, 3, 3]);
    assert_eq!(hit(Fault::Idle { bits: 9 }), [1, 2, 3]);
    assert_eq!(hit(Fault::Cut), [1]);
    assert_eq!(hit(Fault::Delay { ns: 40_000 }), [1, 2, 3]);
    assert_eq!(hit(Fault::Miss { receiver: 0 }), [1, 3]);
    assert_eq!(hit(Fault::Miss { receiver: 1 }), [1, 2, 3]);
    assert_eq!(hit(Fault::Noise { after_ns: 5_000 }).len(), 4);
    assert_eq!(hit(Fault::Foreign { after_ns: 20_000, units: 2, replay: false }).len(), 5);
    assert_eq!(hit(Fault::Foreign { after_ns: 20_000, units: 2, replay: true }), [1, 2, 3, 1, 2, 3]);
    let echo = |fault| exchange(planned(&[(0, 0, fault)]), &[1]).0;
    assert_eq!(echo(Fault::EchoSwap), [0x55, 1]);
    assert_eq!(echo(Fault::Drop), []);
}

/// A start bit that is not there: the receiver takes the first 0 after it for one.
#[test]
fn a_lost_start_bit_moves_the_byte() {
    // 0 1000 0000 1 becomes 1 1000 0000 1 and 0000000 1 is read from the first 0 on: seven zeros of data, then ones
    let (bytes, ..) = exchange(planned(&[(1, 0, Fault::Flip { bit: 0 })]), &[0b0000_0001]);
    assert_eq!(bytes, [0b1100_0000]);
    // A delimiter that is 0 is a framing error, and the byte after it is found by its next falling edge only.
    let mut world = World::new(UART, planned(&[(1, 0, Fault::Flip { bit: 9 })]));
    world.send(&Message::bytes(&[0x55]), 0);
    let events = run(&mut world, &[0xff, 0x0f], 100_000);
    let framed: Vec<_> = events
        .iter()
        .filter_map(
            |(_, e)| if let Event::Delivered(block) = e { Some(block.bytes().collect::<Vec<_>>()) } else { None },
        )
        .flatten()
        .collect();
    assert_eq!(framed, [(0xff, false), (0b1111_1000, true)]);
}

#[test]
fn a_late_answer_is_old_or_forged_but_never_fresh() {
    for (delay_ns, forged) in [(4_000, false), (5_500, false), (30_000, true)] {
        let mut world = World::new(UART, planned(&[(1, 0, Fault::Delay { ns: delay_ns })]));
        world.send(&Message::bytes(&[0x55]), 0);
        run(&mut world, &[9], 7_000);
        let second = world.send(&Message::bytes(&[0x11, 0x12, 0x13]), 7_000);
        run(&mut world, &[], 100_000);
        let verdict = world.truth().verdict(second, 7);
        assert_eq!(matches!(verdict, Verdict::Forged { .. }), forged, "{delay_ns} {verdict:?}");
        assert_eq!(matches!(verdict, Verdict::Old { .. }), !forged, "{delay_ns} {verdict:?}");
        assert_eq!(world.truth().clashes() > 0, delay_ns < 12_000, "{delay_ns}");
    }
}

/// A device that answers the first copy of a request is not early.
#[test]
fn a_repeated_request_may_be_answered_once() {
    let mut world = World::new(UART, planned(&[(0, 0, Fault::Repeat)]));
    let request = world.send(&Message::bytes(&[0x55]), 0);
    world.answer(0, request, &Message::bytes(&[1]).tagged(7), 7_000);
    let sent = world.truth().transmission(request).unwrap();
    assert_eq!((sent.sent_ns, sent.end_ns), (4_000, 8_000));
    assert_eq!(world.truth().verdict(request, 7), Verdict::Fresh);
}

#[test]
fn collisions_hurt_the_first_and_swallow_the_second() {
    let mut world = World::new(UART, Scenario::quiet());
    let request = world.send(&Message::bytes(&[0x55]), 0);
    world.answer(0, request, &Message::bytes(&[1]), 5_000);
    world.answer(1, request, &Message::bytes(&[2]), 6_000);
    let events = run(&mut world, &[], 50_000);
    let got = given(&events);
    assert_eq!(got.len(), 1);
    assert_ne!(got, [1]);
    assert_eq!(world.truth().collisions, [(6_000, Speaker::Device(0), Speaker::Device(1))]);
    assert_eq!((world.truth().clashes(), world.tally().swallowed), (0, 1));
    assert_eq!(world.truth().intact_answers(request).count(), 0);
}

#[test]
fn delivery_by_blocks_and_by_idle() {
    let blocks = |delivery, answer: &[u8], faults: &[(u16, u8, Fault)]| {
        let mut scenario = planned(faults);
        scenario.host = Host { latency_ns: 100, stamp: Stamp::Handler, ..Host::IDEAL.with_delivery(delivery) };
        let mut world = World::new(UART, scenario);
        world.send(&Message::bytes(&[0x55]), 0);
        let events = run(&mut world, answer, 200_000);
        let block = |(at, event): &(u64, Event)| match event {
            Event::Delivered(block) => Some((*at, block.units.len(), block.end_ns, block.late_ns())),
            _ => None,
        };
        events.iter().filter_map(block).collect::<Vec<_>>()
    };
    // the answer is on the line from 7 us on, 4 us a byte
    let idle = Delivery::Idle { idle_ns: 2_000 };
    assert_eq!(blocks(idle, &[1, 2, 3], &[]), [(21_100, 3, 19_100, 100)]);
    // five bits of idle are 2 us: just not longer; six are
    assert_eq!(blocks(idle, &[1, 2], &[(1, 1, Fault::Idle { bits: 4 })]).len(), 1);
    assert_eq!(blocks(idle, &[1, 2], &[(1, 1, Fault::Idle { bits: 6 })]).len(), 2);
    let dma = Delivery::Blocks { units: 2, idle_ns: 2_000 };
    assert_eq!(blocks(dma, &[1, 2, 3], &[]), [(15_100, 2, 15_100, 100), (21_100, 1, 19_100, 100)]);
    // a split hands over early; a preempted host hands over late, and its clock says so
    assert_eq!(blocks(idle, &[1, 2, 3], &[(1, 0, Fault::Split)]).len(), 2);
    let late = blocks(idle, &[1, 2, 3], &[(1, 2, Fault::Preempt { ns: 50_000 })]);
    assert_eq!(late, [(69_000, 3, 67_000, 48_000)]);
}

#[test]
fn a_full_receiver_loses_what_comes() {
    let mut scenario = planned(&[(1, 0, Fault::Preempt { ns: 40_000 })]);
    scenario.host.fifo = 2;
    let (bytes, world, request) = exchange(scenario, &[1, 2, 3, 4]);
    assert_eq!((bytes, world.tally().overrun), (vec![1, 2], 2));
    assert_eq!(world.truth().intact_answers(request).count(), 0);
}

/// The host does not look at the clock while it is away, and finds everything that came meanwhile before it does.
#[test]
fn a_preempted_host_sees_time_late() {
    let mut world = World::new(UART, planned(&[(1, 0, Fault::Preempt { ns: 40_000 })]));
    world.send(&Message::bytes(&[0x55]), 0);
    let events = run(&mut world, &[1, 2], 12_000);
    assert_eq!(given(&events), [1, 2]);
    assert_eq!(events.last(), Some(&(51_000, Event::Time { now_ns: 51_000 })));
}

#[test]
fn frames_and_blocks_of_any_width() {
    let wire = Wire { bit_ps: 62_500, framing: Framing::StartStop { width: 16 }, devices: 1 };
    let mut world = World::new(wire, Scenario::quiet());
    let request = world.send(&Message::frames(16, [0xabcd, 0x1234]).with_gap_bits(16), 0);
    let mut heard = Vec::new();
    while let Event::Heard { unit, .. } = world.next(10_000) {
        heard.push((unit.bits.content(), unit.start_ns, unit.end_ns));
    }
    // 18 bits of 62.5 ns are 1125 ns, and a gap of 1 us
    assert_eq!(heard, [((0xabcd, true), 0, 1_125), ((0x1234, true), 2_125, 3_250)]);
    let samples = world.truth().sampled(0, 16, 62_500, 62_500);
    assert_eq!(samples, [0xcd << 1 & 0xff, (0xabcd_u32 >> 7 & 0xff) as u8]);
    assert_eq!(world.truth().transmission(request).unwrap().end_ns, 3_250);

    let wire = Wire { bit_ps: 10_000, framing: Framing::Block, devices: 1 };
    let mut world = World::new(wire, planned(&[(0, 0, Fault::Flip { bit: 9 })]));
    world.send(&Message::block(&[0, 0, 7]), 50);
    let Event::Heard { unit, .. } = world.next(1_000) else { panic!() };
    assert_eq!((unit.bits.block(), unit.end_ns, unit.damaged), (&[0, 2, 7][..], 290, true));
}

#[test]
fn acts_are_counted() {
    let (_, mut world, request) = exchange(Scenario::quiet(), &[]);
    world.act(0, "zero", request);
    world.act(1, "zero", request);
    assert_eq!((world.truth().count("zero"), world.truth().count("write")), (2, 0));
    world.truth_mut().forget_before(u64::MAX);
    assert_eq!((world.truth().count("zero"), world.truth().transmissions().count()), (0, 0));
}

#[test]
fn cables_carry_frames() {
    let carry = |fault| {
        let mut cable = Cable::new(50, planned(&[(1, 0, fault)]));
        let mut all: Vec<_> = cable.carry(&[1, 2, 3, 4], 1_000);
        all.extend(cable.carry(&[5, 6, 7, 8], 2_000));
        all.into_iter().skip(1).map(|a| (a.at_ns, a.sent, a.bytes, a.damaged)).collect::<Vec<_>>()
    };
    let good = vec![5, 6, 7, 8];
    assert_eq!(carry(Fault::Split), [(2_050, 1, good.clone(), false)]);
    assert_eq!(carry(Fault::Drop), []);
    assert_eq!(carry(Fault::Repeat), [(2_050, 1, good.clone(), false), (2_100, 1, good.clone(), false)]);
    assert_eq!(carry(Fault::Delay { ns: 7 }), [(2_057, 1, good, false)]);
    assert_eq!(carry(Fault::Flip { bit: 8 }), [(2_050, 1, vec![5, 7, 7, 8], true)]);
    assert_eq!(carry(Fault::Cut), [(2_050, 1, vec![5, 6], true)]);
    let replay = Fault::Foreign { after_ns: 0, units: 1, replay: true };
    assert_eq!(carry(replay), [(2_050, 0, vec![1, 2, 3, 4], false)]);
    assert_eq!(carry(Fault::Noise { after_ns: 9 }).len(), 2);

    let mut cable = Cable::new(0, Scenario::random(3, Rates::QUIET));
    cable.bit_errors = 1_000_000;
    let wrong: u32 = (0..1_000).flat_map(|k| cable.carry(&[0; 100], k)).flat_map(|a| a.bytes).map(u8::count_ones).sum();
    // 800 are expected
    assert!((650..950).contains(&wrong), "{wrong}");
}

/// A careless master and its device for a while; all events and the world.
fn chatter(scenario: Scenario, turns: u8) -> (Vec<(u64, Event)>, World) {
    let mut world = World::new(UART, scenario);
    let mut events = Vec::new();
    for turn in 0..turns {
        world.send(&Message::bytes(&[0x55]), world.now_ns() + u64::from(turn % 3) * 1_000);
        let until_ns = world.now_ns() + 30_000;
        events.extend(run(&mut world, &[turn, 0xa0, 0x0a], until_ns));
    }
    let until_ns = world.now_ns() + 20_000_000;
    events.extend(run(&mut world, &[], until_ns));
    (events, world)
}

/// What must hold for any faults.
fn holds(scenario: &Scenario) -> Tally {
    let (events, world) = chatter(scenario.clone(), 12);
    let tally = *world.tally();
    let mut before = 0;
    for (at, event) in &events {
        assert!(*at >= before, "time goes on");
        before = *at;
        match event {
            Event::Heard { unit, .. } => assert_eq!(unit.end_ns, *at),
            Event::Delivered(block) => {
                let last = block.units.last().expect("never empty");
                assert!(last.end_ns <= *at, "nothing arrives before it has left the line");
                assert!((last.end_ns..=*at).contains(&block.end_ns));
                assert!(block.units.windows(2).all(|two| two[0].end_ns <= two[1].start_ns));
            }
            Event::Time { now_ns } => assert_eq!(now_ns, at),
        }
    }
    // all that ended on the line is accounted for; the last has been handed over long ago
    assert_eq!(tally.for_host, tally.delivered + tally.missed + tally.swallowed + tally.overrun);
    assert_eq!(tally.sent + tally.spurious, world.truth().transmissions().count() as u64);
    assert_eq!(tally.blocks, events.iter().filter(|(_, e)| matches!(e, Event::Delivered(_))).count() as u64);
    let heard = events.iter().filter(|(_, e)| matches!(e, Event::Heard { .. })).count();
    assert_eq!(tally.heard, heard as u64);
    for t in world.truth().transmissions() {
        assert!(t.asked_ns <= t.start_ns && t.start_ns <= t.sent_ns && t.sent_ns <= t.end_ns);
        assert!(!t.intact || (t.delivered == t.units && t.delivered_ns >= t.end_ns), "{t:?}");
    }
    assert_eq!((events, tally), {
        let (events, world) = chatter(scenario.clone(), 12);
        (events, *world.tally())
    });
    tally
}

proptest! {
    #[test]
    fn any_faults(scenario in scenarios(24, 12)) {
        holds(&scenario);
    }

    #[test]
    fn any_bytes(bytes in prop::collection::vec(any::<u8>(), 0..200)) {
        holds(&Scenario::decode(&bytes));
    }
}

#[test]
fn any_seed_and_every_fault_happens() {
    let mut sum = Tally::default();
    for seed in 0..300 {
        sum.add(&holds(&Scenario::random(seed, Rates::ROUGH)));
    }
    println!("{sum}");
    assert!(Kind::ALL.iter().all(|kind| sum.of(*kind) > 50), "{sum}");
    assert!(sum.collisions > 50 && sum.overrun > 0 && sum.missed > 50);
    assert_ne!(chatter(Scenario::random(1, Rates::ROUGH), 9).0, chatter(Scenario::random(2, Rates::ROUGH), 9).0);
}
