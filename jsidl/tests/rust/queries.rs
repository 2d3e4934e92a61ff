use ::jaus::codec;

/// The service `Queries`.
///
/// Queries and their reports.
pub mod queries {
    use super::codec;

    /// What the service is called, whatever its version.
    pub const URN: &str = "urn:example:Queries";

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
        /// Answers `QueryPlace`; `None` is for no answer, or a later one.
        fn query_place(&mut self, query: super::QueryPlace, call: &mut C) -> Option<super::ReportPlace>;

        /// Answers `QueryDrive`; `None` is for no answer, or a later one.
        fn query_drive(&mut self, query: super::QueryDrive, call: &mut C) -> Option<super::ReportDrive>;

        /// Handles `QueryEcho`.
        fn query_echo(&mut self, message: super::QueryEcho, call: &mut C);

        /// Handles `QueryCodes`.
        fn query_codes(&mut self, message: super::QueryCodes, call: &mut C);
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
        fn offers(&self) -> Vec<codec::ServiceId> {
            vec![V1_0]
        }

        fn receive(&mut self, code: u16, call: &mut C) -> Option<Result<(), codec::DecodeError>> {
            Some(match code {
                0xE0A1 => call.answer(|query: super::QueryPlace, call| self.service.query_place(query, call)),
                0xE0A2 => call.answer(|query: super::QueryDrive, call| self.service.query_drive(query, call)),
                0xE0A3 => call.receive(|message: super::QueryEcho, call| self.service.query_echo(message, call)),
                0xE0A4 => call.receive(|message: super::QueryCodes, call| self.service.query_codes(message, call)),
                _ => return None,
            })
        }
    }
}

/// The services of the set, by URN and version.
pub static SERVICES: &[codec::ServiceInfo] = &[
    codec::ServiceInfo {
        name: "Queries",
        id: queries::V1_0,
        inherits_from: None,
        inputs: &[0xE0A1, 0xE0A2, 0xE0A3, 0xE0A4],
        outputs: &[0xF0A1, 0xF0A2, 0xF0A3, 0xF0A7],
    },
];

/// The message types of the set, by code; of several with one code the newest first.
pub static MESSAGES: &[codec::MessageInfo] = &[
    codec::MessageInfo::of::<QueryPlace>(&[
        queries::V1_0,
    ]),
    codec::MessageInfo::of::<QueryDrive>(&[
        queries::V1_0,
    ]),
    codec::MessageInfo::of::<QueryEcho>(&[
        queries::V1_0,
    ]),
    codec::MessageInfo::of::<QueryCodes>(&[
        queries::V1_0,
    ]),
    codec::MessageInfo::of::<ReportPlace>(&[
        queries::V1_0,
    ]),
    codec::MessageInfo::of::<ReportDrive>(&[
        queries::V1_0,
    ]),
    codec::MessageInfo::of::<ReportSound>(&[
        queries::V1_0,
    ]),
    codec::MessageInfo::of::<ReportCodes>(&[
        queries::V1_0,
    ]),
];

/// `QueryPlace` (E0A1h).
///
/// Asks for some fields of the place.
///
/// Declared by `urn:example:Queries 1.0`.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct QueryPlace {
    /// `PresenceVector`.
    pub presence_vector: u8,
}

impl codec::Message for QueryPlace {
    const CODE: u16 = 0xE0A1;
    const NAME: &'static str = "QueryPlace";
    const IS_COMMAND: bool = false;
    const NEEDS_CONTROL: bool = false;

    fn encoded_len(&self) -> usize {
        3
    }

    fn write(&self, output: &mut codec::Writer<'_>) -> Result<(), codec::EncodeError> {
        let run = output.run::<3>();
        codec::Fixed::put(<Self as codec::Message>::CODE, run, 0);
        codec::Fixed::put(self.presence_vector, run, 2);
        Ok(())
    }

    fn read(input: &mut codec::Reader<'_>) -> Result<Self, codec::DecodeError> {
        input.code(Self::CODE)?;
        let presence_vector = input.member("PresenceVector", codec::Reader::fixed)?;
        Ok(Self {
            presence_vector,
        })
    }
}

