use ::jaus::codec;

/// The service `Composites`.
///
/// Records, sequences, lists and variants in each other.
pub mod composites {
    use super::codec;

    /// What the service is called, whatever its version.
    pub const URN: &str = "urn:example:Composites";

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
        /// Handles `QueryNothing`.
        fn query_nothing(&mut self, message: super::QueryNothing, call: &mut C);

        /// Handles `ReportTree`.
        fn report_tree(&mut self, message: super::ReportTree, call: &mut C);

        /// Handles `ReportListOfLists`.
        fn report_list_of_lists(&mut self, message: super::ReportListOfLists, call: &mut C);

        /// Handles `SetChoice`.
        fn set_choice(&mut self, message: super::SetChoice, call: &mut C);

        /// Handles `ReportEmptyVariant`.
        fn report_empty_variant(&mut self, message: super::ReportEmptyVariant, call: &mut C);

        /// Handles `ReportOptional`.
        fn report_optional(&mut self, message: super::ReportOptional, call: &mut C);

        /// Handles `ReportManyOptional`.
        fn report_many_optional(&mut self, message: super::ReportManyOptional, call: &mut C);
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
                0xF030 => call.receive(|message: super::QueryNothing, call| self.service.query_nothing(message, call)),
                0xF031 => call.receive(|message: super::ReportTree, call| self.service.report_tree(message, call)),
                0xF032 => call.receive(|message: super::ReportListOfLists, call| self.service.report_list_of_lists(message, call)),
                0xF033 => call.receive(|message: super::SetChoice, call| self.service.set_choice(message, call)),
                0xF034 => call.receive(|message: super::ReportEmptyVariant, call| self.service.report_empty_variant(message, call)),
                0xF035 => call.receive(|message: super::ReportOptional, call| self.service.report_optional(message, call)),
                0xF036 => call.receive(|message: super::ReportManyOptional, call| self.service.report_many_optional(message, call)),
                _ => return None,
            })
        }
    }
}

/// The services of the set, by URN and version.
pub static SERVICES: &[codec::ServiceInfo] = &[
    codec::ServiceInfo {
        name: "Composites", id: composites::V1_0, inherits_from: None,
        inputs: &[0xF030, 0xF031, 0xF032, 0xF033, 0xF034, 0xF035, 0xF036], outputs: &[],
    },
];

/// The message types of the set, by code; of several with one code the newest first.
pub static MESSAGES: &[codec::MessageInfo] = &[
    codec::MessageInfo::of::<QueryNothing>(&[composites::V1_0]),
    codec::MessageInfo::of::<ReportTree>(&[composites::V1_0]),
    codec::MessageInfo::of::<ReportListOfLists>(&[composites::V1_0]),
    codec::MessageInfo::of::<SetChoice>(&[composites::V1_0]),
    codec::MessageInfo::of::<ReportEmptyVariant>(&[composites::V1_0]),
    codec::MessageInfo::of::<ReportOptional>(&[composites::V1_0]),
    codec::MessageInfo::of::<ReportManyOptional>(&[composites::V1_0]),
];

/// The messages of services of version 1.0.
pub mod v1_0 {
    use super::codec;

    /// `QueryNothing` (F030h).
    ///
    /// An empty body.
    ///
    /// Declared by `urn:example:Composites 1.0`.
    #[derive(Debug, Clone, Default, PartialEq)]
    pub struct QueryNothing;

    impl codec::Message for QueryNothing {
        const CODE: u16 = 0xF030;
        const NAME: &'static str = "QueryNothing";
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

    codec::members!(QueryNothing {});

    /// `ReportTree` (F031h).
    ///
    /// Lists in lists.
    ///
    /// Declared by `urn:example:Composites 1.0`.
    #[derive(Debug, Clone, Default, PartialEq)]
    pub struct ReportTree {
        /// `RequestIDRec`.
        pub request_id_rec: report_tree::RequestIdRec,
        /// `Nodes`: up to 65535 elements.
        pub nodes: codec::List<report_tree::NodeSeq>,
    }

    impl codec::Message for ReportTree {
        const CODE: u16 = 0xF031;
        const NAME: &'static str = "ReportTree";
        fn encoded_len(&self) -> usize {
            3 + 2 + self.nodes.iter().map(codec::Composite::encoded_len).sum::<usize>()
        }

        fn write(&self, output: &mut codec::Writer<'_>) -> Result<(), codec::EncodeError> {
            let run = output.run::<3>();
            codec::Fixed::put(<Self as codec::Message>::CODE, run, 0);
            codec::Fixed::put(self.request_id_rec, run, 2);
            output.member("Nodes", |output| output.list::<u16, _>(&self.nodes, 0, 65535, |value, output| codec::Composite::write(value, output)))?;
            Ok(())
        }

        fn read(input: &mut codec::Reader<'_>) -> Result<Self, codec::DecodeError> {
            input.code(Self::CODE)?;
            let request_id_rec = input.member("RequestIDRec", codec::Reader::fixed)?;
            let nodes = input.member("Nodes", |input| input.list::<u16, _>(0, 65535, 3, codec::Composite::read))?;
            Ok(Self { request_id_rec, nodes })
        }
    }

    codec::members!(ReportTree {
        request_id_rec: "RequestIDRec",
        nodes: "Nodes" = |random| codec::arbitrary::list(random, 0, 65535, codec::arbitrary::Arbitrary::arbitrary),
    });

