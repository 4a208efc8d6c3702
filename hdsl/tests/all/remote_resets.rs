//! `RemoteReceiver` on the buses of both devices while the link restarts, the encoder is mute, or the bus fails: no message ends
//! with what nobody answered, none is under way for ever, and no event is lost or told twice.

use core::convert::Infallible;

use hdsl::message::{LongRequest, RemoteRegister, ResourceAddress, ShortRequest};
use hdsl::registers::{BusError, Event, EventS, RegisterBus, RemoteReceiver};
use hdsl::{Dialect, Error};

use crate::remote::{Core, Firmware};

const READ: ShortRequest = ShortRequest::Read(RemoteRegister::SRSSI);

fn name() -> LongRequest {
    LongRequest::read_name(ResourceAddress::RESOLUTN)
}

/// Either device.
trait Device: RegisterBus<Error = Infallible> {
    /// What SRSSI holds.
    const VALUE: u8;
    fn pass(&mut self);
    fn lose(&mut self);
    fn mute(&mut self, mute: bool);
    fn register(&mut self, address: usize) -> &mut u8;
}

macro_rules! device {
    ($device:ident, $registers:ident, $value:literal) => {
        impl Device for $device {
            const VALUE: u8 = $value;

            fn pass(&mut self) {
                self.frame();
            }

            fn lose(&mut self) {
                self.restart();
            }

            fn mute(&mut self, mute: bool) {
                self.mute = mute;
            }

            fn register(&mut self, address: usize) -> &mut u8 {
                &mut self.$registers[address]
            }
        }
    };
}
device!(Firmware, memory, 0x5a);
device!(Core, registers, 0x3c);

/// Runs the same for both.
macro_rules! both {
    ($run:ident) => {
        $run(RemoteReceiver::new(Dialect::TI, Firmware::new()));
        $run(RemoteReceiver::new(Dialect::SICK, Core::new()));
    };
}

/// Both messages, started and answered.
fn works<B: Device>(remote: &mut RemoteReceiver<B>) {
    remote.start_short(READ).unwrap();
    remote.start_long(&name()).unwrap();
    assert_eq!((remote.poll_short(), remote.poll_long()), (Ok(None), Ok(None)));
    remote.bus().pass();
    assert_eq!(remote.poll_short(), Ok(Some(B::VALUE)));
    assert_eq!(remote.poll_long().unwrap().unwrap().as_bytes(), b"RESOLUTN");
    assert_eq!((remote.poll_short(), remote.poll_long()), (Ok(None), Ok(None)));
}

/// A restart of the link drops what is under way; the events of the next lock are no answers. Whether the events are taken before the
/// messages are polled changes nothing.
#[test]
fn a_restart_is_no_answer() {
    fn run<B: Device>(mut remote: RemoteReceiver<B>) {
        for taken in [false, true] {
            // One from before, which says nothing about the messages to come.
            remote.bus().lose();
            works(&mut remote);
            let before = remote.take_events().unwrap();
            assert!(
                before.drive.contains(Event::PRST) && before.safe.contains(EventS::PRST),
                "kept for the application"
            );
            remote.start_short(READ).unwrap();
            remote.start_long(&name()).unwrap();
            remote.bus().lose();
            if taken {
                assert!(remote.take_events().unwrap().drive.contains(Event::PRST));
            }
            assert_eq!(remote.poll_short(), Err(BusError::Link(Error::Dropped)));
            assert_eq!(remote.poll_long(), Err(BusError::Link(Error::Dropped)));
            works(&mut remote);
            let _ = remote.take_events();
            assert!(!remote.take_events().unwrap().drive.contains(Event::PRST), "told once");
            // The long one alone.
            remote.start_long(&name()).unwrap();
            remote.bus().lose();
            assert_eq!(remote.poll_long(), Err(BusError::Link(Error::Dropped)));
            works(&mut remote);
            let _ = remote.take_events();
        }
    }
    both!(run);
}

