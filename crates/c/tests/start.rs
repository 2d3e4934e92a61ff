//! The start of a component on a host whose node does not answer.
#![cfg(unix)]
#![allow(
    clippy::unwrap_used,
    clippy::disallowed_methods,
    reason = "a test with threads and a socket"
)]

use std::ffi::CString;
use std::os::unix::net::UnixListener;
use std::thread;

use jaus_c::{
    JAUS_KIND_VEHICLE, JausAddress, JausComponent, JausNode, JausStatus, jaus_component_address,
    jaus_component_create, jaus_component_free, jaus_component_start, jaus_node_free,
    jaus_node_of_host,
};

/// A component that is described on the node of a host at a socket.
fn component_at(socket: &std::path::Path) -> (JausNode, JausComponent) {
    let address = CString::new(socket.to_str().unwrap()).unwrap();
    let (mut node, mut component) = (JausNode { id: 0 }, JausComponent { id: 0 });
    // SAFETY: a text that ends with a 0, and a handle that can be written.
    let status = unsafe { jaus_node_of_host(address.as_ptr(), &raw mut node) };
    assert_eq!(status, JausStatus::Ok);
    let name = c"Rover".as_ptr();
    // SAFETY: as above.
    let status =
        unsafe { jaus_component_create(node, 33, JAUS_KIND_VEHICLE, name, &raw mut component) };
    assert_eq!(status, JausStatus::Ok);
    (node, component)
}

fn status_of(component: JausComponent) -> JausStatus {
    let mut address = JausAddress {
        subsystem: 0,
        node: 0,
        component: 0,
    };
    // SAFETY: the address can be written.
    unsafe { jaus_component_address(component, &raw mut address) }
}

/// A callback of another component may ask while the start waits, and must not wait for it: it would hold
/// up the thread that brings the answer of the host.
#[test]
fn a_component_that_starts_refuses_calls_and_can_be_freed() {
    let folder = tempfile::tempdir().unwrap();
    let socket = folder.path().join("node.sock");
    let listener = UnixListener::bind(&socket).unwrap();
    let (node, component) = component_at(&socket);
    let starting = thread::spawn(move || jaus_component_start(component));
    // A host that does not answer, until this is dropped.
    let (silent, _) = listener.accept().unwrap();
    assert_eq!(status_of(component), JausStatus::WrongState);
    assert_eq!(jaus_component_start(component), JausStatus::WrongState);
    assert_eq!(jaus_component_free(component), JausStatus::Ok);
    assert_eq!(status_of(component), JausStatus::InvalidHandle);
    drop(silent);
    assert_eq!(starting.join().unwrap(), JausStatus::Stopped);
    assert_eq!(jaus_node_free(node), JausStatus::Ok);
}
