//! Permitted listener addresses of a node, and permitted clients.

use std::fs::{self, Permissions};
use std::os::unix::fs::PermissionsExt;
use std::os::unix::net::UnixListener;

use jaus::node::{Address, HostError, Node, StartError};

use crate::local::place::Place;

fn error(place: &Place) -> String {
    match Node::start(place.config()) {
        Err(error @ StartError::Local(_)) => error.to_string(),
        other => panic!("{other:?}"),
    }
}

#[tokio::test]
async fn the_socket_is_its_owners_alone_and_goes_with_the_node() {
    let place = Place::new();
    let node = place.node();
    let mode = fs::metadata(place.path()).unwrap().permissions().mode();
    assert_eq!(mode & 0o777, 0o600);
    node.shutdown().await;
    assert!(!place.path().exists());
}

#[tokio::test]
async fn the_socket_is_its_groups_too_if_the_settings_say_so() {
    let place = Place::new();
    let mut config = place.config();
    config.local_group = true;
    let _node = Node::start(config).unwrap();
    let mode = fs::metadata(place.path()).unwrap().permissions().mode();
    assert_eq!(mode & 0o777, 0o660);
}

#[tokio::test]
async fn a_directory_that_others_can_change_is_refused_with_the_remedy() {
    let place = Place::new();
    let directory = place.path().parent().unwrap().to_owned();
    fs::set_permissions(&directory, Permissions::from_mode(0o775)).unwrap();
    let error = error(&place);
    assert!(
        error.contains("mode is 775") && error.contains("chmod 700"),
        "{error}"
    );
    // In a sticky directory, no other user can replace our socket.
    fs::set_permissions(&directory, Permissions::from_mode(0o1777)).unwrap();
    place.node();
}

#[tokio::test]
async fn a_directory_that_is_not_there_is_named_with_the_remedy() {
    let place = Place::new();
    fs::remove_dir(place.path().parent().unwrap()).unwrap();
    let error = error(&place);
    assert!(
        error.contains("does not exist") && error.contains("mkdir"),
        "{error}"
    );
}

#[tokio::test]
async fn a_living_nodes_socket_is_not_taken_and_a_dead_ones_is() {
    let place = Place::new();
    let first = place.node();
    let error = error(&place);
    let pid = format!("(process {})", std::process::id());
    assert!(
        error.contains("another node") && error.contains(&pid),
        "{error}"
    );
    place.host().attach(1).await.unwrap();
    first.shutdown().await;

    let stale = Place::new();
    drop(UnixListener::bind(stale.path()).unwrap());
    assert!(stale.path().exists());
    let _second = stale.node();
    stale.host().attach(1).await.unwrap();
}

#[tokio::test]
async fn a_file_in_the_sockets_place_is_left_alone() {
    let place = Place::new();
    fs::write(place.path(), "precious").unwrap();
    let error = error(&place);
    assert!(error.contains("is not a socket"), "{error}");
    assert_eq!(fs::read_to_string(place.path()).unwrap(), "precious");
}

#[tokio::test]
async fn where_no_node_is_the_component_is_told_how_to_start_one() {
    let place = Place::new();
    let error = place.host().attach(1).await.unwrap_err().to_string();
    assert!(error.contains("no node serves components at"), "{error}");
    assert!(error.contains("jaus node --local"), "{error}");
    drop(UnixListener::bind(place.path()).unwrap());
    assert!(matches!(
        place.host().attach(1).await,
        Err(HostError::Link(_))
    ));
}

#[tokio::test]
async fn a_port_of_loopback_serves_as_well() {
    // A port that was free just now.
    let port = std::net::TcpListener::bind("127.0.0.1:0")
        .unwrap()
        .local_addr()
        .unwrap();
    let place = Place::new();
    let node = Node::start(place.config().local(Address::Tcp(port))).unwrap();
    let mut here = node.attach(1).unwrap();
    let there = jaus::node::Host::at(Address::Tcp(port))
        .attach(33)
        .await
        .unwrap();
    there
        .send(crate::local::place::message(&there, here.id(), b"x"))
        .unwrap();
    assert_eq!(
        crate::local::place::receive(&mut here).await.source,
        there.id()
    );
}
