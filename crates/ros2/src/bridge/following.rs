//! The subscriptions to the vehicle's reports: started when a component offers them, ended when it
//! does not any more.

use std::collections::{BTreeMap, BTreeSet};
use std::time::Duration;

use bytes::Bytes;
use jaus::address::JausId;
use jaus::codec::Query;
use jaus::component::{Component, SubscribeError, Undecoded, Update, When};
use jaus::messages::core::{QueryControl, QueryStatus};
use jaus::messages::mobility::{QueryGlobalPose, QueryLocalPose, QueryVelocityState};
use jaus::node::{now, sleep_until};
use jaus::service::Topic;
use jaus_vehicle::messages::ground::QueryMission;
use tokio::sync::mpsc;
use tokio::task::{AbortHandle, JoinSet};

use super::definition::Definition;
use super::report::Report;
use super::vehicle::{Role, Vehicle};

/// A report with its sender.
pub(super) type Received = (JausId, Report);

/// A report that is subscribed to besides those that the bridge converts itself.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Extra {
    pub(super) peer: JausId,
    pub(super) query: Bytes,
    pub(super) report: u16,
    pub(super) definition: Definition,
}

#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
enum Wanted {
    Status(JausId),
    Control(JausId),
    Mission(JausId),
    LocalPose(JausId),
    GlobalPose(JausId),
    Velocity(JausId),
    Extra(Extra),
}

/// The subscriptions.
pub(super) struct Following {
    component: Component,
    received: mpsc::Sender<Received>,
    /// The rate of poses, velocities and further reports.
    rate: When,
    running: BTreeMap<Wanted, Running>,
    tasks: JoinSet<()>,
}

/// A subscription, which ends when this is dropped.
struct Running(AbortHandle);

impl Drop for Running {
    fn drop(&mut self) {
        self.0.abort();
    }
}

/// What is wanted, does not run yet, and has room, and how much has none.
fn admit<W: Ord, R>(running: &BTreeMap<W, R>, wanted: BTreeSet<W>, most: usize) -> (Vec<W>, u64) {
    let new = wanted.into_iter().filter(|it| !running.contains_key(it));
    let mut admitted: Vec<_> = new.collect();
    let room = most.saturating_sub(running.len()).min(admitted.len());
    let refused = admitted.split_off(room).len();
    (admitted, refused as u64)
}

/// The rate of states and of the client in control.
const STATUS: When = When::hz(4.0);
/// Delay before a failed subscription is retried.
const PAUSE: Duration = Duration::from_secs(1);

impl Following {
    /// The most subscriptions; further ones are not started.
    const MOST: usize = 1024;

    pub(super) fn new(
        component: Component,
        received: mpsc::Sender<Received>,
        rate_hz: f64,
    ) -> Self {
        Self {
            component,
            received,
            rate: When::hz(rate_hz),
            running: BTreeMap::new(),
            tasks: JoinSet::new(),
        }
    }

    /// Starts and ends subscriptions to match the vehicle. Returns how many were not started because
    /// there are too many.
    pub(super) fn follow(
        &mut self,
        vehicle: &Vehicle,
        extras: impl IntoIterator<Item = Extra>,
    ) -> u64 {
        while self.tasks.try_join_next().is_some() {}
        let mut wanted: BTreeSet<_> = extras.into_iter().map(Wanted::Extra).collect();
        for part in vehicle.all(Role::Management) {
            wanted.extend([Wanted::Status(part), Wanted::Control(part)]);
        }
        wanted.extend(vehicle.find(Role::Planner).map(Wanted::Mission));
        wanted.extend(vehicle.find(Role::LocalPose).map(Wanted::LocalPose));
        wanted.extend(vehicle.find(Role::GlobalPose).map(Wanted::GlobalPose));
        wanted.extend(vehicle.find(Role::VelocityState).map(Wanted::Velocity));
        self.running.retain(|running, _| wanted.contains(running));
        let (admitted, refused) = admit(&self.running, wanted, Self::MOST);
        for new in admitted {
            let running = self.start(&new);
            self.running.insert(new, running);
        }
        refused
    }

    fn start(&mut self, wanted: &Wanted) -> Running {
        let rate = self.rate;
        Running(match wanted {
            Wanted::Status(peer) => self.subscribe(*peer, QueryStatus {}, STATUS),
            Wanted::Control(peer) => self.subscribe(*peer, QueryControl {}, STATUS),
            Wanted::Mission(peer) => self.subscribe(*peer, QueryMission {}, STATUS),
            Wanted::LocalPose(peer) => self.subscribe(*peer, QueryLocalPose::all(), rate),
            Wanted::GlobalPose(peer) => self.subscribe(*peer, QueryGlobalPose::all(), rate),
            Wanted::Velocity(peer) => self.subscribe(*peer, QueryVelocityState::all(), rate),
            Wanted::Extra(extra) => self.subscribe_undecoded(extra.clone()),
        })
    }

    /// Keeps one subscription until the task is aborted.
    fn subscribe<Q: Query>(&mut self, peer: JausId, query: Q, when: When) -> AbortHandle
    where
        Q::Report: Into<Report>,
    {
        let (component, received) = (self.component.clone(), self.received.clone());
        self.tasks.spawn(async move {
            loop {
                match component.subscribe(peer, &query, when).await {
                    Ok(mut reports) => {
                        // One sample is enough: a newer one is better.
                        while let Some(update) = reports.next().await {
                            let Update::Report(report) = update else {
                                continue;
                            };
                            if received.send((peer, report.into())).await.is_err() {
                                return;
                            }
                        }
                    }
                    Err(SubscribeError::Stopped) => return,
                    Err(error) => tracing::debug!(%peer, %error, "not subscribed"),
                }
                sleep_until(Some(now() + PAUSE)).await;
            }
        })
    }

    fn subscribe_undecoded(&mut self, extra: Extra) -> AbortHandle {
        let (component, received) = (self.component.clone(), self.received.clone());
        let topic = Topic {
            peer: extra.peer,
            query: extra.query,
            report: extra.report,
            when: self.rate,
        };
        let definition = extra.definition;
        self.tasks.spawn(async move {
            loop {
                match component.subscribe_undecoded(topic.clone()).await {
                    Ok(mut reports) => {
                        while let Some(update) = reports.next().await {
                            let Update::Report(Undecoded(octets)) = update else {
                                continue;
                            };
                            let definition = definition.clone();
                            let report = Report::Undecoded { definition, octets };
                            if received.send((topic.peer, report)).await.is_err() {
                                return;
                            }
                        }
                    }
                    Err(SubscribeError::Stopped) => return,
                    Err(error) => tracing::debug!(peer = %topic.peer, %error, "not subscribed"),
                }
                sleep_until(Some(now() + PAUSE)).await;
            }
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn subscriptions_that_have_no_room_are_counted() {
        let running = BTreeMap::from([(1, ()), (5, ())]);
        let wanted = || BTreeSet::from([1, 2, 3, 4, 5]);
        assert_eq!(admit(&running, wanted(), 4), (vec![2, 3], 1));
        assert_eq!(admit(&running, wanted(), 9), (vec![2, 3, 4], 0));
        assert_eq!(admit(&running, wanted(), 1), (vec![], 3));
    }
}
