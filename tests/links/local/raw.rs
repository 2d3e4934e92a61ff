//! Raw connections: the test reads and writes the octets itself.

use std::io::{Read, Write};
use std::os::unix::net::{UnixListener, UnixStream};
use std::time::Duration;

use jaus::address::JausId;
use jaus::link::local::record::{Head, Reason, Record};
use jaus::node::{ComponentEvent, Config, Departure, HostError, Node};
use jaus::wire::Flags;
use jaus_test_kit::group::own_group;
use jaus_test_kit::waiting::within_limit;

use crate::local::place::{Place, component_event, message, receive};

fn write(stream: &mut UnixStream, record: &Record) {
    let mut octets = Vec::new();
    record.encode_head(&mut octets);
    octets.extend_from_slice(&record.payload);
    stream.write_all(&octets).unwrap();
}

/// A message for 101.1.1.
fn send(number: u32) -> Record {
    let head = Head::Send {
        flags: Flags::default(),
        handle: number.into(),
        destination: JausId::new(101, 1, 1),
    };
    let payload = [&[0x00, 0x4D], &number.to_le_bytes()[..]].concat().into();
    Record { head, payload }
}

fn read(stream: &mut UnixStream) -> Record {
    let mut length = [0; 4];
    stream.read_exact(&mut length).unwrap();
    let mut octets = vec![0; u32::from_le_bytes(length) as usize];
    stream.read_exact(&mut octets).unwrap();
    Record::decode(octets.into()).unwrap()
}

/// Runs a blocking function in its own thread, so the node keeps running.
async fn blocking<T: Send + 'static>(what: impl FnOnce() -> T + Send + 'static) -> T {
    within_limit(tokio::task::spawn_blocking(what))
        .await
        .unwrap()
}

#[tokio::test]
async fn what_a_component_sent_before_it_went_away_arrives_though_nothing_can_be_written_to_it() {
    const MESSAGES: u32 = 100;
    let place = Place::new();
    let node = place.node();
    let mut here = node.attach(1).unwrap();
    let mut events = node.component_events();
    let path = place.path();
    let mut there = blocking(move || {
        let mut stream = UnixStream::connect(path).unwrap();
        write(
            &mut stream,
            &Record::with_text(Head::hello(JausId::new(0, 0, 33)), "raw"),
        );
        let welcome = read(&mut stream);
        assert!(matches!(welcome.head, Head::Welcome { .. }), "{welcome:?}");
        stream
    })
    .await;
    // Without a pause in which the node could read or write.
    let there_id = JausId::new(101, 1, 33);
    for number in 0..MESSAGES {
        write(&mut there, &send(number));
    }
    drop(there);
    here.send(message(&here, there_id, b"nobody reads this"))
        .unwrap();
    for number in 0..MESSAGES {
        let heard = receive(&mut here).await;
        assert_eq!(heard.payload[2..], number.to_le_bytes());
    }
    let gone = |event: &ComponentEvent| matches!(event, ComponentEvent::Detached { .. });
    let gone = component_event(&mut events, gone).await;
    let ComponentEvent::Detached { id, why, .. } = gone else {
        panic!("{gone:?}")
    };
    assert_eq!((id, why), (there_id, Departure::Vanished));
}

#[tokio::test]
async fn a_component_of_an_older_release_is_refused_with_the_reason() {
    let place = Place::new();
    let _node = place.node();
    let path = place.path();
    let refused = blocking(move || {
        let mut stream = UnixStream::connect(path).unwrap();
        // Component 33 in version 1, with a name.
        stream
            .write_all(b"\x0b\0\0\0\x01JAUS\x01\0\x21old")
            .unwrap();
        read(&mut stream)
    })
    .await;
    assert_eq!(refused.head, Head::Refused(Reason::Version));
    let why = refused.text();
    assert!(
        why.contains("uses version 1") && why.contains("same release"),
        "{why}"
    );
}

#[tokio::test]
async fn a_node_of_an_older_release_is_named_as_the_reason() {
    let place = Place::new();
    let listener = UnixListener::bind(place.path()).unwrap();
    let node = tokio::task::spawn_blocking(move || {
        let (mut stream, _) = listener.accept().unwrap();
        let mut hello = [0; 15];
        stream.read_exact(&mut hello).unwrap();
        // A version 1 node reads up to here, sees another version, and refuses.
        assert_eq!(hello[4..11], *b"\x01JAUS\x05\x01");
        assert_eq!(hello[11..], JausId::new(0, 0, 33).to_wire());
        stream.write_all(b"\x05\0\0\0\x12\x01old").unwrap();
    });
    let error = within_limit(place.host().attach(33)).await.unwrap_err();
    let HostError::Refused { reason, words } = error else {
        panic!("{error}")
    };
    assert_eq!((reason, words.as_str()), (Reason::Version, "old"));
    node.await.unwrap();
}

#[tokio::test]
async fn a_connection_that_begins_with_something_else_is_closed() {
    let place = Place::new();
    let node = place.node();
    let path = place.path();
    let read = blocking(move || {
        let mut stream = UnixStream::connect(path).unwrap();
        stream.write_all(b"GET / HTTP/1.1\r\n\r\n").unwrap();
        stream.read(&mut [0; 16]).unwrap_or(0)
    })
    .await;
    assert_eq!(read, 0);
    assert!(node.components().is_empty());
    // The same for a message before the first record.
    let path = place.path();
    let read = blocking(move || {
        let mut stream = UnixStream::connect(path).unwrap();
        write(&mut stream, &send(1));
        stream.read(&mut [0; 16]).unwrap_or(0)
    })
    .await;
    assert_eq!(read, 0);
}

#[tokio::test]
async fn silent_connections_keep_no_component_out() {
    let place = Place::new();
    let _node = place.node();
    let path = place.path();
    let connect = move |_| UnixStream::connect(&path).unwrap();
    let silent = blocking(move || (0..100).map(connect).collect::<Vec<_>>()).await;
    // Sooner than the node waits for what a connection says.
    let attached = tokio::time::timeout(Duration::from_secs(3), place.host().attach(33)).await;
    attached.unwrap().unwrap();
    drop(silent);
}

#[tokio::test]
async fn a_component_is_told_of_the_parts_of_a_large_message() {
    let (place, group) = (Place::new(), own_group());
    let _node = Node::start(place.config().group(group)).unwrap();
    let far = Node::start(Config::loopback(102, 1).group(group)).unwrap();
    let mut camera = far.attach(1).unwrap();
    let (path, id, source) = (place.path(), JausId::new(101, 1, 33), camera.id());
    let mut stream = blocking(move || {
        let mut stream = UnixStream::connect(path).unwrap();
        write(&mut stream, &Head::hello(id).into());
        assert!(matches!(read(&mut stream).head, Head::Welcome { .. }));
        let head = Head::Send {
            flags: Flags::default(),
            handle: 1,
            destination: source,
        };
        let payload = vec![0x00, 0x4D].into();
        write(&mut stream, &Record { head, payload });
        stream
    })
    .await;
    receive(&mut camera).await;
    camera.send(message(&camera, id, vec![7; 1 << 20])).unwrap();
    blocking(move || while read(&mut stream).head != (Head::Progress { source }) {}).await;
}
