//! The reference vehicle: missions, sensors, the store under power cuts, faults, and hostile clients.

mod beliefs;
mod chain;
mod gaps;
mod inertial;
mod mission;
mod navigation;
mod part_faults;
mod scene;
mod store;
mod vehicle_hostile;
mod waterfall;
mod whole_vehicle;
