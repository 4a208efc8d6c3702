/// What the documents leave open, as this encoder has it. The default is the most likely reading.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
#[non_exhaustive]
pub struct Behaviour {
    /// From the last delimiter of a request to the first start bit of the response, in ns. Default 2800, as one vendor's
    /// simulated encoder waits.
    pub turn_around_ns: u32,
    /// Whether ES0 is set in the first response to an EEPROM read. Default: yes.
    pub busy_in_first_read: bool,
    /// EEPROM data while they are not determined.
    pub undetermined: u16,
    /// The response that shows the effect of a reset first. Default [`Shows::Ninth`] ("Nikon Protocol Design").
    pub reset_shows: Shows,
    /// What EA of a multi-response request means. Default [`Ea::Highest`].
    pub ea: Ea,
    /// Place among the responses to a multi-response request, 0..=7; `None` is the own address, whoever else is there. Give
    /// other numbers where the responses close up.
    pub place: Option<u8>,
    /// Whether the responses to commands 11 and 20 show the new address. Default: yes.
    pub shows_new_address: bool,
    /// What starts the count of a reset again. Default [`Restart::Any`].
    pub restart: Restart,
}

/// What starts the count of a reset again, besides another request to the same encoder.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
pub enum Restart {
    /// Any other request on the line, and a damaged frame.
    Any,
    /// Nothing else.
    Own,
}

/// Which response shows the effect of a reset first.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
pub enum Shows {
    /// That to the eighth request.
    Eighth,
    /// That to the next request.
    Ninth,
}

/// What EA of a multi-response request means.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
pub enum Ea {
    /// The highest address that answers.
    Highest,
    /// Nothing: all encoders answer.
    All,
}

impl Behaviour {
    /// The default readings.
    pub const fn new() -> Self {
        Self {
            turn_around_ns: 2_800,
            busy_in_first_read: true,
            undetermined: 0xa5a5,
            reset_shows: Shows::Ninth,
            ea: Ea::Highest,
            place: None,
            shows_new_address: true,
            restart: Restart::Any,
        }
    }

    /// With another turn-around time.
    pub const fn with_turn_around_ns(self, turn_around_ns: u32) -> Self {
        Self { turn_around_ns, ..self }
    }

    /// With ES0 clear in the first response to an EEPROM read.
    pub const fn not_busy_in_first_read(self) -> Self {
        Self { busy_in_first_read: false, ..self }
    }

    /// With the effect of a reset in the response to the eighth request.
    pub const fn showing_in_the_eighth(self) -> Self {
        Self { reset_shows: Shows::Eighth, ..self }
    }

    /// Answering every multi-response request.
    pub const fn answering_all(self) -> Self {
        Self { ea: Ea::All, ..self }
    }

    /// With this place among the responses to a multi-response request.
    pub const fn at_place(self, place: u8) -> Self {
        Self { place: Some(place), ..self }
    }

    /// With these EEPROM data while they are not determined.
    pub const fn with_undetermined(self, undetermined: u16) -> Self {
        Self { undetermined, ..self }
    }

    /// With a count of resets that only other requests to the same encoder start again.
    pub const fn counting_its_own_requests(self) -> Self {
        Self { restart: Restart::Own, ..self }
    }

    /// With the old address in the responses to commands 11 and 20.
    pub const fn showing_the_old_address(self) -> Self {
        Self { shows_new_address: false, ..self }
    }
}

impl Default for Behaviour {
    fn default() -> Self {
        Self::new()
    }
}
