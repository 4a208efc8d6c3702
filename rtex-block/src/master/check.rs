use crate::block::BlockSize;
use crate::code::Code;
use crate::error::Error;
use crate::error_code::ErrorCode;
use crate::header::{MacId, UpdateCounter};
use crate::noncyclic_response::NonCyclicResponse;
use crate::response::Response;
use crate::sub::split32;

/// What the response to a command should say.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Expected {
    /// 16- or 32-byte blocks.
    pub size: BlockSize,
    /// The drive.
    pub mac_id: MacId,
    /// The counter of the command last sent.
    pub update_counter: UpdateCounter,
    /// The code of the command last sent.
    pub code: Code,
}

/// What a response from the right drive says about the last command sent.
///
/// The first two are not faults in themselves: the counter comes back with the next reception, the code one
/// command later, so the usual pair is (code N - 1, counter N). SX-DSV02310, "Update timing".
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Acknowledgement {
    /// The counter is not the last one sent.
    CounterNotEchoed,
    /// The code is not the last one sent.
    CodeNotYetEchoed,
    /// CMD_Error: the command was not accepted.
    CommandError(ErrorCode),
    /// All echoes match and the command was accepted.
    Accepted,
}

servowire_core::one_line!(Acknowledgement {
    Self::CounterNotEchoed => "the counter is not echoed";
    Self::CodeNotYetEchoed => "the code is not yet echoed";
    Self::CommandError(code) => "command not accepted: {}", code;
    Self::Accepted => "accepted";
});

/// A response from the right drive, with what it says about the last command sent.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Checked {
    /// The response.
    pub response: Response,
    /// What the response says.
    pub acknowledgement: Acknowledgement,
}

servowire_core::one_line!(Checked { Self { response, acknowledgement } => "{}: {}", response, acknowledgement; });

impl Expected {
    /// Makes the checks that a master can make, in this order: length, C/R, MAC-ID; then counter, code, CMD_Error.
    ///
    /// There is no checksum in a block. A flipped bit outside of these fields is not noticed: 112 of the 128 bits of a
    /// 16-byte response.
    ///
    /// # Errors
    /// [`Error::Truncated`], [`Error::TooLong`], [`Error::Direction`] or [`Error::MacId`]: no part of such a block may be
    /// used.
    pub const fn check(&self, bytes: &[u8]) -> Result<Checked, Error> {
        let parsed = match self.size {
            BlockSize::Bytes16 => Response::parse(bytes),
            BlockSize::Bytes32 => match split32(bytes) {
                Ok((main, _)) => Response::parse(main),
                Err(e) => Err(e),
            },
        };
        let response = match parsed {
            Ok(response) => response,
            Err(e) => return Err(e),
        };
        if response.mac_id.get() != self.mac_id.get() {
            return Err(Error::MacId { got: response.mac_id.get(), want: self.mac_id.get() });
        }
        let acknowledgement = if response.update_counter_echo.get() != self.update_counter.get() {
            Acknowledgement::CounterNotEchoed
        } else if response.code.get() != self.code.get() {
            Acknowledgement::CodeNotYetEchoed
        } else if let NonCyclicResponse::CommandError(code) = response.noncyclic() {
            Acknowledgement::CommandError(code)
        } else {
            Acknowledgement::Accepted
        };
        Ok(Checked { response, acknowledgement })
    }
}
