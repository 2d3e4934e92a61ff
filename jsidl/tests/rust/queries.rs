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

        /// Answers `QueryEcho`; `None` is for no answer, or a later one.
        fn query_echo(&mut self, query: super::QueryEcho, call: &mut C) -> Option<super::ReportSound>;

        /// Answers `QueryCodes`; `None` is for no answer, or a later one.
        fn query_codes(&mut self, query: super::QueryCodes, call: &mut C) -> Option<super::ReportCodes>;

        /// Answers `QueryMotion`; `None` is for no answer, or a later one.
        fn query_motion(&mut self, query: super::QueryMotion, call: &mut C) -> Option<super::ReportMotion>;

        /// Answers `QueryCameras`; `None` is for no answer, or a later one.
        fn query_cameras(&mut self, query: super::QueryCameras, call: &mut C) -> Option<super::ReportCameras>;
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

        fn answers(&self, query: u16) -> bool { [0xE0A1, 0xE0A2, 0xE0A3, 0xE0A4, 0xE0A5, 0xE0A6].contains(&query) }

        fn receive(&mut self, code: u16, call: &mut C) -> Option<Result<(), codec::DecodeError>> {
            Some(match code {
                0xE0A1 => call.answer(|query: super::QueryPlace, call| self.service.query_place(query, call)),
                0xE0A2 => call.answer(|query: super::QueryDrive, call| self.service.query_drive(query, call)),
                0xE0A3 => call.answer(|query: super::QueryEcho, call| self.service.query_echo(query, call)),
                0xE0A4 => call.answer(|query: super::QueryCodes, call| self.service.query_codes(query, call)),
                0xE0A5 => call.answer(|query: super::QueryMotion, call| self.service.query_motion(query, call)),
                0xE0A6 => call.answer(|query: super::QueryCameras, call| self.service.query_cameras(query, call)),
                _ => return None,
            })
        }
    }
}

/// The services of the set, by URN and version.
pub static SERVICES: &[codec::ServiceInfo] = &[
    codec::ServiceInfo {
        name: "Queries", id: queries::V1_0, inherits_from: None,
        inputs: &[0xE0A1, 0xE0A2, 0xE0A3, 0xE0A4, 0xE0A5, 0xE0A6],
        outputs: &[0xF0A1, 0xF0A2, 0xF0A3, 0xF0A7, 0xF0A5, 0xF0A6],
    },
];

/// The message types of the set, by code; of several with one code the newest first.
pub static MESSAGES: &[codec::MessageInfo] = &[
    codec::MessageInfo::of_query::<QueryPlace>(&[queries::V1_0]),
    codec::MessageInfo::of_query::<QueryDrive>(&[queries::V1_0]),
    codec::MessageInfo::of_query::<QueryEcho>(&[queries::V1_0]),
    codec::MessageInfo::of_query::<QueryCodes>(&[queries::V1_0]),
    codec::MessageInfo::of_query::<QueryMotion>(&[queries::V1_0]),
    codec::MessageInfo::of_query::<QueryCameras>(&[queries::V1_0]),
    codec::MessageInfo::of::<ReportPlace>(&[queries::V1_0]),
    codec::MessageInfo::of::<ReportDrive>(&[queries::V1_0]),
    codec::MessageInfo::of::<ReportSound>(&[queries::V1_0]),
    codec::MessageInfo::of::<ReportMotion>(&[queries::V1_0]),
    codec::MessageInfo::of::<ReportCameras>(&[queries::V1_0]),
    codec::MessageInfo::of::<ReportCodes>(&[queries::V1_0]),
];

/// The messages of services of version 1.0.
pub mod v1_0 {
    use super::codec;

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
        fn encoded_len(&self) -> usize { 3 }

        fn write(&self, output: &mut codec::Writer<'_>) -> Result<(), codec::EncodeError> {
            let run = output.run::<3>();
            codec::Fixed::put(<Self as codec::Message>::CODE, run, 0);
            codec::Fixed::put(self.presence_vector, run, 2);
            Ok(())
        }

