//! Subscriptions and control in an application: components on nodes with real sockets on the
//! loopback interface, and a scripted peer.

use std::time::Duration;

use jaus::address::JausId;
use jaus::codec::{Message, ServiceId};
use jaus::component::{
    Component, Control, ControlError, ControlLost, FindError, Handlers, Kind, ManageError,
    Management, Outage, Patience, SessionError, SessionState, SubscribeError, Subscription,
    SubscriptionEnd, Update, When,
};
use jaus::endpoint::{Outgoing, Received};
use jaus::messages::core::{
    CancelEvent, ConfirmControl, ConfirmEventRequest, CreateEvent, Event, QueryStatus,
    RejectControl, RejectEventRequest, ReleaseControl, ReportStatus, RequestControl, Resume,
    SetEmergency, discovery, management,
};
use jaus::node::{Config, Node, Port};
use jaus::wire::Priority;
use jaus_test_kit::group::own_group;
use jaus_test_kit::waiting::{until, within_limit};

/// An operator, and a scripted peer on its own node.
struct Scene {
    operator: Component,
    peer: Puppet,
    _nodes: [Node; 2],
}

struct Puppet(Port);

impl Scene {
    fn new() -> Self {
        let group = own_group();
        let start = |subsystem| Node::start(Config::loopback(subsystem, 1).group(group)).unwrap();
        let (station, vehicle) = (start(42), start(101));
        let operator = Component::builder(Kind::OperatorControlUnit, "Operator")
            .patience(Patience {
                tries: 2,
                interval: Duration::from_millis(100),
            })
            .attach(&station, 1)
            .unwrap();
        Self {
            operator,
            peer: Puppet(vehicle.attach(33).unwrap()),
            _nodes: [station, vehicle],
        }
    }

    /// A subscription that the peer has confirmed as event 7, at 20 Hz.
    async fn subscribed(&mut self) -> Subscription<ReportStatus> {
        let id = self.peer.id();
        let subscribing = self.operator.subscribe(id, &QueryStatus {}, When::hz(20.0));
        let confirming = self.peer.confirm_event(7);
        let (subscription, ()) =
            within_limit(async { tokio::join!(subscribing, confirming) }).await;
        let mut subscription = subscription.unwrap();
        assert_eq!(within_limit(subscription.next()).await, Some(Update::Up));
        subscription
    }

    /// Control granted by the peer.
    async fn controlled(&mut self) -> Control {
        let id = self.peer.id();
        let peer = &mut self.peer;
        let granting = async {
            let request = peer.expect::<RequestControl>().await;
            assert_eq!(request.authority_code, 200);
            peer.say(&ConfirmControl::default());
        };
        let asking = self.operator.control(id, 200);
        let (control, ()) = within_limit(async { tokio::join!(asking, granting) }).await;
        control.unwrap()
    }
}

impl Puppet {
    fn id(&self) -> JausId {
        self.0.id()
    }

    fn say<M: Message>(&self, message: &M) {
        let operator = JausId::new(42, 1, 1);
        let payload = message.encode().unwrap();
        self.0
            .send(Outgoing::new(self.id(), operator, payload))
            .unwrap();
    }

    /// The next message of one type; all others are ignored.
    async fn expect<M: Message>(&mut self) -> M {
        loop {
            let message: Received = self.0.recv().await.expect("a running node");
            if let Ok(message) = M::decode(&message.payload) {
                return message;
            }
        }
    }

    async fn confirm_event(&mut self, event_id: u8) {
        let create: CreateEvent = self.expect().await;
        let mut confirm = ConfirmEventRequest {
            request_id: create.request_id,
            event_id,
            ..ConfirmEventRequest::default()
        };
        let hz = create.requested_periodic_rate_hz();
        confirm.set_confirmed_periodic_rate_hz(hz).unwrap();
        self.say(&confirm);
    }

    fn fire(&self, event_id: u8, sequence_number: u8, report: &ReportStatus) {
        self.say(&Event {
            event_id,
            sequence_number,
            report_message: report.encode().unwrap(),
        });
    }
}

fn status(code: u8) -> ReportStatus {
    ReportStatus {
        status: code.into(),
        reserved: 0,
    }
}

