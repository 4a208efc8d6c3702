/// What this encoder does at the points that the documents leave open. The default is the most likely reading.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
#[non_exhaustive]
pub struct Behaviour {
    /// Time from the last delimiter of a request to the first start bit of the response, in ns. Default 2800, the time that one
    /// vendor's simulated encoder waits.
    pub response_delay_ns: u32,
    /// What ES0 shows in the first response to an EEPROM read. Default [`FirstRead::Busy`].
    pub first_read: FirstRead,
    /// EEPROM data while they are undetermined.
    pub undetermined: u16,
    /// The first response that shows the effect of a reset. Default [`Shows::Ninth`] ("Nikon Protocol Design").
    pub reset_shows: Shows,
    /// The meaning of EA in a multi-response request. Default [`Ea::Highest`].
    pub ea: Ea,
    /// Place among the responses to a multi-response request, 0..=7; `None` means its own address, regardless of the other
    /// encoders. Set other numbers if the responses close up.
    pub place: Option<u8>,
    /// Which address the responses to commands 11 and 20 show. Default [`ShownAddress::New`].
    pub shown_address: ShownAddress,
    /// What restarts the count of a reset. Default [`Restart::Any`].
    pub restart: Restart,
}

/// What ES0 shows in the first response to an EEPROM read.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
pub enum FirstRead {
    /// The memory is busy.
    Busy,
    /// Nothing.
    Ready,
}

/// Which address the response to an address setting shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
pub enum ShownAddress {
    /// The new one.
    New,
    /// The old one.
    Old,
}

/// What restarts the count of a reset, besides another request to the same encoder.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
pub enum Restart {
    /// Any other request on the line, and a damaged frame.
    Any,
    /// Only that.
    Own,
}

/// The first response that shows the effect of a reset.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
pub enum Shows {
    /// The response to the eighth request.
    Eighth,
    /// The response to the next request.
    Ninth,
}

/// The meaning of EA in a multi-response request.
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
    /// Returns the default readings.
    pub const fn new() -> Self {
        Self {
            response_delay_ns: 2_800,
            first_read: FirstRead::Busy,
            undetermined: 0xa5a5,
            reset_shows: Shows::Ninth,
            ea: Ea::Highest,
            place: None,
            shown_address: ShownAddress::New,
            restart: Restart::Any,
        }
    }

    servowire_core::builder! {
        with_response_delay_ns: response_delay_ns, u32;
        with_first_read: first_read, FirstRead;
        with_undetermined: undetermined, u16;
        with_reset_shows: reset_shows, Shows;
        with_ea: ea, Ea;
        with_place: place, Option<u8>;
        with_shown_address: shown_address, ShownAddress;
        with_restart: restart, Restart;
    }
}

impl Default for Behaviour {
    fn default() -> Self {
        Self::new()
    }
}
