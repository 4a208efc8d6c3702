//! The bounds that a caller may ask for before a call refuses.

use step_motion::{Arc, Clock, Limits, Turning};

#[test]
fn the_bounds_that_are_said_are_those_that_are_checked() {
    assert_eq!((Clock::MIN_HZ, Clock::MAX_HZ), (1_000, 1_073_741_823));
    for (hz, fits) in [(999, false), (Clock::MIN_HZ, true), (Clock::MAX_HZ, true), (Clock::MAX_HZ + 1, false)] {
        assert_eq!(Clock::new(hz).is_some(), fits, "{hz} Hz");
    }
    assert_eq!((Limits::MAX_ACCELERATION, Limits::MAX_JERK), (2_147_483_647, 17_592_186_044_415));
    assert!(Limits::new(1, Limits::MAX_ACCELERATION).is_ok());
    assert!(Limits::new(1, Limits::MAX_ACCELERATION + 1).is_err());
    assert_eq!(Arc::MAX_RADIUS, 1_073_741_824);
    let quarter = |radius: i32| Arc::new([radius, 0], [0, radius], [0, 0], Turning::Clockwise, 1 << 29);
    assert!(quarter(1_073_741_824).is_ok());
    assert!(quarter(1_073_741_825).is_err());
}

#[test]
fn clocks_and_limits_as_numbers() {
    assert_eq!(u32::from(Clock::new(72_000_000).unwrap()), 72_000_000);
    let limits = Limits::new(20_000, 200_000).unwrap();
    assert_eq!(<(u32, u32, Option<u64>)>::from(limits), (20_000, 200_000, None));
    assert_eq!(
        <(u32, u32, Option<u64>)>::from(limits.with_jerk(4_000_000).unwrap()),
        (20_000, 200_000, Some(4_000_000))
    );
}