        fn read(input: &mut codec::Reader<'_>) -> Result<Self, codec::DecodeError> {
            input.code(Self::CODE)?;
            let presence_vector = input.member("PresenceVector", codec::Reader::fixed)?;
            Ok(Self { presence_vector })
        }
    }

    codec::members!(QueryPlace { presence_vector: "PresenceVector" });

    impl codec::Query for QueryPlace { type Report = ReportPlace;

    fn drop_unrequested(&self, report: &mut ReportPlace) {
        codec::keep_if(self.presence_vector & 0x0001 != 0, &mut report.x);
        codec::keep_if(self.presence_vector & 0x0002 != 0, &mut report.self_);
        codec::keep_if(self.presence_vector & 0x0004 != 0, &mut report.time_stamp);
    }
}

codec::requests!(QueryPlace, new {
    /// Requests every optional field of [`ReportPlace`].
    fn(const) all => Self { presence_vector: 0x0007 };
    /// Requests no optional field of [`ReportPlace`] yet.
    fn(const) none => Self { presence_vector: 0x0000 };
} with {
    /// Also requests `X`, bit 0.
    with_x: presence_vector | 0x0001;
    /// Also requests `Self`, bit 1.
    with_self: presence_vector | 0x0002;
    /// Also requests `TimeStamp`, bit 2.
    with_time_stamp: presence_vector | 0x0004;
});

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
    fn encoded_len(&self) -> usize { 4 }

    fn write(&self, output: &mut codec::Writer<'_>) -> Result<(), codec::EncodeError> {
        let run = output.run::<4>();
        codec::Fixed::put(<Self as codec::Message>::CODE, run, 0);
        codec::Fixed::put(self.drive, run, 2);
        codec::Fixed::put(self.presence_vector, run, 3);
        Ok(())
    }

    fn read(input: &mut codec::Reader<'_>) -> Result<Self, codec::DecodeError> {
        input.code(Self::CODE)?;
        let run = input.run::<2>(&[("Drive", 1), ("PresenceVector", 1)])?;
        let drive = codec::Fixed::get(run, 0);
        let presence_vector = codec::Fixed::get(run, 1);
        Ok(Self { drive, presence_vector })
    }
}

codec::members!(QueryDrive { drive: "Drive", presence_vector: "PresenceVector" });

impl codec::Query for QueryDrive { type Report = ReportDrive;

fn drop_unrequested(&self, report: &mut ReportDrive) {
    codec::keep_if(self.presence_vector & 0x0001 != 0, &mut report.effort);
}
}

codec::requests!(QueryDrive, new {
    /// Requests every optional field of [`ReportDrive`].
    fn() all => Self { presence_vector: 0x0001, ..Self::default() };
    /// Requests no optional field of [`ReportDrive`] yet.
    fn() none => Self { presence_vector: 0x0000, ..Self::default() };
} with {
    /// Also requests `Effort`, bit 0.
    with_effort: presence_vector | 0x0001;
});

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
    fn encoded_len(&self) -> usize { 2 }

    fn write(&self, output: &mut codec::Writer<'_>) -> Result<(), codec::EncodeError> {
        output.fixed(<Self as codec::Message>::CODE);
        Ok(())
    }

    fn read(input: &mut codec::Reader<'_>) -> Result<Self, codec::DecodeError> {
        input.code(Self::CODE)?;
        Ok(Self)
    }
}

codec::members!(QueryEcho {});

impl codec::Query for QueryEcho { type Report = ReportSound; }

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
    fn encoded_len(&self) -> usize { 2 }

    fn write(&self, output: &mut codec::Writer<'_>) -> Result<(), codec::EncodeError> {
        output.fixed(<Self as codec::Message>::CODE);
        Ok(())
    }

    fn read(input: &mut codec::Reader<'_>) -> Result<Self, codec::DecodeError> {
        input.code(Self::CODE)?;
        Ok(Self)
    }
}

codec::members!(QueryCodes {});

impl codec::Query for QueryCodes { type Report = ReportCodes; }

/// `QueryMotion` (E0A5h).
///
/// Asks for some fields of two records.
///
/// Declared by `urn:example:Queries 1.0`.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct QueryMotion {
    /// `VelocityVarPresenceVector`.
    pub velocity_var_presence_vector: u8,
    /// `PosePresenceVector`.
    pub pose_presence_vector: u8,
}

impl codec::Message for QueryMotion {
    const CODE: u16 = 0xE0A5;
    const NAME: &'static str = "QueryMotion";
    fn encoded_len(&self) -> usize { 4 }