#[tokio::test]
async fn a_subscription_is_shared_and_ends_with_its_last_reader() {
    let mut scene = Scene::new();
    let mut first = scene.subscribed().await;
    let mut second = first.share().depth(1);
    scene.peer.fire(7, 0, &status(1));
    scene.peer.fire(7, 2, &status(2));
    let next = async |of: &mut Subscription<ReportStatus>| within_limit(of.report()).await;
    assert_eq!(next(&mut first).await, Some(status(1)));
    assert_eq!(next(&mut first).await, Some(status(2)));
    assert_eq!(next(&mut second).await, Some(status(2)), "the latest");
    assert_eq!((first.missed(), second.missed()), (0, 1));
    assert_eq!((first.lost(), second.lost()), (1, 1));
    drop(first);
    scene.peer.fire(7, 3, &status(3));
    assert_eq!(next(&mut second).await, Some(status(3)));
    drop(second);
    let end: CancelEvent = within_limit(scene.peer.expect()).await;
    assert_eq!(end.event_id, 7);
}

#[tokio::test]
async fn a_subscription_yields_reports_and_says_when_it_is_down() {
    let mut scene = Scene::new();
    let mut subscription = scene.subscribed().await;
    assert_eq!(subscription.hz().map(f64::round), Some(20.0));
    scene.peer.fire(7, 0, &status(1));
    scene.peer.fire(7, 3, &status(2));
    let mut next = async || within_limit(subscription.next()).await.unwrap();
    assert_eq!(next().await, Update::Report(status(1)));
    assert_eq!(next().await, Update::Report(status(2)));
    let down = next().await;
    assert!(
        matches!(
            down,
            Update::Down {
                why: Outage::Silent,
                ..
            }
        ),
        "{down:?}"
    );
    // The peer has restarted and numbers its events from the start.
    within_limit(scene.peer.confirm_event(1)).await;
    scene.peer.fire(1, 0, &status(5));
    assert_eq!(next().await, Update::Up);
    assert_eq!(next().await, Update::Report(status(5)));
    assert_eq!((subscription.lost(), subscription.missed()), (2, 0));
    assert!(subscription.is_up());
}

#[tokio::test]
async fn a_report_that_cannot_be_read_is_counted_and_passed_over() {
    let mut scene = Scene::new();
    let mut subscription = scene.subscribed().await;
    scene.peer.say(&Event {
        event_id: 7,
        sequence_number: 0,
        report_message: vec![0x02, 0x40].into(),
    });
    scene.peer.fire(7, 1, &status(1));
    let report = within_limit(subscription.report()).await;
    assert_eq!(report, Some(status(1)));
    assert_eq!(subscription.unreadable(), 1);
}

#[tokio::test]
async fn a_subscription_that_is_dropped_is_cancelled_even_with_its_component() {
    let mut scene = Scene::new();
    let subscription = scene.subscribed().await;
    let Scene {
        operator,
        mut peer,
        _nodes: nodes,
    } = scene;
    drop(operator);
    peer.fire(7, 0, &status(1));
    drop(subscription);
    let cancel: CancelEvent = within_limit(peer.expect()).await;
    assert_eq!(cancel.event_id, 7);
    drop(nodes);
}

#[tokio::test]
async fn a_peer_that_rejects_or_says_nothing_is_named_with_what_it_did() {
    let mut scene = Scene::new();
    let id = scene.peer.id();
    let asking = async || {
        let query = QueryStatus {};
        let asked = scene.operator.subscribe(id, &query, When::OnChange);
        asked.await.unwrap_err()
    };
    let silent = within_limit(asking()).await;
    assert!(
        matches!(
            silent,
            SubscribeError::Ended {
                why: SubscriptionEnd::NoAnswer(_),
                ..
            }
        ),
        "{silent:?}"
    );
    let told = silent.to_string();
    assert!(
        told.starts_with(
            "no subscription to QueryStatus of 101.1.33: CreateEvent was answered with neither \
             ConfirmEventRequest nor RejectEventRequest: 2 attempts in 0."
        ),
        "{told}"
    );
    let peer = &mut scene.peer;
    let rejecting = async {
        // Rejects the last of the two previous requests.
        loop {
            let request_id = peer.expect::<CreateEvent>().await.request_id;
            peer.say(&RejectEventRequest {
                request_id,
                response_code: Some(2.into()),
                error_message: None,
            });
        }
    };
    let rejected = within_limit(async {
        tokio::select! {
            rejected = asking() => rejected,
            () = rejecting => unreachable!(),
        }
    });
    assert_eq!(
        rejected.await.to_string(),
        "no subscription to QueryStatus of 101.1.33: the peer refuses it: it has no events on \
         change (code 2)"
    );
}

