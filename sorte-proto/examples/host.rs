//! What the published firmware shares with its host: the map of both memories, or what a dump of the master's data RAM says.
//!
//! `cargo run -p sorte-proto --example host -- [DUMP]`

use core::error::Error;

use sorte_proto::host::{DEVICE, MASTER, MasterMemory, Place};

fn map(title: &str, places: &[Place]) {
    println!("{title}");
    for Place { name, offset, len } in places {
        println!("  {offset:#05x}  {:>4}  {name}", len.map_or_else(|| "?".to_owned(), |len| len.to_string()));
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let Some(path) = std::env::args().nth(1) else {
        map("master, data RAM: offset, bytes, what", &MASTER);
        map("device, shared RAM: offset, bytes, what", &DEVICE);
        return Ok(());
    };
    let ram = std::fs::read(path)?;
    let master = MasterMemory::new(&ram);
    println!("enabled {:?}, state {:?}, version {:x?}", master.is_enabled(), master.state(), master.version());
    println!("devices {:?}", master.devices());
    for (address, entry) in (1..).zip(master.discovery()?.entries()) {
        println!("  device {address}: {} bytes in, {} out", entry.input, entry.output);
    }
    Ok(())
}
