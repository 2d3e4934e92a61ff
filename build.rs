//! Turns the service definitions in `jsidl/services` into typed messages.

fn main() {
    let mut build = jsidl::build::Build::new()
        .runtime("crate::codec")
        .module("core", "urn:jaus:jss:core:");
    if std::env::var_os("CARGO_FEATURE_MOBILITY").is_some() {
        build = build.module("mobility", "urn:jaus:jss:mobility:");
    }
    if std::env::var_os("CARGO_FEATURE_GROUND").is_some() {
        build = build.module("ground", "urn:jaus-rs:ground:");
    }
    build.run();
}
