//! Serial ports, and information about them.

use std::io::{self, Read, Write};
use std::path::Path;
use std::time::Duration;

use serialport::{ClearBuffer, SerialPort, SerialPortType};
use tformat::BitRate;

use super::fault::Fault;

/// A serial port, or in tests a pseudo-terminal.
pub trait Port: Read + Write {
    /// How long a read waits for its first byte.
    ///
    /// # Errors
    /// That of the port.
    fn wait(&mut self, longest: Duration) -> io::Result<()>;
    /// Discards the bytes received.
    ///
    /// # Errors
    /// That of the port.
    fn forget(&mut self) -> io::Result<()>;
}

impl<P: SerialPort + ?Sized> Port for Box<P> {
    fn wait(&mut self, longest: Duration) -> io::Result<()> {
        Ok(self.set_timeout(longest)?)
    }

    fn forget(&mut self) -> io::Result<()> {
        Ok(self.clear(ClearBuffer::Input)?)
    }
}

/// Opens a port as T-Format requires: 8N1.
///
/// # Errors
/// That of the system, with advice.
pub fn open(name: &str, rate: BitRate) -> Result<Box<dyn SerialPort>, Fault> {
    let port = serialport::new(name, rate.bits_per_second()).timeout(Duration::from_millis(50));
    port.open().map_err(|error| {
        use serialport::ErrorKind::{Io, NoDevice};
        let missing = !Path::new(name).exists();
        let text = match error.kind() {
            NoDevice | Io(io::ErrorKind::NotFound) if missing => format!("there is no such port{}", ports()),
            NoDevice => format!("another program has the port: {error}"),
            Io(io::ErrorKind::PermissionDenied) => {
                format!("{error}; on Linux your user has to be in the group that owns the port, often dialout")
            }
            _ => format!("this is not a serial port, or it does not support {} Mbit/s: {error}", megabits(rate)),
        };
        Fault::Port(format!("{name}: {text}"))
    })
}

/// Mbit/s.
pub fn megabits(rate: BitRate) -> f64 {
    f64::from(rate.bits_per_second()) / 1e6
}

/// Lists the ports.
fn ports() -> String {
    let names: Vec<_> =
        serialport::available_ports().unwrap_or_default().into_iter().map(|port| port.port_name).collect();
    if names.is_empty() { "; there is no serial port".to_owned() } else { format!("; there are {}", names.join(", ")) }
}

/// Describes an adapter in sentences.
pub(super) fn about(name: &str, rate: BitRate) -> Vec<String> {
    let mut lines = Vec::new();
    let known = serialport::available_ports().unwrap_or_default();
    if let Some(SerialPortType::UsbPort(usb)) =
        known.into_iter().find(|port| port.port_name == name).map(|port| port.port_type)
    {
        let product = usb.product.unwrap_or_else(|| "USB adapter".to_owned());
        lines.push(format!("{product}, USB {:04x}:{:04x}{}", usb.vid, usb.pid, made_rate(usb.vid, usb.pid, rate)));
    }
    let device = name.rsplit('/').next().unwrap_or(name);
    if let Ok(timer) = std::fs::read_to_string(format!("/sys/bus/usb-serial/devices/{device}/latency_timer")) {
        let timer = timer.trim();
        lines.push(format!("latency timer {timer} ms: the adapter holds short answers back for that long"));
        if timer != "1" {
            lines
                .push(format!("to read faster: echo 1 > /sys/bus/usb-serial/devices/{device}/latency_timer (as root)"));
        }
    }
    lines
}

/// Returns the bit rate that an adapter produces for the one requested; encoders require it within 2.5 %.
fn made_rate(vid: u16, pid: u16, rate: BitRate) -> String {
    let asked = f64::from(rate.bits_per_second());
    // FTDI H types: 12 MHz divided by eighths; the others: 3 MHz by eighths, nothing between 2 and 3 MHz.
    let made = match (vid, pid) {
        (0x0403, 0x6010 | 0x6011 | 0x6014) => Some(12e6 / ((12e6 / asked * 8.0).floor() / 8.0)),
        (0x0403, 0x6001 | 0x6015) => return ": this chip makes neither 2.5 nor 5 Mbit/s: use an FT232H".to_owned(),
        (0x10c4, 0xea60) => return ": this chip makes neither 2.5 nor 5 Mbit/s well: use an FT232H".to_owned(),
        _ => None,
    };
    made.map_or_else(String::new, |made| {
        format!(
            ": asked for {} Mbit/s, this chip makes {:.3} ({:+.2} %)",
            asked / 1e6,
            made / 1e6,
            (made / asked - 1.0) * 100.0
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_rates_that_ftdi_chips_make() {
        assert_eq!(
            made_rate(0x0403, 0x6014, BitRate::Mbit2_5),
            ": asked for 2.5 Mbit/s, this chip makes 2.526 (+1.05 %)"
        );
        assert_eq!(made_rate(0x0403, 0x6014, BitRate::Mbit5), ": asked for 5 Mbit/s, this chip makes 5.053 (+1.05 %)");
        assert_eq!(made_rate(1, 2, BitRate::Mbit5), "");
    }
}
