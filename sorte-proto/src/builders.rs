//! `with_...` of the settings.

/// A `with_` method for each field.
macro_rules! builders {
    ($($method:ident $field:ident: $kind:ty),+ $(,)?) => {
        $(
            #[doc = concat!("With another [`", stringify!($field), "`](Self::", stringify!($field), ").")]
            pub const fn $method(mut self, $field: $kind) -> Self {
                self.$field = $field;
                self
            }
        )+
    };
}

pub(crate) use builders;