    fn write(&self, output: &mut codec::Writer<'_>) -> Result<(), codec::EncodeError> {
        let run = output.run::<4>();
        codec::Fixed::put(<Self as codec::Message>::CODE, run, 0);
        codec::Fixed::put(self.velocity_var_presence_vector, run, 2);
        codec::Fixed::put(self.pose_presence_vector, run, 3);
        Ok(())
    }

    fn read(input: &mut codec::Reader<'_>) -> Result<Self, codec::DecodeError> {
        input.code(Self::CODE)?;
        let run = input.run::<2>(&[("VelocityVarPresenceVector", 1), ("PosePresenceVector", 1)])?;
        let velocity_var_presence_vector = codec::Fixed::get(run, 0);
        let pose_presence_vector = codec::Fixed::get(run, 1);
        Ok(Self { velocity_var_presence_vector, pose_presence_vector })
    }
}

codec::members!(QueryMotion {
    velocity_var_presence_vector: "VelocityVarPresenceVector",
    pose_presence_vector: "PosePresenceVector",
});

impl codec::Query for QueryMotion { type Report = ReportMotion;

fn drop_unrequested(&self, report: &mut ReportMotion) {
    if let report_motion::VelocityVar::ForwardRec(value) = &mut report.velocity_var {
        codec::keep_if(self.velocity_var_presence_vector & 0x0001 != 0, &mut value.forward);
        codec::keep_if(self.velocity_var_presence_vector & 0x0002 != 0, &mut value.up);
    }
    if let report_motion::VelocityVar::NorthRec(value) = &mut report.velocity_var {
        codec::keep_if(self.velocity_var_presence_vector & 0x0001 != 0, &mut value.north);
        codec::keep_if(self.velocity_var_presence_vector & 0x0002 != 0, &mut value.up);
    }
    codec::keep_if(self.pose_presence_vector & 0x0001 != 0, &mut report.report_pose_rec.up);
    codec::keep_if(self.pose_presence_vector & 0x0002 != 0, &mut report.report_pose_rec.time_seconds);
    codec::keep_if(self.pose_presence_vector & 0x0004 != 0, &mut report.report_pose_rec.time_nano_seconds);
}
}

codec::requests!(QueryMotion, new {
    /// Requests every optional field of [`ReportMotion`].
    fn(const) all => Self { velocity_var_presence_vector: 0x0003, pose_presence_vector: 0x0007 };
    /// Requests no optional field of [`ReportMotion`] yet.
    fn(const) none => Self { velocity_var_presence_vector: 0x0000, pose_presence_vector: 0x0000 };
} with {
    /// Also requests `Forward` of `VelocityVar`, bit 0.
    with_velocity_var_forward: velocity_var_presence_vector | 0x0001;
    /// Also requests `Up` of `VelocityVar`, bit 1.
    with_velocity_var_up: velocity_var_presence_vector | 0x0002;
    /// Also requests `North` of `VelocityVar`, bit 0.
    with_velocity_var_north: velocity_var_presence_vector | 0x0001;
    /// Also requests `Up` of `Pose`, bit 0.
    with_pose_up: pose_presence_vector | 0x0001;
    /// Also requests `TimeSeconds` of `Pose`, bit 1.
    with_pose_time_seconds: pose_presence_vector | 0x0002;
    /// Also requests `TimeNanoSeconds` of `Pose`, bit 2.
    with_pose_time_nano_seconds: pose_presence_vector | 0x0004;
});

/// `QueryCameras` (E0A6h).
///
/// Asks for some fields of each camera.
///
/// Declared by `urn:example:Queries 1.0`.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct QueryCameras {
    /// `QueryCameraList`: up to 255 elements.
    pub query_camera_list: codec::List<query_cameras::QueryCameraRec>,
}

impl codec::Message for QueryCameras {
    const CODE: u16 = 0xE0A6;
    const NAME: &'static str = "QueryCameras";
    fn encoded_len(&self) -> usize {
        2 + 1 + 2 * self.query_camera_list.len()
    }

    fn write(&self, output: &mut codec::Writer<'_>) -> Result<(), codec::EncodeError> {
        output.fixed(<Self as codec::Message>::CODE);
        output.member("QueryCameraList", |output| output.list::<u8, _>(&self.query_camera_list, 0, 255, |value, output| { output.fixed(*value); Ok(()) }))?;
        Ok(())
    }

