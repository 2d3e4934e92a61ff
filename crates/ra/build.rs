//! Generates the messages of the Reference Architecture.

fn main() {
    jsidl::build::Build::new()
        .module("ra33", "urn:jaus-rs:ra33:")
        .run();
}
