//! A complete mission with the real parts, each on its own node: the tester's mission, and its
//! reaction to the death of a part.

use std::time::Duration;

use jaus_vehicle::motion::Ackermann;
use jaus_vehicle::parts::tester::MissionTest;
use jaus_vehicle::parts::tester::steps::{Step, all_pass};

use crate::scene::PATH;
use crate::whole_vehicle::WholeVehicle;

fn listed(steps: &[Step]) -> String {
    let lines: Vec<_> = steps.iter().map(ToString::to_string).collect();
    lines.join("\n")
}

#[tokio::test(start_paused = true)]
async fn a_mission_goes_through_the_whole_chain_though_the_path_driver_dies_on_the_way() {
    let mut vehicle = WholeVehicle::with_retries("chain", None, 2);
    let tester = vehicle.client.clone();
    let test = MissionTest {
        subsystem: PATH.subsystem(),
        patience: Duration::from_secs(30),
        speed: 0.3,
        ..MissionTest::default()
    };
    let (tell, mut steps_so_far) = tokio::sync::mpsc::unbounded_channel();
    let running = test.run(&tester, move |step| tell.send(step.name.clone()).unwrap());
    let killing = async {
        while let Some(step) = steps_so_far.recv().await {
            if step.starts_with("each driver is commanded") {
                vehicle.restart(PATH).await;
                break;
            }
        }
    };
    let (steps, ()) = tokio::join!(running, killing);
    assert!(all_pass(&steps), "{}", listed(&steps));
    vehicle.end().await;
}

#[tokio::test(start_paused = true)]
async fn a_vehicle_with_steered_wheels_drives_the_same_mission() {
    let vehicle = WholeVehicle::start("steered", Some(Ackermann::default()));
    let test = MissionTest {
        subsystem: PATH.subsystem(),
        patience: Duration::from_secs(60),
        speed: 0.5,
        ..MissionTest::default()
    };
    let steps = test.run(&vehicle.client, |_| {}).await;
    assert!(all_pass(&steps), "{}", listed(&steps));
    vehicle.end().await;
}
