//! A temporary socket directory with a node, and waits with a timeout.

use std::fs::{DirBuilder, remove_dir_all};
use std::os::unix::fs::DirBuilderExt;
use std::path::PathBuf;
use std::sync::atomic::{AtomicU32, Ordering};

use bytes::Bytes;
use jaus::address::JausId;
use jaus::endpoint::{Outgoing, Received};
use jaus::link::Group;
use jaus::node::{Address, ComponentEvent, ComponentEvents, Config, Host, Node, Port};
use jaus_test_kit::waiting::within_limit;

/// A directory that is removed when the test ends.
#[derive(Debug)]
pub(crate) struct Place(PathBuf);

impl Place {
    pub(crate) fn new() -> Self {
        static COUNT: AtomicU32 = AtomicU32::new(0);
        let number = COUNT.fetch_add(1, Ordering::Relaxed);
        let name = format!("jaus-test-{}-{number}", std::process::id());
        let path = std::env::temp_dir().join(name);
        DirBuilder::new().mode(0o700).create(&path).unwrap();
        Self(path)
    }

    pub(crate) fn path(&self) -> PathBuf {
        self.0.join("node.sock")
    }

    pub(crate) fn address(&self) -> Address {
        Address::Path(self.path())
    }

    pub(crate) fn host(&self) -> Host {
        Host::at(self.address())
    }

    /// Settings of a node that stays on this host, without multicast.
    pub(crate) fn config(&self) -> Config {
        Config::loopback(101, 1)
            .group(Group::Off)
            .local(self.address())
    }

    pub(crate) fn node(&self) -> Node {
        Node::start(self.config()).unwrap()
    }
}

impl Drop for Place {
    fn drop(&mut self) {
        let _ = remove_dir_all(&self.0);
    }
}

pub(crate) async fn receive(port: &mut Port) -> Received {
    within_limit(port.recv())
        .await
        .expect("an attached component")
}

pub(crate) async fn component_event(
    events: &mut ComponentEvents,
    wanted: impl Fn(&ComponentEvent) -> bool,
) -> ComponentEvent {
    within_limit(async {
        loop {
            let event = events.recv().await.expect("a running node");
            if wanted(&event) {
                return event;
            }
        }
    })
    .await
}

/// A message from a port, with the unassigned code 4D00h.
pub(crate) fn message(from: &Port, to: JausId, body: impl AsRef<[u8]>) -> Outgoing {
    let payload = [&[0x00, 0x4D], body.as_ref()].concat();
    Outgoing::new(from.id(), to, Bytes::from(payload))
}
