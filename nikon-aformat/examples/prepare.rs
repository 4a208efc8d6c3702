//! A bench prepares an encoder before it is built in, and then reads it on a bus: `cargo run -p nikon-aformat --example prepare`.
//!
//! Identification code, address, alarms, turns and an EEPROM word are set by procedures that say whether it is done. The encoders
//! are simulated, with readings of their own of what the documents leave open.
#![allow(clippy::arithmetic_side_effects, reason = "a program on a host")]

use core::convert::Infallible;

use nikon_aformat::bus::{Addresses, Bus};
use nikon_aformat::device::{Behaviour, Device, Ea, Encoders, FirstRead, Restart, ShownAddress, Shows};
use nikon_aformat::master::{
    EepromRead, Exchange, GuardedReset, Line, Polling, Progress, Reset, Transaction, VerifiedWrite, Write,
};
use nikon_aformat::{
    Alm, BitOrder, BitRate, EncoderAddress, EncoderId, Error, Operation, PmAlm, Policy, Request, Resolution, Response,
    Temperature, Tolerated, U10,
};
use servowire_core::{Ended, Procedure};

const RATE: BitRate = BitRate::Mbit8;

fn main() -> Result<(), Error> {
    let resolution = Resolution::default();
    let mut encoder = Device::<2>::new(EncoderAddress::ZERO, resolution, RATE);
    let behaviour =
        Behaviour::new().with_response_delay_ns(4_000).with_first_read(FirstRead::Ready).with_undetermined(0xdead);
    let behaviour = behaviour.with_reset_shows(Shows::Eighth).with_shown_address(ShownAddress::Old);
    // It counts eight requests of a reset even if others are asked in between.
    encoder.set_behaviour(behaviour.with_restart(Restart::Own));
    encoder.set_id(EncoderId::truncate(0x00_0001));
    encoder.set_position(0x8_0000, 12);
    encoder.set_temperature(Temperature(U10::truncate(1004)));
    encoder.set_eeprom(1, 0x10, 0xffff);
    // The battery was away, and is back.
    encoder.raise_alarms(Alm::BATT | Alm::MTERR);
    encoder.end_alarms(Alm::BATT | Alm::MTERR);

    let mut bench = Bench::new([encoder]);
    let ea = prepare(&mut bench)?;
    let [encoder] = bench.encoders.all;
    println!("encoder {ea} with identification code {:#08x}, {}", encoder.id().get(), encoder.alm(bench.now_ns));
    read(&mut bench, ea)?;
    on_a_bus(&encoder)
}

/// Everything that outlasts the supply, with the encoder alone on the line.
fn prepare(bench: &mut Bench<1>) -> Result<EncoderAddress, Error> {
    let mut id = VerifiedWrite::new(Write::id_of_the_only_encoder(EncoderId::truncate(0x12_3456)));
    bench.run(&mut id)?;
    let ea = EncoderAddress::truncate(5);
    let resets = [Reset::set_address_of_the_only_encoder(ea), Reset::clear_status(ea), Reset::clear_multiturn(ea)];
    for reset in resets.into_iter().chain([Reset::clear_status_and_multiturn(ea)]) {
        println!("{} eight times", reset.command());
        let mut reset = GuardedReset::new(reset);
        bench.run(&mut reset)?;
    }
    let mut word = VerifiedWrite::new(Write::eeprom_of_bank(ea, 1, 0x10, 0x2026));
    bench.run(&mut word)?;
    Ok(ea)
}

