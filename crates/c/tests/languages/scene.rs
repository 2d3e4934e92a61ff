//! The parts of the tests in Rust: a node on loopback with a group of its own, drivers and operators.

use std::time::Duration;

use jaus::component::{Component, Control, Handlers, Kind, Management};
use jaus::messages::mobility::{
    QueryVelocityState, QueryVelocityStateExt, QueryWrenchEffort, ReportVelocityState,
    SetWrenchEffort, primitive_driver, velocity_state_sensor,
};
use jaus::node::{Config, Node, Port};
use jaus_test_kit::group::own_group;
use jaus_test_kit::waiting::within_limit;
use tokio::sync::watch;

/// A node and an operator on it.
pub(crate) struct Scene {
    pub(crate) group: String,
    pub(crate) node: Node,
    pub(crate) operator: Component,
}

impl Scene {
    pub(crate) fn new() -> Self {
        let group = own_group();
        let node = Node::start(Config::loopback(42, 1).group(group)).unwrap();
        let operator = Component::builder(Kind::OperatorControlUnit, "Operator");
        Self {
            group: group.to_string(),
            operator: operator.attach(&node, 1).unwrap(),
            node,
        }
    }

    /// Control of the driver that is found, made ready.
    pub(crate) async fn control(&self) -> Control {
        let driver = within_limit(self.operator.find(primitive_driver::URN)).await;
        let control = within_limit(self.operator.control(driver.unwrap(), 127)).await;
        let control = control.unwrap();
        within_limit(control.resume()).await.unwrap();
        control
    }

    /// A driver in Rust on this node. The second is whether it drives.
    pub(crate) fn driver(&self) -> (Component, watch::Receiver<bool>) {
        driver_on(self.node.attach(33).unwrap())
    }
}

/// A primitive driver. The second is whether it drives.
pub(crate) fn driver_on(port: Port) -> (Component, watch::Receiver<bool>) {
    let (drives, watched) = watch::channel(false);
    let stopped = drives.clone();
    let handlers = Handlers::new(primitive_driver::LATEST)
        .command(move |_: SetWrenchEffort, _, _| {
            drives.send_replace(true);
        })
        .declines::<QueryWrenchEffort>()
        .on_stop(move |_| {
            stopped.send_replace(false);
        });
    let driver = Component::builder(Kind::Vehicle, "Rover")
        .offer(handlers)
        .management(Management::new());
    (driver.live_on(port).unwrap(), watched)
}

/// A velocity sensor, which reports 1.5 m/s.
pub(crate) fn sensor_on(port: Port) -> Component {
    let mut speed = ReportVelocityState::default();
    speed.set_velocity_x_m_per_s(1.5).unwrap();
    let handlers = Handlers::new(velocity_state_sensor::LATEST)
        .answer(move |_: QueryVelocityState| speed.clone())
        .declines::<QueryVelocityStateExt>();
    let sensor = Component::builder(Kind::Vehicle, "Rover").offer(handlers);
    sensor.live_on(port).unwrap()
}

/// Set Wrench Effort, forward.
pub(crate) fn effort(percent: f64) -> SetWrenchEffort {
    let mut effort = SetWrenchEffort::default();
    effort
        .set_propulsive_linear_effort_x_percent(percent)
        .unwrap();
    effort
}

/// Sends an effort again and again, as drivers need it, until control is lost or this is dropped.
pub(crate) async fn keep_driving(control: &Control, percent: f64) {
    while control.send(&effort(percent)).is_ok() {
        tokio::time::sleep(Duration::from_millis(50)).await;
    }
}
