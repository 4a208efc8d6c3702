use crate::doubt::Doubt;
use crate::marks::{
    ABSENT, NEVER, NO_TURNS, OBJECTIONS, OTHER_ENCODER, UPPER_BITS, WIDE_TURNS, abm_bits, alarms, of_status, of_widths,
    single_turn_bits, status,
};
use crate::message::AllData;
use crate::resolution::Resolution;
use crate::response::Response;
use crate::status::StatusField;
use crate::tolerated::{Policy, Tolerated};

servowire_core::shaft_evidence! {
    /// What an encoder has reported about its position, and when it was sampled. It is judged where it is used, by
    /// [`at`](Self::at).
    ///
    /// The receiver of the response creates it with [`Exchange::evidence`](crate::master::Exchange::evidence), which checks what
    /// does not depend on the user: whether the request was damaged and whether the fields fit the widths. The user of the
    /// position, perhaps in an interrupt of another priority with a [`servowire_core::Cell`] in between, decides how old it may
    /// be and which alarms are tolerable. These differ between code that commutates a motor by the single-turn position and code
    /// that counts turns.
    ///
    /// ```
    /// use tformat::{Almc, Doubt, Evidence, Policy, Request, Resolution, Response, Tolerated};
    ///
    /// // The counter has overflowed and the battery was empty: nobody knows in which turn the shaft is.
    /// let bytes = [0x1a, 0x20, 0x29, 0xc0, 0x3b, 0x17, 0x00, 0x00, 0x00, 0xc8, 0x37];
    /// let response = Response::parse(Request::ReadAll, &bytes)?;
    /// let evidence = Evidence::of(response, Resolution::new(23, 16)?, 4_480);
    ///
    /// let positioning = Policy::new(125_000).tolerating(Tolerated::MULTI_TURN);
    /// assert_eq!(evidence.at(60_000, positioning), Err(Doubt::Alarms { alarms: Almc::BE }));
    /// let commutation = Policy::new(125_000).tolerating(Tolerated::SINGLE_TURN);
    /// let sample = evidence.at(60_000, commutation)?;
    /// assert_eq!((sample.single_turn(), sample.turns()), (3_915_817, None));
    /// assert_eq!(evidence.at(140_000, commutation), Err(Doubt::Old { age_ns: 135_520 }));
    /// # Ok::<(), Box<dyn core::error::Error>>(())
    /// ```
    Evidence, abs_bits
}

impl Evidence {
    /// Creates evidence from a response of an encoder with these widths, sampled at `sampled_ns`, for tools and buffers. A
    /// master uses its [`Exchange`](crate::master::Exchange) instead, which knows the instant, and that the response is no older
    /// than its request.
    ///
    /// ABS comes with ID 0, 3, 7, 8 and C; the turns come with ID 3.
    pub const fn of(response: Response, resolution: Resolution, sampled_ns: u64) -> Self {
        let mut evidence =
            Self { sampled_ns, marks: of_widths(resolution.abs_bits(), resolution.abm_bits()), ..Self::NEVER };
        let flaw = match (response, response.status(), response.abs()) {
            (_, None, _) | (_, _, None) => ABSENT,
            // Which fields these are is not known.
            (_, Some(sf), _) if of_status(sf) & OBJECTIONS != 0 => of_status(sf),
            (Response::ReadAll(data), ..) => evidence.take_all(data, resolution),
            (_, Some(sf), Some(abs)) => {
                let (single_turn, flaw) = match resolution.single_turn(abs) {
                    Ok(single_turn) if resolution.abm_bits() == 0 => (single_turn, 0),
                    Ok(single_turn) => (single_turn, NO_TURNS),
                    Err(_) => (abs.get(), UPPER_BITS),
                };
                evidence.single_turn = single_turn;
                flaw | of_status(sf) | sf.alarms_behind().bits() as u32
            }
        };
        evidence.marks |= flaw;
        evidence
    }

    /// Takes the valid fields and marks those that are not valid.
    #[expect(clippy::cast_possible_wrap, reason = "24 bits fit")]
    const fn take_all(&mut self, data: AllData, resolution: Resolution) -> u32 {
        // EA0 and EA1 without the alarm that they stand for: one of the two bytes is wrong.
        let unexplained = data.sf.difference(StatusField::of_alarms(data.almc));
        let marks = of_status(unexplained) | data.almc.union(unexplained.alarms_behind()).bits() as u32;
        if resolution.contradicts(data.enid) {
            self.single_turn = data.enid as u32;
            return marks | OTHER_ENCODER;
        }
        let Ok(single_turn) = resolution.single_turn(data.abs) else {
            self.single_turn = data.abs.get();
            return marks | UPPER_BITS;
        };
        self.single_turn = single_turn;
        let Ok(turns) = resolution.turns(data.abm) else {
            self.turns = data.abm.get() as i32;
            return marks | WIDE_TURNS;
        };
        self.turns = turns;
        marks
    }

    /// Returns why the position must not be used; kept off the hot path.
    #[cold]
    #[inline(never)]
    #[expect(clippy::cast_sign_loss, reason = "a field that was stored there")]
    const fn doubt(&self, now_ns: u64, policy: Policy) -> Doubt {
        let marks = policy.tolerated().objects_to(self.marks);
        let (sf, abs_bits) = (status(self.marks), single_turn_bits(self.marks));
        if marks & NEVER != 0 {
            Doubt::Never
        } else if let Err(age_ns) = policy.check_age(now_ns, self.sampled_ns) {
            Doubt::Old { age_ns }
        } else if marks & (ABSENT | NO_TURNS) != 0 {
            Doubt::Absent
        } else if sf.bits() & 0x0f != 0 {
            Doubt::Shifted { sf }
        } else if sf.intersects(StatusField::REQUEST_DAMAGED) {
            Doubt::RequestDamaged { sf }
        } else if marks & OTHER_ENCODER != 0 {
            let [enid, ..] = self.single_turn.to_le_bytes();
            Doubt::OtherEncoder { enid, abs_bits }
        } else if marks & UPPER_BITS != 0 {
            upper_bits(self.single_turn, abs_bits as u32)
        } else if marks & WIDE_TURNS != 0 {
            upper_bits(self.turns as u32, abm_bits(self.marks))
        } else {
            let alarms = alarms(marks).difference(sf.alarms_behind());
            if alarms.is_empty() { Doubt::Status { sf } } else { Doubt::Alarms { alarms } }
        }
    }
}

/// Returns the doubt about a field that is wider than the encoder's data.
const fn upper_bits(value: u32, bits: u32) -> Doubt {
    Doubt::UpperBits { value, excess: value & u32::MAX.wrapping_shl(bits) }
}

#[cfg(test)]
mod tests;