    /// The types inside [`ReportTree`].
    pub mod report_tree {
        use super::codec;

        /// `RequestIDRec`.
        #[derive(Debug, Clone, Copy, Default, PartialEq)]
        pub struct RequestIdRec {
            /// `RequestID`.
            pub request_id: u8,
        }

        impl codec::Fixed for RequestIdRec {
            const SIZE: usize = 1;

            #[inline]
            fn get(run: &[u8], at: usize) -> Self {
                Self {
                    request_id: codec::Fixed::get(run, at),
                }
            }

            #[inline]
            fn put(self, run: &mut [u8], at: usize) {
                codec::Fixed::put(self.request_id, run, at);
            }
        }

        codec::members!(RequestIdRec { request_id: "RequestID" });

        /// `NodeRec`.
        #[derive(Debug, Clone, Copy, Default, PartialEq)]
        pub struct NodeRec {
            /// `NodeID`.
            pub node_id: u8,
            /// `Kind`.
            pub kind: u8,
        }

        impl codec::Fixed for NodeRec {
            const SIZE: usize = 2;

            #[inline]
            fn get(run: &[u8], at: usize) -> Self {
                Self {
                    node_id: codec::Fixed::get(run, at),
                    kind: codec::Fixed::get(run, at + 1),
                }
            }

            #[inline]
            fn put(self, run: &mut [u8], at: usize) {
                codec::Fixed::put(self.node_id, run, at);
                codec::Fixed::put(self.kind, run, at + 1);
            }
        }

        codec::members!(NodeRec { node_id: "NodeID", kind: "Kind" });

        /// `ComponentRec`.
        #[derive(Debug, Clone, Default, PartialEq)]
        pub struct ComponentRec {
            /// `ComponentID`.
            pub component_id: u8,
            /// `Name`: up to 255 octets of text.
            pub name: codec::Text,
        }

        impl codec::Composite for ComponentRec {
            const MIN_LEN: usize = 2;
            fn encoded_len(&self) -> usize {
                1 + 1 + self.name.len()
            }

            #[inline]
            fn write(&self, output: &mut codec::Writer<'_>) -> Result<(), codec::EncodeError> {
                output.fixed(self.component_id);
                output.member("Name", |output| output.text::<u8>(&self.name, 0, 255))?;
                Ok(())
            }

            #[inline]
            fn read(input: &mut codec::Reader<'_>) -> Result<Self, codec::DecodeError> {
                let component_id = input.member("ComponentID", codec::Reader::fixed)?;
                let name = input.member("Name", |input| input.text::<u8>(0, 255))?;
                Ok(Self { component_id, name })
            }
        }

        codec::members!(ComponentRec {
            component_id: "ComponentID",
            name: "Name" = |random| codec::arbitrary::text(random, 0, 255),
        });

        /// `NodeSeq`.
        #[derive(Debug, Clone, Default, PartialEq)]
        pub struct NodeSeq {
            /// `NodeRec`.
            pub node_rec: NodeRec,
            /// `Components`: up to 255 elements.
            pub components: codec::List<ComponentRec>,
        }

        impl codec::Composite for NodeSeq {
            const MIN_LEN: usize = 3;
            fn encoded_len(&self) -> usize {
                2 + 1 + self.components.iter().map(codec::Composite::encoded_len).sum::<usize>()
            }

            #[inline]
            fn write(&self, output: &mut codec::Writer<'_>) -> Result<(), codec::EncodeError> {
                output.fixed(self.node_rec);
                output.member("Components", |output| output.list::<u8, _>(&self.components, 0, 255, |value, output| codec::Composite::write(value, output)))?;
                Ok(())
            }

            #[inline]
            fn read(input: &mut codec::Reader<'_>) -> Result<Self, codec::DecodeError> {
                let node_rec = input.member("NodeRec", codec::Reader::fixed)?;
                let components = input.member("Components", |input| input.list::<u8, _>(0, 255, 2, codec::Composite::read))?;
                Ok(Self { node_rec, components })
            }
        }

        codec::members!(NodeSeq {
            node_rec: "NodeRec",
            components: "Components" = |random| codec::arbitrary::list(random, 0, 255, codec::arbitrary::Arbitrary::arbitrary),
        });
    }

    /// `ReportListOfLists` (F032h).
    ///
    /// A list directly in a list.
    ///
    /// Declared by `urn:example:Composites 1.0`.
    #[derive(Debug, Clone, Default, PartialEq)]
    pub struct ReportListOfLists {
        /// `Outer`: at most 100 elements.
        pub outer: codec::List<codec::List<report_list_of_lists::PointRec>>,
    }

    impl codec::Message for ReportListOfLists {
        const CODE: u16 = 0xF032;
        const NAME: &'static str = "ReportListOfLists";
        fn encoded_len(&self) -> usize {
            2 + 2 + self.outer.iter().map(|value| 1 + 4 * value.len()).sum::<usize>()
        }

        fn write(&self, output: &mut codec::Writer<'_>) -> Result<(), codec::EncodeError> {
            output.fixed(<Self as codec::Message>::CODE);
            output.member("Outer", |output| output.list::<u16, _>(&self.outer, 0, 100, |value, output| output.list::<u8, _>(value, 1, 4, |value, output| { output.fixed(*value); Ok(()) })))?;
            Ok(())
        }

