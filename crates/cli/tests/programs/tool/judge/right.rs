//! Components of the library pass every applicable step.

use std::sync::mpsc;

use jaus::component::{AccessControl, Builder, Component, Kind};
use jaus::link::Group;
use jaus::node::{Config, Node};
use jaus::service::Management;
use jaus_vehicle::ground::{RangeSensor, StageBoard};
use jaus_vehicle::sensing::{RangerConfig, Ray, Scan};

use crate::support::run;
use crate::tool::judge::peer::network;

#[test]
fn the_core_services_pass_every_step_that_they_are_in() {
    let management = |component: Builder| component.management(Management::default());
    judge(management, &["--only", "A1-A3,B1-B26"]);
}

#[test]
fn a_service_of_the_ground_vehicle_passes_its_steps() {
    let stage = |component: Builder| component.offer(StageBoard::default().service());
    let judged = judge(stage, &["--service", "Stage"]);
    assert!(judged.contains("QueryStage is answered"), "{judged}");
}

#[test]
fn a_range_sensor_passes_its_steps() {
    let sensor = |component: Builder| {
        let sensor = RangeSensor::new(RangerConfig::default(), 10.0);
        let rays = [-0.5, 0.0, 0.5].map(|bearing| Ray {
            bearing,
            range: 3.0,
        });
        sensor.publish(Some(&Scan::new(rays)), std::time::UNIX_EPOCH);
        component
            .access_control(AccessControl::new())
            .offer(sensor.service())
    };
    let judged = judge(sensor, &["--service", "RangeSensor"]);
    for query in [
        "QueryRangeSensorData",
        "QueryRangeSensorCapabilities",
        "QueryRangeSensorConfiguration",
        "QuerySensorGeometricProperties",
    ] {
        assert!(judged.contains(&format!("{query} is answered")), "{judged}");
    }
}

/// Judges a component with these services, and returns the report. No step may fail.
fn judge(services: fn(Builder) -> Builder, arguments: &[&str]) -> String {
    let flags = network();
    let group: Group = flags.last().unwrap().parse().unwrap();
    let (ready, is_ready) = mpsc::channel();
    std::thread::spawn(move || {
        let mut runtime = tokio::runtime::Builder::new_current_thread();
        runtime.enable_all().build().unwrap().block_on(async move {
            let node = Node::start(Config::loopback(105, 1).group(group)).unwrap();
            let component = services(Component::builder(Kind::Vehicle, "Rover"));
            let _component = component.attach(&node, 1).unwrap();
            ready.send(()).unwrap();
            std::future::pending::<()>().await;
        });
    });
    is_ready.recv().unwrap();
    let network: Vec<&str> = flags.iter().map(String::as_str).collect();
    let judged = run(&[&["judge", "105.1.1"], arguments, &*network].concat(), b"");
    assert_eq!(
        (judged.status, &*judged.stderr),
        (0, ""),
        "{}",
        judged.stdout
    );
    assert!(judged.stdout.contains(" 0 failed, "), "{}", judged.stdout);
    judged.stdout
}
