//! Ground vehicle services over models of this crate: those of this project, which no published
//! service set covers, the operating zones of AS6009, and the range sensor of AS6060.
//!
//! Each service is a thin layer over a model in another module: missions in
//! [`mission`](crate::mission), objects, maps and zones in [`world`](crate::world).

mod knowledge_store;
mod odometry;
mod operating_zones;
mod planner;
mod range_sensor;
mod raster_cells;
mod raster_maps;
mod stage;
mod world_store;

pub use knowledge_store::VectorKnowledgeStore;
pub use odometry::WheelOdometry;
pub use operating_zones::{OperatingZones, reported_zones};
pub use planner::{MissionPlanner, Missions, News};
pub use range_sensor::{RangeSensor, reported_scan};
pub use raster_cells::{RasterEdition, fetch_cells};
pub use raster_maps::RasterMaps;
pub(crate) use raster_maps::refuse_map_change;
pub use stage::{StageBoard, StageReport, StageState};
pub use world_store::WorldStore;
