//! Global and local vectors, 0407h 2407h 4407h and 0408h 2408h 4408h: speed and heading setpoints.
//!
//! The global vector of our version 1.1 has the fields and bits of the Reference Architecture; in
//! 1.0 the speed is mandatory and has no bit. The RA local vector is exactly a speed and a heading:
//! one of ours that sets a height or an attitude is refused as a command; in a report those fields
//! are left out.
//!
//! Speeds reach 10 000 m/s there and 327.67 m/s here. Steps there are 0.15 m/s: a small speed may
//! become zero, and no speed increases by more than half a step.

use super::carry::{ByScale, Carry, Counterpart, Optional, refuse, require, same_fields};
use super::pair::Pair;
use super::{Context, Refusal};
use crate::messages::ra33;
use jaus::codec::Scaled;
use jaus::messages::mobility;
use jaus::messages::mobility::v1_0;

pub(super) const PAIRS: &[Pair] = &[
    Pair::of::<ra33::SetGlobalVector, mobility::SetGlobalVector>().for_minor(1),
    Pair::of::<ra33::SetGlobalVector, v1_0::SetGlobalVector>().for_minor(0),
    Pair::of::<ra33::QueryGlobalVector, mobility::QueryGlobalVector>(),
    Pair::of::<ra33::ReportGlobalVector, mobility::ReportGlobalVector>().for_minor(1),
    Pair::of::<ra33::ReportGlobalVector, v1_0::ReportGlobalVector>().for_minor(0),
    Pair::of::<ra33::SetLocalVector, mobility::SetLocalVector>().for_minor(1),
    Pair::of::<ra33::SetLocalVector, v1_0::SetLocalVector>().for_minor(0),
    Pair::of::<ra33::QueryLocalVector, mobility::QueryLocalVector>(),
    Pair::of::<ra33::ReportLocalVector, mobility::ReportLocalVector>().for_minor(1),
    Pair::of::<ra33::ReportLocalVector, v1_0::ReportLocalVector>().for_minor(0),
];

same_fields! {
    ra33::SetGlobalVector, mobility::SetGlobalVector { speed, altitude, heading, roll, pitch }
    ra33::ReportGlobalVector, mobility::ReportGlobalVector { speed, altitude, heading, roll, pitch }
}

macro_rules! global_of_1_0 {
    ($($ra:path, $jaus:path;)*) => {$(
        impl Counterpart<$jaus> for $ra {
            fn counterpart(self, _: Context<'_>) -> Result<$jaus, Refusal> {
                type There = $jaus;
                Ok(There {
                    speed: require(self.speed, "Speed")?.carry()?,
                    altitude: self.altitude.carry()?,
                    heading: self.heading.carry()?,
                    roll: self.roll.carry()?,
                    pitch: self.pitch.carry()?,
                })
            }
        }

        impl Counterpart<$ra> for $jaus {
            fn counterpart(self, _: Context<'_>) -> Result<$ra, Refusal> {
                type There = $ra;
                Ok(There {
                    speed: Some(self.speed.carry()?),
                    altitude: self.altitude.carry()?,
                    heading: self.heading.carry()?,
                    roll: self.roll.carry()?,
                    pitch: self.pitch.carry()?,
                })
            }
        }
    )*};
}

global_of_1_0! {
    ra33::SetGlobalVector, v1_0::SetGlobalVector;
    ra33::ReportGlobalVector, v1_0::ReportGlobalVector;
}

/// Speed, altitude, heading, roll, pitch: the bits of the Reference Architecture and of 1.1.
const GLOBAL: u8 = 0b1_1111;
/// The speed bit, which 1.0 does not have.
const SPEED: u8 = 0b1;

impl Counterpart<mobility::QueryGlobalVector> for ra33::QueryGlobalVector {
    fn counterpart(self, context: Context<'_>) -> Result<mobility::QueryGlobalVector, Refusal> {
        let wanted = self.presence_vector & GLOBAL;
        let presence_vector = match context.minor {
            Some(0) => wanted >> 1,
            _ => wanted,
        };
        Ok(mobility::QueryGlobalVector { presence_vector })
    }
}

impl Counterpart<ra33::QueryGlobalVector> for mobility::QueryGlobalVector {
    fn counterpart(self, context: Context<'_>) -> Result<ra33::QueryGlobalVector, Refusal> {
        let presence_vector = match context.minor {
            Some(0) => (self.presence_vector << 1 | SPEED) & GLOBAL,
            _ => self.presence_vector & GLOBAL,
        };
        Ok(ra33::QueryGlobalVector { presence_vector })
    }
}

/// The speed of a local vector, optional in version 1.0.
trait Speed<There, How>: Sized {
    fn from_ra(speed: There) -> Result<Self, Refusal>;
    fn into_ra(self) -> Result<There, Refusal>;
}

impl<There: Scaled, Here: Scaled> Speed<There, ByScale> for Here {
    fn from_ra(speed: There) -> Result<Self, Refusal> {
        speed.carry()
    }

    fn into_ra(self) -> Result<There, Refusal> {
        self.carry()
    }
}

impl<There: Scaled, Here: Scaled> Speed<There, Optional<ByScale>> for Option<Here> {
    fn from_ra(speed: There) -> Result<Self, Refusal> {
        Ok(Some(speed.carry()?))
    }

    fn into_ra(self) -> Result<There, Refusal> {
        require(self, "Speed")?.carry()
    }
}

/// Local vectors. Fields without counterpart are refused in a command and left out in a report.
macro_rules! local {
    ($($ra:path, $jaus:path, $is_command:expr;)*) => {$(
        impl Counterpart<$jaus> for $ra {
            fn counterpart(self, _: Context<'_>) -> Result<$jaus, Refusal> {
                type There = $jaus;
                Ok(There {
                    speed: Speed::from_ra(self.speed)?,
                    heading: Some(self.heading.carry()?),
                    z: None,
                    roll: None,
                    pitch: None,
                })
            }
        }

        impl Counterpart<$ra> for $jaus {
            fn counterpart(self, _: Context<'_>) -> Result<$ra, Refusal> {
                type There = $ra;
                if $is_command {
                    refuse(self.z, "Z")?;
                    refuse(self.roll, "Roll")?;
                    refuse(self.pitch, "Pitch")?;
                }
                Ok(There {
                    speed: self.speed.into_ra()?,
                    heading: require(self.heading, "Heading")?.carry()?,
                })
            }
        }
    )*};
}

local! {
    ra33::SetLocalVector, mobility::SetLocalVector, true;
    ra33::ReportLocalVector, mobility::ReportLocalVector, false;
    ra33::SetLocalVector, v1_0::SetLocalVector, true;
    ra33::ReportLocalVector, v1_0::ReportLocalVector, false;
}

impl Counterpart<mobility::QueryLocalVector> for ra33::QueryLocalVector {
    fn counterpart(self, context: Context<'_>) -> Result<mobility::QueryLocalVector, Refusal> {
        // The heading, and in 1.0 the speed, which has a bit there.
        let presence_vector = match context.minor {
            Some(0) => 0b101,
            _ => 0b10,
        };
        Ok(mobility::QueryLocalVector { presence_vector })
    }
}

impl Counterpart<ra33::QueryLocalVector> for mobility::QueryLocalVector {
    fn counterpart(self, _: Context<'_>) -> Result<ra33::QueryLocalVector, Refusal> {
        Ok(ra33::QueryLocalVector)
    }
}
