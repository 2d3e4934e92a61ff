//! The messages of these tests. `ReportSurvey` has a field of every kind.

use jaus_codec::{
    self as codec, Bytes, Composite, DecodeError, EncodeError, Fixed, FormattedBlob, Message,
    Reader, Text, Writer,
};

#[derive(Clone, Copy, Default, PartialEq)]
pub(crate) struct Mode(pub(crate) u8);
codec::enumeration!(Mode(u8), [(0, "Off"), (7, "Run")]);

#[derive(Clone, Copy, Default, PartialEq)]
pub(crate) struct Side(pub(crate) u8);
codec::enumeration!(Side(u8), [(1, "Left"), (2, "Right")]);

/// Bits 0 and 3 belong to no sub-field.
#[derive(Clone, Copy, Default, PartialEq)]
pub(crate) struct Flags(pub(crate) u8);
codec::bit_field!(Flags(u8), [("Side", 1, 2, Side), ("Level", 4, 7)]);

/// Steps of 0.0001 around 0.
#[derive(Clone, Copy, Default, PartialEq)]
pub(crate) struct Course(i16);
codec::scaled!(Course(i16), "Course", -3.2767 to 3.2767 "radian", Round);

/// Steps of 0.01 above 0.
#[derive(Clone, Copy, Default, PartialEq)]
pub(crate) struct Depth(u16);
codec::scaled!(Depth(u16), "Depth", 0.0 to 655.35 "meter", Round);

/// A `variable_field`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Height {
    Steps(u8),
    Meter(f32),
}

impl Composite for Height {
    const MIN_LEN: usize = 2;

    fn encoded_len(&self) -> usize {
        match self {
            Self::Steps(_) => 2,
            Self::Meter(_) => 5,
        }
    }

    fn write(&self, output: &mut Writer<'_>) -> Result<(), EncodeError> {
        match *self {
            Self::Steps(value) => output.fixed([1, value]),
            Self::Meter(value) => {
                output.fixed(3_u8);
                output.fixed(value);
            }
        }
        Ok(())
    }

    fn read(input: &mut Reader<'_>) -> Result<Self, DecodeError> {
        match input.fixed::<u8>()? {
            1 => input.fixed().map(Self::Steps),
            3 => input.fixed().map(Self::Meter),
            index => Err(input.unknown_choice(index)),
        }
    }
}

#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Point {
    pub(crate) east: i16,
    pub(crate) height: Height,
}

impl Composite for Point {
    const MIN_LEN: usize = 4;

    fn encoded_len(&self) -> usize {
        2 + self.height.encoded_len()
    }

    fn write(&self, output: &mut Writer<'_>) -> Result<(), EncodeError> {
        output.fixed(self.east);
        output.member("Height", |output| self.height.write(output))
    }

    fn read(input: &mut Reader<'_>) -> Result<Self, DecodeError> {
        Ok(Self {
            east: input.member("East", Reader::fixed)?,
            height: input.member("Height", Height::read)?,
        })
    }
}

/// A variant.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Shape {
    Circle(u16),
    Polygon(Vec<u16>),
}

impl Composite for Shape {
    const MIN_LEN: usize = 2;

    fn encoded_len(&self) -> usize {
        match self {
            Self::Circle(_) => 3,
            Self::Polygon(corners) => 2 + 2 * corners.len(),
        }
    }

    fn write(&self, output: &mut Writer<'_>) -> Result<(), EncodeError> {
        match self {
            Self::Circle(radius) => {
                output.fixed(0_u8);
                output.fixed(*radius);
                Ok(())
            }
            Self::Polygon(corners) => {
                output.fixed(1_u8);
                output.member("Polygon", |output| {
                    output.list::<u8, _>(corners, 0, 255, |corner, output| {
                        output.fixed(*corner);
                        Ok(())
                    })
                })
            }
        }
    }