codec::if_serde! {
    impl codec::view::View for QueryPlace {
        #[inline(never)]
        fn view(&self) -> codec::view::Value {
            codec::view::Value::object(1)
            .with("PresenceVector", codec::view::View::view(&self.presence_vector))
        }

        #[inline(never)]
        fn from_view(value: &codec::view::Value) -> Result<Self, codec::view::Error> {
            let object = codec::view::Object::new(value, &["PresenceVector"])?;
            Ok(Self {
                presence_vector: object.member("PresenceVector")?,
            })
        }
    }
    codec::serde_by_view!(QueryPlace);
}

codec::if_arbitrary! {
    impl<'a> codec::arbitrary::Arbitrary<'a> for QueryPlace {
        fn arbitrary(random: &mut codec::arbitrary::Unstructured<'a>) -> codec::arbitrary::Result<Self> {
            Ok(Self {
                presence_vector: codec::arbitrary::Arbitrary::arbitrary(random)?,
            })
        }
    }
}

impl codec::Query for QueryPlace {
    type Report = ReportPlace;

    fn drop_unrequested(&self, report: &mut ReportPlace) {
        if self.presence_vector & 0x0001 == 0 {
            report.x = None;
        }
        if self.presence_vector & 0x0002 == 0 {
            report.self_ = None;
        }
        if self.presence_vector & 0x0004 == 0 {
            report.time_stamp = None;
        }
    }
}

impl QueryPlace {
    /// Requests every optional field of [`ReportPlace`].
    #[must_use]
    pub const fn all() -> Self {
        Self {
            presence_vector: 0x0007,
        }
    }

    /// Requests no optional field of [`ReportPlace`] yet.
    #[must_use]
    pub const fn none() -> Self {
        Self {
            presence_vector: 0x0000,
        }
    }

    /// Also requests `X`, bit 0.
    #[must_use]
    pub const fn with_x(mut self) -> Self {
        self.presence_vector |= 0x0001;
        self
    }

    /// Also requests `Self`, bit 1.
    #[must_use]
    pub const fn with_self(mut self) -> Self {
        self.presence_vector |= 0x0002;
        self
    }

    /// Also requests `TimeStamp`, bit 2.
    #[must_use]
    pub const fn with_time_stamp(mut self) -> Self {
        self.presence_vector |= 0x0004;
        self
    }
}

/// `QueryDrive` (E0A2h).
///
/// Asks for some fields of one drive.
///
/// Declared by `urn:example:Queries 1.0`.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct QueryDrive {
    /// `Drive`.
    pub drive: u8,
    /// `PresenceVector`.
    pub presence_vector: u8,
}

impl codec::Message for QueryDrive {
    const CODE: u16 = 0xE0A2;
    const NAME: &'static str = "QueryDrive";
    const IS_COMMAND: bool = false;
    const NEEDS_CONTROL: bool = false;

    fn encoded_len(&self) -> usize {
        4
    }

    fn write(&self, output: &mut codec::Writer<'_>) -> Result<(), codec::EncodeError> {
        let run = output.run::<4>();
        codec::Fixed::put(<Self as codec::Message>::CODE, run, 0);
        codec::Fixed::put(self.drive, run, 2);
        codec::Fixed::put(self.presence_vector, run, 3);
        Ok(())
    }

    fn read(input: &mut codec::Reader<'_>) -> Result<Self, codec::DecodeError> {
        input.code(Self::CODE)?;
        let run = input.run::<2>(&[
            ("Drive", 1),
            ("PresenceVector", 1),
        ])?;
        let drive = codec::Fixed::get(run, 0);
        let presence_vector = codec::Fixed::get(run, 1);
        Ok(Self {
            drive,
            presence_vector,
        })
    }
}

