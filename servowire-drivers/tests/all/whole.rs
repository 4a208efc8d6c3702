//! A request is whole or was not sent: what an encoder hears through a line driver that software switches, whatever the clock, the
//! processor, the UART and the executor do within the stated worst case.

use std::cell::RefCell;
use std::rc::Rc;

use embedded_hal::digital::{ErrorType as PinErrorType, OutputPin};
use embedded_io::{ErrorKind, ErrorType};
use servowire_drivers::tformat::blocking;
use servowire_drivers::{Clock, ClockError, DirectionPin, Error, PinTooSlow, Worst};
use servowire_world::Draw;
use tformat::master::Line;
use tformat::{Address, BitRate, Request};

/// A look at the clock lasts so long.
const LOOK_NS: u64 = 30;
/// From a reading to the pin there is more than one look.
const LOOKS_NS: u64 = 3 * LOOK_NS;

/// What a UART does with bytes that it is handed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Room {
    /// It takes them all.
    All,
    /// It has a register besides the one that shifts; `write` waits for it.
    One,
    /// It takes this many at a time.
    Pieces(usize),
}

/// What `flush` waits for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Flush {
    Nothing,
    /// The end of the last bit.
    End,
    /// The last byte is in the register that shifts.
    Begin,
}

/// Everything that differs between boards.
#[derive(Debug, Clone, Copy)]
struct Board {
    rate: BitRate,
    /// By how much its bits are longer, in 1/1000.
    slow: u64,
    tick_ns: u64,
    uart_start_ns: u64,
    jitter_ns: u64,
    /// Longest time that passes in software before the UART has what it is handed, and after that.
    soft_ns: u64,
    room: Room,
    flush: Flush,
}

impl Board {
    /// The truth about it. Rate and bytes: a UART that is slow counts as one that begins late.
    fn worst(&self, fields: u64) -> Worst {
        let slow_ns = fields * 10 * u64::from(self.rate.bit_ns()) * self.slow / 1_000;
        Worst {
            uart_start_ns: (self.uart_start_ns + slow_ns) as u32,
            wake_ns: (self.jitter_ns + LOOKS_NS) as u32,
            clock_ns: self.tick_ns as u32,
        }
    }

    /// Four bits.
    fn window_ns(&self) -> u64 {
        4 * u64::from(self.rate.bit_ns())
    }

    fn bit_ps(&self) -> u64 {
        u64::from(self.rate.bit_ns()) * (1_000 + self.slow)
    }
}

struct World {
    board: Board,
    draw: Draw,
    now_ns: u64,
    /// Bytes on the way out of the UART, each with its start.
    sent: Vec<(u64, u8)>,
    /// When the driver was switched, and whether on.
    switched: Vec<(u64, bool)>,
}

impl World {
    fn end_of(&self, begin_ns: u64) -> u64 {
        begin_ns + self.board.bit_ps() / 100
    }

    fn end_ns(&self) -> u64 {
        self.sent.last().map_or(0, |(begin_ns, _)| self.end_of(*begin_ns))
    }

    fn driver_is_on(&self, at_ns: u64) -> bool {
        self.switched.iter().rev().find(|(from_ns, _)| *from_ns <= at_ns).is_some_and(|(_, on)| *on)
    }

    fn tx(&self, at_ns: u64) -> bool {
        let field = self.sent.iter().rev().find(|(begin_ns, _)| *begin_ns <= at_ns);
        field.is_none_or(|(begin_ns, byte)| match (at_ns - begin_ns) * 1_000 / self.board.bit_ps() {
            0 => false,
            bit @ 1..=8 => byte >> (bit - 1) & 1 == 1,
            _ => true,
        })
    }

    /// Nobody drives: the line idles at 1.
    fn line(&self, at_ns: u64) -> bool {
        !self.driver_is_on(at_ns) || self.tx(at_ns)
    }

