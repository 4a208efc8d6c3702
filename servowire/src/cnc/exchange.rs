//! One cycle of the IO exchange over the line.

use sorte_proto::device::State;
use sorte_proto::follow::InputSlice;
use sorte_proto::master::Heard;
use sorte_proto::timing::BYTE_NS;
use sorte_proto::{DeviceFrame, MasterFrameView, Pto, TRANSIT_NS};

use super::line::Line;
use super::node::Received;
use super::record::Recorder;

/// Trigger of the master frame in its cycle.
const TRIGGER_NS: u64 = 500;
/// Preamble of the frames of the exchange.
const PREAMBLE: usize = 2;
/// From the end of the master frame until the device has checked it and taken its slice: 119 instructions of the
/// published receive path, and the table of its CRC.
const RECEIVE_NS: f64 = 800.0;
const DEVICE_FRAME: usize = DeviceFrame::<{ InputSlice::LEN }>::LEN;
/// Generator period that a step is made in: the second after the cycle that brought its word.
const PERIOD_NS: f64 = 4000.0;

impl Line {
    /// `words`: one for each axis.
    pub(super) fn cycle(&mut self, at_ns: u64, time_stamp: u16, cycle: u64, words: &[Pto], record: &mut Recorder) {
        self.incidents(cycle);
        self.now_ns = at_ns;
        let begin = (at_ns - TRIGGER_NS) as f64;
        let cycle_ns = u64::from(self.setup.cycle_ns());
        let positions = self.setup.positions;
        let [mut sent, mut frame] = core::mem::take(&mut self.buffers);
        self.build(words, time_stamp, &mut sent);
        frame.clone_from(&sent);
        record.exchange(at_ns, &sent, false);

        for node in &mut self.nodes {
            node.enter(begin, cycle_ns);
        }
        // What the devices tell in this cycle they knew before its master frame was there.
        self.answers(begin, cycle_ns, record);
        let wire_ns = (PREAMBLE + frame.len()) as f64 * f64::from(BYTE_NS);
        let acts = begin + cycle_ns as f64 + PERIOD_NS;
        let mut sof = at_ns as f64;
        for k in 0..self.nodes.len() {
            let jitter = self.jitter();
            let cable = self.cable(k);
            let Some(node) = self.nodes.get_mut(k) else { break };
            if node.is_running() {
                record.axis(k, |seen| node.run(cycle_ns, &mut self.periods, seen));
            }
            if k >= self.plugged {
                continue;
            }
            sof += cable;
            self.noise.pass(&mut frame);
            let done = sof + wire_ns + RECEIVE_NS;
            node.receive(&Received { frame: &frame, sent: &sent, sof: sof + jitter, done, acts, cycle_ns, positions });
            sof += f64::from(TRANSIT_NS);
        }
        for node in &mut self.nodes {
            if node.device.state() == State::Exchange {
                node.device.cycle_start();
            }
            node.leave(cycle_ns, &mut self.periods);
        }
        self.buffers = [sent, frame];
    }

    /// What was to happen in a cycle that never came.
    pub(super) fn still_to_come(&self) -> Option<String> {
        let cycles = self.master.counters().cycles;
        let unplug = self.setup.unplug.filter(|(_, when)| *when >= cycles);
        let fault = self.setup.driver_fault.filter(|(_, when, _)| *when >= cycles);
        unplug
            .map(|(device, when)| {
                format!("cycle {when}, in which the cable in front of device {device} was to be pulled")
            })
            .or(fault
                .map(|(device, when, _)| format!("cycle {when}, in which the driver of device {device} was to fail")))
    }

    /// What was to happen in this cycle.
    fn incidents(&mut self, cycle: u64) {
        if let Some((device, _)) = self.setup.unplug.filter(|(_, when)| *when == cycle) {
            self.event(format!("cycle {cycle}: the cable in front of device {device} is pulled"));
            self.plug(device - 1);
        }
        if let Some((device, _, fault)) = self.setup.driver_fault.filter(|(_, when, _)| *when == cycle) {
            self.event(format!("cycle {cycle}: the driver of device {device} {fault}"));
            if let Some(node) = self.nodes.get_mut(device - 1) {
                node.axis.driver.hit(fault);
            }
        }
    }

    fn build(&mut self, words: &[Pto], time_stamp: u16, into: &mut Vec<u8>) {
        let len = usize::from(self.master.output_len());
        let mut output = core::mem::take(&mut self.output);
        output.clear();
        for (node, word) in self.nodes.iter_mut().zip(words) {
            output.extend(node.ask(*word, self.setup.positions).emit());
        }
        output.resize(len, 0);
        into.resize(len + MasterFrameView::OVERHEAD, 0);
        // The length is the line's.
        let _: Result<_, _> = self.master.emit_into(&output, time_stamp, into);
        self.output = output;
    }

    /// The devices' frames travel back, each over the cables before it.
    fn answers(&mut self, begin: f64, cycle_ns: u64, record: &mut Recorder) {
        let positions = self.setup.positions;
        let (mut way, mut line_free) = (0.0, f64::NEG_INFINITY);
        for k in 0..self.plugged {
            way += self.cable_back(k) + if k > 0 { f64::from(TRANSIT_NS) } else { 0.0 };
            let Some(node) = self.nodes.get_mut(k) else { return };
            let Some((sent, input)) = node.answer(cycle_ns, positions) else { continue };
            let Some(answer) = node.device.answer(input.emit()) else { continue };
            let mut frame = [0; DEVICE_FRAME];
            if answer.emit_into(&mut frame).is_err() {
                continue;
            }
            self.noise.travel(&mut frame, k + 1);
            let start = sent + way;
            let end = start + ((PREAMBLE + DEVICE_FRAME) * BYTE_NS as usize) as f64;
            if start < line_free {
                // Two frames on one wire: what comes out is neither.
                self.collisions += 1;
                frame = frame.map(|byte| byte ^ 0x55);
            } else if line_free.is_finite() {
                self.gap_ns = self.gap_ns.min(start - line_free);
            }
            line_free = end;
            record.exchange(start.max(begin) as u64, &frame, true);
            if end > begin + cycle_ns as f64 {
                self.overruns += 1;
                continue;
            }
            // What the master refuses, it counts.
            let heard = self.master.hear(&frame, start.max(begin) as u64).ok().and_then(Heard::device);
            if let Some(payload) = heard.and_then(|frame| frame.payload().first_chunk()) {
                node.reported(InputSlice::parse(*payload), positions);
            }
        }
    }
}
