//! Connections between two nodes, and with unexpected peers.

use bytes::Bytes;

use super::*;
use crate::messages::ra33::confirm_service_connection::ConfirmedPeriodicUpdateRate;
use crate::messages::ra33::create_service_connection::RequestedPeriodicUpdateRate;

const POSE: RaId = RaId::new(10, 1, 38, 1);
const US: RaId = RaId::new(30, 1, 40, 1);

#[expect(
    clippy::disallowed_methods,
    reason = "virtual time starts at any instant"
)]
fn start() -> Instant {
    Instant::now()
}

fn wish(rate: f64) -> Request {
    Request {
        provider: POSE,
        client: US,
        code: 0x4402,
        presence: 0x7F,
        rate,
    }
}

/// A provider and a client with an interruptible network.
struct World {
    now: Instant,
    provider: Connections,
    client: Connections,
    cut: bool,
    /// Events of each of them.
    told: (Vec<Event>, Vec<Event>),
}

impl World {
    fn new() -> Self {
        Self {
            now: start(),
            provider: Connections::new(Settings::default()),
            client: Connections::new(Settings::default()),
            cut: false,
            told: Default::default(),
        }
    }

    /// With a connection at a rate, and a report.
    fn connected(rate: f64) -> (Self, ConnectionId, ConnectionId) {
        let mut world = Self::new();
        let ours = world.client.create(world.now, wish(rate)).unwrap();
        world.exchange();
        let [Event::Wanted(theirs, request)] = world.told.0[..] else {
            panic!("{:?}", world.told)
        };
        assert!((request.rate - rate).abs() < 0.02);
        assert!(world.provider.accept(world.now, theirs).is_some());
        let report = Bytes::from_static(b"here");
        world.provider.set_report(world.now, theirs, report);
        world.exchange();
        (world, theirs, ours)
    }

    fn exchange(&mut self) {
        loop {
            let to_client = std::iter::from_fn(|| self.provider.poll_transmit());
            let to_client: Vec<_> = to_client.collect();
            let to_provider = std::iter::from_fn(|| self.client.poll_transmit());
            let to_provider: Vec<_> = to_provider.collect();
            if to_client.is_empty() && to_provider.is_empty() {
                break;
            }
            if self.cut {
                continue;
            }
            for message in to_client {
                assert!(self.client.handle_message(self.now, &message));
            }
            for message in to_provider {
                assert!(self.provider.handle_message(self.now, &message));
            }
        }
        let provider = std::iter::from_fn(|| self.provider.poll_event());
        self.told.0.extend(provider);
        self.told
            .1
            .extend(std::iter::from_fn(|| self.client.poll_event()));
    }

    fn pass(&mut self, seconds: f64) {
        let end = self.now + Duration::from_secs_f64(seconds);
        let next = |world: &Self| {
            let both = [world.provider.poll_timeout(), world.client.poll_timeout()];
            both.into_iter().flatten().min()
        };
        while let Some(next) = next(self).filter(|&next| next <= end) {
            self.now = self.now.max(next);
            self.provider.handle_timeout(self.now);
            self.client.handle_timeout(self.now);
            self.exchange();
        }
        self.now = end;
    }

    fn reports(&mut self) -> Vec<Message> {
        let told = std::mem::take(&mut self.told.1).into_iter();
        told.filter_map(|event| match event {
            Event::Report(_, message) => Some(message),
            _ => None,
        })
        .collect()
    }
}