/// An encoder that does not answer: a reset ends the messages, and the next ones wait until the encoder has answered INIT.
#[test]
fn a_mute_encoder_is_reset() {
    fn run<B: Device>(mut remote: RemoteReceiver<B>) {
        for round in 0..3 {
            remote.bus().mute(true);
            remote.start_short(READ).unwrap();
            remote.start_long(&name()).unwrap();
            for _ in 0..100 {
                remote.bus().pass();
                assert_eq!((remote.poll_short(), remote.poll_long()), (Ok(None), Ok(None)));
                assert_eq!(remote.start_short(READ), Err(BusError::Link(Error::Busy)));
            }
            // MIN of an earlier reset is among the events; what else is set stays so; it is asked for twice.
            *remote.bus().register(0x05) |= 0x20;
            *remote.bus().register(0x00) = 0x03;
            remote.reset_messages().unwrap();
            remote.reset_messages().unwrap();
            assert_eq!(*remote.bus().register(0x00), 0x43);
            if round == 2 {
                assert!(remote.take_events().unwrap().drive.contains(Event::MIN), "kept for the application");
            }
            remote.bus().mute(false);
            let mut frames = 0;
            while remote.start_short(READ).is_err() {
                if frames <= 7 {
                    assert_eq!(remote.start_long(&name()), Err(BusError::Link(Error::Busy)));
                }
                if round == 1 {
                    let _ = remote.take_events();
                }
                remote.bus().pass();
                frames += 1;
                assert!(frames < 10);
            }
            assert!(matches!(frames, 8 | 9), "{frames}: when the encoder has answered INIT");
            assert_eq!(remote.poll_short(), Ok(None));
            remote.bus().pass();
            assert_eq!(remote.poll_short(), Ok(Some(B::VALUE)));
            works(&mut remote);
        }
        assert!(remote.take_events().unwrap().drive.contains(Event::MIN));
        // Without an encoder nobody answers INIT; the restart of the link ends the reset.
        remote.reset_messages().unwrap();
        assert_eq!(remote.start_short(READ), Err(BusError::Link(Error::Busy)));
        remote.bus().lose();
        works(&mut remote);
    }
    both!(run);
}

/// Events that are kept and come again are told, once.
#[test]
fn what_is_kept_and_comes_again() {
    fn run<B: Device>(mut remote: RemoteReceiver<B>) {
        for times in 1..5 {
            for _ in 0..times {
                remote.bus().lose();
                works(&mut remote);
            }
            for (lose, want) in [(false, true), (false, false), (true, true), (false, false)] {
                if lose {
                    remote.bus().lose();
                }
                let events = remote.take_events().unwrap();
                let told = [events.drive.contains(Event::PRST), events.safe.contains(EventS::PRST)];
                assert_eq!(told, [want; 2], "{times} {events:?}");
            }
            for _ in 0..times {
                remote.reset_messages().unwrap();
                while remote.start_short(READ).is_err() {
                    remote.bus().pass();
                }
                remote.bus().pass();
                assert_eq!(remote.poll_short(), Ok(Some(B::VALUE)));
            }
            // MIN of all of them, and none after it.
            assert!(remote.take_events().unwrap().drive.contains(Event::MIN));
            assert!(!remote.take_events().unwrap().drive.contains(Event::MIN));
            // Asked for, and not answered yet: no MIN. QMLW comes meanwhile, and stays.
            remote.reset_messages().unwrap();
            *remote.bus().register(0x05) |= 0x04;
            assert_eq!(remote.start_short(READ), Err(BusError::Link(Error::Busy)));
            assert_eq!(remote.take_events().unwrap().drive & (Event::MIN | Event::QMLW), Event::QMLW);
            // MIN that was there before each of two resets.
            for _ in 0..times {
                *remote.bus().register(0x05) |= 0x20;
                remote.reset_messages().unwrap();
            }
            assert!(remote.take_events().unwrap().drive.contains(Event::MIN));
            remote.bus().lose();
            works(&mut remote);
            let _ = remote.take_events();
        }
    }
    both!(run);
}

