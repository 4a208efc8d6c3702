//! How flag sets are printed.

/// `Display` and `defmt::Format` of a set declared with `bitflags`: the names, then the bits without a name, `LAST 40h`.
macro_rules! show_flags {
    ($name:ty) => {
        impl core::fmt::Display for $name {
            fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
                let rest = self.iter_names().fold(*self, |rest, (_, flag)| rest.difference(flag)).bits();
                servowire_core::write_names(f, self.iter_names().map(|(name, _)| name))?;
                match rest {
                    0 => Ok(()),
                    rest if rest == self.bits() => write!(f, "{rest:02X}h"),
                    rest => write!(f, " {rest:02X}h"),
                }
            }
        }

        #[cfg(feature = "defmt")]
        #[cfg_attr(docsrs, doc(cfg(feature = "defmt")))]
        impl defmt::Format for $name {
            fn format(&self, f: defmt::Formatter<'_>) {
                let (mut rest, mut gap) = (*self, "");
                for (name, flag) in self.iter_names() {
                    rest = rest.difference(flag);
                    defmt::write!(f, "{=str}{=str}", gap, name);
                    gap = " ";
                }
                if !rest.is_empty() {
                    defmt::write!(f, "{=str}{=u16:02X}h", gap, u16::from(rest.bits()));
                }
            }
        }
    };
}

pub(crate) use show_flags;
