//! What is said of frames: values, verdicts, and the pairing of request and answer.

use crate::common::{Bench, Run, Wave, field, id0, id3, sealed};
use serde_json::json;

/// Between two good exchanges, so that the rate can be found.
fn decode(draw: impl Fn(&mut Wave)) -> Run {
    let mut wave = Wave::new(2.5e6);
    wave.idle_us(20.0).exchange(&[0x1a], &id3(1, 0, 0));
    draw(&mut wave);
    wave.exchange(&[0x1a], &id3(2, 0, 0));
    let mut run = Bench::new().decode("a.vcd", wave.vcd(), &["--json"]);
    let lines: Vec<&str> = run.out.lines().collect();
    let (first, last) = (lines[..2].join("\n"), lines[lines.len() - 2..].join("\n"));
    assert!(first.contains("\"ABS\":1,") && last.contains("\"ABS\":2,"), "{}", run.out);
    run.out = lines[2..lines.len() - 2].join("\n");
    run
}

#[test]
fn values_of_an_id_3_answer() {
    let run = decode(|wave| {
        wave.exchange(&[0x1a], &[0x1a, 0x20, 0x29, 0xc0, 0x3b, 0x17, 0x02, 0x00, 0x00, 0xc8, 0x35]);
    });
    run.is_good();
    let answer = &run.json()[1];
    assert_eq!(
        answer["fields"],
        json!({
            "SF": { "raw": 0x20, "set": ["EA1"] }, "ABS": 3_915_817, "ENID": 23, "ABM": 2,
            "ALMC": { "raw": 0xc8, "set": ["OF", "BE", "BA"] }, "CRC": 0x35,
        })
    );
    assert_eq!(answer["position"]["counts"], 2 * (1 << 23) + 3_915_817);
    assert_eq!(answer["delay_ps"], 3_000_000);
    assert_eq!((&answer["start_ps"], &answer["end_ps"]), (&json!(118_000_000), &json!(162_000_000)));
}

#[test]
fn positions_need_a_resolution() {
    let bench = Bench::new();
    let mut wave = Wave::new(2.5e6);
    wave.idle_us(20.0);
    for k in 0..3 {
        wave.exchange(&[0x02], &id0(0x8000 + k));
    }
    let plain = bench.decode("a.vcd", wave.vcd(), &["--json"]);
    assert_eq!(plain.json()[1]["position"], json!({ "name": "ABS", "counts": 0x8000 }));
    let wide = bench.decode("a.vcd", wave.vcd(), &["--json", "--single-turn-bits", "17"]);
    assert_eq!(wide.json()[1]["position"], json!({ "name": "ABS", "counts": 0x8000, "turns": 0.25 }));
    let narrow = bench.decode("a.vcd", wave.vcd(), &["--json", "--single-turn-bits", "11"]);
    narrow.is_good();
    assert!(narrow.json()[1].get("position").is_none());
    assert!(narrow.json()[1]["fields"]["width"].as_str().unwrap().contains("taken as 11 + 16 bits"));
}

#[test]
fn eeprom() {
    let run = decode(|wave| {
        wave.exchange(&sealed(&[0xea, 0x05]), &sealed(&[0xea, 0x85, 0x00]))
            .exchange(&sealed(&[0xea, 0x05]), &sealed(&[0xea, 0x05, 0xff]))
            .exchange(&sealed(&[0x32, 0x05, 0xa5]), &sealed(&[0x32, 0x05, 0xa5]));
    });
    run.is_good();
    let events = run.json();
    assert_eq!(events[0]["fields"], json!({ "ADF": { "raw": 5, "set": [] } }));
    // While the memory is busy its data byte says nothing.
    assert_eq!(events[1]["fields"], json!({ "ADF": { "raw": 0x85, "set": ["busy"] }, "CRC": 0x6f }));
    assert_eq!(events[3]["fields"]["EDF"], 0xff);
    assert_eq!(events[4]["fields"], json!({ "ADF": { "raw": 5, "set": [] }, "EDF": 0xa5 }));
    let wrong = decode(|wave| {
        wave.exchange(&sealed(&[0xea, 0x05]), &sealed(&[0xea, 0x06, 0x00]))
            .exchange(&sealed(&[0x32, 0x05, 0xa5]), &sealed(&[0x32, 0x05, 0x25]));
    });
    assert_eq!(wrong.verdicts(), ["ok", "address_mismatch", "ok", "data_mismatch"]);
}