    fn read(input: &mut Reader<'_>) -> Result<Self, DecodeError> {
        match input.tag::<u8>(2)? {
            0 => input.member("Circle", Reader::fixed).map(Self::Circle),
            _ => input
                .member("Polygon", |input| {
                    input.list::<u8, _>(0, 255, 2, Reader::fixed)
                })
                .map(Self::Polygon),
        }
    }
}

#[derive(Debug, Clone, PartialEq)]
pub(crate) struct ReportSurvey {
    pub(crate) mode: Mode,
    pub(crate) flags: Flags,
    pub(crate) course: Course,
    pub(crate) depth: Option<Depth>,
    pub(crate) mark: Option<Text>,
    pub(crate) photo: Option<FormattedBlob<u8>>,
    pub(crate) name: Text,
    pub(crate) samples: [f64; 3],
    pub(crate) points: Vec<Point>,
    pub(crate) shape: Shape,
}

impl Message for ReportSurvey {
    const CODE: u16 = 0x4C01;
    const NAME: &'static str = "ReportSurvey";
    const IS_COMMAND: bool = false;
    const NEEDS_CONTROL: bool = false;

    fn encoded_len(&self) -> usize {
        7 + 2 * usize::from(self.depth.is_some())
            + 4 * usize::from(self.mark.is_some())
            + self.photo.as_ref().map_or(0, |photo| 3 + photo.data.len())
            + (1 + self.name.len())
            + 24
            + (1 + self.points.iter().map(Point::encoded_len).sum::<usize>())
            + self.shape.encoded_len()
    }

    fn write(&self, output: &mut Writer<'_>) -> Result<(), EncodeError> {
        let present = u8::from(self.depth.is_some())
            | u8::from(self.mark.is_some()) << 1
            | u8::from(self.photo.is_some()) << 2;
        let run = output.run::<7>();
        Self::CODE.put(run, 0);
        present.put(run, 2);
        self.mode.put(run, 3);
        self.flags.put(run, 4);
        self.course.put(run, 5);
        output.optional(self.depth);
        if let Some(mark) = &self.mark {
            output.member("Mark", |output| output.fixed_text(mark, 4))?;
        }
        if let Some(photo) = &self.photo {
            output.member("Photo", |output| output.formatted::<u16, _>(photo, 0, 300))?;
        }
        output.member("Name", |output| output.text::<u8>(&self.name, 1, 8))?;
        output.fixed(self.samples);
        output.member("Points", |output| {
            output.list::<u8, _>(&self.points, 1, 3, Point::write)
        })?;
        output.member("Shape", |output| self.shape.write(output))
    }

    fn read(input: &mut Reader<'_>) -> Result<Self, DecodeError> {
        input.code(Self::CODE)?;
        let present = input.presence::<u8>(0x7)?;
        let run = input.run::<4>(&[("Mode", 1), ("Flags", 1), ("Course", 2)])?;
        Ok(Self {
            mode: Fixed::get(run, 0),
            flags: Fixed::get(run, 1),
            course: Fixed::get(run, 2),
            depth: input.optional(present & 1 != 0, "Depth", Reader::fixed)?,
            mark: input.optional(present & 2 != 0, "Mark", |input| input.fixed_text(4))?,
            photo: input.optional(present & 4 != 0, "Photo", |input| {
                input.formatted::<u16, _>(0, 300)
            })?,
            name: input.member("Name", |input| input.text::<u8>(1, 8))?,
            samples: input.member("Samples", Reader::fixed)?,
            points: input.member("Points", |input| {
                input.list::<u8, _>(1, 3, Point::MIN_LEN, Point::read)
            })?,
            shape: input.member("Shape", Shape::read)?,
        })
    }
}