    fn read(input: &mut codec::Reader<'_>) -> Result<Self, codec::DecodeError> {
        input.code(Self::CODE)?;
        let query_camera_list = input.member("QueryCameraList", |input| input.list::<u8, _>(0, 255, 2, codec::Reader::fixed))?;
        Ok(Self { query_camera_list })
    }
}

codec::members!(QueryCameras is query_camera_list = |random| codec::arbitrary::list(random, 0, 255, codec::arbitrary::Arbitrary::arbitrary));

/// The types inside [`QueryCameras`].
pub mod query_cameras {
    use super::codec;

    /// `QueryCameraRec`.
    #[derive(Debug, Clone, Copy, Default, PartialEq)]
    pub struct QueryCameraRec {
        /// `Camera`.
        pub camera: u8,
        /// `QueryPresenceVector`.
        pub query_presence_vector: u8,
    }

    impl codec::Fixed for QueryCameraRec {
        const SIZE: usize = 2;

        #[inline]
        fn get(run: &[u8], at: usize) -> Self {
            Self {
                camera: codec::Fixed::get(run, at),
                query_presence_vector: codec::Fixed::get(run, at + 1),
            }
        }

        #[inline]
        fn put(self, run: &mut [u8], at: usize) {
            codec::Fixed::put(self.camera, run, at);
            codec::Fixed::put(self.query_presence_vector, run, at + 1);
        }
    }

    codec::members!(QueryCameraRec {
        camera: "Camera", query_presence_vector: "QueryPresenceVector",
    });
}

impl codec::Query for QueryCameras { type Report = ReportCameras;

fn drop_unrequested(&self, report: &mut ReportCameras) {
    for item in &mut report.camera_list {
        let mut requests = self.query_camera_list.iter();
        let Some(request) = requests.find(|it| it.camera == item.camera) else {
            continue;
        };
        codec::keep_if(request.query_presence_vector & 0x0001 != 0, &mut item.zoom);
    }
}
}

codec::requests!(query_cameras::QueryCameraRec, new {
    /// Requests every optional field of [`ReportCameras`].
    fn() all => Self { query_presence_vector: 0x0001, ..Self::default() };
    /// Requests no optional field of [`ReportCameras`] yet.
    fn() none => Self { query_presence_vector: 0x0000, ..Self::default() };
} with {
    /// Also requests `Zoom`, bit 0.
    with_zoom: query_presence_vector | 0x0001;
});

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
    fn encoded_len(&self) -> usize {
        4 + usize::from(self.x.is_some()) + usize::from(self.self_.is_some())
        + 4 * usize::from(self.time_stamp.is_some())
    }

    #[inline]
    fn write(&self, output: &mut codec::Writer<'_>) -> Result<(), codec::EncodeError> {
        if let Self { map, x: Some(x), self_: Some(self_), time_stamp: Some(time_stamp) } = self {
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
            let run = input.run::<7>(&[("Map", 1), ("X", 1), ("Self", 1), ("TimeStamp", 4)])?;
            return Ok(Self {
                map: codec::Fixed::get(run, 0), x: Some(codec::Fixed::get(run, 1)),
                self_: Some(codec::Fixed::get(run, 2)), time_stamp: Some(codec::Fixed::get(run, 3)),
            });
        }
        Self::read_some(input, present)
    }
}

impl ReportPlace {
    #[inline(never)]
    fn write_some(&self, output: &mut codec::Writer<'_>) {
        let present = u8::from(self.x.is_some()) | u8::from(self.self_.is_some()) << 1
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
        Ok(Self { map, x, self_, time_stamp })
    }
}

codec::members!(ReportPlace { map: "Map", x: "X", self_: "Self", time_stamp: "TimeStamp" });

/// The types inside [`ReportPlace`].
pub mod report_place {
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
}

impl codec::Report for ReportPlace {
    fn stamp(&mut self, since_1970: ::core::time::Duration) {
        if self.time_stamp.is_none() {
            self.time_stamp.get_or_insert_default().0 = codec::time_stamp(since_1970);
        }
    }
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
    fn encoded_len(&self) -> usize {
        4 + usize::from(self.effort.is_some())
    }

    #[inline]
    fn write(&self, output: &mut codec::Writer<'_>) -> Result<(), codec::EncodeError> {
        if let Self { drive, effort: Some(effort) } = self {
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
            let run = input.run::<2>(&[("Drive", 1), ("Effort", 1)])?;
            return Ok(Self {
                drive: codec::Fixed::get(run, 0), effort: Some(codec::Fixed::get(run, 1)),
            });
        }
        Self::read_some(input, present)
    }
}