#[test]
fn resets_say_what_they_do() {
    let run = decode(|wave| {
        for cf in [0xba, 0xc2, 0x62] {
            wave.exchange(&[cf], &sealed(&[cf, 0, 1, 2, 3]));
        }
    });
    run.is_good();
    let said: Vec<_> = run.json().iter().step_by(2).map(|e| e["fields"]["effect"].clone()).collect();
    let due =
        ["clears errors, one of 10", "sets the single-turn zero, one of 10", "clears turns and errors, one of 10"];
    assert_eq!(said, due);
}

#[test]
fn a_wrong_check_field() {
    let run = decode(|wave| {
        let mut bytes = id3(77, 0, 0);
        bytes[3] ^= 0x10;
        wave.exchange(&[0x1a], &bytes);
    });
    run.fails_with("1 of 6 frames refused: crc 1");
    let answer = &run.json()[1];
    assert_eq!((&answer["verdict"], &answer["at_field"]), (&json!("crc"), &json!("CRC")));
    assert!(answer["reason"].as_str().unwrap().contains("computed 0x50"), "{answer}");
    // Ten fields of 4 us after the beginning of the answer.
    assert_eq!(answer["at_ps"].as_i64(), answer["start_ps"].as_i64().map(|start| start + 40_000_000));
    assert!(answer["fields"].get("ABS").is_none(), "no value beside an error");
    assert_eq!(answer["cause"], "single bits were disturbed");
}

#[test]
fn a_low_delimiter() {
    let run = decode(|wave| {
        wave.send(&[0x1a]).idle_us(3.0);
        for (k, byte) in id3(0x0f_0f0f, 0, 0).into_iter().enumerate() {
            let mut bits = field(byte);
            bits[9] = k != 3;
            wave.bits(&bits);
        }
        wave.idle_us(40.0);
    });
    let answer = &run.json()[1];
    assert_eq!(
        (&answer["verdict"], &answer["at_field"], &answer["at_bit"]),
        (&json!("delimiter"), &json!("ABS1"), &json!(9))
    );
    assert_eq!(run.json().len(), 2, "{}", run.out);
    assert_eq!(run.code, 1);
}

/// A glitch at the turn-round of the line is taken for a start bit, and the frame is read one bit early.
#[test]
fn a_frame_shifted_by_a_glitch() {
    let run = decode(|wave| {
        wave.send(&[0x1a]).idle_us(2.6).level(false, 0.4e6).send(&id3(0x12_3456, 1, 0)).idle_us(40.0);
    });
    run.fails_with("frames refused");
    let answer = &run.json()[1];
    assert!(answer["cause"].as_str().unwrap().contains("the frame begins 1 bit(s) later"), "{answer}");
}

/// The encoder answers a damaged request with an ID 3 frame.
#[test]
fn damaged_requests() {
    let run = decode(|wave| {
        // Parity, sink code, a code without a meaning, the check field of an EEPROM request.
        wave.exchange(&[0x9a], &id3(5, 0, 0)).exchange(&[0x1b], &id3(6, 0, 0)).exchange(&[0xa2], &id3(7, 0, 0));
        wave.exchange(&[0xea, 0x01, 0x00], &id3(8, 0, 0));
    });
    let verdicts = ["parity", "rejected", "sink_code", "rejected", "unknown_data_id", "rejected", "crc", "rejected"];
    assert_eq!(run.verdicts(), verdicts);
    assert_eq!(run.json()[1]["fields"]["ABS"], 5, "a refusal tells what the encoder knows");
    let good_request = decode(|wave| {
        let mut refusal = id3(5, 0, 0);
        (refusal[1], refusal[10]) = (0x40, refusal[10] ^ 0x40);
        wave.exchange(&[0x92], &refusal);
    });
    assert_eq!(good_request.verdicts(), ["ok", "rejected"]);
    assert_eq!(good_request.json()[1]["fields"]["SF"]["set"], json!(["CA0"]));
}

