//! The receive logic of TI's configurable logic block (CLB) design, for designers who implement it in an FPGA or a CLB.
//!
//! TIDM-1011, section 2.3.6, aligns the clock of an SPI peripheral to the line with one state machine, two counters and
//! two look-up tables. The printed text is missing some negations (LUT_0, LUT_1) and names a state bit s2 that does not exist.
//! The equations here agree with the tables, with the vendor's configuration files, and with each other.
//!
//! ```text
//!             START_OPERATION        tx clocks done        falling edge of the response
//!    IDLE ───────────────▶ TRANSMIT_DATA ────────▶ WAIT_FOR_START ────────▶ RECEIVE_DATA ──┐
//!     00  ◀────────────────── 01 ─────────────────────── 10 ────────────────── 11 ─────────┘
//!                                                                    rx clocks done
//! ```
//!
//! [`State`], [`lut0`] and [`lut1`] are the equations; [`Tile`] runs them cycle by cycle; [`SerialCrc`] is the check
//! register that is clocked with the line bits.

#![expect(clippy::needless_bitwise_bool, reason = "the equations as they are wired")]

servowire_core::codes! {
    /// State of FRAME_STATE, TIDM-1011 tables 2-13 and 2-14. Its code is s1 in bit 1 and s0 in bit 0.
    pub enum State: u8 {
        /// 00: nothing happens.
        Idle = 0 => "IDLE",
        /// 01: the request is being sent.
        TransmitData = 1 => "TRANSMIT_DATA",
        /// 10: the request has been sent and the response has not begun.
        WaitForStart = 2 => "WAIT_FOR_START",
        /// 11: the response is being received.
        ReceiveData = 3 => "RECEIVE_DATA",
    }
}

/// The inputs of the state machine.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Events {
    /// e1, CLOCK_COUNT_COMPLETE.
    pub clock_count_complete: bool,
    /// e0, TRANSMIT_OR_RECEIVE_STARTED.
    pub started: bool,
}

impl State {
    /// State bit s1: the response is awaited or being received.
    pub const fn s1(self) -> bool {
        matches!(self, Self::WaitForStart | Self::ReceiveData)
    }

    /// State bit s0: bits are being clocked.
    pub const fn s0(self) -> bool {
        matches!(self, Self::TransmitData | Self::ReceiveData)
    }

    /// Output of the state machine, s1 | s0: an operation is in progress.
    pub const fn is_active(self) -> bool {
        self.s1() | self.s0()
    }

    /// Returns the next state.
    pub const fn next(self, events: Events) -> Self {
        let Events { clock_count_complete: e1, started: e0 } = events;
        let (s1, s0) = (self.s1(), self.s0());
        let next_s0 = (!s1 & !s0 & e0) | (!s1 & s0 & !e1) | (s1 & s0 & !e1) | (s1 & !s0 & e0);
        let next_s1 = (!s1 & s0 & e1) | (s1 & s0 & !e1) | (s1 & !s0);
        match (next_s1, next_s0) {
            (false, false) => Self::Idle,
            (false, true) => Self::TransmitData,
            (true, false) => Self::WaitForStart,
            (true, true) => Self::ReceiveData,
        }
    }
}

/// Computes LUT_0, which resets the bit counter: i3 | (i0 & s1), with i3 = the counter reached a full bit and i0 = any edge of the
/// response.
pub const fn lut0(full_bit: bool, any_edge: bool, state: State) -> bool {
    full_bit | (any_edge & state.s1())
}

/// Computes LUT_1, which is e0: i0 | (i1 & !s0 & s1), with i0 = rising edge of START_OPERATION and i1 = falling edge of the
/// response.
pub const fn lut1(start: bool, falling_edge: bool, state: State) -> bool {
    start | (falling_edge & !state.s0() & state.s1())
}

/// The check register that is clocked with the data bits of the line: rotate left, XOR the bit into bit 0.
///
/// Fed with fields least significant bit first, in line order, it ends up holding the *bit-reversed* check field, which is also
/// how the SPI shows a field.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct SerialCrc(u8);

impl SerialCrc {
    /// Creates a register that holds 0.
    pub const fn new() -> Self {
        Self(0)
    }

    /// Takes one data bit; start bits and delimiters are left out.
    pub const fn bit(&mut self, bit: bool) {
        self.0 = self.0.rotate_left(1) ^ bit as u8;
    }

    /// Takes the eight data bits of a field in line order.
    pub const fn field(&mut self, byte: u8) {
        let mut rest = byte;
        let mut k = 0_u8;
        while k < 8 {
            self.bit(rest & 1 == 1);
            rest >>= 1;
            k = k.wrapping_add(1);
        }
    }

