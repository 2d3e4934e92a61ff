use ::jaus::codec;

/// The service `Centred`.
///
/// Scaled numbers whose 0 is the centre of their range.
pub mod centred {
    use super::codec;

    /// What the service is called, whatever its version.
    pub const URN: &str = "urn:example:Centred";

    /// Version 1.0.
    pub const V1_0: codec::ServiceId = codec::ServiceId {
        urn: URN,
        major: 1,
        minor: 0,
    };

    /// The newest version.
    pub const LATEST: codec::ServiceId = V1_0;

    /// The service, as an application implements it. `C` is the type of a call.
    pub trait Service<C> {
        /// Handles `SetLean` of the client in control.
        fn set_lean(&mut self, message: super::SetLean, call: &mut C);
    }

    /// Passes messages to a [`Service`].
    #[derive(Debug)]
    pub struct Server<T> {
        service: T,
    }

    impl<T> Server<T> {
        /// A server of this service.
        #[must_use]
        pub const fn new(service: T) -> Self {
            Self { service }
        }
    }

    impl<T: Service<C>, C: codec::Call> codec::Provider<C> for Server<T> {
        fn offers(&self) -> codec::List<codec::ServiceId> {
            codec::List::from([V1_0])
        }

        fn hazards(&self) -> codec::Hazards {
            codec::Hazards {
                acts_on: None,
                set_up_by: Some("SetLean"),
                stops: false,
            }
        }

        fn receive(&mut self, code: u16, call: &mut C) -> Option<Result<(), codec::DecodeError>> {
            Some(match code {
                0xF0A1 => call.receive(|message: super::SetLean, call| self.service.set_lean(message, call)),
                _ => return None,
            })
        }
    }
}

/// The services of the set, by URN and version.
pub static SERVICES: &[codec::ServiceInfo] = &[
    codec::ServiceInfo {
        name: "Centred", id: centred::V1_0, inherits_from: None, inputs: &[0xF0A1], outputs: &[],
    },
];

/// The message types of the set, by code; of several with one code the newest first.
pub static MESSAGES: &[codec::MessageInfo] = &[
    codec::MessageInfo::of::<SetLean>(&[centred::V1_0]),
];

/// The messages of services of version 1.0.
pub mod v1_0 {
    use super::codec;

    /// `SetLean` (F0A1h), a command.
    ///
    /// Signed integers of every size.
    ///
    /// Declared by `urn:example:Centred 1.0`.
    #[derive(Debug, Clone, Default, PartialEq)]
    pub struct SetLean {
        /// `Lean`: degree, -127 to 127.
        pub lean: set_lean::Lean,
        /// `Effort`: percent, -100 to 100, bit 0 of the presence vector.
        pub effort: Option<set_lean::Effort>,
        /// `Height`: meter, -10000 to 35000, bit 1 of the presence vector.
        pub height: Option<set_lean::Height>,
        /// `Latitude`: degree, -90 to 90, bit 2 of the presence vector.
        pub latitude: Option<set_lean::Latitude>,
    }

    codec::accessors!(SetLean {
        lean: set_lean::Lean => lean_deg, set_lean_deg, with_lean_deg, "`Lean` in degree", "-127 to 127";
        effort: set_lean::Effort, ? => effort_percent, set_effort_percent, with_effort_percent, "`Effort` in percent", "-100 to 100";
        height: set_lean::Height, ? => height_m, set_height_m, with_height_m, "`Height` in meter", "-10000 to 35000";
        latitude: set_lean::Latitude, ? => latitude_deg, set_latitude_deg, with_latitude_deg, "`Latitude` in degree", "-90 to 90";
    });

    impl codec::Message for SetLean {
        const CODE: u16 = 0xF0A1;
        const NAME: &'static str = "SetLean";
        const IS_COMMAND: bool = true;
        fn encoded_len(&self) -> usize {
            4 + 2 * usize::from(self.effort.is_some()) + 4 * usize::from(self.height.is_some())
            + 4 * usize::from(self.latitude.is_some())
        }

