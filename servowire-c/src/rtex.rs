//! Panasonic RTEX.

mod axis;
mod block;
mod names;

pub use axis::{
    sw_rtex_axis_clear, sw_rtex_axis_hear, sw_rtex_axis_set_control, sw_rtex_axis_set_position, sw_rtex_axis_set_rate,
    sw_rtex_axis_setpoint, sw_rtex_axis_start, sw_rtex_axis_state, sw_rtex_axis_stop, sw_rtex_axis_switch_off,
    sw_rtex_axis_switch_on, sw_rtex_axis_t, sw_rtex_axis_transmit, sw_rtex_config_t, sw_rtex_feedback,
    sw_rtex_feedback_t, sw_rtex_state_of_t,
};
pub use block::{
    sw_rtex_build_command, sw_rtex_command_t, sw_rtex_parse_command, sw_rtex_parse_response, sw_rtex_response_t,
};
pub use names::{
    sw_rtex_axis_code_t, sw_rtex_control_t, sw_rtex_error_t, sw_rtex_mode_t, sw_rtex_reason_t, sw_rtex_status_t,
};
