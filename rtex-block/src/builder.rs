//! `with_` methods of the configurations, one for each field that has a default.

macro_rules! builder {
    ($($method:ident: $field:ident, $type:ty;)*) => {
        $(
            #[doc = concat!("With another [`", stringify!($field), "`](Self::", stringify!($field), ").")]
            #[must_use]
            pub const fn $method(self, $field: $type) -> Self {
                Self { $field, ..self }
            }
        )*
    };
}

pub(crate) use builder;
