use ::jaus::codec;

/// The service `BitFields`.
///
/// Several numbers in one.
pub mod bit_fields {
    use super::codec;

    /// What the service is called, whatever its version.
    pub const URN: &str = "urn:example:BitFields";

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
        /// Handles `ReportTime`.
        fn report_time(&mut self, message: super::ReportTime, call: &mut C);
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
                0xF011 => call.receive(|message: super::ReportTime, call| self.service.report_time(message, call)),
                _ => return None,
            })
        }
    }
}

/// The services of the set, by URN and version.
pub static SERVICES: &[codec::ServiceInfo] = &[
    codec::ServiceInfo {
        name: "BitFields", id: bit_fields::V1_0, inherits_from: None, inputs: &[0xF011],
        outputs: &[],
    },
];

/// The message types of the set, by code; of several with one code the newest first.
pub static MESSAGES: &[codec::MessageInfo] = &[
    codec::MessageInfo::of::<ReportTime>(&[bit_fields::V1_0]),
];

/// The messages of services of version 1.0.
pub mod v1_0 {
    use super::codec;

    /// `ReportTime` (F011h).
    ///
    /// Bit fields of every width, with free bits.
    ///
    /// Declared by `urn:example:BitFields 1.0`.
    #[derive(Debug, Clone, Default, PartialEq)]
    pub struct ReportTime {
        /// `TimeStamp`.
        pub time_stamp: report_time::TimeStamp,
        /// `Flags`: bit 0 of the presence vector.
        pub flags: Option<report_time::Flags>,
        /// `Wide`: bit 1 of the presence vector.
        pub wide: Option<report_time::Wide>,
        /// `Whole`: bit 2 of the presence vector.
        pub whole: Option<report_time::Whole>,
    }

    impl codec::Message for ReportTime {
        const CODE: u16 = 0xF011;
        const NAME: &'static str = "ReportTime";
        fn encoded_len(&self) -> usize {
            7 + usize::from(self.flags.is_some()) + 8 * usize::from(self.wide.is_some())
            + 2 * usize::from(self.whole.is_some())
        }

        #[inline]
        fn write(&self, output: &mut codec::Writer<'_>) -> Result<(), codec::EncodeError> {
            if let Self {
                time_stamp, flags: Some(flags), wide: Some(wide), whole: Some(whole),
            } = self {
                let run = output.run::<18>();
                codec::Fixed::put(<Self as codec::Message>::CODE, run, 0);
                codec::Fixed::put(0x7_u8, run, 2);
                codec::Fixed::put(*time_stamp, run, 3);
                codec::Fixed::put(*flags, run, 7);
                codec::Fixed::put(*wide, run, 8);
                codec::Fixed::put(*whole, run, 16);
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
                let run = input.run::<15>(&[
                    ("TimeStamp", 4), ("Flags", 1), ("Wide", 8), ("Whole", 2),
                ])?;
                return Ok(Self {
                    time_stamp: codec::Fixed::get(run, 0), flags: Some(codec::Fixed::get(run, 4)),
                    wide: Some(codec::Fixed::get(run, 5)), whole: Some(codec::Fixed::get(run, 13)),
                });
            }
            Self::read_some(input, present)
        }
    }

    impl ReportTime {
        #[inline(never)]
        fn write_some(&self, output: &mut codec::Writer<'_>) {
            let present = u8::from(self.flags.is_some()) | u8::from(self.wide.is_some()) << 1
            | u8::from(self.whole.is_some()) << 2;
            let run = output.run::<7>();
            codec::Fixed::put(<Self as codec::Message>::CODE, run, 0);
            codec::Fixed::put(present, run, 2);
            codec::Fixed::put(self.time_stamp, run, 3);
            output.optional(self.flags);
            output.optional(self.wide);
            output.optional(self.whole);
        }

        #[inline(never)]
        fn read_some(place: &mut codec::Reader<'_>, present: u64) -> Result<Self, codec::DecodeError> {
            let mut input = place.clone();
            let time_stamp = input.member("TimeStamp", codec::Reader::fixed)?;
            let flags = input.optional(present & 0x1 != 0, "Flags", codec::Reader::fixed)?;
            let wide = input.optional(present & 0x2 != 0, "Wide", codec::Reader::fixed)?;
            let whole = input.optional(present & 0x4 != 0, "Whole", codec::Reader::fixed)?;
            *place = input;
            Ok(Self { time_stamp, flags, wide, whole })
        }
    }

