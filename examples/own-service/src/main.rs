//! A component that offers the service. Query it with
//! `jaus query --loopback --jsidl services 106.1.40 QueryLamp`.

use jaus::component::{AccessControl, Component, Kind};
use jaus::node::{Config, Node};

#[tokio::main(flavor = "current_thread")]
async fn main() -> Result<(), Box<dyn std::error::Error>> {
    let node = Node::start(Config::loopback(106, 1))?;
    let lamp = Component::builder(Kind::Vehicle, "Lamp")
        .offer(own_service::service())
        .access_control(AccessControl::new())
        .attach(&node, 40)?;
    println!("{} is up; Ctrl-C ends it", lamp.id());
    Ok(tokio::signal::ctrl_c().await?)
}
