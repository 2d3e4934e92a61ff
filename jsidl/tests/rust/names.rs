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
        fn offers(&self) -> Vec<codec::ServiceId> {
            vec![V1_0]
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
        name: "Option",
        id: option::V1_0,
        inherits_from: None,
        inputs: &[0xF061, 0xF062, 0xF063, 0xF064, 0xF065, 0xF066, 0xF067, 0xF068],
        outputs: &[],
    },
];

/// The message types of the set, by code; of several with one code the newest first.
pub static MESSAGES: &[codec::MessageInfo] = &[
    codec::MessageInfo::of::<Option_>(&[
        option::V1_0,
    ]),
    codec::MessageInfo::of::<Result_>(&[
        option::V1_0,
    ]),
    codec::MessageInfo::of::<Vec_>(&[
        option::V1_0,
    ]),
    codec::MessageInfo::of::<Codec>(&[
        option::V1_0,
    ]),
    codec::MessageInfo::of::<Move>(&[
        option::V1_0,
    ]),
    codec::MessageInfo::of::<Move2>(&[
        option::V1_0,
    ]),
    codec::MessageInfo::of::<ReportSame>(&[
        option::V1_0,
    ]),
    codec::MessageInfo::of::<SameRecAgain>(&[
        option::V1_0,
    ]),
];

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
    pub self_2: option_2::Self_,
    /// `super`.
    pub super_: option_2::Super,
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

impl Option_ {
    /// `Self` in meter.
    pub fn self_m(&self) -> f64 {
        self.self_2.value()
    }

    /// Sets `Self` in meter to the nearest value that the field can hold.
    ///
    /// # Errors
    /// If the value is not in 0 to 1.
    pub fn set_self_m(&mut self, value: f64) -> Result<(), codec::OutOfRange> {
        self.self_2 = option_2::Self_::new(value)?;
        Ok(())
    }
}

impl codec::Message for Option_ {
    const CODE: u16 = 0xF061;
    const NAME: &'static str = "Option";
    const IS_COMMAND: bool = false;
    const NEEDS_CONTROL: bool = false;

    fn encoded_len(&self) -> usize {
        13
        + 2 * usize::from(self.present.is_some())
        + 2 * usize::from(self.value.is_some())
    }

    #[inline]
    fn write(&self, output: &mut codec::Writer<'_>) -> Result<(), codec::EncodeError> {
        if let Self {
            r#type,
            self_,
            self_2,
            super_,
            input,
            output: output_,
            run: run_,
            present: Some(present),
            value: Some(value),
        } = self
        {
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
                ("type", 1),
                ("self", 1),
                ("Self", 1),
                ("super", 1),
                ("input", 2),
                ("output", 2),
                ("run", 2),
                ("present", 2),
                ("value", 2),
            ])?;
            return Ok(Self {
                r#type: codec::Fixed::get(run_, 0),
                self_: codec::Fixed::get(run_, 1),
                self_2: codec::Fixed::get(run_, 2),
                super_: codec::Fixed::get(run_, 3),
                input: codec::Fixed::get(run_, 4),
                output: codec::Fixed::get(run_, 6),
                run: codec::Fixed::get(run_, 8),
                present: Some(codec::Fixed::get(run_, 10)),
                value: Some(codec::Fixed::get(run_, 12)),
            });
        }
        Self::read_some(input_, present_)
    }
}

impl Option_ {
    #[inline(never)]
    fn write_some(&self, output: &mut codec::Writer<'_>) {
        let present =
        u8::from(self.present.is_some())
        | u8::from(self.value.is_some()) << 1;
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
            ("type", 1),
            ("self", 1),
            ("Self", 1),
            ("super", 1),
            ("input", 2),
            ("output", 2),
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
        Ok(Self {
            r#type,
            self_,
            self_2,
            super_,
            input,
            output,
            run,
            present,
            value,
        })
    }
}