codec::if_serde! {
    impl codec::view::View for QueryDrive {
        #[inline(never)]
        fn view(&self) -> codec::view::Value {
            codec::view::Value::object(2)
            .with("Drive", codec::view::View::view(&self.drive))
            .with("PresenceVector", codec::view::View::view(&self.presence_vector))
        }

        #[inline(never)]
        fn from_view(value: &codec::view::Value) -> Result<Self, codec::view::Error> {
            let object = codec::view::Object::new(value, &["Drive", "PresenceVector"])?;
            Ok(Self {
                drive: object.member("Drive")?,
                presence_vector: object.member("PresenceVector")?,
            })
        }
    }
    codec::serde_by_view!(QueryDrive);
}

codec::if_arbitrary! {
    impl<'a> codec::arbitrary::Arbitrary<'a> for QueryDrive {
        fn arbitrary(random: &mut codec::arbitrary::Unstructured<'a>) -> codec::arbitrary::Result<Self> {
            Ok(Self {
                drive: codec::arbitrary::Arbitrary::arbitrary(random)?,
                presence_vector: codec::arbitrary::Arbitrary::arbitrary(random)?,
            })
        }
    }
}

impl codec::Query for QueryDrive {
    type Report = ReportDrive;

    fn drop_unrequested(&self, report: &mut ReportDrive) {
        if self.presence_vector & 0x0001 == 0 {
            report.effort = None;
        }
    }
}

impl QueryDrive {
    /// Requests every optional field of [`ReportDrive`].
    #[must_use]
    pub fn all() -> Self {
        Self {
            presence_vector: 0x0001,
            ..Self::default()
        }
    }

    /// Requests no optional field of [`ReportDrive`] yet.
    #[must_use]
    pub fn none() -> Self {
        Self {
            presence_vector: 0x0000,
            ..Self::default()
        }
    }

    /// Also requests `Effort`, bit 0.
    #[must_use]
    pub const fn with_effort(mut self) -> Self {
        self.presence_vector |= 0x0001;
        self
    }
}

/// `QueryEcho` (E0A3h).
///
/// Its report has another name.
///
/// Declared by `urn:example:Queries 1.0`.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct QueryEcho;

impl codec::Message for QueryEcho {
    const CODE: u16 = 0xE0A3;
    const NAME: &'static str = "QueryEcho";
    const IS_COMMAND: bool = false;
    const NEEDS_CONTROL: bool = false;

    fn encoded_len(&self) -> usize {
        2
    }

    fn write(&self, output: &mut codec::Writer<'_>) -> Result<(), codec::EncodeError> {
        output.fixed(<Self as codec::Message>::CODE);
        Ok(())
    }

    fn read(input: &mut codec::Reader<'_>) -> Result<Self, codec::DecodeError> {
        input.code(Self::CODE)?;
        Ok(Self)
    }
}

codec::if_serde! {
    impl codec::view::View for QueryEcho {
        #[inline(never)]
        fn view(&self) -> codec::view::Value {
            codec::view::Value::object(0)
        }

        #[inline(never)]
        fn from_view(value: &codec::view::Value) -> Result<Self, codec::view::Error> {
            codec::view::Object::new(value, &[])?;
            Ok(Self)
        }
    }
    codec::serde_by_view!(QueryEcho);
}

codec::if_arbitrary! {
    impl<'a> codec::arbitrary::Arbitrary<'a> for QueryEcho {
        fn arbitrary(_: &mut codec::arbitrary::Unstructured<'a>) -> codec::arbitrary::Result<Self> {
            Ok(Self)
        }
    }
}

/// `QueryCodes` (E0A4h).
///
/// Its report has a code that does not follow.
///
/// Declared by `urn:example:Queries 1.0`.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct QueryCodes;

impl codec::Message for QueryCodes {
    const CODE: u16 = 0xE0A4;
    const NAME: &'static str = "QueryCodes";
    const IS_COMMAND: bool = false;
    const NEEDS_CONTROL: bool = false;

    fn encoded_len(&self) -> usize {
        2
    }

    fn write(&self, output: &mut codec::Writer<'_>) -> Result<(), codec::EncodeError> {
        output.fixed(<Self as codec::Message>::CODE);
        Ok(())
    }

    fn read(input: &mut codec::Reader<'_>) -> Result<Self, codec::DecodeError> {
        input.code(Self::CODE)?;
        Ok(Self)
    }
}

