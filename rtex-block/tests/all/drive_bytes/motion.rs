//! How the modelled drive moves: windows, limits, profile motion, and what its monitor shows of them.

use rtex_block::Alarm;
use rtex_block::device::{Behaviour, Quirks};
use rtex_block::position::Gear;

use super::{NOTHING, OFF, ON, Raw, about, config, number};

/// The motor makes up a quarter of the deviation: 25 of 100, so 75 are left.
#[test]
fn windows_and_limits_at_their_edges() {
    for (window, want) in [(75, 0xc1), (74, 0xc0)] {
        let mut raw = Raw::on(config().with_in_position(window), 0x20);
        raw.send(0x20, ON, 100, NOTHING);
        let response = raw.send(0x20, ON, 100, NOTHING);
        // 25 in half a millisecond are 50 000 a second.
        assert_eq!((response[2], number(&response, 4), number(&response, 8)), (want, 25, 50_000));
    }
    // A torque of more than 300 % is limited.
    let mut raw = Raw::on(config(), 0x20);
    raw.send(0x20, ON, 8_000, NOTHING);
    let response = raw.send(0x20, ON, 8_000, NOTHING);
    assert_eq!((response[2] & 0x08, number(&response, 12)), (0x08, 3_000));
    let response = raw.hold(80, 0x20, ON, 8_000, NOTHING);
    assert_eq!((response[2], number(&response, 12)), (0xc1, 0));
    // 400 M pulses a second are 20 M units in half a millisecond at gear 1/100; speeds end at 32 bits.
    for (step, speed) in [(20_000_000, i32::MAX), (-20_000_000, i32::MIN)] {
        let mut raw = Raw::on(config().with_gear(Gear::new(1, 100).unwrap()), 0x20);
        raw.send(0x20, ON, step, NOTHING);
        assert_eq!(number(&raw.send(0x20, ON, step, NOTHING), 8), speed);
        assert_eq!(raw.drive.alarm(), None);
        raw.send(0x20, ON, -step - step.signum(), NOTHING);
        assert_eq!(raw.drive.alarm(), Some(Alarm { main: 27, sub: 4 }));
    }
    // In r/min they do so too, and torque makes speed.
    for (speed, by) in [(i32::MAX, i32::MAX), (i32::MIN, i32::MIN), (-60_000, -524_288)] {
        let mut raw = Raw::new(config());
        raw.hold(3, 0x20, OFF, 0, NOTHING);
        raw.write(0x0719, 0);
        raw.hold(6, 0x30, ON, 0, NOTHING);
        raw.send(0x30, ON, speed, NOTHING);
        assert_eq!(raw.drive.position(), by);
    }
    let mut raw = Raw::on(config(), 0x40);
    let positions = [0; 3].map(|_| {
        raw.send(0x40, ON, 10, NOTHING);
        raw.drive.position()
    });
    assert_eq!(positions, [5, 15, 30]);
}

/// With two communications an update every counter comes twice, and the axis moves once.
#[test]
fn two_communications() {
    let mut raw = Raw::new(config().with_communications(2).with_counter_limit(1));
    let twice = |raw: &mut Raw, at| {
        let block = raw.block(0x20, ON, at, NOTHING);
        let before = raw.drive.position();
        raw.drive.hear(&block).unwrap();
        let middle = raw.drive.position();
        raw.drive.hear(&block).unwrap();
        (middle - before, raw.drive.position() - middle)
    };
    for _ in 0..40 {
        assert_eq!(twice(&mut raw, 0), (0, 0));
    }
    assert_eq!(twice(&mut raw, 1_000), (0, 250));
    assert_eq!(raw.drive.alarm(), None);
    // The third time is one too many.
    let block = raw.block(0x20, ON, 1_000, NOTHING);
    for alarm in [None, None, Some(Alarm { main: 86, sub: 2 })] {
        raw.drive.hear(&block).unwrap();
        assert_eq!(raw.drive.alarm(), alarm);
    }
}

