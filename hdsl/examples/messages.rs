//! What an application can ask an encoder, as it goes over the line, and what changes the encoder for good:
//! `cargo run -p hdsl --example messages`.

use hdsl::message::{AccessLevel, Data, FileName, Length, LongRequest, Offset, ResourceAddress};

fn main() -> Result<(), Box<dyn core::error::Error>> {
    let name = FileName::new("MOTOR").ok_or("a name has one to eight characters")?;
    let (public, operator) = (AccessLevel::Public, AccessLevel::Operator);
    let at = Offset::truncate;
    let requests = [
        ("name of a resource", LongRequest::read_name(ResourceAddress::RESOLUTN)),
        ("its data type", LongRequest::read_attribute(ResourceAddress::RESOLUTN, at(5))),
        ("steps a turn", LongRequest::read(ResourceAddress::RESOLUTN, Length::Four)),
        ("type code from the 8th character on", LongRequest::read_at(ResourceAddress::TYPECODE, at(8), Length::Eight)),
        ("how many files", LongRequest::directory()),
        ("name of the first file", LongRequest::file_name(at(1))),
        ("access as operator with the key 1111", LongRequest::set_access(operator, *b"1111")),
        ("new file", LongRequest::create_file(name, operator, public)),
        ("open a file", LongRequest::load_file(name)),
        ("open it, checksums aside", LongRequest::load_file_unverified(name)),
        ("size and rights", LongRequest::file_status()),
        ("write into it", LongRequest::write_file(at(0), Data::new(&[0x00, 0x35])?)),
        ("read it back", LongRequest::read_file(at(0), Length::Two)),
        ("who may read and write it", LongRequest::change_file_rights(name, operator, operator)),
        ("count the user counter up", LongRequest::count_up()),
        ("reset the encoder", LongRequest::reset_encoder()),
        ("shut it down", LongRequest::shut_encoder_down_until_power_cycle()),
        ("clear the user counter", LongRequest::clear_user_counter_for_good()),
        ("delete the open file", LongRequest::delete_loaded_file_for_good(name)),
        ("another key", LongRequest::change_access_key_for_good(operator, *b"2222", *b"1111")),
    ];
    for (what, request) in requests {
        let bytes: Vec<String> = request.emit().as_bytes().iter().map(|byte| format!("{byte:02X}")).collect();
        let warning = if request.is_dangerous() { "  (dangerous)" } else { "" };
        println!("{what:38} {}{warning}", bytes.join(" "));
    }
    Ok(())
}
