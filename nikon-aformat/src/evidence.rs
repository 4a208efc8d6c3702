use crate::abs40::Abs40;
use crate::doubt::Doubt;
use crate::marks::{
    ABSENT, NEVER, NO_TURNS, SUMMED, UPPER_BITS, alarms, of_alarms, of_bits, of_status, single_turn_bits, status,
};
use crate::resolution::Resolution;
use crate::response::{Body, Response};
use crate::status::EncoderStatus;
use crate::tolerated::{Policy, Tolerated};

servowire_core::shaft_evidence! {
    /// What an encoder has reported about its position, and when it was sampled. It is judged where it is used, by
    /// [`at`](Self::at).
    ///
    /// The receiver of the response creates it with [`Exchange::evidence`](crate::master::Exchange::evidence), which checks
    /// what does not depend on the user: what the response carries and whether it fits the widths. The user of the position,
    /// perhaps in an interrupt of another priority with an [`EvidenceCell`] in between, decides how old it may be and what
    /// to tolerate.
    ///
    /// ```
    /// use nikon_aformat::{
    ///     BitOrder, Command, Doubt, EncoderStatus, Evidence, Expected, Layout, Policy, Resolution, Response, Tolerated,
    /// };
    ///
    /// let expected = Expected::new(Layout::Abs40, Command::Abs40Mt);
    /// let response = Response::parse_words(&expected, &[0x2085, 0xf64a, 0x8009, 0x80a1], BitOrder::MsbFirst)?;
    /// let evidence = Evidence::of(response, Resolution::new(17, 16)?, 1_000_000);
    ///
    /// // an encoder without its battery
    /// let shown = EncoderStatus::BATT | EncoderStatus::ERROR;
    /// let policy = Policy::new(125_000);
    /// assert_eq!(evidence.at(1_040_000, policy), Err(Doubt::Status { es: shown }));
    /// let commutation = policy.tolerating(Tolerated::SINGLE_TURN.status(shown));
    /// let sample = evidence.at(1_040_000, commutation)?;
    /// assert_eq!((sample.single_turn(), sample.turns()), (86_639, None));
    /// assert_eq!(evidence.at(1_200_000, commutation), Err(Doubt::Old { age_ns: 200_000 }));
    /// # Ok::<(), Box<dyn core::error::Error>>(())
    /// ```
    Evidence, st_bits
}

impl Evidence {
    /// Creates evidence from a response of an encoder with these widths, sampled at `sampled_ns`, for tools and buffers. A
    /// master uses its [`Exchange`](crate::master::Exchange) instead, which knows the instant, and that the response is no older
    /// than its request.
    pub const fn of(response: Response, resolution: Resolution, sampled_ns: u64) -> Self {
        let shown = match response.body {
            Body::Abs17 { es_any: true, .. } => SUMMED | of_status(EncoderStatus::all()),
            Body::Abs17 { es_any: false, .. } => SUMMED,
            Body::Full { es, .. } => of_status(es),
        };
        let alarms = match response.alm() {
            Some(alarms) => of_alarms(alarms),
            None => 0,
        };
        let evidence = Self { sampled_ns, marks: shown | alarms, ..Self::NEVER };
        match response.abs() {
            Some(abs) => evidence.with_abs(abs, response.layout().abs_bits(), resolution),
            None => Self { marks: evidence.marks | ABSENT, ..evidence },
        }
    }

    /// Does the same with a response that [`Abs40`] has decoded.
    ///
    /// ```
    /// use nikon_aformat::{Abs40, EncoderAddress, EncoderStatus, Evidence, Policy, Resolution, U40};
    /// let abs = U40::new(5 << 20 | 77).unwrap(); // 5 turns of 20 bits
    /// let response = Abs40 { ea: EncoderAddress::ZERO, es: EncoderStatus::empty(), abs };
    /// let evidence = Evidence::of_abs40(response, Resolution::new(20, 16)?, 1_000);
    /// let sample = evidence.at(2_000, Policy::new(62_500)).unwrap();
    /// assert_eq!((sample.single_turn(), sample.turns()), (77, Some(5)));
    /// # Ok::<(), servowire_core::OutOfRange>(())
    /// ```
    pub const fn of_abs40(response: Abs40, resolution: Resolution, sampled_ns: u64) -> Self {
        let evidence = Self { sampled_ns, marks: of_status(response.es), ..Self::NEVER };
        evidence.with_abs(response.abs.get(), 40, resolution)
    }

    /// Takes the lowest `abs_bits` position bits, which are all that the response carries.
    const fn with_abs(mut self, abs: u64, abs_bits: u8, resolution: Resolution) -> Self {
        let width = resolution.st_bits().wrapping_add(resolution.mt_bits());
        self.marks |= of_bits(resolution.st_bits());
        if abs_bits < resolution.st_bits() {
            self.marks |= ABSENT;
        } else if abs.wrapping_shr(width as u32) != 0 {
            self.marks |= UPPER_BITS;
            self.single_turn = width as u32;
        } else {
            self.single_turn = resolution.single_turn(abs);
            if abs_bits < width {
                self.marks |= NO_TURNS;
            } else {
                self.turns = resolution.turns(abs);
            }
        }
        self
    }

    /// Returns why the position must not be used; kept off the hot path.
    #[cold]
    #[inline(never)]
    const fn doubt(&self, now_ns: u64, policy: Policy) -> Doubt {
        let marks = policy.tolerated().objects_to(self.marks);
        let es = status(marks);
        if marks & NEVER != 0 {
            Doubt::Never
        } else if let Err(age_ns) = policy.check_age(now_ns, self.sampled_ns) {
            Doubt::Old { age_ns }
        } else if marks & UPPER_BITS != 0 {
            Doubt::UpperBits { width: self.single_turn.to_le_bytes()[0] }
        } else if marks & (ABSENT | NO_TURNS) != 0 {
            Doubt::Absent
        } else if es.is_empty() {
            Doubt::Alarms { alarms: alarms(marks) }
        } else if self.marks & SUMMED != 0 {
            Doubt::AnyStatus
        } else {
            Doubt::Status { es }
        }
    }
}

#[cfg(test)]
mod tests;