codec::if_serde! {
    impl codec::view::View for QueryCodes {
        #[inline(never)]
        fn view(&self) -> codec::view::Value {
            codec::view::Value::object(0)
        }

        #[inline(never)]
        fn from_view(value: &codec::view::Value) -> Result<Self, codec::view::Error> {
            codec::view::Object::new(value, &[])?;
            Ok(Self)
        }
    }
    codec::serde_by_view!(QueryCodes);
}

codec::if_arbitrary! {
    impl<'a> codec::arbitrary::Arbitrary<'a> for QueryCodes {
        fn arbitrary(_: &mut codec::arbitrary::Unstructured<'a>) -> codec::arbitrary::Result<Self> {
            Ok(Self)
        }
    }
}

/// `ReportPlace` (F0A1h).
///
/// The place.
///
/// Declared by `urn:example:Queries 1.0`.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ReportPlace {
    /// `Map`.
    pub map: u8,
    /// `X`: bit 0 of the presence vector.
    pub x: Option<u8>,
    /// `Self`: bit 1 of the presence vector.
    pub self_: Option<u8>,
    /// `TimeStamp`: bit 2 of the presence vector.
    pub time_stamp: Option<report_place::TimeStamp>,
}

impl codec::Message for ReportPlace {
    const CODE: u16 = 0xF0A1;
    const NAME: &'static str = "ReportPlace";
    const IS_COMMAND: bool = false;
    const NEEDS_CONTROL: bool = false;

    fn encoded_len(&self) -> usize {
        4
        + usize::from(self.x.is_some())
        + usize::from(self.self_.is_some())
        + 4 * usize::from(self.time_stamp.is_some())
    }

    #[inline]
    fn write(&self, output: &mut codec::Writer<'_>) -> Result<(), codec::EncodeError> {
        if let Self {
            map,
            x: Some(x),
            self_: Some(self_),
            time_stamp: Some(time_stamp),
        } = self
        {
            let run = output.run::<10>();
            codec::Fixed::put(<Self as codec::Message>::CODE, run, 0);
            codec::Fixed::put(0x7_u8, run, 2);
            codec::Fixed::put(*map, run, 3);
            codec::Fixed::put(*x, run, 4);
            codec::Fixed::put(*self_, run, 5);
            codec::Fixed::put(*time_stamp, run, 6);
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
            let run = input.run::<7>(&[
                ("Map", 1),
                ("X", 1),
                ("Self", 1),
                ("TimeStamp", 4),
            ])?;
            return Ok(Self {
                map: codec::Fixed::get(run, 0),
                x: Some(codec::Fixed::get(run, 1)),
                self_: Some(codec::Fixed::get(run, 2)),
                time_stamp: Some(codec::Fixed::get(run, 3)),
            });
        }
        Self::read_some(input, present)
    }
}

impl ReportPlace {
    #[inline(never)]
    fn write_some(&self, output: &mut codec::Writer<'_>) {
        let present =
        u8::from(self.x.is_some())
        | u8::from(self.self_.is_some()) << 1
        | u8::from(self.time_stamp.is_some()) << 2;
        let run = output.run::<4>();
        codec::Fixed::put(<Self as codec::Message>::CODE, run, 0);
        codec::Fixed::put(present, run, 2);
        codec::Fixed::put(self.map, run, 3);
        output.optional(self.x);
        output.optional(self.self_);
        output.optional(self.time_stamp);
    }

    #[inline(never)]
    fn read_some(place: &mut codec::Reader<'_>, present: u64) -> Result<Self, codec::DecodeError> {
        let mut input = place.clone();
        let map = input.member("Map", codec::Reader::fixed)?;
        let x = input.optional(present & 0x1 != 0, "X", codec::Reader::fixed)?;
        let self_ = input.optional(present & 0x2 != 0, "Self", codec::Reader::fixed)?;
        let time_stamp = input.optional(present & 0x4 != 0, "TimeStamp", codec::Reader::fixed)?;
        *place = input;
        Ok(Self {
            map,
            x,
            self_,
            time_stamp,
        })
    }
}

