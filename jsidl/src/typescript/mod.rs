//! Generates JavaScript modules with TypeScript declarations.
//!
//! [`files`] writes one module for each set of services, and the codec that they share. The modules
//! are plain ECMAScript with a declaration file beside each: pages and Node.js run them without a
//! build step, and TypeScript checks their use. They have no dependencies.
//!
//! A module has a namespace for each version (`v1_0`), and each message under its name for its
//! newest layout. The types inside a message are members of its class.

mod declarations;
mod layouts;

use heck::{ToLowerCamelCase, ToUpperCamelCase};

use crate::library::Library;
use crate::model::Service;
use crate::typed::lines::{Lines, quoted as quoted_with};
use crate::typed::names::{Spelling, version};
use crate::typed::{self, Plan, Set};

static SPELLING: Spelling = Spelling {
    member: |name| name.to_lower_camel_case(),
    value: |name| name.to_upper_camel_case(),
    // Of the base classes, and the name of the codec.
    reserved: &[&["codec", "constructor", "encode", "toString", "valueOf"]],
    suffix: "_",
};

/// The codec, by file name.
const RUNTIME: [(&str, &str); 4] = [
    ("codec.js", include_str!("runtime/codec.js")),
    ("codec.d.ts", include_str!("runtime/codec.d.ts")),
    ("codec/numbers.js", include_str!("runtime/codec/numbers.js")),
    ("codec/scaled.js", include_str!("runtime/codec/scaled.js")),
];

/// The files for the services that `wanted` selects, by name: `codec.js`, a module for each set such
/// as `core.js`, and a declaration file beside each.
///
/// ```
/// let mut loader = jsidl::Loader::new();
/// loader.catalogue();
/// let files = jsidl::typescript::files(&loader.load().library, |_| true);
/// let (_, declarations) = files.iter().find(|(name, _)| name == "core.d.ts").expect("the core set");
/// assert!(declarations.contains("class ReportIdentification extends codec.Message"));
/// ```
pub fn files(library: &Library, wanted: impl Fn(&Service) -> bool) -> Vec<(String, String)> {
    let runtime = RUNTIME.iter();
    let mut files: Vec<_> = runtime
        .map(|(name, text)| ((*name).to_owned(), (*text).to_owned()))
        .collect();
    for set in typed::sets(library, wanted, &SPELLING) {
        files.push((format!("{}.js", set.name), module(&set)));
        files.push((format!("{}.d.ts", set.name), declarations::module(&set)));
    }
    files
}

fn introduction(set: &Set<'_>) -> String {
    format!(
        "// The messages of {}, written by `jaus jsidl typescript`.",
        set.urn
    )
}

fn module(set: &Set<'_>) -> String {
    let mut out = Lines::new("  ");
    out.line(introduction(set));
    out.line("");
    out.line("import * as codec from \"./codec.js\";");
    for number in set.versions() {
        let namespace = version(number);
        out.line("");
        out.line(format!("export const {namespace} = {{}};"));
        for (plan, ident) in set.shared_in(number) {
            out.line(format!("{namespace}.{ident} = {};", path(plan)));
        }
        for plan in set.defined_in(number) {
            out.line("");
            layouts::message(&mut out, plan);
        }
    }
    out.line("");
    for (plan, ident) in newest(set) {
        out.line(format!("export const {ident} = {};", path(plan)));
    }
    out.line("");
    let all: Vec<_> = set.messages.iter().map(path).collect();
    out.open("export const messages = codec.messages([");
    for path in all {
        out.line(format!("{path},"));
    }
    out.close("]);");
    out.finish()
}

/// The messages with the names of their newest layouts.
fn newest<'s, 'm>(set: &'s Set<'m>) -> impl Iterator<Item = (&'s Plan<'m>, &'s str)> {
    let plans = set.messages.iter();
    plans.filter_map(|plan| Some((plan, plan.newest.as_deref()?)))
}

/// The definition's place in its module, such as `v1_0.ReportIdentification`.
fn path(plan: &Plan<'_>) -> String {
    let (number, ident) = plan.definition();
    format!("{}.{ident}", version(number))
}

/// A literal of a string.
fn quoted(text: &str) -> String {
    quoted_with(text, |out, character| {
        let mut units = [0; 2];
        for unit in character.encode_utf16(&mut units) {
            out.push_str(&format!("\\u{unit:04x}"));
        }
    })
}
