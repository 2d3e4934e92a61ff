use ::jaus::codec;

/// The service `Numbers`.
///
/// Numbers of every type and meaning.
pub mod numbers {
    use super::codec;

    /// What the service is called, whatever its version.
    pub const URN: &str = "urn:example:Numbers";

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
        /// Handles `ReportNumbers`.
        fn report_numbers(&mut self, message: super::ReportNumbers, call: &mut C);

        /// Handles `SetScaled` of the client in control.
        fn set_scaled(&mut self, message: super::SetScaled, call: &mut C);

        /// Handles `SetScaledOptional`.
        fn set_scaled_optional(&mut self, message: super::SetScaledOptional, call: &mut C);

        /// Handles `ReportNamed`.
        fn report_named(&mut self, message: super::ReportNamed, call: &mut C);
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
                set_up_by: Some("SetScaled"),
                stops: false,
            }
        }

        fn receive(&mut self, code: u16, call: &mut C) -> Option<Result<(), codec::DecodeError>> {
            Some(match code {
                0xF001 => call.receive(|message: super::ReportNumbers, call| self.service.report_numbers(message, call)),
                0xF002 => call.receive(|message: super::SetScaled, call| self.service.set_scaled(message, call)),
                0xF003 => call.receive(|message: super::SetScaledOptional, call| self.service.set_scaled_optional(message, call)),
                0xF004 => call.receive(|message: super::ReportNamed, call| self.service.report_named(message, call)),
                _ => return None,
            })
        }
    }
}

/// The services of the set, by URN and version.
pub static SERVICES: &[codec::ServiceInfo] = &[
    codec::ServiceInfo {
        name: "Numbers", id: numbers::V1_0, inherits_from: None,
        inputs: &[0xF001, 0xF002, 0xF003, 0xF004], outputs: &[],
    },
];

/// The message types of the set, by code; of several with one code the newest first.
pub static MESSAGES: &[codec::MessageInfo] = &[
    codec::MessageInfo::of::<ReportNumbers>(&[numbers::V1_0]),
    codec::MessageInfo::of::<SetScaled>(&[numbers::V1_0]),
    codec::MessageInfo::of::<SetScaledOptional>(&[numbers::V1_0]),
    codec::MessageInfo::of::<ReportNamed>(&[numbers::V1_0]),
];

/// The messages of services of version 1.0.
pub mod v1_0 {
    use super::codec;

    /// `ReportNumbers` (F001h).
    ///
    /// Every number there is.
    ///
    /// Declared by `urn:example:Numbers 1.0`.
    #[derive(Debug, Clone, Default, PartialEq)]
    pub struct ReportNumbers {
        /// `Byte`.
        pub byte: i8,
        /// `Short`.
        pub short: i16,
        /// `Integer`: meter.
        pub integer: i32,
        /// `Long`.
        pub long: i64,
        /// `UnsignedByte`.
        pub unsigned_byte: u8,
        /// `UnsignedShort`.
        pub unsigned_short: u16,
        /// `UnsignedInteger`.
        pub unsigned_integer: u32,
        /// `UnsignedLong`.
        pub unsigned_long: u64,
        /// `Float`: second. Seconds of something.
        pub float: f32,
        /// `LongFloat`.
        pub long_float: f64,
    }

    impl codec::Message for ReportNumbers {
        const CODE: u16 = 0xF001;
        const NAME: &'static str = "ReportNumbers";
        fn encoded_len(&self) -> usize { 44 }

        fn write(&self, output: &mut codec::Writer<'_>) -> Result<(), codec::EncodeError> {
            let run = output.run::<44>();
            codec::Fixed::put(<Self as codec::Message>::CODE, run, 0);
            codec::Fixed::put(self.byte, run, 2);
            codec::Fixed::put(self.short, run, 3);
            codec::Fixed::put(self.integer, run, 5);
            codec::Fixed::put(self.long, run, 9);
            codec::Fixed::put(self.unsigned_byte, run, 17);
            codec::Fixed::put(self.unsigned_short, run, 18);
            codec::Fixed::put(self.unsigned_integer, run, 20);
            codec::Fixed::put(self.unsigned_long, run, 24);
            codec::Fixed::put(self.float, run, 32);
            codec::Fixed::put(self.long_float, run, 36);
            Ok(())
        }

