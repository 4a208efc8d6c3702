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

/// The line driver, and whether it may be on: before the first call, after a future was forgotten, and after a pin that refused.
#[derive(Debug)]
pub(crate) struct Switch<D> {
    direction: D,
    on: bool,
}

impl<D> Switch<D> {
    pub(crate) const fn new(direction: D) -> Self {
        Self { direction, on: true }
    }

    pub(crate) fn release(self) -> D {
        self.direction
    }
}

impl<D: Direction> Switch<D> {
    /// Sees to it that the driver is off: before anybody listens.
    pub(crate) fn off(&mut self) -> Result<(), D::Error> {
        if self.on {
            self.direction.receive()?;
            self.on = false;
        }
        Ok(())
    }

    /// Switches the driver on.
    pub(crate) fn transmit(&mut self) -> Result<Guard<'_, D>, D::Error> {
        self.on = true;
        let guard = Guard(self);
        guard.0.direction.transmit()?;
        Ok(guard)
    }
}

/// Switches the driver off when it is dropped, whatever has happened.
#[derive(Debug)]
pub(crate) struct Guard<'a, D: Direction>(&'a mut Switch<D>);

impl<D: Direction> Guard<'_, D> {
    /// Switches the driver off and tells whether that went well; if not, it is tried once more.
    pub(crate) fn receive(self) -> Result<(), D::Error> {
        self.0.off()
    }
}

impl<D: Direction> Drop for Guard<'_, D> {
    fn drop(&mut self) {
        // Nobody is there to hear of it; the next call tries again before it listens.
        let _: Result<(), _> = self.0.off();
    }
}
