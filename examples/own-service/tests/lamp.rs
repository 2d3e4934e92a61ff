//! The service, as a client sees it.

use jaus::component::{Component, Kind};
use jaus::node::{Config, Node};
use own_service::messages::set_lamp::Brightness;
use own_service::messages::{QueryLamp, ReportLamp, SetLamp};

#[tokio::test]
async fn the_lamp_is_as_bright_as_it_was_set() -> Result<(), Box<dyn std::error::Error>> {
    let node = Node::start(Config::loopback(101, 1))?;
    let lamp = Component::builder(Kind::Vehicle, "Lamp")
        .offer(own_service::service())
        .attach(&node, 40)?;
    let client = Component::builder(Kind::OperatorControlUnit, "Client").attach(&node, 1)?;

    let brightness = Brightness::new(40.0)?;
    client.send(lamp.id(), &SetLamp { brightness })?;
    let report: ReportLamp = client.query(lamp.id(), &QueryLamp).await?;
    assert_eq!(report.brightness_percent(), 40.0);
    Ok(())
}