    /// What an encoder hears, with sixteen samples a bit: bytes, and whether the delimiter was 1.
    fn heard(&self) -> Vec<(u8, bool)> {
        let Some((first_ns, _)) = self.sent.first() else { return Vec::new() };
        let bit_ns = u64::from(self.board.rate.bit_ns());
        let (mut at_ns, mut heard) = (first_ns - 100, Vec::new());
        while at_ns < self.end_ns() + 2 * bit_ns {
            if self.line(at_ns) {
                at_ns += bit_ns / 16;
                continue;
            }
            let middle = |bit: u64| self.line(at_ns + bit * bit_ns + bit_ns / 2);
            let byte = (0..8).map(|bit| u8::from(middle(bit + 1)) << bit).sum();
            heard.push((byte, middle(9)));
            at_ns += 9 * bit_ns + bit_ns / 2;
        }
        heard
    }

    fn soft(&mut self) {
        if self.board.soft_ns > 0 && self.draw.below(4) == 0 {
            self.now_ns += self.draw.below(self.board.soft_ns + 1);
        }
    }

    fn write(&mut self, bytes: &[u8]) -> usize {
        self.soft();
        let most = if let Room::Pieces(most) = self.board.room { most } else { bytes.len() };
        for byte in bytes.iter().take(most) {
            if let (Room::One, [.., (begin_ns, _)]) = (self.board.room, &*self.sent) {
                self.now_ns = self.now_ns.max(*begin_ns);
            }
            let late_ns = self.draw.below(self.board.uart_start_ns + 1);
            let begin_ns = (self.now_ns + late_ns).max(self.end_ns());
            self.sent.push((begin_ns, *byte));
        }
        self.soft();
        most.min(bytes.len())
    }

    fn flush(&mut self) {
        let begin_ns = self.sent.last().map_or(0, |(begin_ns, _)| *begin_ns);
        self.now_ns = self.now_ns.max(match self.board.flush {
            Flush::Nothing => 0,
            Flush::Begin => begin_ns,
            Flush::End => self.end_ns(),
        });
    }

    fn switch(&mut self, on: bool) {
        self.now_ns += self.draw.below(self.board.jitter_ns + 1);
        self.switched.push((self.now_ns, on));
    }
}

#[derive(Clone)]
struct Bench(Rc<RefCell<World>>);

impl Bench {
    fn new(board: Board, draw: Draw) -> Self {
        let (sent, switched) = (Vec::new(), Vec::new());
        Self(Rc::new(RefCell::new(World { board, draw, now_ns: 1_000_000, sent, switched })))
    }
}

impl Clock for Bench {
    fn now_ns(&mut self) -> Result<u64, ClockError> {
        let mut world = self.0.borrow_mut();
        world.now_ns += LOOK_NS;
        Ok(world.now_ns / world.board.tick_ns * world.board.tick_ns)
    }
}

impl PinErrorType for Bench {
    type Error = core::convert::Infallible;
}

impl OutputPin for Bench {
    fn set_low(&mut self) -> Result<(), Self::Error> {
        self.0.borrow_mut().switch(false);
        Ok(())
    }

    fn set_high(&mut self) -> Result<(), Self::Error> {
        self.0.borrow_mut().switch(true);
        Ok(())
    }
}

impl ErrorType for Bench {
    type Error = ErrorKind;
}

impl embedded_io::Write for Bench {
    fn write(&mut self, bytes: &[u8]) -> Result<usize, ErrorKind> {
        Ok(self.0.borrow_mut().write(bytes))
    }

    fn flush(&mut self) -> Result<(), ErrorKind> {
        self.0.borrow_mut().flush();
        Ok(())
    }
}

impl embedded_io::ReadReady for Bench {
    fn read_ready(&mut self) -> Result<bool, ErrorKind> {
        Ok(false)
    }
}

impl embedded_io::Read for Bench {
    fn read(&mut self, _: &mut [u8]) -> Result<usize, ErrorKind> {
        Err(ErrorKind::Other)
    }
}

/// How a call ended: what was refused when the driver was made, or by how much the driver was late as far as the caller was told.
type Ended = Result<u64, PinTooSlow>;