#[test]
fn reports_come_at_the_rate_numbered_and_marked() {
    let (mut world, theirs, ours) = World::connected(25.0);
    let established = world.told.1.iter().find_map(|event| match event {
        Event::Established(id, rate) => Some((*id, *rate)),
        _ => None,
    });
    let (id, rate) = established.unwrap();
    assert!(id == ours && (rate - 25.0).abs() < 0.02);
    world.pass(10.0);
    let reports = world.reports();
    assert!((249..=252).contains(&reports.len()), "{}", reports.len());
    for (number, report) in reports.iter().enumerate() {
        assert_eq!(usize::from(report.sequence), number);
        assert!(report.connection && report.data == "here"[..]);
    }
    let new = Bytes::from_static(b"there");
    world.provider.set_report(world.now, theirs, new);
    world.pass(0.1);
    assert!(
        world
            .reports()
            .iter()
            .all(|report| report.data == "there"[..])
    );
}

#[test]
fn more_often_than_its_rate_nothing_is_sent() {
    let (mut world, theirs, _) = World::connected(10.0);
    world.told.1.clear();
    for number in 0..1000 {
        world
            .provider
            .set_report(world.now, theirs, Bytes::from(vec![number as u8]));
        world.pass(0.001);
    }
    assert!((9..=11).contains(&world.reports().len()));
}

#[test]
fn a_rate_above_the_highest_is_confirmed_as_the_highest() {
    let mut world = World::new();
    world.client.create(world.now, wish(1092.0)).unwrap();
    world.exchange();
    let Event::Wanted(theirs, _) = world.told.0[0] else {
        panic!()
    };
    assert_eq!(world.provider.accept(world.now, theirs), Some(100.0));
    world.exchange();
    let Event::Established(_, rate) = world.told.1[0] else {
        panic!()
    };
    assert!((rate - 100.0).abs() < 0.02);
}

#[test]
fn suspended_connections_pause_and_go_on() {
    let (mut world, _, ours) = World::connected(10.0);
    world.client.set_active(world.now, ours, false);
    world.exchange();
    world.told.1.clear();
    world.pass(20.0);
    assert_eq!(world.told.1, [], "no reports, and no complaint");
    world.client.set_active(world.now, ours, true);
    world.exchange();
    world.pass(1.0);
    assert!(world.reports().len() >= 10);
}

#[test]
fn either_side_can_end_it() {
    let (mut world, theirs, ours) = World::connected(10.0);
    world.client.end(ours);
    world.exchange();
    assert_eq!(world.told.0.last(), Some(&Event::Ended(theirs)));
    assert_eq!((world.provider.len(), world.client.len()), ((0, 0), (0, 0)));
    let (mut world, theirs, ours) = World::connected(10.0);
    world.provider.end(theirs);
    world.exchange();
    assert_eq!(world.told.1.last(), Some(&Event::Ended(ours)));
}

#[test]
fn a_silent_provider_is_asked_anew_until_it_answers() {
    let (mut world, _, ours) = World::connected(10.0);
    world.told.1.clear();
    world.cut = true;
    world.pass(30.0);
    let silent = |told: &[Event]| told.iter().filter(|e| **e == Event::Silent(ours)).count();
    assert_eq!(silent(&world.told.1), 2, "once lost, once without answer");
    world.cut = false;
    world.told.1.clear();
    world.pass(6.0);
    let again = |event: &Event| matches!(event, Event::Established(id, _) if *id == ours);
    assert_eq!(world.told.1.iter().filter(|event| again(event)).count(), 1);
    assert!(world.reports().len() > 5, "the provider knew it still");
    assert_eq!(world.provider.len(), (1, 0));
}

#[test]
fn what_is_refused_is_forgotten() {
    let mut world = World::new();
    let ours = world.client.create(world.now, wish(1.0)).unwrap();
    assert_eq!(
        world.client.create(world.now, wish(2.0)),
        Err(CannotConnect::Exists(ours))
    );
    assert_eq!(
        world.client.create(world.now, wish(0.0)),
        Err(CannotConnect::Rate)
    );
    world.exchange();
    let Event::Wanted(theirs, _) = world.told.0[0] else {
        panic!()
    };
    let why = ResponseCode::COMMAND_NOT_SUPPORTED;
    world.provider.refuse(theirs, why);
    world.exchange();
    assert_eq!(world.told.1, [Event::Refused(ours, why)]);
    assert_eq!((world.provider.len(), world.client.len()), ((0, 0), (0, 0)));
}

