use ::jaus::codec;

/// The service `Octets`.
///
/// Strings and raw octets.
pub mod octets {
    use super::codec;

    /// What the service is called, whatever its version.
    pub const URN: &str = "urn:example:Octets";

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
        /// Handles `SetTexts`.
        fn set_texts(&mut self, message: super::SetTexts, call: &mut C);

        /// Handles `SetBlobs`.
        fn set_blobs(&mut self, message: super::SetBlobs, call: &mut C);
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
                0xF021 => call.receive(|message: super::SetTexts, call| self.service.set_texts(message, call)),
                0xF022 => call.receive(|message: super::SetBlobs, call| self.service.set_blobs(message, call)),
                _ => return None,
            })
        }
    }
}

/// The services of the set, by URN and version.
pub static SERVICES: &[codec::ServiceInfo] = &[
    codec::ServiceInfo {
        name: "Octets", id: octets::V1_0, inherits_from: None, inputs: &[0xF021, 0xF022],
        outputs: &[],
    },
];

/// The message types of the set, by code; of several with one code the newest first.
pub static MESSAGES: &[codec::MessageInfo] = &[
    codec::MessageInfo::of::<SetTexts>(&[octets::V1_0]),
    codec::MessageInfo::of::<SetBlobs>(&[octets::V1_0]),
];

/// The messages of services of version 1.0.
pub mod v1_0 {
    use super::codec;

    /// `SetTexts` (F021h).
    ///
    /// Strings.
    ///
    /// Declared by `urn:example:Octets 1.0`.
    #[derive(Debug, Clone, Default, PartialEq)]
    pub struct SetTexts {
        /// `Name`: at most 12 octets of text.
        pub name: codec::Text,
        /// `Comment`: at most 80 octets of text.
        pub comment: codec::Text,
        /// `Long`: 2 to 60000 octets of text, bit 0 of the presence vector.
        pub long: Option<codec::Text>,
        /// `Code`: at most 3 octets of text, bit 1 of the presence vector.
        pub code: Option<codec::Text>,
    }

    impl codec::Message for SetTexts {
        const CODE: u16 = 0xF021;
        const NAME: &'static str = "SetTexts";
        fn encoded_len(&self) -> usize {
            15 + 1 + self.comment.len() + self.long.as_ref().map_or(0, |value| 2 + value.len())
            + 3 * usize::from(self.code.is_some())
        }

        fn write(&self, output: &mut codec::Writer<'_>) -> Result<(), codec::EncodeError> {
            let present = u8::from(self.long.is_some()) | u8::from(self.code.is_some()) << 1;
            let run = output.run::<3>();
            codec::Fixed::put(<Self as codec::Message>::CODE, run, 0);
            codec::Fixed::put(present, run, 2);
            output.member("Name", |output| output.fixed_text(&self.name, 12))?;
            output.member("Comment", |output| output.text::<u8>(&self.comment, 0, 80))?;
            if let Some(value) = &self.long {
                output.member("Long", |output| output.text::<u16>(value, 2, 60000))?;
            }
            if let Some(value) = &self.code {
                output.member("Code", |output| output.fixed_text(value, 3))?;
            }
            Ok(())
        }

        fn read(input: &mut codec::Reader<'_>) -> Result<Self, codec::DecodeError> {
            input.code(Self::CODE)?;
            let present = input.presence::<u8>(0x3)?;
            let name = input.member("Name", |input| input.fixed_text(12))?;
            let comment = input.member("Comment", |input| input.text::<u8>(0, 80))?;
            let long = input.optional(present & 0x1 != 0, "Long", |input| input.text::<u16>(2, 60000))?;
            let code = input.optional(present & 0x2 != 0, "Code", |input| input.fixed_text(3))?;
            Ok(Self { name, comment, long, code })
        }
    }

    codec::members!(SetTexts {
        name: "Name" = |random| codec::arbitrary::fixed_text(random, 12),
        comment: "Comment" = |random| codec::arbitrary::text(random, 0, 80),
        long: "Long" = |random| codec::arbitrary::optional(random, |random| codec::arbitrary::text(random, 2, 60000)),
        code: "Code" = |random| codec::arbitrary::optional(random, |random| codec::arbitrary::fixed_text(random, 3)),
    });