codec::if_serde! {
    impl codec::view::View for Option_ {
        #[inline(never)]
        fn view(&self) -> codec::view::Value {
            codec::view::Value::object(9)
            .with("type", codec::view::View::view(&self.r#type))
            .with("self", codec::view::View::view(&self.self_))
            .with("Self", codec::view::View::view(&self.self_2))
            .with("super", codec::view::View::view(&self.super_))
            .with("input", codec::view::View::view(&self.input))
            .with("output", codec::view::View::view(&self.output))
            .with("run", codec::view::View::view(&self.run))
            .with("present", codec::view::View::view(&self.present))
            .with("value", codec::view::View::view(&self.value))
        }

        #[inline(never)]
        fn from_view(value: &codec::view::Value) -> Result<Self, codec::view::Error> {
            let object = codec::view::Object::new(value, &["type", "self", "Self", "super", "input", "output", "run", "present", "value"])?;
            Ok(Self {
                r#type: object.member("type")?,
                self_: object.member("self")?,
                self_2: object.member("Self")?,
                super_: object.member("super")?,
                input: object.member("input")?,
                output: object.member("output")?,
                run: object.member("run")?,
                present: object.member("present")?,
                value: object.member("value")?,
            })
        }
    }
    codec::serde_by_view!(Option_);
}

codec::if_arbitrary! {
    impl<'a> codec::arbitrary::Arbitrary<'a> for Option_ {
        fn arbitrary(random: &mut codec::arbitrary::Unstructured<'a>) -> codec::arbitrary::Result<Self> {
            Ok(Self {
                r#type: codec::arbitrary::Arbitrary::arbitrary(random)?,
                self_: codec::arbitrary::Arbitrary::arbitrary(random)?,
                self_2: codec::arbitrary::Arbitrary::arbitrary(random)?,
                super_: codec::arbitrary::Arbitrary::arbitrary(random)?,
                input: codec::arbitrary::Arbitrary::arbitrary(random)?,
                output: codec::arbitrary::Arbitrary::arbitrary(random)?,
                run: codec::arbitrary::Arbitrary::arbitrary(random)?,
                present: codec::arbitrary::optional(random, codec::arbitrary::Arbitrary::arbitrary)?,
                value: codec::arbitrary::optional(random, codec::arbitrary::Arbitrary::arbitrary)?,
            })
        }
    }
}

/// The types inside [`Option_`].
pub mod option_2 {
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

    codec::enumeration!(Super(u8), [
        (0, "self"),
        (1, "Self"),
    ]);
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
    const IS_COMMAND: bool = false;
    const NEEDS_CONTROL: bool = false;

    fn encoded_len(&self) -> usize {
        3
        + usize::from(self.input.is_some())
        + usize::from(self.present.is_some())
        + usize::from(self.run.is_some())
        + usize::from(self.object.is_some())
        + usize::from(self.random.is_some())
        + usize::from(self.output.is_some())
    }

    #[inline]
    fn write(&self, output: &mut codec::Writer<'_>) -> Result<(), codec::EncodeError> {
        if let Self {
            input: Some(input),
            present: Some(present),
            run: Some(run_),
            object: Some(object),
            random: Some(random),
            output: Some(output_),
        } = self
        {
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
                ("input", 1),
                ("present", 1),
                ("run", 1),
                ("object", 1),
                ("random", 1),
                ("output", 1),
            ])?;
            return Ok(Self {
                input: Some(codec::Fixed::get(run_, 0)),
                present: Some(codec::Fixed::get(run_, 1)),
                run: Some(codec::Fixed::get(run_, 2)),
                object: Some(codec::Fixed::get(run_, 3)),
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
        let present =
        u8::from(self.input.is_some())
        | u8::from(self.present.is_some()) << 1
        | u8::from(self.run.is_some()) << 2
        | u8::from(self.object.is_some()) << 3
        | u8::from(self.random.is_some()) << 4
        | u8::from(self.output.is_some()) << 5;
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
        Ok(Self {
            input,
            present,
            run,
            object,
            random,
            output,
        })
    }
}

codec::if_serde! {
    impl codec::view::View for Result_ {
        #[inline(never)]
        fn view(&self) -> codec::view::Value {
            codec::view::Value::object(6)
            .with("input", codec::view::View::view(&self.input))
            .with("present", codec::view::View::view(&self.present))
            .with("run", codec::view::View::view(&self.run))
            .with("object", codec::view::View::view(&self.object))
            .with("random", codec::view::View::view(&self.random))
            .with("output", codec::view::View::view(&self.output))
        }

        #[inline(never)]
        fn from_view(value: &codec::view::Value) -> Result<Self, codec::view::Error> {
            let object = codec::view::Object::new(value, &["input", "present", "run", "object", "random", "output"])?;
            Ok(Self {
                input: object.member("input")?,
                present: object.member("present")?,
                run: object.member("run")?,
                object: object.member("object")?,
                random: object.member("random")?,
                output: object.member("output")?,
            })
        }
    }
    codec::serde_by_view!(Result_);
}

codec::if_arbitrary! {
    impl<'a> codec::arbitrary::Arbitrary<'a> for Result_ {
        fn arbitrary(random: &mut codec::arbitrary::Unstructured<'a>) -> codec::arbitrary::Result<Self> {
            Ok(Self {
                input: codec::arbitrary::optional(random, codec::arbitrary::Arbitrary::arbitrary)?,
                present: codec::arbitrary::optional(random, codec::arbitrary::Arbitrary::arbitrary)?,
                run: codec::arbitrary::optional(random, codec::arbitrary::Arbitrary::arbitrary)?,
                object: codec::arbitrary::optional(random, codec::arbitrary::Arbitrary::arbitrary)?,
                random: codec::arbitrary::optional(random, codec::arbitrary::Arbitrary::arbitrary)?,
                output: codec::arbitrary::optional(random, codec::arbitrary::Arbitrary::arbitrary)?,
            })
        }
    }
}

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
    pub none: Vec<vec::Err_>,
    /// `Box`.
    pub r#box: vec::Box_,
}

impl codec::Message for Vec_ {
    const CODE: u16 = 0xF063;
    const NAME: &'static str = "Vec";
    const IS_COMMAND: bool = false;
    const NEEDS_CONTROL: bool = false;

    fn encoded_len(&self) -> usize {
        3
        + 1 + self.none.iter().map(codec::Composite::encoded_len).sum::<usize>()
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
        Ok(Self {
            some,
            none,
            r#box,
        })
    }
}

codec::if_serde! {
    impl codec::view::View for Vec_ {
        #[inline(never)]
        fn view(&self) -> codec::view::Value {
            codec::view::Value::object(3)
            .with("Some", codec::view::View::view(&self.some))
            .with("None", codec::view::View::view(&self.none))
            .with("Box", codec::view::View::view(&self.r#box))
        }

        #[inline(never)]
        fn from_view(value: &codec::view::Value) -> Result<Self, codec::view::Error> {
            let object = codec::view::Object::new(value, &["Some", "None", "Box"])?;
            Ok(Self {
                some: object.member("Some")?,
                none: object.member("None")?,
                r#box: object.member("Box")?,
            })
        }
    }
    codec::serde_by_view!(Vec_);
}

codec::if_arbitrary! {
    impl<'a> codec::arbitrary::Arbitrary<'a> for Vec_ {
        fn arbitrary(random: &mut codec::arbitrary::Unstructured<'a>) -> codec::arbitrary::Result<Self> {
            Ok(Self {
                some: codec::arbitrary::Arbitrary::arbitrary(random)?,
                none: codec::arbitrary::list(random, 0, 255, codec::arbitrary::Arbitrary::arbitrary)?,
                r#box: codec::arbitrary::Arbitrary::arbitrary(random)?,
            })
        }
    }
}

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

    impl Some_ {
        /// `Ok`.
        pub fn ok_value(&self) -> f64 {
            self.ok.value()
        }

        /// Sets `Ok` to the nearest value that the field can hold.
        ///
        /// # Errors
        /// If the value is not in 0 to 1.
        pub fn set_ok_value(&mut self, value: f64) -> Result<(), codec::OutOfRange> {
            self.ok = Ok_::new(value)?;
            Ok(())
        }
    }

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

    codec::if_serde! {
        impl codec::view::View for Some_ {
            #[inline(never)]
            fn view(&self) -> codec::view::Value {
                codec::view::Value::object(1)
                .with("Ok", codec::view::View::view(&self.ok))
            }

            #[inline(never)]
            fn from_view(value: &codec::view::Value) -> Result<Self, codec::view::Error> {
                let object = codec::view::Object::new(value, &["Ok"])?;
                Ok(Self {
                    ok: object.member("Ok")?,
                })
            }
        }
        codec::serde_by_view!(Some_);
    }

    codec::if_arbitrary! {
        impl<'a> codec::arbitrary::Arbitrary<'a> for Some_ {
            fn arbitrary(random: &mut codec::arbitrary::Unstructured<'a>) -> codec::arbitrary::Result<Self> {
                Ok(Self {
                    ok: codec::arbitrary::Arbitrary::arbitrary(random)?,
                })
            }
        }
    }

    /// `Err`.
    #[derive(Debug, Clone, Default, PartialEq)]
    pub struct Err_ {
        /// `String`: up to 255 octets of text.
        pub string: codec::Text,
    }

    impl codec::Composite for Err_ {
        const MIN_LEN: usize = 1;

        fn encoded_len(&self) -> usize {
            1 + self.string.len()
        }

        #[inline]
        fn write(&self, output: &mut codec::Writer<'_>) -> Result<(), codec::EncodeError> {
            output.member("String", |output| output.text::<u8>(&self.string, 0, 255))?;
            Ok(())
        }

        #[inline]
        fn read(input: &mut codec::Reader<'_>) -> Result<Self, codec::DecodeError> {
            let string = input.member("String", |input| input.text::<u8>(0, 255))?;
            Ok(Self {
                string,
            })
        }
    }

    codec::if_serde! {
        impl codec::view::View for Err_ {
            #[inline(never)]
            fn view(&self) -> codec::view::Value {
                codec::view::Value::object(1)
                .with("String", codec::view::View::view(&self.string))
            }

            #[inline(never)]
            fn from_view(value: &codec::view::Value) -> Result<Self, codec::view::Error> {
                let object = codec::view::Object::new(value, &["String"])?;
                Ok(Self {
                    string: object.member("String")?,
                })
            }
        }
        codec::serde_by_view!(Err_);
    }

    codec::if_arbitrary! {
        impl<'a> codec::arbitrary::Arbitrary<'a> for Err_ {
            fn arbitrary(random: &mut codec::arbitrary::Unstructured<'a>) -> codec::arbitrary::Result<Self> {
                Ok(Self {
                    string: codec::arbitrary::text(random, 0, 255)?,
                })
            }
        }
    }

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

    codec::if_serde! {
        impl codec::view::View for Self_ {
            #[inline(never)]
            fn view(&self) -> codec::view::Value {
                codec::view::Value::object(1)
                .with("self", codec::view::View::view(&self.self_))
            }

            #[inline(never)]
            fn from_view(value: &codec::view::Value) -> Result<Self, codec::view::Error> {
                let object = codec::view::Object::new(value, &["self"])?;
                Ok(Self {
                    self_: object.member("self")?,
                })
            }
        }
        codec::serde_by_view!(Self_);
    }

    codec::if_arbitrary! {
        impl<'a> codec::arbitrary::Arbitrary<'a> for Self_ {
            fn arbitrary(random: &mut codec::arbitrary::Unstructured<'a>) -> codec::arbitrary::Result<Self> {
                Ok(Self {
                    self_: codec::arbitrary::Arbitrary::arbitrary(random)?,
                })
            }
        }
    }

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

    codec::if_serde! {
        impl codec::view::View for Default_ {
            #[inline(never)]
            fn view(&self) -> codec::view::Value {
                codec::view::Value::object(1)
                .with("Clone", codec::view::View::view(&self.clone))
            }

            #[inline(never)]
            fn from_view(value: &codec::view::Value) -> Result<Self, codec::view::Error> {
                let object = codec::view::Object::new(value, &["Clone"])?;
                Ok(Self {
                    clone: object.member("Clone")?,
                })
            }
        }
        codec::serde_by_view!(Default_);
    }

    codec::if_arbitrary! {
        impl<'a> codec::arbitrary::Arbitrary<'a> for Default_ {
            fn arbitrary(random: &mut codec::arbitrary::Unstructured<'a>) -> codec::arbitrary::Result<Self> {
                Ok(Self {
                    clone: codec::arbitrary::Arbitrary::arbitrary(random)?,
                })
            }
        }
    }

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

    codec::if_serde! {
        impl codec::view::View for Box_ {
            fn view(&self) -> codec::view::Value {
                match self {
                    Self::Self_(value) => {
                        codec::view::Value::alternative("Self", codec::view::View::view(value))
                    }
                    Self::Default_(value) => {
                        codec::view::Value::alternative("Default", codec::view::View::view(value))
                    }
                }
            }

            fn from_view(value: &codec::view::Value) -> Result<Self, codec::view::Error> {
                let (name, value) = value.chosen()?;
                let read = match name {
                    "Self" => codec::view::View::from_view(value).map(Self::Self_),
                    "Default" => codec::view::View::from_view(value).map(Self::Default_),
                    _ => return Err(codec::view::Error::unknown_key(name, &["Self", "Default"])),
                };
                read.map_err(|error| error.within(name))
            }
        }
        codec::serde_by_view!(Box_);
    }

    codec::if_arbitrary! {
        impl<'a> codec::arbitrary::Arbitrary<'a> for Box_ {
            fn arbitrary(random: &mut codec::arbitrary::Unstructured<'a>) -> codec::arbitrary::Result<Self> {
                match random.int_in_range(0..=1)? {
                    0 => codec::arbitrary::Arbitrary::arbitrary(random).map(Self::Self_),
                    _ => codec::arbitrary::Arbitrary::arbitrary(random).map(Self::Default_),
                }
            }
        }
    }
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

impl Codec {
    /// `Position_RMS` in meter.
    pub fn position_rms_m(&self) -> f64 {
        self.position_rms.value()
    }

    /// Sets `Position_RMS` in meter to the nearest value that the field can hold.
    ///
    /// # Errors
    /// If the value is not in 0 to 1.
    pub fn set_position_rms_m(&mut self, value: f64) -> Result<(), codec::OutOfRange> {
        self.position_rms = codec_2::PositionRms::new(value)?;
        Ok(())
    }

    /// `PositionRMS` in meter.
    pub fn position_rms_m_2(&self) -> f64 {
        self.position_rms_2.value()
    }

    /// Sets `PositionRMS` in meter to the nearest value that the field can hold.
    ///
    /// # Errors
    /// If the value is not in 0 to 2.
    pub fn set_position_rms_m_2(&mut self, value: f64) -> Result<(), codec::OutOfRange> {
        self.position_rms_2 = codec_2::PositionRms2::new(value)?;
        Ok(())
    }
}

impl codec::Message for Codec {
    const CODE: u16 = 0xF064;
    const NAME: &'static str = "codec";
    const IS_COMMAND: bool = false;
    const NEEDS_CONTROL: bool = false;

    fn encoded_len(&self) -> usize {
        7
    }

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
            ("Position_RMS", 1),
            ("PositionRMS", 1),
            ("positionRms", 1),
            ("_9Lives", 1),
            ("Code", 1),
        ])?;
        let position_rms = codec::Fixed::get(run, 0);
        let position_rms_2 = codec::Fixed::get(run, 1);
        let position_rms_3 = codec::Fixed::get(run, 2);
        let _9lives = codec::Fixed::get(run, 3);
        let code = codec::Fixed::get(run, 4);
        Ok(Self {
            position_rms,
            position_rms_2,
            position_rms_3,
            _9lives,
            code,
        })
    }
}

codec::if_serde! {
    impl codec::view::View for Codec {
        #[inline(never)]
        fn view(&self) -> codec::view::Value {
            codec::view::Value::object(5)
            .with("Position_RMS", codec::view::View::view(&self.position_rms))
            .with("PositionRMS", codec::view::View::view(&self.position_rms_2))
            .with("positionRms", codec::view::View::view(&self.position_rms_3))
            .with("_9Lives", codec::view::View::view(&self._9lives))
            .with("Code", codec::view::View::view(&self.code))
        }

        #[inline(never)]
        fn from_view(value: &codec::view::Value) -> Result<Self, codec::view::Error> {
            let object = codec::view::Object::new(value, &["Position_RMS", "PositionRMS", "positionRms", "_9Lives", "Code"])?;
            Ok(Self {
                position_rms: object.member("Position_RMS")?,
                position_rms_2: object.member("PositionRMS")?,
                position_rms_3: object.member("positionRms")?,
                _9lives: object.member("_9Lives")?,
                code: object.member("Code")?,
            })
        }
    }
    codec::serde_by_view!(Codec);
}

codec::if_arbitrary! {
    impl<'a> codec::arbitrary::Arbitrary<'a> for Codec {
        fn arbitrary(random: &mut codec::arbitrary::Unstructured<'a>) -> codec::arbitrary::Result<Self> {
            Ok(Self {
                position_rms: codec::arbitrary::Arbitrary::arbitrary(random)?,
                position_rms_2: codec::arbitrary::Arbitrary::arbitrary(random)?,
                position_rms_3: codec::arbitrary::Arbitrary::arbitrary(random)?,
                _9lives: codec::arbitrary::Arbitrary::arbitrary(random)?,
                code: codec::arbitrary::Arbitrary::arbitrary(random)?,
            })
        }
    }
}

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

    codec::enumeration!(N9lives(u8), [
        (9, "9"),
    ]);
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
    impl codec::view::View for Move {
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
    codec::serde_by_view!(Move);
}

codec::if_arbitrary! {
    impl<'a> codec::arbitrary::Arbitrary<'a> for Move {
        fn arbitrary(_: &mut codec::arbitrary::Unstructured<'a>) -> codec::arbitrary::Result<Self> {
            Ok(Self)
        }
    }
}

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
    impl codec::view::View for Move2 {
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
    codec::serde_by_view!(Move2);
}

codec::if_arbitrary! {
    impl<'a> codec::arbitrary::Arbitrary<'a> for Move2 {
        fn arbitrary(_: &mut codec::arbitrary::Unstructured<'a>) -> codec::arbitrary::Result<Self> {
            Ok(Self)
        }
    }
}

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
    const IS_COMMAND: bool = false;
    const NEEDS_CONTROL: bool = false;

    fn encoded_len(&self) -> usize {
        6
    }

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
            ("FirstSeq.SameRec.A", 1),
            ("SecondSeq.SameRec.A", 1),
            ("SecondSeq.SameRec.B", 1),
            ("ThirdSeq.SameRec.A", 1),
        ])?;
        let first_seq = codec::Fixed::get(run, 0);
        let second_seq = codec::Fixed::get(run, 1);
        let third_seq = codec::Fixed::get(run, 3);
        Ok(Self {
            first_seq,
            second_seq,
            third_seq,
        })
    }
}

