//! What fits into a cycle: end times for lines of 1 to 12 devices, and how long the cycle has to be.
//!
//! `cargo run -p sorte-proto --example line -- [line delay in ns]`

use sorte_proto::Parameters;
use sorte_proto::sync0::CMP7_NS;
use sorte_proto::timing::{CNC_CYCLE_NS, GAP_NS, Limit, Timing};

fn main() {
    let line_delay = std::env::args().nth(1).and_then(|text| text.parse().ok()).unwrap_or(85);
    println!("line delay {line_delay} ns between any two; 4 output bytes and 3 payload bytes a device\n");
    println!("devices  master frame at the last  last frame at the master  shortest cycle  limited by");
    for devices in (1..=12).chain([32, 100, 254]) {
        let budget = Timing::new(&[line_delay], devices).budget();
        let limit = if budget.limit() == Limit::MasterFrame { "the way out" } else { "the way back" };
        println!(
            "{devices:7}  {:21} ns  {:21} ns  {:11} ns  {limit}{}",
            budget.master_frame_at_last_ns,
            budget.device_frames_at_master_ns,
            budget.min_cycle_ns(),
            match (budget.fits(CNC_CYCLE_NS), budget.same_cycle(CMP7_NS.into())) {
                (true, true) => ", fits 4 us",
                (true, false) => ", fits 4 us, but only with 16 output bytes do all devices act in the same cycle",
                (false, _) => "",
            },
        );
    }
    println!("\ncycle times that the vendor names, and the devices that they have room for");
    for cycle_ns in Parameters::CYCLE_TIMES_NS.into_iter().rev() {
        let fits = |devices: &u8| Timing::new(&[line_delay], *devices).misfit(cycle_ns).is_none();
        println!("{:9} us  {:3}", f64::from(cycle_ns) / 1e3, (1..=254).take_while(fits).last().unwrap_or(0));
    }
    let named = Parameters::GAPS_NS;
    println!(
        "gaps that the vendor names: {named:?} ns; PARAM announces {} ns, the exchange is laid out for {GAP_NS} ns",
        Parameters::STOCK.gap_ns()
    );
}
