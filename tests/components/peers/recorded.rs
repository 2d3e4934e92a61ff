//! Datagrams of a capture, with their times and addresses.

use std::fs::File;
use std::net::SocketAddr;
use std::path::Path;
use std::time::Duration;

use bytes::Bytes;
use jaus::wire::{Frame, judp};
use jaus_view::{Capture, Network};

/// A captured datagram.
#[derive(Debug, Clone)]
pub(crate) struct Recorded {
    /// Since the first datagram of the capture.
    pub(crate) at: Duration,
    pub(crate) source: SocketAddr,
    pub(crate) destination: SocketAddr,
    pub(crate) payload: Bytes,
}

impl Recorded {
    /// The messages, and the number of octets behind the last.
    pub(crate) fn frames(&self) -> (Vec<Frame>, usize) {
        let Ok(mut frames) = judp::frames(self.payload.clone()) else {
            return (Vec::new(), 0);
        };
        let all = frames.by_ref().map_while(Result::ok).collect();
        (all, frames.remaining())
    }
}

/// The JAUS datagrams of a capture.
pub(crate) fn datagrams(file: &Path) -> Vec<Recorded> {
    let mut capture = Capture::new(File::open(file).expect("a readable file")).expect("a capture");
    let mut network = Network::new([judp::PORT]);
    let mut datagrams: Vec<Recorded> = Vec::new();
    let mut began = None;
    while let Some(frame) = capture.next_frame() {
        let frame = frame.expect("a whole capture");
        let time = frame.time.map_or(Duration::ZERO, |time| {
            Duration::new(time.seconds().unsigned_abs(), time.subsec_nanos())
        });
        for datagram in network.handle_frame(&frame) {
            datagrams.push(Recorded {
                at: time.saturating_sub(*began.get_or_insert(time)),
                source: datagram.source,
                destination: datagram.destination,
                payload: Bytes::copy_from_slice(&datagram.payload),
            });
        }
    }
    datagrams
}