codec::if_serde! {
    impl codec::view::View for ReportSame {
        #[inline(never)]
        fn view(&self) -> codec::view::Value {
            codec::view::Value::object(3)
            .with("FirstSeq", codec::view::View::view(&self.first_seq))
            .with("SecondSeq", codec::view::View::view(&self.second_seq))
            .with("ThirdSeq", codec::view::View::view(&self.third_seq))
        }

        #[inline(never)]
        fn from_view(value: &codec::view::Value) -> Result<Self, codec::view::Error> {
            let object = codec::view::Object::new(value, &["FirstSeq", "SecondSeq", "ThirdSeq"])?;
            Ok(Self {
                first_seq: object.member("FirstSeq")?,
                second_seq: object.member("SecondSeq")?,
                third_seq: object.member("ThirdSeq")?,
            })
        }
    }
    codec::serde_by_view!(ReportSame);
}

codec::if_arbitrary! {
    impl<'a> codec::arbitrary::Arbitrary<'a> for ReportSame {
        fn arbitrary(random: &mut codec::arbitrary::Unstructured<'a>) -> codec::arbitrary::Result<Self> {
            Ok(Self {
                first_seq: codec::arbitrary::Arbitrary::arbitrary(random)?,
                second_seq: codec::arbitrary::Arbitrary::arbitrary(random)?,
                third_seq: codec::arbitrary::Arbitrary::arbitrary(random)?,
            })
        }
    }
}

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

    codec::if_serde! {
        impl codec::view::View for SameRec {
            #[inline(never)]
            fn view(&self) -> codec::view::Value {
                codec::view::Value::object(1)
                .with("A", codec::view::View::view(&self.a))
            }

            #[inline(never)]
            fn from_view(value: &codec::view::Value) -> Result<Self, codec::view::Error> {
                let object = codec::view::Object::new(value, &["A"])?;
                Ok(Self {
                    a: object.member("A")?,
                })
            }
        }
        codec::serde_by_view!(SameRec);
    }

    codec::if_arbitrary! {
        impl<'a> codec::arbitrary::Arbitrary<'a> for SameRec {
            fn arbitrary(random: &mut codec::arbitrary::Unstructured<'a>) -> codec::arbitrary::Result<Self> {
                Ok(Self {
                    a: codec::arbitrary::Arbitrary::arbitrary(random)?,
                })
            }
        }
    }

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

    codec::if_serde! {
        impl codec::view::View for FirstSeq {
            #[inline(never)]
            fn view(&self) -> codec::view::Value {
                codec::view::Value::object(1)
                .with("SameRec", codec::view::View::view(&self.same_rec))
            }

            #[inline(never)]
            fn from_view(value: &codec::view::Value) -> Result<Self, codec::view::Error> {
                let object = codec::view::Object::new(value, &["SameRec"])?;
                Ok(Self {
                    same_rec: object.member("SameRec")?,
                })
            }
        }
        codec::serde_by_view!(FirstSeq);
    }

    codec::if_arbitrary! {
        impl<'a> codec::arbitrary::Arbitrary<'a> for FirstSeq {
            fn arbitrary(random: &mut codec::arbitrary::Unstructured<'a>) -> codec::arbitrary::Result<Self> {
                Ok(Self {
                    same_rec: codec::arbitrary::Arbitrary::arbitrary(random)?,
                })
            }
        }
    }

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

    codec::if_serde! {
        impl codec::view::View for SameRec2 {
            #[inline(never)]
            fn view(&self) -> codec::view::Value {
                codec::view::Value::object(2)
                .with("A", codec::view::View::view(&self.a))
                .with("B", codec::view::View::view(&self.b))
            }

            #[inline(never)]
            fn from_view(value: &codec::view::Value) -> Result<Self, codec::view::Error> {
                let object = codec::view::Object::new(value, &["A", "B"])?;
                Ok(Self {
                    a: object.member("A")?,
                    b: object.member("B")?,
                })
            }
        }
        codec::serde_by_view!(SameRec2);
    }

    codec::if_arbitrary! {
        impl<'a> codec::arbitrary::Arbitrary<'a> for SameRec2 {
            fn arbitrary(random: &mut codec::arbitrary::Unstructured<'a>) -> codec::arbitrary::Result<Self> {
                Ok(Self {
                    a: codec::arbitrary::Arbitrary::arbitrary(random)?,
                    b: codec::arbitrary::Arbitrary::arbitrary(random)?,
                })
            }
        }
    }

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

    codec::if_serde! {
        impl codec::view::View for SecondSeq {
            #[inline(never)]
            fn view(&self) -> codec::view::Value {
                codec::view::Value::object(1)
                .with("SameRec", codec::view::View::view(&self.same_rec))
            }

            #[inline(never)]
            fn from_view(value: &codec::view::Value) -> Result<Self, codec::view::Error> {
                let object = codec::view::Object::new(value, &["SameRec"])?;
                Ok(Self {
                    same_rec: object.member("SameRec")?,
                })
            }
        }
        codec::serde_by_view!(SecondSeq);
    }

    codec::if_arbitrary! {
        impl<'a> codec::arbitrary::Arbitrary<'a> for SecondSeq {
            fn arbitrary(random: &mut codec::arbitrary::Unstructured<'a>) -> codec::arbitrary::Result<Self> {
                Ok(Self {
                    same_rec: codec::arbitrary::Arbitrary::arbitrary(random)?,
                })
            }
        }
    }

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

    codec::if_serde! {
        impl codec::view::View for ThirdSeq {
            #[inline(never)]
            fn view(&self) -> codec::view::Value {
                codec::view::Value::object(1)
                .with("SameRec", codec::view::View::view(&self.same_rec))
            }

            #[inline(never)]
            fn from_view(value: &codec::view::Value) -> Result<Self, codec::view::Error> {
                let object = codec::view::Object::new(value, &["SameRec"])?;
                Ok(Self {
                    same_rec: object.member("SameRec")?,
                })
            }
        }
        codec::serde_by_view!(ThirdSeq);
    }

    codec::if_arbitrary! {
        impl<'a> codec::arbitrary::Arbitrary<'a> for ThirdSeq {
            fn arbitrary(random: &mut codec::arbitrary::Unstructured<'a>) -> codec::arbitrary::Result<Self> {
                Ok(Self {
                    same_rec: codec::arbitrary::Arbitrary::arbitrary(random)?,
                })
            }
        }
    }
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
    const IS_COMMAND: bool = false;
    const NEEDS_CONTROL: bool = false;

    fn encoded_len(&self) -> usize {
        4
    }

    fn write(&self, output: &mut codec::Writer<'_>) -> Result<(), codec::EncodeError> {
        let run = output.run::<4>();
        codec::Fixed::put(<Self as codec::Message>::CODE, run, 0);
        codec::Fixed::put(self.same_rec, run, 2);
        Ok(())
    }

    fn read(input: &mut codec::Reader<'_>) -> Result<Self, codec::DecodeError> {
        input.code(Self::CODE)?;
        let same_rec = input.member("SameRec", codec::Reader::fixed)?;
        Ok(Self {
            same_rec,
        })
    }
}

codec::if_serde! {
    impl codec::view::View for SameRecAgain {
        #[inline(never)]
        fn view(&self) -> codec::view::Value {
            codec::view::Value::object(1)
            .with("SameRec", codec::view::View::view(&self.same_rec))
        }

        #[inline(never)]
        fn from_view(value: &codec::view::Value) -> Result<Self, codec::view::Error> {
            let object = codec::view::Object::new(value, &["SameRec"])?;
            Ok(Self {
                same_rec: object.member("SameRec")?,
            })
        }
    }
    codec::serde_by_view!(SameRecAgain);
}

codec::if_arbitrary! {
    impl<'a> codec::arbitrary::Arbitrary<'a> for SameRecAgain {
        fn arbitrary(random: &mut codec::arbitrary::Unstructured<'a>) -> codec::arbitrary::Result<Self> {
            Ok(Self {
                same_rec: codec::arbitrary::Arbitrary::arbitrary(random)?,
            })
        }
    }
}

/// The types inside [`SameRecAgain`].
pub mod same_rec_again {
    #[doc(inline)]
    pub use super::report_same::SameRec2 as SameRec;
}