        fn read(input: &mut codec::Reader<'_>) -> Result<Self, codec::DecodeError> {
            input.code(Self::CODE)?;
            let outer = input.member("Outer", |input| input.list::<u16, _>(0, 100, 5, |input| input.list::<u8, _>(1, 4, 4, codec::Reader::fixed)))?;
            Ok(Self { outer })
        }
    }

    codec::members!(ReportListOfLists is outer = |random| codec::arbitrary::list(random, 0, 100, |random| codec::arbitrary::list(random, 1, 4, codec::arbitrary::Arbitrary::arbitrary)));

    /// The types inside [`ReportListOfLists`].
    pub mod report_list_of_lists {
        use super::codec;

        /// `PointRec`.
        #[derive(Debug, Clone, Copy, Default, PartialEq)]
        pub struct PointRec {
            /// `X`.
            pub x: u16,
            /// `Y`.
            pub y: u16,
        }

        impl codec::Fixed for PointRec {
            const SIZE: usize = 4;

            #[inline]
            fn get(run: &[u8], at: usize) -> Self {
                Self {
                    x: codec::Fixed::get(run, at),
                    y: codec::Fixed::get(run, at + 2),
                }
            }

            #[inline]
            fn put(self, run: &mut [u8], at: usize) {
                codec::Fixed::put(self.x, run, at);
                codec::Fixed::put(self.y, run, at + 2);
            }
        }

        codec::members!(PointRec { x: "X", y: "Y" });
    }

    /// `SetChoice` (F033h).
    ///
    /// A variant as the body.
    ///
    /// Declared by `urn:example:Composites 1.0`.
    #[derive(Debug, Clone, Default, PartialEq)]
    pub struct SetChoice {
        /// `Choice`.
        pub choice: set_choice::Choice,
    }

    impl codec::Message for SetChoice {
        const CODE: u16 = 0xF033;
        const NAME: &'static str = "SetChoice";
        fn encoded_len(&self) -> usize {
            2 + codec::Composite::encoded_len(&self.choice)
        }

        fn write(&self, output: &mut codec::Writer<'_>) -> Result<(), codec::EncodeError> {
            output.fixed(<Self as codec::Message>::CODE);
            output.member("Choice", |output| codec::Composite::write(&self.choice, output))?;
            Ok(())
        }

        fn read(input: &mut codec::Reader<'_>) -> Result<Self, codec::DecodeError> {
            input.code(Self::CODE)?;
            let choice = input.member("Choice", codec::Composite::read)?;
            Ok(Self { choice })
        }
    }

    codec::members!(SetChoice is choice);

    /// The types inside [`SetChoice`].
    pub mod set_choice {
        use super::codec;

        /// `NumberRec`.
        #[derive(Debug, Clone, Copy, Default, PartialEq)]
        pub struct NumberRec {
            /// `Number`.
            pub number: u32,
        }

        impl codec::Fixed for NumberRec {
            const SIZE: usize = 4;

            #[inline]
            fn get(run: &[u8], at: usize) -> Self {
                Self {
                    number: codec::Fixed::get(run, at),
                }
            }

            #[inline]
            fn put(self, run: &mut [u8], at: usize) {
                codec::Fixed::put(self.number, run, at);
            }
        }

        codec::members!(NumberRec { number: "Number" });

        /// `TextRec`.
        #[derive(Debug, Clone, Default, PartialEq)]
        pub struct TextRec {
            /// `Text`: up to 255 octets of text.
            pub text: codec::Text,
        }

        impl codec::Composite for TextRec {
            const MIN_LEN: usize = 1;
            fn encoded_len(&self) -> usize { 1 + self.text.len() }

            #[inline]
            fn write(&self, output: &mut codec::Writer<'_>) -> Result<(), codec::EncodeError> {
                output.member("Text", |output| output.text::<u8>(&self.text, 0, 255))?;
                Ok(())
            }

            #[inline]
            fn read(input: &mut codec::Reader<'_>) -> Result<Self, codec::DecodeError> {
                let text = input.member("Text", |input| input.text::<u8>(0, 255))?;
                Ok(Self { text })
            }
        }

        codec::members!(TextRec { text: "Text" = |random| codec::arbitrary::text(random, 0, 255) });

        /// `EmptyPresenceRec`.
        #[derive(Debug, Clone, Default, PartialEq)]
        pub struct EmptyPresenceRec {
            /// `Maybe`: bit 0 of the presence vector.
            pub maybe: Option<u8>,
        }

        impl codec::Composite for EmptyPresenceRec {
            const MIN_LEN: usize = 1;
            fn encoded_len(&self) -> usize {
                1 + usize::from(self.maybe.is_some())
            }

            #[inline]
            fn write(&self, output: &mut codec::Writer<'_>) -> Result<(), codec::EncodeError> {
                if let Self { maybe: Some(maybe) } = self {
                    let run = output.run::<2>();
                    codec::Fixed::put(0x1_u8, run, 0);
                    codec::Fixed::put(*maybe, run, 1);
                    return Ok(());
                }
                self.write_some(output);
                Ok(())
            }

            #[inline]
            fn read(input: &mut codec::Reader<'_>) -> Result<Self, codec::DecodeError> {
                let present = input.presence::<u8>(0x1)?;
                if present == 0x1 {
                    let run = input.run::<1>(&[("Maybe", 1)])?;
                    return Ok(Self { maybe: Some(codec::Fixed::get(run, 0)) });
                }
                Self::read_some(input, present)
            }
        }

