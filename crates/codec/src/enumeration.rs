//! Integers with named values: `value_set`.

/// An integer with named values. Peers send others too, and those are kept.
pub trait Enumeration: Copy {
    /// The values that the definition names, in its order.
    const VALUES: &'static [(u64, &'static str)];

    /// The integer on the wire.
    fn raw(self) -> u64;

    /// The definition's name for the value, if it has one.
    fn name(self) -> Option<&'static str> {
        Self::VALUES
            .iter()
            .find(|(value, _)| *value == self.raw())
            .map(|(_, name)| *name)
    }
}

/// Gives a newtype over an integer what an enumerated field needs.
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
                    $crate::view::View::view(&self.0)
                }

                fn from_view(
                    value: &$crate::view::Value,
                ) -> Result<Self, $crate::view::Error> {
                    let named = value.named(<Self as $crate::Enumeration>::VALUES)?;
                    $crate::view::View::from_view(&named).map(Self)
                }
            }
        }

        $crate::arbitrary_integer!($name);
    };
}
