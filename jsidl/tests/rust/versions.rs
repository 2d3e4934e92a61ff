use ::jaus::codec;

/// The service `Versions`.
///
/// Version 1.1 of the service.
pub mod versions {
    use super::codec;

    /// What the service is called, whatever its version.
    pub const URN: &str = "urn:example:Versions";

    /// Version 1.1.
    pub const V1_1: codec::ServiceId = codec::ServiceId {
        urn: URN,
        major: 1,
        minor: 1,
    };

    /// Version 1.0.
    pub const V1_0: codec::ServiceId = codec::ServiceId {
        urn: URN,
        major: 1,
        minor: 0,
    };

    /// The newest version.
    pub const LATEST: codec::ServiceId = V1_1;

    /// The service, as an application implements it. `C` is the type of a call.
    pub trait Service<C> {
        /// Handles `ReportState`.
        fn report_state(&mut self, message: super::ReportState, call: &mut C);

        /// Handles `ReportMode`.
        fn report_mode(&mut self, message: super::ReportMode, call: &mut C);

        /// Handles `QueryState`.
        fn query_state(&mut self, message: super::QueryState, call: &mut C);

        /// Handles `QueryMode`.
        fn query_mode(&mut self, message: super::QueryMode, call: &mut C);
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
            codec::List::from([V1_1])
        }

        fn receive(&mut self, code: u16, call: &mut C) -> Option<Result<(), codec::DecodeError>> {
            Some(match code {
                0xF081 => call.receive(|message: super::ReportState, call| self.service.report_state(message, call)),
                0xF082 => call.receive(|message: super::ReportMode, call| self.service.report_mode(message, call)),
                0xE081 => call.receive(|message: super::QueryState, call| self.service.query_state(message, call)),
                0xE082 => call.receive(|message: super::QueryMode, call| self.service.query_mode(message, call)),
                _ => return None,
            })
        }
    }
}

/// The services of the set, by URN and version.
pub static SERVICES: &[codec::ServiceInfo] = &[
    codec::ServiceInfo {
        name: "Versions", id: versions::V1_0, inherits_from: None,
        inputs: &[0xF081, 0xF082, 0xE081, 0xE082], outputs: &[],
    },
    codec::ServiceInfo {
        name: "Versions", id: versions::V1_1, inherits_from: None,
        inputs: &[0xF081, 0xF082, 0xE081, 0xE082], outputs: &[],
    },
];

/// The message types of the set, by code; of several with one code the newest first.
pub static MESSAGES: &[codec::MessageInfo] = &[
    codec::MessageInfo::of::<QueryState>(&[versions::V1_1]),
    codec::MessageInfo::of::<v1_0::QueryState>(&[versions::V1_0]),
    codec::MessageInfo::of::<QueryMode>(&[versions::V1_1, versions::V1_0]),
    codec::MessageInfo::of::<ReportState>(&[versions::V1_1]),
    codec::MessageInfo::of::<v1_0::ReportState>(&[versions::V1_0]),
    codec::MessageInfo::of::<ReportMode>(&[versions::V1_1, versions::V1_0]),
];

/// The messages of services of version 1.0.
pub mod v1_0 {
    use super::codec;

    /// `QueryState` (E081h).
    ///
    /// Asks for the state.
    ///
    /// Declared by `urn:example:Versions 1.0`.
    #[derive(Debug, Clone, Default, PartialEq)]
    pub struct QueryState;

    impl codec::Message for QueryState {
        const CODE: u16 = 0xE081;
        const NAME: &'static str = "QueryState";
        const OTHER_LAYOUTS: &'static [codec::ServiceId] = &[super::versions::V1_1];
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

    codec::members!(QueryState {});

    /// `QueryMode` (E082h).
    ///
    /// Asks for the mode.
    ///
    /// Declared by `urn:example:Versions 1.1`, `urn:example:Versions 1.0`.
    #[derive(Debug, Clone, Default, PartialEq)]
    pub struct QueryMode;