        impl EmptyPresenceRec {
            #[inline(never)]
            fn write_some(&self, output: &mut codec::Writer<'_>) {
                let present = u8::from(self.maybe.is_some());
                output.fixed(present);
                output.optional(self.maybe);
            }

            #[inline(never)]
            fn read_some(place: &mut codec::Reader<'_>, present: u64) -> Result<Self, codec::DecodeError> {
                let mut input = place.clone();
                let maybe = input.optional(present & 0x1 != 0, "Maybe", codec::Reader::fixed)?;
                *place = input;
                Ok(Self { maybe })
            }
        }

        codec::members!(EmptyPresenceRec { maybe: "Maybe" });

        /// `Again`: one of its alternatives.
        #[derive(Debug, Clone, PartialEq)]
        pub enum Again {
            /// `TextRec`.
            TextRec(TextRec),
            /// `EmptyPresenceRec`.
            EmptyPresenceRec(EmptyPresenceRec),
        }

        impl Default for Again {
            fn default() -> Self {
                Self::TextRec(Default::default())
            }
        }

        impl codec::Composite for Again {
            const MIN_LEN: usize = 2;

            fn encoded_len(&self) -> usize {
                match self {
                    Self::TextRec(value) => 1 + codec::Composite::encoded_len(value),
                    Self::EmptyPresenceRec(value) => 1 + codec::Composite::encoded_len(value),
                }
            }

            fn write(&self, output: &mut codec::Writer<'_>) -> Result<(), codec::EncodeError> {
                match self {
                    Self::TextRec(value) => {
                        output.fixed(0_u8);
                        output.member("TextRec", |output| codec::Composite::write(value, output))
                    }
                    Self::EmptyPresenceRec(value) => {
                        output.fixed(1_u8);
                        output.member("EmptyPresenceRec", |output| codec::Composite::write(value, output))
                    }
                }
            }

            fn read(input: &mut codec::Reader<'_>) -> Result<Self, codec::DecodeError> {
                match input.tag::<u8>(2)? {
                    0 => input.member("TextRec", codec::Composite::read).map(Self::TextRec),
                    _ => input.member("EmptyPresenceRec", codec::Composite::read).map(Self::EmptyPresenceRec),
                }
            }
        }

        codec::alternatives!(Again { TextRec: "TextRec", EmptyPresenceRec: "EmptyPresenceRec" });

        /// `FirstRec`.
        #[derive(Debug, Clone, Copy, Default, PartialEq)]
        pub struct FirstRec {
            /// `A`.
            pub a: u8,
        }

        impl codec::Fixed for FirstRec {
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

        codec::members!(FirstRec { a: "A" });

        /// `SecondRec`.
        #[derive(Debug, Clone, Copy, Default, PartialEq)]
        pub struct SecondRec {
            /// `B`.
            pub b: u16,
        }

        impl codec::Fixed for SecondRec {
            const SIZE: usize = 2;

            #[inline]
            fn get(run: &[u8], at: usize) -> Self {
                Self {
                    b: codec::Fixed::get(run, at),
                }
            }

            #[inline]
            fn put(self, run: &mut [u8], at: usize) {
                codec::Fixed::put(self.b, run, at);
            }
        }

        codec::members!(SecondRec { b: "B" });

        /// `PairSeq`.
        #[derive(Debug, Clone, Copy, Default, PartialEq)]
        pub struct PairSeq {
            /// `FirstRec`.
            pub first_rec: FirstRec,
            /// `SecondRec`.
            pub second_rec: SecondRec,
        }

        impl codec::Fixed for PairSeq {
            const SIZE: usize = 3;

            #[inline]
            fn get(run: &[u8], at: usize) -> Self {
                Self {
                    first_rec: codec::Fixed::get(run, at),
                    second_rec: codec::Fixed::get(run, at + 1),
                }
            }

            #[inline]
            fn put(self, run: &mut [u8], at: usize) {
                codec::Fixed::put(self.first_rec, run, at);
                codec::Fixed::put(self.second_rec, run, at + 1);
            }
        }

        codec::members!(PairSeq { first_rec: "FirstRec", second_rec: "SecondRec" });

        /// `Choice`: one of its alternatives.
        #[derive(Debug, Clone, PartialEq)]
        pub enum Choice {
            /// `NumberRec`.
            NumberRec(NumberRec),
            /// `Numbers`: up to 255 elements.
            Numbers(codec::List<NumberRec>),
            /// `Again`.
            Again(Again),
            /// `PairSeq`.
            PairSeq(PairSeq),
        }

        impl Default for Choice {
            fn default() -> Self {
                Self::NumberRec(Default::default())
            }
        }

        impl codec::Composite for Choice {
            const MIN_LEN: usize = 2;

            fn encoded_len(&self) -> usize {
                match self {
                    Self::NumberRec(_) => 1 + 4,
                    Self::Numbers(value) => 1 + 1 + 4 * value.len(),
                    Self::Again(value) => 1 + codec::Composite::encoded_len(value),
                    Self::PairSeq(_) => 1 + 3,
                }
            }

            fn write(&self, output: &mut codec::Writer<'_>) -> Result<(), codec::EncodeError> {
                match self {
                    Self::NumberRec(value) => {
                        output.fixed(0_u8);
                        output.member("NumberRec", |output| { output.fixed(*value); Ok(()) })
                    }
                    Self::Numbers(value) => {
                        output.fixed(1_u8);
                        output.member("Numbers", |output| output.list::<u8, _>(value, 0, 255, |value, output| { output.fixed(*value); Ok(()) }))
                    }
                    Self::Again(value) => {
                        output.fixed(2_u8);
                        output.member("Again", |output| codec::Composite::write(value, output))
                    }
                    Self::PairSeq(value) => {
                        output.fixed(3_u8);
                        output.member("PairSeq", |output| { output.fixed(*value); Ok(()) })
                    }
                }
            }

