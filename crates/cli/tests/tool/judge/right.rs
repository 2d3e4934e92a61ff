//! A component of the library's own core services passes every applicable step.

use std::sync::mpsc;

use jaus::component::{Component, Kind};
use jaus::link::Group;
use jaus::node::{Config, Node};
use jaus::service::Management;

use crate::judge::peer::network;
use crate::support::run;

/// Judges a component that has Management, in both forms.
#[test]
fn the_core_services_pass_every_step_that_they_are_in() {
    let flags = network();
    let group: Group = flags.last().unwrap().parse().unwrap();
    let runtime = tokio::runtime::Builder::new_multi_thread()
        .worker_threads(1)
        .enable_all()
        .build()
        .unwrap();
    let (ready, is_ready) = mpsc::channel();
    runtime.spawn(async move {
        let node = Node::start(Config::loopback(105, 1).group(group)).unwrap();
        let component = Component::builder(Kind::Vehicle, "Rover")
            .management(Management::default())
            .attach(&node, 1)
            .unwrap();
        ready.send(()).unwrap();
        std::future::pending::<()>().await;
        drop(component);
    });
    is_ready.recv().unwrap();
    let network: Vec<&str> = flags.iter().map(String::as_str).collect();
    let judge = ["judge", "105.1.1", "--only", "A1-A3,B1-B26"];
    let judged = run(&[&judge, &*network].concat(), b"");
    assert_eq!(
        (judged.status, &*judged.stderr),
        (0, ""),
        "{}",
        judged.stdout
    );
    assert!(judged.stdout.contains(" 0 failed, "), "{}", judged.stdout);
    println!("{}", judged.stdout);
}
