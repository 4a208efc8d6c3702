use hdsl::device::Device;
use hdsl::inspect::Expected;
use hdsl::master::{Master, State};
use hdsl::message::{RemoteRegister, ShortRequest};
use hdsl::{Dialect, EncoderId, Evidence, Rule, Window};

/// An answer of a running link, the first bit of the line first.
const ANSWER: &str = "1001100101010110010000111110000110011001101101010100010100101";

fn line(bits: usize) -> Window {
    let bits = ANSWER.bytes().take(bits).enumerate().map(|(at, bit)| u128::from(bit & 1) << at).sum::<u128>()
        | u128::from(bits == 0);
    Window::from_bits(bits, 61).unwrap()
}

fn short() -> Window {
    Window::from_bits(0, 60).unwrap()
}

/// The word of the acceleration with one wrong bit.
fn damaged() -> Window {
    Window::from_bits(line(61).bits() ^ 1 << 41, 61).unwrap()
}

fn encoder() -> Device {
    Device::new(EncoderId::try_from(0x00153).unwrap())
}

/// Of a link that has run for 300 H-frames; the last one ended 3.45 ms after its start.
fn evidence() -> Evidence {
    let (mut master, mut encoder) = (Master::new(Dialect::SICK), encoder());
    for frame in 0..300 {
        let sent = master.transmission();
        let heard = encoder.set_position(12 * frame).hear(sent.head.bits());
        let bits = heard.map_or(u64::MAX, |sent| sent.bits);
        let _ = master.hear_bits(bits, None, STARTED_NS + 11_520 * frame + 10_560);
    }
    assert_eq!(master.state(), State::Running);
    master.fast()
}

/// An instant that needs more than 32 bits.
const STARTED_NS: u64 = 5_000_000_000;
const SAMPLED_NS: u64 = STARTED_NS + 11_520 * 299 + 853;

/// RESET and the SYNC frames that an encoder wants before it answers.
fn awake() -> (Device, Window) {
    let (mut master, mut encoder) = (Master::new(Dialect::SICK), encoder());
    loop {
        let head = master.transmission().head.bits();
        match encoder.set_position(0).hear(head) {
            Some(_) => return (encoder, head),
            None => drop(master.hear_bits(u64::MAX, None, 0).state),
        }
    }
}

decode! { hdsl::Answer(Rule, Window); with (Rule::Strict); sound line(61); damaged short() => "truncated" }
encode! { hdsl::message::ShortRequest = ShortRequest::Read(RemoteRegister::SRSSI) }
code! { hdsl::message::Length: 3; unknown 7 }
feedback! { hdsl: evidence(), sampled at SAMPLED_NS; "`master.fast()`; `master.safe()` gives `SafeEvidence`" }
device! {
    hdsl::"Device::new(id)" = awake().0;
    with Behaviour::new().with_sync_frames(4);
    heard |_at| (awake().1); "Window)"
}
inspect! { hdsl::inspect(expected = Expected::Normal { at: None }; line); damaged damaged() => "invalid_word" }
log! { hdsl: ShortRequest, hdsl::master::RestartReason, hdsl::message::Length }
counters! { hdsl }
differs! {
    EXCHANGE: "an H-frame has its own clock: `Master::new(dialect)`, `transmission()`, `hear(samples: &[u8], end_ns)`";
    PROCEDURE: "a message takes many frames: `master.start_short(request)`, its end is in the `HFrame`";
}