    codec::members!(ReportTime {
        time_stamp: "TimeStamp", flags: "Flags", wide: "Wide", whole: "Whole",
    });

    /// The types inside [`ReportTime`].
    pub mod report_time {
        use super::codec;

        /// `TimeStamp`: several numbers in one `u32`. Bits outside all of them are kept.
        #[derive(Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
        pub struct TimeStamp(pub u32);

        codec::sub_fields!(TimeStamp(u32) {
            /// `Milliseconds`: bits 0 to 9, 0 to 999.
            milliseconds: u16, 0 to 9, 0 to 999, "Milliseconds" => with_milliseconds;
            /// `Seconds`: bits 10 to 15, 0 to 59.
            seconds: u8, 10 to 15, 0 to 59, "Seconds" => with_seconds;
            /// `Minutes`: bits 16 to 21, 0 to 59.
            minutes: u8, 16 to 21, 0 to 59, "Minutes" => with_minutes;
            /// `Hour`: bits 22 to 26, 0 to 23.
            hour: u8, 22 to 26, 0 to 23, "Hour" => with_hour;
            /// `Day`: bits 27 to 31, 1 to 31.
            day: u8, 27 to 31, 1 to 31, "Day" => with_day;
        });

        impl TimeStamp {
            /// The stamp of a time since the beginning of 1970 (UTC).
            #[must_use]
            pub const fn at(since_1970: ::core::time::Duration) -> Self {
                Self(codec::time_stamp(since_1970))
            }
        }

        codec::bit_field!(TimeStamp(u32), [
            ("Milliseconds", 0, 9), ("Seconds", 10, 15), ("Minutes", 16, 21), ("Hour", 22, 26),
            ("Day", 27, 31),
        ]);

        /// `Flags Ready`: a number with named values. Others are kept as they come.
        #[derive(Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
        pub struct FlagsReady(pub u8);

        impl FlagsReady {
            /// `No` = 0.
            pub const NO: Self = Self(0);
            /// `Yes` = 1. It is.
            pub const YES: Self = Self(1);
        }

        codec::enumeration!(FlagsReady(u8), [(0, "No"), (1, "Yes")]);

        /// `Flags`: several numbers in one `u8`. Bits outside all of them are kept.
        #[derive(Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
        pub struct Flags(pub u8);

        codec::sub_fields!(Flags(u8) {
            /// `Ready`: bit 1.
            ready: u8 as FlagsReady, 1 to 1, 0 to 1, "Ready" => with_ready;
            /// `Level`: bits 4 to 6, 0 to 7.
            level: u8, 4 to 6, 0 to 7, "Level" => with_level;
        });

        codec::bit_field!(Flags(u8), [("Ready", 1, 1, FlagsReady), ("Level", 4, 6)]);

        /// `Wide`: several numbers in one `u64`. Bits outside all of them are kept.
        #[derive(Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
        pub struct Wide(pub u64);

        codec::sub_fields!(Wide(u64) {
            /// `Low`: bits 0 to 31, 0 to 4294967295.
            low: u32, 0 to 31, 0 to 4294967295, "Low" => with_low;
            /// `type`: bits 32 to 63, 0 to 4294967295.
            r#type: u32, 32 to 63, 0 to 4294967295, "type" => with_type;
        });

        codec::bit_field!(Wide(u64), [("Low", 0, 31), ("type", 32, 63)]);

        /// `Whole`: several numbers in one `u16`. Bits outside all of them are kept.
        #[derive(Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
        pub struct Whole(pub u16);

        codec::sub_fields!(Whole(u16) {
            /// `All`: bits 0 to 15, 0 to 65535.
            all: u16, 0 to 15, 0 to 65535, "All" => with_all;
        });

        codec::bit_field!(Whole(u16), [("All", 0, 15)]);
    }
}

#[doc(inline)]
#[allow(unused_imports)]
pub use v1_0::{ReportTime, report_time};
