use core::fmt;

/// Writes names separated by a space, as the crates print a set: `OF BE BA`, or `-` for the empty set.
pub fn write_names<'a>(f: &mut fmt::Formatter<'_>, names: impl IntoIterator<Item = &'a str>) -> fmt::Result {
    let mut names = names.into_iter();
    f.write_str(names.next().unwrap_or("-"))?;
    names.try_for_each(|name| write!(f, " {name}"))
}

/// Implements `Display`, and behind the calling crate's feature `defmt` also `defmt::Format`, for sets declared with `bitflags`
/// over `u8` or `u16`: the names of the set bits, then the bits without a name as one number, `LAST 40h`; `-` for the
/// empty set.
///
/// ```
/// #[derive(Clone, Copy)]
/// pub struct Lamps(u8);
/// bitflags::bitflags! {
///     impl Lamps: u8 {
///         const GREEN = 1 << 0;
///         const RED = 1 << 3;
///     }
/// }
/// servowire_core::show_flags!(Lamps);
///
/// let texts = [0x00, 0x09, 0x41, 0x40, 0x03, 0x02].map(|bits| Lamps::from_bits_retain(bits).to_string());
/// assert_eq!(texts, ["-", "GREEN RED", "GREEN 40h", "40h", "GREEN 02h", "02h"]);
/// ```
#[macro_export]
macro_rules! show_flags {
    ($($name:ty),+ $(,)?) => {
        $(
            impl core::fmt::Display for $name {
                fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
                    let rest = self.iter_names().fold(*self, |rest, (_, flag)| rest.difference(flag)).bits();
                    if rest != 0 && rest == self.bits() {
                        return write!(f, "{rest:02X}h");
                    }
                    $crate::write_names(f, self.iter_names().map(|(name, _)| name))?;
                    if rest == 0 { Ok(()) } else { write!(f, " {rest:02X}h") }
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
                    } else if self.is_empty() {
                        defmt::write!(f, "-");
                    }
                }
            }
        )+
    };
}

/// Implements `Display`, and behind the calling crate's feature `defmt` also `defmt::Format`, for a value that is a list: each
/// item with the same format string, separated by spaces, or `-` for an empty list. Firmware then needs no `core::fmt`.
///
/// ```
/// pub struct Frames(Vec<u16>);
/// servowire_core::listed!(Frames { |frames| &frames.0 => "{:04X}" });
///
/// assert_eq!(Frames(vec![0x12, 0xabcd]).to_string(), "0012 ABCD");
/// assert_eq!(Frames(vec![]).to_string(), "-");
/// ```
#[macro_export]
macro_rules! listed {
    ($type:ty { |$value:ident| $items:expr => $format:literal }) => {
        impl core::fmt::Display for $type {
            fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
                let ($value, mut gap) = (self, "");
                for item in $items {
                    f.write_str(gap)?;
                    write!(f, $format, item)?;
                    gap = " ";
                }
                f.write_str(if gap.is_empty() { "-" } else { "" })
            }
        }

        #[cfg(feature = "defmt")]
        #[cfg_attr(docsrs, doc(cfg(feature = "defmt")))]
        impl defmt::Format for $type {
            fn format(&self, f: defmt::Formatter<'_>) {
                let ($value, mut gap) = (self, "");
                for item in $items {
                    defmt::write!(f, "{=str}", gap);
                    defmt::write!(f, $format, item);
                    gap = " ";
                }
                if gap.is_empty() {
                    defmt::write!(f, "-");
                }
            }
        }
    };
}

/// Implements `Display`, and behind the calling crate's feature `defmt` also `defmt::Format`, from the same format strings, one
/// for each pattern of the value: the text is the same on a host and in a log, and firmware needs no `core::fmt`.
///
/// ```
/// pub enum Level {
///     Low { volts: u8 },
///     Good,
/// }
/// servowire_core::one_line!(Level {
///     Self::Low { volts } => "low, {} V", volts;
///     Self::Good => "good";
/// });
///
/// assert_eq!(Level::Low { volts: 3 }.to_string(), "low, 3 V");
/// assert_eq!(Level::Good.to_string(), "good");
/// ```
#[macro_export]
macro_rules! one_line {
    ($type:ty { $($pattern:pat $(if $guard:expr)? => $format:literal $(, $part:expr)*;)+ }) => {
        impl core::fmt::Display for $type {
            fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
                match self {
                    $($pattern $(if $guard)? => write!(f, $format $(, $part)*),)+
                }
            }
        }

        #[cfg(feature = "defmt")]
        #[cfg_attr(docsrs, doc(cfg(feature = "defmt")))]
        impl defmt::Format for $type {
            fn format(&self, f: defmt::Formatter<'_>) {
                match self {
                    $($pattern $(if $guard)? => defmt::write!(f, $format $(, $part)*),)+
                }
            }
        }
    };
}
