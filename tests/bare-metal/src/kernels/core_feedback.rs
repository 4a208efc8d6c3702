//! Feedback through a cell: put by the one that receives, judged by the one that controls; the angle of the field.

use servowire_core::{
    Acceleration, Angle, Cell, Commutation, Estimate, Feedback, Policy, Reader, Sense, Shaft, ShaftCell, ShaftReader,
    ShaftWriter, Tolerance, Tracker, Words, Writer,
};

use super::kernels_on_states;
use crate::count::tenths_on;

/// Evidence as a protocol crate has it: a doubt that no policy lifts as a code, alarms that a policy may tolerate.
#[derive(Clone, Copy)]
struct Evidence {
    damage: u32,
    alarms: u32,
    counts: u32,
    turns: i32,
    sampled_ns: u64,
}

/// Alarms.
#[derive(Clone, Copy)]
struct Alarms(u32);

impl Tolerance for Alarms {
    const NOTHING: Self = Self(0);
}

#[derive(Clone, Copy)]
#[allow(dead_code, reason = "the kernels hand it out")]
struct Sample {
    counts: u32,
    turns: i32,
    sampled_ns: u64,
}

#[derive(Clone, Copy)]
#[allow(dead_code, reason = "the kernels hand it out")]
enum Doubt {
    Damaged { code: u32 },
    Alarms { alarms: u32 },
    Old { age_ns: u64 },
}

impl Feedback for Evidence {
    type Tolerated = Alarms;
    type Sample = Sample;
    type Doubt = Doubt;
    const NEVER: Self = Self { damage: 1, alarms: 0, counts: 0, turns: 0, sampled_ns: 0 };

    #[inline]
    fn at(&self, now_ns: u64, policy: Policy<Alarms>) -> Result<Sample, Doubt> {
        if self.damage != 0 {
            return Err(Doubt::Damaged { code: self.damage });
        }
        let alarms = self.alarms & !policy.tolerated().0;
        if alarms != 0 {
            return Err(Doubt::Alarms { alarms });
        }
        if let Err(age_ns) = policy.check_age(now_ns, self.sampled_ns) {
            return Err(Doubt::Old { age_ns });
        }
        Ok(Sample { counts: self.counts, turns: self.turns, sampled_ns: self.sampled_ns })
    }
}

impl Shaft for Evidence {
    fn shaft(sample: &Sample) -> (Angle, u64) {
        (Angle::from_counts(sample.counts, COUNTS), sample.sampled_ns)
    }
}

impl Words<6> for Evidence {
    fn to_words(&self) -> [u32; 6] {
        let Self { damage, alarms, counts, turns, sampled_ns } = *self;
        [damage, alarms, counts, turns.cast_unsigned(), sampled_ns as u32, (sampled_ns >> 32) as u32]
    }

    #[inline]
    fn from_words([damage, alarms, counts, turns, low, high]: [u32; 6]) -> Self {
        Self { damage, alarms, counts, turns: turns.cast_signed(), sampled_ns: u64::from(high) << 32 | u64::from(low) }
    }
}

const GOOD: Evidence = Evidence { damage: 0, alarms: 0x20, counts: 0x12_3456, turns: -7, sampled_ns: 0x0001_0000_0000 };

/// Counts per turn.
const COUNTS: u32 = 1 << 23;

/// 62.5 µs and 5000 counts later.
const NEXT: Evidence = Evidence { counts: GOOD.counts + 5_000, sampled_ns: GOOD.sampled_ns + 62_500, ..GOOD };

/// A time and a policy.
type Use = (u64, Policy<Alarms>);

const TRACKER: Tracker = Tracker::new(COUNTS, 100).expect("an encoder");
const COMMUTATION: Commutation = Commutation::new(5, Angle::HALF, Sense::Down).expect("a motor");
const ACCELERATION: Acceleration = Acceleration::from_turns_per_s2(2_000).expect("an acceleration");

/// After the sample, and just before it.
const USES: &[Use] = &[
    (GOOD.sampled_ns + 40_000, Policy::new(125_000).tolerating(Alarms(0x20))),
    (GOOD.sampled_ns - 700, Policy::new(125_000).tolerating(Alarms(0x60))),
];

kernels_on_states! {
    /// The newest evidence out of the cell, and its verdict.
    fn core_feedback_at(reader: &mut Reader<'_, Evidence, 6>, (now_ns, policy): &Use) -> Result<Sample, Doubt> {
        reader.at(*now_ns, *policy)
    } as {
        let mut cell = Cell::new();
        let (mut writer, mut reader) = cell.split();
        writer.put(GOOD);
        tenths_on(&mut reader, core_feedback_at, USES)
    }

    /// The verdict alone.
    fn core_feedback_verdict(evidence: &mut Evidence, (now_ns, policy): &Use) -> Result<Sample, Doubt> {
        evidence.at(*now_ns, *policy)
    } as {
        tenths_on(&mut { GOOD }, core_feedback_verdict, USES)
    }

    /// Evidence into the cell.
    fn core_feedback_put(writer: &mut Writer<'_, Evidence, 6>, evidence: &Evidence) -> () {
        writer.put(*evidence);
    } as {
        tenths_on(&mut Cell::new().split().0, core_feedback_put, &[GOOD])
    }

    /// The angle of the field and its bound, from the newest evidence and the motion.
    fn core_feedback_angle(
        (reader, commutation, acceleration): &mut (ShaftReader<'_, Evidence, 6>, Commutation, Acceleration),
        (now_ns, policy): &Use
    ) -> Result<Estimate, Doubt> {
        reader.angle(*now_ns, *policy, *commutation, *acceleration)
    } as {
        let mut cell = ShaftCell::new();
        let (mut writer, reader) = cell.split(TRACKER);
        core_feedback_track(&mut writer, &[GOOD, NEXT]);
        tenths_on(&mut (reader, COMMUTATION, ACCELERATION), core_feedback_angle, USES)
    }

    /// Evidence into the cell with its motion, twice.
    fn core_feedback_track(writer: &mut ShaftWriter<'_, Evidence, 6>, pair: &[Evidence; 2]) -> () {
        for evidence in pair {
            writer.put(*evidence, evidence.sampled_ns, USES[0].1);
        }
    } as {
        tenths_on(&mut ShaftCell::new().split(TRACKER).0, core_feedback_track, &[[GOOD, NEXT]])
    }
}