        fn read(input: &mut codec::Reader<'_>) -> Result<Self, codec::DecodeError> {
            input.code(Self::CODE)?;
            let run = input.run::<42>(&[
                ("Byte", 1), ("Short", 2), ("Integer", 4), ("Long", 8), ("UnsignedByte", 1),
                ("UnsignedShort", 2), ("UnsignedInteger", 4), ("UnsignedLong", 8), ("Float", 4),
                ("LongFloat", 8),
            ])?;
            let byte = codec::Fixed::get(run, 0);
            let short = codec::Fixed::get(run, 1);
            let integer = codec::Fixed::get(run, 3);
            let long = codec::Fixed::get(run, 7);
            let unsigned_byte = codec::Fixed::get(run, 15);
            let unsigned_short = codec::Fixed::get(run, 16);
            let unsigned_integer = codec::Fixed::get(run, 18);
            let unsigned_long = codec::Fixed::get(run, 22);
            let float = codec::Fixed::get(run, 30);
            let long_float = codec::Fixed::get(run, 34);
            Ok(Self {
                byte, short, integer, long, unsigned_byte, unsigned_short, unsigned_integer,
                unsigned_long, float, long_float,
            })
        }
    }

    codec::members!(ReportNumbers {
        byte: "Byte", short: "Short", integer: "Integer", long: "Long",
        unsigned_byte: "UnsignedByte", unsigned_short: "UnsignedShort",
        unsigned_integer: "UnsignedInteger", unsigned_long: "UnsignedLong",
        float: "Float" = codec::arbitrary::f32, long_float: "LongFloat" = codec::arbitrary::f64,
    });

    /// `SetScaled` (F002h), a command.
    ///
    /// Real numbers as integers.
    ///
    /// Declared by `urn:example:Numbers 1.0`.
    #[derive(Debug, Clone, Default, PartialEq)]
    pub struct SetScaled {
        /// `Percent`: percent, 0 to 100.
        pub percent: set_scaled::Percent,
        /// `Angle`: radian, -1.5707963267948966 to 1.5707963267948966.
        pub angle: set_scaled::Angle,
        /// `Latitude`: degree, -90 to 90. North is positive.
        pub latitude: set_scaled::Latitude,
        /// `Fine`: -1 to 1.
        pub fine: set_scaled::Fine,
        /// `Below`: meter, -1 to 1.
        pub below: set_scaled::Below,
        /// `Above`: meter, -1 to 1.
        pub above: set_scaled::Above,
    }

    codec::accessors!(SetScaled {
        percent: set_scaled::Percent => percent_percent, set_percent_percent, with_percent_percent, "`Percent` in percent", "0 to 100";
        angle: set_scaled::Angle => angle_rad, set_angle_rad, with_angle_rad, "`Angle` in radian", "-1.5707963267948966 to 1.5707963267948966";
        latitude: set_scaled::Latitude => latitude_deg, set_latitude_deg, with_latitude_deg, "`Latitude` in degree", "-90 to 90";
        fine: set_scaled::Fine => fine_value, set_fine_value, with_fine_value, "`Fine`", "-1 to 1";
        below: set_scaled::Below => below_m, set_below_m, with_below_m, "`Below` in meter", "-1 to 1";
        above: set_scaled::Above => above_m, set_above_m, with_above_m, "`Above` in meter", "-1 to 1";
    });

    impl codec::Message for SetScaled {
        const CODE: u16 = 0xF002;
        const NAME: &'static str = "SetScaled";
        const IS_COMMAND: bool = true;
        fn encoded_len(&self) -> usize { 15 }

        fn write(&self, output: &mut codec::Writer<'_>) -> Result<(), codec::EncodeError> {
            let run = output.run::<15>();
            codec::Fixed::put(<Self as codec::Message>::CODE, run, 0);
            codec::Fixed::put(self.percent, run, 2);
            codec::Fixed::put(self.angle, run, 3);
            codec::Fixed::put(self.latitude, run, 5);
            codec::Fixed::put(self.fine, run, 9);
            codec::Fixed::put(self.below, run, 13);
            codec::Fixed::put(self.above, run, 14);
            Ok(())
        }

        fn read(input: &mut codec::Reader<'_>) -> Result<Self, codec::DecodeError> {
            input.code(Self::CODE)?;
            let run = input.run::<13>(&[
                ("Percent", 1), ("Angle", 2), ("Latitude", 4), ("Fine", 4), ("Below", 1),
                ("Above", 1),
            ])?;
            let percent = codec::Fixed::get(run, 0);
            let angle = codec::Fixed::get(run, 1);
            let latitude = codec::Fixed::get(run, 3);
            let fine = codec::Fixed::get(run, 7);
            let below = codec::Fixed::get(run, 11);
            let above = codec::Fixed::get(run, 12);
            Ok(Self { percent, angle, latitude, fine, below, above })
        }
    }

    codec::members!(SetScaled {
        percent: "Percent", angle: "Angle", latitude: "Latitude", fine: "Fine", below: "Below",
        above: "Above",
    });

    /// The types inside [`SetScaled`].
    pub mod set_scaled {
        use super::codec;

        /// `Percent` in percent: 0 to 100 in steps of 3.922e-1, carried as `u8`.
        #[derive(Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
        pub struct Percent(u8);

