//! The PLL of an STM32: crystal / M x N / R.

/// The limits of a PLL from the data sheet of the chip: minimum and maximum of each.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PllLimits {
    /// Input of the phase comparator, Hz.
    pub input_hz: (u32, u32),
    /// Its oscillator, Hz.
    pub vco_hz: (u32, u32),
    /// Divider before it.
    pub m: (u32, u32),
    /// Multiplier.
    pub n: (u32, u32),
}

impl PllLimits {
    /// STM32G474 data sheet, PLL characteristics; RM0440, `RCC_PLLCFGR`.
    pub const STM32G4: Self =
        Self { input_hz: (2_660_000, 16_000_000), vco_hz: (96_000_000, 344_000_000), m: (1, 16), n: (8, 127) };
    /// STM32F405 data sheet, main PLL characteristics; RM0090, `RCC_PLLCFGR`.
    pub const STM32F4: Self =
        Self { input_hz: (950_000, 2_100_000), vco_hz: (100_000_000, 432_000_000), m: (2, 63), n: (50, 432) };
}

/// Settings of a PLL.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Pll {
    /// Divider before it.
    pub m: u32,
    /// Multiplier.
    pub n: u32,
    /// Divider after it: 2, 4, 6 or 8.
    pub r: u32,
}

impl Pll {
    /// Returns the settings that make exactly `out_hz` from `in_hz`, with the highest frequency at the comparator. `None`
    /// if there are none.
    #[must_use]
    pub const fn solve(limits: PllLimits, in_hz: u32, out_hz: u32) -> Option<Self> {
        let mut m = limits.m.0;
        while m <= limits.m.1 {
            let mut r = 2;
            while r <= 8 {
                if let Some(n) = multiplier(limits, in_hz, m, (out_hz as u64).wrapping_mul(r as u64)) {
                    return Some(Self { m, n, r });
                }
                r = r.wrapping_add(2);
            }
            m = m.wrapping_add(1);
        }
        None
    }
}

impl PllLimits {
    /// Returns the settings that make exactly `out_hz` from `in_hz`; otherwise a `const` does not compile.
    ///
    /// # Panics
    /// If there are none.
    #[must_use]
    #[expect(clippy::panic, reason = "at compile time")]
    pub const fn exact(self, in_hz: u32, out_hz: u32) -> Pll {
        match Pll::solve(self, in_hz, out_hz) {
            Some(pll) => pll,
            None => panic!("no PLL makes the core clock of this crystal"),
        }
    }
}

/// Returns the multiplier with which the oscillator runs at `vco_hz`.
#[expect(clippy::arithmetic_side_effects, clippy::cast_possible_truncation, reason = "m is not 0; n is within limits")]
const fn multiplier(limits: PllLimits, in_hz: u32, m: u32, vco_hz: u64) -> Option<u32> {
    let (scaled, in_hz, m) = (vco_hz * m as u64, in_hz as u64, m as u64);
    if in_hz == 0 || in_hz < limits.input_hz.0 as u64 * m || in_hz > limits.input_hz.1 as u64 * m {
        return None;
    }
    let n = scaled / in_hz;
    let exact = n * in_hz == scaled;
    let within = n >= limits.n.0 as u64 && n <= limits.n.1 as u64;
    if exact && within && vco_hz >= limits.vco_hz.0 as u64 && vco_hz <= limits.vco_hz.1 as u64 {
        Some(n as u32)
    } else {
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn boards_with_their_crystals() {
        for (limits, crystal_hz, want) in [
            // Nucleo with a G4; B-G431B-ESC1; the internal oscillator.
            (PllLimits::STM32G4, 24_000_000, Some((3, 40, 2))),
            (PllLimits::STM32G4, 8_000_000, Some((1, 40, 2))),
            (PllLimits::STM32G4, 16_000_000, Some((1, 20, 2))),
            // Feather; Nucleo-64; Netduino Plus 2; the internal oscillator.
            (PllLimits::STM32F4, 12_000_000, Some((6, 160, 2))),
            (PllLimits::STM32F4, 8_000_000, Some((4, 160, 2))),
            (PllLimits::STM32F4, 25_000_000, Some((15, 192, 2))),
            (PllLimits::STM32F4, 16_000_000, Some((8, 160, 2))),
            // 2.5 MHz is too slow for the comparator, 11.0592 MHz never makes 160.
            (PllLimits::STM32G4, 2_500_000, None),
            (PllLimits::STM32G4, 11_059_200, None),
            (PllLimits::STM32G4, 0, None),
        ] {
            let found = Pll::solve(limits, crystal_hz, 160_000_000);
            assert_eq!(found.map(|Pll { m, n, r }| (m, n, r)), want, "{crystal_hz}");
        }
    }

    #[test]
    fn no_setting_is_outside_the_limits() {
        let (mut found, mut none) = (0, 0);
        for limits in [PllLimits::STM32G4, PllLimits::STM32F4] {
            for in_khz in (100..50_000).step_by(100) {
                let Some(Pll { m, n, r }) = Pll::solve(limits, in_khz * 1_000, 160_000_000) else {
                    none += 1;
                    continue;
                };
                found += 1;
                let within =
                    |value: f64, (least, most): (u32, u32)| f64::from(least) <= value && value <= f64::from(most);
                let comparator = f64::from(in_khz) * 1e3 / f64::from(m);
                assert!(within(comparator, limits.input_hz) && within(comparator * f64::from(n), limits.vco_hz));
                assert!(within(m.into(), limits.m) && within(n.into(), limits.n) && [2, 4, 6, 8].contains(&r));
                assert!((comparator * f64::from(n) / f64::from(r) - 160e6).abs() < 1e-3);
            }
        }
        assert!(found > 50 && none > 50, "{found} found, {none} not");
    }
}
