//! Where a `Mover` turns round: DIR as a timer has it that is loaded with `turn` after each request, and the steps on either side.

use step_motion::{Clock, Direction, Limits, Mover};

/// DIR of a driver, and what its user does.
struct Driver {
    mover: Mover,
    pause: u64,
    now: u64,
    dir: Direction,
    edge: Option<u64>,
    last: Option<u64>,
    turns: u32,
}

impl Driver {
    /// 8000 steps/s and 800,000 steps/s².
    fn new(pause: u32) -> Self {
        let limits = Limits::new(8000, 800_000).unwrap();
        let mover = Mover::new(Clock::MICROSECONDS, limits).unwrap().with_reversal_pause(pause);
        let (now, dir, edge, last) = (0, Direction::Forward, None, None);
        Self { mover, pause: pause.into(), now, dir, edge, last, turns: 0 }
    }

    /// Time goes on. Half of the pause lies between an edge and the steps on either side, and never none.
    fn until(&mut self, time: u64) {
        loop {
            let turn = self.mover.turn().filter(|_| self.dir != self.mover.direction());
            let due = self.mover.due();
            let Some(next) = turn.into_iter().chain(due).min().filter(|next| *next <= time) else { break };
            self.now = next;
            let half = (self.pause / 2).max(1);
            if turn == Some(next) {
                let before = self.last.map_or(half, |last| next - last);
                assert!(before >= half, "DIR {before} ticks after a step at {next}, pause {}", self.pause);
                (self.dir, self.edge) = (self.mover.direction(), Some(next));
            } else {
                let pulse = self.mover.pulse().unwrap();
                assert_eq!((pulse.tick, pulse.direction), (next, self.dir), "DIR at a step");
                if let Some(edge) = self.edge.take() {
                    assert!(
                        next - edge >= half,
                        "a step {} ticks after DIR at {edge}, pause {}",
                        next - edge,
                        self.pause
                    );
                    self.turns += 1;
                }
                self.last = Some(next);
            }
        }
        self.now = self.now.max(time);
    }

    /// A request never moves the change of DIR to a time before it.
    fn ask(&mut self, ask: impl FnOnce(&mut Mover, u64)) {
        let before = self.mover.turn();
        ask(&mut self.mover, self.now);
        let turn = self.mover.turn().filter(|turn| Some(*turn) != before);
        assert!(turn.is_none_or(|turn| turn >= self.now), "DIR is to change at {turn:?}, asked at {}", self.now);
    }
}

/// At 1 step/s, and faster from any moment before the first step of the way back.
#[test]
fn a_way_back_that_is_made_faster_keeps_its_pause() {
    for (pause, at) in [0, 40, 900, 20_000].into_iter().flat_map(|pause| (0..40).map(move |at| (pause, at * at * 320)))
    {
        let mut driver = Driver::new(pause);
        driver.ask(|mover, now| mover.move_to(50, now).unwrap());
        driver.until(100_000);
        driver.ask(|mover, now| mover.run(Direction::Reverse, 1, now).unwrap());
        driver.until(100_000 + at);
        driver.ask(|mover, now| mover.run(Direction::Reverse, 8000, now).unwrap());
        driver.until(1_000_000);
        assert!(driver.mover.commanded() < -1000 && driver.turns == 1);
    }
}

#[test]
fn dir_has_half_of_the_pause_on_either_side_whatever_is_asked() {
    for pause in [0, 1, 40, 900, 20_000] {
        let mut driver = Driver::new(pause);
        let mut dice = u64::from(pause);
        let mut below = |most: u64| {
            dice = dice.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (dice >> 33) % most
        };
        for _ in 0..4000 {
            let place = i64::try_from(below(60)).unwrap() - 30;
            let speed = [1, 20, 700, 8000][usize::try_from(below(4)).unwrap()];
            let way = if below(2) == 0 { Direction::Forward } else { Direction::Reverse };
            match below(9) {
                0 | 1 => driver.ask(|mover, now| _ = mover.move_to(place, now)),
                2 | 3 => driver.ask(|mover, now| _ = mover.run(way, speed, now)),
                4 => driver.ask(Mover::hold),
                5 => driver.ask(Mover::resume),
                6 => driver.ask(|mover, now| mover.set_override([1, 30, 100][usize::from(speed < 100)], now)),
                7 => driver.ask(Mover::stop),
                _ => driver.ask(|mover, now| mover.quick_stop(Limits::new(1, 8_000_000).unwrap(), now)),
            }
            let wait = [pause.into(), 10, 1000, 100_000][usize::try_from(below(4)).unwrap()];
            driver.until(driver.now + below(wait + 2));
        }
        assert!(driver.turns > 100, "{} turns", driver.turns);
    }
}
