use core::fmt;

use crate::frequency::{Frequency, Speed};

/// The ten tones of Table 3 in TIDEP0061, section 2.3.3, in the German names printed there.
///
/// `cis` is C sharp, `gis` G sharp, `H` B natural; a 2 means an octave higher.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
pub enum Tone {
    /// 277.1 Hz.
    Cis,
    /// 329.6 Hz.
    E,
    /// 369.9 Hz.
    Fis,
    /// 391.9 Hz.
    G,
    /// 415.3 Hz.
    Gis,
    /// 440.0 Hz.
    A,
    /// 493.8 Hz.
    H,
    /// 554.3 Hz.
    Cis2,
    /// 587.3 Hz.
    D2,
    /// 739.9 Hz.
    Fis2,
}

/// A row of Table 3.
struct Row {
    name: &'static str,
    tenths_hz: u16,
    speed: u32,
    p125: u32,
    p250: u32,
}

/// Its name in Table 3.
impl fmt::Display for Tone {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

impl Tone {
    /// All of them, as printed.
    pub const ALL: [Self; 10] =
        [Self::Cis, Self::E, Self::Fis, Self::G, Self::Gis, Self::A, Self::H, Self::Cis2, Self::D2, Self::Fis2];

    const fn row(self) -> Row {
        let (name, tenths_hz, speed, p125, p250) = match self {
            Self::Cis => ("cis", 2771, 932_886, 8_781, 17_563),
            Self::E => ("E", 3296, 780_121, 10_501, 21_002),
            Self::Fis => ("fis", 3699, 693_009, 11_821, 23_642),
            Self::G => ("G", 3919, 653_191, 12_542, 25_083),
            Self::Gis => ("gis", 4153, 615_572, 13_308, 26_616),
            Self::A => ("A", 4400, 580_294, 14_117, 28_234),
            Self::H => ("H", 4938, 515_897, 15_879, 31_758),
            Self::Cis2 => ("cis2", 5543, 458_659, 17_861, 35_722),
            Self::D2 => ("D2", 5873, 432_486, 18_942, 37_883),
            Self::Fis2 => ("fis2", 7399, 342_190, 23_940, 47_880),
        };
        Row { name, tenths_hz, speed, p125, p250 }
    }

    /// Returns the tone of this name, spelt as in Table 3.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|tone| tone.name() == name)
    }

    /// Its name in Table 3.
    pub const fn name(self) -> &'static str {
        self.row().name
    }

    /// Its pitch in tenths of a hertz.
    pub const fn tenths_hz(self) -> u16 {
        self.row().tenths_hz
    }

    /// Its step frequency by Equation 5; see [`Frequency::of_tone`].
    pub const fn frequency(self) -> Frequency {
        match Frequency::of_tone(self.row().tenths_hz as u32) {
            Some(frequency) => frequency,
            None => Frequency::from_hz(0),
        }
    }

    /// Its speed constant.
    pub const fn speed(self) -> Speed {
        Speed::from_raw(self.row().speed)
    }

    /// Steps of 125 ms at full speed. The ramps are not included: with one step per ramp entry a move of N steps
    /// lasts as long as N + 1302 steps at full speed.
    pub const fn p125(self) -> u32 {
        self.row().p125
    }

    /// Steps of 250 ms at full speed; see [`p125`](Self::p125).
    pub const fn p250(self) -> u32 {
        self.row().p250
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Table 3 follows from Equation 5 without a difference.
    #[test]
    fn table_3_is_equation_5() {
        for tone in Tone::ALL {
            let frequency = tone.frequency();
            assert_eq!(Speed::from_frequency(frequency), Ok(tone.speed()), "{tone:?}");
            assert_eq!((frequency.steps_in(125), frequency.steps_in(250)), (tone.p125(), tone.p250()), "{tone:?}");
            assert_eq!(Tone::from_name(tone.name()), Some(tone));
        }
        assert_eq!(Tone::from_name("h"), None);
        // Tones are cut to one decimal.
        assert_eq!((Tone::A.tenths_hz(), Tone::G.tenths_hz()), (4400, 3919));
    }
}
