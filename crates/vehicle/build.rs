//! Generates the messages of the ground vehicle's services.

fn main() {
    jsidl::build::Build::new()
        .module("ground", "urn:jaus-rs:ground:")
        .run();
}
