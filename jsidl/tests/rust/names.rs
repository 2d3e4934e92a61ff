use ::jaus::codec;

/// The service `Option`.
///
/// Names that Rust reserves, and names that collide.
pub mod option {
    use super::codec;

    /// What the service is called, whatever its version.
    pub const URN: &str = "urn:example:Option";

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
        /// Handles `Option`.
        fn option(&mut self, message: super::Option_, call: &mut C);

        /// Handles `Result`.
        fn result(&mut self, message: super::Result_, call: &mut C);

        /// Handles `Vec`.
        fn vec(&mut self, message: super::Vec_, call: &mut C);

        /// Handles `codec`.
        fn codec(&mut self, message: super::Codec, call: &mut C);

        /// Handles `move`.
        fn r#move(&mut self, message: super::Move, call: &mut C);

        /// Handles `Move`.
        fn move_2(&mut self, message: super::Move2, call: &mut C);

        /// Handles `ReportSame`.
        fn report_same(&mut self, message: super::ReportSame, call: &mut C);

        /// Handles `SameRecAgain`.
        fn same_rec_again(&mut self, message: super::SameRecAgain, call: &mut C);
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
                0xF061 => call.receive(|message: super::Option_, call| self.service.option(message, call)),
                0xF062 => call.receive(|message: super::Result_, call| self.service.result(message, call)),
                0xF063 => call.receive(|message: super::Vec_, call| self.service.vec(message, call)),
                0xF064 => call.receive(|message: super::Codec, call| self.service.codec(message, call)),
                0xF065 => call.receive(|message: super::Move, call| self.service.r#move(message, call)),
                0xF066 => call.receive(|message: super::Move2, call| self.service.move_2(message, call)),
                0xF067 => call.receive(|message: super::ReportSame, call| self.service.report_same(message, call)),
                0xF068 => call.receive(|message: super::SameRecAgain, call| self.service.same_rec_again(message, call)),
                _ => return None,
            })
        }
    }
}

/// The services of the set, by URN and version.
pub static SERVICES: &[codec::ServiceInfo] = &[
    codec::ServiceInfo {
        name: "Option", id: option::V1_0, inherits_from: None,
        inputs: &[0xF061, 0xF062, 0xF063, 0xF064, 0xF065, 0xF066, 0xF067, 0xF068], outputs: &[],
    },
];

/// The message types of the set, by code; of several with one code the newest first.
pub static MESSAGES: &[codec::MessageInfo] = &[
    codec::MessageInfo::of::<Option_>(&[option::V1_0]),
    codec::MessageInfo::of::<Result_>(&[option::V1_0]),
    codec::MessageInfo::of::<Vec_>(&[option::V1_0]),
    codec::MessageInfo::of::<Codec>(&[option::V1_0]),
    codec::MessageInfo::of::<Move>(&[option::V1_0]),
    codec::MessageInfo::of::<Move2>(&[option::V1_0]),
    codec::MessageInfo::of::<ReportSame>(&[option::V1_0]),
    codec::MessageInfo::of::<SameRecAgain>(&[option::V1_0]),
];

/// The messages of services of version 1.0.
pub mod v1_0 {
    use super::codec;

    /// `Option` (F061h).
    ///
    /// Named like what Rust uses itself.
    ///
    /// Declared by `urn:example:Option 1.0`.
    #[derive(Debug, Clone, Default, PartialEq)]
    pub struct Option_ {
        /// `type`.
        pub r#type: u8,
        /// `self`.
        pub self_: u8,
        /// `Self`: meter, 0 to 1.
        pub self_2: option::Self_,
        /// `super`.
        pub super_: option::Super,
        /// `input`.
        pub input: u16,
        /// `output`.
        pub output: u16,
        /// `run`.
        pub run: u16,
        /// `present`: bit 0 of the presence vector.
        pub present: Option<u16>,
        /// `value`: bit 1 of the presence vector.
        pub value: Option<u16>,
    }

