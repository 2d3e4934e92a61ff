//! A complete mission with the real parts, each on its own node: the tester's mission, and its
//! reaction to the death of a part.

use std::path::PathBuf;
use std::time::Duration;

use jaus::component::{Component, Kind};
use jaus::node::{Config, Node};
use jaus_vehicle::motion::Ackermann;
use jaus_vehicle::parts::tester::steps::{Step, all_pass};
use jaus_vehicle::parts::tester::{Alone, MissionTest};

/// A test's own directory, removed when dropped.
pub(super) struct Directory(pub(super) PathBuf);

impl Directory {
    pub(super) fn new(name: &str) -> Self {
        let name = format!("jaus-mission-{name}-{}", std::process::id());
        let path = std::env::temp_dir().join(name);
        let _ = std::fs::remove_dir_all(&path);
        std::fs::create_dir_all(&path).unwrap();
        Self(path)
    }
}

impl Drop for Directory {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

async fn tester(subsystem: u16) -> (Node, Component) {
    let node = Node::start(Config::loopback(subsystem, 1)).unwrap();
    let tester = Component::builder(Kind::OperatorControlUnit, "Tester");
    let tester = tester.attach(&node, 77).unwrap();
    (node, tester)
}

fn told(steps: &[Step]) -> String {
    let lines: Vec<_> = steps.iter().map(ToString::to_string).collect();
    lines.join("\n")
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_mission_goes_through_the_whole_chain_though_the_path_driver_dies_on_the_way() {
    let _turn = super::turn().await;
    let directory = Directory::new("restart");
    let mut alone = Alone::start(1111, &directory.0, None).unwrap();
    let (node, tester) = tester(1112).await;
    let test = MissionTest {
        subsystem: 1111,
        patience: Duration::from_secs(30),
        speed: 0.3,
        ..MissionTest::default()
    };
    let (tell, mut told_so_far) = tokio::sync::mpsc::unbounded_channel();
    let running = test.run(&tester, move |step| tell.send(step.name.clone()).unwrap());
    let killing = async {
        while let Some(step) = told_so_far.recv().await {
            if step.starts_with("each driver is commanded") {
                alone.kill(48).await;
                alone.start_part(48).unwrap();
                break;
            }
        }
    };
    let (steps, ()) = tokio::join!(running, killing);
    assert!(all_pass(&steps), "{}", told(&steps));
    drop(tester);
    node.shutdown().await;
    alone.end().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_vehicle_with_steered_wheels_drives_the_same_mission() {
    let _turn = super::turn().await;
    let directory = Directory::new("steered");
    let steering = Some(Ackermann::default());
    let alone = Alone::start(1113, &directory.0, steering).unwrap();
    let (node, tester) = tester(1114).await;
    let test = MissionTest {
        subsystem: 1113,
        patience: Duration::from_secs(60),
        speed: 0.5,
        ..MissionTest::default()
    };
    let steps = test.run(&tester, |_| {}).await;
    assert!(all_pass(&steps), "{}", told(&steps));
    drop(tester);
    node.shutdown().await;
    alone.end().await;
}
