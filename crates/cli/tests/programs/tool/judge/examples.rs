//! The examples, and with them README's programs, pass every step about each service that they
//! offer. `cargo test` builds them; to run this test alone, run `cargo build --examples` and
//! `cargo build -p own-service` first.

use std::collections::BTreeSet;

use jaus::address::JausId;
use jaus::component::{Component, Kind};
use jaus::node::{Config, Node};
use jaus_test_kit::evidence::{not_tested, this_test};
use jaus_test_kit::example::{self, Example};
use jaus_test_kit::tools::workspace;
use jaus_test_kit::waiting::within_limit;

use crate::support::{Run, run};

#[tokio::test]
async fn every_example_passes_every_step_about_each_service_that_it_offers() {
    let node = Node::start(Config::loopback(48, 1)).unwrap();
    let finder = Component::builder(Kind::OperatorControlUnit, "Finder");
    let finder = finder.attach(&node, 1).unwrap();
    // All share the network of this host. Those that would disturb each other take turns: three are
    // clients that command drivers, and the group stops drivers when a sensor is too fast.
    let driver = Example::start("driver");
    passes(&finder, "operator", &["43.1.1"]).await;
    drop(driver);
    tokio::join!(
        passes(&finder, "driver", &["102.1.33"]),
        passes(&finder, "speedometer", &["107.1.44"]),
        passes(&finder, "sensor", &["101.1.33"]),
        passes(&finder, "client", &["42.1.1"]),
        passes(&finder, "gnss", &["105.1.43"]),
    );
    the_sensor_passes_the_contests();
    tokio::join!(
        passes(&finder, "two_vehicles", &["45.1.1"]),
        passes(&finder, "group", &["44.1.1"]),
        passes(&finder, "own-service", &["106.1.40"]),
        images_pass(&finder),
    );
}

/// The contests' steps about velocity.
fn the_sensor_passes_the_contests() {
    let _sensor = Example::start("sensor");
    let judged = judge(JausId::new(101, 1, 33), &["--only", "A4,B33"]);
    assert!(judged.stdout.contains("2 ok"), "{judged:?}");
}

async fn images_pass(finder: &Component) {
    if example::is_built("images") {
        return passes(finder, "images", &["104.1.33", "46.1.1"]).await;
    }
    let remedy = "run cargo build --features every-set --example images";
    not_tested(&this_test(), &format!("images is not built: {remedy}"));
}

/// Runs an example, and judges its components.
async fn passes(finder: &Component, example: &'static str, components: &[&str]) {
    let _running = Example::start(example);
    for component in components {
        let id: JausId = component.parse().unwrap();
        let services = within_limit(services(finder, id)).await;
        let judge = tokio::task::spawn_blocking(move || {
            let services = services.iter().flat_map(|urn| ["--service", urn]);
            judge(id, &services.collect::<Vec<_>>())
        });
        let judged = judge.await.unwrap();
        let passed = judged.stdout.contains(" 0 failed, 0 skipped");
        assert!(passed && judged.status == 0, "{example}: {judged:#?}");
    }
}

/// The services that a component lists, as soon as it is found.
async fn services(finder: &Component, id: JausId) -> BTreeSet<String> {
    let mut changes = finder.watch();
    loop {
        let directory = finder.directory();
        let offered = directory.component(id).map(|component| component.offered());
        let urns = offered.into_iter().flatten().map(|offer| offer.urn.clone());
        let urns: BTreeSet<_> = urns.collect();
        if !urns.is_empty() {
            return urns;
        }
        changes.next().await;
    }
}

/// Judges a component by a judge of its own.
fn judge(component: JausId, steps: &[&str]) -> Run {
    let judge = format!("{}.1.1", 1000 + component.subsystem());
    let own = workspace("examples/own-service/services");
    let flags = [
        "--unicast",
        "--loopback",
        "--id",
        &judge,
        "--jsidl",
        own.to_str().unwrap(),
    ];
    run(
        &[&["judge", &component.to_string()], &flags[..], steps].concat(),
        b"",
    )
}