fn block(bench: &Bench, worst: Worst, request: Request) -> Ended {
    let line = Line::new(bench.0.borrow().board.rate);
    let pin = DirectionPin::new(bench.clone(), worst);
    let mut encoder = blocking::Driver::new(bench.clone(), pin, bench.clone(), line)?;
    Ok(told(encoder.transact(request).unwrap_err(), encoder.late_ns()))
}

/// A caller whose exchange fails is told.
fn told(error: Error<ErrorKind, core::convert::Infallible, tformat::Error, tformat::Doubt>, late_ns: u64) -> u64 {
    match error {
        Error::DriverLate { by_ns } => assert_eq!(by_ns, late_ns),
        Error::Protocol(_) => assert_eq!(late_ns, 0),
        other => panic!("{other:?}"),
    }
    late_ns
}

/// Requests, and the bytes that they are, by the tables of the drivers that are known.
fn requests() -> [(Request, &'static [u8]); 9] {
    let address = Address::new(1).unwrap();
    [
        (Request::ReadSingleTurn, &[0x02]),
        (Request::ReadMultiTurn, &[0x8a]),
        (Request::ReadEncoderId, &[0x92]),
        (Request::ReadAll, &[0x1a]),
        (Request::ResetErrors, &[0xba]),
        (Request::SetSingleTurnZero, &[0xc2]),
        (Request::ResetTurnsAndErrors, &[0x62]),
        (Request::read_eeprom(address), &[0xea, 0x01, 0xeb]),
        (Request::write_eeprom(address, 0x5a), &[0x32, 0x01, 0x5a, 0x69]),
    ]
}

/// What an encoder takes for a request.
fn taken(heard: &[(u8, bool)]) -> Vec<Vec<u8>> {
    let (mut at, mut taken) = (0, Vec::new());
    while let Some((cf, framed)) = heard.get(at) {
        let fields = match cf {
            0x02 | 0x8a | 0x92 | 0x1a | 0xba | 0xc2 | 0x62 => 1,
            0xea => 3,
            0x32 => 4,
            _ => 0,
        };
        let Some(frame) = heard.get(at..at + fields).filter(|frame| !frame.is_empty() && *framed) else {
            at += 1;
            continue;
        };
        let bytes: Vec<_> = frame.iter().map(|(byte, _)| *byte).collect();
        let sound = fields == 1 || bytes.iter().fold(0, |sum, byte| sum ^ byte) == 0;
        if sound && frame.iter().all(|(_, framed)| *framed) {
            taken.push(bytes);
        }
        at += fields;
    }
    taken
}

fn pick<T: Copy>(draw: &mut Draw, from: &[T]) -> T {
    from[draw.below(from.len() as u64) as usize]
}

fn board(draw: &mut Draw) -> Board {
    Board {
        rate: pick(draw, &[BitRate::Mbit2_5, BitRate::Mbit5]),
        slow: pick(draw, &[0, 0, 5, 12]),
        tick_ns: pick(draw, &[1, 6, 25, 50, 100, 250, 1_000]),
        uart_start_ns: pick(draw, &[0, 80, 200, 400, 900]),
        jitter_ns: pick(draw, &[0, 60, 200, 500, 1_100]),
        soft_ns: pick(draw, &[0, 0, 900, 3_900, 4_000, 12_000, 1_000_000]),
        room: pick(draw, &[Room::All, Room::One, Room::Pieces(1), Room::Pieces(2)]),
        flush: pick(draw, &[Flush::Nothing, Flush::Begin, Flush::End]),
    }
}

/// Judges what happened on the line; `late_ns`: what the caller was told, if the call came to its end.
fn judge(bench: &Bench, bytes: &[u8], late_ns: Option<u64>, what: &str) {
    let world = bench.0.borrow();
    let (board, heard) = (world.board, world.heard());
    let what = format!("{what}: {board:?}, {bytes:02x?} heard as {heard:02x?}");
    assert!(taken(&heard).iter().all(|request| request == bytes), "{what}");
    assert!(!world.driver_is_on(u64::MAX), "{what}");
    let Some((begin_ns, _)) = world.sent.first() else { return };
    // What passes unseen between two fields of a request may cost its end, which makes no other request of it.
    if bytes.len() == 1 || board.soft_ns == 0 {
        let sent: Vec<_> = world.sent.iter().map(|(_, byte)| (*byte, true)).collect();
        assert_eq!(heard, sent, "{what}");
    }
    let on_ns = world.switched.iter().find(|(_, on)| *on).unwrap().0;
    assert!(on_ns + 1_000 <= *begin_ns, "{what}");
    let Some(late_ns) = late_ns else { return };
    let off_ns = world.switched.last().unwrap().0;
    let in_time = off_ns <= world.end_ns() + board.window_ns();
    assert!(in_time || late_ns > 0, "not told: {what}");
    if board.soft_ns == 0 && board.slow == 0 {
        assert!(in_time && late_ns == 0, "{late_ns}: {what}");
    }
}

#[test]
fn no_request_is_ever_heard_as_another() {
    let (mut draw, mut refused, mut late) = (Draw::default(), 0, 0);
    for case in 0..20_000 {
        let board = board(&mut draw);
        let (request, bytes) = pick(&mut draw, &requests());
        let (bench, worst) = (Bench::new(board, draw), board.worst(bytes.len() as u64));
        match block(&bench, worst, request) {
            Ok(late_ns) => {
                late += u32::from(late_ns > 0);
                judge(&bench, bytes, Some(late_ns), &format!("case {case}"));
            }
            Err(error) => {
                let needed_ns = worst.uart_start_ns + worst.wake_ns + 2 * worst.clock_ns;
                let window_ns = board.window_ns() as u32;
                assert_eq!(error, PinTooSlow { missing_ns: needed_ns - window_ns, window_ns });
                refused += 1;
            }
        }
        draw = bench.0.borrow().draw;
    }
    println!("20000 requests: {refused} refused when the driver was made, {late} with a late driver");
    assert!((6_000..14_000).contains(&refused) && late > 1_000, "{refused} {late}");
}

/// Each number of the worst case understated: then the line shows it.
#[test]
fn an_understated_worst_case_breaks_it() {
    let board = Board {
        rate: BitRate::Mbit2_5,
        slow: 0,
        tick_ns: 10,
        uart_start_ns: 0,
        jitter_ns: 0,
        soft_ns: 0,
        room: Room::All,
        flush: Flush::Nothing,
    };
    let told = Worst { uart_start_ns: 0, wake_ns: 100, clock_ns: 10 };
    let counts = |board: Board| {
        let (mut draw, mut other, mut late) = (Draw::default(), 0, 0);
        for _ in 0..1_000 {
            let bench = Bench::new(board, draw);
            let late_ns = block(&bench, told, Request::ReadSingleTurn).unwrap();
            let world = bench.0.borrow();
            other += u32::from(world.heard() != [(0x02, true)]);
            let (off_ns, _) = world.switched.last().unwrap();
            let is_late = *off_ns > world.end_ns() + board.window_ns();
            assert!(!is_late || late_ns > 0);
            late += u32::from(is_late);
            draw = world.draw;
        }
        [other, late]
    };
    assert_eq!(counts(board), [0, 0]);
    let [cut, _] = counts(Board { uart_start_ns: 2_400, ..board });
    assert!(cut > 100, "the UART begins late: {cut}");
    // The wait before the request ends with a tick, so something has to delay it.
    let [cut, _] = counts(Board { tick_ns: 5_000, soft_ns: 4_900, ..board });
    assert!(cut > 100, "the clock is coarse: {cut}");
    let [cut, late] = counts(Board { jitter_ns: 2_400, ..board });
    assert!(cut == 0 && late > 100, "the pin is late: {cut} {late}");
    // And as the truth it is refused, with what is missing.
    for (worst, missing_ns) in [
        (Worst { uart_start_ns: 2_400, ..told }, 920),
        (Worst { clock_ns: 5_000, ..told }, 8_500),
        (Worst { wake_ns: 2_500, ..told }, 920),
    ] {
        let refused = block(&Bench::new(board, Draw::default()), worst, Request::ReadSingleTurn);
        assert_eq!(refused, Err(PinTooSlow { missing_ns, window_ns: 1_600 }));
    }
}

#[cfg(feature = "async")]
mod asynch {
    use servowire_drivers::tformat::{Released, asynch};

    use super::*;
    use crate::polls::{FOR_EVER, Looks, forget, pause, run};

    impl embedded_io_async::Write for Bench {
        async fn write(&mut self, bytes: &[u8]) -> Result<usize, ErrorKind> {
            pause().await;
            let count = self.0.borrow_mut().write(bytes);
            Ok(count)
        }

        async fn flush(&mut self) -> Result<(), ErrorKind> {
            self.0.borrow_mut().flush();
            Ok(())
        }
    }

    impl embedded_io_async::Read for Bench {
        async fn read(&mut self, _: &mut [u8]) -> Result<usize, ErrorKind> {
            std::future::pending().await
        }
    }

    /// A future that was forgotten at any of its polls has left the line driver on. The next call does not cut its request off, not
    /// even one of a driver that was made anew.
    #[test]
    fn nor_one_of_which_the_future_was_forgotten() {
        let (mut draw, mut on, mut going) = (Draw::default(), 0, 0);
        for case in 0..12_000 {
            let board = Board { tick_ns: 6, soft_ns: 0, jitter_ns: 60, ..board(&mut draw) };
            let (request, bytes) = pick(&mut draw, &requests());
            let polls = draw.below(3_500) as usize;
            let bench = Bench::new(board, draw);
            let pin = DirectionPin::new(bench.clone(), board.worst(bytes.len() as u64));
            let driver = asynch::Driver::new(bench.clone(), pin, Looks(bench.clone()), Line::new(board.rate));
            if let Ok(mut encoder) = driver {
                forget(encoder.transact(request), polls);
                let (forgotten, now_ns) = (bench.0.borrow().sent.len(), bench.0.borrow().now_ns);
                on += u32::from(bench.0.borrow().driver_is_on(u64::MAX));
                going += u32::from(bench.0.borrow().end_ns() > now_ns);
                if draw.below(2) == 0 {
                    let Released { uart, direction, clock } = encoder.release();
                    encoder = asynch::Driver::new(uart, direction, clock, Line::new(board.rate)).unwrap();
                }
                let _ = run(encoder.transact(Request::ReadEncoderId), FOR_EVER);
                let world = bench.0.borrow();
                let sent: Vec<_> = world.sent.iter().map(|(_, byte)| (*byte, true)).collect();
                let what = format!("case {case}, {polls} polls, {forgotten} bytes of {bytes:02x?}, {board:?}");
                assert_eq!(world.heard(), sent, "{what}");
                assert!(!world.driver_is_on(u64::MAX), "{what}");
            }
            draw = bench.0.borrow().draw;
        }
        println!("forgotten with the driver on: {on}, while the request was going out: {going}");
        assert!(on > 200 && going > 200, "{on} {going}");
    }

    /// Futures, half of them dropped at any of their polls.
    #[test]
    fn no_request_is_ever_heard_as_another() {
        let (mut draw, mut dropped) = (Draw::default(), 0);
        for case in 0..20_000 {
            let board = board(&mut draw);
            let (request, bytes) = pick(&mut draw, &requests());
            let polls = if draw.below(2) == 0 { draw.below(4_000) as usize } else { FOR_EVER };
            let bench = Bench::new(board, draw);
            let pin = DirectionPin::new(bench.clone(), board.worst(bytes.len() as u64));
            let driver = asynch::Driver::new(bench.clone(), pin, Looks(bench.clone()), Line::new(board.rate));
            if let Ok(mut encoder) = driver {
                let ended = run(encoder.transact(request), polls);
                let late_ns = ended.map(|ended| told(ended.unwrap_err(), encoder.late_ns()));
                dropped += u32::from(late_ns.is_none());
                judge(&bench, bytes, late_ns, &format!("case {case}, {polls} polls"));
            }
            draw = bench.0.borrow().draw;
        }
        println!("{dropped} futures dropped");
        assert!(dropped > 1_000, "{dropped}");
    }
}
