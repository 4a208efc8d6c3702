//! Events on the line, in the order of their times.

use std::cmp::Ordering;
use std::collections::BinaryHeap;
use std::rc::Rc;

use sorte_proto::device::PortId;

use super::node::Sent;
use super::wires::{Arrival, Hit};

/// Something that happens.
pub(super) enum Event {
    /// The master needs to be polled.
    Master,
    /// A device needs to be polled, unless that has happened meanwhile.
    Device {
        k: usize,
        call: u64,
    },
    /// A start-up frame begins at a device's port, or has ended at the master.
    StartUp {
        at: Place,
        port: PortId,
        frame: Vec<u8>,
        preamble: usize,
        hit: Hit,
    },
    /// A device has dealt with a master frame of the exchange.
    Dealt {
        k: usize,
        arrival: Arrival,
        sent: Rc<Sent>,
    },
    /// A device's frame leaves; one has ended at the master.
    Leaves {
        k: usize,
    },
    Answer {
        k: usize,
        arrival: Arrival,
        hit: Hit,
    },
}

#[derive(Clone, Copy)]
pub(super) enum Place {
    Device(usize),
    Master { sof: f64 },
}

/// Future events; those at the same time come in the order in which they were added.
#[derive(Default)]
pub(super) struct Queue {
    heap: BinaryHeap<Due>,
    order: u64,
}

impl Queue {
    pub(super) fn push(&mut self, at: f64, event: Event) {
        self.order += 1;
        self.heap.push(Due { at, order: self.order, event });
    }

    /// Returns the earliest event and its time.
    pub(super) fn pop(&mut self) -> Option<(f64, Event)> {
        self.heap.pop().map(|due| (due.at, due.event))
    }
}

struct Due {
    at: f64,
    order: u64,
    event: Event,
}

impl PartialEq for Due {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for Due {}

impl PartialOrd for Due {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Due {
    /// Makes the earliest event the greatest, because a heap returns that first.
    fn cmp(&self, other: &Self) -> Ordering {
        other.at.total_cmp(&self.at).then(other.order.cmp(&self.order))
    }
}
