use ::jaus::codec;

/// The service `Arrays`.
///
/// Arrays; the first index is the fastest.
pub mod arrays {
    use super::codec;

    /// What the service is called, whatever its version.
    pub const URN: &str = "urn:example:Arrays";

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
        /// Handles `ReportArrays`.
        fn report_arrays(&mut self, message: super::ReportArrays, call: &mut C);

        /// Handles `ReportArrayList`.
        fn report_array_list(&mut self, message: super::ReportArrayList, call: &mut C);
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
                0xF051 => call.receive(|message: super::ReportArrays, call| self.service.report_arrays(message, call)),
                0xF052 => call.receive(|message: super::ReportArrayList, call| self.service.report_array_list(message, call)),
                _ => return None,
            })
        }
    }
}

/// The services of the set, by URN and version.
pub static SERVICES: &[codec::ServiceInfo] = &[
    codec::ServiceInfo {
        name: "Arrays", id: arrays::V1_0, inherits_from: None, inputs: &[0xF051, 0xF052],
        outputs: &[],
    },
];

/// The message types of the set, by code; of several with one code the newest first.
pub static MESSAGES: &[codec::MessageInfo] = &[
    codec::MessageInfo::of::<ReportArrays>(&[arrays::V1_0]),
    codec::MessageInfo::of::<ReportArrayList>(&[arrays::V1_0]),
];

/// The messages of services of version 1.0.
pub mod v1_0 {
    use super::codec;

    /// `ReportArrays` (F051h).
    ///
    /// Arrays of one, two and three dimensions.
    ///
    /// Declared by `urn:example:Arrays 1.0`.
    #[derive(Debug, Clone, PartialEq)]
    pub struct ReportArrays {
        /// `Vector`: meter, -30 to 30.
        pub vector: [report_arrays::Element; 3],
        /// `Matrix`.
        pub matrix: [[u16; 3]; 2],
        /// `Cube`.
        pub cube: [[[u8; 4]; 3]; 2],
        /// `Many`.
        pub many: [f64; 40],
        /// `Names`: up to 255 octets of text.
        pub names: [codec::Text; 2],
        /// `Grid`: up to 255 octets of text.
        pub grid: [[codec::Text; 2]; 2],
        /// `Stamps`.
        pub stamps: [report_arrays::Stamp; 2],
        /// `Maybe`: bit 0 of the presence vector.
        pub maybe: Option<[u8; 4]>,
        /// `Codes`: at most 3 octets of text.
        pub codes: [codec::Text; 2],
    }

    impl Default for ReportArrays {
        fn default() -> Self {
            Self {
                vector: ::core::array::from_fn(|_| Default::default()),
                matrix: ::core::array::from_fn(|_| ::core::array::from_fn(|_| Default::default())),
                cube: ::core::array::from_fn(|_| ::core::array::from_fn(|_| ::core::array::from_fn(|_| Default::default()))),
                many: ::core::array::from_fn(|_| Default::default()),
                names: ::core::array::from_fn(|_| Default::default()),
                grid: ::core::array::from_fn(|_| ::core::array::from_fn(|_| Default::default())),
                stamps: ::core::array::from_fn(|_| Default::default()),
                maybe: Default::default(),
                codes: ::core::array::from_fn(|_| Default::default()),
            }
        }
    }

    impl codec::Message for ReportArrays {
        const CODE: u16 = 0xF051;
        const NAME: &'static str = "ReportArrays";
        fn encoded_len(&self) -> usize {
            379 + self.names.iter().map(|value| 1 + value.len()).sum::<usize>()
            + self.grid.iter().flatten().map(|value| 1 + value.len()).sum::<usize>()
            + 4 * usize::from(self.maybe.is_some())
        }

