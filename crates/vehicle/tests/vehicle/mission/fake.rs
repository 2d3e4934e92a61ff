//! A vehicle assembled from fakes.

use std::sync::{Arc, Mutex};
use std::time::Duration;

use jaus::address::JausId;
use jaus::component::{Component, Control, Handlers, Kind, Management, Subscription, When};
use jaus::messages::mobility::{
    QueryLocalVector, QueryLocalVectorExt, QueryWrenchEffort, local_vector_driver, primitive_driver,
};
use jaus::node::{Config, Node};
use jaus_test_kit::group::own_group;
use jaus_test_kit::waiting::{LIMIT, within_limit};
use jaus_vehicle::messages::ground::report_mission::Stage as MissionStage;
use jaus_vehicle::messages::ground::report_raster_maps::MapRec;
use jaus_vehicle::messages::ground::report_stage::State;
use jaus_vehicle::messages::ground::{
    QueryMission, QueryRasterCells, QueryRasterMaps, QueryStage, ReportMission, ReportRasterCells,
    ReportRasterMaps, ReportStage, SetDestination, mission_planner, raster_maps, stage,
};
use jaus_vehicle::mission::{Footprint, Settings};
use jaus_vehicle::mobility::Vehicle;
use jaus_vehicle::motion::{Frame, Limits, Pilot, SkidSteer, SkidSteerConfig};
use jaus_vehicle::parts::{Part, Planner, Slot};
use tokio::task::JoinHandle;

/// Side length of the map in cells of 1 m; its corner is the origin.
const SIDE: u16 = 16;

/// A stage whose state the test sets.
#[derive(Clone, Default)]
pub(crate) struct Switch(Arc<Mutex<ReportStage>>);

impl Switch {
    fn service(&self) -> Handlers {
        let report = Arc::clone(&self.0);
        Handlers::new(stage::LATEST).answer(move |_: QueryStage| report.lock().unwrap().clone())
    }

    pub(crate) async fn stand_down(&self, component: &Component, reason: &str) {
        {
            let mut report = self.0.lock().unwrap();
            report.next_subsystem_id = 0;
            report.state = State::BLOCKED;
            report.reason = reason.into();
        }
        _ = component.changed::<QueryStage>().await;
    }

    pub(crate) async fn set(&self, component: &Component, state: State, reason: &str) {
        {
            let mut report = self.0.lock().unwrap();
            report.state = state;
            report.reason = reason.into();
            // As if it commanded the next stage; without one, it has suspended motion.
            report.next_subsystem_id = 1;
        }
        _ = component.changed::<QueryStage>().await;
    }
}

/// One driver of the chain.
pub(crate) struct Driver {
    pub(crate) component: Component,
    pub(crate) stage: Switch,
}

/// The vehicle and an operator.
pub(crate) struct World {
    nodes: Vec<Node>,
    pub(crate) path: Driver,
    pub(crate) vector: Driver,
    pub(crate) primitive: Driver,
    pub(crate) vehicle: Vehicle,
    pub(crate) store: Option<Component>,
    pub(crate) cells: Arc<Mutex<Vec<u8>>>,
    planner: JoinHandle<()>,
    pub(crate) operator: Component,
    pub(crate) control: Control,
    pub(crate) reports: Subscription<ReportMission>,
}

impl World {
    /// Starts everything; the operator has control of the planner.
    pub(crate) async fn new(subsystem: u16) -> Self {
        let group = own_group();
        let start = |subsystem| Node::start(Config::loopback(subsystem, 1).group(group)).unwrap();
        let (node, station) = (start(subsystem), start(subsystem + 1));
        let vehicle = vehicle();
        let path = Switch::default();
        let path = Driver {
            component: driver(&node, 48, |builder| {
                builder
                    .offer(vehicle.list_manager())
                    .offer(vehicle.local_path_segment_driver())
                    .offer(vehicle.local_pose_sensor())
                    .offer(path.service())
            }),
            stage: path,
        };
        let plain = |number, service: jaus::codec::ServiceId| {
            let stage = Switch::default();
            let component = driver(&node, number, |builder| {
                let service = Handlers::new(service)
                    .declines::<QueryLocalVector>()
                    .declines::<QueryLocalVectorExt>()
                    .declines::<QueryWrenchEffort>();
                builder.offer(service).offer(stage.service())
            });
            Driver { component, stage }
        };
        let vector = plain(44, local_vector_driver::LATEST);
        let primitive = plain(33, primitive_driver::LATEST);
        let cells = Arc::new(Mutex::new(vec![255; usize::from(SIDE) * usize::from(SIDE)]));
        let store = store(&node, Arc::clone(&cells));
        let slot = Slot::new(
            node.attach(36).unwrap(),
            node.clone(),
            Kind::Vehicle,
            "Fake",
        );
        let planner = tokio::spawn(async move {
            let error = settings().run(slot).await.unwrap_err();
            panic!("{error}");
        });
        let operator = Component::builder(Kind::OperatorControlUnit, "Operator");
        let operator = operator.attach(&station, 1).unwrap();
        let planner_id = planner_of(&operator, subsystem).await;
        let control = operator.control(planner_id, 200).await.unwrap();
        control.resume().await.unwrap();
        let reports = operator
            .subscribe(planner_id, &QueryMission {}, When::OnChange)
            .await
            .unwrap();
        Self {
            nodes: vec![node, station],
            path,
            vector,
            primitive,
            vehicle,
            store: Some(store),
            cells,
            planner,
            operator,
            control,
            reports,
        }
    }