    impl codec::Message for QueryMode {
        const CODE: u16 = 0xE082;
        const NAME: &'static str = "QueryMode";
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

    codec::members!(QueryMode {});

    /// `ReportState` (F081h).
    ///
    /// The state.
    ///
    /// Declared by `urn:example:Versions 1.0`.
    #[derive(Debug, Clone, Default, PartialEq)]
    pub struct ReportState {
        /// `Speed`: meter per second, 0 to 327.67.
        pub speed: report_state::Speed,
        /// `Mode`.
        pub mode: report_state::Mode,
    }

    codec::accessors!(ReportState {
        speed: report_state::Speed => speed_m_per_s, set_speed_m_per_s, with_speed_m_per_s, "`Speed` in meter per second", "0 to 327.67";
    });

    impl codec::Message for ReportState {
        const CODE: u16 = 0xF081;
        const NAME: &'static str = "ReportState";
        const OTHER_LAYOUTS: &'static [codec::ServiceId] = &[super::versions::V1_1];
        fn encoded_len(&self) -> usize { 5 }

        fn write(&self, output: &mut codec::Writer<'_>) -> Result<(), codec::EncodeError> {
            let run = output.run::<5>();
            codec::Fixed::put(<Self as codec::Message>::CODE, run, 0);
            codec::Fixed::put(self.speed, run, 2);
            codec::Fixed::put(self.mode, run, 4);
            Ok(())
        }

        fn read(input: &mut codec::Reader<'_>) -> Result<Self, codec::DecodeError> {
            input.code(Self::CODE)?;
            let run = input.run::<3>(&[("Speed", 2), ("Mode", 1)])?;
            let speed = codec::Fixed::get(run, 0);
            let mode = codec::Fixed::get(run, 2);
            Ok(Self { speed, mode })
        }
    }

    codec::members!(ReportState { speed: "Speed", mode: "Mode" });

    /// The types inside [`ReportState`].
    pub mod report_state {
        use super::codec;

        /// `Speed` in meter per second: 0 to 327.67 in steps of 5.000e-3, carried as `u16`.
        #[derive(Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
        pub struct Speed(u16);

        codec::scaled!(Speed(u16), "Speed", 0.0_f64 to 327.67_f64 "meter per second", Round);

        /// `Mode`: a number with named values. Others are kept as they come.
        #[derive(Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
        pub struct Mode(pub u8);

        impl Mode {
            /// `Off` = 0.
            pub const OFF: Self = Self(0);
        }

        codec::enumeration!(Mode(u8), [(0, "Off")]);
    }

    /// `ReportMode` (F082h).
    ///
    /// The mode; only names were added.
    ///
    /// Declared by `urn:example:Versions 1.1`, `urn:example:Versions 1.0`.
    #[derive(Debug, Clone, Default, PartialEq)]
    pub struct ReportMode {
        /// `Mode`.
        pub mode: report_mode::Mode,
    }

    impl codec::Message for ReportMode {
        const CODE: u16 = 0xF082;
        const NAME: &'static str = "ReportMode";
        fn encoded_len(&self) -> usize { 3 }

        fn write(&self, output: &mut codec::Writer<'_>) -> Result<(), codec::EncodeError> {
            let run = output.run::<3>();
            codec::Fixed::put(<Self as codec::Message>::CODE, run, 0);
            codec::Fixed::put(self.mode, run, 2);
            Ok(())
        }

        fn read(input: &mut codec::Reader<'_>) -> Result<Self, codec::DecodeError> {
            input.code(Self::CODE)?;
            let mode = input.member("Mode", codec::Reader::fixed)?;
            Ok(Self { mode })
        }
    }

    codec::members!(ReportMode { mode: "Mode" });

    /// The types inside [`ReportMode`].
    pub mod report_mode {
        use super::codec;

        /// `Mode`: a number with named values. Others are kept as they come.
        #[derive(Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
        pub struct Mode(pub u8);

        impl Mode {
            /// `Off` = 0.
            pub const OFF: Self = Self(0);
            /// `On` = 1.
            pub const ON: Self = Self(1);
        }

