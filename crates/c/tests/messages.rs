//! The committed headers with the messages of the examples are those of the definitions.

use std::path::Path;

use jaus_test_kit::snapshot;
use jsidl::{Loader, cpp};

/// The services of the examples.
const SERVICES: [&str; 2] = [
    "urn:jaus:jss:mobility:PrimitiveDriver",
    "urn:jaus:jss:mobility:VelocityStateSensor",
];

#[test]
fn the_messages_of_the_examples_are_those_of_the_definitions() {
    let mut loader = Loader::new();
    loader.catalogue();
    let library = loader.load().library;
    let files = cpp::files(&library, |service| SERVICES.contains(&&*service.id.urn));
    let examples = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples");
    for (name, text) in files {
        snapshot::check(examples.join(name), &text);
    }
}