    codec::accessors!(Option_ {
        self_2: option::Self_ => self_m, set_self_m, with_self_m, "`Self` in meter", "0 to 1";
    });

    impl codec::Message for Option_ {
        const CODE: u16 = 0xF061;
        const NAME: &'static str = "Option";
        fn encoded_len(&self) -> usize {
            13 + 2 * usize::from(self.present.is_some()) + 2 * usize::from(self.value.is_some())
        }

        #[inline]
        fn write(&self, output: &mut codec::Writer<'_>) -> Result<(), codec::EncodeError> {
            if let Self {
                r#type, self_, self_2, super_, input, output: output_, run: run_,
                present: Some(present), value: Some(value),
            } = self {
                let run = output.run::<17>();
                codec::Fixed::put(<Self as codec::Message>::CODE, run, 0);
                codec::Fixed::put(0x3_u8, run, 2);
                codec::Fixed::put(*r#type, run, 3);
                codec::Fixed::put(*self_, run, 4);
                codec::Fixed::put(*self_2, run, 5);
                codec::Fixed::put(*super_, run, 6);
                codec::Fixed::put(*input, run, 7);
                codec::Fixed::put(*output_, run, 9);
                codec::Fixed::put(*run_, run, 11);
                codec::Fixed::put(*present, run, 13);
                codec::Fixed::put(*value, run, 15);
                return Ok(());
            }
            self.write_some(output);
            Ok(())
        }

        #[inline]
        fn read(input_: &mut codec::Reader<'_>) -> Result<Self, codec::DecodeError> {
            input_.code(Self::CODE)?;
            let present_ = input_.presence::<u8>(0x3)?;
            if present_ == 0x3 {
                let run_ = input_.run::<14>(&[
                    ("type", 1), ("self", 1), ("Self", 1), ("super", 1), ("input", 2),
                    ("output", 2), ("run", 2), ("present", 2), ("value", 2),
                ])?;
                return Ok(Self {
                    r#type: codec::Fixed::get(run_, 0), self_: codec::Fixed::get(run_, 1),
                    self_2: codec::Fixed::get(run_, 2), super_: codec::Fixed::get(run_, 3),
                    input: codec::Fixed::get(run_, 4), output: codec::Fixed::get(run_, 6),
                    run: codec::Fixed::get(run_, 8), present: Some(codec::Fixed::get(run_, 10)),
                    value: Some(codec::Fixed::get(run_, 12)),
                });
            }
            Self::read_some(input_, present_)
        }
    }