        codec::scaled!(Percent(u8), "Percent", 0.0_f64 to 100.0_f64 "percent", Round);

        /// `Angle` in radian: -1.5707963267948966 to 1.5707963267948966 in steps of 4.794e-5,
        /// carried as `u16`.
        #[derive(Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
        pub struct Angle(u16);

        codec::scaled!(Angle(u16), "Angle", -1.5707963267948966_f64 to 1.5707963267948966_f64 "radian", Round);

        /// `Latitude` in degree: -90 to 90 in steps of 4.191e-8, carried as `u32`.
        #[derive(Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
        pub struct Latitude(u32);

        codec::scaled!(Latitude(u32), "Latitude", -90.0_f64 to 90.0_f64 "degree", Round);

        /// `Fine`: -1 to 1 in steps of 4.657e-10, carried as `u32`.
        #[derive(Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
        pub struct Fine(u32);

        codec::scaled!(Fine(u32), "Fine", -1.0_f64 to 1.0_f64 "one", Round);

        /// `Below` in meter: -1 to 1 in steps of 7.843e-3, carried as `u8`.
        #[derive(Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
        pub struct Below(u8);

        codec::scaled!(Below(u8), "Below", -1.0_f64 to 1.0_f64 "meter", Floor);

        /// `Above` in meter: -1 to 1 in steps of 7.843e-3, carried as `u8`.
        #[derive(Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
        pub struct Above(u8);

        codec::scaled!(Above(u8), "Above", -1.0_f64 to 1.0_f64 "meter", Ceiling);
    }

    /// `SetScaledOptional` (F003h).
    ///
    /// A required member between optional ones.
    ///
    /// Declared by `urn:example:Numbers 1.0`.
    #[derive(Debug, Clone, Default, PartialEq)]
    pub struct SetScaledOptional {
        /// `Latitude`: degree, -90 to 90, bit 0 of the presence vector.
        pub latitude: Option<set_scaled_optional::Latitude>,
        /// `Request`.
        pub request: u8,
        /// `Heading`: radian, -3.141592653589793 to 3.141592653589793, bit 1 of the presence
        /// vector.
        pub heading: Option<set_scaled_optional::Heading>,
    }

    codec::accessors!(SetScaledOptional {
        latitude: set_scaled_optional::Latitude, ? => latitude_deg, set_latitude_deg, with_latitude_deg, "`Latitude` in degree", "-90 to 90";
        heading: set_scaled_optional::Heading, ? => heading_rad, set_heading_rad, with_heading_rad, "`Heading` in radian", "-3.141592653589793 to 3.141592653589793";
    });

    impl codec::Message for SetScaledOptional {
        const CODE: u16 = 0xF003;
        const NAME: &'static str = "SetScaledOptional";
        fn encoded_len(&self) -> usize {
            4 + 4 * usize::from(self.latitude.is_some()) + 2 * usize::from(self.heading.is_some())
        }

        #[inline]
        fn write(&self, output: &mut codec::Writer<'_>) -> Result<(), codec::EncodeError> {
            if let Self { latitude: Some(latitude), request, heading: Some(heading) } = self {
                let run = output.run::<10>();
                codec::Fixed::put(<Self as codec::Message>::CODE, run, 0);
                codec::Fixed::put(0x3_u8, run, 2);
                codec::Fixed::put(*latitude, run, 3);
                codec::Fixed::put(*request, run, 7);
                codec::Fixed::put(*heading, run, 8);
                return Ok(());
            }
            self.write_some(output);
            Ok(())
        }

        #[inline]
        fn read(input: &mut codec::Reader<'_>) -> Result<Self, codec::DecodeError> {
            input.code(Self::CODE)?;
            let present = input.presence::<u8>(0x3)?;
            if present == 0x3 {
                let run = input.run::<7>(&[("Latitude", 4), ("Request", 1), ("Heading", 2)])?;
                return Ok(Self {
                    latitude: Some(codec::Fixed::get(run, 0)), request: codec::Fixed::get(run, 4),
                    heading: Some(codec::Fixed::get(run, 5)),
                });
            }
            Self::read_some(input, present)
        }
    }

    impl SetScaledOptional {
        #[inline(never)]
        fn write_some(&self, output: &mut codec::Writer<'_>) {
            let present = u8::from(self.latitude.is_some()) | u8::from(self.heading.is_some()) << 1;
            let run = output.run::<3>();
            codec::Fixed::put(<Self as codec::Message>::CODE, run, 0);
            codec::Fixed::put(present, run, 2);
            output.optional(self.latitude);
            output.fixed(self.request);
            output.optional(self.heading);
        }