codec::if_serde! {
    impl codec::view::View for ReportPlace {
        #[inline(never)]
        fn view(&self) -> codec::view::Value {
            codec::view::Value::object(4)
            .with("Map", codec::view::View::view(&self.map))
            .with("X", codec::view::View::view(&self.x))
            .with("Self", codec::view::View::view(&self.self_))
            .with("TimeStamp", codec::view::View::view(&self.time_stamp))
        }

        #[inline(never)]
        fn from_view(value: &codec::view::Value) -> Result<Self, codec::view::Error> {
            let object = codec::view::Object::new(value, &["Map", "X", "Self", "TimeStamp"])?;
            Ok(Self {
                map: object.member("Map")?,
                x: object.member("X")?,
                self_: object.member("Self")?,
                time_stamp: object.member("TimeStamp")?,
            })
        }
    }
    codec::serde_by_view!(ReportPlace);
}

codec::if_arbitrary! {
    impl<'a> codec::arbitrary::Arbitrary<'a> for ReportPlace {
        fn arbitrary(random: &mut codec::arbitrary::Unstructured<'a>) -> codec::arbitrary::Result<Self> {
            Ok(Self {
                map: codec::arbitrary::Arbitrary::arbitrary(random)?,
                x: codec::arbitrary::optional(random, codec::arbitrary::Arbitrary::arbitrary)?,
                self_: codec::arbitrary::optional(random, codec::arbitrary::Arbitrary::arbitrary)?,
                time_stamp: codec::arbitrary::optional(random, codec::arbitrary::Arbitrary::arbitrary)?,
            })
        }
    }
}

/// The types inside [`ReportPlace`].
pub mod report_place {
    use super::codec;

    /// `TimeStamp`: several numbers in one `u32`. Bits outside all of them are kept.
    #[derive(Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
    pub struct TimeStamp(pub u32);

    impl TimeStamp {
        /// `Milliseconds`: bits 0 to 9, 0 to 999.
        pub const fn milliseconds(self) -> u16 {
            codec::bits::get(self.0 as u64, 0, 9) as u16
        }

        /// The same with another `Milliseconds`.
        ///
        /// # Errors
        /// If the value is not in 0 to 999.
        pub const fn with_milliseconds(self, value: u16) -> Result<Self, codec::OutOfRange> {
            match codec::bits::set_checked(self.0 as u64, ("Milliseconds", 0, 9), value as u64, (0, 999)) {
                Ok(raw) => Ok(Self(raw as u32)),
                Err(error) => Err(error),
            }
        }

        /// `Seconds`: bits 10 to 15, 0 to 59.
        pub const fn seconds(self) -> u8 {
            codec::bits::get(self.0 as u64, 10, 15) as u8
        }

        /// The same with another `Seconds`.
        ///
        /// # Errors
        /// If the value is not in 0 to 59.
        pub const fn with_seconds(self, value: u8) -> Result<Self, codec::OutOfRange> {
            match codec::bits::set_checked(self.0 as u64, ("Seconds", 10, 15), value as u64, (0, 59)) {
                Ok(raw) => Ok(Self(raw as u32)),
                Err(error) => Err(error),
            }
        }

        /// `Minutes`: bits 16 to 21, 0 to 59.
        pub const fn minutes(self) -> u8 {
            codec::bits::get(self.0 as u64, 16, 21) as u8
        }

        /// The same with another `Minutes`.
        ///
        /// # Errors
        /// If the value is not in 0 to 59.
        pub const fn with_minutes(self, value: u8) -> Result<Self, codec::OutOfRange> {
            match codec::bits::set_checked(self.0 as u64, ("Minutes", 16, 21), value as u64, (0, 59)) {
                Ok(raw) => Ok(Self(raw as u32)),
                Err(error) => Err(error),
            }
        }

        /// `Hour`: bits 22 to 26, 0 to 23.
        pub const fn hour(self) -> u8 {
            codec::bits::get(self.0 as u64, 22, 26) as u8
        }