/// Events that were read and could not be cleared are read again: the ends of the messages are still ends.
#[test]
fn events_that_are_read_twice() {
    fn run<B: Device>(new: fn() -> B, dialect: Dialect) {
        for fails_at in 0..5 {
            let mut remote = RemoteReceiver::new(dialect, Failing { bus: new(), left: None });
            remote.start_short(READ).unwrap();
            remote.start_long(&name()).unwrap();
            remote.bus().bus.pass();
            // EVENT_H.
            *remote.bus().bus.register(0x04) |= Event::POS.bits().to_be_bytes()[0];
            remote.bus().left = Some(fails_at);
            let calls: Vec<_> = [(); 2].map(|()| remote.take_events()).into();
            let told = calls[usize::from(fails_at < 4)].unwrap();
            assert_eq!(calls[0].is_ok(), fails_at >= 4);
            assert!(told.drive.contains(Event::POS | Event::FREL) && told.safe.contains(EventS::FRES), "{told:?}");
            remote.bus().left = None;
            assert_eq!(remote.poll_short(), Ok(Some(B::VALUE)));
            assert_eq!(remote.poll_long().unwrap().unwrap().as_bytes(), b"RESOLUTN");
        }
    }
    run(Firmware::new, Dialect::TI);
    run(Core::new, Dialect::SICK);
}

/// A bus on which every access in turn fails once.
struct Failing<B> {
    bus: B,
    /// Number of accesses before the one that fails.
    left: Option<u32>,
}

impl<B> Failing<B> {
    fn fails(&mut self) -> Result<(), ()> {
        match self.left {
            Some(0) => {
                self.left = None;
                Err(())
            }
            Some(left) => {
                self.left = Some(left - 1);
                Ok(())
            }
            None => Ok(()),
        }
    }
}

impl<B: Device> RegisterBus for Failing<B> {
    type Error = ();

    fn read(&mut self, address: u8, bytes: &mut [u8]) -> Result<(), ()> {
        self.fails()?;
        let Ok(()) = self.bus.read(address, bytes);
        Ok(())
    }

    fn write(&mut self, address: u8, bytes: &[u8]) -> Result<(), ()> {
        self.fails()?;
        let Ok(()) = self.bus.write(address, bytes);
        Ok(())
    }
}

/// Whichever access fails: the call fails, and what it would have brought comes with the next one.
#[test]
fn a_bus_that_fails_loses_nothing() {
    fn run<B: Device>(new: fn() -> B, dialect: Dialect) {
        let mut calls_that_failed = 0;
        for fails_at in 0..12 {
            let mut remote = RemoteReceiver::new(dialect, Failing { bus: new(), left: None });
            remote.bus().bus.lose();
            remote.start_short(READ).unwrap();
            remote.start_long(&name()).unwrap();
            remote.bus().bus.pass();
            remote.bus().left = Some(fails_at);
            let mut failed = 0;
            let mut again = |result: bool| failed += u32::from(!result);
            let (mut events, mut data, mut text) = (None, None, None);
            while events.is_none() || data.is_none() || text.is_none() {
                if events.is_none() {
                    events = remote.take_events().ok();
                    again(events.is_some());
                }
                if data.is_none() {
                    let polled = remote.poll_short();
                    again(polled.is_ok());
                    data = polled.ok().map(|data| data.unwrap());
                }
                if text.is_none() {
                    let polled = remote.poll_long();
                    again(polled.is_ok());
                    text = polled.ok().map(|text| text.unwrap());
                }
            }
            calls_that_failed += failed;
            assert_eq!((failed <= 1, data, text.unwrap().as_bytes()), (true, Some(B::VALUE), &b"RESOLUTN"[..]));
            // The ends need not be among the events if the messages were polled before.
            let (events, first) = (events.unwrap(), failed == 0 || fails_at > 4);
            assert!(events.drive.contains(Event::PRST) && events.safe.contains(EventS::PRST), "{fails_at} {events:?}");
            let ends = events.drive.contains(Event::FREL) && events.safe.contains(EventS::FRES);
            assert!(ends || !first, "{fails_at} {events:?}");
            remote.bus().left = None;
            assert!(remote.take_events().unwrap().drive.is_empty());
        }
        assert!(calls_that_failed >= 8, "{calls_that_failed}");
    }
    run(Firmware::new, Dialect::TI);
    run(Core::new, Dialect::SICK);
}
