//! The chain of drivers as a whole. A client sends a path to the path segment driver, and the
//! vehicle reaches its end through all stages, even if any part restarts on the way. An emergency
//! at the last stage ends the motion permanently.
#![allow(
    clippy::disallowed_methods,
    clippy::unwrap_used,
    reason = "a failure here fails the test"
)]

use std::time::Duration;

use jaus::address::JausId;
use jaus::codec::{FormattedBlob, Message};
use jaus::component::Control;
use jaus::messages::core::set_element::{ElementDataFormat, ElementRec, RequestIdRec};
use jaus::messages::core::{ConfirmElementRequest, SetElement};
use jaus::messages::mobility::{ExecuteList, SetLocalPathSegment, local_path_segment_driver};
use jaus_vehicle::ground::{StageReport, StageState};

use crate::scene::{PATH, POSE, PRIMITIVE, Scene, VECTOR, VELOCITY};
use crate::whole_vehicle::WholeVehicle;

/// Takes control of the path driver, and makes it drive in straight lines through these points.
async fn drive(scene: &Scene, points: &[(f64, f64)]) -> Control {
    let control = scene.control(PATH, local_path_segment_driver::URN).await;
    let last = points.len() as u16;
    let elements = points.iter().zip(1_u16..).map(|(&point, uid)| ElementRec {
        element_uid: uid,
        previous_uid: uid - 1,
        next_uid: if uid == last { 0 } else { uid + 1 },
        element_data: FormattedBlob::new(ElementDataFormat::JAUS_MESSAGE, segment(point)),
    });
    let request = SetElement {
        request_id_rec: RequestIdRec { request_id: 1 },
        element_list: elements.collect(),
    };
    let _: ConfirmElementRequest = scene.client.request(PATH, &request).await.unwrap();
    execute(&control).await;
    control
}

/// Makes the path driver execute its list from its first element.
async fn execute(control: &Control) {
    let mut execute = ExecuteList {
        element_uid: Some(1),
        ..ExecuteList::default()
    };
    execute.set_speed_m_per_s(1.5).unwrap();
    control.deliver(&execute).await.unwrap();
}

async fn until_stage(scene: &Scene, id: JausId, state: StageState) -> StageReport {
    let is_there = || async {
        let stage = scene.stage(id).await?;
        (stage.state == state).then_some(stage)
    };
    scene.until(&format!("{id} {state}"), is_there).await
}

/// A straight line.
fn segment((x, y): (f64, f64)) -> bytes::Bytes {
    let mut line = SetLocalPathSegment::default();
    line.set_p1_x_m(x).unwrap();
    line.set_p1_y_m(y).unwrap();
    line.set_p2_x_m(x).unwrap();
    line.set_p2_y_m(y).unwrap();
    line.set_weighting_factor_value(0.0).unwrap();
    line.encode().unwrap()
}

/// The points that the vehicle drives through.
const POINTS: [(f64, f64); 2] = [(16.0, 0.0), (16.0, 4.0)];

#[tokio::test(start_paused = true)]
async fn whichever_part_is_started_again_the_vehicle_goes_on_only_by_a_new_command() {
    let mut vehicle = WholeVehicle::start("waterfall", None);
    let mut control = drive(&vehicle, &POINTS).await;
    until_stage(&vehicle, PRIMITIVE, StageState::Active).await;
    let mut at = 0.8;
    for part in [PRIMITIVE, VELOCITY, POSE, VECTOR] {
        vehicle.until_at("sets out", |x, _| x > at).await;
        vehicle.kill(part).await;
        tokio::time::sleep(Duration::from_secs(1)).await;
        vehicle.start_part(part);
        // Longer than any retry delay, and than the braking.
        tokio::time::sleep(Duration::from_secs(8)).await;
        let before = vehicle.here().await;
        assert!(before.0 < at + 2.5, "{part}: {before:?}");
        tokio::time::sleep(Duration::from_secs(20)).await;
        let after = vehicle.here().await;
        let moved = (after.0 - before.0).hypot(after.1 - before.1);
        assert!(moved < 0.05, "{part}: {before:?}, then {after:?}");
        control.release().await;
        control = drive(&vehicle, &POINTS).await;
        at = after.0 + 0.4;
    }
    vehicle.until_at("on the second line", |_, y| y > 0.8).await;
    vehicle.restart(PATH).await;
    control.release().await;
    // The client must repeat its command.
    let _control = drive(&vehicle, &[(16.0, 4.0)]).await;
    let stage = until_stage(&vehicle, PATH, StageState::Done).await;
    assert_eq!(stage.progress, 100);
    let (x, y) = vehicle.here().await;
    assert!((x - 16.0).hypot(y - 4.0) < 0.8, "at {x}, {y}");
    until_stage(&vehicle, PRIMITIVE, StageState::Idle).await;
    vehicle.end().await;
}

#[tokio::test(start_paused = true)]
async fn after_an_emergency_at_the_last_stage_nothing_moves_by_itself() {
    let vehicle = WholeVehicle::start("waterfall-emergency", None);
    let control = drive(&vehicle, &[(8.0, 0.0)]).await;
    vehicle.until_at("sets out", |x, _| x > 0.5).await;
    vehicle.client.set_emergency(PRIMITIVE).await.unwrap();
    let stage = until_stage(&vehicle, PATH, StageState::Blocked).await;
    assert!(
        stage.stands_down() && stage.reason.contains("emergency"),
        "{stage:?}"
    );
    vehicle.client.clear_emergency(PRIMITIVE).await.unwrap();
    let before = vehicle.wheels().await;
    // Longer than any retry delay.
    tokio::time::sleep(Duration::from_secs(3)).await;
    let after = vehicle.wheels().await;
    assert!(
        (after.0 - before.0).abs() < 0.1,
        "{before:?}, then {after:?}"
    );
    // After a new command it continues.
    execute(&control).await;
    vehicle.until_at("goes on", |x, _| x > 2.0).await;
    vehicle.end().await;
}
