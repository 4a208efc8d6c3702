//! The DRV8711 of servowire-drivers: set-up, registers, current.

use servowire_drivers::drv8711::{
    self, Apply, Configuration, IsGain, Register, Word, full_scale_microamps, torque_for_microamps,
};

use super::kernels;

kernels! {
    /// A configuration of the motor driver to its first two words, and a refusal.
    fn drv8711_apply(configuration: &Configuration) -> (Option<Word>, Option<Word>, bool) {
        let mut apply = Apply::new(*configuration);
        let first = apply.transmission();
        let _ = apply.hear([0, 0]);
        let second = apply.transmission();
        (first, second, apply.hear([0xff, 0xff]).is_ok())
    } over [CONFIGURATION];

    /// The registers from their values.
    fn drv8711_parse(value: &u16) -> (u16, u16, u16, bool) {
        let codes = |register: Register| register.fields().iter().map(|field| field.get(*value)).sum();
        let ctrl = drv8711::Ctrl::parse(*value).map_or(0, drv8711::Ctrl::value);
        let decay = drv8711::Decay::parse(*value).map_or(0, drv8711::Decay::value);
        let status = drv8711::Status::of_register(*value);
        (ctrl, decay, codes(Register::Drive), status.is_fault() | status.looks_unpowered())
    } over [0xc10_u16, 0xfff, 0x110];

    /// Current and torque.
    fn drv8711_current((torque, microamps): &(u8, u32)) -> (Option<u32>, Option<u8>) {
        (full_scale_microamps(*torque, IsGain::X10, 50), torque_for_microamps(*microamps, IsGain::X10, 50))
    } over [(255_u8, 1_500_000_u32)];
}

const CONFIGURATION: Configuration = Configuration {
    ctrl: drv8711::Ctrl {
        enable: true,
        reverse_direction: false,
        step: false,
        mode: drv8711::StepMode::Div256,
        external_stall: false,
        gain: IsGain::X10,
        dead_time: drv8711::DeadTime::Ns850,
    },
    torque: drv8711::Torque { torque: 0x70, sample_threshold: drv8711::SampleThreshold::Us400 },
    off: drv8711::Off { off_time: 0x30, bypass_indexer: false },
    blank: drv8711::Blank { blank_time: 0x80, adaptive: true },
    decay: drv8711::Decay { decay_time: 0x10, mode: drv8711::DecayMode::AutoMixed },
    stall: drv8711::Stall {
        threshold: 0x40,
        count: drv8711::StallCount::Steps1,
        divider: drv8711::StallDivider::Div32,
    },
    drive: drv8711::Drive {
        ocp_threshold: drv8711::OcpThreshold::Mv500,
        ocp_deglitch: drv8711::OcpDeglitch::Us4,
        sink_time: drv8711::DriveTime::Ns500,
        source_time: drv8711::DriveTime::Ns500,
        sink_current: drv8711::SinkCurrent::Ma300,
        source_current: drv8711::SourceCurrent::Ma150,
    },
};
