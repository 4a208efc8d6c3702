//! The bounds that a caller may ask for before a call refuses.

use step_profile::{Parameters, Profile, Speed};

#[test]
fn the_bounds_that_are_said_are_those_that_are_checked() {
    assert_eq!(Profile::MAX_STEPS_PER_ENTRY, 134_217_727);
    let entries = |steps_per_entry| {
        let mut parameters = Parameters::at(Speed::KHZ_100);
        parameters.steps_per_entry = steps_per_entry;
        Profile::new(parameters)
    };
    assert!(entries(Profile::MAX_STEPS_PER_ENTRY).is_ok());
    assert!(entries(Profile::MAX_STEPS_PER_ENTRY + 1).is_err());
    // A larger constant is a slower speed: beyond this one the published arithmetic is known to be exact no longer.
    assert_eq!(Profile::MAX_PROVED_SPEED.raw(), 963_131);
    assert!(Profile::new(Parameters::at(Profile::MAX_PROVED_SPEED)).unwrap().pru_is_exact());
    assert!(!Profile::new(Parameters::at(Speed::from_raw(963_132))).unwrap().pru_is_exact());
}
