use ::jaus::codec;

/// The service `Sections`.
///
/// Headers and footers.
pub mod sections {
    use super::codec;

    /// What the service is called, whatever its version.
    pub const URN: &str = "urn:example:Sections";

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
        /// Handles `ReportSections`.
        fn report_sections(&mut self, message: super::ReportSections, call: &mut C);
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
                0xF071 => call.receive(|message: super::ReportSections, call| self.service.report_sections(message, call)),
                _ => return None,
            })
        }
    }
}

/// The services of the set, by URN and version.
pub static SERVICES: &[codec::ServiceInfo] = &[
    codec::ServiceInfo {
        name: "Sections", id: sections::V1_0, inherits_from: None, inputs: &[0xF071], outputs: &[],
    },
];

/// The message types of the set, by code; of several with one code the newest first.
pub static MESSAGES: &[codec::MessageInfo] = &[
    codec::MessageInfo::of::<ReportSections>(&[sections::V1_0]),
];

/// The messages of services of version 1.0.
pub mod v1_0 {
    use super::codec;

    /// `ReportSections` (F071h).
    ///
    /// A message with its own header and footer.
    ///
    /// Declared by `urn:example:Sections 1.0`.
    #[derive(Debug, Clone, Default, PartialEq)]
    pub struct ReportSections {
        /// `header`.
        pub header: report_sections::Header,
        /// `body`: up to 255 elements.
        pub body: codec::List<report_sections::ItemRec>,
        /// `footer`.
        pub footer: report_sections::Footer,
    }

    impl codec::Message for ReportSections {
        const CODE: u16 = 0xF071;
        const NAME: &'static str = "ReportSections";
        fn encoded_len(&self) -> usize {
            5 + 1 + self.body.len()
        }

        fn write(&self, output: &mut codec::Writer<'_>) -> Result<(), codec::EncodeError> {
            let run = output.run::<3>();
            codec::Fixed::put(<Self as codec::Message>::CODE, run, 0);
            codec::Fixed::put(self.header, run, 2);
            output.member("body", |output| output.list::<u8, _>(&self.body, 0, 255, |value, output| { output.fixed(*value); Ok(()) }))?;
            output.fixed(self.footer);
            Ok(())
        }

        fn read(input: &mut codec::Reader<'_>) -> Result<Self, codec::DecodeError> {
            input.code(Self::CODE)?;
            let header = input.member("header", codec::Reader::fixed)?;
            let body = input.member("body", |input| input.list::<u8, _>(0, 255, 1, codec::Reader::fixed))?;
            let footer = input.member("footer", codec::Reader::fixed)?;
            Ok(Self { header, body, footer })
        }
    }

    codec::members!(ReportSections {
        header: "header",
        body: "body" = |random| codec::arbitrary::list(random, 0, 255, codec::arbitrary::Arbitrary::arbitrary),
        footer: "footer",
    });

    /// The types inside [`ReportSections`].
    pub mod report_sections {
        use super::codec;

        /// `header`.
        #[derive(Debug, Clone, Copy, Default, PartialEq)]
        pub struct Header {
            /// `Priority`.
            pub priority: u8,
        }

        impl codec::Fixed for Header {
            const SIZE: usize = 1;

            #[inline]
            fn get(run: &[u8], at: usize) -> Self {
                Self {
                    priority: codec::Fixed::get(run, at),
                }
            }

            #[inline]
            fn put(self, run: &mut [u8], at: usize) {
                codec::Fixed::put(self.priority, run, at);
            }
        }

        codec::members!(Header { priority: "Priority" });

        /// `ItemRec`.
        #[derive(Debug, Clone, Copy, Default, PartialEq)]
        pub struct ItemRec {
            /// `Item`.
            pub item: u8,
        }

        impl codec::Fixed for ItemRec {
            const SIZE: usize = 1;

            #[inline]
            fn get(run: &[u8], at: usize) -> Self {
                Self {
                    item: codec::Fixed::get(run, at),
                }
            }

            #[inline]
            fn put(self, run: &mut [u8], at: usize) {
                codec::Fixed::put(self.item, run, at);
            }
        }

        codec::members!(ItemRec { item: "Item" });

        /// `footer`.
        #[derive(Debug, Clone, Copy, Default, PartialEq)]
        pub struct Footer {
            /// `Checksum`.
            pub checksum: u16,
        }

        impl codec::Fixed for Footer {
            const SIZE: usize = 2;

            #[inline]
            fn get(run: &[u8], at: usize) -> Self {
                Self {
                    checksum: codec::Fixed::get(run, at),
                }
            }

            #[inline]
            fn put(self, run: &mut [u8], at: usize) {
                codec::Fixed::put(self.checksum, run, at);
            }
        }

        codec::members!(Footer { checksum: "Checksum" });
    }
}

#[doc(inline)]
#[allow(unused_imports)]
pub use v1_0::{ReportSections, report_sections};
