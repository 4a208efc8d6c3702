use servowire_core::{Command, Direction};

use crate::error::Error;
use crate::frequency::Speed;
use crate::group::{Group, Motors};
use crate::profile::{Parameters, Profile};
use crate::ramp_steps::MoveState;
use crate::tone::Tone;

/// An entry of the tone table: step time, duration, pause (TIDEP0061, section 2.3.3).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
pub struct Note {
    /// Speed constant of the tone.
    pub speed: Speed,
    /// Duration in steps, ramps included.
    pub steps: u32,
    /// Cycles without a move before the next note. The unit is this crate's choice.
    pub pause: u32,
}

impl Note {
    /// Creates a note: `tone` for 125 ms at full speed, followed by a pause in cycles.
    pub const fn p125(tone: Tone, pause: u32) -> Self {
        Self { speed: tone.speed(), steps: tone.p125(), pause }
    }

    /// Creates a note: `tone` for 250 ms at full speed, followed by a pause in cycles.
    pub const fn p250(tone: Tone, pause: u32) -> Self {
        Self { speed: tone.speed(), steps: tone.p250(), pause }
    }
}

/// Dance mode: the motors run at audible speeds, note after note.
///
/// Every note goes through the ramp up and the ramp down. After the cycle of its last pulse come the cycles of its
/// pause, then cycle 0 of the next note.
#[derive(Debug, Clone)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Dance<'t> {
    group: Group<'t>,
    parameters: Parameters<'t>,
    direction: Direction,
    /// Notes not yet begun.
    song: &'t [Note],
    /// Cycles left before the next note.
    pause: u32,
}

impl<'t> Dance<'t> {
    /// Creates a dance in which the selected motors play `song`, each note with `parameters` but at its own speed. The next
    /// [`tick`](Self::tick) is cycle 0 of the first note.
    ///
    /// # Errors
    /// [`Error::NoMotor`] if no motor is selected; those of [`Profile::new`] for the first note with an error.
    pub fn new(
        motors: Motors,
        parameters: Parameters<'t>,
        direction: Direction,
        song: &'t [Note],
    ) -> Result<Self, Error> {
        if motors == Motors::NONE {
            return Err(Error::NoMotor);
        }
        for note in song {
            Profile::new(Parameters { speed: note.speed, ..parameters })?;
        }
        Ok(Self { group: Group::new(motors), parameters, direction, song, pause: 0 })
    }

    /// Advances to the next cycle and returns the commands of the four motors.
    pub fn tick(&mut self) -> [Command; 4] {
        if self.group.state() == MoveState::Idle {
            self.begin();
        }
        self.group.tick()
    }

    /// Counts down the pause, then begins the next note that has any steps.
    fn begin(&mut self) {
        while self.pause == 0 {
            let Some((note, rest)) = self.song.split_first() else { return };
            self.song = rest;
            self.pause = note.pause;
            let profile = Profile::new(Parameters { speed: note.speed, ..self.parameters });
            let begun = profile.and_then(|profile| self.group.start(profile, note.steps, self.direction));
            if begun.is_ok() && note.steps > 0 {
                return;
            }
        }
        self.pause = self.pause.saturating_sub(1);
    }

    /// Aborts the song and the current note, with the ramp down; see [`Axis::abort`](crate::Axis::abort).
    pub fn abort(&mut self) {
        self.group.abort();
        self.song = &[];
        self.pause = 0;
    }

    /// Returns whether the last note and its pause have ended.
    pub fn is_over(&self) -> bool {
        self.song.is_empty() && self.pause == 0 && self.group.state() == MoveState::Idle
    }

    /// The motors: selection, positions, ramp state.
    pub const fn group(&self) -> &Group<'t> {
        &self.group
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec::Vec;

    fn parameters() -> Parameters<'static> {
        Parameters::at(Speed::KHZ_250)
    }

    fn silent(pause: u32) -> Note {
        Note { steps: 0, ..Note::p125(Tone::A, pause) }
    }

    /// Cycles of all pulses until the song is over, and the cycle after which it is.
    fn play(song: &[Note]) -> (Vec<u64>, u64) {
        let mut dance = Dance::new(Motors::ALL, parameters(), Direction::Forward, song).unwrap();
        let mut pulses = Vec::new();
        let mut cycle = 0;
        while !dance.is_over() {
            let [command, ..] = dance.tick();
            if matches!(command, Command::Pulse { .. }) {
                pulses.push(cycle);
            }
            cycle += 1;
        }
        (pulses, cycle)
    }

    #[test]
    fn notes_and_pauses_follow_each_other() {
        let short = |tone, steps, pause| Note { steps, ..Note::p125(tone, pause) };
        let song = [silent(10), short(Tone::Cis, 5, 0), silent(0), short(Tone::Fis2, 40, 7), short(Tone::A, 3, 2)];
        let (mut want, mut start) = (Vec::new(), 10);
        for note in [song[1], song[3], song[4]] {
            let profile = Profile::new(Parameters { speed: note.speed, ..parameters() }).unwrap();
            let cycles: Vec<u64> = profile.steps(note.steps).map(|s| start + s.cycle).collect();
            start = cycles.last().unwrap() + 1 + u64::from(note.pause);
            want.extend(cycles);
        }
        assert_eq!(play(&song), (want, start));
    }

    #[test]
    fn a_tone_of_table_3_lasts_its_ramps_longer() {
        let (pulses, _) = play(&[Note::p125(Tone::Cis, 0)]);
        assert_eq!(pulses.len(), 8781);
        // 143.5 ms for a note of 125 ms
        assert_eq!(pulses.last().unwrap() * 4 / 1000, 143);
    }

    #[test]
    fn empty_songs_and_refused_ones() {
        assert_eq!(play(&[]), (Vec::new(), 0));
        assert_eq!(play(&[silent(0), silent(0)]).0, [0_u64; 0]);
        let new = |motors, song| Dance::new(motors, parameters(), Direction::Forward, song).map(|_| ());
        assert_eq!(new(Motors::NONE, &[]), Err(Error::NoMotor));
        let fast = [Note { speed: Speed::from_raw(5), steps: 1, pause: 0 }];
        assert_eq!(new(Motors::M1, &fast), Err(Error::StepRateTooHigh { speed: 5, limit: 262_144 }));
    }

    #[test]
    fn abort_ends_note_and_song() {
        let song = [Note::p250(Tone::A, 100), Note::p250(Tone::E, 100)];
        let mut dance = Dance::new(Motors::ALL, parameters(), Direction::Reverse, &song).unwrap();
        for _ in 0..10_000 {
            dance.tick();
        }
        dance.abort();
        let before = dance.group().commanded()[0];
        for _ in 0..10_000 {
            dance.tick();
        }
        assert!(dance.is_over());
        assert_eq!(before - dance.group().commanded()[0], 32);
    }
}