    /// The register: the bit-reversed check field.
    pub const fn register(self) -> u8 {
        self.0
    }
}

/// The inputs of the tile in one cycle.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Inputs {
    /// A pulse of START_OPERATION.
    pub start: bool,
    /// The level of the receiver's pin.
    pub response: bool,
}

/// The outputs of the tile in one cycle.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Outputs {
    /// State of FRAME_STATE in this cycle.
    pub state: State,
    /// Clock of the SPI; it idles high.
    pub clock: bool,
    /// Whether the clock rises in this cycle, which makes the SPI sample the line.
    pub clock_rises: bool,
    /// Driver enable of the transceiver.
    pub transmit_enable: bool,
}

/// The tile, cycle by cycle: FRAME_STATE, the bit counter (COUNTER_0) and the clock counter (COUNTER_1).
///
/// ```text
///  COUNTER_0   0 ............ d-1 ............ 2d-1     d = CLB clock / (2 x bit rate)
///  SPI clock   low            rises            (full bit)    20 at 100 MHz, 24 at 120 MHz
/// ```
///
/// The response passes a synchroniser of two cycles, so a bit is sampled d + 2 cycles after its edge.
///
/// Like the design, this model assumes that START_OPERATION comes only in IDLE and never together with an edge.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Tile {
    divider: u16,
    tx_clocks: u16,
    rx_clocks: u16,
    state: State,
    counter0: u16,
    clock_high: bool,
    counter1: u16,
    match2: u16,
    transmit_enable: bool,
    /// The response as seen by the edge detector: the values in this cycle and in the one before.
    seen: bool,
    seen_before: bool,
}

impl Tile {
    /// Creates the tile. `divider` is d, half a bit in CLB cycles; `tx_clocks` is 1 plus 10 per field of the request;
    /// `rx_clocks` is 10 per field of the response.
    pub const fn new(divider: u16, tx_clocks: u16, rx_clocks: u16) -> Self {
        Self {
            divider,
            tx_clocks,
            rx_clocks,
            state: State::Idle,
            counter0: 0,
            clock_high: true,
            counter1: 0,
            match2: tx_clocks,
            transmit_enable: false,
            seen: true,
            seen_before: true,
        }
    }

    /// COUNTER_0 match 1: the count at which the clock rises, d - 1.
    pub const fn match1(&self) -> u16 {
        self.divider.saturating_sub(1)
    }

    /// COUNTER_0 match 2: the count of a full bit, 2d - 1.
    pub const fn full_bit(&self) -> u16 {
        self.divider.saturating_mul(2).saturating_sub(1)
    }

    /// Runs one CLB cycle: computes its outputs, then the registers for the next cycle.
    pub const fn cycle(&mut self, inputs: Inputs) -> Outputs {
        let rising = self.state.s0() && self.counter0 == self.divider;
        let outputs = Outputs {
            state: self.state,
            clock: !(self.state.s0() && self.state.is_active()) || self.clock_high,
            clock_rises: rising,
            transmit_enable: self.transmit_enable,
        };
        self.advance(inputs);
        outputs
    }