        fn write(&self, output: &mut codec::Writer<'_>) -> Result<(), codec::EncodeError> {
            let present = u8::from(self.maybe.is_some());
            let run = output.run::<15>();
            codec::Fixed::put(<Self as codec::Message>::CODE, run, 0);
            codec::Fixed::put(present, run, 2);
            codec::Fixed::put(self.vector, run, 3);
            output.member("Matrix", |output| { for i1 in 0..3 { for i0 in 0..2 { { output.fixed(self.matrix[i0][i1]); Ok(()) }?; } } Ok(()) })?;
            output.member("Cube", |output| { for i2 in 0..4 { for i1 in 0..3 { for i0 in 0..2 { { output.fixed(self.cube[i0][i1][i2]); Ok(()) }?; } } } Ok(()) })?;
            output.fixed(self.many);
            output.member("Names", |output| { for i0 in 0..2 { output.text::<u8>(&self.names[i0], 0, 255)?; } Ok(()) })?;
            output.member("Grid", |output| { for i1 in 0..2 { for i0 in 0..2 { output.text::<u8>(&self.grid[i0][i1], 0, 255)?; } } Ok(()) })?;
            output.fixed(self.stamps);
            output.optional(self.maybe);
            output.member("Codes", |output| { for i0 in 0..2 { output.fixed_text(&self.codes[i0], 3)?; } Ok(()) })?;
            Ok(())
        }

        fn read(input: &mut codec::Reader<'_>) -> Result<Self, codec::DecodeError> {
            input.code(Self::CODE)?;
            let present = input.presence::<u8>(0x1)?;
            let vector = input.member("Vector", codec::Reader::fixed)?;
            let matrix = input.member("Matrix", |input| { input.require(12)?; let mut array: [[_; 3]; 2] = ::core::array::from_fn(|_| ::core::array::from_fn(|_| Default::default())); for i1 in 0..3 { for i0 in 0..2 { array[i0][i1] = input.fixed()?; } } Ok(array) })?;
            let cube = input.member("Cube", |input| { input.require(24)?; let mut array: [[[_; 4]; 3]; 2] = ::core::array::from_fn(|_| ::core::array::from_fn(|_| ::core::array::from_fn(|_| Default::default()))); for i2 in 0..4 { for i1 in 0..3 { for i0 in 0..2 { array[i0][i1][i2] = input.fixed()?; } } } Ok(array) })?;
            let many = input.member("Many", codec::Reader::fixed)?;
            let names = input.member("Names", |input| { input.require(2)?; let mut array: [_; 2] = ::core::array::from_fn(|_| Default::default()); for i0 in 0..2 { array[i0] = input.text::<u8>(0, 255)?; } Ok(array) })?;
            let grid = input.member("Grid", |input| { input.require(4)?; let mut array: [[_; 2]; 2] = ::core::array::from_fn(|_| ::core::array::from_fn(|_| Default::default())); for i1 in 0..2 { for i0 in 0..2 { array[i0][i1] = input.text::<u8>(0, 255)?; } } Ok(array) })?;
            let stamps = input.member("Stamps", codec::Reader::fixed)?;
            let maybe = input.optional(present & 0x1 != 0, "Maybe", codec::Reader::fixed)?;
            let codes = input.member("Codes", |input| { input.require(6)?; let mut array: [_; 2] = ::core::array::from_fn(|_| Default::default()); for i0 in 0..2 { array[i0] = input.fixed_text(3)?; } Ok(array) })?;
            Ok(Self { vector, matrix, cube, many, names, grid, stamps, maybe, codes })
        }
    }

