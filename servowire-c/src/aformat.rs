//! Nikon A-format.

mod bus;
mod codec;
mod device;
mod names;
mod procedure;
mod words;

pub use bus::{
    sw_aformat_angle, sw_aformat_hear, sw_aformat_init, sw_aformat_missing, sw_aformat_poll, sw_aformat_position,
    sw_aformat_read, sw_aformat_response, sw_aformat_set_hand_over, sw_aformat_t, sw_aformat_transmission_t,
    sw_aformat_until_ns,
};
pub use codec::{
    sw_aformat_build, sw_aformat_encoder_t, sw_aformat_layout, sw_aformat_parse, sw_aformat_parse_as,
    sw_aformat_parse_line, sw_aformat_request_t, sw_aformat_response_t,
};
pub use device::{
    sw_aformat_answer_t, sw_aformat_device_hear, sw_aformat_device_set_alarms, sw_aformat_device_set_eeprom,
    sw_aformat_device_set_position, sw_aformat_device_start, sw_aformat_device_t,
};
pub use names::{sw_aformat_error_t, sw_aformat_es_t, sw_aformat_layout_t, sw_aformat_option_t};
pub use procedure::{
    sw_aformat_detect, sw_aformat_detected, sw_aformat_eeprom_read, sw_aformat_eeprom_write, sw_aformat_next,
    sw_aformat_procedure_hear, sw_aformat_procedure_poll, sw_aformat_procedure_t, sw_aformat_procedure_until_ns,
    sw_aformat_reset, sw_aformat_set_address, sw_aformat_value, sw_aformat_write_id,
};
pub use words::{
    sw_aformat_abs40_t, sw_aformat_bus_missing, sw_aformat_bus_push, sw_aformat_bus_push_abs40, sw_aformat_bus_start,
    sw_aformat_bus_start_abs40, sw_aformat_bus_t, sw_aformat_parse_abs40,
};
