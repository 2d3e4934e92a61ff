//! Who controls the drivers of a vehicle, and the guard that refuses to change what they drive by.
//!
//! A driver is controlled by a client, or by the driver before it in the chain. While that is so, the
//! pose, the time of a pose sensor, the zones and the maps can be changed only by the client at the
//! head of the chain. While nothing is controlled, the usual rules of the component apply.

use std::collections::{BTreeMap, BTreeSet};
use std::convert::Infallible;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Instant;

use crate::messages::ground::mission_planner;
use crate::parts::PartError;
use crate::parts::planner::chain::controller;
use jaus::address::JausId;
use jaus::codec::ServiceId;
use jaus::component::{Audience, Component, GroupUpdate, When};
use jaus::endpoint::Received;
use jaus::messages::core::{QueryControl, management};
use jaus::messages::mobility::{
    global_path_segment_driver, global_vector_driver, global_waypoint_driver,
    global_waypoint_list_driver, local_path_segment_driver, local_vector_driver,
    local_waypoint_driver, local_waypoint_list_driver, primitive_driver, velocity_state_driver,
};
use jaus::service::{Context, Handled, Service, code_of};

/// The services of components that drive, or have others drive.
const DRIVERS: [&str; 11] = [
    mission_planner::URN,
    primitive_driver::URN,
    velocity_state_driver::URN,
    local_vector_driver::URN,
    global_vector_driver::URN,
    local_waypoint_driver::URN,
    global_waypoint_driver::URN,
    local_waypoint_list_driver::URN,
    global_waypoint_list_driver::URN,
    local_path_segment_driver::URN,
    global_path_segment_driver::URN,
];

/// Who controls the drivers of a subsystem. Cheap to clone; all clones share one state.
#[derive(Debug, Clone, Default)]
pub(in crate::parts) struct ChainControl(Arc<Mutex<Controllers>>);

/// The drivers that a client controls, and that client.
type Controllers = BTreeMap<JausId, JausId>;

impl ChainControl {
    /// Tracks the drivers of the component's subsystem.
    pub(in crate::parts) async fn track(
        &self,
        component: &Component,
    ) -> Result<Infallible, PartError> {
        let subsystem = component.id().subsystem();
        // What can move something has states, and so offers Management.
        let movers = Audience::providers(management::URN).in_subsystem(subsystem);
        let reports = component.subscribe_all(movers, &QueryControl {}, When::OnChange);
        let mut reports = reports.map_err(|error| PartError::Broken(error.to_string()))?;
        loop {
            let (source, update) = reports.next().await.ok_or(PartError::NodeStopped)?;
            let report = match update {
                GroupUpdate::Report(report) => Some(report),
                GroupUpdate::Up => component.query(source, &QueryControl {}).await.ok(),
                GroupUpdate::Down { .. } | GroupUpdate::Gone => None,
                GroupUpdate::NotSubscribed { .. } => continue,
            };
            let client = report.as_ref().and_then(controller);
            self.set(source, client.filter(|_| is_driver(component, source)));
        }
    }

    /// Sets the client in control of a driver.
    fn set(&self, driver: JausId, client: Option<JausId>) {
        let mut controllers = self.lock();
        match client {
            Some(client) => controllers.insert(driver, client),
            None => controllers.remove(&driver),
        };
    }

    /// Whether a client may change what the drivers drive by.
    ///
    /// # Errors
    /// Who else would have to, as text for the operator.
    pub(in crate::parts) fn permits(&self, client: JausId) -> Result<(), String> {
        match heads(&self.lock()).into_iter().find(|&head| head != client) {
            Some(head) => Err(format!(
                "{head} is in control of the drivers: only it can change this, or anyone after it \
                 has released control"
            )),
            None => Ok(()),
        }
    }

    /// A guard for the messages with these codes. Offer it before the services that handle them.
    pub(in crate::parts) fn guard(&self, codes: &'static [u16]) -> ChainGuard {
        ChainGuard {
            control: self.clone(),
            codes,
            is_harmless: Box::new(|_| false),
            refuse: |_, _, _| {},
        }
    }

