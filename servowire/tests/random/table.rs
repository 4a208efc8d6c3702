//! The conditions under which captures are drawn, and the table of how many come out right.

use super::judge::judge;
use super::rng::Rng;
use super::speech::Kind;
use super::wire::{Scene, capture};

/// A condition by its name.
pub struct Condition {
    pub name: &'static str,
    pub scene: fn(&mut Rng) -> Scene,
}

macro_rules! conditions {
    ($($name:literal: |$rng:pat_param, $scene:ident| $change:expr;)*) => {
        pub const CONDITIONS: &[Condition] = &[$(Condition {
            name: $name,
            scene: |$rng| {
                let mut $scene = Scene::clean();
                $change;
                $scene
            },
        }),*];
    };
}

conditions! {
    "clean": |_, scene| scene.samples = None;
    "both rates off by up to 2 %": |_, scene| scene.rate = 0.02;
    "encoder off by up to 4 %": |_, scene| scene.encoder = 0.04;
    "4 to 6 samples a bit": |_, scene| scene.samples = Some((4.0, 6.0));
    "6 to 40 samples a bit": |_, scene| scene.samples = Some((6.0, 40.0));
    "inverted": |_, scene| scene.inverted = true;
    "edges jitter by 10 % of a bit": |_, scene| scene.jitter = 0.1;
    "1 to 6 spikes": |_, scene| scene.spikes = (1, 6);
    "ringing after 5 to 100 % of the edges": |rng, scene| scene.ringing = rng.pick(&[0.05, 0.1, 0.2, 0.5, 1.0]);
    "2 to 7 decoys": |_, scene| scene.decoys = (2, 7);
    "a UART of 2.5 Mbit/s beside": |_, scene| scene.stranger = true;
    "idle for 1 to 200 ms at first": |_, scene| scene.idle = (1.0, 200.0);
    "requests and answers apart": |_, scene| scene.apart = true;
    "transmit signal beside the pair": |_, scene| scene.transmit = true;
    "begins inside a frame": |_, scene| scene.inside = true;
    "two encoders": |_, scene| scene.encoders = 2;
    "1 to 3 transactions": |_, scene| scene.transactions = (1, 3);
    "a quarter of the answers missing": |_, scene| scene.missing = 0.25;
    "mixtures": |rng, scene| {
        scene.samples = Some((6.0, 40.0));
        scene.rate = rng.pick(&[0.0, 0.01]);
        scene.encoder = rng.pick(&[0.0, 0.02]);
        scene.inverted = rng.chance(0.3);
        scene.jitter = rng.pick(&[0.0, 0.05]);
        scene.ringing = rng.pick(&[0.0, 0.1]);
        scene.decoys = (0, 4);
        scene.stranger = rng.chance(0.3);
        scene.inside = rng.chance(0.2);
        scene.transmit = rng.chance(0.2);
        scene.missing = rng.pick(&[0.0, 0.1]);
    };
}

/// One line of the table.
#[derive(Debug)]
pub struct Row {
    pub condition: &'static str,
    pub kind: Kind,
    pub captures: u32,
    pub right: u32,
    pub wrong: usize,
    /// Those that are not right: seed, why, what was said.
    pub faults: Vec<(u64, String, String)>,
}

/// Draws `captures` captures under a condition, from number `first` on.
pub fn row(condition: &Condition, kind: Kind, first: u64, captures: u32) -> Row {
    let mut row = Row { condition: condition.name, kind, captures, right: 0, wrong: 0, faults: Vec::new() };
    for k in first..first + u64::from(captures) {
        let seed = k * 7919 + condition.name.len() as u64 * 104_729 + kind as u64 * 31;
        let scene = (condition.scene)(&mut Rng::new(seed ^ 0x5eed));
        let outcome = judge(&capture(kind, &scene, seed), scene.inside);
        row.right += u32::from(outcome.right);
        row.wrong += outcome.wrong;
        if !outcome.right {
            row.faults.push((seed, outcome.why, outcome.notes));
        }
    }
    row
}
