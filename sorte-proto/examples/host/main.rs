//! What the published firmware shares with its host: the map of both memories, or what a dump of one says.
//!
//! `cargo run -p sorte-proto --example host -- [DUMP]` for the master's data RAM, and with `--device DUMP` for a device's
//! shared RAM.

use core::error::Error;

use sorte_proto::DeviceAddress;

mod memory;
use memory::{DEVICE, DeviceMemory, MASTER, MasterMemory, Region};

fn map(title: &str, places: &[Region]) {
    println!("{title}");
    for Region { name, offset, len } in places {
        println!("  {offset:#05x}  {:>4}  {name}", len.map_or_else(|| "?".to_owned(), |len| len.to_string()));
    }
}

fn master(ram: &[u8]) -> Result<(), Box<dyn Error>> {
    let master = MasterMemory::new(ram);
    println!("enabled {:?}, state {:?}, version {:x?}", master.is_enabled(), master.state(), master.version());
    let limits = master.control_parameter();
    let changed =
        if limits == Some(MasterMemory::CONTROL_PARAMETER) { "as after reset" } else { "changed by the host" };
    println!("starts again by itself {:?}, control parameter {limits:x?}, {changed}", master.retrains());
    println!("devices {:?}", master.devices());
    println!("output image {:02x?}, input {:02x?}", master.output(16), master.input());
    for (address, entry) in (1..).zip(master.discovery()?.entries()) {
        println!("  device {address}: {} bytes in, {} out", entry.input, entry.output);
    }
    Ok(())
}

fn device(ram: &[u8]) {
    let device = DeviceMemory::new(ram);
    println!("address {:?}, {:?} ns from the master", device.address().map(DeviceAddress::get), device.delay_ns());
    println!("line to the next device {:?} ns", device.line_delay_next_ns());
    println!("last SYNC: {:?}", device.last_sync());
    println!("good frames {:?}, wrong checks {:?}", device.good_frames(), device.crc_errors());
    println!("missed frames {:?}, retrains {:?}", device.missed_frames(), device.retrains());
    println!("motor driver {:?}, parameters {:?}", device.driver(), device.parameters());
    println!("master's time at its last frame {:?} ns", device.reference_ns());
}

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
    match *arguments {
        [] => {
            map("master, data RAM: offset, bytes, what", &MASTER);
            map("device, shared RAM: offset, bytes, what", &DEVICE);
        }
        ["--device", path] => device(&std::fs::read(path)?),
        [path] => master(&std::fs::read(path)?)?,
        _ => return Err("one dump, or --device and one".into()),
    }
    Ok(())
}
