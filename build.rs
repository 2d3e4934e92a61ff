//! Turns the service definitions in `jsidl/services` into typed messages: the core set, and the sets
//! whose features are on.

/// The sets by feature, each with the beginning of its services' URNs.
const SETS: &[(&str, &str)] = &[
    ("mobility", "urn:jaus:jss:mobility:"),
    ("environment-sensing", "urn:jaus:jss:environmentSensing:"),
    ("manipulator", "urn:jaus:jss:manipulator:"),
    ("ugv", "urn:jaus:jss:ugv:"),
    ("hmi", "urn:jaus:jss:HMI:"),
    ("mission-spooler", "urn:jaus:jss:missionSpooler:"),
    ("iop", "urn:jaus:jss:iop:"),
    // The health monitor, which the profiles took over under its old name.
    ("iop", "urn:jaus:jss:exp:aeodrs:"),
    ("ground", "urn:jaus-rs:ground:"),
    ("ra33", "urn:jaus-rs:ra33:"),
];

fn main() {
    let mut build = jsidl::build::Build::new()
        .runtime("crate::codec")
        .module("core", "urn:jaus:jss:core:");
    for (feature, urn) in SETS {
        let module = feature.replace('-', "_");
        if std::env::var_os(format!("CARGO_FEATURE_{}", module.to_uppercase())).is_some() {
            build = build.module(&module, urn);
        }
    }
    build.run();
}