    fn lock(&self) -> MutexGuard<'_, Controllers> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

fn is_driver(component: &Component, id: JausId) -> bool {
    let directory = component.directory();
    let entry = directory.components().find(|entry| entry.id == id);
    entry.is_some_and(|entry| DRIVERS.iter().any(|urn| entry.offers(urn)))
}

/// The ids at the heads of the chains: those that no other controls.
fn heads(controllers: &Controllers) -> BTreeSet<JausId> {
    let clients = controllers.values().copied();
    let heads = clients.filter(|client| !controllers.contains_key(client));
    let heads: BTreeSet<_> = heads.collect();
    match (heads.is_empty(), controllers.values().next()) {
        // Two drivers that control each other have no head, and permit nobody.
        (true, Some(client)) => BTreeSet::from([*client]),
        _ => heads,
    }
}

/// Whether a message changes nothing that the drivers rely on.
type IsHarmless = Box<dyn Fn(&Received) -> bool + Send>;

/// Consumes messages of clients that may not change what the drivers drive by.
pub(in crate::parts) struct ChainGuard {
    control: ChainControl,
    codes: &'static [u16],
    is_harmless: IsHarmless,
    refuse: fn(&Received, &str, &mut Context<'_>),
}

impl ChainGuard {
    /// Accepts harmless messages from any sender.
    pub(in crate::parts) fn unless(
        mut self,
        is_harmless: impl Fn(&Received) -> bool + Send + 'static,
    ) -> Self {
        self.is_harmless = Box::new(is_harmless);
        self
    }

    /// Sets the answer to a refused message, which is given the reason.
    pub(in crate::parts) const fn or_else(
        mut self,
        refuse: fn(&Received, &str, &mut Context<'_>),
    ) -> Self {
        self.refuse = refuse;
        self
    }
}

impl Service for ChainGuard {
    fn offers(&self) -> Vec<ServiceId> {
        Vec::new()
    }

    fn handle_message(
        &mut self,
        _: Instant,
        message: &Received,
        context: &mut Context<'_>,
    ) -> Handled {
        let code = code_of(&message.payload).filter(|code| self.codes.contains(code));
        let Some(code) = code.filter(|_| !(self.is_harmless)(message)) else {
            return Handled::No;
        };
        let Err(why) = self.control.permits(message.source) else {
            return Handled::No;
        };
        tracing::warn!(source = %message.source, "message {code:04X}h refused: {why}");
        (self.refuse)(message, &why, context);
        context.ended(code, false);
        Handled::Yes
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mobility::Vehicle;
    use crate::motion::{Frame, Observed, Pilot};
    use jaus::codec::Message;
    use jaus::messages::mobility::SetLocalPose;
    use jaus::service::rig::{CLIENT, Rig, STRANGER};

    const PLANNER: JausId = JausId::new(101, 36, 36);
    const PATH: JausId = JausId::new(101, 48, 48);
    const VECTOR: JausId = JausId::new(101, 44, 44);

    fn chain(links: &[(JausId, JausId)]) -> ChainControl {
        let control = ChainControl::default();
        for &(driver, client) in links {
            control.set(driver, Some(client));
        }
        control
    }

    #[test]
    fn only_the_head_of_every_chain_may_change_what_is_driven_by() {
        for (links, client, stranger) in [
            (&[][..], true, true),
            (&[(VECTOR, CLIENT)], true, false),
            (
                &[(VECTOR, PATH), (PATH, PLANNER), (PLANNER, CLIENT)],
                true,
                false,
            ),
            // A planner that drives without a client, such as on its way back.
            (&[(VECTOR, PATH), (PATH, PLANNER)], false, false),
            (&[(VECTOR, CLIENT), (PLANNER, STRANGER)], false, false),
            (&[(VECTOR, PATH), (PATH, VECTOR)], false, false),
        ] {
            let control = chain(links);
            assert_eq!(control.permits(CLIENT).is_ok(), client, "{links:?}");
            assert_eq!(control.permits(STRANGER).is_ok(), stranger, "{links:?}");
        }
        let control = chain(&[(VECTOR, CLIENT)]);
        control.set(VECTOR, None);
        assert_eq!(control.permits(STRANGER), Ok(()), "released");
    }

    #[test]
    fn the_pose_is_not_set_by_a_client_that_does_not_control_the_chain() {
        const CODES: &[u16] = &[SetLocalPose::CODE];
        let control = chain(&[(VECTOR, STRANGER)]);
        let observed = Observed::default();
        let vehicle = Vehicle::new(Pilot::new(observed.clone(), Frame::default()));
        let services: Vec<Box<dyn Service>> = vec![
            Box::new(control.guard(CODES)),
            Box::new(vehicle.local_pose_sensor()),
        ];
        // The client is in control of the sensor, but not of the vector driver.
        let mut rig = Rig::new(services);
        let mut pose = SetLocalPose::default();
        pose.set_x_m(5.0).unwrap();
        rig.send(CLIENT, &pose);
        assert_eq!(observed.take_set_pose(), None);
        control.set(VECTOR, None);
        rig.send(CLIENT, &pose);
        assert!(observed.take_set_pose().is_some(), "nothing is driven");
    }
}