            fn read(input: &mut codec::Reader<'_>) -> Result<Self, codec::DecodeError> {
                match input.tag::<u8>(4)? {
                    0 => input.member("NumberRec", codec::Reader::fixed).map(Self::NumberRec),
                    1 => input.member("Numbers", |input| input.list::<u8, _>(0, 255, 4, codec::Reader::fixed)).map(Self::Numbers),
                    2 => input.member("Again", codec::Composite::read).map(Self::Again),
                    _ => input.member("PairSeq", codec::Reader::fixed).map(Self::PairSeq),
                }
            }
        }

        codec::alternatives!(Choice {
            NumberRec: "NumberRec",
            Numbers: "Numbers" = |random| codec::arbitrary::list(random, 0, 255, codec::arbitrary::Arbitrary::arbitrary),
            Again: "Again", PairSeq: "PairSeq",
        });
    }

    /// `ReportEmptyVariant` (F034h).
    ///
    /// A variant without alternatives.
    ///
    /// Declared by `urn:example:Composites 1.0`.
    #[derive(Debug, Clone, Default, PartialEq)]
    pub struct ReportEmptyVariant {
        /// `Nothing`.
        pub nothing: report_empty_variant::Nothing,
        /// `AfterRec`.
        pub after_rec: report_empty_variant::AfterRec,
    }

    impl codec::Message for ReportEmptyVariant {
        const CODE: u16 = 0xF034;
        const NAME: &'static str = "ReportEmptyVariant";
        fn encoded_len(&self) -> usize {
            3 + codec::Composite::encoded_len(&self.nothing)
        }

        fn write(&self, output: &mut codec::Writer<'_>) -> Result<(), codec::EncodeError> {
            output.fixed(<Self as codec::Message>::CODE);
            output.member("Nothing", |output| codec::Composite::write(&self.nothing, output))?;
            output.fixed(self.after_rec);
            Ok(())
        }

        fn read(input: &mut codec::Reader<'_>) -> Result<Self, codec::DecodeError> {
            input.code(Self::CODE)?;
            let nothing = input.member("Nothing", codec::Composite::read)?;
            let after_rec = input.member("AfterRec", codec::Reader::fixed)?;
            Ok(Self { nothing, after_rec })
        }
    }

    codec::members!(ReportEmptyVariant { nothing: "Nothing", after_rec: "AfterRec" });

    /// The types inside [`ReportEmptyVariant`].
    pub mod report_empty_variant {
        use super::codec;

        /// `Nothing`: one of its alternatives.
        #[derive(Debug, Clone, Copy, Default, PartialEq)]
        pub struct Nothing;

        impl codec::Composite for Nothing {
            const MIN_LEN: usize = 1;

            fn encoded_len(&self) -> usize {
                1
            }

            fn write(&self, output: &mut codec::Writer<'_>) -> Result<(), codec::EncodeError> {
                output.fixed(0_u8);
                Ok(())
            }

            fn read(input: &mut codec::Reader<'_>) -> Result<Self, codec::DecodeError> {
                input.tag::<u8>(0)?;
                Ok(Self)
            }
        }

        codec::members!(Nothing {});

        /// `AfterRec`.
        #[derive(Debug, Clone, Copy, Default, PartialEq)]
        pub struct AfterRec {
            /// `After`.
            pub after: u8,
        }

        impl codec::Fixed for AfterRec {
            const SIZE: usize = 1;

            #[inline]
            fn get(run: &[u8], at: usize) -> Self {
                Self {
                    after: codec::Fixed::get(run, at),
                }
            }

            #[inline]
            fn put(self, run: &mut [u8], at: usize) {
                codec::Fixed::put(self.after, run, at);
            }
        }

        codec::members!(AfterRec { after: "After" });
    }

    /// `ReportOptional` (F035h).
    ///
    /// Optional composites.
    ///
    /// Declared by `urn:example:Composites 1.0`.
    #[derive(Debug, Clone, Default, PartialEq)]
    pub struct ReportOptional {
        /// `AlwaysRec`.
        pub always_rec: report_optional::AlwaysRec,
        /// `MaybeRec`: bit 0 of the presence vector.
        pub maybe_rec: Option<report_optional::MaybeRec>,
        /// `MaybeList`: up to 255 elements, bit 1 of the presence vector.
        pub maybe_list: Option<codec::List<report_optional::ItemRec>>,
        /// `MaybeVariant`: bit 2 of the presence vector.
        pub maybe_variant: Option<report_optional::MaybeVariant>,
    }

    impl codec::Message for ReportOptional {
        const CODE: u16 = 0xF035;
        const NAME: &'static str = "ReportOptional";
        fn encoded_len(&self) -> usize {
            8 + self.maybe_rec.as_ref().map_or(0, codec::Composite::encoded_len)
            + self.maybe_list.as_ref().map_or(0, |value| 1 + value.len())
            + self.maybe_variant.as_ref().map_or(0, codec::Composite::encoded_len)
        }