        #[inline]
        fn write(&self, output: &mut codec::Writer<'_>) -> Result<(), codec::EncodeError> {
            if let Self {
                lean, effort: Some(effort), height: Some(height), latitude: Some(latitude),
            } = self {
                let run = output.run::<14>();
                codec::Fixed::put(<Self as codec::Message>::CODE, run, 0);
                codec::Fixed::put(0x7_u8, run, 2);
                codec::Fixed::put(*lean, run, 3);
                codec::Fixed::put(*effort, run, 4);
                codec::Fixed::put(*height, run, 6);
                codec::Fixed::put(*latitude, run, 10);
                return Ok(());
            }
            self.write_some(output);
            Ok(())
        }

        #[inline]
        fn read(input: &mut codec::Reader<'_>) -> Result<Self, codec::DecodeError> {
            input.code(Self::CODE)?;
            let present = input.presence::<u8>(0x7)?;
            if present == 0x7 {
                let run = input.run::<11>(&[
                    ("Lean", 1), ("Effort", 2), ("Height", 4), ("Latitude", 4),
                ])?;
                return Ok(Self {
                    lean: codec::Fixed::get(run, 0), effort: Some(codec::Fixed::get(run, 1)),
                    height: Some(codec::Fixed::get(run, 3)),
                    latitude: Some(codec::Fixed::get(run, 7)),
                });
            }
            Self::read_some(input, present)
        }
    }

    impl SetLean {
        #[inline(never)]
        fn write_some(&self, output: &mut codec::Writer<'_>) {
            let present = u8::from(self.effort.is_some()) | u8::from(self.height.is_some()) << 1
            | u8::from(self.latitude.is_some()) << 2;
            let run = output.run::<4>();
            codec::Fixed::put(<Self as codec::Message>::CODE, run, 0);
            codec::Fixed::put(present, run, 2);
            codec::Fixed::put(self.lean, run, 3);
            output.optional(self.effort);
            output.optional(self.height);
            output.optional(self.latitude);
        }

        #[inline(never)]
        fn read_some(place: &mut codec::Reader<'_>, present: u64) -> Result<Self, codec::DecodeError> {
            let mut input = place.clone();
            let lean = input.member("Lean", codec::Reader::fixed)?;
            let effort = input.optional(present & 0x1 != 0, "Effort", codec::Reader::fixed)?;
            let height = input.optional(present & 0x2 != 0, "Height", codec::Reader::fixed)?;
            let latitude = input.optional(present & 0x4 != 0, "Latitude", codec::Reader::fixed)?;
            *place = input;
            Ok(Self { lean, effort, height, latitude })
        }
    }

    codec::members!(SetLean {
        lean: "Lean", effort: "Effort", height: "Height", latitude: "Latitude",
    });

    /// The types inside [`SetLean`].
    pub mod set_lean {
        use super::codec;

        /// `Lean` in degree: -127 to 127 in steps of 1.000e0, carried as `i8`.
        #[derive(Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
        pub struct Lean(i8);

        codec::scaled!(Lean(i8), "Lean", -127.0_f64 to 127.0_f64 "degree", Round);

        /// `Effort` in percent: -100 to 100 in steps of 3.052e-3, carried as `i16`.
        #[derive(Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
        pub struct Effort(i16);

        codec::scaled!(Effort(i16), "Effort", -100.0_f64 to 100.0_f64 "percent", Floor);

        /// `Height` in meter: -10000 to 35000 in steps of 1.048e-5, carried as `i32`.
        #[derive(Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
        pub struct Height(i32);

        codec::scaled!(Height(i32), "Height", -10000.0_f64 to 35000.0_f64 "meter", Ceiling);

        /// `Latitude` in degree: -90 to 90 in steps of 4.191e-8, carried as `i32`.
        #[derive(Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
        pub struct Latitude(i32);

        codec::scaled!(Latitude(i32), "Latitude", -90.0_f64 to 90.0_f64 "degree", Round);
    }
}

#[doc(inline)]
#[allow(unused_imports)]
pub use v1_0::{SetLean, set_lean};
