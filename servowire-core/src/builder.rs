/// Writes a `with_` method for each field of a settings struct that has defaults. The method takes the value as its
/// argument, or sets a single fixed value.
///
/// ```
/// #[derive(Default)]
/// pub struct Settings {
///     /// Bits a second.
///     pub rate: u32,
///     /// Requests before giving up.
///     pub tries: u8,
///     /// Whether the own request comes back.
///     pub echo: bool,
/// }
///
/// impl Settings {
///     servowire_core::builder! {
///         with_rate: rate, u32;
///         with_tries: tries, u8;
///         with_echo: echo = true;
///     }
/// }
///
/// let settings = Settings::default().with_rate(2_500_000).with_tries(3).with_echo();
/// assert_eq!((settings.rate, settings.tries, settings.echo), (2_500_000, 3, true));
/// ```
#[macro_export]
macro_rules! builder {
    (@method $method:ident $field:ident, $type:ty) => {
        #[doc = concat!("With another [`", stringify!($field), "`](Self::", stringify!($field), ").")]
        #[must_use]
        pub const fn $method(mut self, $field: $type) -> Self {
            self.$field = $field;
            self
        }
    };
    (@method $method:ident $field:ident = $value:expr) => {
        #[doc = concat!("With [`", stringify!($field), "`](Self::", stringify!($field), ") = `", stringify!($value), "`.")]
        #[must_use]
        pub const fn $method(mut self) -> Self {
            self.$field = $value;
            self
        }
    };
    ($($method:ident: $field:ident $(, $type:ty)? $(= $value:expr)?;)*) => {
        $($crate::builder!(@method $method $field $(, $type)? $(= $value)?);)*
    };
}
