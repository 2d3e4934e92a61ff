//! Turns `services/*.xml` into typed messages.

fn main() {
    jsidl::build::Build::new()
        .path("services")
        .module("messages", "urn:example:")
        .run();
}