/// A message of one fixed field after its code.
macro_rules! short_message {
    ($name:ident, $text:literal, $code:literal, $is_command:literal, $field:ident: $type:ty, $label:literal) => {
        #[derive(Debug, Clone, PartialEq)]
        pub(crate) struct $name {
            pub(crate) $field: $type,
        }

        impl Message for $name {
            const CODE: u16 = $code;
            const NAME: &'static str = $text;
            const IS_COMMAND: bool = $is_command;
            const NEEDS_CONTROL: bool = false;

            fn encoded_len(&self) -> usize {
                2 + <$type as Fixed>::SIZE
            }

            fn write(&self, output: &mut Writer<'_>) -> Result<(), EncodeError> {
                output.fixed(Self::CODE);
                output.fixed(self.$field);
                Ok(())
            }

            fn read(input: &mut Reader<'_>) -> Result<Self, DecodeError> {
                input.code(Self::CODE)?;
                let $field = input.member($label, Reader::fixed)?;
                Ok(Self { $field })
            }
        }

        codec::if_serde! {
            impl codec::view::View for $name {
                fn view(&self) -> codec::view::Value {
                    codec::view::Value::object(1).with($label, self.$field.view())
                }

                fn from_view(value: &codec::view::Value) -> Result<Self, codec::view::Error> {
                    let object = codec::view::Object::new(value, &[$label])?;
                    let $field = object.member($label)?;
                    Ok(Self { $field })
                }
            }
        }

        codec::if_arbitrary! {
            impl<'a> codec::arbitrary::Arbitrary<'a> for $name {
                fn arbitrary(
                    random: &mut codec::arbitrary::Unstructured<'a>,
                ) -> codec::arbitrary::Result<Self> {
                    let $field = codec::arbitrary::Arbitrary::arbitrary(random)?;
                    Ok(Self { $field })
                }
            }
        }
    };
}

short_message!(SetMode, "SetMode", 0x0C02, true, mode: Mode, "Mode");
short_message!(OldSetMode, "SetMode", 0x0C02, true, modes: [u8; 2], "Modes");
short_message!(QueryDepth, "QueryDepth", 0x2C03, false, sonar: u8, "Sonar");

codec::if_serde! {
    use codec::serde_by_view;
    use codec::view::{Error, Object, Value, View, choice, choice_of};

    impl View for Height {
        fn view(&self) -> Value {
            match self {
                Self::Steps(value) => choice_of(1, "one", value),
                Self::Meter(value) => choice_of(3, "meter", value),
            }
        }

        fn from_view(value: &Value) -> Result<Self, Error> {
            choice(value, |index, value| Some(match index {
                1 => View::from_view(value).map(Self::Steps),
                3 => View::from_view(value).map(Self::Meter),
                _ => return None,
            }))
        }
    }

    impl View for Point {
        fn view(&self) -> Value {
            Value::object(2)
                .with("East", self.east.view())
                .with("Height", self.height.view())
        }

        fn from_view(value: &Value) -> Result<Self, Error> {
            let object = Object::new(value, &["East", "Height"])?;
            Ok(Self {
                east: object.member("East")?,
                height: object.member("Height")?,
            })
        }
    }

    impl View for Shape {
        fn view(&self) -> Value {
            match self {
                Self::Circle(value) => Value::alternative("Circle", value.view()),
                Self::Polygon(value) => Value::alternative("Polygon", value.view()),
            }
        }

        fn from_view(value: &Value) -> Result<Self, Error> {
            let (name, value) = value.chosen()?;
            let read = match name {
                "Circle" => View::from_view(value).map(Self::Circle),
                "Polygon" => View::from_view(value).map(Self::Polygon),
                _ => return Err(Error::unknown_key(name, &["Circle", "Polygon"])),
            };
            read.map_err(|error| error.within(name))
        }
    }

    impl View for ReportSurvey {
        fn view(&self) -> Value {
            Value::object(10)
                .with("Mode", self.mode.view())
                .with("Flags", self.flags.view())
                .with("Course", self.course.view())
                .with("Depth", self.depth.view())
                .with("Mark", self.mark.view())
                .with("Photo", self.photo.view())
                .with("Name", self.name.view())
                .with("Samples", self.samples.view())
                .with("Points", self.points.view())
                .with("Shape", self.shape.view())
        }

        fn from_view(value: &Value) -> Result<Self, Error> {
            let object = Object::new(
                value,
                &[
                    "Mode", "Flags", "Course", "Depth", "Mark", "Photo", "Name", "Samples",
                    "Points", "Shape",
                ],
            )?;
            Ok(Self {
                mode: object.member("Mode")?,
                flags: object.member("Flags")?,
                course: object.member("Course")?,
                depth: object.member("Depth")?,
                mark: object.member("Mark")?,
                photo: object.member("Photo")?,
                name: object.member("Name")?,
                samples: object.member("Samples")?,
                points: object.member("Points")?,
                shape: object.member("Shape")?,
            })
        }
    }

    serde_by_view!(ReportSurvey);
}