#[tokio::test]
async fn control_is_told_when_it_is_lost_and_commands_are_refused_then() {
    let mut scene = Scene::new();
    let mut control = scene.controlled().await;
    assert!(control.is_held());
    control.send(&Resume {}).unwrap();
    within_limit(scene.peer.expect::<Resume>()).await;
    scene.peer.say(&RejectControl::default());
    let lost = within_limit(control.lost()).await;
    let why = ControlLost::TakenBack;
    let peer = scene.peer.id();
    assert_eq!(lost, ControlError::Lost { peer, why });
    assert_eq!(control.send(&Resume {}), Err(lost));
    assert!(!control.is_held());
}

#[tokio::test]
async fn control_tells_each_status_that_the_peer_reports_and_its_own_loss() {
    let mut scene = Scene::new();
    let control = scene.controlled().await;
    assert_eq!(control.status(), Ok(None));
    let mut known = None;
    for code in [2, 1] {
        let reporting = async {
            scene.peer.expect::<QueryStatus>().await;
            scene.peer.say(&status(code));
        };
        let next = async { tokio::join!(control.status_after(known), reporting).0 };
        assert_eq!(within_limit(next).await, Ok(Some(code)));
        known = Some(code);
    }
    assert_eq!(control.status(), Ok(known));
    scene.peer.say(&RejectControl::default());
    let lost = within_limit(control.status_after(known)).await;
    assert!(matches!(lost, Err(ControlError::Lost { .. })), "{lost:?}");
    assert_eq!(control.status(), lost);
}

#[test]
fn control_is_given_back_at_the_end_of_main() {
    let group = own_group();
    let (addressed, address) = std::sync::mpsc::channel();
    let peer = std::thread::spawn(move || {
        runtime().block_on(async {
            let node = Node::start(Config::loopback(101, 1).group(group)).unwrap();
            let mut peer = Puppet(node.attach(33).unwrap());
            addressed.send(peer.id()).unwrap();
            within_limit(peer.expect::<RequestControl>()).await;
            peer.say(&ConfirmControl::default());
            within_limit(peer.expect::<ReleaseControl>()).await;
        });
    });
    let peer_id = address.recv().unwrap();
    runtime().block_on(async {
        let node = Node::start(Config::loopback(42, 1).group(group)).unwrap();
        let operator = Component::builder(Kind::OperatorControlUnit, "Operator")
            .attach(&node, 1)
            .unwrap();
        let control = operator.control(peer_id, 127).await.unwrap();
        // The last command precedes the release.
        control.send(&Resume {}).unwrap();
    });
    peer.join().unwrap();
}

fn runtime() -> tokio::runtime::Runtime {
    let mut runtime = tokio::runtime::Builder::new_current_thread();
    runtime.enable_all().build().unwrap()
}

#[tokio::test]
async fn control_is_given_back_when_it_is_dropped() {
    let mut scene = Scene::new();
    let control = scene.controlled().await;
    drop(control);
    within_limit(scene.peer.expect::<ReleaseControl>()).await;
    scene.peer.say(&RejectControl::default());
    let control = scene.controlled().await;
    let peer = &mut scene.peer;
    let releasing = async {
        peer.expect::<ReleaseControl>().await;
        peer.say(&RejectControl::default());
    };
    within_limit(async { tokio::join!(control.release(), releasing) }).await;
}

