//! The client's side of a capture.

use std::collections::VecDeque;
use std::fs::File;
use std::path::Path;
use std::time::Duration;

use bytes::Bytes;
use jaus::address::JausId;
use jaus::codec::Message;
use jaus::messages::core::{ConfirmEventRequest, CreateEvent};
use jaus::wire::{Frame, judp};
use jaus_view::{Capture, JAUS_PORT, Network, Timestamp};

/// Offset of the destination in a datagram: version, then type, size and flags.
const DESTINATION: std::ops::Range<usize> = 5..9;

/// A datagram sent by a client.
#[derive(Debug, Clone)]
pub(crate) struct Said {
    /// The time since the client's previous datagram.
    pub(crate) pause: Duration,
    pub(crate) datagram: Vec<u8>,
    /// The first message in the datagram.
    pub(crate) frame: Frame,
    /// For Create Event: the event id that the captured vehicle assigned.
    pub(crate) event_id: Option<u8>,
}

impl Said {
    pub(crate) fn code(&self) -> u16 {
        self.frame.code().unwrap()
    }

    /// Replaces the destination in the header; nothing else changes.
    fn address_to(&mut self, destination: JausId) {
        self.datagram[DESTINATION].copy_from_slice(&destination.to_wire());
        self.frame.destination = destination;
    }
}

/// All datagrams that a client (or the clients of one node) sent, in order, readdressed from the
/// captured vehicle's subsystem to the component `ours`.
pub(crate) fn said_by(
    capture: &Path,
    client: impl Fn(JausId) -> bool,
    vehicle: u16,
    ours: JausId,
) -> Vec<Said> {
    let mut all: Vec<Said> = Vec::new();
    let mut confirmations = VecDeque::new();
    let mut before = None;
    for (time, datagram, frame) in messages(capture) {
        if frame.source.subsystem() == vehicle {
            if let Ok(confirmation) = ConfirmEventRequest::decode(&frame.payload) {
                confirmations.push_back(confirmation);
            }
            continue;
        }
        if !client(frame.source) {
            continue;
        }
        let pause = before.map_or(0.0, |before| time - before);
        before = Some(time);
        let mut said = Said {
            pause: Duration::from_secs_f64(pause.max(0.0)),
            datagram,
            frame,
            event_id: None,
        };
        let to = said.frame.destination;
        if to.subsystem() == vehicle {
            // A single component becomes ours; the wildcard stays a wildcard.
            let is_all = to.component() == JausId::ANY_COMPONENT;
            let component = if is_all {
                to.component()
            } else {
                ours.component()
            };
            said.address_to(JausId::new(ours.subsystem(), ours.node(), component));
        }
        all.push(said);
    }
    name_streams(&mut all, confirmations);
    all
}

/// Adds to each Create Event the event id that the captured vehicle assigned.
fn name_streams(all: &mut [Said], mut confirmations: VecDeque<ConfirmEventRequest>) {
    for said in all {
        let Ok(creation) = CreateEvent::decode(&said.frame.payload) else {
            continue;
        };
        let of_it = |one: &ConfirmEventRequest| one.request_id == creation.request_id;
        if let Some(at) = confirmations.iter().position(of_it) {
            said.event_id = confirmations.remove(at).map(|one| one.event_id);
        }
    }
}

/// The datagrams of a capture, each with its time in seconds and its first message.
fn messages(capture: &Path) -> Vec<(f64, Vec<u8>, Frame)> {
    let mut capture = Capture::new(File::open(capture).unwrap()).unwrap();
    let mut network = Network::new([JAUS_PORT]);
    let mut messages = Vec::new();
    while let Some(frame) = capture.next_frame() {
        let frame = frame.unwrap();
        let time = frame.time.map_or(0.0, in_seconds);
        for datagram in network.handle_frame(&frame) {
            let octets = datagram.payload.into_owned();
            let first = judp::frames(Bytes::from(octets.clone()));
            let first = first.ok().and_then(|mut frames| frames.next()?.ok());
            // Acknowledgements belong to the transport and have no code.
            if let Some(message) = first.filter(|message| message.code().is_some()) {
                messages.push((time, octets, message));
            }
        }
    }
    messages
}

fn in_seconds(time: Timestamp) -> f64 {
    time.seconds() as f64 + f64::from(time.subsec_nanos()) / 1e9
}
