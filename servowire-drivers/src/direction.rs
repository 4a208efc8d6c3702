use core::convert::Infallible;

use embedded_hal::digital::OutputPin;

/// Who switches the driver of the RS-485 transceiver.
pub trait Direction {
    /// Why it cannot.
    type Error;
    /// Before the first bit.
    ///
    /// # Errors
    /// That of the pin.
    fn transmit(&mut self) -> Result<(), Self::Error>;
    /// After the last bit, before the encoder answers.
    ///
    /// # Errors
    /// That of the pin.
    fn receive(&mut self) -> Result<(), Self::Error>;
}

/// The UART or the adapter does it: hardware driver enable. Prefer it where there is one.
#[derive(Debug, Clone, Copy, Default)]
pub struct Automatic;

impl Direction for Automatic {
    type Error = Infallible;

    fn transmit(&mut self) -> Result<(), Infallible> {
        Ok(())
    }

    fn receive(&mut self) -> Result<(), Infallible> {
        Ok(())
    }
}

/// A pin at DE, or at DE and /RE tied: high while sending.
#[derive(Debug, Clone, Copy)]
pub struct DriverEnable<P>(pub P);

impl<P: OutputPin> Direction for DriverEnable<P> {
    type Error = P::Error;

    fn transmit(&mut self) -> Result<(), P::Error> {
        self.0.set_high()
    }

    fn receive(&mut self) -> Result<(), P::Error> {
        self.0.set_low()
    }
}

/// Switches the driver off when it is dropped, whatever has happened.
#[derive(Debug)]
pub(crate) struct Guard<'a, D: Direction> {
    direction: &'a mut D,
    on: bool,
}

impl<'a, D: Direction> Guard<'a, D> {
    pub(crate) fn transmit(direction: &'a mut D) -> Result<Self, D::Error> {
        let guard = Self { direction, on: true };
        guard.direction.transmit()?;
        Ok(guard)
    }

    /// Switches the driver off and tells whether that went well.
    pub(crate) fn receive(mut self) -> Result<(), D::Error> {
        self.on = false;
        self.direction.receive()
    }
}

impl<D: Direction> Drop for Guard<'_, D> {
    fn drop(&mut self) {
        if self.on {
            // Nobody is there to hear of it; the next call sets the pin again and does.
            let _: Result<(), _> = self.direction.receive();
        }
    }
}
