//! Requests by purpose. Requests that cannot be undone say so in their names.

use super::long::{Access, Data, LongRequest};
use crate::resource::{Offset, ResourceAddress};

servowire_core::codes! {
    /// Who may access a resource (SICK manual, p. 90). Levels 5..=14 are not defined.
    pub enum AccessLevel: u8 {
        /// Everybody.
        Public = 0 => "public",
        /// Operator.
        Operator = 1 => "operator",
        /// Maintenance.
        Maintenance = 2 => "maintenance",
        /// Authorised client.
        AuthorisedClient = 3 => "authorised client",
        /// Service.
        Service = 4 => "service",
        /// Nobody.
        Never = 15 => "never",
    }
}

impl LongRequest {
    /// Resets the encoder (RID 100h, SICK manual, p. 114). The encoder saves its lifetime data and does not answer. The link
    /// restarts, and the position is lost if the encoder does not save it.
    pub const fn reset_encoder() -> Self {
        Self { address: ResourceAddress::RESET, indirect: true, offset: None, access: Access::Write(Data::NONE) }
    }

    /// Shuts the encoder down (RID 100h, offset 1): it stays silent **until its power is cycled**.
    pub const fn shut_encoder_down_until_power_cycle() -> Self {
        let access = Access::Write(Data::NONE);
        Self { address: ResourceAddress::RESET, indirect: true, offset: Offset::new(1), access }
    }

    /// Adds 1 to the user counter (RID 121h).
    pub const fn count_up() -> Self {
        Self { address: ResourceAddress::INCCOUNT, indirect: true, offset: None, access: Access::Write(Data::NONE) }
    }

    /// Sets the user counter to 0 (RID 122h); its count is lost.
    pub const fn clear_user_counter_for_good() -> Self {
        Self { address: ResourceAddress::RESETCNT, indirect: true, offset: None, access: Access::Write(Data::NONE) }
    }

    /// Requests an access level with its key (RID 104h). After a reset the level is public again.
    pub fn set_access(level: AccessLevel, key: [u8; 4]) -> Self {
        let [k0, k1, k2, k3] = key;
        let access = Access::Write(Data::eight([level.code(), 0, 0, 0, k0, k1, k2, k3]));
        Self { address: ResourceAddress::SETACCESS, indirect: true, offset: None, access }
    }

    /// Changes the key of an access level (RID 105h). **A lost key cannot be recovered.**
    pub fn change_access_key_for_good(level: AccessLevel, new: [u8; 4], old: [u8; 4]) -> Self {
        let ([n0, n1, n2, n3], [o0, o1, o2, o3]) = (new, old);
        Self {
            address: ResourceAddress::CHANGEKEY,
            indirect: true,
            offset: Offset::new(level as u16),
            access: Access::Write(Data::eight([n0, n1, n2, n3, o0, o1, o2, o3])),
        }
    }

    /// Returns whether this request makes the encoder lose something or leave the link: reset, shut-down, counting
    /// direction, access keys, user counter, deletion of files.
    pub fn is_dangerous(&self) -> bool {
        let Access::Write(_) = self.access else { return false };
        match self.address {
            ResourceAddress::RESET
            | ResourceAddress::COUNTDIR
            | ResourceAddress::CHANGEKEY
            | ResourceAddress::RESETCNT => true,
            ResourceAddress::MAKEFILE => self.offset.is_none_or(|offset| offset.get() >> 8 & 3 == 0),
            _ => false,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::message::Length;

    /// Header bytes of the manual's examples: 54 read 2 bytes, 58 read 4, 5C read 8, 7C with an offset, 11 write without
    /// data, 1D write 8 (to addresses below 100h: 54 becomes D4 on the line, with its marker bit).
    #[test]
    fn headers_of_the_manual() {
        let header = |request: LongRequest| {
            let bytes = request.emit();
            let mut head = [0; 2];
            head.copy_from_slice(&bytes.as_bytes()[..2]);
            head
        };
        let read = |length| header(LongRequest::read(ResourceAddress::TEMPRTUR, length));
        assert_eq!(
            [read(Length::Two), read(Length::Four), read(Length::Eight)],
            [[0xd4, 0xc1], [0xd8, 0xc1], [0xdc, 0xc1]]
        );
        let offset = Offset::truncate(8);
        assert_eq!(header(LongRequest::read_at(ResourceAddress::TYPECODE, offset, Length::Eight)), [0xfc, 0x83]);
        assert_eq!(header(LongRequest::reset_encoder()), [0x91, 0x00]);
        assert_eq!(header(LongRequest::set_access(AccessLevel::Operator, *b"1111")), [0x9d, 0x04]);
        assert_eq!(header(LongRequest::read_name(ResourceAddress::RESOLUTN)), [0xcc, 0x81]);
    }

    #[test]
    fn dangerous_ones_are_known() {
        let shut_down = LongRequest::shut_encoder_down_until_power_cycle();
        assert_eq!((shut_down.offset.map(Offset::get), shut_down.emit().as_bytes().len()), (Some(1), 6));
        let key = LongRequest::change_access_key_for_good(AccessLevel::Service, *b"abcd", *b"4444");
        assert_eq!(key.offset.map(Offset::get), Some(4));
        assert_eq!(key.emit().as_bytes()[4..12], *b"abcd4444");
        for request in [shut_down, key, LongRequest::reset_encoder(), LongRequest::clear_user_counter_for_good()] {
            assert!(request.is_dangerous());
        }
        let read = LongRequest::read(ResourceAddress::RESET, Length::Two);
        assert!(!read.is_dangerous() && !LongRequest::count_up().is_dangerous());
        for code in 0..=255 {
            let level = AccessLevel::from_code(code);
            assert_eq!(level.map(AccessLevel::code), matches!(code, 0..=4 | 15).then_some(code));
        }
    }
}