        #[inline(never)]
        fn read_some(place: &mut codec::Reader<'_>, present: u64) -> Result<Self, codec::DecodeError> {
            let mut input = place.clone();
            let latitude = input.optional(present & 0x1 != 0, "Latitude", codec::Reader::fixed)?;
            let request = input.member("Request", codec::Reader::fixed)?;
            let heading = input.optional(present & 0x2 != 0, "Heading", codec::Reader::fixed)?;
            *place = input;
            Ok(Self { latitude, request, heading })
        }
    }

    codec::members!(SetScaledOptional {
        latitude: "Latitude", request: "Request", heading: "Heading",
    });

    /// The types inside [`SetScaledOptional`].
    pub mod set_scaled_optional {
        use super::codec;
        #[doc(inline)]
        #[allow(unused_imports)]
        pub use super::super::v1_0::set_scaled::Latitude;

        /// `Heading` in radian: -3.141592653589793 to 3.141592653589793 in steps of 9.588e-5,
        /// carried as `u16`.
        #[derive(Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
        pub struct Heading(u16);

        codec::scaled!(Heading(u16), "Heading", -3.141592653589793_f64 to 3.141592653589793_f64 "radian", Round);
    }

    /// `ReportNamed` (F004h).
    ///
    /// Numbers with names.
    ///
    /// Declared by `urn:example:Numbers 1.0`.
    #[derive(Debug, Clone, Default, PartialEq)]
    pub struct ReportNamed {
        /// `State`.
        pub state: report_named::State,
        /// `Signed`.
        pub signed: report_named::Signed,
        /// `Range`: 1 to 65534 (an id).
        pub range: u16,
        /// `Both`: 1 to 10 (a channel).
        pub both: report_named::Both,
    }

    impl codec::Message for ReportNamed {
        const CODE: u16 = 0xF004;
        const NAME: &'static str = "ReportNamed";
        fn encoded_len(&self) -> usize { 8 }

        fn write(&self, output: &mut codec::Writer<'_>) -> Result<(), codec::EncodeError> {
            let run = output.run::<8>();
            codec::Fixed::put(<Self as codec::Message>::CODE, run, 0);
            codec::Fixed::put(self.state, run, 2);
            codec::Fixed::put(self.signed, run, 3);
            codec::Fixed::put(self.range, run, 5);
            codec::Fixed::put(self.both, run, 7);
            Ok(())
        }

        fn read(input: &mut codec::Reader<'_>) -> Result<Self, codec::DecodeError> {
            input.code(Self::CODE)?;
            let run = input.run::<6>(&[("State", 1), ("Signed", 2), ("Range", 2), ("Both", 1)])?;
            let state = codec::Fixed::get(run, 0);
            let signed = codec::Fixed::get(run, 1);
            let range = codec::Fixed::get(run, 3);
            let both = codec::Fixed::get(run, 5);
            Ok(Self { state, signed, range, both })
        }
    }

    codec::members!(ReportNamed { state: "State", signed: "Signed", range: "Range", both: "Both" });

    /// The types inside [`ReportNamed`].
    pub mod report_named {
        use super::codec;

        /// `State`: a number with named values. Others are kept as they come.
        #[derive(Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
        pub struct State(pub u8);

        impl State {
            /// `Stand by` = 0. Waiting.
            pub const STAND_BY: Self = Self(0);
            /// `On` = 1.
            pub const ON: Self = Self(1);
            /// `852x480 (hd480)` = 7.
            pub const N852X480_HD480: Self = Self(7);
            /// `Stand-By` = 8. Collides.
            pub const STAND_BY_2: Self = Self(8);
            /// `%` = 255.
            pub const N: Self = Self(255);
        }

        codec::enumeration!(State(u8), [
            (0, "Stand by"), (1, "On"), (7, "852x480 (hd480)"), (8, "Stand-By"), (255, "%"),
        ]);

        /// `Signed`: a number with named values. Others are kept as they come.
        #[derive(Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
        pub struct Signed(pub i16);

        impl Signed {
            /// `Three` = 3.
            pub const THREE: Self = Self(3);
            /// `Minus two` = -2.
            pub const MINUS_TWO: Self = Self(-2);
        }

        codec::enumeration!(Signed(i16), [(3, "Three"), (18446744073709551614, "Minus two")]);

        /// `Both`: a number with named values. Others are kept as they come.
        ///
        /// Without a name: 1 to 10 (a channel).
        #[derive(Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
        pub struct Both(pub u8);

        impl Both {
            /// `None` = 0.
            pub const NONE: Self = Self(0);
        }

        codec::enumeration!(Both(u8), [(0, "None")]);
    }
}

#[doc(inline)]
#[allow(unused_imports)]
pub use v1_0::{
    ReportNumbers, SetScaled, set_scaled, SetScaledOptional, set_scaled_optional, ReportNamed,
    report_named,
};
