use ::jaus::codec;

/// The service `Measures`.
///
/// Variable fields, whose index is not the position.
pub mod measures {
    use super::codec;

    /// What the service is called, whatever its version.
    pub const URN: &str = "urn:example:Measures";

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
        /// Handles `SetPosition`.
        fn set_position(&mut self, message: super::SetPosition, call: &mut C);
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

        fn receive(&mut self, code: u16, call: &mut C) -> Option<Result<(), codec::DecodeError>> {
            Some(match code {
                0xF041 => call.receive(|message: super::SetPosition, call| self.service.set_position(message, call)),
                _ => return None,
            })
        }
    }
}

/// The services of the set, by URN and version.
pub static SERVICES: &[codec::ServiceInfo] = &[
    codec::ServiceInfo {
        name: "Measures", id: measures::V1_0, inherits_from: None, inputs: &[0xF041], outputs: &[],
    },
];

/// The message types of the set, by code; of several with one code the newest first.
pub static MESSAGES: &[codec::MessageInfo] = &[
    codec::MessageInfo::of::<SetPosition>(&[measures::V1_0]),
];

/// The messages of services of version 1.0.
pub mod v1_0 {
    use super::codec;

    /// `SetPosition` (F041h).
    ///
    /// Numbers whose type and unit are chosen.
    ///
    /// Declared by `urn:example:Measures 1.0`.
    #[derive(Debug, Clone, Default, PartialEq)]
    pub struct SetPosition {
        /// `Position`.
        pub position: set_position::Position,
        /// `Reading`: bit 0 of the presence vector.
        pub reading: Option<set_position::Reading>,
    }

    impl codec::Message for SetPosition {
        const CODE: u16 = 0xF041;
        const NAME: &'static str = "SetPosition";
        fn encoded_len(&self) -> usize {
            3 + codec::Composite::encoded_len(&self.position)
            + self.reading.as_ref().map_or(0, codec::Composite::encoded_len)
        }

        fn write(&self, output: &mut codec::Writer<'_>) -> Result<(), codec::EncodeError> {
            let present = u8::from(self.reading.is_some());
            let run = output.run::<3>();
            codec::Fixed::put(<Self as codec::Message>::CODE, run, 0);
            codec::Fixed::put(present, run, 2);
            output.member("Position", |output| codec::Composite::write(&self.position, output))?;
            if let Some(value) = &self.reading {
                output.member("Reading", |output| codec::Composite::write(value, output))?;
            }
            Ok(())
        }

        fn read(input: &mut codec::Reader<'_>) -> Result<Self, codec::DecodeError> {
            input.code(Self::CODE)?;
            let present = input.presence::<u8>(0x1)?;
            let position = input.member("Position", codec::Composite::read)?;
            let reading = input.optional(present & 0x1 != 0, "Reading", codec::Composite::read)?;
            Ok(Self { position, reading })
        }
    }

    codec::members!(SetPosition { position: "Position", reading: "Reading" });

    /// The types inside [`SetPosition`].
    pub mod set_position {
        use super::codec;

        /// `Position` in radian: -8 to 8 in steps of 3.725e-9, carried as `u32`.
        #[derive(Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
        pub struct PositionRadian(u32);

        codec::scaled!(PositionRadian(u32), "Position", -8.0_f64 to 8.0_f64 "radian", Round);

        /// `Position` in meter: -10 to 10 in steps of 4.657e-9, carried as `u32`.
        #[derive(Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
        pub struct PositionMeter(u32);

        codec::scaled!(PositionMeter(u32), "Position", -10.0_f64 to 10.0_f64 "meter", Round);

        /// `Position`: a number whose type and unit are chosen by an index.
        #[derive(Debug, Clone, Copy, PartialEq)]
        pub enum Position {
            /// Index 1: radian, -8 to 8.
            Radian(PositionRadian),
            /// Index 2: meter, -10 to 10.
            Meter(PositionMeter),
        }

        impl Default for Position {
            fn default() -> Self {
                Self::Radian(Default::default())
            }
        }

        impl codec::Composite for Position {
            const MIN_LEN: usize = 5;

            fn encoded_len(&self) -> usize {
                match self {
                    Self::Radian(_) => 5,
                    Self::Meter(_) => 5,
                }
            }
            fn write(&self, output: &mut codec::Writer<'_>) -> Result<(), codec::EncodeError> {
                match *self {
                    Self::Radian(value) => {
                        output.fixed(1_u8);
                        output.fixed(value);
                    }
                    Self::Meter(value) => {
                        output.fixed(2_u8);
                        output.fixed(value);
                    }
                }
                Ok(())
            }
            fn read(input: &mut codec::Reader<'_>) -> Result<Self, codec::DecodeError> {
                match input.fixed::<u8>()? {
                    1 => input.fixed().map(Self::Radian),
                    2 => input.fixed().map(Self::Meter),
                    index => Err(input.unknown_choice(index)),
                }
            }
        }

