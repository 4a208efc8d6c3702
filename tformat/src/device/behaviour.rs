/// The instant from which the time between two reset requests is counted. No document says which instant that is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
pub enum Interval {
    /// From the start of one request to the start of the next.
    #[default]
    StartToStart,
    /// From the end of a response to the start of the next request.
    EndToStart,
}

/// The effect of writing the number of a page that does not exist to the page register.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
pub enum AbsentPage {
    /// The page stays as it is.
    #[default]
    Ignored,
    /// The number is taken modulo the number of pages.
    Wrapped,
}

/// The data byte of a read while the memory is busy.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
pub enum BusyData {
    /// 0x00.
    #[default]
    Zeros,
    /// 0xff.
    Ones,
    /// The contents of the cell.
    Cell,
}

/// The points that no document settles, and the response delay. The defaults are those of the reference vectors.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
#[non_exhaustive]
pub struct Behaviour {
    /// From the end of the request to the start bit of the response, in ns. Default 3 000; 3 200 was logged from a real
    /// encoder.
    pub response_delay_ns: u32,
    /// The instant from which the 40 us between two reset requests are counted.
    pub reset_interval: Interval,
    /// Whether another request restarts the count of reset requests.
    pub others_restart_count: bool,
    /// Whether a damaged request restarts the count of reset requests.
    pub damage_restarts_count: bool,
    /// Whether the response to the tenth reset shows its effect, or only the one after it.
    pub tenth_shows_effect: bool,
    /// Whether the encoder is silent for 18 ms while it stores a single-turn zero.
    pub silent_while_storing: bool,
    /// Whether selecting a page keeps the memory busy like any write.
    pub page_select_is_busy: bool,
    /// What happens if a page that does not exist is selected.
    pub absent_page: AbsentPage,
    /// The data byte of reads while the memory is busy.
    pub busy_data: BusyData,
    /// Whether a request with a wrong sink code is answered with ID 3.
    pub answers_wrong_sink: bool,
    /// Whether a request with a delimiter error is answered with ID 3.
    pub answers_delimiter_error: bool,
    /// Whether SF is always 0, as in some compatible encoders.
    pub leaves_status_zero: bool,
}

impl Behaviour {
    /// Returns an encoder as the documents describe it; the same as [`Default`].
    pub const fn new() -> Self {
        Self {
            response_delay_ns: 3_000,
            reset_interval: Interval::StartToStart,
            others_restart_count: true,
            damage_restarts_count: true,
            tenth_shows_effect: false,
            silent_while_storing: false,
            page_select_is_busy: false,
            absent_page: AbsentPage::Ignored,
            busy_data: BusyData::Zeros,
            answers_wrong_sink: false,
            answers_delimiter_error: true,
            leaves_status_zero: false,
        }
    }

    /// Returns the combination with this number, for tests that walk through them all: every switch combined with every other,
    /// and response delays of 3.0, 3.2, 1.7 and 9 us. Numbers from [`NUMBERED`](Self::NUMBERED) upwards start over.
    pub const fn numbered(number: u16) -> Self {
        const fn bit(number: u16, at: u32) -> bool {
            number >> at & 1 == 1
        }
        // Three kinds of data while busy; the others are powers of two.
        let busy_data = match number % 3 {
            0 => BusyData::Zeros,
            1 => BusyData::Ones,
            _ => BusyData::Cell,
        };
        let number = number / 3;
        Self {
            busy_data,
            reset_interval: if bit(number, 0) { Interval::EndToStart } else { Interval::StartToStart },
            others_restart_count: !bit(number, 1),
            damage_restarts_count: !bit(number, 2),
            tenth_shows_effect: bit(number, 3),
            silent_while_storing: bit(number, 4),
            page_select_is_busy: bit(number, 5),
            absent_page: if bit(number, 6) { AbsentPage::Wrapped } else { AbsentPage::Ignored },
            answers_wrong_sink: bit(number, 7),
            answers_delimiter_error: !bit(number, 8),
            leaves_status_zero: bit(number, 9),
            response_delay_ns: match number >> 10 & 3 {
                0 => 3_000,
                1 => 3_200,
                2 => 1_700,
                _ => 9_000,
            },
        }
    }

    /// Number of combinations that [`numbered`](Self::numbered) returns: 3 kinds of data, ten switches, 4 delays.
    pub const NUMBERED: u16 = 3 << 12;

    servowire_core::builder! {
        with_response_delay_ns: response_delay_ns, u32;
        with_reset_interval: reset_interval, Interval;
        with_count_despite_others: others_restart_count = false;
        with_count_despite_damage: damage_restarts_count = false;
        with_effect_in_tenth: tenth_shows_effect = true;
        with_silence_while_storing: silent_while_storing = true;
        with_busy_page_select: page_select_is_busy = true;
        with_absent_page: absent_page, AbsentPage;
        with_busy_data: busy_data, BusyData;
        with_wrong_sink_answered: answers_wrong_sink = true;
        with_delimiter_error_unanswered: answers_delimiter_error = false;
        with_status_zero: leaves_status_zero = true;
    }
}

impl Default for Behaviour {
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::HashSet;

    /// Each combination once: no two are the same, and there are as many as the switches make.
    #[test]
    fn every_combination_is_there() {
        let shown = |number| std::format!("{:?}", Behaviour::numbered(number));
        // All of them take ten minutes under Miri.
        let step = if cfg!(miri) { 97 } else { 1 };
        let all: HashSet<_> = (0..Behaviour::NUMBERED).step_by(step).map(shown).collect();
        assert_eq!(all.len(), (3 * 1024 * 4_usize).div_ceil(step));
        assert_eq!(Behaviour::numbered(0), Behaviour::new());
        assert_eq!(Behaviour::numbered(Behaviour::NUMBERED), Behaviour::new());
    }
}
