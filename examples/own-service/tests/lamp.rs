//! Tests the service through a client.

use jaus::component::{AccessControl, Component, Kind};
use jaus::node::{Config, Node};
use own_service::messages::set_lamp::Brightness;
use own_service::messages::{QueryLamp, SetLamp};

#[tokio::test]
async fn the_lamp_is_as_bright_as_the_client_in_control_sets_it()
-> Result<(), Box<dyn std::error::Error>> {
    let node = Node::start(Config::loopback(101, 1))?;
    let lamp = Component::builder(Kind::Vehicle, "Lamp")
        .offer(own_service::service())
        .access_control(AccessControl::new())
        .attach(&node, 40)?;
    let client = Component::builder(Kind::OperatorControlUnit, "Client").attach(&node, 1)?;

    let brightness = Brightness::new(40.0)?;
    client.send(lamp.id(), &SetLamp { brightness })?;
    let report = client.query(lamp.id(), &QueryLamp).await?;
    assert_eq!(report.brightness_percent(), 0.0, "nobody is in control");
    let control = client.control(lamp.id(), 127).await?;
    control.send(&SetLamp { brightness })?;
    let report = client.query(lamp.id(), &QueryLamp).await?;
    assert_eq!(report.brightness_percent(), 40.0);
    Ok(())
}

#[tokio::test]
async fn a_lamp_without_access_control_cannot_be_attached() {
    let node = Node::start(Config::loopback(101, 2)).expect("a node on loopback");
    let lamp = Component::builder(Kind::Vehicle, "Lamp").offer(own_service::service());
    let error = lamp.attach(&node, 41).expect_err("anyone could set it");
    let text = error.to_string();
    assert!(
        text.contains("SetLamp") && text.contains(".access_control("),
        "{text}"
    );
}