impl ReportDrive {
    #[inline(never)]
    fn write_some(&self, output: &mut codec::Writer<'_>) {
        let present = u8::from(self.effort.is_some());
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
        Ok(Self { drive, effort })
    }
}

codec::members!(ReportDrive { drive: "Drive", effort: "Effort" });

impl codec::Report for ReportDrive {}

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
    fn encoded_len(&self) -> usize { 2 }

    fn write(&self, output: &mut codec::Writer<'_>) -> Result<(), codec::EncodeError> {
        output.fixed(<Self as codec::Message>::CODE);
        Ok(())
    }

    fn read(input: &mut codec::Reader<'_>) -> Result<Self, codec::DecodeError> {
        input.code(Self::CODE)?;
        Ok(Self)
    }
}

codec::members!(ReportSound {});

impl codec::Report for ReportSound {
    fn without_values() -> Option<Self> {
        Some(Self)
    }
}

/// `ReportMotion` (F0A5h).
///
/// Its optional fields are in records.
///
/// Declared by `urn:example:Queries 1.0`.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ReportMotion {
    /// `VelocityVar`.
    pub velocity_var: report_motion::VelocityVar,
    /// `ReportPoseRec`.
    pub report_pose_rec: report_motion::ReportPoseRec,
}

impl codec::Message for ReportMotion {
    const CODE: u16 = 0xF0A5;
    const NAME: &'static str = "ReportMotion";
    fn encoded_len(&self) -> usize {
        2 + codec::Composite::encoded_len(&self.velocity_var)
        + codec::Composite::encoded_len(&self.report_pose_rec)
    }

    fn write(&self, output: &mut codec::Writer<'_>) -> Result<(), codec::EncodeError> {
        output.fixed(<Self as codec::Message>::CODE);
        output.member("VelocityVar", |output| codec::Composite::write(&self.velocity_var, output))?;
        output.member("ReportPoseRec", |output| codec::Composite::write(&self.report_pose_rec, output))?;
        Ok(())
    }

    fn read(input: &mut codec::Reader<'_>) -> Result<Self, codec::DecodeError> {
        input.code(Self::CODE)?;
        let velocity_var = input.member("VelocityVar", codec::Composite::read)?;
        let report_pose_rec = input.member("ReportPoseRec", codec::Composite::read)?;
        Ok(Self { velocity_var, report_pose_rec })
    }
}

codec::members!(ReportMotion { velocity_var: "VelocityVar", report_pose_rec: "ReportPoseRec" });

/// The types inside [`ReportMotion`].
pub mod report_motion {
    use super::codec;

    /// `ForwardRec`.
    #[derive(Debug, Clone, Default, PartialEq)]
    pub struct ForwardRec {
        /// `Forward`: bit 0 of the presence vector.
        pub forward: Option<u8>,
        /// `Up`: bit 1 of the presence vector.
        pub up: Option<u8>,
    }

    impl codec::Composite for ForwardRec {
        const MIN_LEN: usize = 1;
        fn encoded_len(&self) -> usize {
            1 + usize::from(self.forward.is_some()) + usize::from(self.up.is_some())
        }

        #[inline]
        fn write(&self, output: &mut codec::Writer<'_>) -> Result<(), codec::EncodeError> {
            if let Self { forward: Some(forward), up: Some(up) } = self {
                let run = output.run::<3>();
                codec::Fixed::put(0x3_u8, run, 0);
                codec::Fixed::put(*forward, run, 1);
                codec::Fixed::put(*up, run, 2);
                return Ok(());
            }
            self.write_some(output);
            Ok(())
        }

        #[inline]
        fn read(input: &mut codec::Reader<'_>) -> Result<Self, codec::DecodeError> {
            let present = input.presence::<u8>(0x3)?;
            if present == 0x3 {
                let run = input.run::<2>(&[("Forward", 1), ("Up", 1)])?;
                return Ok(Self {
                    forward: Some(codec::Fixed::get(run, 0)), up: Some(codec::Fixed::get(run, 1)),
                });
            }
            Self::read_some(input, present)
        }
    }

    impl ForwardRec {
        #[inline(never)]
        fn write_some(&self, output: &mut codec::Writer<'_>) {
            let present = u8::from(self.forward.is_some()) | u8::from(self.up.is_some()) << 1;
            output.fixed(present);
            output.optional(self.forward);
            output.optional(self.up);
        }

