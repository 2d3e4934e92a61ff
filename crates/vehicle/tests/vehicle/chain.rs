//! What a vehicle under way drives by is changed by the client at the head of the chain of its drivers
//! alone: not by one of a higher authority, nor by one that had a sensor or the store before. And a client gets
//! no more authority over a driver by the stage before it than it has.
#![allow(
    clippy::disallowed_methods,
    clippy::unwrap_used,
    clippy::panic,
    reason = "a test with sockets"
)]

use std::time::Duration;

use jaus::address::JausId;
use jaus::codec::Message;
use jaus::component::Control;
use jaus::messages::core::set_time::TimeStamp;
use jaus::messages::core::{QueryControl, QueryTime, ReportTime, SetTime};
use jaus::messages::mobility::delete_zone::ZoneIdRec;
use jaus::messages::mobility::set_global_operating_zone::{
    GlobalExclusionZoneRec, GlobalExclusionZoneSeq, GlobalPolygonPointRec, Latitude, Longitude,
};
use jaus::messages::mobility::{
    DeleteZone, QueryLocalOperatingZone, ReportLocalOperatingZone, SetGlobalOperatingZone,
    SetLocalVector, delete_zone,
};
use jaus_vehicle::messages::ground::report_mission::Stage;
use jaus_vehicle::messages::ground::report_raster_change::Result_ as ChangeResult;
use jaus_vehicle::messages::ground::{
    CreateRasterMap, DeleteRasterMap, QueryRasterCells, QueryRasterMaps, ReportRasterCells,
    ReportRasterChange, SetRasterCells,
};
use tokio::time::sleep;

use crate::beliefs::{Stranger, driving, pose, until_stage};
use crate::mission::zones::{keep_out, square};
use crate::scene::{POSE, PRIMITIVE, STORE, Scene, VECTOR};
use crate::whole_vehicle::WholeVehicle;

/// A number of a keep-out zone far from everything.
const ZONE: u16 = 7;

/// What a stranger has of the vehicle: the pose sensor and the store, with the highest authority.
struct Hold {
    stranger: Stranger,
    sensor: Control,
    store: Control,
}

impl Hold {
    async fn take(scene: &Scene) -> Self {
        let stranger = Stranger::new(scene);
        let take = |id| {
            let client = &stranger.client;
            scene.until("control", move || async move {
                client.control(id, 255).await.ok()
            })
        };
        let (sensor, store) = (take(POSE).await, take(STORE).await);
        Self {
            stranger,
            sensor,
            store,
        }
    }

    /// Asks the store for a change of its maps; returns the answer.
    async fn change_map(&self, change: &impl Message) -> ReportRasterChange {
        self.stranger.client.request(STORE, change).await.unwrap()
    }
}

async fn zones(scene: &Scene) -> ReportLocalOperatingZone {
    let query = QueryLocalOperatingZone::default();
    scene.client.query(STORE, &query).await.unwrap()
}

/// The number of the only map, and its cells.
async fn map(scene: &Scene) -> (u16, ReportRasterCells) {
    let maps = scene.client.query(STORE, &QueryRasterMaps {}).await;
    let [map] = maps.unwrap().map_list[..].to_vec().try_into().unwrap();
    let query = QueryRasterCells {
        map: map.map,
        ..QueryRasterCells::default()
    };
    (map.map, scene.client.query(STORE, &query).await.unwrap())
}

/// Seconds of the hour by the sensor's clock.
async fn clock(scene: &Scene) -> u64 {
    let time: ReportTime = scene.client.query(POSE, &QueryTime::all()).await.unwrap();
    let stamp = time.time_stamp.unwrap();
    u64::from(stamp.minutes()) * 60 + u64::from(stamp.seconds())
}

fn delete() -> DeleteZone {
    DeleteZone {
        zone_id_list: vec![ZoneIdRec {
            zone_id: delete_zone::ZoneId(ZONE),
        }],
    }
}

/// The same zone, elsewhere and on the globe.
fn on_globe() -> SetGlobalOperatingZone {
    let vertex = |&(latitude, longitude): &(f64, f64)| GlobalExclusionZoneSeq {
        global_exclusion_zone_rec: GlobalExclusionZoneRec {
            zone_id: delete_zone::ZoneId(ZONE),
        },
        global_polygon_point_rec: GlobalPolygonPointRec {
            latitude: Latitude::new(latitude).unwrap(),
            longitude: Longitude::new(longitude).unwrap(),
            ..GlobalPolygonPointRec::default()
        },
    };
    let vertices = [(0.001, 0.001), (0.002, 0.001), (0.002, 0.002)];
    SetGlobalOperatingZone {
        global_exclusion_zones: vec![vertices.iter().map(vertex).collect()],
        ..SetGlobalOperatingZone::default()
    }
}

