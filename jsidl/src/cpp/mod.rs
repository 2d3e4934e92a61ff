//! Generates C++17 headers.
//!
//! [`files`] writes one header for each set of services, and the codec that they share. They are
//! header only, have no dependencies and need no exceptions. A message is a struct with the
//! nested types of the message; `codec::decode` and `codec::encode` return a value or an error.
//!
//! A header has a namespace for each version (`jaus::core::v1_0`), and each message under its name
//! for its newest layout.

mod structs;

use heck::ToSnakeCase;

use crate::library::Library;
use crate::model::Service;
use crate::typed::lines::{Lines, quoted as quoted_with};
use crate::typed::names::{Spelling, version};
use crate::typed::{self, Plan, Set, keywords};

static SPELLING: Spelling = Spelling {
    member: |name| name.to_snake_case(),
    value: |name| name.to_snake_case(),
    reserved: &[
        keywords::CPP,
        keywords::MACROS,
        // Names that the generated code uses.
        &[
            "chosen", "codec", "from_raw", "get_bits", "jaus", "json", "raw", "set_bits", "std",
            "visit",
        ],
    ],
    suffix: "_",
};

/// The codec, by path.
const RUNTIME: [(&str, &str); 3] = [
    ("jaus/codec.hpp", include_str!("runtime/codec.hpp")),
    (
        "jaus/codec/values.hpp",
        include_str!("runtime/codec/values.hpp"),
    ),
    ("jaus/json.hpp", include_str!("runtime/json.hpp")),
];

/// The headers for the services that `wanted` selects, by path: `jaus/codec.hpp`, `jaus/json.hpp`
/// and a header for each set such as `jaus/core.hpp`.
///
/// ```
/// let mut loader = jsidl::Loader::new();
/// loader.catalogue();
/// let files = jsidl::cpp::files(&loader.load().library, |_| true);
/// let (_, header) = files.iter().find(|(path, _)| path == "jaus/core.hpp").expect("the core set");
/// assert!(header.contains("struct ReportIdentification {"));
/// ```
pub fn files(library: &Library, wanted: impl Fn(&Service) -> bool) -> Vec<(String, String)> {
    let runtime = RUNTIME.iter();
    let mut files: Vec<_> = runtime
        .map(|(name, text)| ((*name).to_owned(), (*text).to_owned()))
        .collect();
    for set in typed::sets(library, wanted, &SPELLING) {
        files.push((format!("jaus/{}.hpp", set.name), header(&set)));
    }
    files
}

fn header(set: &Set<'_>) -> String {
    let guard = format!("JAUS_MESSAGES_{}_HPP", set.name.to_uppercase());
    let mut out = Lines::new("    ");
    out.line(format!(
        "// The messages of {}, written by `jaus jsidl cpp`.",
        set.urn
    ));
    out.line("");
    out.line(format!("#ifndef {guard}\n#define {guard}"));
    out.line("");
    out.line("#include \"codec.hpp\"");
    out.line("");
    out.line(format!("namespace jaus::{} {{", set.name));
    for number in set.versions() {
        let namespace = version(number);
        out.line("");
        out.line(format!("namespace {namespace} {{"));
        for (plan, ident) in set.shared_in(number) {
            out.line("");
            out.line(format!("using {ident} = {};", path(plan)));
        }
        for plan in set.defined_in(number) {
            out.line("");
            structs::message(&mut out, plan);
        }
        out.line("");
        out.line(format!("}} // namespace {namespace}"));
    }
    out.line("");
    for plan in &set.messages {
        if let Some(ident) = &plan.newest {
            out.line(format!("using {ident} = {};", path(plan)));
        }
    }
    out.line("");
    out.line("/// All messages, older versions first.");
    let all: Vec<_> = set.messages.iter().map(path).collect();
    out.open("using messages = codec::Types<");
    for (place, path) in all.iter().enumerate() {
        let end = if place + 1 == all.len() { ">;" } else { "," };
        out.line(format!("{path}{end}"));
    }
    out.end();
    out.line("");
    out.line(format!("}} // namespace jaus::{}", set.name));
    out.line("");
    out.line("#endif");
    out.finish()
}

/// The definition's place in its set, such as `v1_0::ReportIdentification`.
fn path(plan: &Plan<'_>) -> String {
    let (number, ident) = plan.definition();
    format!("{}::{ident}", version(number))
}

/// A literal of a string.
fn quoted(text: &str) -> String {
    let literal = quoted_with(text, |out, character| {
        let mut octets = [0; 4];
        for octet in character.encode_utf8(&mut octets).bytes() {
            // Three digits, so that a digit may follow.
            out.push_str(&format!("\\{octet:03o}"));
        }
    });
    // Three characters that begin with ?? meant another one until C++17.
    literal.replace("??", "?\\?")
}