        #[inline(never)]
        fn read_some(place: &mut codec::Reader<'_>, present: u64) -> Result<Self, codec::DecodeError> {
            let mut input = place.clone();
            let forward = input.optional(present & 0x1 != 0, "Forward", codec::Reader::fixed)?;
            let up = input.optional(present & 0x2 != 0, "Up", codec::Reader::fixed)?;
            *place = input;
            Ok(Self { forward, up })
        }
    }

    codec::members!(ForwardRec { forward: "Forward", up: "Up" });

    /// `NorthRec`.
    #[derive(Debug, Clone, Default, PartialEq)]
    pub struct NorthRec {
        /// `North`: bit 0 of the presence vector.
        pub north: Option<u8>,
        /// `Up`: bit 1 of the presence vector.
        pub up: Option<u8>,
    }

    impl codec::Composite for NorthRec {
        const MIN_LEN: usize = 1;
        fn encoded_len(&self) -> usize {
            1 + usize::from(self.north.is_some()) + usize::from(self.up.is_some())
        }

        #[inline]
        fn write(&self, output: &mut codec::Writer<'_>) -> Result<(), codec::EncodeError> {
            if let Self { north: Some(north), up: Some(up) } = self {
                let run = output.run::<3>();
                codec::Fixed::put(0x3_u8, run, 0);
                codec::Fixed::put(*north, run, 1);
                codec::Fixed::put(*up, run, 2);
                return Ok(());
            }
            self.write_some(output);
            Ok(())
        }

        #[inline]
        fn read(input: &mut codec::Reader<'_>) -> Result<Self, codec::DecodeError> {
            let present = input.presence::<u8>(0x3)?;
            if present == 0x3 {
                let run = input.run::<2>(&[("North", 1), ("Up", 1)])?;
                return Ok(Self {
                    north: Some(codec::Fixed::get(run, 0)), up: Some(codec::Fixed::get(run, 1)),
                });
            }
            Self::read_some(input, present)
        }
    }

    impl NorthRec {
        #[inline(never)]
        fn write_some(&self, output: &mut codec::Writer<'_>) {
            let present = u8::from(self.north.is_some()) | u8::from(self.up.is_some()) << 1;
            output.fixed(present);
            output.optional(self.north);
            output.optional(self.up);
        }

        #[inline(never)]
        fn read_some(place: &mut codec::Reader<'_>, present: u64) -> Result<Self, codec::DecodeError> {
            let mut input = place.clone();
            let north = input.optional(present & 0x1 != 0, "North", codec::Reader::fixed)?;
            let up = input.optional(present & 0x2 != 0, "Up", codec::Reader::fixed)?;
            *place = input;
            Ok(Self { north, up })
        }
    }

    codec::members!(NorthRec { north: "North", up: "Up" });

    /// `VelocityVar`: one of its alternatives.
    #[derive(Debug, Clone, PartialEq)]
    pub enum VelocityVar {
        /// `ForwardRec`.
        ForwardRec(ForwardRec),
        /// `NorthRec`.
        NorthRec(NorthRec),
    }

    impl Default for VelocityVar {
        fn default() -> Self {
            Self::ForwardRec(Default::default())
        }
    }

    impl codec::Composite for VelocityVar {
        const MIN_LEN: usize = 2;

        fn encoded_len(&self) -> usize {
            match self {
                Self::ForwardRec(value) => 1 + codec::Composite::encoded_len(value),
                Self::NorthRec(value) => 1 + codec::Composite::encoded_len(value),
            }
        }

        fn write(&self, output: &mut codec::Writer<'_>) -> Result<(), codec::EncodeError> {
            match self {
                Self::ForwardRec(value) => {
                    output.fixed(0_u8);
                    output.member("ForwardRec", |output| codec::Composite::write(value, output))
                }
                Self::NorthRec(value) => {
                    output.fixed(1_u8);
                    output.member("NorthRec", |output| codec::Composite::write(value, output))
                }
            }
        }

        fn read(input: &mut codec::Reader<'_>) -> Result<Self, codec::DecodeError> {
            match input.tag::<u8>(2)? {
                0 => input.member("ForwardRec", codec::Composite::read).map(Self::ForwardRec),
                _ => input.member("NorthRec", codec::Composite::read).map(Self::NorthRec),
            }
        }
    }