        codec::if_serde! {
            impl codec::view::View for Position {
                fn view(&self) -> codec::view::Value {
                    match self {
                        Self::Radian(value) => {
                            codec::view::choice_of(1, "radian", value)
                        }
                        Self::Meter(value) => {
                            codec::view::choice_of(2, "meter", value)
                        }
                    }
                }

                fn from_view(value: &codec::view::Value) -> Result<Self, codec::view::Error> {
                    codec::view::choice(value, |index, value| Some(match index {
                        1 => codec::view::View::from_view(value).map(Self::Radian),
                        2 => codec::view::View::from_view(value).map(Self::Meter),
                        _ => return None,
                    }))
                }
            }
            codec::serde_by_view!(Position);
        }

        codec::if_arbitrary! {
            impl<'a> codec::arbitrary::Arbitrary<'a> for Position {
                fn arbitrary(random: &mut codec::arbitrary::Unstructured<'a>) -> codec::arbitrary::Result<Self> {
                    match random.int_in_range(0..=1)? {
                        0 => codec::arbitrary::Arbitrary::arbitrary(random).map(Self::Radian),
                        _ => codec::arbitrary::Arbitrary::arbitrary(random).map(Self::Meter),
                    }
                }
            }
        }

        /// `Reading one`: a number with named values. Others are kept as they come.
        #[derive(Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
        pub struct ReadingOne(pub u16);

        impl ReadingOne {
            /// `Cold` = 1.
            pub const COLD: Self = Self(1);
            /// `Hot` = 2.
            pub const HOT: Self = Self(2);
        }

        codec::enumeration!(ReadingOne(u16), [(1, "Cold"), (2, "Hot")]);

        /// `Reading`: a number whose type and unit are chosen by an index.
        #[derive(Debug, Clone, Copy, PartialEq)]
        pub enum Reading {
            /// Index 0.
            One(u8),
            /// Index 7: meter.
            Meter(f32),
            /// Index 9: meter.
            Meter2(i32),
            /// Index 200.
            One2(ReadingOne),
        }

        impl Default for Reading {
            fn default() -> Self {
                Self::One(Default::default())
            }
        }

        impl codec::Composite for Reading {
            const MIN_LEN: usize = 2;

            fn encoded_len(&self) -> usize {
                match self {
                    Self::One(_) => 2,
                    Self::Meter(_) => 5,
                    Self::Meter2(_) => 5,
                    Self::One2(_) => 3,
                }
            }
            fn write(&self, output: &mut codec::Writer<'_>) -> Result<(), codec::EncodeError> {
                match *self {
                    Self::One(value) => {
                        output.fixed(0_u8);
                        output.fixed(value);
                    }
                    Self::Meter(value) => {
                        output.fixed(7_u8);
                        output.fixed(value);
                    }
                    Self::Meter2(value) => {
                        output.fixed(9_u8);
                        output.fixed(value);
                    }
                    Self::One2(value) => {
                        output.fixed(200_u8);
                        output.fixed(value);
                    }
                }
                Ok(())
            }
            fn read(input: &mut codec::Reader<'_>) -> Result<Self, codec::DecodeError> {
                match input.fixed::<u8>()? {
                    0 => input.fixed().map(Self::One),
                    7 => input.fixed().map(Self::Meter),
                    9 => input.fixed().map(Self::Meter2),
                    200 => input.fixed().map(Self::One2),
                    index => Err(input.unknown_choice(index)),
                }
            }
        }

        codec::if_serde! {
            impl codec::view::View for Reading {
                fn view(&self) -> codec::view::Value {
                    match self {
                        Self::One(value) => {
                            codec::view::choice_of(0, "one", value)
                        }
                        Self::Meter(value) => {
                            codec::view::choice_of(7, "meter", value)
                        }
                        Self::Meter2(value) => {
                            codec::view::choice_of(9, "meter", value)
                        }
                        Self::One2(value) => {
                            codec::view::choice_of(200, "one", value)
                        }
                    }
                }

                fn from_view(value: &codec::view::Value) -> Result<Self, codec::view::Error> {
                    codec::view::choice(value, |index, value| Some(match index {
                        0 => codec::view::View::from_view(value).map(Self::One),
                        7 => codec::view::View::from_view(value).map(Self::Meter),
                        9 => codec::view::View::from_view(value).map(Self::Meter2),
                        200 => codec::view::View::from_view(value).map(Self::One2),
                        _ => return None,
                    }))
                }
            }
            codec::serde_by_view!(Reading);
        }

        codec::if_arbitrary! {
            impl<'a> codec::arbitrary::Arbitrary<'a> for Reading {
                fn arbitrary(random: &mut codec::arbitrary::Unstructured<'a>) -> codec::arbitrary::Result<Self> {
                    match random.int_in_range(0..=3)? {
                        0 => codec::arbitrary::Arbitrary::arbitrary(random).map(Self::One),
                        1 => codec::arbitrary::f32(random).map(Self::Meter),
                        2 => codec::arbitrary::Arbitrary::arbitrary(random).map(Self::Meter2),
                        _ => codec::arbitrary::Arbitrary::arbitrary(random).map(Self::One2),
                    }
                }
            }
        }
    }
}

#[doc(inline)]
#[allow(unused_imports)]
pub use v1_0::{SetPosition, set_position};