        fn write(&self, output: &mut codec::Writer<'_>) -> Result<(), codec::EncodeError> {
            let present = u32::from(self.maybe_rec.is_some())
            | u32::from(self.maybe_list.is_some()) << 1
            | u32::from(self.maybe_variant.is_some()) << 2;
            let run = output.run::<8>();
            codec::Fixed::put(<Self as codec::Message>::CODE, run, 0);
            codec::Fixed::put(present, run, 2);
            codec::Fixed::put(self.always_rec, run, 6);
            if let Some(value) = &self.maybe_rec {
                output.member("MaybeRec", |output| codec::Composite::write(value, output))?;
            }
            if let Some(value) = &self.maybe_list {
                output.member("MaybeList", |output| output.list::<u8, _>(value, 0, 255, |value, output| { output.fixed(*value); Ok(()) }))?;
            }
            if let Some(value) = &self.maybe_variant {
                output.member("MaybeVariant", |output| codec::Composite::write(value, output))?;
            }
            Ok(())
        }

        fn read(input: &mut codec::Reader<'_>) -> Result<Self, codec::DecodeError> {
            input.code(Self::CODE)?;
            let present = input.presence::<u32>(0x7)?;
            let always_rec = input.member("AlwaysRec", codec::Reader::fixed)?;
            let maybe_rec = input.optional(present & 0x1 != 0, "MaybeRec", codec::Composite::read)?;
            let maybe_list = input.optional(present & 0x2 != 0, "MaybeList", |input| input.list::<u8, _>(0, 255, 1, codec::Reader::fixed))?;
            let maybe_variant = input.optional(present & 0x4 != 0, "MaybeVariant", codec::Composite::read)?;
            Ok(Self { always_rec, maybe_rec, maybe_list, maybe_variant })
        }
    }

    codec::members!(ReportOptional {
        always_rec: "AlwaysRec", maybe_rec: "MaybeRec",
        maybe_list: "MaybeList" = |random| codec::arbitrary::optional(random, |random| codec::arbitrary::list(random, 0, 255, codec::arbitrary::Arbitrary::arbitrary)),
        maybe_variant: "MaybeVariant",
    });

    /// The types inside [`ReportOptional`].
    pub mod report_optional {
        use super::codec;

        /// `AlwaysRec`.
        #[derive(Debug, Clone, Copy, Default, PartialEq)]
        pub struct AlwaysRec {
            /// `A`.
            pub a: u16,
        }

        impl codec::Fixed for AlwaysRec {
            const SIZE: usize = 2;

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

        codec::members!(AlwaysRec { a: "A" });

        /// `MaybeRec`.
        #[derive(Debug, Clone, Default, PartialEq)]
        pub struct MaybeRec {
            /// `B`.
            pub b: u16,
            /// `C`: bit 0 of the presence vector.
            pub c: Option<u8>,
        }

        impl codec::Composite for MaybeRec {
            const MIN_LEN: usize = 3;
            fn encoded_len(&self) -> usize {
                3 + usize::from(self.c.is_some())
            }

            #[inline]
            fn write(&self, output: &mut codec::Writer<'_>) -> Result<(), codec::EncodeError> {
                if let Self { b, c: Some(c) } = self {
                    let run = output.run::<4>();
                    codec::Fixed::put(0x1_u8, run, 0);
                    codec::Fixed::put(*b, run, 1);
                    codec::Fixed::put(*c, run, 3);
                    return Ok(());
                }
                self.write_some(output);
                Ok(())
            }

            #[inline]
            fn read(input: &mut codec::Reader<'_>) -> Result<Self, codec::DecodeError> {
                let present = input.presence::<u8>(0x1)?;
                if present == 0x1 {
                    let run = input.run::<3>(&[("B", 2), ("C", 1)])?;
                    return Ok(Self {
                        b: codec::Fixed::get(run, 0), c: Some(codec::Fixed::get(run, 2)),
                    });
                }
                Self::read_some(input, present)
            }
        }

        impl MaybeRec {
            #[inline(never)]
            fn write_some(&self, output: &mut codec::Writer<'_>) {
                let present = u8::from(self.c.is_some());
                let run = output.run::<3>();
                codec::Fixed::put(present, run, 0);
                codec::Fixed::put(self.b, run, 1);
                output.optional(self.c);
            }

            #[inline(never)]
            fn read_some(place: &mut codec::Reader<'_>, present: u64) -> Result<Self, codec::DecodeError> {
                let mut input = place.clone();
                let b = input.member("B", codec::Reader::fixed)?;
                let c = input.optional(present & 0x1 != 0, "C", codec::Reader::fixed)?;
                *place = input;
                Ok(Self { b, c })
            }
        }

        codec::members!(MaybeRec { b: "B", c: "C" });

        /// `ItemRec`.
        #[derive(Debug, Clone, Copy, Default, PartialEq)]
        pub struct ItemRec {
            /// `D`.
            pub d: u8,
        }

        impl codec::Fixed for ItemRec {
            const SIZE: usize = 1;

            #[inline]
            fn get(run: &[u8], at: usize) -> Self {
                Self {
                    d: codec::Fixed::get(run, at),
                }
            }

            #[inline]
            fn put(self, run: &mut [u8], at: usize) {
                codec::Fixed::put(self.d, run, at);
            }
        }

        codec::members!(ItemRec { d: "D" });

        /// `LeftRec`.
        #[derive(Debug, Clone, Copy, Default, PartialEq)]
        pub struct LeftRec {
            /// `E`.
            pub e: u8,
        }

