//! Field conversions shared by all message families.

use std::marker::PhantomData;

use super::{Context, Refusal};
use jaus::codec::{OutOfRange, Scaled};

/// A field that converts to a field of the other side. `How` distinguishes the implementations; it
/// is always inferred.
pub(super) trait Carry<To, How> {
    /// The same value in the other field's type.
    fn carry(self) -> Result<To, Refusal>;
}

/// By the value in engineering units, rounded to the nearest step of the other scale.
pub(super) struct ByScale;
/// Unchanged.
pub(super) struct Unchanged;
/// Same bits.
pub(super) struct ByBits;
/// By the value, if present.
pub(super) struct Optional<How>(PhantomData<How>);

impl<Here: Scaled, There: Scaled> Carry<There, ByScale> for Here {
    fn carry(self) -> Result<There, Refusal> {
        let value = self.to_real();
        // If both ranges end at the same value, rounding must not exceed the other range.
        let nearest = value.clamp(There::SCALE.lower(), There::SCALE.upper());
        let slack = Here::SCALE.step().max(There::SCALE.step()) / 2.0;
        match (value - nearest).abs() < slack {
            true => Ok(There::from_real(nearest)?),
            false => Err(OutOfRange::of::<There>(value).into()),
        }
    }
}

impl Carry<Self, Unchanged> for u8 {
    fn carry(self) -> Result<Self, Refusal> {
        Ok(self)
    }
}

impl Carry<Self, Unchanged> for u16 {
    fn carry(self) -> Result<Self, Refusal> {
        Ok(self)
    }
}

impl<Here: Carry<There, How>, There, How> Carry<Option<There>, Optional<How>> for Option<Here> {
    fn carry(self) -> Result<Option<There>, Refusal> {
        self.map(Carry::carry).transpose()
    }
}

/// A message or record that converts to one of the other side.
pub(super) trait Counterpart<To>: Sized {
    /// Converts to the other side's type.
    fn counterpart(self, context: Context<'_>) -> Result<To, Refusal>;
}

/// Implements both directions between two types with the same fields, as the compiler checks. After
/// a semicolon: fields with another name on our side.
macro_rules! same_fields {
    ($($ra:path, $jaus:path {
        $($field:ident),* $(,)? $(; $($theirs:ident = $ours:ident),* $(,)?)?
    })*) => {$(
        $crate::convert::carry::same_fields!(
            @one $ra => $jaus { $($field $field,)* $($($theirs $ours,)*)? }
        );
        $crate::convert::carry::same_fields!(
            @one $jaus => $ra { $($field $field,)* $($($ours $theirs,)*)? }
        );
    )*};
    (@one $from:path => $to:path { $($here:ident $there:ident,)* }) => {
        impl $crate::convert::carry::Counterpart<$to> for $from {
            fn counterpart(
                self,
                _: $crate::convert::Context<'_>,
            ) -> Result<$to, $crate::convert::Refusal> {
                type There = $to;
                let Self { $($here),* } = self;
                Ok(There { $($there: $crate::convert::carry::Carry::carry($here)?),* })
            }
        }
    };
}

pub(super) use same_fields;

/// Implements both directions between two types with the same bits, such as time stamps.
macro_rules! same_bits {
    ($($ra:path, $jaus:path;)*) => {$(
        $crate::convert::carry::same_bits!(@one $ra => $jaus);
        $crate::convert::carry::same_bits!(@one $jaus => $ra);
    )*};
    (@one $from:path => $to:path) => {
        impl $crate::convert::carry::Carry<$to, $crate::convert::carry::ByBits> for $from {
            fn carry(self) -> Result<$to, $crate::convert::Refusal> {
                Ok($to(self.0))
            }
        }
    };
}

pub(super) use same_bits;

/// Implements both directions between two queries whose presence vectors agree in their lowest
/// bits; higher bits request nothing and are left out.
macro_rules! same_presence {
    ($($ra:path, $jaus:path: $fields:literal fields;)*) => {$(
        $crate::convert::carry::same_presence!(@one $ra => $jaus, $fields);
        $crate::convert::carry::same_presence!(@one $jaus => $ra, $fields);
    )*};
    (@one $from:path => $to:path, $fields:literal) => {
        impl $crate::convert::carry::Counterpart<$to> for $from {
            fn counterpart(
                self,
                _: $crate::convert::Context<'_>,
            ) -> Result<$to, $crate::convert::Refusal> {
                type There = $to;
                let presence_vector = self.presence_vector & ((1 << $fields) - 1);
                Ok(There { presence_vector })
            }
        }
    };
}

pub(super) use same_presence;

/// Refuses a field that is set but does not exist on the other side.
pub(super) fn refuse<T: Copy>(field: Option<T>, name: &'static str) -> Result<(), Refusal> {
    match field {
        None => Ok(()),
        Some(_) => Err(Refusal::Inexpressible { field: name }),
    }
}

/// Requires a field that is mandatory on the other side.
pub(super) fn require<T>(field: Option<T>, name: &'static str) -> Result<T, Refusal> {
    field.ok_or(Refusal::Missing { field: name })
}
