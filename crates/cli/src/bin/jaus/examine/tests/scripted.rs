//! Scripted peers: a correct one with an option for each possible fault, and three simple ones.

use std::collections::BTreeMap;
use std::net::SocketAddr;

use bytes::{BufMut, Bytes, BytesMut};
use jaus::address::JausId;
use jaus::codec::{Message, Text};
use jaus::messages::core::*;
use jaus::wire::{Acknowledgement, Broadcast, DataControl, Flags, Frame, Priority, Version, judp};

use super::super::case::Send;
use super::super::seen::{Listener, Refusal, TcpAnswer};
use super::air::{Air, Scripted};

/// An event of the vehicle's client.
#[derive(Clone, Debug)]
pub(super) struct Subscription {
    client: JausId,
    to: SocketAddr,
    kind: create_event::EventType,
    query: Bytes,
}

/// A peer that passes everything, unless an option makes it fail.
pub(super) struct Vehicle {
    pub(super) id: JausId,
    pub(super) name: &'static str,
    pub(super) address: SocketAddr,
    pub(super) speaks_from: u16,
    pub(super) hears_at_source: bool,
    pub(super) hears_unicast: bool,
    pub(super) joined: bool,
    pub(super) calls: bool,
    pub(super) identifies: bool,
    pub(super) beats: bool,
    pub(super) acknowledges: bool,
    pub(super) configures: bool,
    pub(super) lists_itself: bool,
    pub(super) wildcard: bool,
    pub(super) named: bool,
    pub(super) all: bool,
    pub(super) reports_authority: bool,
    pub(super) reports_status: bool,
    pub(super) reports_control: bool,
    pub(super) confirms: bool,
    pub(super) fires: bool,
    pub(super) cancels: bool,
    pub(super) on_change: bool,
    pub(super) events_of_services: bool,
    pub(super) most_fragments: usize,
    pub(super) most_at_once: usize,
    pub(super) counts: bool,
    pub(super) doubles: bool,
    pub(super) twin: Option<SocketAddr>,
    pub(super) old_services: bool,
    /// Maximum number of fragments of an echoed D7F0h message; 0 echoes none.
    pub(super) echoes_up_to: usize,
    /// The accepted message types.
    pub(super) takes_type: fn(u8) -> bool,
    /// Takes a 0 in an id for "all".
    pub(super) zero_is_all: bool,
    /// Number of additional copies of an event's first report.
    pub(super) first_copies: usize,
    /// Surplus octets after its messages.
    pub(super) stale: usize,
    pub(super) events: BTreeMap<u8, Subscription>,
    pub(super) heard_codes: Vec<u16>,
    fragments: usize,
    pieces: Vec<Bytes>,
    at_once: usize,
    ticks: u64,
    number: u16,
}

impl Vehicle {
    pub(super) fn sound() -> Self {
        Self {
            id: JausId::new(77, 1, 1),
            name: "Mule",
            address: ([10, 0, 0, 2], 3794).into(),
            speaks_from: 3794,
            hears_at_source: false,
            hears_unicast: true,
            joined: true,
            calls: true,
            identifies: true,
            beats: true,
            acknowledges: true,
            configures: true,
            lists_itself: true,
            wildcard: true,
            named: true,
            all: true,
            reports_authority: true,
            reports_status: true,
            reports_control: true,
            confirms: true,
            fires: true,
            cancels: true,
            on_change: true,
            events_of_services: true,
            most_fragments: usize::MAX,
            most_at_once: usize::MAX,
            counts: true,
            doubles: false,
            twin: None,
            old_services: false,
            echoes_up_to: 0,
            takes_type: |kind| kind == 0,
            zero_is_all: false,
            first_copies: 0,
            stale: 0,
            events: BTreeMap::new(),
            heard_codes: Vec::new(),
            fragments: 0,
            pieces: Vec::new(),
            at_once: 0,
            ticks: 0,
            number: 7,
        }
    }

    /// Behaves like JAUS++: empty lists, old services, surplus octets.
    pub(super) fn jauspp() -> Self {
        Self {
            wildcard: false,
            old_services: true,
            events_of_services: false,
            first_copies: 4,
            stale: 40,
            number: 0,
            ..Self::sound()
        }
    }

    /// A client of Junior without services that echoes messages.
    pub(super) fn junior() -> Self {
        Self {
            echoes_up_to: 50,
            takes_type: |kind| kind & 0b11 == 0,
            calls: false,
            identifies: false,
            beats: false,
            configures: false,
            wildcard: false,
            named: false,
            all: false,
            reports_authority: false,
            reports_status: false,
            reports_control: false,
            confirms: false,
            ..Self::sound()
        }
    }