fn create(client: RaId, rate: f64, presence_vector: u32) -> Message {
    let body = CreateServiceConnection {
        command_code: 0x4402,
        requested_periodic_update_rate: RequestedPeriodicUpdateRate::new(rate).unwrap(),
        presence_vector,
    };
    Message::with_body(client, POSE, &body).unwrap()
}

#[test]
fn instances_are_numbered_as_openjaus_does() {
    let (now, mut provider) = (start(), Connections::new(Settings::default()));
    let other = RaId::new(31, 1, 40, 1);
    let mut instances = Vec::new();
    for (client, presence) in [(US, 1), (US, 2), (US, 1), (other, 1)] {
        provider.handle_message(now, &create(client, 5.0, presence));
        if let Some(Event::Wanted(id, _)) = provider.poll_event() {
            provider.accept(now, id);
        }
        let confirmed = provider.poll_transmit().unwrap();
        let confirmed: ConfirmServiceConnection = confirmed.body().unwrap();
        assert_eq!(confirmed.response_code, ResponseCode::SUCCESSFUL);
        instances.push(confirmed.instance_id);
    }
    assert_eq!(instances, [0, 1, 0, 0]);
}

#[test]
fn requests_beyond_reason_are_refused_and_floods_are_bounded() {
    let settings = Settings {
        max_provided: 10,
        queue_limit: 50,
        ..Settings::default()
    };
    let (now, mut provider) = (start(), Connections::new(settings));
    provider.handle_message(now, &create(US, 0.0, 1));
    let refused: ConfirmServiceConnection = provider.poll_transmit().unwrap().body().unwrap();
    assert_eq!(refused.response_code, ResponseCode::INVALID_PARAMETER);
    for presence in 0..1000 {
        provider.handle_message(now, &create(US, 5.0, presence));
    }
    assert_eq!(provider.len(), (10, 0));
    assert_eq!(provider.counters().get(Counter::ConnectionRefused), 991);
    assert!(provider.counters().get(Counter::TransmitQueueFull) > 900);
    for rate in 1..1000 {
        provider.handle_message(now, &create(US, f64::from(rate), 0));
    }
    assert!(std::iter::from_fn(|| provider.poll_event()).count() <= 100);
    let mut short = create(US, 5.0, 1);
    short.data.truncate(3);
    assert!(provider.handle_message(now, &short));
    assert_eq!(provider.counters().get(Counter::Malformed), 1);
    provider.forget(|id| id != US);
    assert_eq!(provider.len(), (0, 0));
}

#[test]
fn who_sends_what_nobody_wants_is_told_to_end() {
    let (now, mut client) = (start(), Connections::new(Settings::default()));
    let mut report = Message::new(POSE, US, 0x4402, Bytes::new());
    assert!(!client.handle_message(now, &report), "a plain answer");
    report.connection = true;
    for _ in 0..100 {
        assert!(client.handle_message(now, &report));
    }
    let confirmed = ConfirmServiceConnection {
        command_code: 0x4404,
        instance_id: 3,
        confirmed_periodic_update_rate: ConfirmedPeriodicUpdateRate::new(5.0).unwrap(),
        response_code: ResponseCode::SUCCESSFUL,
    };
    client.handle_message(now, &Message::with_body(POSE, US, &confirmed).unwrap());
    let ends = std::iter::from_fn(|| client.poll_transmit());
    let ends: Vec<TerminateServiceConnection> = ends.map(|end| end.body().unwrap()).collect();
    let ends: Vec<_> = ends
        .iter()
        .map(|end| (end.command_code, end.instance_id))
        .collect();
    assert_eq!(ends, [(0x4402, 0), (0x4404, 3)]);
    assert_eq!(client.counters().get(Counter::UnwantedReport), 100);
}