    const fn advance(&mut self, Inputs { start, response }: Inputs) {
        let edge = self.seen != self.seen_before;
        let falling = edge && !self.seen;
        let at_match1 = self.state.s0() && self.counter0 == self.match1();
        let e1 = self.counter1 == self.match2 && self.counter1 != 0;
        let e0 = lut1(start, falling, self.state);
        let next = self.state.next(Events { clock_count_complete: e1, started: e0 });
        self.transmit_enable = match (self.state, next) {
            (State::Idle, State::TransmitData) => true,
            (State::TransmitData, State::TransmitData) => self.transmit_enable,
            _ => false,
        };
        self.counter1 = match (self.state, next) {
            (State::Idle, _) | (State::WaitForStart, State::ReceiveData) => 0,
            _ if at_match1 => self.counter1.wrapping_add(1),
            _ => self.counter1,
        };
        self.match2 = if next.s1() { self.rx_clocks } else { self.tx_clocks };
        let reset = !self.state.is_active() || lut0(self.counter0 == self.full_bit(), edge, self.state);
        self.clock_high = if reset { false } else { self.clock_high || at_match1 };
        self.counter0 = if reset { 0 } else { self.counter0.wrapping_add(1) };
        self.state = next;
        self.seen_before = self.seen;
        self.seen = response;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::crc;
    use State::{Idle, ReceiveData, TransmitData, WaitForStart};

    /// TIDM-1011, table 2-14: columns e1,e0 = 00, 01, 11, 10.
    #[test]
    fn the_whole_state_table() {
        let table = [
            (Idle, [Idle, TransmitData, TransmitData, Idle]),
            (TransmitData, [TransmitData, TransmitData, WaitForStart, WaitForStart]),
            (ReceiveData, [ReceiveData, ReceiveData, Idle, Idle]),
            (WaitForStart, [WaitForStart, ReceiveData, ReceiveData, WaitForStart]),
        ];
        for (state, next) in table {
            let got = [(false, false), (false, true), (true, true), (true, false)]
                .map(|(clock_count_complete, started)| state.next(Events { clock_count_complete, started }));
            assert_eq!(got, next, "{state:?}");
            assert_eq!(State::from_code(u8::from(state.s1()) << 1 | u8::from(state.s0())), Some(state));
        }
    }

    #[test]
    fn the_register_ends_as_the_reversed_check_field() {
        for (a, b) in (0..=255_u8).zip((0..=255_u8).rev()) {
            let mut register = SerialCrc::new();
            for byte in [a, b, 0x5a] {
                register.field(byte);
            }
            assert_eq!(register.register(), crc(&[a, b, 0x5a]).reverse_bits());
        }
    }

    /// The clock is 1 while nothing is sent or received; else it is low for d cycles and high for d, and rises when it is said to.
    #[test]
    fn the_clock_of_each_bit_is_half_low_and_half_high() {
        const D: u64 = 20;
        let mut tile = Tile::new(20, 11, 60);
        let (mut before, mut level, mut lasted, mut rises) = (Idle, true, 0, 0);
        for cycle in 0..4_000_u64 {
            let out = tile.cycle(Inputs { start: cycle == 59, response: cycle < 700 });
            let busy = matches!(out.state, TransmitData | ReceiveData);
            assert!(busy || out.clock, "{cycle}");
            if busy && out.state == before && out.clock != level {
                assert_eq!(lasted, D, "{cycle}");
                assert!(!out.clock || out.clock_rises, "{cycle}");
                rises += u32::from(out.clock);
            }
            lasted = if out.state == before && out.clock == level { lasted + 1 } else { 1 };
            (before, level) = (out.state, out.clock);
        }
        assert_eq!(rises, 11 + 60);
    }

    #[test]
    fn a_start_and_an_edge_at_once_are_one_event() {
        for state in [Idle, TransmitData, ReceiveData, WaitForStart] {
            assert!(lut1(true, true, state) && lut1(true, false, state));
            assert_eq!(lut1(false, true, state), state == WaitForStart);
        }
    }

    /// A line that is low when it is waited for has to rise and fall.
    #[test]
    fn a_response_begins_with_an_edge() {
        let mut tile = Tile::new(20, 11, 60);
        let mut waited = false;
        for cycle in 0..2_000 {
            let out = tile.cycle(Inputs { start: cycle == 59, response: cycle < 300 });
            waited |= out.state == WaitForStart;
            assert!(out.state != ReceiveData, "{cycle}");
        }
        assert!(waited);
    }

    /// A readout of ID 0 at 100 MHz, d = 20: the cycles at which the states are entered, by the arithmetic of the design.
    #[test]
    fn a_transaction_cycle_by_cycle() {
        let (d, tx, rx) = (20_u64, 11_u64, 60_u64);
        let mut tile = Tile::new(20, 11, 60);
        let mut entered = std::vec![(0, Idle)];
        let (mut rises, mut sampled, mut falls) = (0, std::vec::Vec::new(), u64::MAX);
        for cycle in 0..4000_u64 {
            let bit = cycle.checked_sub(falls).map(|since| since / (2 * d));
            let level = bit.is_none_or(|bit| bit % 3 != 0);
            let out = tile.cycle(Inputs { start: cycle == 59, response: level });
            if entered.last().unwrap().1 != out.state {
                entered.push((cycle, out.state));
                if out.state == WaitForStart {
                    falls = cycle + d - 1 + 300;
                }
            }
            assert_eq!(out.transmit_enable, out.state == TransmitData);
            rises += u64::from(out.clock_rises);
            if out.clock_rises && out.state == ReceiveData {
                assert_eq!((cycle - falls) % (2 * d), d + 2);
                sampled.push(level);
            }
        }
        let wait = 60 + (tx - 1) * 2 * d + d + 1;
        let receive = wait + 300 + d + 1;
        let idle = receive + (rx - 1) * 2 * d + d + 1;
        assert_eq!(
            entered,
            [(0, Idle), (60, TransmitData), (wait, WaitForStart), (receive, ReceiveData), (idle, Idle)]
        );
        assert_eq!(rises, tx + rx);
        assert!(sampled.iter().enumerate().all(|(k, level)| *level == (k % 3 != 0)));
    }
}