    fn source(&self) -> SocketAddr {
        SocketAddr::new(self.address.ip(), self.speaks_from)
    }

    fn number(&mut self) -> u16 {
        self.number += u16::from(self.counts);
        self.number
    }

    fn frame(&mut self, to: JausId, payload: Bytes) -> Frame {
        Frame {
            flags: Flags::new(Priority::Standard),
            sequence: self.number(),
            ..Frame::new(self.id, to, payload)
        }
    }

    fn tell(&mut self, to: JausId, report: &impl Message, air: &mut Air) {
        let frame = self.frame(to, report.encode().unwrap());
        self.put(Listener::Unicast, &frame, air);
    }

    fn put(&mut self, listener: Listener, frame: &Frame, air: &mut Air) {
        let mut datagram = BytesMut::from(&judp::encode(frame).unwrap()[..]);
        datagram.put_bytes(0xEE, self.stale);
        let datagram = datagram.freeze();
        for _ in 0..1 + usize::from(self.doubles) {
            air.say_octets(listener, self.source(), datagram.clone());
        }
    }

    fn answer(&mut self, frame: &Frame, air: &mut Air) {
        let from = frame.source;
        let (payload, Some(code)) = (&frame.payload, frame.code()) else {
            return;
        };
        self.heard_codes.push(code);
        match code {
            QueryIdentification::CODE if self.identifies => {
                let report = ReportIdentification {
                    query_type: report_identification::QueryType::SUBSYSTEM_IDENTIFICATION,
                    r#type: report_identification::Type::VEHICLE,
                    identification: Text::from(self.name),
                };
                self.tell(from, &report, air);
            }
            QueryHeartbeatPulse::CODE if self.beats => {
                self.at_once += 1;
                if self.at_once <= self.most_at_once {
                    self.tell(from, &ReportHeartbeatPulse, air);
                }
            }
            QueryConfiguration::CODE if self.configures => self.configuration(from, air),
            QueryServices::CODE => self.services(from, payload, air),
            QueryAuthority::CODE if self.reports_authority => {
                self.tell(from, &ReportAuthority { authority_code: 2 }, air);
            }
            QueryStatus::CODE if self.reports_status => {
                let report = ReportStatus {
                    status: report_status::Status(2),
                    reserved: 0,
                };
                self.tell(from, &report, air);
            }
            QueryControl::CODE if self.reports_control => {
                self.tell(from, &ReportControl::default(), air);
            }
            RequestControl::CODE => {
                self.tell(from, &ConfirmControl::default(), air);
            }
            ReleaseControl::CODE => self.tell(from, &RejectControl::default(), air),
            CreateEvent::CODE if self.confirms => self.create(from, payload, air),
            CancelEvent::CODE if self.cancels => self.cancel(from, payload, air),
            QueryEvents::CODE => self.list_events(from, air),
            _ => {}
        }
    }

    fn configuration(&mut self, to: JausId, air: &mut Air) {
        let component = report_configuration::ComponentRec {
            component_id: self.id.component() + u8::from(!self.lists_itself),
            instance_id: 0,
        };
        let node_list = vec![report_configuration::NodeSeq {
            node_rec: report_configuration::NodeRec {
                node_id: self.id.node(),
            },
            component_list: vec![component],
        }];
        self.tell(to, &ReportConfiguration { node_list }, air);
    }

    fn services(&mut self, to: JausId, payload: &Bytes, air: &mut Air) {
        let query = QueryServices::decode(payload).unwrap();
        let answers = match query.node_list.first() {
            None => self.all,
            Some(node) if node.node_rec.node_id.0 == 255 => self.wildcard,
            Some(_) => self.named,
        };
        let minor = u8::from(!self.old_services);
        let offer = |name: &str| register_services::ServiceRec {
            uri: Text::from(format!("urn:jaus:jss:core:{name}").as_str()),
            major_version_number: 1,
            minor_version_number: minor,
        };
        let names = [
            "Liveness",
            "Events",
            "Discovery",
            "AccessControl",
            "Management",
        ];
        let component = report_services::ComponentSeq {
            component_rec: report_services::ComponentRec {
                component_id: self.id.component(),
                instance_id: 0,
            },
            service_list: names.into_iter().map(offer).collect(),
        };
        let node = report_services::NodeSeq {
            node_rec: report_services::NodeRec {
                node_id: self.id.node(),
            },
            component_list: vec![component],
        };
        if self.identifies {
            let node_list = if answers { vec![node] } else { Vec::new() };
            self.tell(to, &ReportServices { node_list }, air);
        }
    }

