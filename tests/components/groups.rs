//! Multicast messages and group subscriptions: components on nodes with real sockets on the
//! loopback interface.

use std::time::Duration;

use jaus::address::JausId;
use jaus::codec::Message;
use jaus::component::{
    Audience, CannotSubscribe, Component, GroupUpdate, Handlers, Kind, Messages, Priority,
    QueryOptions, SubscribeError, SubscriptionEnd, Timing, When,
};
use jaus::link::Group;
use jaus::messages::core::{QueryIdentification, ReportHeartbeatPulse, discovery};
use jaus::messages::mobility::{
    QueryVelocityState, QueryVelocityStateExt, ReportVelocityState, velocity_state_sensor,
};
use jaus::node::{Config, Node};
use jaus_test_kit::group::own_group;
use jaus_test_kit::waiting::within_limit;

const QUERY: QueryVelocityState = QueryVelocityState::none().with_velocity_x();

/// A separate network, isolated from other tests.
struct Network(Group);

impl Network {
    fn new() -> Self {
        Self(own_group())
    }

    fn node(&self, subsystem: u16, node: u8) -> Node {
        let mut config = Config::loopback(subsystem, node).group(self.0);
        config.delivery.patience = Duration::from_millis(500);
        Node::start(config).unwrap()
    }

    /// A component that reports a speed.
    fn sensor(&self, subsystem: u16, speed: f64) -> Component {
        let mut report = ReportVelocityState::default();
        report.set_velocity_x_m_per_s(speed).unwrap();
        let speedometer = Handlers::new(velocity_state_sensor::LATEST)
            .answer(move |_: QueryVelocityState| report.clone())
            .declines::<QueryVelocityStateExt>();
        Component::builder(Kind::Vehicle, "Sensor")
            .offer(speedometer)
            .attach(&self.node(subsystem, 1), 42)
            .unwrap()
    }

    /// A component that quickly notices others that appear and leave.
    fn operator(&self) -> Component {
        let timing = Timing {
            call: Duration::from_millis(100),
            call_per_peer: Duration::ZERO,
            refresh: Duration::from_millis(200),
            refresh_per_peer: Duration::ZERO,
            probes: 2,
            probe_interval: Duration::from_millis(100),
            ..Timing::default()
        };
        Component::builder(Kind::OperatorControlUnit, "Operator")
            .timing(timing)
            .attach(&self.node(42, 1), 1)
            .unwrap()
    }
}

/// Waits until an audience has this number of members.
async fn gathered(component: &Component, audience: &Audience, members: usize) {
    let mut changes = component.watch();
    within_limit(async {
        while component.members(audience).len() != members {
            changes.next().await.unwrap();
        }
    })
    .await;
}

/// Waits until a component receives `M` from the sender.
async fn hears<M: Message>(messages: &mut Messages, from: JausId) {
    let heard = async {
        while let Some(message) = messages.next().await {
            if message.source == from && M::decode(&message.payload).is_ok() {
                return;
            }
        }
        panic!("the node has stopped");
    };
    within_limit(heard).await;
}

#[tokio::test]
async fn a_message_to_a_subsystem_a_node_or_providers_reaches_those_and_nobody_else() {
    let network = Network::new();
    let operator = network.operator();
    let boards = [
        network.node(101, 2),
        network.node(101, 3),
        network.node(102, 2),
    ];
    let plain = |node: &Node, component| {
        let plain = Component::builder(Kind::Vehicle, "Plain");
        plain.attach(node, component).unwrap()
    };
    let here = plain(&boards[0], 33);
    let beside = plain(&boards[1], 33);
    let elsewhere = plain(&boards[2], 33);
    let mut ears = [&here, &beside, &elsewhere].map(Component::messages);
    gathered(&operator, &Audience::EVERYBODY, 3).await;

    // In this order: a message with too wide a destination would arrive before the expected one.
    let pulse = ReportHeartbeatPulse {};
    assert_eq!(operator.send_all(Audience::node(101, 2), &pulse), Ok(1));
    hears::<ReportHeartbeatPulse>(&mut ears[0], operator.id()).await;
    assert_eq!(operator.send_all(Audience::subsystem(101), &pulse), Ok(2));
    hears::<ReportHeartbeatPulse>(&mut ears[0], operator.id()).await;
    hears::<ReportHeartbeatPulse>(&mut ears[1], operator.id()).await;
    let providers = Audience::providers(discovery::URN).in_subsystem(102);
    gathered(&operator, &providers, 1).await;
    assert_eq!(operator.send_all(&providers, &pulse), Ok(1));
    hears::<ReportHeartbeatPulse>(&mut ears[2], operator.id()).await;
    drop((here, beside, elsewhere));
    for mut ear in ears {
        assert!(ear.next().await.is_none(), "a message too many");
    }
}

