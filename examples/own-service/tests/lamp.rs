//! Tests the service through a client.

use jaus::component::{AccessControl, Component, Kind, Update, When};
use jaus::node::{Config, Node};
use own_service::messages::set_lamp::Brightness;
use own_service::messages::{QueryLamp, SetLamp};

#[tokio::test]
async fn the_lamp_obeys_the_client_in_control_and_warms_up_first()
-> Result<(), Box<dyn std::error::Error>> {
    let node = Node::start(Config::loopback(101, 1))?;
    let lamp = Component::builder(Kind::Vehicle, "Lamp")
        .offer(own_service::service())
        .access_control(AccessControl::new())
        .attach(&node, 40)?;
    let client = Component::builder(Kind::OperatorControlUnit, "Client").attach(&node, 1)?;
    let set = |percent| Brightness::new(percent).map(|brightness| SetLamp { brightness });
    let mut reports = client
        .subscribe(lamp.id(), &QueryLamp, When::OnChange)
        .await?;
    let mut shown = async || loop {
        match reports.next().await {
            Some(Update::Report(report)) => break report.brightness_percent(),
            Some(_) => {}
            None => break f64::NAN,
        }
    };
    assert_eq!(shown().await, 0.0);

    client.send(lamp.id(), &set(40.0)?)?;
    let report = client.query(lamp.id(), &QueryLamp).await?;
    assert_eq!(report.brightness_percent(), 0.0, "nobody is in control");

    let control = client.control(lamp.id(), 127).await?;
    control.send(&set(40.0)?)?;
    control.send(&set(80.0)?)?;
    assert_eq!(shown().await, 40.0, "it is not dimmed while it warms up");
    control.send(&set(80.0)?)?;
    assert_eq!(shown().await, 80.0);
    control.send(&set(0.0)?)?;
    assert_eq!(shown().await, 0.0);
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