/// Every monitor code of SX-DSV02310 that is confirmed, while the axis moves at 10 units an update.
#[test]
fn monitor_values() {
    let mut raw = Raw::on(config(), 0x20);
    let mut at = 0;
    let mut read = |raw: &mut Raw, control, type_code: u16, index| {
        let mut answer = [0; 16];
        for _ in 0..40 {
            at += 10;
            raw.send(0x20, control, at, NOTHING);
        }
        for _ in 0..3 {
            at += 10;
            answer = raw.send(0x2a, control, at, about(type_code, index, 0));
        }
        (answer[1], number(&answer, 12), number(&answer, 4), at - 10)
    };
    // A quarter of the deviation is made up, so the motor is three to four steps behind: 30 to 40 units.
    let (_, deviation, ..) = read(&mut raw, ON, 0x01, 0);
    assert!((28..=40).contains(&deviation), "{deviation}");
    for index in [1, 2] {
        let (code, same, actual, command) = read(&mut raw, ON, 0x01, index);
        assert_eq!((code, same, actual), (0x2a, deviation, command - deviation));
    }
    for code in [0x04, 0x08] {
        let (_, value, _, command) = read(&mut raw, ON, code, 0);
        assert_eq!(value, command, "{code:x}");
    }
    assert_eq!(read(&mut raw, ON, 0x05, 0).1, 20_000);
    assert_eq!(read(&mut raw, ON, 0x0c, 0).1, 20_000);
    let (code, actual, data1, _) = read(&mut raw, ON, 0x07, 0);
    assert_eq!((code, actual), (0x2a, data1));
    for code in [0x06, 0x11, 0x12] {
        assert_eq!(read(&mut raw, ON, code, 0).1, 0, "{code:x}");
    }
    for (code, index, error) in [(0x01, 3, 0x32), (0x07, 1, 0x32), (0x0b, 0, 0x31), (0x101, 0, 0x31)] {
        let answer = raw.hold(3, 0x2a, ON, at, about(code, index, 0));
        assert_eq!((answer[1], answer[8], answer[9]), (0xaa, error, 0), "{code:x}");
    }
    at += 10;
    raw.send(0x20, ON, at, NOTHING);
    // Released, it stands: no speed of any kind, and the command position is the actual one.
    raw.hold(30, 0x20, OFF, 0, NOTHING);
    for code in [0x01, 0x05, 0x06, 0x0c] {
        assert_eq!(raw.monitor(0x2a, OFF, 0, code), 0, "{code:x}");
    }
    // A torque that accelerates.
    let mut raw = Raw::on(config(), 0x20);
    raw.send(0x20, ON, 400, NOTHING);
    assert_eq!(number(&raw.send(0x20, ON, 400, NOTHING), 12), 200);
}

/// Position set while on fails with ERR, or is done where the drive allows it: 21h moves the actual position to the value,
/// 22h the command position, with the deviation between them kept.
#[test]
fn position_set_while_it_moves() {
    let mut raw = Raw::on(config(), 0x20);
    let answer = raw.hold(3, 0x24, ON, 0, about(0x21, 0, 5));
    assert_eq!((answer[1], answer[9], raw.drive.position()), (0x24, 0x80, 0));
    let allowed = Behaviour::new().with_quirks(Quirks::SETS_POSITION_WHILE_ON);
    for type_code in [0x21, 0x22] {
        let mut raw = Raw::on(config(), 0x10);
        raw.drive.set_behaviour(allowed);
        raw.send(0x17, ON, 100_000, about(0x11, 0, 1_000_000));
        raw.hold(200, 0x17, ON, 100_000, about(0x11, 0, 1_000_000));
        let deviation = raw.monitor(0x1a, ON, 0, 0x01);
        assert!(deviation > 1_000, "{deviation}");
        let before = raw.drive.position();
        raw.send(0x14, ON, 0, about(type_code, 0, 9_000));
        let deviation = raw.monitor(0x1a, ON, 0, 0x01);
        let (actual, command) = (raw.monitor(0x1a, ON, 0, 0x07), raw.monitor(0x1a, ON, 0, 0x08));
        assert!(before > 20_000 && deviation > 1_000);
        // Seven exchanges at 500 a period have passed since.
        let set = if type_code == 0x21 { actual } else { command };
        assert!((9_000..=9_000 + 7 * 510).contains(&set), "{type_code:x}: {actual} {command}");
    }
}

/// A motion starts with the change from 10h to 17h, energised, and with none under way.
#[test]
fn starts_of_motions() {
    let go = about(0x11, 0, 1_000_000);
    let mut raw = Raw::new(config());
    raw.hold(4, 0x10, OFF, 0, NOTHING);
    assert_eq!(raw.hold(3, 0x17, OFF, 5_000, go)[9] & 0x80, 0x80);
    let mut raw = Raw::on(config(), 0x20);
    assert_eq!(raw.hold(3, 0x17, ON, 5_000, go)[9] & 0x80, 0x80);
    raw.hold(2, 0x10, ON, 0, NOTHING);
    let answer = raw.hold(3, 0x17, ON, 5_000, go);
    assert_eq!((answer[2] & 0x02, answer[9] & 0x90), (0x02, 0x10));
    // Another one while it goes on.
    raw.hold(2, 0x10, ON, 0, NOTHING);
    let answer = raw.hold(3, 0x17, ON, 90_000, go);
    assert_eq!((answer[2] & 0x02, answer[9] & 0x80), (0x02, 0x80));
    raw.hold(400, 0x10, ON, 0, NOTHING);
    assert_eq!(raw.drive.position(), 5_000);
    let refused = raw.hold(3, 0x17, ON, 0, about(0xee, 0, 5));
    assert_eq!((refused[1], refused[8]), (0x97, 0x31));
    // After 17h the normal answer has the speed where the type code was: 10 M units/s2 for 150 periods are 750 000.
    let mut raw = Raw::on(config(), 0x10);
    raw.hold(150, 0x17, ON, 500_000, go);
    let answer = raw.hold(2, 0x10, ON, 0, NOTHING);
    assert!((735_000..=750_000).contains(&number(&answer, 8)), "{}", number(&answer, 8));
}