    /// The vehicle's node.
    pub(crate) fn node(&self) -> Node {
        self.nodes[0].clone()
    }

    pub(crate) async fn go(&self, x: f64, y: f64, approved: bool) {
        let to = SetDestination {
            x,
            y,
            approved: jaus_vehicle::messages::ground::set_destination::Approved(approved.into()),
            speed: Some(3.0),
        };
        self.control.deliver(&to).await.unwrap();
    }

    /// Waits until the mission report satisfies the condition, and returns it.
    pub(crate) async fn until(&mut self, wanted: impl Fn(&ReportMission) -> bool) -> ReportMission {
        let peer = self.control.peer();
        let mut last = ReportMission::default();
        let coming = async {
            loop {
                last = self.operator.query(peer, &QueryMission {}).await.unwrap();
                if wanted(&last) {
                    return last.clone();
                }
                tokio::select! {
                    report = self.reports.report() => {
                        last = report.expect("the planner lives");
                        if wanted(&last) {
                            return last.clone();
                        }
                    }
                    () = tokio::time::sleep(Duration::from_millis(200)) => {}
                }
            }
        };
        let report = tokio::time::timeout(LIMIT, coming).await;
        report.unwrap_or_else(|_| panic!("it did not come to that: {last:?}"))
    }

    pub(crate) async fn until_stage(&mut self, stage: MissionStage) -> ReportMission {
        self.until(|report| report.stage == stage).await
    }

    /// Makes the drivers active, one after the other.
    pub(crate) async fn engage(&mut self) {
        self.until_stage(MissionStage::PATH).await;
        self.until_ready().await;
        let drivers = [
            (&self.path, MissionStage::VECTOR),
            (&self.vector, MissionStage::PRIMITIVE),
            (&self.primitive, MissionStage::DRIVING),
        ]
        .map(|(driver, stage)| (driver.component.clone(), driver.stage.clone(), stage));
        for (component, switch, stage) in drivers {
            switch.set(&component, State::ACTIVE, "").await;
            self.until(|report| report.stage >= stage).await;
        }
    }

    /// Waits until the planner has made the path segment driver Ready and sent its list.
    async fn until_ready(&self) {
        let mut standing = self.path.component.watch_standing();
        let ready = standing.wait_for(|standing| standing.may_act());
        within_limit(ready).await.unwrap();
    }

    pub(crate) async fn shut_down(self) {
        self.planner.abort();
        let _ = self.planner.await;
        drop((
            self.path,
            self.vector,
            self.primitive,
            self.store,
            self.operator,
            self.control,
            self.reports,
        ));
        for node in self.nodes {
            node.shutdown().await;
        }
    }
}

/// Finds the planner of a subsystem.
async fn planner_of(operator: &Component, subsystem: u16) -> JausId {
    let mut changes = operator.watch();
    loop {
        let directory = operator.directory();
        let mut planners = directory.offering(mission_planner::URN);
        if let Some(planner) = planners.find(|it| it.id.subsystem() == subsystem) {
            return planner.id;
        }
        changes.next().await.expect("the node lives");
    }
}

fn settings() -> Planner {
    Planner {
        vehicle: Footprint {
            width: 0.6,
            margin: 0.1,
            ..Footprint::default()
        },
        mission: Settings {
            pause: Duration::from_millis(200),
            settling: Duration::from_millis(200),
            ..Settings::default()
        },
        ..Planner::default()
    }
}

/// A simulated platform in the corner of the map.
fn vehicle() -> Vehicle {
    let limits = Limits {
        speed: 5.0,
        reverse: 1.0,
        acceleration: 10.0,
        deceleration: 10.0,
        yaw_rate: 6.0,
        yaw_acceleration: 30.0,
        turning_radius: 0.0,
    };
    let mut pilot = Pilot::new(
        SkidSteer::new(SkidSteerConfig {
            limits,
            ..SkidSteerConfig::default()
        }),
        Frame::at(52.5, 13.4),
    );
    pilot.set_pose(jaus_vehicle::motion::Pose {
        x: 1.5,
        y: 1.5,
        ..jaus_vehicle::motion::Pose::default()
    });
    Vehicle::new(pilot)
}

fn driver(
    node: &Node,
    number: u8,
    offer: impl FnOnce(jaus::component::Builder) -> jaus::component::Builder,
) -> Component {
    let builder = Component::builder(Kind::Vehicle, "Fake").management(Management::new());
    offer(builder).attach(node, number).unwrap()
}

pub(crate) fn store(node: &Node, cells: Arc<Mutex<Vec<u8>>>) -> Component {
    let maps = Handlers::new(raster_maps::LATEST)
        .answer(|_: QueryRasterMaps| ReportRasterMaps {
            map_list: vec![MapRec {
                map: 1,
                name: "traversability".into(),
                rows: SIDE,
                columns: SIDE,
                cell_size: 1.0,
                ..MapRec::default()
            }],
        })
        .answer(move |query: QueryRasterCells| {
            let cells = cells.lock().unwrap();
            let side = usize::from(SIDE);
            let rows = usize::from(query.row)..usize::from(query.row + query.maximum_rows);
            let tile = rows
                .flat_map(|row| cells[row * side..][..usize::from(query.maximum_columns)].to_vec());
            ReportRasterCells {
                map: query.map,
                revision: 0,
                row: query.row,
                column: query.column,
                rows: query.maximum_rows,
                columns: query.maximum_columns,
                cells: tile.collect::<Vec<u8>>().into(),
            }
        });
    let store = Component::builder(Kind::Vehicle, "Fake").offer(maps);
    store.attach(node, 61).unwrap()
}