    fn create(&mut self, client: JausId, payload: &Bytes, air: &mut Air) {
        let create = CreateEvent::decode(payload).unwrap();
        let of_services = create
            .query_message
            .starts_with(&QueryServices::CODE.to_le_bytes());
        let on_change = create.event_type == create_event::EventType::EVERY_CHANGE;
        if of_services && !self.events_of_services || on_change && !self.on_change {
            let reject = RejectEventRequest {
                request_id: create.request_id,
                response_code: Some(reject_event_request::ResponseCode(2)),
                error_message: None,
            };
            return self.tell(client, &reject, air);
        }
        let id = (0..=255).find(|id| !self.events.contains_key(id)).unwrap();
        let confirm = ConfirmEventRequest {
            request_id: create.request_id,
            event_id: id,
            confirmed_periodic_rate: confirm_event_request::ConfirmedPeriodicRate::new(
                create.requested_periodic_rate_hz(),
            )
            .unwrap(),
        };
        self.tell(client, &confirm, air);
        let subscription = Subscription {
            client,
            to: self.address,
            kind: create.event_type,
            query: create.query_message,
        };
        for _copy in 0..self.first_copies {
            self.fire(id, client, air);
        }
        self.events.insert(id, subscription);
    }

    fn fire(&mut self, event_id: u8, client: JausId, air: &mut Air) {
        let event = Event {
            event_id,
            sequence_number: 0,
            report_message: ReportStatus::default().encode().unwrap(),
        };
        self.tell(client, &event, air);
    }

    fn cancel(&mut self, to: JausId, payload: &Bytes, air: &mut Air) {
        let cancel = CancelEvent::decode(payload).unwrap();
        self.events.remove(&cancel.event_id);
        let confirm = ConfirmEventRequest {
            request_id: cancel.request_id,
            event_id: cancel.event_id,
            ..ConfirmEventRequest::default()
        };
        self.tell(to, &confirm, air);
    }

    fn list_events(&mut self, to: JausId, air: &mut Air) {
        let event_list = self
            .events
            .iter()
            .map(|(&event_id, it)| report_events::ReportEventRec {
                event_type: it.kind,
                event_id,
                query_message: it.query.clone(),
            });
        let event_list = event_list.collect();
        let report = ReportEvents { event_list }.encode().unwrap();
        self.send_back(to, &report, air);
    }

    fn acknowledge(&mut self, frame: &Frame, air: &mut Air) {
        if frame.flags.data() != DataControl::Single {
            self.fragments += 1;
        }
        if self.acknowledges && self.fragments <= self.most_fragments {
            let flags = Flags::new(frame.flags.priority());
            let answer = Frame {
                flags: flags.with_acknowledgement(Acknowledgement::Positive),
                sequence: frame.sequence,
                ..Frame::new(self.id, frame.source, Bytes::new())
            };
            self.put(Listener::Unicast, &answer, air);
        }
    }

    fn take(&mut self, frame: &Frame, air: &mut Air) {
        let destination = match self.zero_is_all {
            true => frame.destination.with_zeros_for_all(),
            false => frame.destination,
        };
        if !destination.matches(self.id) || !(self.takes_type)(frame.kind.0) {
            return;
        }
        if frame.flags.acknowledgement() == Acknowledgement::Request {
            self.acknowledge(frame, air);
        }
        match frame.flags.data() {
            DataControl::Single => {
                self.answer(frame, air);
                let code = frame.code().filter(|_| frame.payload.len() > 2);
                if code == Some(0xD7F0) && self.echoes_up_to > 0 {
                    self.send_back(frame.source, &frame.payload, air);
                }
            }
            data => self.collect(data, frame, air),
        }
    }

    /// Reassembles a large message, within the limit, and echoes it.
    fn collect(&mut self, data: DataControl, frame: &Frame, air: &mut Air) {
        if data == DataControl::First {
            self.pieces.clear();
        }
        self.pieces.push(frame.payload.clone());
        if data == DataControl::Last && self.pieces.len() <= self.echoes_up_to {
            let whole = self.pieces.concat();
            self.send_back(frame.source, &whole, air);
        }
    }

