//! Frames whose answers the receiver did not hear, told of and not, and frames that are longer or late: what is given is the truth of its
//! instant, and it comes back.

use hdsl::Dialect;
use hdsl::frame::Stuffing;

use crate::position_laws::{FRAME_NS, Link, each};

/// Frames that the host says it has lost: the link stays up, their numbers are left out, the position is estimated and returns.
#[test]
fn lost_frames_that_are_told() {
    for lost in [1, 2, 8, 9, 16, 17, 100, 255] {
        for place in 0..8 {
            each(|mut link| {
                link.master.set_acceleration_threshold(255);
                link.lock();
                for _ in 0..8 + place {
                    let _ = link.frame(link.push() / 8, 0);
                }
                let before = link.fast().unwrap().frame();
                (0..lost).for_each(|_| link.lost_frame());
                link.master.skip(lost);
                assert!(link.frame(0, 0).is_err());
                if let Ok(ridden) = link.ridden(lost, link.push()) {
                    assert_eq!(ridden.frame(), before + u32::from(lost) + 1);
                } else {
                    // A word of its own, and the estimate may be beyond what a small range can tell.
                    assert_eq!(lost, 255);
                }
                link.returns();
                // What the host has not heard says nothing about the line.
                assert_eq!(link.master.h_frame().quality, 15);
                assert_eq!(
                    (link.master.counters().restarts, link.fast().unwrap().frame()),
                    (0, before + u32::from(lost) + 57)
                );
            });
        }
    }
}

/// A frame is lost and nobody tells: it is known by the time, so that nothing wrong is given; what the V-frame then brings ends the
/// link, and the next one has a position.
#[test]
fn lost_frames_that_are_not_told() {
    for lost in [1, 2, 8, 24] {
        for place in 0..8 {
            each(|mut link| {
                link.lock();
                for _ in 0..8 + place {
                    let _ = link.frame(link.push() / 8, 0);
                }
                (0..lost).for_each(|_| link.lost_frame());
                assert!(link.frame(0, 0).is_err());
                for _ in 0..3 {
                    let _ = link.frame(link.push() / 8, 0);
                }
                for _ in 0..150 {
                    let _ = link.frame(0, 0);
                }
                link.returns();
            });
        }
    }
}

/// Late by less than half a frame is no frame more.
#[test]
fn a_late_end_is_no_lost_frame() {
    let mut link = Link::new(Dialect::SICK, 32);
    link.lock();
    link.sampled_ns += 5_700;
    assert!(link.frame(3, 0).is_ok());
    link.sampled_ns += 5_800;
    assert!(link.frame(3, 0).is_err());
}

/// Frames with 12 blocks of stuffing last 180 bits, 19.2 us: none is taken for lost, and one that is lost is known.
#[test]
fn frames_with_stuffing() {
    let mut link = Link::new(Dialect::SICK, 32);
    link.master.set_stuffing(Stuffing::new(12).unwrap());
    let stuffed = |link: &mut Link, more_ns: u64| {
        link.sampled_ns += 19_200 - FRAME_NS + more_ns;
        link.frame(3, 0)
    };
    let first = (0..200).find(|_| stuffed(&mut link, 0).is_ok());
    assert!(first.is_some_and(|frame| frame < 120), "{first:?}");
    for _ in 0..20 {
        assert!(stuffed(&mut link, 0).is_ok());
        assert_eq!(link.master.h_frame().tail.stuffing.get(), 12);
    }
    assert!(stuffed(&mut link, 5_700).is_ok());
    assert!(stuffed(&mut link, 19_200).is_err());
}

/// Stuffing that is asked for on a running link begins with the end of the next frame.
#[test]
fn stuffing_of_a_running_link() {
    let mut link = Link::new(Dialect::SICK, 32);
    link.lock();
    link.master.set_stuffing(Stuffing::new(12).unwrap());
    assert!(link.frame(3, 0).is_ok());
    assert_eq!(link.master.h_frame().tail.stuffing.get(), 12);
    for _ in 0..20 {
        link.sampled_ns += 19_200 - FRAME_NS;
        assert!(link.frame(3, 0).is_ok());
    }
    link.master.set_stuffing(Stuffing::MIN);
    link.sampled_ns += 19_200 - FRAME_NS;
    assert!(link.frame(3, 0).is_ok());
    assert_eq!(link.master.h_frame().tail.stuffing.get(), 0);
    // One of 19.2 us is too long now.
    link.sampled_ns += 19_200 - FRAME_NS;
    assert!(link.frame(3, 0).is_err());
}
