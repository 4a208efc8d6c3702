use core::convert::Infallible;

use embedded_hal::digital::OutputPin;

/// How the driver of the RS-485 transceiver is switched.
pub trait Direction {
    /// Why the switching failed.
    type Error;
    /// Switches the line driver on, before the first bit.
    ///
    /// # Errors
    /// The error of the pin.
    fn transmit(&mut self) -> Result<(), Self::Error>;
    /// Switches the line driver off, after the last bit and before the encoder answers.
    ///
    /// # Errors
    /// The error of the pin.
    fn receive(&mut self) -> Result<(), Self::Error>;
    /// The worst-case inaccuracy if software switches the driver; `None` if the hardware does so and takes no time.
    fn worst(&self) -> Option<Worst>;
}

/// The UART or the adapter switches the line driver (hardware driver enable). Prefer this if available.
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

    fn worst(&self) -> Option<Worst> {
        None
    }
}

/// The worst-case inaccuracy with which software switches the line driver. The numbers depend on the board, the HAL and the
/// executor, which a library cannot know, so none of them has a default.
///
/// The driver has to be switched off after the last bit of a request and before the encoder may answer, four bits later (1.6 us at
/// 2.5 Mbit/s, 0.8 us at 5) unless `turn_around_ns` of the line says otherwise. `uart_start_ns + wake_ns + 2 * clock_ns` has to
/// fit in between: the time is read once when the request begins and once when it ends. If it does not fit, creating the
/// [`Driver`](crate::tformat::blocking::Driver) fails with [`PinTooSlow`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Worst {
    /// Time from the return of `write` to the start bit on the line, in ns: a UART waits for its next bit clock (up to 400
    /// ns at 2.5 Mbit/s), a buffered one for its interrupt, one with DMA for its set-up. If the rate is too low, add the
    /// time by which a request lasts longer: 1 % of four fields is 160 ns. If it is understated, requests are cut off.
    pub uart_start_ns: u32,
    /// Time from the instant at which the pin should switch until it does, in ns: the duration of interrupts served meanwhile,
    /// for futures the latency of the executor and its timer, and the latency of the pin. If it is understated, the driver is
    /// switched off while the encoder answers, which is reported.
    pub wake_ns: u32,
    /// A tick of the clock, in ns: 6 for a cycle counter at 170 MHz, 1 000 for a timer of 1 MHz, which is too long. If it is
    /// understated, requests are cut off.
    pub clock_ns: u32,
}

/// It is not certain that the line driver can be switched off between the end of a request and the answer.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, thiserror::Error)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[error("the direction pin is too slow: {missing_ns} ns are missing in a window of {window_ns} ns")]
pub struct PinTooSlow {
    /// The time that is missing, in ns.
    pub missing_ns: u32,
    /// Time from the end of a request to the earliest answer, in ns.
    pub window_ns: u32,
}

#[cfg(feature = "tformat")]
impl Worst {
    /// Checks that the window is long enough for the pin.
    pub(crate) fn check(self, window_ns: u32) -> Result<(), PinTooSlow> {
        let clock_ns = self.clock_ns.saturating_mul(2);
        let needed_ns = self.uart_start_ns.saturating_add(self.wake_ns).saturating_add(clock_ns);
        match needed_ns.saturating_sub(window_ns) {
            0 => Ok(()),
            missing_ns => Err(PinTooSlow { missing_ns, window_ns }),
        }
    }
}

/// A pin connected to DE, or to DE and /RE tied together: high while sending, switched by software.
///
/// ```
/// use servowire_drivers::{DirectionPin, Worst};
///
/// # fn make<P: embedded_hal::digital::OutputPin>(pin: P) -> DirectionPin<P> {
/// // a UART without a buffer, interrupts of up to 0.8 us, a cycle counter at 170 MHz
/// DirectionPin::new(pin, Worst { uart_start_ns: 400, wake_ns: 800, clock_ns: 6 })
/// # }
/// ```
#[derive(Debug, Clone, Copy)]
pub struct DirectionPin<P> {
    pin: P,
    worst: Worst,
}

impl<P> DirectionPin<P> {
    /// Creates a direction pin that switches within these worst cases.
    pub const fn new(pin: P, worst: Worst) -> Self {
        Self { pin, worst }
    }

    /// Returns the pin.
    pub fn release(self) -> P {
        self.pin
    }
}

impl<P: OutputPin> Direction for DirectionPin<P> {
    type Error = P::Error;

    fn transmit(&mut self) -> Result<(), P::Error> {
        self.pin.set_high()
    }

    fn receive(&mut self) -> Result<(), P::Error> {
        self.pin.set_low()
    }

    fn worst(&self) -> Option<Worst> {
        Some(self.worst)
    }
}

/// The line driver, and whether it may be on, which is possible before the first call, after a future was forgotten, and after
/// the pin reported an error.
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
    /// Makes sure that the driver is off, before listening.
    pub(crate) fn off(&mut self) -> Result<(), D::Error> {
        if self.on {
            self.direction.receive()?;
            self.on = false;
        }
        Ok(())
    }

    /// Switches the driver on. The caller has to make sure that it is switched off.
    pub(crate) fn on(&mut self) -> Result<(), D::Error> {
        self.on = true;
        self.direction.transmit()
    }

    #[cfg(feature = "tformat")]
    pub(crate) const fn is_on(&self) -> bool {
        self.on
    }

    #[cfg(feature = "tformat")]
    pub(crate) fn worst(&self) -> Option<Worst> {
        self.direction.worst()
    }

    #[cfg(feature = "tformat")]
    /// Checks that it can be switched within this window.
    pub(crate) fn check(&self, window_ns: u32) -> Result<(), PinTooSlow> {
        self.worst().map_or(Ok(()), |worst| worst.check(window_ns))
    }

    /// Switches the driver on until the guard is dropped.
    pub(crate) fn transmit(&mut self) -> Result<Guard<'_, D>, D::Error> {
        let guard = Guard(self);
        guard.0.on()?;
        Ok(guard)
    }
}

/// Switches the driver off when dropped, whatever has happened.
#[derive(Debug)]
pub(crate) struct Guard<'a, D: Direction>(&'a mut Switch<D>);

impl<D: Direction> Guard<'_, D> {
    /// Switches the driver off and returns whether that succeeded; if not, it tries once more.
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

#[cfg(all(test, feature = "tformat"))]
mod tests {
    use super::*;

    /// Four bits are 1,600 ns at 2.5 Mbit/s. The clock tick counts twice.
    #[test]
    fn what_is_missing_is_said() {
        let worst = |uart_start_ns, wake_ns, clock_ns| Worst { uart_start_ns, wake_ns, clock_ns };
        assert_eq!(worst(400, 1_000, 100).check(1_600), Ok(()));
        for worse in [worst(401, 1_000, 100), worst(400, 1_001, 100)] {
            assert_eq!(worse.check(1_600), Err(PinTooSlow { missing_ns: 1, window_ns: 1_600 }));
        }
        assert_eq!(worst(400, 1_000, 101).check(1_600), Err(PinTooSlow { missing_ns: 2, window_ns: 1_600 }));
        // The usual clock of embassy-time, whatever else is true.
        assert_eq!(worst(0, 0, 1_000).check(1_600), Err(PinTooSlow { missing_ns: 400, window_ns: 1_600 }));
        assert!(worst(u32::MAX, u32::MAX, u32::MAX).check(0).is_err());
    }
}
