//! Turns the service definitions in `jsidl/services` into typed messages.

fn main() {}
