//! A whole H-frame of a running link, mean and worst of 4,000: what a processor has to do between an answer and the next
//! head.
//!
//! The mean is that of a line with jitter, with a short and a long message every 100 frames, 1.2 ms. The worst is that of a damaged
//! line: wrong bits, glitches in every bit, answers that are nothing but noise, silence, links that are lost and start anew; and
//! messages are under way all the time there, so that their work falls into the dearest frames too.

use core::hint::black_box;

use hdsl::device::Device;
use hdsl::master::{HFrame, Master, State};
use hdsl::message::{LongRequest, RemoteRegister, ResourceAddress, ShortRequest};
use hdsl::registers::{Events, Interrupts, Register, Registers};
use hdsl::sampling::WINDOW;
use hdsl::sync::{Es, Synchroniser};
use hdsl::{Dialect, EncoderId, Window};

use super::Kernel;
use super::hdsl_cable::{Cable, Disturbance};
use crate::count;

const FRAMES: u32 = 4000;

/// Both ends on a cable.
struct Link {
    master: Master,
    map: Registers,
    encoder: Device,
    cable: Cable,
    position: u64,
    count: u32,
    line: Line,
    noise: u32,
}

/// What happens to answers.
#[derive(Clone, Copy, PartialEq)]
enum Line {
    /// Jitter of a sample.
    Polite,
    /// In every third frame something worse.
    Damaged,
}

/// An answer in all forms that a receiver takes.
struct Received {
    bytes: [u8; WINDOW],
    words: [u32; WINDOW / 4],
    bits: u64,
    end_ns: u64,
}

/// What a kernel does with an H-frame.
type Step = fn(&mut Link, answer: &Received) -> Window;

impl Link {
    /// Answers come `delay` eighths of a bit after the start of reception.
    fn up(delay: u32, line: Line) -> Self {
        Self::of(Master::new(Dialect::SICK), delay, line)
    }

    /// Frames of 12.4 µs, each on a pulse; a fraction of an eighth is left to the corrections.
    fn synchronised(line: Line) -> Option<Self> {
        let sync = Synchroniser::new(930, Es::ONE).ok()?;
        Some(Self::of(Master::synchronised(Dialect::SICK, sync), 14, line))
    }

    #[expect(clippy::large_types_passed_by_value, reason = "it is moved into the link")]
    fn of(master: Master, delay: u32, line: Line) -> Self {
        let mut link = Self {
            master,
            map: Registers::new(&Dialect::SICK),
            encoder: Device::new(EncoderId::truncate(0x00153)),
            cable: Cable::new(Disturbance::default().with_jitter(1).with_delay(delay), 1),
            position: 0,
            count: 0,
            line: Line::Polite,
            noise: 1,
        };
        for _ in 0..200 {
            link.frame(hdsl_frame);
        }
        link.line = line;
        link
    }

    fn draw(&mut self) -> u32 {
        self.noise = self.noise.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        self.noise >> 8
    }

    /// What is done to the samples of an answer, and to its bits.
    fn damage(&mut self, samples: &mut [u8; WINDOW], bits: u64) -> u64 {
        let place = self.draw() % 61;
        match self.draw() % 240 {
            // One wrong bit, and a glitch in it.
            0..6 => {
                samples[place as usize + 3] ^= 0xff;
                bits ^ 1 << place
            }
            // A wrong bit in each word, and in each bit a glitch that leaves an RSSI of 4.
            6..9 => {
                for byte in samples.iter_mut() {
                    *byte ^= 0x10;
                }
                bits ^ 0x0402_0100_8040_2010
            }
            // Ten equal bits in each word.
            9 => {
                samples.fill(0);
                0
            }
            // Silence.
            10 => {
                samples.fill(0xff);
                u64::MAX >> 3
            }
            // Noise.
            11..13 => {
                for byte in samples.iter_mut() {
                    *byte = self.draw() as u8;
                }
                u64::from(self.draw()) << 37 | u64::from(self.draw()) << 20 | u64::from(self.draw())
            }
            // Glitches in the bits between the samples that are taken.
            13..16 => {
                for byte in samples.iter_mut() {
                    *byte ^= 0x10;
                }
                bits
            }
            _ => bits,
        }
    }