codec::if_arbitrary! {
    use codec::arbitrary::{self, Arbitrary, Unstructured};

    impl<'a> Arbitrary<'a> for Point {
        fn arbitrary(random: &mut Unstructured<'a>) -> arbitrary::Result<Self> {
            Ok(Self {
                east: Arbitrary::arbitrary(random)?,
                height: match random.int_in_range(0..=1)? {
                    0 => Height::Steps(Arbitrary::arbitrary(random)?),
                    _ => Height::Meter(arbitrary::f32(random)?),
                },
            })
        }
    }

    impl<'a> Arbitrary<'a> for ReportSurvey {
        fn arbitrary(random: &mut Unstructured<'a>) -> arbitrary::Result<Self> {
            Ok(Self {
                mode: Arbitrary::arbitrary(random)?,
                flags: Arbitrary::arbitrary(random)?,
                course: Arbitrary::arbitrary(random)?,
                depth: arbitrary::optional(random, Arbitrary::arbitrary)?,
                mark: arbitrary::optional(random, |random| arbitrary::fixed_text(random, 4))?,
                photo: arbitrary::optional(random, |random| arbitrary::formatted(random, 0, 300))?,
                name: arbitrary::text(random, 1, 8)?,
                samples: arbitrary::array(random, arbitrary::f64)?,
                points: arbitrary::list(random, 1, 3, Arbitrary::arbitrary)?,
                shape: match random.int_in_range(0..=1)? {
                    0 => Shape::Circle(Arbitrary::arbitrary(random)?),
                    _ => arbitrary::list(random, 0, 255, Arbitrary::arbitrary).map(Shape::Polygon)?,
                },
            })
        }
    }
}

/// A survey with everything in it.
pub(crate) fn survey() -> ReportSurvey {
    ReportSurvey {
        mode: Mode(7),
        flags: Flags(0xAC),
        course: Course::from_raw(15000),
        depth: Some(Depth::from_raw(1234)),
        mark: Some("N1".into()),
        photo: Some(FormattedBlob::new(1, &b"\xFF\xD8\xFE"[..])),
        name: "dock".into(),
        samples: [1.0, -2.5, 0.1],
        points: vec![
            Point {
                east: -2,
                height: Height::Steps(5),
            },
            Point {
                east: 300,
                height: Height::Meter(1.5),
            },
        ],
        shape: Shape::Polygon(vec![10, 20]),
    }
}

/// The octets of [`survey`], by hand.
pub(crate) const SURVEY: Bytes = Bytes::from_static(
    b"\x01\x4C\x07\
    \x07\xAC\x98\x3A\
    \xD2\x04\
    N1\0\0\
    \x01\x03\x00\xFF\xD8\xFE\
    \x04dock\
    \0\0\0\0\0\0\xF0\x3F\0\0\0\0\0\0\x04\xC0\x9A\x99\x99\x99\x99\x99\xB9\x3F\
    \x02\xFE\xFF\x01\x05\x2C\x01\x03\0\0\xC0\x3F\
    \x01\x02\x0A\x00\x14\x00",
);