#[tokio::test]
async fn resume_waits_until_the_peer_says_that_it_is_ready() {
    let mut scene = Scene::new();
    let control = scene.controlled().await;
    let peer = &mut scene.peer;
    // The lease queries the status as well.
    let answering = async {
        peer.expect::<Resume>().await;
        for code in [2, 2].into_iter().chain(std::iter::repeat(1)) {
            peer.expect::<QueryStatus>().await;
            peer.say(&status(code));
        }
    };
    let resumed = within_limit(async {
        tokio::select! {
            resumed = control.resume() => resumed,
            () = answering => unreachable!(),
        }
    })
    .await;
    resumed.unwrap();
    let answering = async {
        loop {
            peer.expect::<QueryStatus>().await;
            peer.say(&status(1));
        }
    };
    let refused = within_limit(async {
        tokio::select! {
            refused = control.standby() => refused,
            () = answering => unreachable!(),
        }
    });
    let refused = refused.await.unwrap_err();
    assert!(matches!(refused, ManageError::State { found: 1, .. }));
    assert_eq!(
        refused.to_string(),
        "101.1.33 was set to the state standby, but reports the status 1"
    );
}

#[tokio::test]
async fn a_session_does_not_resume_a_peer_that_is_lost() {
    let Scene {
        operator,
        mut peer,
        _nodes,
    } = Scene::new();
    let mut session = within_limit(operator.session(peer.id(), 127))
        .await
        .unwrap();
    within_limit(peer.expect::<RequestControl>()).await;
    peer.say(&ConfirmControl::default());
    within_limit(peer.expect::<Resume>()).await;
    peer.say(&RejectControl::default());
    within_limit(async {
        loop {
            let state = session.changed().await.unwrap();
            if matches!(state, SessionState::Lost { continues, .. } if continues) {
                break;
            }
        }
    })
    .await;
    let refused = within_limit(session.resume()).await.unwrap_err();
    assert!(
        matches!(refused, SessionError::State(SessionState::Lost { .. })),
        "{refused}"
    );
}

#[tokio::test]
async fn the_greater_authority_takes_control_and_an_emergency_stops_everybody() {
    let group = own_group();
    let start = |subsystem| Node::start(Config::loopback(subsystem, 1).group(group)).unwrap();
    let attach = |subsystem| {
        Component::builder(Kind::OperatorControlUnit, "Operator").attach(&start(subsystem), 1)
    };
    let (pupil, teacher) = (attach(42).unwrap(), attach(43).unwrap());
    let rover = Component::builder(Kind::Vehicle, "Rover")
        .management(Management::new())
        .attach(&start(101), 1)
        .unwrap();
    let peer = within_limit(pupil.find(management::LATEST)).await.unwrap();
    assert_eq!(peer, rover.id());
    let query = QueryStatus {};
    let subscribing = teacher.subscribe(peer, &query, When::OnChange);
    let mut states = within_limit(subscribing).await.unwrap();
    // Wait for each change, because changes in quick succession are reported as one.
    let mut state = async || within_limit(states.report()).await.unwrap().status.0;
    assert_eq!(state().await, 2, "standby");

    let mut held = within_limit(pupil.control(peer, 50)).await.unwrap();
    within_limit(held.resume()).await.unwrap();
    assert_eq!(state().await, 1, "ready");
    let refused = within_limit(teacher.control(peer, 50)).await.unwrap_err();
    assert!(
        refused
            .to_string()
            .starts_with("no control of 101.1.1: the authority 50 is below"),
        "{refused}"
    );
    let taken = within_limit(teacher.control(peer, 60)).await.unwrap();
    let lost = within_limit(held.lost()).await;
    assert!(matches!(lost, ControlError::Lost { .. }), "{lost}");

    within_limit(pupil.set_emergency(peer)).await.unwrap();
    assert_eq!(state().await, 5, "emergency");
    let refused = within_limit(taken.resume()).await.unwrap_err();
    assert!(
        matches!(refused, ManageError::State { found: 5, .. }),
        "{refused}"
    );
    within_limit(pupil.clear_emergency(peer)).await.unwrap();
    assert_eq!(state().await, 2, "standby");
    within_limit(taken.resume()).await.unwrap();
    assert_eq!(state().await, 1, "ready");
    within_limit(taken.release()).await;
    assert_eq!(state().await, 2, "standby");
}