        codec::enumeration!(Mode(u8), [(0, "Off"), (1, "On")]);
    }
}

/// The messages of services of version 1.1.
pub mod v1_1 {
    use super::codec;

    #[doc(inline)]
    #[allow(unused_imports)]
    pub use super::v1_0::{QueryMode, ReportMode, report_mode};

    /// `QueryState` (E081h).
    ///
    /// Asks for the state.
    ///
    /// Declared by `urn:example:Versions 1.1`.
    #[derive(Debug, Clone, Default, PartialEq)]
    pub struct QueryState {
        /// `Detail`.
        pub detail: u8,
    }

    impl codec::Message for QueryState {
        const CODE: u16 = 0xE081;
        const NAME: &'static str = "QueryState";
        const OTHER_LAYOUTS: &'static [codec::ServiceId] = &[super::versions::V1_0];
        fn encoded_len(&self) -> usize { 3 }

        fn write(&self, output: &mut codec::Writer<'_>) -> Result<(), codec::EncodeError> {
            let run = output.run::<3>();
            codec::Fixed::put(<Self as codec::Message>::CODE, run, 0);
            codec::Fixed::put(self.detail, run, 2);
            Ok(())
        }

        fn read(input: &mut codec::Reader<'_>) -> Result<Self, codec::DecodeError> {
            input.code(Self::CODE)?;
            let detail = input.member("Detail", codec::Reader::fixed)?;
            Ok(Self { detail })
        }
    }

    codec::members!(QueryState { detail: "Detail" });

    /// `ReportState` (F081h).
    ///
    /// The state, finer.
    ///
    /// Declared by `urn:example:Versions 1.1`.
    #[derive(Debug, Clone, Default, PartialEq)]
    pub struct ReportState {
        /// `Speed`: meter per second, 0 to 327.67.
        pub speed: report_state::Speed,
        /// `Mode`.
        pub mode: report_state::Mode,
    }

    codec::accessors!(ReportState {
        speed: report_state::Speed => speed_m_per_s, set_speed_m_per_s, with_speed_m_per_s, "`Speed` in meter per second", "0 to 327.67";
    });

    impl codec::Message for ReportState {
        const CODE: u16 = 0xF081;
        const NAME: &'static str = "ReportState";
        const OTHER_LAYOUTS: &'static [codec::ServiceId] = &[super::versions::V1_0];
        fn encoded_len(&self) -> usize { 7 }

        fn write(&self, output: &mut codec::Writer<'_>) -> Result<(), codec::EncodeError> {
            let run = output.run::<7>();
            codec::Fixed::put(<Self as codec::Message>::CODE, run, 0);
            codec::Fixed::put(self.speed, run, 2);
            codec::Fixed::put(self.mode, run, 6);
            Ok(())
        }

        fn read(input: &mut codec::Reader<'_>) -> Result<Self, codec::DecodeError> {
            input.code(Self::CODE)?;
            let run = input.run::<5>(&[("Speed", 4), ("Mode", 1)])?;
            let speed = codec::Fixed::get(run, 0);
            let mode = codec::Fixed::get(run, 4);
            Ok(Self { speed, mode })
        }
    }

    codec::members!(ReportState { speed: "Speed", mode: "Mode" });

    /// The types inside [`ReportState`].
    pub mod report_state {
        use super::codec;
        #[doc(inline)]
        #[allow(unused_imports)]
        pub use super::super::v1_0::report_mode::Mode;

        /// `Speed` in meter per second: 0 to 327.67 in steps of 7.629e-8, carried as `u32`.
        #[derive(Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
        pub struct Speed(u32);

        codec::scaled!(Speed(u32), "Speed", 0.0_f64 to 327.67_f64 "meter per second", Round);
    }
}

#[doc(inline)]
#[allow(unused_imports)]
pub use v1_0::{QueryMode, ReportMode, report_mode};

#[doc(inline)]
#[allow(unused_imports)]
pub use v1_1::{QueryState, ReportState, report_state};
