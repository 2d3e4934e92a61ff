//! Generates typed messages from the service definitions in `jsidl/services`: the core set, and the
//! sets whose feature is on; and the table of what the sender of each message of all sets needs.

use std::path::PathBuf;
use std::{env, fs};

use jsidl::Loader;
use jsidl::permission::Permissions;

/// The features, with the modules that each adds and the beginnings of their services' URNs.
const SETS: &[(&str, &[(&str, &str)])] = &[
    (
        "MOBILITY",
        &[
            ("mobility", "urn:jaus:jss:mobility:"),
            // The elements of lists, which no service of the set declares.
            ("mobility", "urn:jaus-rs:mobility:"),
        ],
    ),
    (
        "EVERY_SET",
        &[
            ("environment_sensing", "urn:jaus:jss:environmentSensing:"),
            ("manipulator", "urn:jaus:jss:manipulator:"),
            ("ugv", "urn:jaus:jss:ugv:"),
            ("hmi", "urn:jaus:jss:HMI:"),
            ("mission_spooler", "urn:jaus:jss:missionSpooler:"),
            ("iop", "urn:jaus:jss:iop:"),
            // The health monitor, which the profiles took over under its old name.
            ("iop", "urn:jaus:jss:exp:aeodrs:"),
        ],
    ),
];

fn main() {
    let mut build = jsidl::build::Build::new()
        .runtime("crate::codec")
        // Peers of mobility 1.0 know no other messages than those that 1.1 calls deprecated.
        .warn_of_deprecated(false)
        .module("core", "urn:jaus:jss:core:")
        // Our own part of it, which every component offers.
        .module("core", "urn:jaus-rs:core:");
    for (feature, modules) in SETS {
        if env::var_os(format!("CARGO_FEATURE_{feature}")).is_some() {
            for (module, urn) in *modules {
                build = build.module(module, urn);
            }
        }
    }
    build.run();
    permissions();
}

/// Writes the table of permissions, for `src/rights`.
fn permissions() {
    let mut loader = Loader::new();
    loader.catalogue();
    let loaded = loader.load();
    for error in loaded.diagnostics.errors() {
        println!("cargo::error={error}");
    }
    let permissions = Permissions::of(&loaded.library);
    for message in &permissions.missing {
        let (name, place) = (&message.name, &message.location);
        println!("cargo::error={place}: {name} lacks `own:permission`");
    }
    let folder = env::var_os("OUT_DIR")
        .map(PathBuf::from)
        .unwrap_or_default();
    if let Err(error) = fs::write(folder.join("permissions.txt"), permissions.to_string()) {
        println!("cargo::error=permissions.txt: {error}");
    }
}