#[tokio::test]
async fn what_the_node_holds_ends_with_it() {
    let mut scene = Scene::new();
    let mut subscription = scene.subscribed().await;
    let mut control = scene.controlled().await;
    let [station, _vehicle] = scene._nodes;
    within_limit(station.shutdown()).await;
    while let Some(update) = within_limit(subscription.next()).await {
        assert!(matches!(update, Update::Down { .. }), "{update:?}");
    }
    assert_eq!(within_limit(control.lost()).await, ControlError::Stopped);
    assert_eq!(subscription.end(), None);
}

#[tokio::test]
async fn a_version_that_nobody_offers_is_told_with_the_versions_that_are_there() {
    const CAMERA: ServiceId = ServiceId {
        urn: "urn:test:Camera",
        major: 1,
        minor: 2,
    };
    let group = own_group();
    let start = |subsystem| Node::start(Config::loopback(subsystem, 1).group(group)).unwrap();
    let rover = Component::builder(Kind::Vehicle, "Rover")
        .offer(Handlers::new(CAMERA))
        .attach(&start(102), 1)
        .unwrap();
    let operator = Component::builder(Kind::OperatorControlUnit, "Operator")
        .attach(&start(43), 1)
        .unwrap();
    let older = ServiceId { minor: 1, ..CAMERA };
    let found = within_limit(operator.find(older)).await;
    assert_eq!(found, Ok(rover.id()));
    let newer = ServiceId { minor: 3, ..CAMERA };
    let limit = Duration::from_millis(50);
    let error = operator.find_within(newer, limit).await.unwrap_err();
    assert!(matches!(&error, FindError::NotFound { instead, .. } if instead.len() == 1));
    let told = error.to_string();
    assert!(
        told.starts_with("no component with urn:test:Camera 1.3 found within 0."),
        "{told}"
    );
    assert!(told.ends_with("(102.1.1 offers version 1.2)"), "{told}");
    assert!(within_limit(operator.find(discovery::LATEST)).await.is_ok());
}

#[tokio::test]
async fn commands_are_refused_once_the_peer_is_known_to_be_no_longer_ready() {
    let mut scene = Scene::new();
    let control = scene.controlled().await;
    let peer = &mut scene.peer;
    let answering = async {
        loop {
            peer.expect::<QueryStatus>().await;
            peer.say(&status(1));
        }
    };
    within_limit(async {
        tokio::select! {
            resumed = control.resume() => resumed.unwrap(),
            () = answering => unreachable!(),
        }
    })
    .await;
    assert_eq!(control.send(&Resume {}), Ok(()));
    // The peer was restarted, or is in an emergency. Only the lease queries it.
    let answering = async {
        loop {
            peer.expect::<QueryStatus>().await;
            peer.say(&status(5));
        }
    };
    tokio::select! {
        () = until(|| control.send(&Resume {}).is_err()) => {}
        () = answering => unreachable!(),
    }
    let (peer, state) = (control.peer(), 5);
    let refused = ControlError::NotReady { peer, state };
    assert_eq!(control.send(&Resume {}), Err(refused));
    assert!(control.is_held());
}

#[tokio::test]
async fn control_can_be_asked_for_again_as_soon_as_it_is_dropped() {
    let mut scene = Scene::new();
    for _ in 0..50 {
        // The peer may not have confirmed the release yet.
        drop(scene.controlled().await);
    }
}

#[tokio::test]
async fn releasing_lost_control_ends_at_once_and_leaves_the_control_that_came_after_it() {
    let mut scene = Scene::new();
    let mut lost = scene.controlled().await;
    scene.peer.say(&RejectControl::default());
    within_limit(lost.lost()).await;
    let next = scene.controlled().await;
    within_limit(lost.release()).await;
    next.send(&Resume {}).unwrap();
    within_limit(scene.peer.expect::<Resume>()).await;
    assert!(next.is_held());
}

#[tokio::test]
async fn an_emergency_is_sent_with_safety_critical_priority() {
    let mut scene = Scene::new();
    let (operator, id) = (scene.operator.clone(), scene.peer.id());
    tokio::spawn(async move { operator.set_emergency(id).await });
    let received = within_limit(async {
        loop {
            let message = scene.peer.0.recv().await.expect("a running node");
            if SetEmergency::decode(&message.payload).is_ok() {
                return message;
            }
        }
    });
    assert_eq!(received.await.priority, Priority::SafetyCritical);
}