#[tokio::test(start_paused = true)]
async fn a_client_of_the_highest_authority_that_is_not_the_head_of_the_chain_changes_nothing() {
    let (vehicle, _planner) = driving("chain-head").await;
    let hold = Hold::take(&vehicle).await;
    hold.store
        .deliver(&keep_out(ZONE, &square((-20.0, 0.0), 1.5)))
        .await
        .unwrap();
    sleep(Duration::from_secs(1)).await;
    let (before, (number, cells)) = (zones(&vehicle).await, map(&vehicle).await);
    assert_eq!(
        before.local_exclusion_zones.len(),
        1,
        "a new zone restricts"
    );

    let (x, y) = vehicle.here().await;
    hold.sensor.deliver(&pose(x, y + 3.0, 1.5)).await.unwrap();
    let time = clock(&vehicle).await;
    let set = SetTime {
        time_stamp: Some(TimeStamp::default().with_minutes(59).unwrap()),
        ..SetTime::default()
    };
    hold.sensor.deliver(&set).await.unwrap();
    hold.store
        .deliver(&keep_out(ZONE, &square((-40.0, 0.0), 1.5)))
        .await
        .unwrap();
    hold.store.deliver(&on_globe()).await.unwrap();
    hold.store.deliver(&delete()).await.unwrap();
    // As a command whose end is reported.
    let client = &hold.stranger.client;
    if let Ok(running) = client.run(STORE, &delete(), Duration::from_secs(5)).await {
        assert!(running.end().await.is_err());
    }
    let create = CreateRasterMap {
        name: "other".into(),
        rows: 2,
        columns: 2,
        cell_size: 1.0,
        ..CreateRasterMap::default()
    };
    let set = SetRasterCells {
        map: number,
        rows: 1,
        columns: 1,
        cells: vec![255].into(),
        ..SetRasterCells::default()
    };
    let remove = DeleteRasterMap {
        map: number,
        ..DeleteRasterMap::default()
    };
    for answer in [
        hold.change_map(&create).await,
        hold.change_map(&set).await,
        hold.change_map(&remove).await,
    ] {
        assert_eq!(answer.result, ChangeResult::FAILED);
        let reason = answer.reason.to_string();
        assert!(reason.contains("only it can change this"), "{reason}");
    }

    // The store would have written any change by now.
    sleep(Duration::from_secs(1)).await;
    let (_, after) = vehicle.here().await;
    assert!(after < y + 2.0, "{y:.2} to {after:.2}");
    assert!(clock(&vehicle).await.abs_diff(time) < 60, "the clock");
    assert_eq!(zones(&vehicle).await, before);
    assert_eq!(map(&vehicle).await, (number, cells));
    until_stage(&vehicle, Stage::ARRIVED).await;
    vehicle.end().await;
}

/// Drives for 3 s by the vector driver, with this authority of a stranger. Returns who controls the motors then.
async fn controller_of_the_motors(vehicle: &WholeVehicle, authority: u8) -> (JausId, u8) {
    let stranger = Stranger::new(vehicle);
    let client = &stranger.client;
    let take = || async move { client.control(VECTOR, authority).await.ok() };
    let vector_driver = vehicle.until("control", take).await;
    vector_driver.resume().await.unwrap();
    let mut vector = SetLocalVector::default();
    vector.set_speed_m_per_s(0.5).unwrap();
    for _ in 0..30 {
        vector_driver.send(&vector).unwrap();
        sleep(Duration::from_millis(100)).await;
    }
    let told = vehicle.client.query(PRIMITIVE, &QueryControl {}).await;
    let told = told.unwrap();
    vector_driver.release().await;
    (
        JausId::new(told.subsystem_id, told.node_id, told.component_id),
        told.authority_code,
    )
}

#[tokio::test(start_paused = true)]
async fn a_client_gets_no_more_authority_over_the_motors_by_the_stage_before_them() {
    let vehicle = WholeVehicle::start("lent-authority", None);
    for (authority, lent) in [(1, 1), (50, 50), (255, 100)] {
        let free = controller_of_the_motors(&vehicle, authority).await;
        assert_eq!(free, (VECTOR, lent));
        sleep(Duration::from_secs(2)).await;
    }
    let take = || async { vehicle.client.control(PRIMITIVE, 50).await.ok() };
    let _operator = vehicle.until("control", take).await;
    let held = controller_of_the_motors(&vehicle, 1).await;
    assert_eq!(held, (vehicle.client.id(), 50), "the guest has 1");
    vehicle.end().await;
}