    impl Option_ {
        #[inline(never)]
        fn write_some(&self, output: &mut codec::Writer<'_>) {
            let present = u8::from(self.present.is_some()) | u8::from(self.value.is_some()) << 1;
            let run = output.run::<13>();
            codec::Fixed::put(<Self as codec::Message>::CODE, run, 0);
            codec::Fixed::put(present, run, 2);
            codec::Fixed::put(self.r#type, run, 3);
            codec::Fixed::put(self.self_, run, 4);
            codec::Fixed::put(self.self_2, run, 5);
            codec::Fixed::put(self.super_, run, 6);
            codec::Fixed::put(self.input, run, 7);
            codec::Fixed::put(self.output, run, 9);
            codec::Fixed::put(self.run, run, 11);
            output.optional(self.present);
            output.optional(self.value);
        }

        #[inline(never)]
        fn read_some(place: &mut codec::Reader<'_>, present_: u64) -> Result<Self, codec::DecodeError> {
            let mut input_ = place.clone();
            let run_ = input_.run::<10>(&[
                ("type", 1), ("self", 1), ("Self", 1), ("super", 1), ("input", 2), ("output", 2),
                ("run", 2),
            ])?;
            let r#type = codec::Fixed::get(run_, 0);
            let self_ = codec::Fixed::get(run_, 1);
            let self_2 = codec::Fixed::get(run_, 2);
            let super_ = codec::Fixed::get(run_, 3);
            let input = codec::Fixed::get(run_, 4);
            let output = codec::Fixed::get(run_, 6);
            let run = codec::Fixed::get(run_, 8);
            let present = input_.optional(present_ & 0x1 != 0, "present", codec::Reader::fixed)?;
            let value = input_.optional(present_ & 0x2 != 0, "value", codec::Reader::fixed)?;
            *place = input_;
            Ok(Self { r#type, self_, self_2, super_, input, output, run, present, value })
        }
    }

    codec::members!(Option_ {
        r#type: "type", self_: "self", self_2: "Self", super_: "super", input: "input",
        output: "output", run: "run", present: "present", value: "value",
    });

    /// The types inside [`Option_`].
    pub mod option {
        use super::codec;

        /// `Self` in meter: 0 to 1 in steps of 3.922e-3, carried as `u8`.
        #[derive(Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
        pub struct Self_(u8);

        codec::scaled!(Self_(u8), "Self", 0.0_f64 to 1.0_f64 "meter", Round);

        /// `super`: a number with named values. Others are kept as they come.
        #[derive(Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
        pub struct Super(pub u8);

        impl Super {
            /// `self` = 0.
            pub const SELF: Self = Self(0);
            /// `Self` = 1.
            pub const SELF_2: Self = Self(1);
        }

        codec::enumeration!(Super(u8), [(0, "self"), (1, "Self")]);
    }

    /// `Result` (F062h).
    ///
    /// Members named like local variables.
    ///
    /// Declared by `urn:example:Option 1.0`.
    #[derive(Debug, Clone, Default, PartialEq)]
    pub struct Result_ {
        /// `input`: bit 0 of the presence vector.
        pub input: Option<u8>,
        /// `present`: bit 1 of the presence vector.
        pub present: Option<u8>,
        /// `run`: bit 2 of the presence vector.
        pub run: Option<u8>,
        /// `object`: bit 3 of the presence vector.
        pub object: Option<u8>,
        /// `random`: bit 4 of the presence vector.
        pub random: Option<u8>,
        /// `output`: bit 5 of the presence vector.
        pub output: Option<u8>,
    }

    impl codec::Message for Result_ {
        const CODE: u16 = 0xF062;
        const NAME: &'static str = "Result";
        fn encoded_len(&self) -> usize {
            3 + usize::from(self.input.is_some()) + usize::from(self.present.is_some())
            + usize::from(self.run.is_some()) + usize::from(self.object.is_some())
            + usize::from(self.random.is_some()) + usize::from(self.output.is_some())
        }

        #[inline]
        fn write(&self, output: &mut codec::Writer<'_>) -> Result<(), codec::EncodeError> {
            if let Self {
                input: Some(input), present: Some(present), run: Some(run_), object: Some(object),
                random: Some(random), output: Some(output_),
            } = self {
                let run = output.run::<9>();
                codec::Fixed::put(<Self as codec::Message>::CODE, run, 0);
                codec::Fixed::put(0x3f_u8, run, 2);
                codec::Fixed::put(*input, run, 3);
                codec::Fixed::put(*present, run, 4);
                codec::Fixed::put(*run_, run, 5);
                codec::Fixed::put(*object, run, 6);
                codec::Fixed::put(*random, run, 7);
                codec::Fixed::put(*output_, run, 8);
                return Ok(());
            }
            self.write_some(output);
            Ok(())
        }

        #[inline]
        fn read(input_: &mut codec::Reader<'_>) -> Result<Self, codec::DecodeError> {
            input_.code(Self::CODE)?;
            let present_ = input_.presence::<u8>(0x3f)?;
            if present_ == 0x3f {
                let run_ = input_.run::<6>(&[
                    ("input", 1), ("present", 1), ("run", 1), ("object", 1), ("random", 1),
                    ("output", 1),
                ])?;
                return Ok(Self {
                    input: Some(codec::Fixed::get(run_, 0)),
                    present: Some(codec::Fixed::get(run_, 1)),
                    run: Some(codec::Fixed::get(run_, 2)), object: Some(codec::Fixed::get(run_, 3)),
                    random: Some(codec::Fixed::get(run_, 4)),
                    output: Some(codec::Fixed::get(run_, 5)),
                });
            }
            Self::read_some(input_, present_)
        }
    }

    impl Result_ {
        #[inline(never)]
        fn write_some(&self, output: &mut codec::Writer<'_>) {
            let present = u8::from(self.input.is_some()) | u8::from(self.present.is_some()) << 1
            | u8::from(self.run.is_some()) << 2 | u8::from(self.object.is_some()) << 3
            | u8::from(self.random.is_some()) << 4 | u8::from(self.output.is_some()) << 5;
            let run = output.run::<3>();
            codec::Fixed::put(<Self as codec::Message>::CODE, run, 0);
            codec::Fixed::put(present, run, 2);
            output.optional(self.input);
            output.optional(self.present);
            output.optional(self.run);
            output.optional(self.object);
            output.optional(self.random);
            output.optional(self.output);
        }

        #[inline(never)]
        fn read_some(place: &mut codec::Reader<'_>, present_: u64) -> Result<Self, codec::DecodeError> {
            let mut input_ = place.clone();
            let input = input_.optional(present_ & 0x1 != 0, "input", codec::Reader::fixed)?;
            let present = input_.optional(present_ & 0x2 != 0, "present", codec::Reader::fixed)?;
            let run = input_.optional(present_ & 0x4 != 0, "run", codec::Reader::fixed)?;
            let object = input_.optional(present_ & 0x8 != 0, "object", codec::Reader::fixed)?;
            let random = input_.optional(present_ & 0x10 != 0, "random", codec::Reader::fixed)?;
            let output = input_.optional(present_ & 0x20 != 0, "output", codec::Reader::fixed)?;
            *place = input_;
            Ok(Self { input, present, run, object, random, output })
        }
    }

    codec::members!(Result_ {
        input: "input", present: "present", run: "run", object: "object", random: "random",
        output: "output",
    });

    /// `Vec` (F063h).
    ///
    /// Types named like the prelude.
    ///
    /// Declared by `urn:example:Option 1.0`.
    #[derive(Debug, Clone, Default, PartialEq)]
    pub struct Vec_ {
        /// `Some`.
        pub some: vec::Some_,
        /// `None`: up to 255 elements.
        pub none: codec::List<vec::Err_>,
        /// `Box`.
        pub r#box: vec::Box_,
    }

    impl codec::Message for Vec_ {
        const CODE: u16 = 0xF063;
        const NAME: &'static str = "Vec";
        fn encoded_len(&self) -> usize {
            3 + 1 + self.none.iter().map(codec::Composite::encoded_len).sum::<usize>()
            + codec::Composite::encoded_len(&self.r#box)
        }

        fn write(&self, output: &mut codec::Writer<'_>) -> Result<(), codec::EncodeError> {
            let run = output.run::<3>();
            codec::Fixed::put(<Self as codec::Message>::CODE, run, 0);
            codec::Fixed::put(self.some, run, 2);
            output.member("None", |output| output.list::<u8, _>(&self.none, 0, 255, |value, output| codec::Composite::write(value, output)))?;
            output.member("Box", |output| codec::Composite::write(&self.r#box, output))?;
            Ok(())
        }

        fn read(input: &mut codec::Reader<'_>) -> Result<Self, codec::DecodeError> {
            input.code(Self::CODE)?;
            let some = input.member("Some", codec::Reader::fixed)?;
            let none = input.member("None", |input| input.list::<u8, _>(0, 255, 1, codec::Composite::read))?;
            let r#box = input.member("Box", codec::Composite::read)?;
            Ok(Self { some, none, r#box })
        }
    }

    codec::members!(Vec_ {
        some: "Some",
        none: "None" = |random| codec::arbitrary::list(random, 0, 255, codec::arbitrary::Arbitrary::arbitrary),
        r#box: "Box",
    });

    /// The types inside [`Vec_`].
    pub mod vec {
        use super::codec;

        /// `Ok`: 0 to 1 in steps of 3.922e-3, carried as `u8`.
        #[derive(Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
        pub struct Ok_(u8);

        codec::scaled!(Ok_(u8), "Ok", 0.0_f64 to 1.0_f64 "one", Round);

        /// `Some`.
        #[derive(Debug, Clone, Copy, Default, PartialEq)]
        pub struct Some_ {
            /// `Ok`: 0 to 1.
            pub ok: Ok_,
        }

        codec::accessors!(Some_ {
            ok: Ok_ => ok_value, set_ok_value, with_ok_value, "`Ok`", "0 to 1";
        });

        impl codec::Fixed for Some_ {
            const SIZE: usize = 1;

            #[inline]
            fn get(run: &[u8], at: usize) -> Self {
                Self {
                    ok: codec::Fixed::get(run, at),
                }
            }

            #[inline]
            fn put(self, run: &mut [u8], at: usize) {
                codec::Fixed::put(self.ok, run, at);
            }
        }

        codec::members!(Some_ { ok: "Ok" });

        /// `Err`.
        #[derive(Debug, Clone, Default, PartialEq)]
        pub struct Err_ {
            /// `String`: up to 255 octets of text.
            pub string: codec::Text,
        }

        impl codec::Composite for Err_ {
            const MIN_LEN: usize = 1;
            fn encoded_len(&self) -> usize { 1 + self.string.len() }

            #[inline]
            fn write(&self, output: &mut codec::Writer<'_>) -> Result<(), codec::EncodeError> {
                output.member("String", |output| output.text::<u8>(&self.string, 0, 255))?;
                Ok(())
            }

            #[inline]
            fn read(input: &mut codec::Reader<'_>) -> Result<Self, codec::DecodeError> {
                let string = input.member("String", |input| input.text::<u8>(0, 255))?;
                Ok(Self { string })
            }
        }

        codec::members!(Err_ {
            string: "String" = |random| codec::arbitrary::text(random, 0, 255),
        });

        /// `Self`.
        #[derive(Debug, Clone, Copy, Default, PartialEq)]
        pub struct Self_ {
            /// `self`.
            pub self_: u8,
        }

        impl codec::Fixed for Self_ {
            const SIZE: usize = 1;

            #[inline]
            fn get(run: &[u8], at: usize) -> Self {
                Self {
                    self_: codec::Fixed::get(run, at),
                }
            }

            #[inline]
            fn put(self, run: &mut [u8], at: usize) {
                codec::Fixed::put(self.self_, run, at);
            }
        }

        codec::members!(Self_ { self_: "self" });

        /// `Default`.
        #[derive(Debug, Clone, Copy, Default, PartialEq)]
        pub struct Default_ {
            /// `Clone`.
            pub clone: u8,
        }

        impl codec::Fixed for Default_ {
            const SIZE: usize = 1;

            #[inline]
            fn get(run: &[u8], at: usize) -> Self {
                Self {
                    clone: codec::Fixed::get(run, at),
                }
            }

            #[inline]
            fn put(self, run: &mut [u8], at: usize) {
                codec::Fixed::put(self.clone, run, at);
            }
        }

        codec::members!(Default_ { clone: "Clone" });

        /// `Box`: one of its alternatives.
        #[derive(Debug, Clone, PartialEq)]
        pub enum Box_ {
            /// `Self`.
            Self_(Self_),
            /// `Default`.
            Default_(Default_),
        }

        impl Default for Box_ {
            fn default() -> Self {
                Self::Self_(Default::default())
            }
        }

        impl codec::Composite for Box_ {
            const MIN_LEN: usize = 2;

            fn encoded_len(&self) -> usize {
                match self {
                    Self::Self_(_) => 1 + 1,
                    Self::Default_(_) => 1 + 1,
                }
            }

            fn write(&self, output: &mut codec::Writer<'_>) -> Result<(), codec::EncodeError> {
                match self {
                    Self::Self_(value) => {
                        output.fixed(0_u8);
                        output.member("Self", |output| { output.fixed(*value); Ok(()) })
                    }
                    Self::Default_(value) => {
                        output.fixed(1_u8);
                        output.member("Default", |output| { output.fixed(*value); Ok(()) })
                    }
                }
            }

            fn read(input: &mut codec::Reader<'_>) -> Result<Self, codec::DecodeError> {
                match input.tag::<u8>(2)? {
                    0 => input.member("Self", codec::Reader::fixed).map(Self::Self_),
                    _ => input.member("Default", codec::Reader::fixed).map(Self::Default_),
                }
            }
        }

        codec::alternatives!(Box_ { Self_: "Self", Default_: "Default" });
    }

    /// `codec` (F064h).
    ///
    /// Names that become the same.
    ///
    /// Declared by `urn:example:Option 1.0`.
    #[derive(Debug, Clone, Default, PartialEq)]
    pub struct Codec {
        /// `Position_RMS`: meter, 0 to 1.
        pub position_rms: codec_2::PositionRms,
        /// `PositionRMS`: meter, 0 to 2.
        pub position_rms_2: codec_2::PositionRms2,
        /// `positionRms`.
        pub position_rms_3: u8,
        /// `_9Lives`.
        pub _9lives: codec_2::N9lives,
        /// `Code`.
        pub code: u8,
    }

    codec::accessors!(Codec {
        position_rms: codec_2::PositionRms => position_rms_m, set_position_rms_m, with_position_rms_m, "`Position_RMS` in meter", "0 to 1";
        position_rms_2: codec_2::PositionRms2 => position_rms_m_2, set_position_rms_m_2, with_position_rms_m_2, "`PositionRMS` in meter", "0 to 2";
    });

    impl codec::Message for Codec {
        const CODE: u16 = 0xF064;
        const NAME: &'static str = "codec";
        fn encoded_len(&self) -> usize { 7 }

        fn write(&self, output: &mut codec::Writer<'_>) -> Result<(), codec::EncodeError> {
            let run = output.run::<7>();
            codec::Fixed::put(<Self as codec::Message>::CODE, run, 0);
            codec::Fixed::put(self.position_rms, run, 2);
            codec::Fixed::put(self.position_rms_2, run, 3);
            codec::Fixed::put(self.position_rms_3, run, 4);
            codec::Fixed::put(self._9lives, run, 5);
            codec::Fixed::put(self.code, run, 6);
            Ok(())
        }

        fn read(input: &mut codec::Reader<'_>) -> Result<Self, codec::DecodeError> {
            input.code(Self::CODE)?;
            let run = input.run::<5>(&[
                ("Position_RMS", 1), ("PositionRMS", 1), ("positionRms", 1), ("_9Lives", 1),
                ("Code", 1),
            ])?;
            let position_rms = codec::Fixed::get(run, 0);
            let position_rms_2 = codec::Fixed::get(run, 1);
            let position_rms_3 = codec::Fixed::get(run, 2);
            let _9lives = codec::Fixed::get(run, 3);
            let code = codec::Fixed::get(run, 4);
            Ok(Self { position_rms, position_rms_2, position_rms_3, _9lives, code })
        }
    }

    codec::members!(Codec {
        position_rms: "Position_RMS", position_rms_2: "PositionRMS", position_rms_3: "positionRms",
        _9lives: "_9Lives", code: "Code",
    });

    /// The types inside [`Codec`].
    pub mod codec_2 {
        use super::codec;

        /// `Position_RMS` in meter: 0 to 1 in steps of 3.922e-3, carried as `u8`.
        #[derive(Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
        pub struct PositionRms(u8);

        codec::scaled!(PositionRms(u8), "Position_RMS", 0.0_f64 to 1.0_f64 "meter", Round);

        /// `PositionRMS` in meter: 0 to 2 in steps of 7.843e-3, carried as `u8`.
        #[derive(Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
        pub struct PositionRms2(u8);

        codec::scaled!(PositionRms2(u8), "PositionRMS", 0.0_f64 to 2.0_f64 "meter", Round);

        /// `_9Lives`: a number with named values. Others are kept as they come.
        #[derive(Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
        pub struct N9lives(pub u8);

        impl N9lives {
            /// `9` = 9.
            pub const N9: Self = Self(9);
        }

        codec::enumeration!(N9lives(u8), [(9, "9")]);
    }

    /// `move` (F065h).
    ///
    /// A keyword.
    ///
    /// Declared by `urn:example:Option 1.0`.
    #[derive(Debug, Clone, Default, PartialEq)]
    pub struct Move;

    impl codec::Message for Move {
        const CODE: u16 = 0xF065;
        const NAME: &'static str = "move";
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

    codec::members!(Move {});

    /// `Move` (F066h).
    ///
    /// Another name in other case.
    ///
    /// Declared by `urn:example:Option 1.0`.
    #[derive(Debug, Clone, Default, PartialEq)]
    pub struct Move2;

    impl codec::Message for Move2 {
        const CODE: u16 = 0xF066;
        const NAME: &'static str = "Move";
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

    codec::members!(Move2 {});

    /// `ReportSame` (F067h).
    ///
    /// Records of one name, two of them alike.
    ///
    /// Declared by `urn:example:Option 1.0`.
    #[derive(Debug, Clone, Default, PartialEq)]
    pub struct ReportSame {
        /// `FirstSeq`.
        pub first_seq: report_same::FirstSeq,
        /// `SecondSeq`.
        pub second_seq: report_same::SecondSeq,
        /// `ThirdSeq`.
        pub third_seq: report_same::ThirdSeq,
    }

    impl codec::Message for ReportSame {
        const CODE: u16 = 0xF067;
        const NAME: &'static str = "ReportSame";
        fn encoded_len(&self) -> usize { 6 }

        fn write(&self, output: &mut codec::Writer<'_>) -> Result<(), codec::EncodeError> {
            let run = output.run::<6>();
            codec::Fixed::put(<Self as codec::Message>::CODE, run, 0);
            codec::Fixed::put(self.first_seq, run, 2);
            codec::Fixed::put(self.second_seq, run, 3);
            codec::Fixed::put(self.third_seq, run, 5);
            Ok(())
        }

        fn read(input: &mut codec::Reader<'_>) -> Result<Self, codec::DecodeError> {
            input.code(Self::CODE)?;
            let run = input.run::<4>(&[
                ("FirstSeq.SameRec.A", 1), ("SecondSeq.SameRec.A", 1), ("SecondSeq.SameRec.B", 1),
                ("ThirdSeq.SameRec.A", 1),
            ])?;
            let first_seq = codec::Fixed::get(run, 0);
            let second_seq = codec::Fixed::get(run, 1);
            let third_seq = codec::Fixed::get(run, 3);
            Ok(Self { first_seq, second_seq, third_seq })
        }
    }

    codec::members!(ReportSame {
        first_seq: "FirstSeq", second_seq: "SecondSeq", third_seq: "ThirdSeq",
    });

    /// The types inside [`ReportSame`].
    pub mod report_same {
        use super::codec;

        /// `SameRec`.
        #[derive(Debug, Clone, Copy, Default, PartialEq)]
        pub struct SameRec {
            /// `A`.
            pub a: u8,
        }

        impl codec::Fixed for SameRec {
            const SIZE: usize = 1;

            #[inline]
            fn get(run: &[u8], at: usize) -> Self {
                Self {
                    a: codec::Fixed::get(run, at),
                }
            }

            #[inline]
            fn put(self, run: &mut [u8], at: usize) {
                codec::Fixed::put(self.a, run, at);
            }
        }

        codec::members!(SameRec { a: "A" });

        /// `FirstSeq`.
        #[derive(Debug, Clone, Copy, Default, PartialEq)]
        pub struct FirstSeq {
            /// `SameRec`.
            pub same_rec: SameRec,
        }

        impl codec::Fixed for FirstSeq {
            const SIZE: usize = 1;

            #[inline]
            fn get(run: &[u8], at: usize) -> Self {
                Self {
                    same_rec: codec::Fixed::get(run, at),
                }
            }

            #[inline]
            fn put(self, run: &mut [u8], at: usize) {
                codec::Fixed::put(self.same_rec, run, at);
            }
        }

        codec::members!(FirstSeq { same_rec: "SameRec" });

        /// `SameRec`.
        #[derive(Debug, Clone, Copy, Default, PartialEq)]
        pub struct SameRec2 {
            /// `A`.
            pub a: u8,
            /// `B`.
            pub b: u8,
        }

        impl codec::Fixed for SameRec2 {
            const SIZE: usize = 2;

            #[inline]
            fn get(run: &[u8], at: usize) -> Self {
                Self {
                    a: codec::Fixed::get(run, at),
                    b: codec::Fixed::get(run, at + 1),
                }
            }

            #[inline]
            fn put(self, run: &mut [u8], at: usize) {
                codec::Fixed::put(self.a, run, at);
                codec::Fixed::put(self.b, run, at + 1);
            }
        }

        codec::members!(SameRec2 { a: "A", b: "B" });

        /// `SecondSeq`.
        #[derive(Debug, Clone, Copy, Default, PartialEq)]
        pub struct SecondSeq {
            /// `SameRec`.
            pub same_rec: SameRec2,
        }

        impl codec::Fixed for SecondSeq {
            const SIZE: usize = 2;

            #[inline]
            fn get(run: &[u8], at: usize) -> Self {
                Self {
                    same_rec: codec::Fixed::get(run, at),
                }
            }

            #[inline]
            fn put(self, run: &mut [u8], at: usize) {
                codec::Fixed::put(self.same_rec, run, at);
            }
        }

        codec::members!(SecondSeq { same_rec: "SameRec" });

        /// `ThirdSeq`.
        #[derive(Debug, Clone, Copy, Default, PartialEq)]
        pub struct ThirdSeq {
            /// `SameRec`.
            pub same_rec: SameRec,
        }

        impl codec::Fixed for ThirdSeq {
            const SIZE: usize = 1;

            #[inline]
            fn get(run: &[u8], at: usize) -> Self {
                Self {
                    same_rec: codec::Fixed::get(run, at),
                }
            }

            #[inline]
            fn put(self, run: &mut [u8], at: usize) {
                codec::Fixed::put(self.same_rec, run, at);
            }
        }

        codec::members!(ThirdSeq { same_rec: "SameRec" });
    }

    /// `SameRecAgain` (F068h).
    ///
    /// A record that another message has, too.
    ///
    /// Declared by `urn:example:Option 1.0`.
    #[derive(Debug, Clone, Default, PartialEq)]
    pub struct SameRecAgain {
        /// `SameRec`.
        pub same_rec: same_rec_again::SameRec,
    }

    impl codec::Message for SameRecAgain {
        const CODE: u16 = 0xF068;
        const NAME: &'static str = "SameRecAgain";
        fn encoded_len(&self) -> usize { 4 }

        fn write(&self, output: &mut codec::Writer<'_>) -> Result<(), codec::EncodeError> {
            let run = output.run::<4>();
            codec::Fixed::put(<Self as codec::Message>::CODE, run, 0);
            codec::Fixed::put(self.same_rec, run, 2);
            Ok(())
        }

        fn read(input: &mut codec::Reader<'_>) -> Result<Self, codec::DecodeError> {
            input.code(Self::CODE)?;
            let same_rec = input.member("SameRec", codec::Reader::fixed)?;
            Ok(Self { same_rec })
        }
    }

    codec::members!(SameRecAgain { same_rec: "SameRec" });

    /// The types inside [`SameRecAgain`].
    pub mod same_rec_again {
        #[doc(inline)]
        #[allow(unused_imports)]
        pub use super::super::v1_0::report_same::SameRec2 as SameRec;
    }
}

#[doc(inline)]
#[allow(unused_imports)]
pub use v1_0::{
    Option_, option as option_2, Result_, Vec_, vec, Codec, codec_2, Move, Move2, ReportSame,
    report_same, SameRecAgain, same_rec_again,
};