        /// The same with another `Hour`.
        ///
        /// # Errors
        /// If the value is not in 0 to 23.
        pub const fn with_hour(self, value: u8) -> Result<Self, codec::OutOfRange> {
            match codec::bits::set_checked(self.0 as u64, ("Hour", 22, 26), value as u64, (0, 23)) {
                Ok(raw) => Ok(Self(raw as u32)),
                Err(error) => Err(error),
            }
        }

        /// `Day`: bits 27 to 31, 1 to 31.
        pub const fn day(self) -> u8 {
            codec::bits::get(self.0 as u64, 27, 31) as u8
        }

        /// The same with another `Day`.
        ///
        /// # Errors
        /// If the value is not in 1 to 31.
        pub const fn with_day(self, value: u8) -> Result<Self, codec::OutOfRange> {
            match codec::bits::set_checked(self.0 as u64, ("Day", 27, 31), value as u64, (1, 31)) {
                Ok(raw) => Ok(Self(raw as u32)),
                Err(error) => Err(error),
            }
        }

        /// The stamp of a time since the beginning of 1970 (UTC).
        #[must_use]
        pub const fn at(since_1970: ::std::time::Duration) -> Self {
            Self(codec::time_stamp(since_1970))
        }
    }

    codec::bit_field!(TimeStamp(u32), [
        ("Milliseconds", 0, 9),
        ("Seconds", 10, 15),
        ("Minutes", 16, 21),
        ("Hour", 22, 26),
        ("Day", 27, 31),
    ]);
}

/// `ReportDrive` (F0A2h).
///
/// One drive.
///
/// Declared by `urn:example:Queries 1.0`.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ReportDrive {
    /// `Drive`.
    pub drive: u8,
    /// `Effort`: bit 0 of the presence vector.
    pub effort: Option<u8>,
}

impl codec::Message for ReportDrive {
    const CODE: u16 = 0xF0A2;
    const NAME: &'static str = "ReportDrive";
    const IS_COMMAND: bool = false;
    const NEEDS_CONTROL: bool = false;

    fn encoded_len(&self) -> usize {
        4
        + usize::from(self.effort.is_some())
    }

    #[inline]
    fn write(&self, output: &mut codec::Writer<'_>) -> Result<(), codec::EncodeError> {
        if let Self {
            drive,
            effort: Some(effort),
        } = self
        {
            let run = output.run::<5>();
            codec::Fixed::put(<Self as codec::Message>::CODE, run, 0);
            codec::Fixed::put(0x1_u8, run, 2);
            codec::Fixed::put(*drive, run, 3);
            codec::Fixed::put(*effort, run, 4);
            return Ok(());
        }
        self.write_some(output);
        Ok(())
    }

    #[inline]
    fn read(input: &mut codec::Reader<'_>) -> Result<Self, codec::DecodeError> {
        input.code(Self::CODE)?;
        let present = input.presence::<u8>(0x1)?;
        if present == 0x1 {
            let run = input.run::<2>(&[
                ("Drive", 1),
                ("Effort", 1),
            ])?;
            return Ok(Self {
                drive: codec::Fixed::get(run, 0),
                effort: Some(codec::Fixed::get(run, 1)),
            });
        }
        Self::read_some(input, present)
    }
}

impl ReportDrive {
    #[inline(never)]
    fn write_some(&self, output: &mut codec::Writer<'_>) {
        let present =
        u8::from(self.effort.is_some());
        let run = output.run::<4>();
        codec::Fixed::put(<Self as codec::Message>::CODE, run, 0);
        codec::Fixed::put(present, run, 2);
        codec::Fixed::put(self.drive, run, 3);
        output.optional(self.effort);
    }

    #[inline(never)]
    fn read_some(place: &mut codec::Reader<'_>, present: u64) -> Result<Self, codec::DecodeError> {
        let mut input = place.clone();
        let drive = input.member("Drive", codec::Reader::fixed)?;
        let effort = input.optional(present & 0x1 != 0, "Effort", codec::Reader::fixed)?;
        *place = input;
        Ok(Self {
            drive,
            effort,
        })
    }
}