    codec::alternatives!(VelocityVar { ForwardRec: "ForwardRec", NorthRec: "NorthRec" });

    /// `ReportPoseRec`.
    #[derive(Debug, Clone, Default, PartialEq)]
    pub struct ReportPoseRec {
        /// `Up`: bit 0 of the presence vector.
        pub up: Option<u8>,
        /// `TimeSeconds`: bit 1 of the presence vector.
        pub time_seconds: Option<u32>,
        /// `TimeNanoSeconds`: bit 2 of the presence vector.
        pub time_nano_seconds: Option<u32>,
    }

    impl codec::Composite for ReportPoseRec {
        const MIN_LEN: usize = 1;
        fn encoded_len(&self) -> usize {
            1 + usize::from(self.up.is_some()) + 4 * usize::from(self.time_seconds.is_some())
            + 4 * usize::from(self.time_nano_seconds.is_some())
        }

        #[inline]
        fn write(&self, output: &mut codec::Writer<'_>) -> Result<(), codec::EncodeError> {
            if let Self {
                up: Some(up), time_seconds: Some(time_seconds),
                time_nano_seconds: Some(time_nano_seconds),
            } = self {
                let run = output.run::<10>();
                codec::Fixed::put(0x7_u8, run, 0);
                codec::Fixed::put(*up, run, 1);
                codec::Fixed::put(*time_seconds, run, 2);
                codec::Fixed::put(*time_nano_seconds, run, 6);
                return Ok(());
            }
            self.write_some(output);
            Ok(())
        }

        #[inline]
        fn read(input: &mut codec::Reader<'_>) -> Result<Self, codec::DecodeError> {
            let present = input.presence::<u8>(0x7)?;
            if present == 0x7 {
                let run = input.run::<9>(&[("Up", 1), ("TimeSeconds", 4), ("TimeNanoSeconds", 4)])?;
                return Ok(Self {
                    up: Some(codec::Fixed::get(run, 0)),
                    time_seconds: Some(codec::Fixed::get(run, 1)),
                    time_nano_seconds: Some(codec::Fixed::get(run, 5)),
                });
            }
            Self::read_some(input, present)
        }
    }

    impl ReportPoseRec {
        #[inline(never)]
        fn write_some(&self, output: &mut codec::Writer<'_>) {
            let present = u8::from(self.up.is_some()) | u8::from(self.time_seconds.is_some()) << 1
            | u8::from(self.time_nano_seconds.is_some()) << 2;
            output.fixed(present);
            output.optional(self.up);
            output.optional(self.time_seconds);
            output.optional(self.time_nano_seconds);
        }

        #[inline(never)]
        fn read_some(place: &mut codec::Reader<'_>, present: u64) -> Result<Self, codec::DecodeError> {
            let mut input = place.clone();
            let up = input.optional(present & 0x1 != 0, "Up", codec::Reader::fixed)?;
            let time_seconds = input.optional(present & 0x2 != 0, "TimeSeconds", codec::Reader::fixed)?;
            let time_nano_seconds = input.optional(present & 0x4 != 0, "TimeNanoSeconds", codec::Reader::fixed)?;
            *place = input;
            Ok(Self { up, time_seconds, time_nano_seconds })
        }
    }

    codec::members!(ReportPoseRec {
        up: "Up", time_seconds: "TimeSeconds", time_nano_seconds: "TimeNanoSeconds",
    });
}

impl codec::Report for ReportMotion {
    fn stamp(&mut self, since_1970: ::core::time::Duration) {
        if self.report_pose_rec.time_seconds.is_none() && self.report_pose_rec.time_nano_seconds.is_none() {
            self.report_pose_rec.time_seconds = u32::try_from(since_1970.as_secs()).ok();
            self.report_pose_rec.time_nano_seconds = Some(since_1970.subsec_nanos());
        }
    }
}

/// `ReportCameras` (F0A6h).
///
/// Its optional fields are in the elements of a list.
///
/// Declared by `urn:example:Queries 1.0`.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ReportCameras {
    /// `CameraList`: up to 255 elements.
    pub camera_list: codec::List<report_cameras::CameraRec>,
}

impl codec::Message for ReportCameras {
    const CODE: u16 = 0xF0A6;
    const NAME: &'static str = "ReportCameras";
    fn encoded_len(&self) -> usize {
        2 + 1 + self.camera_list.iter().map(codec::Composite::encoded_len).sum::<usize>()
    }

