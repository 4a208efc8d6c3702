use crate::layout::MAX_FRAMES;

/// Frames as a receiver with hardware framing delivers them, for [`Transaction::hear`](crate::master::Transaction::hear) and
/// [`Device::hear`](crate::device::Device::hear).
///
/// Each is the 16 content bits, the first on the line in bit 0, or `None` if the delimiter reads 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Units {
    units: [Option<u16>; MAX_FRAMES as usize],
    len: u8,
}

impl Units {
    /// The frames in the order of the line.
    pub fn as_slice(&self) -> &[Option<u16>] {
        self.units.get(..usize::from(self.len)).unwrap_or(&self.units)
    }
}

/// The first six frames.
impl FromIterator<Option<u16>> for Units {
    fn from_iter<I: IntoIterator<Item = Option<u16>>>(frames: I) -> Self {
        let mut all = Self::default();
        for (to, from) in all.units.iter_mut().zip(frames) {
            *to = from;
            all.len = all.len.saturating_add(1);
        }
        all
    }
}