codec::if_serde! {
    impl codec::view::View for ReportDrive {
        #[inline(never)]
        fn view(&self) -> codec::view::Value {
            codec::view::Value::object(2)
            .with("Drive", codec::view::View::view(&self.drive))
            .with("Effort", codec::view::View::view(&self.effort))
        }

        #[inline(never)]
        fn from_view(value: &codec::view::Value) -> Result<Self, codec::view::Error> {
            let object = codec::view::Object::new(value, &["Drive", "Effort"])?;
            Ok(Self {
                drive: object.member("Drive")?,
                effort: object.member("Effort")?,
            })
        }
    }
    codec::serde_by_view!(ReportDrive);
}

codec::if_arbitrary! {
    impl<'a> codec::arbitrary::Arbitrary<'a> for ReportDrive {
        fn arbitrary(random: &mut codec::arbitrary::Unstructured<'a>) -> codec::arbitrary::Result<Self> {
            Ok(Self {
                drive: codec::arbitrary::Arbitrary::arbitrary(random)?,
                effort: codec::arbitrary::optional(random, codec::arbitrary::Arbitrary::arbitrary)?,
            })
        }
    }
}

/// `ReportSound` (F0A3h).
///
/// Not the report of Query Echo.
///
/// Declared by `urn:example:Queries 1.0`.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ReportSound;

impl codec::Message for ReportSound {
    const CODE: u16 = 0xF0A3;
    const NAME: &'static str = "ReportSound";
    const IS_COMMAND: bool = false;
    const NEEDS_CONTROL: bool = false;

    fn encoded_len(&self) -> usize {
        2
    }

    fn write(&self, output: &mut codec::Writer<'_>) -> Result<(), codec::EncodeError> {
        output.fixed(<Self as codec::Message>::CODE);
        Ok(())
    }

    fn read(input: &mut codec::Reader<'_>) -> Result<Self, codec::DecodeError> {
        input.code(Self::CODE)?;
        Ok(Self)
    }
}

codec::if_serde! {
    impl codec::view::View for ReportSound {
        #[inline(never)]
        fn view(&self) -> codec::view::Value {
            codec::view::Value::object(0)
        }

        #[inline(never)]
        fn from_view(value: &codec::view::Value) -> Result<Self, codec::view::Error> {
            codec::view::Object::new(value, &[])?;
            Ok(Self)
        }
    }
    codec::serde_by_view!(ReportSound);
}

codec::if_arbitrary! {
    impl<'a> codec::arbitrary::Arbitrary<'a> for ReportSound {
        fn arbitrary(_: &mut codec::arbitrary::Unstructured<'a>) -> codec::arbitrary::Result<Self> {
            Ok(Self)
        }
    }
}

/// `ReportCodes` (F0A7h).
///
/// Not the report of Query Codes.
///
/// Declared by `urn:example:Queries 1.0`.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ReportCodes;

impl codec::Message for ReportCodes {
    const CODE: u16 = 0xF0A7;
    const NAME: &'static str = "ReportCodes";
    const IS_COMMAND: bool = false;
    const NEEDS_CONTROL: bool = false;

    fn encoded_len(&self) -> usize {
        2
    }

    fn write(&self, output: &mut codec::Writer<'_>) -> Result<(), codec::EncodeError> {
        output.fixed(<Self as codec::Message>::CODE);
        Ok(())
    }

    fn read(input: &mut codec::Reader<'_>) -> Result<Self, codec::DecodeError> {
        input.code(Self::CODE)?;
        Ok(Self)
    }
}

codec::if_serde! {
    impl codec::view::View for ReportCodes {
        #[inline(never)]
        fn view(&self) -> codec::view::Value {
            codec::view::Value::object(0)
        }

        #[inline(never)]
        fn from_view(value: &codec::view::Value) -> Result<Self, codec::view::Error> {
            codec::view::Object::new(value, &[])?;
            Ok(Self)
        }
    }
    codec::serde_by_view!(ReportCodes);
}

codec::if_arbitrary! {
    impl<'a> codec::arbitrary::Arbitrary<'a> for ReportCodes {
        fn arbitrary(_: &mut codec::arbitrary::Unstructured<'a>) -> codec::arbitrary::Result<Self> {
            Ok(Self)
        }
    }
}
