//! Arbitrary text through the loader, which must answer any input with diagnostics; and each
//! definition that it accepts through the codec, with some octets, and through every emitter. The
//! text may be in the compact form; XML is brought into that form and back.
#![no_main]

use jaus_fuzz::{octets_come_back, with_code};
use jsidl::docs::{self, Format};
use jsidl::model::Service;
use jsidl::ros::{Package, PackageName};
use jsidl::{
    Library, Loader, cpp, diff, dynamic, explain, format, lua, machine, rust, schema, typescript,
};
use libfuzzer_sys::fuzz_target;

/// Message bodies to try: zeros satisfy most fields, ones request large counts.
const BODIES: [[u8; 32]; 3] = [[0; 32], [1; 32], [0xFF; 32]];

/// Most octets of text that is passed to the emitters: their output is many times as long.
const LONGEST: usize = 16 << 10;

/// Runs every emitter: for Rust, C++, TypeScript, ROS 2, Wireshark, pages, JSON Schema, drawings of machines,
/// explanations of messages, and the comparison with nothing and with itself.
fn emit(library: &Library) {
    let services: Vec<&Service> = library.services().map(AsRef::as_ref).collect();
    let module = rust::module(library, services.iter().copied(), "::jaus::codec");
    let script = lua::dissector(library);
    assert!(!module.is_empty() && !script.is_empty());
    for format in [Format::Html, Format::Markdown] {
        let pages = docs::pages(library, |_| true, format);
        assert_eq!(pages.len(), 1 + services.len());
        assert!(
            pages.iter().all(|page| !page.path.contains('/')),
            "{pages:?}"
        );
    }
    let schemas = schema::files(library, |_| true);
    assert_eq!(schemas.len(), services.len());
    for (service, (_, schema)) in services.iter().zip(schemas) {
        let text = schema.to_string();
        let read = serde_json::from_str::<serde_json::Value>(&text).ok();
        assert_eq!(read, Some(schema), "{}", service.id);
    }
    assert!(!cpp::files(library, |_| true).is_empty());
    assert!(!typescript::files(library, |_| true).is_empty());
    ros(library);
    for service in &services {
        for machine in library.machines(service) {
            assert!(!machine::dot(&machine).is_empty() && !machine::mermaid(&machine).is_empty());
        }
        for message in service.messages() {
            for body in BODIES {
                let octets = with_code(message.code, &body);
                let (rows, _) = explain::explain_as(message, &octets);
                assert!(!explain::table(&rows).is_empty());
            }
        }
    }
    assert!(diff::compare(library, library, |_| true).is_empty());
    let nothing = Library::default();
    diff::compare(&nothing, library, |_| true);
    diff::compare(library, &nothing, |_| true);
}

/// Every message has a type in the ROS 2 package, and whatever can be decoded has a value.
fn ros(library: &Library) {
    let package = Package::of(library, |_| true, &PackageName::default());
    assert!(package.files().len() >= 2);
    for service in library.services() {
        for message in service.messages() {
            let interface = package.interface(&service.id, message);
            let interface = interface.expect("every service was selected");
            for body in BODIES {
                if let Ok(value) = dynamic::decode(message, &with_code(message.code, &body)) {
                    assert!(interface.value(&value).is_ok(), "{}", message.name);
                }
            }
        }
    }
}

/// A formatted text has the same format, and the same definitions.
fn format_twice(text: &str) {
    if let Ok(formatted) = format::format("fuzz.xml", text) {
        assert_eq!(format::format("fuzz.xml", &formatted), Ok(formatted));
    }
    let _ = format::strict("fuzz.xml", text);
}

/// A text in the compact form is written there as it was read, and can be read back.
fn convert_twice(text: &str) {
    if let Ok(compact) = format::compact("fuzz.xml", text) {
        assert_eq!(format::compact("fuzz.csd", &compact), Ok(compact.clone()));
        let mut loader = Loader::new();
        loader.catalogue().text("fuzz.csd", &compact);
        let _ = loader.xml();
    }
}

fuzz_target!(|text: &str| {
    let mut loader = Loader::new();
    loader.text("fuzz.xml", text);
    let loaded = loader.load();
    for diagnostic in loaded.diagnostics.iter() {
        let sentence = diagnostic.to_string();
        assert!(sentence.starts_with("fuzz.xml:"), "{sentence}");
    }
    for message in loaded
        .library
        .services()
        .flat_map(|service| service.messages())
    {
        for body in BODIES {
            for length in [0, 1, 2, 8, body.len()] {
                octets_come_back(message, &with_code(message.code, &body[..length]));
            }
        }
    }
    if text.len() <= LONGEST {
        emit(&loaded.library);
        format_twice(text);
        convert_twice(text);
    }
});