/// What it says afterwards.
fn read(bench: &mut Bench<1>, ea: EncoderAddress) -> Result<(), Error> {
    let polling = Polling { interval_ns: 500_000, max_tries: 6 };
    let mut word = EepromRead::of_bank(ea, 1, 0x10).with_polling(polling);
    println!("bank 1: {:#06x}", bench.run(&mut word)?);
    // ES0 is clear in the first response of this encoder, whose data are not determined: trusting it is wrong here.
    let trusting = EepromRead::of_bank(ea, 1, 0x10).knowing_that_none_was_broken_off();
    let mut trusting = trusting.trusting_es0_of_the_first_response();
    println!("wrong: {:#06x}", bench.run(&mut trusting)?);
    let exchange = bench.transact(Request::new(ea, Operation::Temperature))?;
    if let Some(temperature) = exchange.response.temperature() {
        let (above, below) = (temperature.milli_celsius(), temperature.signed_milli_celsius());
        println!("{above} or, if encoders send negative numbers, {below} thousandths of a degree");
    }
    let resolution = Resolution::default();
    let exchange = bench.transact(Request::new(ea, Operation::Abs24Status))?;
    // 24 bits do not hold all of its turns: only the single turn is used.
    let evidence = exchange.evidence(resolution);
    let policy = Policy::new(1_000_000).tolerating(Tolerated::SINGLE_TURN);
    println!("any status bit: {}", exchange.response.has_status());
    match evidence.at(bench.now_ns, policy) {
        Ok(sample) => println!("{} degrees", resolution.degrees_f32(sample.single_turn())),
        Err(doubt) => println!("not to be used: {doubt}"),
    }
    Ok(())
}

/// Two encoders that have the same address by mistake, and one that is not there.
fn on_a_bus(encoder: &Device<2>) -> Result<(), Error> {
    let mut all = [*encoder; 2];
    for (place, device) in (0..).zip(&mut all) {
        device.set_behaviour(Behaviour::new().with_ea(Ea::All).with_place(Some(place)));
        device.set_motion(-1_000, 5);
        device.set_pm_alm(PmAlm::INCW1);
    }
    let mut bench = Bench::new(all);
    let request = Request::new(EncoderAddress::MAX, Operation::Abs24VelAccMt);
    println!("{}: short information field: {}", request.command(), request.command().has_short_information());
    let frames = request.emit();
    let [cdf] = frames.as_slice() else { return Err(Error::NotCarried) };
    println!("into the shift register: {:#010x}", cdf.transmit_word());
    let asked = Addresses::NONE.with(encoder.ea()).with(EncoderAddress::ZERO);
    let mut bus = Bus::new(request.expected(Resolution::default()), asked);
    for answer in bench.encoders.hear(&[Some(cdf.content())], 10_000).into_iter().flatten() {
        bus.push_words(answer.frames.contents(), BitOrder::LsbFirst);
    }
    println!(
        "missing {:08b}, twice {:08b}, {} never started",
        bus.missing().bits(),
        bus.duplicates().bits(),
        bus.not_started()
    );
    Ok(())
}

/// Encoders, a line and a clock.
struct Bench<const N: usize> {
    encoders: Encoders<N, 2>,
    line: Line,
    now_ns: u64,
}

impl<const N: usize> Bench<N> {
    fn new(all: [Device<2>; N]) -> Self {
        let line = Line::new(RATE).with_frame_gap_ns(2_000).with_turn_around_ns(1_000).with_idle_in_response_ns(0);
        Self { encoders: Encoders { all }, line, now_ns: 0 }
    }

    /// One request and its response, the frames carried from one end to the other.
    fn transact(&mut self, request: Request) -> Result<Exchange, Error> {
        let mut transaction = Transaction::start(request, Resolution::default(), self.line, self.now_ns);
        let sent = transaction.transmission();
        self.now_ns = sent.end_ns;
        for answer in self.encoders.hear(sent.frames.units().as_slice(), sent.end_ns).into_iter().flatten() {
            self.now_ns = answer.end_ns;
            let _ = transaction.hear(answer.units().as_slice(), answer.end_ns);
        }
        match transaction.poll(self.now_ns + 10_000_000) {
            Progress::Done { value, .. } => Ok(value),
            Progress::Failed { error, .. } => Err(error),
            Progress::Pending { .. } => unreachable!("10 ms are longer than any time-out"),
        }
    }

    /// A procedure from its start to its end. There is no port that could fail.
    fn run<P>(&mut self, procedure: &mut P) -> Result<P::Value, Error>
    where
        P: Procedure<Request = Request, Response = Response, Error = Error>,
    {
        let Ok(Ended { outcome, ready_ns }) = servowire_core::run(procedure, self.now_ns, |request, not_before_ns| {
            self.now_ns = self.now_ns.max(not_before_ns);
            let outcome = self.transact(request).map(|exchange| exchange.response);
            Ok::<_, Infallible>(Ended { outcome, ready_ns: self.now_ns })
        });
        self.now_ns = self.now_ns.max(ready_ns);
        outcome
    }
}