#[tokio::test]
async fn an_urgent_message_reaches_every_member_with_its_priority() {
    let network = Network::new();
    let sensors = [101, 102].map(|subsystem| network.sensor(subsystem, 1.0));
    let mut received = sensors.each_ref().map(Component::messages);
    let operator = network.operator();
    let audience = Audience::providers(velocity_state_sensor::URN);
    gathered(&operator, &audience, 2).await;
    let urgent = Priority::SafetyCritical;
    let results = operator.deliver_all_with(urgent, &audience, &ReportHeartbeatPulse {});
    assert!(within_limit(results).await.is_complete());
    for messages in &mut received {
        let message = within_limit(messages.next()).await.unwrap();
        assert_eq!(message.priority, urgent);
    }
}

#[tokio::test]
async fn everybody_who_acknowledged_or_answered_is_told_apart_from_who_did_not() {
    let network = Network::new();
    let operator = network.operator();
    let sensor = network.sensor(101, 1.0);
    let doomed_node = network.node(102, 1);
    let doomed = Component::builder(Kind::Vehicle, "Doomed");
    let doomed = doomed.attach(&doomed_node, 42).unwrap();
    let (alive, dead) = (sensor.id(), doomed.id());
    gathered(&operator, &Audience::EVERYBODY, 2).await;

    let pulse = ReportHeartbeatPulse {};
    let told = within_limit(operator.deliver_all(Audience::EVERYBODY, &pulse)).await;
    assert!(told.is_complete() && told.len() == 2, "{told:?}");
    let name = QueryIdentification {
        query_type: 2.into(),
    };
    let named = within_limit(operator.query_all(Audience::EVERYBODY, &name));
    assert_eq!(named.await.successes().count(), 2);

    drop((doomed, doomed_node));
    // Addressed by id, so that discovery need not have noticed the loss.
    let both = [alive, dead].map(Audience::from);
    let [to_the_living, to_the_dead] = both.map(|one| operator.deliver_all(one, &pulse));
    assert!(within_limit(to_the_living).await.is_complete());
    let failed = within_limit(to_the_dead).await;
    assert!(!failed.is_complete());
    assert!(failed.failures().all(|(id, _)| id == dead), "{failed:?}");
}

#[tokio::test]
async fn a_group_subscription_follows_providers_as_they_come_restart_and_go() {
    let network = Network::new();
    let operator = network.operator();
    let mut speeds = operator
        .subscribe_all(velocity_state_sensor::URN, &QUERY, When::hz(20.0))
        .unwrap();
    let first = network.sensor(101, 1.0);
    let mut next = async || within_limit(speeds.next()).await.expect("a running node");
    assert_eq!(next().await, (first.id(), GroupUpdate::Up));
    assert!(matches!(next().await, (id, GroupUpdate::Report(_)) if id == first.id()));

    let second = network.sensor(102, 2.0);
    let other = second.id();
    while next().await != (other, GroupUpdate::Up) {}
    // Both sensors report, each with its own speed.
    let mut heard = [false; 2];
    while heard != [true; 2] {
        if let (id, GroupUpdate::Report(report)) = next().await {
            let speed = report.velocity_x_m_per_s().unwrap().round();
            assert_eq!(speed, f64::from(id.subsystem() - 100));
            heard[usize::from(id == other)] = true;
        }
    }

    drop(second);
    while next().await != (other, GroupUpdate::Gone) {}
    let _second = network.sensor(102, 3.0);
    while next().await != (other, GroupUpdate::Up) {}
    loop {
        if let (id, GroupUpdate::Report(report)) = next().await
            && id == other
        {
            assert_eq!(report.velocity_x_m_per_s().unwrap().round(), 3.0);
            break;
        }
    }
    drop(first);
    assert_eq!(speeds.members().count(), 2);
}

