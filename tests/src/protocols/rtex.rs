//! Panasonic RTEX data block and the master around it.

mod blocks;
mod constants;
mod fields;
mod master;
mod timing;
mod traces;

use crate::row::Check;

pub(crate) const TOPICS: &[(&str, Check)] = &[
    ("axis_traces", traces::axis),
    ("bitflips", master::bitflips),
    ("commands16", blocks::commands),
    ("commands32", blocks::commands),
    ("constants", constants::constants),
    ("control_bits", blocks::control_bits),
    ("counter_start", master::counter_start),
    ("drive_check", master::drive_check),
    ("frame_time", timing::frame_time),
    ("handshake", traces::handshake),
    ("header_byte0", blocks::header_byte0),
    ("header_byte1", blocks::header_byte1),
    ("led", timing::led),
    ("master_check", master::master_check),
    ("noncyclic_traces", master::noncyclic_traces),
    ("packing", blocks::packing),
    ("periods_a6n", timing::periods_a6n),
    ("phase_traces", timing::phase_traces),
    ("position_rate", timing::position_rate),
    ("position_step", timing::position_step),
    ("profile_traces", traces::profile),
    ("responses16", blocks::responses),
    ("responses32", blocks::responses),
    ("servo_off", master::servo_off),
    ("status_flags", blocks::status_flags),
    ("sub_traces", traces::sub),
    ("timer_reload", timing::timer_reload),
    ("update_counter_traces", master::update_counter_traces),
];