        impl codec::Fixed for LeftRec {
            const SIZE: usize = 1;

            #[inline]
            fn get(run: &[u8], at: usize) -> Self {
                Self {
                    e: codec::Fixed::get(run, at),
                }
            }

            #[inline]
            fn put(self, run: &mut [u8], at: usize) {
                codec::Fixed::put(self.e, run, at);
            }
        }

        codec::members!(LeftRec { e: "E" });

        /// `RightRec`.
        #[derive(Debug, Clone, Copy, Default, PartialEq)]
        pub struct RightRec {
            /// `F`.
            pub f: f32,
        }

        impl codec::Fixed for RightRec {
            const SIZE: usize = 4;

            #[inline]
            fn get(run: &[u8], at: usize) -> Self {
                Self {
                    f: codec::Fixed::get(run, at),
                }
            }

            #[inline]
            fn put(self, run: &mut [u8], at: usize) {
                codec::Fixed::put(self.f, run, at);
            }
        }

        codec::members!(RightRec { f: "F" = codec::arbitrary::f32 });

        /// `MaybeVariant`: one of its alternatives.
        #[derive(Debug, Clone, PartialEq)]
        pub enum MaybeVariant {
            /// `LeftRec`.
            LeftRec(LeftRec),
            /// `RightRec`.
            RightRec(RightRec),
        }

        impl Default for MaybeVariant {
            fn default() -> Self {
                Self::LeftRec(Default::default())
            }
        }

        impl codec::Composite for MaybeVariant {
            const MIN_LEN: usize = 3;

            fn encoded_len(&self) -> usize {
                match self {
                    Self::LeftRec(_) => 2 + 1,
                    Self::RightRec(_) => 2 + 4,
                }
            }

            fn write(&self, output: &mut codec::Writer<'_>) -> Result<(), codec::EncodeError> {
                match self {
                    Self::LeftRec(value) => {
                        output.fixed(0_u16);
                        output.member("LeftRec", |output| { output.fixed(*value); Ok(()) })
                    }
                    Self::RightRec(value) => {
                        output.fixed(1_u16);
                        output.member("RightRec", |output| { output.fixed(*value); Ok(()) })
                    }
                }
            }

            fn read(input: &mut codec::Reader<'_>) -> Result<Self, codec::DecodeError> {
                match input.tag::<u16>(2)? {
                    0 => input.member("LeftRec", codec::Reader::fixed).map(Self::LeftRec),
                    _ => input.member("RightRec", codec::Reader::fixed).map(Self::RightRec),
                }
            }
        }

        codec::alternatives!(MaybeVariant { LeftRec: "LeftRec", RightRec: "RightRec" });
    }

    /// `ReportManyOptional` (F036h).
    ///
    /// A wide presence vector.
    ///
    /// Declared by `urn:example:Composites 1.0`.
    #[derive(Debug, Clone, Default, PartialEq)]
    pub struct ReportManyOptional {
        /// `M0`: bit 0 of the presence vector.
        pub m0: Option<u16>,
        /// `M1`: bit 1 of the presence vector.
        pub m1: Option<u8>,
        /// `M2`: bit 2 of the presence vector.
        pub m2: Option<u16>,
        /// `M3`: bit 3 of the presence vector.
        pub m3: Option<u8>,
        /// `M4`: bit 4 of the presence vector.
        pub m4: Option<u16>,
        /// `M5`: bit 5 of the presence vector.
        pub m5: Option<u8>,
        /// `M6`: bit 6 of the presence vector.
        pub m6: Option<u16>,
        /// `M7`: bit 7 of the presence vector.
        pub m7: Option<u8>,
        /// `M8`: bit 8 of the presence vector.
        pub m8: Option<u16>,
        /// `M9`: bit 9 of the presence vector.
        pub m9: Option<u8>,
        /// `M10`: bit 10 of the presence vector.
        pub m10: Option<u16>,
        /// `M11`: bit 11 of the presence vector.
        pub m11: Option<u8>,
    }

    impl codec::Message for ReportManyOptional {
        const CODE: u16 = 0xF036;
        const NAME: &'static str = "ReportManyOptional";
        fn encoded_len(&self) -> usize {
            4 + 2 * usize::from(self.m0.is_some()) + usize::from(self.m1.is_some())
            + 2 * usize::from(self.m2.is_some()) + usize::from(self.m3.is_some())
            + 2 * usize::from(self.m4.is_some()) + usize::from(self.m5.is_some())
            + 2 * usize::from(self.m6.is_some()) + usize::from(self.m7.is_some())
            + 2 * usize::from(self.m8.is_some()) + usize::from(self.m9.is_some())
            + 2 * usize::from(self.m10.is_some()) + usize::from(self.m11.is_some())
        }

