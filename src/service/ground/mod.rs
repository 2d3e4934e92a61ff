//! The services of a ground vehicle, which are our own: what no published set has.
//!
//! Each service tells others of something that lives elsewhere, and is a thin cover over it: the
//! mission in [`mission`](crate::mission).

mod odometry;
mod planner;
mod stage;

pub use odometry::WheelOdometry;
pub use planner::{MissionPlanner, Missions, News};
pub use stage::{StageBoard, StageReport, StageState};
