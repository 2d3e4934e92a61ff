//! The reference vehicle: missions, the store under power cuts, faults, and hostile clients.

mod mission;
mod navigation;
mod part_faults;
mod scene;
mod store;
mod vehicle_hostile;
mod waterfall;
mod whole_vehicle;