/// 500 units an update at 1 M units/s: Hard_Stop ends the motion in one period, Smooth_Stop with Pr8.04.
#[test]
fn hard_and_smooth_stop() {
    for (byte3, periods) in [(0x80, 2..=2), (0x40, 150..=260)] {
        let mut raw = Raw::new(config());
        raw.hold(3, 0x20, OFF, 0, NOTHING);
        // 10 M units/s2 up, 10 M down: 0.1 s, 200 periods.
        raw.hold(6, 0x10, ON, 0, NOTHING);
        raw.hold(400, 0x17, ON, 5_000_000, about(0x11, 0, 1_000_000));
        let end = (1..500).find(|_| raw.send(0x17, [0x80, byte3], 5_000_000, about(0x11, 0, 1_000_000))[2] & 0x02 == 0);
        assert!(end.is_some_and(|end| periods.contains(&end)), "{end:?}");
    }
}

/// NEAR: as many command units to go as the window has, or fewer.
#[test]
fn near_window() {
    for (near, want) in [(3_000, 0x02), (2_999, 0x00)] {
        let mut raw = Raw::on(config().with_near(near), 0x10);
        // Paused at the start, all of it is still to go.
        let answer = raw.hold(3, 0x17, [0x80, 0x20], 3_000, about(0x11, 0, 1_000_000));
        assert_eq!((answer[1], answer[2] & 0x02, answer[9] & 0x0f), (0x17, 0x02, want));
        // There is a Latch_Sel1 to be echoed, and no Latch_Sel2.
        let answer = raw.hold(3, 0x17, [0x80, 0x20], 3_000, about(0x11, 0x09f3, 1_000_000));
        assert_eq!(answer[10..12], [0x03, 0x09]);
    }
}

/// A trapezoid: 1 M units at 1 M units/s, 10 M units/s2 up and 5 M down, take 1 + 0.05 + 0.1 s.
#[test]
fn a_motion_takes_its_time() {
    let mut raw = Raw::new(config());
    raw.hold(3, 0x20, OFF, 0, NOTHING);
    raw.write(0x0804, 500);
    raw.hold(6, 0x10, ON, 0, NOTHING);
    let mut run = |distance, speed| {
        // Monitor_Sel 08h: IPOS, the position command that the drive generates.
        let mut tail = about(0x11, 0, speed);
        tail[3] = 0x08;
        let mut last = number(&raw.hold(2, 0x1a, ON, 0, about(0x08, 0, 0)), 12);
        raw.hold(2, 0x10, ON, 0, NOTHING);
        raw.send(0x17, ON, distance, tail);
        let mut steps = vec![];
        loop {
            let answer = raw.send(0x17, ON, distance, tail);
            steps.push(number(&answer, 12) - last);
            last = number(&answer, 12);
            if steps.len() > 3 && answer[2] & 0x02 == 0 {
                return steps;
            }
            assert!(steps.len() < 5_000);
        }
    };
    let steps = run(1_000_000, 1_000_000);
    assert!((2_295..=2_310).contains(&steps.len()), "{}", steps.len());
    assert_eq!((steps.iter().sum::<i32>(), steps.iter().max()), (1_000_000, Some(&500)));
    // It never gets faster on the way down: 5 M units/s2 take 2.5 units a period off the speed.
    assert!(steps[1_500..].windows(2).all(|pair| pair[1] <= pair[0] + 1));
    assert!(steps[2_100..].windows(2).all(|pair| pair[0] - pair[1] <= 4), "{:?}", &steps[2_100..]);
    // Less than one unit a period: 300 units at 1 500 a second take 0.2 s.
    let steps = run(-300, 1_500);
    assert!((400..=406).contains(&steps.len()), "{}", steps.len());
    assert_eq!(steps.iter().sum::<i32>(), -300);
}