    /// One H-frame, and the instructions of the receiver.
    fn frame(&mut self, step: Step) -> u32 {
        let received = self.received();
        count::once(|| {
            black_box(step(self, black_box(&received)));
        })
    }

    /// What comes to the receiver in an H-frame.
    fn received(&mut self) -> Received {
        self.position = self.position.wrapping_add(77);
        self.count = self.count.wrapping_add(1);
        if (self.line == Line::Damaged || self.count.is_multiple_of(100)) && self.master.state() == State::Running {
            let _ = self.master.start_short(ShortRequest::Read(RemoteRegister::PING));
            let _ = self.master.start_long(LongRequest::read_name(ResourceAddress::RESOLUTN));
        }
        let answer = self.encoder.set_position(self.position).hear(self.master.transmission().head.bits());
        let mut bytes = self.cable.up(answer);
        let mut bits = answer.map_or(u64::MAX >> 3, |answer| answer.bits);
        if self.line == Line::Damaged {
            bits = self.damage(&mut bytes, bits);
        }
        let mut words = [0; WINDOW / 4];
        for (to, from) in words.iter_mut().zip(bytes.chunks_exact(4)) {
            *to = from.iter().rev().fold(0, |word, byte| word << 8 | u32::from(*byte));
        }
        Received { bytes, words, bits, end_ns: 11_520 * u64::from(self.count) }
    }
}

/// Samples to the next head.
#[expect(unsafe_code, reason = "the symbol is how run.sh finds the kernel")]
#[inline(never)]
#[unsafe(no_mangle)]
extern "Rust" fn hdsl_frame(link: &mut Link, answer: &Received) -> Window {
    let _ = link.master.hear(&answer.bytes, answer.end_ns);
    link.master.transmission().head.bits()
}

/// Samples in whole words to the next head.
#[expect(unsafe_code, reason = "the symbol is how run.sh finds the kernel")]
#[inline(never)]
#[unsafe(no_mangle)]
extern "Rust" fn hdsl_frame_words(link: &mut Link, answer: &Received) -> Window {
    let _ = link.master.hear_words(&answer.words, answer.end_ns);
    link.master.transmission().head.bits()
}

/// 61 bits to the next head.
#[expect(unsafe_code, reason = "the symbol is how run.sh finds the kernel")]
#[inline(never)]
#[unsafe(no_mangle)]
extern "Rust" fn hdsl_frame_bits(link: &mut Link, answer: &Received) -> Window {
    let _ = link.master.hear_bits(answer.bits, None, answer.end_ns);
    link.master.transmission().head.bits()
}

/// Samples to the next head and stuffing, in a frame that is on an external pulse.
#[expect(unsafe_code, reason = "the symbol is how run.sh finds the kernel")]
#[inline(never)]
#[unsafe(no_mangle)]
extern "Rust" fn hdsl_frame_sync(link: &mut Link, answer: &Received) -> Window {
    // Up to three eighths of a bit beside its edge; one in eight is not seen.
    let [late, ..] = answer.bits.to_le_bytes();
    if late & 7 != 7 {
        link.master.hear_pulse(i16::from(late & 7) - 3);
    }
    let _ = link.master.hear(&answer.bytes, answer.end_ns);
    link.master.transmission().head.bits()
}

/// The next head, before the answer of the present frame is taken in.
#[expect(unsafe_code, reason = "the symbol is how run.sh finds the kernel")]
#[inline(never)]
#[unsafe(no_mangle)]
extern "Rust" fn hdsl_frame_ahead(link: &mut Link, _: &Received) -> Window {
    link.master.ahead().map_or(Window::EMPTY, |next| next.head.bits())
}

