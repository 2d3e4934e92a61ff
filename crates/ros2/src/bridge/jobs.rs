//! What the bridge sends to the vehicle: each message is a task that reports its completion.

use std::sync::Arc;
use std::time::{Duration, Instant};

use jaus::address::JausId;
use jaus::codec::{Message, OutOfRange};
use jaus::component::{Component, Priority, Session, SessionError};
use jaus::messages::core::clear_emergency::EmergencyCode as ClearedCode;
use jaus::messages::core::set_emergency::EmergencyCode;
use jaus::messages::core::{ClearEmergency, QueryStatus, ReportStatus, SetEmergency};
use jaus::messages::mobility::{SetLocalWaypoint, SetTravelSpeed};
use jaus::node::{now, sleep_until};
use jaus_vehicle::messages::ground::set_destination::Approved;
use jaus_vehicle::messages::ground::{SetDestination, StopMission};
use tokio::sync::oneshot;
use tokio::task::{AbortHandle, JoinSet};

use super::goal::{Goal, Navigation, Order};
use super::lease;
use super::vehicle::Role;
use super::velocity::{Limits, Velocity};

/// Completion of a task.
pub(super) enum Finished {
    /// A session with the component that drives, or with the one that takes goals, has begun.
    Begun {
        is_drive: bool,
        peer: JausId,
        result: Result<Session, SessionError>,
    },
    /// The driver received a stop, or did not acknowledge it.
    Halted { is_acknowledged: bool },
    /// The component that takes goals received an order, or not, for this reason.
    Ordered {
        order: Order,
        result: Result<(), String>,
    },
    /// A component received an emergency or its end, with its state afterwards.
    Alarmed {
        peer: JausId,
        /// The request that it belongs to.
        request: u64,
        status: Option<ReportStatus>,
    },
}

/// The tasks.
pub(super) struct Jobs {
    component: Component,
    tasks: JoinSet<Finished>,
    steering: Option<Steering>,
    /// Ends the delivery of the last order when it is dropped.
    order: Option<oneshot::Sender<()>>,
    /// The number of the last request to set or clear an emergency, and its deliveries.
    request: u64,
    alarms: Vec<AbortHandle>,
}

/// The last velocity sent.
struct Steering {
    velocity: Velocity,
    sent: Instant,
    /// The delivery of a stop.
    stop: Option<AbortHandle>,
}

/// A stop without acknowledgement for this time is sent anew.
const STEERING_PATIENCE: Duration = Duration::from_millis(100);
/// The same velocity is sent again after this time: at each beat.
const REPETITION: Duration = Duration::from_millis(40);
/// Another velocity follows after this time at the earliest.
const SHORTEST: Duration = Duration::from_millis(10);
/// Timeout of an emergency before it is repeated, and of the query for the state.
const ALARM_PATIENCE: Duration = Duration::from_millis(700);
/// The code of the emergencies that ROS sets and clears.
pub(super) const EMERGENCY: u16 = 1;
/// Timeout of an order about a goal.
const ORDER_PATIENCE: Duration = Duration::from_secs(3);

impl Jobs {
    pub(super) fn new(component: Component) -> Self {
        Self {
            component,
            tasks: JoinSet::new(),
            steering: None,
            order: None,
            request: 0,
            alarms: Vec::new(),
        }
    }

    /// The next completed task. Pending forever without tasks.
    pub(super) async fn finished(&mut self) -> Finished {
        loop {
            match self.tasks.join_next().await {
                // The end of a delivery of an earlier request says nothing about the last one.
                Some(Ok(Finished::Alarmed { request, .. })) if request != self.request => {}
                Some(Ok(finished)) => return finished,
                // A stop or an emergency replaced by a newer one.
                Some(Err(_)) => {}
                None => std::future::pending().await,
            }
        }
    }

