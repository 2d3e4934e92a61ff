//! Messages generated from small definitions, one module per language construct. The definitions
//! are those of the emitter's own tests.

macro_rules! constructs {
    ($($name:ident),* $(,)?) => {
        $(
            #[allow(missing_docs, unreachable_pub, dead_code, clippy::all, reason = "generated")]
            pub(crate) mod $name {
                include!(concat!(
                    env!("CARGO_MANIFEST_DIR"),
                    "/jsidl/tests/rust/",
                    stringify!($name),
                    ".rs"
                ));
            }
        )*

        /// The service sets of all constructs.
        pub(crate) static SETS: &[jaus::codec::ServiceSet] = &[$(
            jaus::codec::ServiceSet { services: $name::SERVICES, messages: $name::MESSAGES }
        ),*];
    };
}

constructs!(
    arrays, bits, centred, composites, controlled, machines, measures, names, numbers, octets,
    queries, sections, versions
);
