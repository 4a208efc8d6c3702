/// A `with_` method for each field of a settings struct that has a default.
///
/// ```
/// #[derive(Default)]
/// pub struct Settings {
///     /// Bits a second.
///     pub rate: u32,
///     /// Requests before giving up.
///     pub tries: u8,
/// }
///
/// impl Settings {
///     servowire_core::builder! {
///         with_rate: rate, u32;
///         with_tries: tries, u8;
///     }
/// }
///
/// assert_eq!(Settings::default().with_rate(2_500_000).with_tries(3).rate, 2_500_000);
/// ```
#[macro_export]
macro_rules! builder {
    ($($method:ident: $field:ident, $type:ty;)*) => {
        $(
            #[doc = concat!("With another [`", stringify!($field), "`](Self::", stringify!($field), ").")]
            #[must_use]
            pub const fn $method(mut self, $field: $type) -> Self {
                self.$field = $field;
                self
            }
        )*
    };
}