    fn write(&self, output: &mut codec::Writer<'_>) -> Result<(), codec::EncodeError> {
        output.fixed(<Self as codec::Message>::CODE);
        output.member("CameraList", |output| output.list::<u8, _>(&self.camera_list, 0, 255, |value, output| codec::Composite::write(value, output)))?;
        Ok(())
    }

    fn read(input: &mut codec::Reader<'_>) -> Result<Self, codec::DecodeError> {
        input.code(Self::CODE)?;
        let camera_list = input.member("CameraList", |input| input.list::<u8, _>(0, 255, 2, codec::Composite::read))?;
        Ok(Self { camera_list })
    }
}

codec::members!(ReportCameras is camera_list = |random| codec::arbitrary::list(random, 0, 255, codec::arbitrary::Arbitrary::arbitrary));

/// The types inside [`ReportCameras`].
pub mod report_cameras {
    use super::codec;

    /// `CameraRec`.
    #[derive(Debug, Clone, Default, PartialEq)]
    pub struct CameraRec {
        /// `Camera`.
        pub camera: u8,
        /// `Zoom`: bit 0 of the presence vector.
        pub zoom: Option<u8>,
    }

    impl codec::Composite for CameraRec {
        const MIN_LEN: usize = 2;
        fn encoded_len(&self) -> usize {
            2 + usize::from(self.zoom.is_some())
        }

        #[inline]
        fn write(&self, output: &mut codec::Writer<'_>) -> Result<(), codec::EncodeError> {
            if let Self { camera, zoom: Some(zoom) } = self {
                let run = output.run::<3>();
                codec::Fixed::put(0x1_u8, run, 0);
                codec::Fixed::put(*camera, run, 1);
                codec::Fixed::put(*zoom, run, 2);
                return Ok(());
            }
            self.write_some(output);
            Ok(())
        }

        #[inline]
        fn read(input: &mut codec::Reader<'_>) -> Result<Self, codec::DecodeError> {
            let present = input.presence::<u8>(0x1)?;
            if present == 0x1 {
                let run = input.run::<2>(&[("Camera", 1), ("Zoom", 1)])?;
                return Ok(Self {
                    camera: codec::Fixed::get(run, 0), zoom: Some(codec::Fixed::get(run, 1)),
                });
            }
            Self::read_some(input, present)
        }
    }

    impl CameraRec {
        #[inline(never)]
        fn write_some(&self, output: &mut codec::Writer<'_>) {
            let present = u8::from(self.zoom.is_some());
            let run = output.run::<2>();
            codec::Fixed::put(present, run, 0);
            codec::Fixed::put(self.camera, run, 1);
            output.optional(self.zoom);
        }

        #[inline(never)]
        fn read_some(place: &mut codec::Reader<'_>, present: u64) -> Result<Self, codec::DecodeError> {
            let mut input = place.clone();
            let camera = input.member("Camera", codec::Reader::fixed)?;
            let zoom = input.optional(present & 0x1 != 0, "Zoom", codec::Reader::fixed)?;
            *place = input;
            Ok(Self { camera, zoom })
        }
    }

    codec::members!(CameraRec { camera: "Camera", zoom: "Zoom" });
}

impl codec::Report for ReportCameras {
    fn without_values() -> Option<Self> {
        Some(Self::default())
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
    fn encoded_len(&self) -> usize { 2 }

    fn write(&self, output: &mut codec::Writer<'_>) -> Result<(), codec::EncodeError> {
        output.fixed(<Self as codec::Message>::CODE);
        Ok(())
    }

    fn read(input: &mut codec::Reader<'_>) -> Result<Self, codec::DecodeError> {
        input.code(Self::CODE)?;
        Ok(Self)
    }
}

codec::members!(ReportCodes {});

impl codec::Report for ReportCodes {
    fn without_values() -> Option<Self> {
        Some(Self)
    }
}
}

#[doc(inline)]
#[allow(unused_imports)]
pub use v1_0::{
    QueryPlace, QueryDrive, QueryEcho, QueryCodes, QueryMotion, QueryCameras, query_cameras,
    ReportPlace, report_place, ReportDrive, ReportSound, ReportMotion, report_motion, ReportCameras,
    report_cameras, ReportCodes,
};