/// The register map, from what the frame brought.
#[expect(unsafe_code, reason = "the symbol is how run.sh finds the kernel")]
#[inline(never)]
#[unsafe(no_mangle)]
extern "Rust" fn hdsl_frame_registers(map: &mut Registers, h_frame: &HFrame) -> Interrupts {
    map.apply(h_frame)
}

/// What an application does with the registers in a control cycle: takes the events, reads a byte, writes one.
#[expect(unsafe_code, reason = "the symbol is how run.sh finds the kernel")]
#[inline(never)]
#[unsafe(no_mangle)]
extern "Rust" fn hdsl_registers(link: &mut Link, received: &Received) -> (Events, Option<u8>) {
    let [address, value, ..] = received.bits.to_le_bytes();
    let events = link.map.take_events();
    let byte = link.map.read(address & 0x3f);
    let _ = link.map.write(&mut link.master, Register::MaskL as u8, value);
    (events, byte)
}

fn access(link: &mut Link, received: &Received) -> Window {
    black_box(hdsl_registers(link, received));
    Window::EMPTY
}

/// A frame and all that can wait until after it: the register map.
fn all(link: &mut Link, received: &Received) -> Window {
    let head = hdsl_frame_words(link, received);
    hdsl_frame_registers(&mut link.map, link.master.h_frame());
    head
}

/// No work: what the measurement itself takes.
fn nothing(_: &mut Link, _: &Received) -> Window {
    Window::EMPTY
}

/// Mean, in tenths, and worst of all frames after a delay in eighths of a bit.
fn measure(line: Line, delay: u32, step: Step) -> (u32, u32) {
    measure_on(Link::up(delay, line), delay, step)
}

/// The same of a link that is up.
fn measure_on(mut link: Link, delay: u32, step: Step) -> (u32, u32) {
    // Without the receiver the link stands still; the answers are as long.
    let mut idle = Link::up(delay, Line::Polite);
    let empty = (0..FRAMES).fold(0, |sum: u32, _| sum + idle.frame(nothing)) / FRAMES;
    let (mut sum, mut worst) = (0, 0);
    for _ in 0..FRAMES {
        let one = link.frame(step);
        sum += one;
        worst = worst.max(one);
    }
    ((sum / (FRAMES / 10)).saturating_sub(empty * 10), worst.saturating_sub(empty))
}

/// On 10 m of cable.
fn mean(step: Step) -> u32 {
    measure(Line::Polite, 14, step).0
}

fn worst(step: Step) -> u32 {
    measure(Line::Damaged, 14, step).1 * 10
}

/// In sync mode, on 10 m of cable.
fn synchronised(line: Line, step: Step) -> (u32, u32) {
    Link::synchronised(line).map_or((u32::MAX, u32::MAX), |link| measure_on(link, 14, step))
}

/// Mean and worst of a part of the work; the samples are taken in before or afterwards, and do not count.
fn measure_part(line: Line, part: Step, ahead: bool) -> (u32, u32) {
    let mut link = Link::up(14, line);
    let empty = link.frame(nothing);
    let (mut sum, mut worst) = (0, 0);
    for _ in 0..FRAMES {
        let received = link.received();
        if !ahead {
            hdsl_frame(&mut link, &received);
        }
        let one = count::once(|| {
            black_box(part(&mut link, black_box(&received)));
        });
        if ahead {
            hdsl_frame(&mut link, &received);
        }
        sum += one;
        worst = worst.max(one);
    }
    ((sum / (FRAMES / 10)).saturating_sub(empty * 10), worst.saturating_sub(empty))
}

fn registers(link: &mut Link, _: &Received) -> Window {
    hdsl_frame_registers(&mut link.map, link.master.h_frame());
    Window::EMPTY
}

