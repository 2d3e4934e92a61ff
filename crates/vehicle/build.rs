//! Generates the messages of the ground vehicle's services, and of handing over control.

fn main() {
    jsidl::build::Build::new()
        .module("ground", "urn:jaus-rs:ground:")
        .module("handoff", "urn:jaus:jss:iop:EnhancedAccessControl")
        .module("handoff", "urn:jaus:jss:iop:HandoffController")
        .run();
}
