//! A whole vehicle in one process. Each part has its own node on loopback, so messages use the same
//! transport as between boards.

use std::collections::BTreeMap;
use std::path::PathBuf;

use tokio::task::{AbortHandle, JoinSet};

use crate::motion::Ackermann;
use crate::parts::{
    KnowledgeStore, Part, PartError, PathDriver, Planner, PoseSensor, PrimitiveDriver, Slot,
    SteeringGear, VectorDriver, VelocitySensor,
};
use jaus::component::Kind;
use jaus::node::{Config, Node, StartError};

/// The running parts of a vehicle that a mission needs.
#[derive(Debug)]
pub struct Alone {
    subsystem: u16,
    /// Directory for the store's file and the pose sensor's pose.
    directory: PathBuf,
    /// The geometry of a vehicle with steered wheels.
    steering: Option<Ackermann>,
    running: BTreeMap<u8, (Node, AbortHandle)>,
    tasks: JoinSet<PartError>,
}

/// Why a part does not start.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum AloneError {
    /// Its node cannot start.
    #[error(transparent)]
    Start(#[from] StartError),
    /// Its component cannot be attached.
    #[error(transparent)]
    Attach(#[from] jaus::node::AttachError),
}

impl Alone {
    /// The parts by component number: primitive driver, planner, local pose sensor, velocity state
    /// sensor, vector driver, path segment driver, knowledge store.
    pub const PARTS: [u8; 7] = [33, 36, 41, 42, 44, 48, 61];

    /// Starts all parts, each as component C on node C of a subsystem. They store their files in
    /// `directory`. With `steering` the front wheels are steered; without, the vehicle turns on the
    /// spot.
    ///
    /// # Errors
    /// If a node cannot start.
    ///
    /// # Panics
    /// Outside a tokio runtime.
    pub fn start(
        subsystem: u16,
        directory: impl Into<PathBuf>,
        steering: Option<Ackermann>,
    ) -> Result<Self, AloneError> {
        let mut alone = Self {
            subsystem,
            directory: directory.into(),
            steering,
            running: BTreeMap::new(),
            tasks: JoinSet::new(),
        };
        for number in Self::PARTS {
            alone.start_part(number)?;
        }
        Ok(alone)
    }

    /// Starts a part, for example after [`kill`](Self::kill).
    ///
    /// # Errors
    /// If its node cannot start.
    pub fn start_part(&mut self, number: u8) -> Result<(), AloneError> {
        let node = Node::start(Config::loopback(self.subsystem, number))?;
        let slot = Slot {
            port: node.attach(number)?,
            node: Some(node.clone()),
            kind: Kind::Vehicle,
            name: "Tested".to_owned(),
        };
        let radius = self.steering.map_or(0.0, |it| it.turning_radius());
        let task = match number {
            33 => {
                let gear = self.steering.map(SteeringGear::simulated);
                self.spawn(PrimitiveDriver::default().steering(gear), slot)
            }
            36 => self.spawn(Planner::default().turning_radius(radius), slot),
            41 => self.spawn(PoseSensor::default(), slot),
            42 => self.spawn(VelocitySensor::default(), slot),
            44 => self.spawn(VectorDriver::default().turning_radius(radius), slot),
            48 => self.spawn(PathDriver::default().turning_radius(radius), slot),
            _ => {
                let store = KnowledgeStore {
                    file: self.directory.join(KnowledgeStore::FILE),
                    map: Some(KnowledgeStore::demo_map()),
                    ..KnowledgeStore::default()
                };
                self.spawn(store, slot)
            }
        };
        self.running.insert(number, (node, task));
        Ok(())
    }

    fn spawn(&mut self, part: impl Part, slot: Slot) -> AbortHandle {
        self.tasks.spawn(async move {
            let Err(error) = part.run(slot).await;
            error
        })
    }

    /// Ends a part immediately, as if its process were killed.
    pub async fn kill(&mut self, number: u8) {
        if let Some((node, task)) = self.running.remove(&number) {
            task.abort();
            node.shutdown().await;
        }
    }

    /// The nodes of the running parts.
    pub fn nodes(&self) -> impl Iterator<Item = &Node> {
        self.running.values().map(|(node, _)| node)
    }

    /// Waits until a part fails, and returns its error. Pending forever while all parts run.
    pub async fn broken(&mut self) -> PartError {
        loop {
            match self.tasks.join_next().await {
                Some(Ok(error)) => return error,
                // The part was killed.
                Some(Err(_)) => {}
                None => std::future::pending().await,
            }
        }
    }

    /// Ends all parts, then their nodes.
    pub async fn end(mut self) {
        self.tasks.shutdown().await;
        for (node, _) in self.running.into_values() {
            node.shutdown().await;
        }
    }
}