/// A kernel under a name of its own that does what another one does.
macro_rules! named {
    ($($name:ident = $step:expr;)*) => {
        $(
            #[expect(unsafe_code, reason = "the symbol is how run.sh finds the kernel")]
            #[inline(never)]
            #[unsafe(no_mangle)]
            fn $name(link: &mut Link, answer: &Received) -> Window {
                // Without a difference two kernels become one function with one of the names.
                black_box(stringify!($name));
                $step(link, answer)
            }
        )*
    };
}

named! {
    hdsl_frame_worst = hdsl_frame;
    hdsl_frame_words_worst = hdsl_frame_words;
    hdsl_frame_damaged = hdsl_frame;
    hdsl_frame_border = hdsl_frame;
    hdsl_frame_sync_worst = hdsl_frame_sync;
    hdsl_frame_bits_worst = hdsl_frame_bits;
    hdsl_frame_bits_damaged = hdsl_frame_bits;
    hdsl_frame_ahead_worst = hdsl_frame_ahead;
    hdsl_frame_words_damaged = hdsl_frame_words;
    hdsl_frame_registers_damaged = registers;
    hdsl_frame_registers_worst = registers;
    hdsl_frame_all_worst = all;
}

pub(crate) const KERNELS: &[Kernel] = &[
    Kernel { name: "hdsl_frame", tenths: || mean(hdsl_frame) },
    Kernel { name: "hdsl_frame_damaged", tenths: || measure(Line::Damaged, 14, hdsl_frame_damaged).0 },
    Kernel { name: "hdsl_frame_worst", tenths: || worst(hdsl_frame_worst) },
    // The edges are where bit times meet: with jitter two fall into one, and the RSSI has to be looked up.
    Kernel { name: "hdsl_frame_border", tenths: || measure(Line::Polite, 16, hdsl_frame_border).0 },
    Kernel { name: "hdsl_frame_words", tenths: || mean(hdsl_frame_words) },
    Kernel { name: "hdsl_frame_words_damaged", tenths: || measure(Line::Damaged, 14, hdsl_frame_words_damaged).0 },
    Kernel { name: "hdsl_frame_words_worst", tenths: || worst(hdsl_frame_words_worst) },
    Kernel { name: "hdsl_frame_all_worst", tenths: || worst(hdsl_frame_all_worst) },
    Kernel { name: "hdsl_frame_sync", tenths: || synchronised(Line::Polite, hdsl_frame_sync).0 },
    Kernel { name: "hdsl_frame_sync_worst", tenths: || synchronised(Line::Damaged, hdsl_frame_sync_worst).1 * 10 },
    Kernel { name: "hdsl_registers", tenths: || measure_part(Line::Polite, access, false).0 },
    Kernel { name: "hdsl_frame_bits", tenths: || mean(hdsl_frame_bits) },
    Kernel { name: "hdsl_frame_bits_damaged", tenths: || measure(Line::Damaged, 14, hdsl_frame_bits_damaged).0 },
    Kernel { name: "hdsl_frame_bits_worst", tenths: || worst(hdsl_frame_bits_worst) },
    Kernel { name: "hdsl_frame_ahead", tenths: || measure_part(Line::Polite, hdsl_frame_ahead, true).0 },
    Kernel {
        name: "hdsl_frame_ahead_worst",
        tenths: || measure_part(Line::Damaged, hdsl_frame_ahead_worst, true).1 * 10,
    },
    Kernel { name: "hdsl_frame_registers", tenths: || measure_part(Line::Polite, registers, false).0 },
    Kernel {
        name: "hdsl_frame_registers_damaged",
        tenths: || measure_part(Line::Damaged, hdsl_frame_registers_damaged, false).0,
    },
    Kernel {
        name: "hdsl_frame_registers_worst",
        tenths: || measure_part(Line::Damaged, hdsl_frame_registers_worst, false).1 * 10,
    },
];
