//! Generates the messages of the ground vehicle's services, of handing over control, and of its range
//! sensor.

fn main() {
    jsidl::build::Build::new()
        .module("ground", "urn:jaus-rs:ground:")
        .module("handoff", "urn:jaus:jss:iop:EnhancedAccessControl")
        .module("handoff", "urn:jaus:jss:iop:HandoffController")
        .module(
            "environment_sensing",
            "urn:jaus:jss:environmentSensing:RangeSensor",
        )
        .run();
}
