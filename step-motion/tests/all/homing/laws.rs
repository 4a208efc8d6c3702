//! Any homing, with any requests of others at any moment.

use proptest::prelude::*;
use step_motion::{AxesQueue, Direction, Error, HomingConfig, HomingState, Limits, Queue};

use super::benches::{Ask, Bench, Case, Halves, OfAxes, OfPath, OneByOne};

/// 100 us each: twice what the slowest search takes, with a background that is late.
const POLLS: u32 = 500_000;

fn cases() -> u32 {
    std::env::var("MOTION_CASES").ok().and_then(|n| n.parse().ok()).unwrap_or(40)
}

prop_compose! {
    fn any_case()(
        reverse in any::<bool>(),
        (seek, approach) in (200..4000_u32, 50..1500_u32),
        (back_off, range) in (1..300_u32, 500..3000_u32),
        hard in 60_000..400_000_u32,
        switch in prop::option::weighted(0.9, -250..2500_i64),
    ) -> Case {
        let direction = if reverse { Direction::Reverse } else { Direction::Forward };
        let stop = Limits::new(10_000, hard).unwrap();
        Case { config: HomingConfig::new(direction, seek, approach, range, stop).with_back_off(back_off), switch }
    }
}

fn any_ask() -> impl Strategy<Value = Ask> {
    prop_oneof![
        3 => Just(Ask::Hold),
        3 => Just(Ask::Resume),
        3 => prop_oneof![Just(0), 1..200_u16].prop_map(Ask::Override),
        1 => Just(Ask::Stop),
        1 => Just(Ask::Quick),
        1 => Just(Ask::Halt),
        1 => (-60..200_i64).prop_map(Ask::MoveTo),
    ]
}

/// What has been seen of a homing.
struct Watch {
    state: HomingState,
    /// Where it was when this state began.
    since: i64,
    /// Somebody else has asked for a motion or a stop.
    taken: bool,
}

/// Follows a homing to its end, and looks at each poll.
fn follow(bench: &mut dyn Bench, case: Case, asks: &[(u32, Ask)]) -> Result<(), TestCaseError> {
    let mut watch = Watch { state: HomingState::Seeking, since: 0, taken: false };
    let mut asks = asks.iter().copied().peekable();
    for poll in 0..POLLS {
        while let Some((_, ask)) = asks.next_if(|(at, _)| *at <= poll) {
            let over = matches!(watch.state, HomingState::Done | HomingState::Failed);
            let taken = matches!(ask, Ask::Stop | Ask::Quick | Ask::Halt | Ask::MoveTo(_));
            match bench.ask(ask) {
                Ok(()) => watch.taken |= taken && !over,
                Err(error) => prop_assert_eq!(error, Error::Moving),
            }
        }
        if asks.peek().is_none() {
            // Nothing holds it for ever.
            bench.ask(Ask::Resume).unwrap();
            bench.ask(Ask::Override(100)).unwrap();
        }
        // The axis may be asked for a move before a halt has been confirmed.
        let state = match bench.go() {
            Ok(state) => state,
            Err(error) => {
                prop_assert_eq!(error, Error::Moving);
                continue;
            }
        };
        let (real, called) = bench.at();
        if state != watch.state {
            changed(&watch, case, (state, real, called))?;
            (watch.state, watch.since) = (state, real);
        }
        if asks.peek().is_none() && matches!(state, HomingState::Done | HomingState::Failed) && bench.is_at_rest() {
            return Ok(());
        }
    }
    Err(TestCaseError::fail(format!("it does not end: {:?}", watch.state)))
}

/// A new state is the next one, or it says why not.
fn changed(watch: &Watch, case: Case, (state, real, called): (HomingState, i64, i64)) -> Result<(), TestCaseError> {
    use HomingState::{Approaching, BackingOff, Done, Failed, Seeking, Settling, Stopping};
    prop_assert!(!matches!(watch.state, Done | Failed), "{state:?} after {:?}", watch.state);
    if watch.taken {
        prop_assert_eq!(state, Failed);
        return Ok(());
    }
    match state {
        Failed => {
            let closed = case.switch(real) == step_motion::Switch::Closed;
            let far = real.abs_diff(watch.since) > u64::from(case.config.range);
            prop_assert!(
                closed && watch.state == BackingOff || far,
                "{:?} from {}, at {real}",
                watch.state,
                watch.since
            );
        }
        Done => {
            // Between two polls it makes up to 0.15 steps of the approach.
            let off = real - called - case.place().unwrap_or(i64::MAX);
            prop_assert!(off.abs() <= 1, "{called} is at {real}, {off} off");
        }
        _ => {
            let next = [
                (Seeking, Stopping),
                (Stopping, BackingOff),
                (Seeking, BackingOff),
                (BackingOff, Approaching),
                (Approaching, Settling),
            ];
            prop_assert!(next.contains(&(watch.state, state)), "{state:?} after {:?}", watch.state);
        }
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig { cases: cases(), ..ProptestConfig::default() })]

    /// It finds its switch to the step, says why not, or leaves the axis to who has asked for it.
    #[test]
    fn whatever_is_asked_a_homing_ends_as_it_says(
        case in any_case(),
        asks in prop::collection::vec((0..30_000_u32, any_ask()), 0..5),
    ) {
        let mut asks = asks;
        asks.sort_by_key(|(at, _)| *at);
        follow(&mut OneByOne::new(case), case, &asks)?;
        follow(&mut Halves::new(case, &Queue::new()), case, &asks)?;
        follow(&mut OfPath::new(case), case, &asks)?;
        follow(&mut OfAxes::new(case, &AxesQueue::new(), false), case, &asks)?;
        follow(&mut OfAxes::new(case, &AxesQueue::new(), true), case, &asks)?;
    }
}