    /// `SetBlobs` (F022h).
    ///
    /// Raw octets.
    ///
    /// Declared by `urn:example:Octets 1.0`.
    #[derive(Debug, Clone, Default, PartialEq)]
    pub struct SetBlobs {
        /// `Message`: 2 to 2147483647 octets, JAUS MESSAGE.
        pub message: codec::Bytes,
        /// `Raw`: up to 65535 octets, User Defined, bit 0 of the presence vector.
        pub raw: Option<codec::Bytes>,
        /// `Image`: up to 4294967295 octets.
        pub image: codec::FormattedBlob<set_blobs::ImageFormat>,
        /// `Extra`: up to 255 octets, bit 1 of the presence vector.
        pub extra: Option<codec::FormattedBlob<set_blobs::ExtraFormat>>,
    }

    impl codec::Message for SetBlobs {
        const CODE: u16 = 0xF022;
        const NAME: &'static str = "SetBlobs";
        fn encoded_len(&self) -> usize {
            4 + 4 + self.message.len() + self.raw.as_ref().map_or(0, |value| 2 + value.len())
            + 5 + self.image.data.len()
            + self.extra.as_ref().map_or(0, |value| 2 + value.data.len())
        }

        fn write(&self, output: &mut codec::Writer<'_>) -> Result<(), codec::EncodeError> {
            let present = u16::from(self.raw.is_some()) | u16::from(self.extra.is_some()) << 1;
            let run = output.run::<4>();
            codec::Fixed::put(<Self as codec::Message>::CODE, run, 0);
            codec::Fixed::put(present, run, 2);
            output.member("Message", |output| output.blob::<u32>(&self.message, 2, 2147483647))?;
            if let Some(value) = &self.raw {
                output.member("Raw", |output| output.blob::<u16>(value, 0, 65535))?;
            }
            output.member("Image", |output| output.formatted::<u32, _>(&self.image, 0, 4294967295))?;
            if let Some(value) = &self.extra {
                output.member("Extra", |output| output.formatted::<u8, _>(value, 0, 255))?;
            }
            Ok(())
        }

        fn read(input: &mut codec::Reader<'_>) -> Result<Self, codec::DecodeError> {
            input.code(Self::CODE)?;
            let present = input.presence::<u16>(0x3)?;
            let message = input.member("Message", |input| input.blob::<u32>(2, 2147483647))?;
            let raw = input.optional(present & 0x1 != 0, "Raw", |input| input.blob::<u16>(0, 65535))?;
            let image = input.member("Image", |input| input.formatted::<u32, _>(0, 4294967295))?;
            let extra = input.optional(present & 0x2 != 0, "Extra", |input| input.formatted::<u8, _>(0, 255))?;
            Ok(Self { message, raw, image, extra })
        }
    }

    codec::members!(SetBlobs {
        message: "Message" = |random| codec::arbitrary::blob(random, 2, 2147483647),
        raw: "Raw" = |random| codec::arbitrary::optional(random, |random| codec::arbitrary::blob(random, 0, 65535)),
        image: "Image" = |random| codec::arbitrary::formatted(random, 0, 4294967295),
        extra: "Extra" = |random| codec::arbitrary::optional(random, |random| codec::arbitrary::formatted(random, 0, 255)),
    });

    /// The types inside [`SetBlobs`].
    pub mod set_blobs {
        use super::codec;

        /// `Image Format`: a number with named values. Others are kept as they come.
        #[derive(Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
        pub struct ImageFormat(pub u8);

        impl ImageFormat {
            /// `JPEG` = 0.
            pub const JPEG: Self = Self(0);
            /// `PNG` = 2.
            pub const PNG: Self = Self(2);
        }

        codec::enumeration!(ImageFormat(u8), [(0, "JPEG"), (2, "PNG")]);

        /// `Extra Format`: a number with named values. Others are kept as they come.
        #[derive(Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
        pub struct ExtraFormat(pub u8);

        impl ExtraFormat {
            /// `User defined` = 1.
            pub const USER_DEFINED: Self = Self(1);
        }

        codec::enumeration!(ExtraFormat(u8), [(1, "User defined")]);
    }
}

#[doc(inline)]
#[allow(unused_imports)]
pub use v1_0::{SetTexts, SetBlobs, set_blobs};