    /// Begins a session that takes control of a component, and makes it ready if it may.
    pub(super) fn begin(&mut self, is_drive: bool, peer: JausId, authority: u8, may_resume: bool) {
        let component = self.component.clone();
        self.tasks.spawn(async move {
            let result = lease::begin(&component, peer, authority, may_resume).await;
            Finished::Begun {
                is_drive,
                peer,
                result,
            }
        });
    }

    /// Sends a velocity to the driver, unless it is too early for it. One that moves is not
    /// acknowledged, because a retransmission would come after newer ones. A stop is.
    pub(super) fn steer(
        &mut self,
        now: Instant,
        session: &Arc<Session>,
        role: Role,
        velocity: Velocity,
        limits: Limits,
    ) {
        if let Some(last) = &self.steering {
            let since = now.saturating_duration_since(last.sent);
            let is_underway = last.stop.as_ref().is_some_and(|stop| !stop.is_finished());
            if !may_follow(last.velocity, since, is_underway, velocity) {
                return;
            }
            if let Some(stop) = &last.stop {
                stop.abort();
            }
        }
        let stop = if velocity == Velocity::ZERO {
            let session = Arc::clone(session);
            let halt = async move {
                let is_acknowledged = match role {
                    Role::VelocityDriver => deliver(&session, velocity.command()).await,
                    _ => deliver(&session, velocity.effort(limits)).await,
                }
                .is_ok();
                Finished::Halted { is_acknowledged }
            };
            Some(self.tasks.spawn(halt))
        } else {
            let sent = match role {
                Role::VelocityDriver => send(session, velocity.command()),
                _ => send(session, velocity.effort(limits)),
            };
            if let Err(error) = sent {
                tracing::debug!(%error, "velocity not sent");
            }
            None
        };
        self.steering = Some(Steering {
            velocity,
            sent: now,
            stop,
        });
    }

    /// Sends an order about a goal to a planner or a waypoint driver.
    pub(super) fn order(&mut self, session: &Arc<Session>, role: Role, order: Order, speed: f64) {
        let session = Arc::clone(session);
        let (ends, end) = oneshot::channel();
        self.order = Some(ends);
        self.tasks.spawn(async move {
            let delivery = within(ORDER_PATIENCE, follow(&session, role, order, speed));
            let result = tokio::select! {
                delivered = delivery => delivered.unwrap_or_else(|| {
                    let waited = ORDER_PATIENCE.as_secs();
                    Err(format!("the vehicle has not answered for {waited} s"))
                }),
                _ = end => Err("it was replaced by another order".to_owned()),
            };
            Finished::Ordered { order, result }
        });
    }

    /// Ends the delivery of the last order, which reports its completion nevertheless.
    pub(super) fn end_order(&mut self) {
        self.order = None;
    }

    /// Ends the deliveries of an emergency or its end, before the next request.
    pub(super) fn end_alarms(&mut self) {
        self.request += 1;
        for alarm in self.alarms.drain(..) {
            alarm.abort();
        }
    }

    /// Sends an emergency or its end to a component, then queries its state.
    pub(super) fn alarm(&mut self, peer: JausId, on: bool) {
        let (component, request) = (self.component.clone(), self.request);
        let alarm = self.tasks.spawn(async move {
            // Some peers never acknowledge. Their state decides.
            let _ = within(ALARM_PATIENCE, deliver_emergency(&component, peer, on)).await;
            let status = component.query(peer, &QueryStatus {});
            let status = within(ALARM_PATIENCE, status).await.and_then(Result::ok);
            Finished::Alarmed {
                peer,
                request,
                status,
            }
        });
        self.alarms.retain(|alarm| !alarm.is_finished());
        self.alarms.push(alarm);
    }
}

/// Whether a velocity may follow the last one after this time, so that a fast publisher does not
/// flood the vehicle. A stop never waits.
fn may_follow(last: Velocity, since: Duration, is_underway: bool, next: Velocity) -> bool {
    let stops = next == Velocity::ZERO && last != Velocity::ZERO;
    let pause = match (is_underway, next == last) {
        (true, _) => STEERING_PATIENCE,
        (false, true) => REPETITION,
        (false, false) => SHORTEST,
    };
    stops || since >= pause
}

