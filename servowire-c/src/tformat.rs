//! T-Format.

mod codec;
mod device;
mod master;
mod names;
mod procedure;
mod spi;
mod typed;

pub use codec::{
    sw_detail_t, sw_tformat_build, sw_tformat_build_line, sw_tformat_build_response, sw_tformat_control_field,
    sw_tformat_crc, sw_tformat_parse, sw_tformat_parse_control_field, sw_tformat_parse_echoed, sw_tformat_parse_line,
    sw_tformat_parse_request, sw_tformat_request_t, sw_tformat_response_t, sw_tformat_why, sw_tformat_widths,
};
pub use device::{
    sw_tformat_answer_t, sw_tformat_device_answer, sw_tformat_device_framing_error, sw_tformat_device_hear,
    sw_tformat_device_page, sw_tformat_device_set_alarms, sw_tformat_device_set_position, sw_tformat_device_start,
    sw_tformat_device_t,
};
pub use master::{
    sw_position_t, sw_tformat_angle, sw_tformat_doubt, sw_tformat_framing_error, sw_tformat_get_line, sw_tformat_hear,
    sw_tformat_init, sw_tformat_line_t, sw_tformat_poll, sw_tformat_position, sw_tformat_read, sw_tformat_response,
    sw_tformat_set_line, sw_tformat_set_resolution, sw_tformat_start, sw_tformat_t, sw_tformat_tolerate,
    sw_tformat_transmission_t, sw_tformat_until_ns,
};
pub use names::{
    sw_bit_order_t, sw_tformat_adf_t, sw_tformat_almc_t, sw_tformat_doubt_t, sw_tformat_error_t, sw_tformat_id_t,
    sw_tformat_sf_t, sw_tformat_turns_t,
};
pub use procedure::{
    sw_tformat_clear_errors, sw_tformat_clear_turns_and_lose_multi_turn_reference, sw_tformat_detect,
    sw_tformat_eeprom_read, sw_tformat_eeprom_write, sw_tformat_next, sw_tformat_procedure_t, sw_tformat_value,
    sw_tformat_zero_single_turn_and_shift_commutation_angle,
};
pub use spi::{sw_tformat_build_spi10, sw_tformat_build_spi16, sw_tformat_parse_spi10, sw_tformat_parse_spi16};
pub use typed::{
    sw_tformat_all_t, sw_tformat_encoder_id_t, sw_tformat_multi_turn_t, sw_tformat_parse_all,
    sw_tformat_parse_encoder_id, sw_tformat_parse_multi_turn, sw_tformat_parse_single_turn, sw_tformat_single_turn_t,
};
