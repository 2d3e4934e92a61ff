//! Integers with named values (JSIDL `value_set`).

/// An integer with named values. Unnamed values from peers are preserved.
pub trait Enumeration: Copy {
    /// The values named in the definition, in definition order; negative ones as in
    /// [`raw`](Self::raw).
    const VALUES: &'static [(u64, &'static str)];

    /// The integer on the wire; a negative one in two's complement of eight octets.
    fn raw(self) -> u64;

    /// The name of the value in the definition, if it has one.
    fn name(self) -> Option<&'static str> {
        Self::VALUES
            .iter()
            .find(|(value, _)| *value == self.raw())
            .map(|(_, name)| *name)
    }
}

/// Implements the enumeration traits for a newtype over an integer.
#[doc(hidden)]
#[macro_export]
macro_rules! __codec_enumeration {
    ($name:ident($raw:ty), [$(($value:literal, $text:literal)),* $(,)?]) => {
        impl $crate::Enumeration for $name {
            const VALUES: &'static [(u64, &'static str)] = &[$(($value, $text)),*];

            fn raw(self) -> u64 {
                self.0 as u64
            }
        }

        impl From<$raw> for $name {
            fn from(raw: $raw) -> Self {
                Self(raw)
            }
        }

        $crate::fixed_newtype!($name($raw));

        impl ::core::fmt::Debug for $name {
            fn fmt(&self, f: &mut ::core::fmt::Formatter<'_>) -> ::core::fmt::Result {
                match $crate::Enumeration::name(*self) {
                    Some(name) => write!(f, "{} ({name})", self.0),
                    None => write!(f, "{}", self.0),
                }
            }
        }

        $crate::if_serde! {
            impl $crate::view::View for $name {
                fn view(&self) -> $crate::view::Value {
                    $crate::view::enumerated::<Self>($crate::view::View::view(&self.0))
                }

                fn from_view(
                    value: &$crate::view::Value,
                ) -> Result<Self, $crate::view::Error> {
                    let named = value.named(<Self as $crate::Enumeration>::VALUES)?;
                    match (value, &named) {
                        // A negative value is in two's complement, as in `raw`.
                        ($crate::view::Value::Text(_), $crate::view::Value::Unsigned(raw)) => {
                            Ok(Self(*raw as $raw))
                        }
                        _ => $crate::view::View::from_view(&named).map(Self),
                    }
                }
            }
        }

        $crate::arbitrary_integer!($name);
    };
}