#[test]
fn answers_that_are_too_short_or_missing() {
    let run = decode(|wave| {
        wave.exchange(&[0x1a], &id3(1, 0, 0)[..7]);
        wave.exchange(&[0x1a], &[0x1a, 0x00, 0x00, 0x1a]);
        wave.send(&[0x02]).idle_us(60.0);
        wave.exchange(&[0x92], &sealed(&[0x8a, 0, 0, 0, 0]));
    });
    assert_eq!(run.verdicts(), ["ok", "truncated", "ok", "truncated", "ok", "no_response", "ok", "cf_mismatch"]);
    let short = &run.json()[1];
    assert!(short["reason"].as_str().unwrap().contains("7 of 11 fields"));
    assert_eq!((&short["at_field"], &short["at_ps"]), (&json!("ABM1"), &short["end_ps"]));
    // ID 1 (8A) for ID 2 (92): bits 3 and 4 of the byte differ.
    assert_eq!((&run.json()[7]["at_field"], &run.json()[7]["at_bit"]), (&json!("CF"), &json!(4)));
}

#[test]
fn answers_alone() {
    let mut wave = Wave::new(2.5e6);
    wave.idle_us(20.0);
    for (k, bytes) in [id3(3, 4, 0), id0(9), sealed(&[0x92, 0, 0x11]), sealed(&[0xea, 1, 2])].iter().enumerate() {
        wave.send(bytes).idle_us(20.0 + k as f64);
    }
    let run = Bench::new().decode("rx.vcd", wave.vcd(), &["--json"]);
    run.is_good();
    assert!(run.json().iter().all(|e| e["direction"] == "answer" && e.get("delay_ps").is_none()), "{}", run.out);
}

/// Nothing is passed over: what follows an answer without a pause is a frame of its own.
#[test]
fn fields_after_an_answer() {
    let run = decode(|wave| {
        wave.exchange(&[0x02], &[&id0(9)[..], &[0x55, 0x66]].concat());
        wave.send(&[&id3(7, 0, 0)[..], &[0x55, 0x66]].concat()).idle_us(40.0);
    });
    assert_eq!(run.verdicts(), ["ok", "ok", "sink_code", "ok", "sink_code"]);
    let log = Bench::new().decode("a.txt", "02 02 20 B4 BD 1C 37 55 66\n", &["--bytes", "--json"]);
    assert_eq!(log.verdicts(), ["ok", "ok", "sink_code", "sink_code"]);
}

/// Pauses between the fields of an answer, as a UART makes them.
#[test]
fn pauses_inside_frames() {
    let run = decode(|wave| {
        for pause in [0.2, 0.7, 1.2] {
            wave.send(&[0x1a]).idle_us(2.5);
            for byte in id3(55, 66, 0) {
                wave.send(&[byte]).idle_us(pause);
            }
            wave.idle_us(30.0);
            for byte in sealed(&[0xea, 0x01]) {
                wave.send(&[byte]).idle_us(pause);
            }
            wave.idle_us(3.0).send(&sealed(&[0xea, 0x01, 0x02])).idle_us(15.0);
        }
    });
    run.is_good();
    assert_eq!(run.json().len(), 12);
}

/// Wherever a bit is lost or added in an answer, that is said, and the rest of it is no second frame.
#[test]
fn a_bit_lost_or_added() {
    let bits: Vec<bool> = id3(0x12_3456, 0x789a, 0).into_iter().flat_map(field).collect();
    let (mut right, mut all) = (0, 0);
    for at in (3..108).step_by(5) {
        for add in [false, true] {
            let mut bits = bits.clone();
            if add {
                bits.insert(at, !bits[at]);
            } else {
                bits.remove(at);
            }
            let run = decode(|wave| {
                wave.send(&[0x1a]).idle_us(3.0).bits(&bits).idle_us(40.0);
            });
            let events = run.json();
            assert!(events.len() >= 2 && events[1]["verdict"] != "ok", "{at} {add}: {}", run.out);
            all += 1;
            let cause = events[1]["cause"].as_str().unwrap_or_default();
            let want = if add { "or inserted" } else { "was lost" };
            right += usize::from(events.len() == 2 && (cause.contains(want) || cause.contains("bit(s)")));
        }
    }
    assert!(100 * right >= 95 * all, "{right} of {all}");
}

#[test]
fn a_cut_answer_is_called_cut() {
    let run = decode(|wave| {
        wave.exchange(&[0x1a], &id3(1, 0, 0)[..7]);
    });
    assert!(run.json()[1]["cause"].as_str().unwrap().contains("it was cut"), "{}", run.out);
}