        #[inline]
        fn write(&self, output: &mut codec::Writer<'_>) -> Result<(), codec::EncodeError> {
            if let Self {
                m0: Some(m0), m1: Some(m1), m2: Some(m2), m3: Some(m3), m4: Some(m4), m5: Some(m5),
                m6: Some(m6), m7: Some(m7), m8: Some(m8), m9: Some(m9), m10: Some(m10),
                m11: Some(m11),
            } = self {
                let run = output.run::<22>();
                codec::Fixed::put(<Self as codec::Message>::CODE, run, 0);
                codec::Fixed::put(0xfff_u16, run, 2);
                codec::Fixed::put(*m0, run, 4);
                codec::Fixed::put(*m1, run, 6);
                codec::Fixed::put(*m2, run, 7);
                codec::Fixed::put(*m3, run, 9);
                codec::Fixed::put(*m4, run, 10);
                codec::Fixed::put(*m5, run, 12);
                codec::Fixed::put(*m6, run, 13);
                codec::Fixed::put(*m7, run, 15);
                codec::Fixed::put(*m8, run, 16);
                codec::Fixed::put(*m9, run, 18);
                codec::Fixed::put(*m10, run, 19);
                codec::Fixed::put(*m11, run, 21);
                return Ok(());
            }
            self.write_some(output);
            Ok(())
        }

        #[inline]
        fn read(input: &mut codec::Reader<'_>) -> Result<Self, codec::DecodeError> {
            input.code(Self::CODE)?;
            let present = input.presence::<u16>(0xfff)?;
            if present == 0xfff {
                let run = input.run::<18>(&[
                    ("M0", 2), ("M1", 1), ("M2", 2), ("M3", 1), ("M4", 2), ("M5", 1), ("M6", 2),
                    ("M7", 1), ("M8", 2), ("M9", 1), ("M10", 2), ("M11", 1),
                ])?;
                return Ok(Self {
                    m0: Some(codec::Fixed::get(run, 0)), m1: Some(codec::Fixed::get(run, 2)),
                    m2: Some(codec::Fixed::get(run, 3)), m3: Some(codec::Fixed::get(run, 5)),
                    m4: Some(codec::Fixed::get(run, 6)), m5: Some(codec::Fixed::get(run, 8)),
                    m6: Some(codec::Fixed::get(run, 9)), m7: Some(codec::Fixed::get(run, 11)),
                    m8: Some(codec::Fixed::get(run, 12)), m9: Some(codec::Fixed::get(run, 14)),
                    m10: Some(codec::Fixed::get(run, 15)), m11: Some(codec::Fixed::get(run, 17)),
                });
            }
            Self::read_some(input, present)
        }
    }

    impl ReportManyOptional {
        #[inline(never)]
        fn write_some(&self, output: &mut codec::Writer<'_>) {
            let present = u16::from(self.m0.is_some()) | u16::from(self.m1.is_some()) << 1
            | u16::from(self.m2.is_some()) << 2 | u16::from(self.m3.is_some()) << 3
            | u16::from(self.m4.is_some()) << 4 | u16::from(self.m5.is_some()) << 5
            | u16::from(self.m6.is_some()) << 6 | u16::from(self.m7.is_some()) << 7
            | u16::from(self.m8.is_some()) << 8 | u16::from(self.m9.is_some()) << 9
            | u16::from(self.m10.is_some()) << 10 | u16::from(self.m11.is_some()) << 11;
            let run = output.run::<4>();
            codec::Fixed::put(<Self as codec::Message>::CODE, run, 0);
            codec::Fixed::put(present, run, 2);
            output.optional(self.m0);
            output.optional(self.m1);
            output.optional(self.m2);
            output.optional(self.m3);
            output.optional(self.m4);
            output.optional(self.m5);
            output.optional(self.m6);
            output.optional(self.m7);
            output.optional(self.m8);
            output.optional(self.m9);
            output.optional(self.m10);
            output.optional(self.m11);
        }

        #[inline(never)]
        fn read_some(place: &mut codec::Reader<'_>, present: u64) -> Result<Self, codec::DecodeError> {
            let mut input = place.clone();
            let m0 = input.optional(present & 0x1 != 0, "M0", codec::Reader::fixed)?;
            let m1 = input.optional(present & 0x2 != 0, "M1", codec::Reader::fixed)?;
            let m2 = input.optional(present & 0x4 != 0, "M2", codec::Reader::fixed)?;
            let m3 = input.optional(present & 0x8 != 0, "M3", codec::Reader::fixed)?;
            let m4 = input.optional(present & 0x10 != 0, "M4", codec::Reader::fixed)?;
            let m5 = input.optional(present & 0x20 != 0, "M5", codec::Reader::fixed)?;
            let m6 = input.optional(present & 0x40 != 0, "M6", codec::Reader::fixed)?;
            let m7 = input.optional(present & 0x80 != 0, "M7", codec::Reader::fixed)?;
            let m8 = input.optional(present & 0x100 != 0, "M8", codec::Reader::fixed)?;
            let m9 = input.optional(present & 0x200 != 0, "M9", codec::Reader::fixed)?;
            let m10 = input.optional(present & 0x400 != 0, "M10", codec::Reader::fixed)?;
            let m11 = input.optional(present & 0x800 != 0, "M11", codec::Reader::fixed)?;
            *place = input;
            Ok(Self { m0, m1, m2, m3, m4, m5, m6, m7, m8, m9, m10, m11 })
        }
    }

    codec::members!(ReportManyOptional {
        m0: "M0", m1: "M1", m2: "M2", m3: "M3", m4: "M4", m5: "M5", m6: "M6", m7: "M7", m8: "M8",
        m9: "M9", m10: "M10", m11: "M11",
    });
}

#[doc(inline)]
#[allow(unused_imports)]
pub use v1_0::{
    QueryNothing, ReportTree, report_tree, ReportListOfLists, report_list_of_lists, SetChoice,
    set_choice, ReportEmptyVariant, report_empty_variant, ReportOptional, report_optional,
    ReportManyOptional,
};
