//! The services of a ground vehicle, which are our own: what no published set has.
//!
//! Each service tells others of something that lives elsewhere, and is a thin cover over it: the
//! mission in [`mission`](crate::mission), objects and maps in [`world`](crate::world).

mod knowledge_store;
mod odometry;
mod planner;
mod raster_maps;
mod stage;
mod world_store;

pub use knowledge_store::VectorKnowledgeStore;
pub use odometry::WheelOdometry;
pub use planner::{MissionPlanner, Missions, News};
pub use raster_maps::RasterMaps;
pub use stage::{StageBoard, StageReport, StageState};
pub use world_store::WorldStore;