#[tokio::test]
async fn a_member_that_takes_its_service_back_is_gone_and_one_that_refuses_is_told_of() {
    let network = Network::new();
    let operator = network.operator();
    let slow = When::hz(1000.0).at_least(1000.0);
    let mut speeds = operator
        .subscribe_all(velocity_state_sensor::URN, &QUERY, slow)
        .unwrap();
    let sensor = network.sensor(101, 1.0);
    let (id, update) = within_limit(speeds.next()).await.unwrap();
    let GroupUpdate::NotSubscribed { why, again } = update else {
        panic!("{id} keeps no 1000 Hz: {update:?}");
    };
    let SubscribeError::Ended { peer, why, .. } = why else {
        panic!("it was asked: {why}");
    };
    assert!(matches!(why, SubscriptionEnd::TooSlow { .. }), "{why}");
    assert!(peer == sensor.id() && again == Duration::from_secs(1));

    sensor.withdraw(velocity_state_sensor::URN).await.unwrap();
    while within_limit(speeds.next()).await != Some((id, GroupUpdate::Gone)) {}
}

#[tokio::test]
async fn what_no_member_could_grant_is_refused_at_once_and_a_stopped_node_ends_the_stream() {
    let network = Network::new();
    let node = network.node(42, 1);
    let operator = Component::builder(Kind::OperatorControlUnit, "Operator");
    let operator = operator.attach(&node, 1).unwrap();
    let subscribe = |when| operator.subscribe_all(velocity_state_sensor::URN, &QUERY, when);
    let refused = subscribe(When::hz(2000.0)).unwrap_err();
    assert_eq!(refused, CannotSubscribe::Rate { hz: 2000.0 });
    let mut speeds = subscribe(When::OnChange).unwrap();
    node.shutdown().await;
    assert!(within_limit(speeds.next()).await.is_none());
}

#[tokio::test]
async fn queries_of_one_component_and_of_a_group_reach_it_with_their_priority() {
    let network = Network::new();
    let (heard, mut priorities) = tokio::sync::mpsc::unbounded_channel();
    let sensor = Handlers::new(velocity_state_sensor::LATEST)
        .receive(move |_: QueryVelocityState, query, context| {
            heard.send(query.priority).unwrap();
            context.reply(query, &ReportVelocityState::default());
        })
        .declines::<QueryVelocityStateExt>();
    let sensor = Component::builder(Kind::Vehicle, "Sensor")
        .offer(sensor)
        .attach(&network.node(101, 1), 42)
        .unwrap();
    let operator = network.operator();
    let audience = Audience::providers(velocity_state_sensor::URN);
    gathered(&operator, &audience, 1).await;
    let urgent = QueryOptions::default().priority(Priority::High);
    let answers = async {
        operator
            .query_with(urgent, sensor.id(), &QUERY)
            .await
            .unwrap();
        let request = operator.request_with(urgent, sensor.id(), &QUERY).await;
        let _: ReportVelocityState = request.unwrap();
        operator.query_all_with(urgent, &audience, &QUERY).await
    };
    assert!(within_limit(answers).await.is_complete());
    for _query in 0..3 {
        assert_eq!(priorities.recv().await, Some(Priority::High));
    }
    operator.query(sensor.id(), &QUERY).await.unwrap();
    assert_eq!(priorities.recv().await, Some(Priority::Standard));
}