    fn send_back(&mut self, to: JausId, message: &[u8], air: &mut Air) {
        let pieces: Vec<&[u8]> = message.chunks(4079).collect();
        let last = pieces.len() - 1;
        for (number, piece) in pieces.into_iter().enumerate() {
            let mut frame = self.frame(to, Bytes::copy_from_slice(piece));
            frame.flags = frame.flags.with_data(match number {
                0 if last == 0 => DataControl::Single,
                0 => DataControl::First,
                number if number == last => DataControl::Last,
                _ => DataControl::Middle,
            });
            self.put(Listener::Unicast, &frame, air);
        }
    }
}

impl Scripted for Vehicle {
    fn hear(&mut self, send: &Send, air: &mut Air) {
        match send {
            Send::To(to, frame) => {
                let at_source = self.hears_at_source && *to == self.source();
                if self.hears_unicast && (*to == self.address || at_source) {
                    self.take(frame, air);
                }
            }
            Send::Group(frame) if self.joined => self.take(frame, air),
            Send::Group(_) => {}
            Send::Probe(to, _) => {
                if to.ip() == self.address.ip() && *to != self.address {
                    air.refuse(*to, Refusal::Port);
                } else if to.ip() != self.address.ip() {
                    air.refuse(*to, Refusal::Host);
                }
            }
            Send::Connect(_) => air.answer_tcp(TcpAnswer::Refused),
        }
    }

    fn beat(&mut self, air: &mut Air) {
        self.ticks += 1;
        self.at_once = 0;
        if self.ticks % 50 == 3 && self.calls {
            let query = QueryIdentification::default().encode().unwrap();
            let mut frame = self.frame(JausId::EVERYONE, query);
            frame.flags = frame.flags.with_broadcast(Broadcast::Global);
            self.put(Listener::Group, &frame, air);
            if let Some(twin) = self.twin {
                air.say(Listener::Group, twin, &frame);
            }
        }
        let due = self.ticks.is_multiple_of(2) && self.fires;
        let events: Vec<_> = self.events.clone().into_iter().filter(|_| due).collect();
        for (event_id, it) in events {
            let periodic = it.kind == create_event::EventType::PERIODIC_SC;
            if periodic && it.to == self.address {
                self.fire(event_id, it.client, air);
            }
        }
    }
}

/// A silent host, a closed port, a program that hangs, or an absent host.
#[derive(Default)]
pub(super) struct Silent {
    pub(super) refuses: bool,
    /// Refuses all ports but that of the program, which reads nothing.
    pub(super) hangs: bool,
    pub(super) gone: bool,
}

impl Scripted for Silent {
    fn hear(&mut self, send: &Send, air: &mut Air) {
        match send {
            Send::Probe(to, _) if self.refuses || self.hangs && to.port() != 3794 => {
                air.refuse(*to, Refusal::Port);
            }
            // Meanwhile the system has searched for the host.
            Send::To(to, _) if self.gone => air.refuse(*to, Refusal::Host),
            _ => {}
        }
    }
}

/// A node manager of the Reference Architecture.
#[derive(Default)]
pub(super) struct Ra {
    /// Its answers go to a port in use by another program.
    goes_astray: bool,
    ticks: u64,
}

impl Ra {
    /// A peer whose answers do not reach us.
    pub(super) fn astray() -> Self {
        Self {
            goes_astray: true,
            ..Self::default()
        }
    }

    fn say(source: [u8; 4], to: [u8; 4], payload: Bytes, listener: Listener, air: &mut Air) {
        let frame = Frame {
            version: Version::Ra,
            flags: Flags::new(Priority::Standard),
            ..Frame::new(JausId::from_wire(source), JausId::from_wire(to), payload)
        };
        air.say(listener, ([10, 0, 0, 2], 3794).into(), &frame);
    }
}

impl Scripted for Ra {
    fn hear(&mut self, send: &Send, air: &mut Air) {
        let Send::To(_, frame) = send else {
            return;
        };
        if frame.version == Version::Ra && frame.code() == Some(0x2B00) && !self.goes_astray {
            let mut report = vec![0x00, 0x4B, 2, 0, 0, 0];
            report.extend(b"OJ_a");
            report.resize(86, 0);
            let to = frame.source.to_wire();
            Self::say([1, 35, 1, 10], to, report.into(), Listener::Unicast, air);
        }
    }

    fn beat(&mut self, air: &mut Air) {
        self.ticks += 1;
        if self.ticks.is_multiple_of(10) {
            let pulse = Bytes::from_static(&[0x02, 0x42]);
            Self::say(
                [1, 35, 1, 10],
                [1, 1, 255, 255],
                pulse,
                Listener::RaGroup,
                air,
            );
        }
    }
}
