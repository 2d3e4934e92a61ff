//! What the members of a struct determine: its view, and random values of it.

/// Implements `View`, serde's traits and `Arbitrary` for a struct, as far as the features of this crate
/// say so. Each member has its name in the definition, and if `Arbitrary` is not enough, a function
/// that makes a random value.
///
/// `Name is member` is a struct that is shown as its only member.
#[doc(hidden)]
#[macro_export]
macro_rules! __codec_members {
    ($name:ident { $($member:ident: $text:literal $(= $make:expr)?),* $(,)? }) => {
        $crate::if_serde! {
            impl $crate::view::View for $name {
                // The registry references these functions; inlined copies would only cost space.
                #[inline(never)]
                fn view(&self) -> $crate::view::Value {
                    let names: &[&str] = &[$($text),*];
                    $crate::view::Value::object(names.len())
                        $(.with($text, $crate::view::View::view(&self.$member)))*
                }

                #[inline(never)]
                #[allow(unused_variables)]
                fn from_view(
                    value: &$crate::view::Value,
                ) -> ::core::result::Result<Self, $crate::view::Error> {
                    let names: &[&str] = &[$($text),*];
                    let object = $crate::view::Object::new(value, names)?;
                    Ok(Self { $($member: object.member($text)?),* })
                }
            }

            $crate::serde_by_view!($name);
        }

        $crate::random_members!($name { $($member $(= $make)?),* });
    };
    ($name:ident is $member:ident $(= $make:expr)?) => {
        $crate::if_serde! {
            impl $crate::view::View for $name {
                #[inline(never)]
                fn view(&self) -> $crate::view::Value {
                    $crate::view::View::view(&self.$member)
                }

                #[inline(never)]
                fn from_view(
                    value: &$crate::view::Value,
                ) -> ::core::result::Result<Self, $crate::view::Error> {
                    Ok(Self { $member: $crate::view::View::from_view(value)? })
                }
            }

            $crate::serde_by_view!($name);
        }

        $crate::random_members!($name { $member $(= $make)? });
    };
}

/// Implements the same for an enum whose alternatives each hold one value.
#[doc(hidden)]
#[macro_export]
macro_rules! __codec_alternatives {
    ($name:ident { $($alternative:ident: $text:literal $(= $make:expr)?),* $(,)? }) => {
        $crate::if_serde! {
            impl $crate::view::View for $name {
                fn view(&self) -> $crate::view::Value {
                    match self {
                        $(Self::$alternative(value) => {
                            $crate::view::Value::alternative($text, $crate::view::View::view(value))
                        })*
                    }
                }

                fn from_view(
                    value: &$crate::view::Value,
                ) -> ::core::result::Result<Self, $crate::view::Error> {
                    let (name, value) = value.chosen()?;
                    let read = match name {
                        $($text => $crate::view::View::from_view(value).map(Self::$alternative),)*
                        _ => return Err($crate::view::Error::unknown_key(name, &[$($text),*])),
                    };
                    read.map_err(|error| error.within(name))
                }
            }

            $crate::serde_by_view!($name);
        }

        $crate::random_alternatives!($name { $($alternative $(= $make)?),* });
    };
}

/// Implements `Arbitrary` for an enum whose alternatives each hold one value.
#[cfg(feature = "arbitrary")]
#[doc(hidden)]
#[macro_export]
macro_rules! __codec_random_alternatives {
    ($name:ident { $($alternative:ident $(= $make:expr)?),* }) => {
        impl<'a> $crate::arbitrary::Arbitrary<'a> for $name {
            fn arbitrary(
                random: &mut $crate::arbitrary::Unstructured<'a>,
            ) -> $crate::arbitrary::Result<Self> {
                let make: $crate::arbitrary::Maker<'a, Self> = *random.choose(&[$(
                    (|random| $crate::random_member!(random $(, $make)?).map(Self::$alternative))
                        as $crate::arbitrary::Maker<'a, Self>
                ),*])?;
                make(random)
            }
        }
    };
}

/// Expands to nothing without the feature `arbitrary`.
#[cfg(not(feature = "arbitrary"))]
#[doc(hidden)]
#[macro_export]
macro_rules! __codec_random_alternatives {
    ($($content:tt)*) => {};
}

/// Implements `Arbitrary` for a struct.
#[cfg(feature = "arbitrary")]
#[doc(hidden)]
#[macro_export]
macro_rules! __codec_random_members {
    ($name:ident { $($member:ident $(= $make:expr)?),* }) => {
        impl<'a> $crate::arbitrary::Arbitrary<'a> for $name {
            #[allow(unused_variables)]
            fn arbitrary(
                random: &mut $crate::arbitrary::Unstructured<'a>,
            ) -> $crate::arbitrary::Result<Self> {
                Ok(Self { $($member: $crate::random_member!(random $(, $make)?)?),* })
            }
        }
    };
}

/// A random value of one member.
#[cfg(feature = "arbitrary")]
#[doc(hidden)]
#[macro_export]
macro_rules! __codec_random_member {
    ($random:ident) => {
        $crate::arbitrary::Arbitrary::arbitrary($random)
    };
    ($random:ident, $make:expr) => {
        $crate::arbitrary::made($random, $make)
    };
}

/// Expands to nothing without the feature `arbitrary`.
#[cfg(not(feature = "arbitrary"))]
#[doc(hidden)]
#[macro_export]
macro_rules! __codec_random_members {
    ($($content:tt)*) => {};
}

/// Implements a getter, a setter and a step of a builder in engineering units for scaled members; those
/// of optional members are marked with `?`.
#[doc(hidden)]
#[macro_export]
macro_rules! __codec_accessors {
    ($name:ident { $(
        $member:ident: $type:ty $(, $optional:tt)? => $get:ident, $set:ident,
        $with:ident, $what:literal, $range:literal;
    )* }) => {
        impl $name {
            $(
                #[doc = ::core::concat!($what, ": ", $range, ".")]
                pub fn $get(&self) -> $crate::accessor!(type $($optional)?) {
                    $crate::accessor!(get self.$member, $type $(, $optional)?)
                }

                #[doc = ::core::concat!("Sets ", $what, " to the nearest value that the field can hold.")]
                ///
                /// # Errors
                #[doc = ::core::concat!("If the value is not in ", $range, ".")]
                pub fn $set(
                    &mut self,
                    value: f64,
                ) -> ::core::result::Result<(), $crate::OutOfRange> {
                    self.$member = $crate::accessor!(set value, $type $(, $optional)?);
                    Ok(())
                }

                #[doc = ::core::concat!("The same with ", $what, ", as [`", ::core::stringify!($set),
                    "`](Self::", ::core::stringify!($set), ") sets it.")]
                ///
                /// # Errors
                #[doc = ::core::concat!("If the value is not in ", $range, ".")]
                pub fn $with(mut self, value: f64) -> ::core::result::Result<Self, $crate::OutOfRange> {
                    self.$set(value)?;
                    Ok(self)
                }
            )*
        }
    };
}

/// The parts of an accessor that depend on whether the member is optional.
#[doc(hidden)]
#[macro_export]
macro_rules! __codec_accessor {
    (type) => { f64 };
    (type ?) => { ::core::option::Option<f64> };
    (get $self:ident.$member:ident, $type:ty) => { $self.$member.value() };
    (get $self:ident.$member:ident, $type:ty, ?) => { $self.$member.map(<$type>::value) };
    (set $value:ident, $type:ty) => { <$type>::new($value)? };
    (set $value:ident, $type:ty, ?) => { ::core::option::Option::Some(<$type>::new($value)?) };
}