    codec::members!(ReportArrays {
        vector: "Vector" = |random| codec::arbitrary::array(random, codec::arbitrary::Arbitrary::arbitrary),
        matrix: "Matrix" = |random| codec::arbitrary::array(random, |random| codec::arbitrary::array(random, codec::arbitrary::Arbitrary::arbitrary)),
        cube: "Cube" = |random| codec::arbitrary::array(random, |random| codec::arbitrary::array(random, |random| codec::arbitrary::array(random, codec::arbitrary::Arbitrary::arbitrary))),
        many: "Many" = |random| codec::arbitrary::array(random, codec::arbitrary::f64),
        names: "Names" = |random| codec::arbitrary::array(random, |random| codec::arbitrary::text(random, 0, 255)),
        grid: "Grid" = |random| codec::arbitrary::array(random, |random| codec::arbitrary::array(random, |random| codec::arbitrary::text(random, 0, 255))),
        stamps: "Stamps" = |random| codec::arbitrary::array(random, codec::arbitrary::Arbitrary::arbitrary),
        maybe: "Maybe" = |random| codec::arbitrary::optional(random, |random| codec::arbitrary::array(random, codec::arbitrary::Arbitrary::arbitrary)),
        codes: "Codes" = |random| codec::arbitrary::array(random, |random| codec::arbitrary::fixed_text(random, 3)),
    });

    /// The types inside [`ReportArrays`].
    pub mod report_arrays {
        use super::codec;

        /// `Element` in meter: -30 to 30 in steps of 1.397e-8, carried as `u32`.
        #[derive(Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
        pub struct Element(u32);

        codec::scaled!(Element(u32), "Element", -30.0_f64 to 30.0_f64 "meter", Round);

        /// `Stamp`: several numbers in one `u8`. Bits outside all of them are kept.
        #[derive(Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
        pub struct Stamp(pub u8);

        codec::sub_fields!(Stamp(u8) {
            /// `Low`: bits 0 to 3, 0 to 15.
            low: u8, 0 to 3, 0 to 15, "Low" => with_low;
        });

        codec::bit_field!(Stamp(u8), [("Low", 0, 3)]);
    }

    /// `ReportArrayList` (F052h).
    ///
    /// Arrays in a list.
    ///
    /// Declared by `urn:example:Arrays 1.0`.
    #[derive(Debug, Clone, Default, PartialEq)]
    pub struct ReportArrayList {
        /// `Rows`: up to 255 elements.
        pub rows: codec::List<report_array_list::RowRec>,
    }

    impl codec::Message for ReportArrayList {
        const CODE: u16 = 0xF052;
        const NAME: &'static str = "ReportArrayList";
        fn encoded_len(&self) -> usize {
            2 + 1 + 6 * self.rows.len()
        }

        fn write(&self, output: &mut codec::Writer<'_>) -> Result<(), codec::EncodeError> {
            output.fixed(<Self as codec::Message>::CODE);
            output.member("Rows", |output| output.list::<u8, _>(&self.rows, 0, 255, |value, output| { output.fixed(*value); Ok(()) }))?;
            Ok(())
        }

        fn read(input: &mut codec::Reader<'_>) -> Result<Self, codec::DecodeError> {
            input.code(Self::CODE)?;
            let rows = input.member("Rows", |input| input.list::<u8, _>(0, 255, 6, codec::Reader::fixed))?;
            Ok(Self { rows })
        }
    }

    codec::members!(ReportArrayList is rows = |random| codec::arbitrary::list(random, 0, 255, codec::arbitrary::Arbitrary::arbitrary));

    /// The types inside [`ReportArrayList`].
    pub mod report_array_list {
        use super::codec;

        /// `RowRec`.
        #[derive(Debug, Clone, Copy, Default, PartialEq)]
        pub struct RowRec {
            /// `Row`.
            pub row: [i16; 3],
        }

        impl codec::Fixed for RowRec {
            const SIZE: usize = 6;

            #[inline]
            fn get(run: &[u8], at: usize) -> Self {
                Self {
                    row: codec::Fixed::get(run, at),
                }
            }

            #[inline]
            fn put(self, run: &mut [u8], at: usize) {
                codec::Fixed::put(self.row, run, at);
            }
        }

        codec::members!(RowRec {
            row: "Row" = |random| codec::arbitrary::array(random, codec::arbitrary::Arbitrary::arbitrary),
        });
    }
}

#[doc(inline)]
#[allow(unused_imports)]
pub use v1_0::{ReportArrays, report_arrays, ReportArrayList, report_array_list};
