//! T-Format: one encoder, one request after the other.

use std::error::Error;

use clap::Args;
use tformat::device::Device;
use tformat::master::{Line, Progress, Transaction};
use tformat::{Adf, BitRate, DataId, Request};

use super::{Bar, LATE, Plan, SOON};
use crate::units::tformat_rate;

/// One Tamagawa T-Format encoder.
#[derive(Debug, Args)]
pub(super) struct Arguments {
    /// Bits per second, 2.5M or 5M.
    #[arg(long, value_name = "HZ", default_value = "2.5M", value_parser = tformat_rate)]
    rate: BitRate,
    /// What to ask for, one hex digit: 0 position, 1 turns, 2 encoder ID, 3 all, 6 and D EEPROM, 7, 8 and C reset.
    #[arg(long, value_name = "ID", default_value = "3", value_parser = data_id)]
    id: DataId,
    /// Length of the cable in metres, 5 ns a metre each way.
    #[arg(long, value_name = "M", default_value_t = 0)]
    cable: u16,
    /// From the end of the request to the response, at the encoder, in ns.
    #[arg(long, value_name = "NS", default_value_t = tformat::RESPONSE_DELAY_NS)]
    turn_around: u32,
    /// From the end of the response to its hand-over to the program, in ns.
    #[arg(long, value_name = "NS", default_value_t = 0)]
    latency: u32,
}

fn data_id(text: &str) -> Result<DataId, String> {
    let code = u8::from_str_radix(text, 16).map_err(|_| format!("\"{text}\" is not a data ID, such as 3 or D"))?;
    DataId::from_code(code).ok_or_else(|| tformat::Error::UnknownDataId { code }.to_string())
}

impl Arguments {
    pub(super) fn plan(&self) -> Result<Plan, Box<dyn Error>> {
        let Self { rate, id, cable, turn_around, latency } = *self;
        let line = Line::new(rate).with_hand_over_ns(latency);
        let way_ns = 5 * i64::from(cable);
        let tformat::Layout { request, response } = id.layout();
        let asked_ns = i64::from(rate.fields_ns(id.request_fields()));
        // As the controller sees it: the request travels there, the response back.
        let answer_ns = asked_ns + 2 * way_ns + i64::from(turn_around);
        let end_ns = answer_ns + i64::from(rate.fields_ns(id.response_fields()));
        let handed_ns = end_ns + i64::from(latency);
        let lead_ns = i64::from(line.driver_lead_ns);
        let bar = |who, what, start_ns, end_ns| Bar { who, what, start_ns, end_ns };
        let bars = vec![
            bar("controller", "driver on".to_owned(), -lead_ns, 0),
            bar("controller", format!("request {}", request.join(" ")), 0, asked_ns),
            bar("line", format!("turn-around, {cable} m of cable there and back"), asked_ns, answer_ns),
            bar("encoder", format!("response {}", response.join(" ")), answer_ns, end_ns),
            bar("controller", "hand-over".to_owned(), end_ns, handed_ns),
        ];
        let request = Request::of(id, Adf::from_bits(0), 0);
        let mut heard = Transaction::start(request, line, 0);
        let answer = Device::<1>::new(0x17, rate).answer(request, 0).ok_or("the encoder is silent")?;
        // A controller looks at its clock until the first field has come.
        let waited_ns = answer_ns + i64::from(rate.fields_ns(1)) + i64::from(latency) - 1;
        if let Progress::Failed { .. } = heard.poll(waited_ns.try_into()?) {
            return Err(LATE.into());
        }
        if !matches!(heard.hear(answer.emit().as_bytes(), end_ns.try_into()?), Progress::Done { .. }) {
            return Err(SOON.into());
        }
        let mut lost = Transaction::start(request, line, 0);
        let fault_ns = match lost.poll(u64::MAX) {
            Progress::Failed { ready_ns, .. } => ready_ns,
            _ => 0,
        };
        let title = format!("T-Format, {id} at {rate}");
        // The driver of the next request may be switched on when the response is over.
        let cycle_ns = u64::try_from(handed_ns + lead_ns).unwrap_or(0);
        Ok(Plan { title, bars, cycle_ns, fault_ns })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plan(rate: BitRate, id: DataId, cable: u16) -> Plan {
        Arguments { rate, id, cable, turn_around: 3_000, latency: 0 }.plan().unwrap()
    }

    /// A controller takes nothing that begins less than four bits after its request, 1.6 us, and waits 10 us.
    #[test]
    fn a_response_that_no_controller_takes() {
        for id in DataId::ALL {
            let plan = |turn_around| Arguments { rate: BitRate::Mbit2_5, id, cable: 0, turn_around, latency: 0 }.plan();
            for (turn_around, want) in [(0, SOON), (1_590, SOON), (10_100, LATE), (20_000, LATE), (u32::MAX, LATE)] {
                assert_eq!(plan(turn_around).unwrap_err().to_string(), want, "{id} after {turn_around} ns");
            }
            assert!([1_600, 3_000, 10_000].map(plan).iter().all(Result::is_ok), "{id}");
        }
        let late =
            Arguments { rate: BitRate::Mbit5, id: DataId::ReadAll, cable: 0, turn_around: 3_000, latency: 60_000 };
        assert!(late.plan().is_ok());
    }

    /// The end of the response, in us, with 3 us of turn-around: IDs 0, 1, 2, 3, 6, 7, 8, C, D.
    #[test]
    fn responses_end_as_the_tables_say() {
        let ends = |rate| DataId::ALL.map(|id| plan(rate, id, 0).bars[3].end_ns / 1000);
        assert_eq!(ends(BitRate::Mbit2_5), [31, 31, 23, 51, 35, 31, 31, 31, 31]);
        assert_eq!(ends(BitRate::Mbit5), [17, 17, 13, 27, 19, 17, 17, 17, 17]);
        // 100 m of cable add 1 us.
        assert_eq!(plan(BitRate::Mbit2_5, DataId::ReadAll, 100).bars[3].end_ns, 52_000);
    }

    /// 4 us, 10 us to the start bit, 44 us: the longest response that may come.
    #[test]
    fn cycle_and_worst_fault() {
        let plan = plan(BitRate::Mbit2_5, DataId::ReadAll, 0);
        assert_eq!((plan.cycle_ns, plan.fault_ns), (52_000, 58_000));
        let text = plan.to_string();
        assert!(text.contains("shortest cycle 52.00 us, 19.2 kHz"), "{text}");
        assert!(text.contains("  encoder        7.00 ..  51.00 us  response CF SF ABS0"), "{text}");
    }

    #[test]
    fn wrong_use_is_refused() {
        assert!(data_id("4").is_err() && data_id("g").is_err());
        assert_eq!(data_id("C"), Ok(DataId::ResetTurnsAndErrors));
    }
}