/// The result of a future, unless it takes longer.
async fn within<T>(limit: Duration, future: impl Future<Output = T>) -> Option<T> {
    tokio::select! {
        result = future => Some(result),
        () = sleep_until(Some(now() + limit)) => None,
    }
}

async fn deliver_emergency(component: &Component, peer: JausId, on: bool) {
    let priority = Priority::SafetyCritical;
    let delivered = if on {
        let emergency_code = EmergencyCode(EMERGENCY);
        let set = SetEmergency { emergency_code };
        component.deliver_with(priority, peer, &set).await
    } else {
        let emergency_code = ClearedCode(EMERGENCY);
        let clear = ClearEmergency { emergency_code };
        component.deliver_with(priority, peer, &clear).await
    };
    if let Err(error) = delivered {
        tracing::debug!(%peer, %error, "not acknowledged");
    }
}

async fn deliver<M: Message>(
    session: &Session,
    command: Result<M, OutOfRange>,
) -> Result<(), String> {
    let command = command.map_err(|error| error.to_string())?;
    let delivered = session.deliver(&command).await;
    delivered.map_err(|error| error.to_string())
}

fn send<M: Message>(session: &Session, command: Result<M, OutOfRange>) -> Result<(), String> {
    let command = command.map_err(|error| error.to_string())?;
    session.send(&command).map_err(|error| error.to_string())
}

async fn follow(session: &Session, role: Role, order: Order, speed: f64) -> Result<(), String> {
    match (role, order) {
        (Role::Planner, Order::Go(goal)) => deliver(session, Ok(destination(goal, speed))).await,
        (Role::Planner, Order::Stop) => deliver(session, Ok(StopMission {})).await,
        (_, Order::Go(goal)) => {
            deliver(session, travel_speed(speed)).await?;
            deliver(session, waypoint(goal)).await
        }
        (_, Order::Stop) => deliver(session, travel_speed(0.0)).await,
    }
}

fn destination(goal: Goal, speed: f64) -> SetDestination {
    SetDestination {
        x: goal.x,
        y: goal.y,
        approved: Approved::YES,
        speed: Some(speed as f32),
    }
}

fn travel_speed(speed: f64) -> Result<SetTravelSpeed, OutOfRange> {
    let mut command = SetTravelSpeed::default();
    command.set_speed_m_per_s(speed)?;
    Ok(command)
}

fn waypoint(goal: Goal) -> Result<SetLocalWaypoint, OutOfRange> {
    let mut waypoint = SetLocalWaypoint::default();
    waypoint.set_x_m(goal.x)?;
    waypoint.set_y_m(goal.y)?;
    waypoint.set_yaw_rad(goal.heading)?;
    waypoint.set_waypoint_tolerance_m(Navigation::TOLERANCE)?;
    Ok(waypoint)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_fast_publisher_does_not_flood_the_vehicle_and_a_stop_does_not_wait() {
        let at = |forward| Velocity {
            forward,
            ..Velocity::ZERO
        };
        let ms = Duration::from_millis;
        for (last, since, is_underway, next, expected) in [
            (at(1.0), ms(39), false, at(1.0), false),
            (at(1.0), ms(40), false, at(1.0), true),
            (at(1.0), ms(9), false, at(1.1), false),
            (at(1.0), ms(10), false, at(1.1), true),
            (Velocity::ZERO, ms(99), true, at(1.1), false),
            (Velocity::ZERO, ms(100), true, at(1.1), true),
            (at(1.0), ms(0), false, Velocity::ZERO, true),
            (Velocity::ZERO, ms(39), false, Velocity::ZERO, false),
        ] {
            let may = may_follow(last, since, is_underway, next);
            assert_eq!(may, expected, "{last:?} {since:?} {is_underway} {next:?}");
        }
    }
}
