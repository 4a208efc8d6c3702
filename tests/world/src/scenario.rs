use crate::{Delivery, Host, Planned, Rates, Script, Stamp};

/// A host and what happens to it: all that a run depends on, so that it can be printed and repeated.
#[derive(Debug, Clone, PartialEq)]
pub struct Scenario {
    /// The host.
    pub host: Host,
    /// The faults.
    pub script: Script,
}

impl Scenario {
    /// A good line and a host that hears at once.
    pub fn quiet() -> Self {
        Self { host: Host::IDEAL, script: Script::planned(Vec::new()) }
    }

    /// Random faults at random places and a random host.
    pub fn random(seed: u64, rates: Rates) -> Self {
        let mut script = Script::random(seed, rates);
        let host = decode_host(script.noise().to_le_bytes(), rates.longest_ns.min(4_000));
        Self { host, script }
    }

    /// Any bytes, as a fuzzer has them: eight for the host, then six for each fault; too few are filled with zeros.
    pub fn decode(bytes: &[u8]) -> Self {
        let mut head = [0; 8];
        head.iter_mut().zip(bytes).for_each(|(to, from)| *to = *from);
        let planned = bytes.get(8..).unwrap_or_default().chunks_exact(6).map(|six| {
            let mut array = [0; 6];
            array.copy_from_slice(six);
            Planned::decode(array)
        });
        Self { host: decode_host(head, 4_000), script: Script::planned(planned.collect()) }
    }
}

fn decode_host([flags, mode, latency, latency_high, idle, idle_high, units, fifo]: [u8; 8], longest_ns: u32) -> Host {
    let latency_ns = u32::from(u16::from_le_bytes([latency, latency_high])) % (longest_ns + 1);
    let idle_ns = u32::from(u16::from_le_bytes([idle, idle_high])) % 8_000;
    let delivery = match mode % 4 {
        0 | 1 => Delivery::Each,
        2 => Delivery::Blocks { units: 1 + units % 16, idle_ns },
        _ => Delivery::Idle { idle_ns },
    };
    let stamp = if flags & 4 == 0 { Stamp::Line } else { Stamp::Handler };
    let fifo = if flags & 8 == 0 { 0 } else { 1 + fifo % 32 };
    Host { echo: flags & 2 != 0, delivery, stamp, latency_ns, fifo }
}

/// The same for `proptest`: what fails is cut down to the fewest faults.
#[cfg(feature = "proptest")]
pub(crate) mod strategy {
    use super::{Planned, Scenario, Script, decode_host};
    use proptest::prelude::*;

    /// Up to `most` planned faults in the first `transmissions` transmissions.
    pub fn faults(transmissions: u8, most: usize) -> impl Strategy<Value = Vec<Planned>> {
        let one = any::<[u8; 6]>().prop_map(move |[transmission, rest @ ..]| {
            let [unit, kind, a, b, c] = rest;
            Planned::decode([transmission % transmissions.max(1), unit, kind, a, b, c])
        });
        prop::collection::vec(one, 0..=most)
    }

    /// Any host, and up to `most` planned faults in the first `transmissions` transmissions.
    pub fn scenarios(transmissions: u8, most: usize) -> impl Strategy<Value = Scenario> {
        (any::<[u8; 8]>(), faults(transmissions, most))
            .prop_map(|(host, planned)| Scenario { host: decode_host(host, 4_000), script: Script::planned(planned) })
    }
}
