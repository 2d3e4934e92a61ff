//! Manual drive of one vehicle: setpoints of the operator's page go to the primitive driver, until
//! the stick is released, the page falls silent, or something else ends it.

use std::sync::Arc;
use std::time::{Duration, Instant};

use tokio::task::AbortHandle;

use super::client::{Client, Finished};
use super::control::NO_CONTROL;
use super::vehicle::Vehicle;
use crate::orders::DriveOrder;
use crate::ownership::Owner;
use crate::page_link::{PageLink, TooOld};
use crate::role::Role;
use crate::state::Drive;
use crate::stick::{Push, Stick};
use jaus::component::Session;
use jaus::service::State;

/// The stick of a vehicle, and its setpoints on their way.
#[derive(Default)]
pub(super) struct ManualDrive {
    stick: Stick,
    /// The delivery of the stop.
    stop: Option<AbortHandle>,
    /// Why the station ended manual drive, until a page drives again.
    ended: Option<String>,
}

impl ManualDrive {
    pub(super) const fn is_driven(&self) -> bool {
        self.stick.driven().is_some()
    }

    /// The stick is released.
    pub(super) fn stop(&mut self, now: Instant) {
        self.stick.stop(now);
    }

    /// The station releases the stick.
    fn end(&mut self, now: Instant, why: String) {
        if self.is_driven() {
            tracing::warn!("manual drive ended: {why}");
        }
        self.stick.stop(now);
        self.ended = Some(why);
    }

    /// Nobody is interested in why driving ended any more.
    pub(super) fn forget(&mut self) {
        self.ended = None;
        self.stick.forget_silence();
    }

    pub(super) fn handle_stopped(&mut self) {
        self.stick.handle_stopped();
    }

    /// Sends the stick's setpoint to the primitive driver, until it has acknowledged the release.
    ///
    /// Setpoints are sent once: what a retransmission would bring is older than the next one. The
    /// stop is delivered, and repeated meanwhile.
    fn steer(
        &mut self,
        now: Instant,
        vehicle: u16,
        driver: Option<Arc<Session>>,
        client: &mut Client,
    ) {
        let Some(push) = self.stick.poll_push(now) else {
            return;
        };
        let Some(driver) = driver.filter(|it| it.check().is_ok()) else {
            // Without control and in standby, earlier commands no longer affect the vehicle.
            return self.stick.handle_stopped();
        };
        let Ok(effort) = push.effort() else {
            // Cannot happen: a push is within the range of the message.
            return;
        };
        if let Err(error) = driver.send(&effort) {
            tracing::debug!(%error, "setpoint not sent");
        }
        if self.is_driven() {
            // A stop that is still being delivered would brake again.
            if let Some(stop) = self.stop.take() {
                stop.abort();
            }
        } else if self.stop.as_ref().is_none_or(AbortHandle::is_finished) {
            self.stop = Some(client.start(async move {
                let acknowledged = driver.deliver(&effort).await.is_ok();
                Finished::Stopped {
                    vehicle,
                    acknowledged,
                }
            }));
        }
    }

    pub(super) fn state(&self) -> Drive {
        let push = self.stick.driven().unwrap_or_default();
        Drive {
            active: self.is_driven(),
            forward: push.forward(),
            turn: push.turn(),
            reason: self.reason(),
        }
    }

    /// Why driving ended without a release of the stick; empty otherwise.
    fn reason(&self) -> String {
        if self.stick.fell_silent() {
            let limit = Stick::DEAD_MAN.as_millis();
            return format!("no command from the page for {limit} ms: the vehicle was stopped");
        }
        self.ended.clone().unwrap_or_default()
    }
}

/// How long a setpoint has waited on its way from the page until now.
fn waited(now: Instant, order: &DriveOrder) -> Result<Duration, TooOld> {
    let waited = order.waited? + now.saturating_duration_since(order.at);
    if waited > PageLink::SLACK {
        return Err(TooOld::Late(waited));
    }
    Ok(waited)
}

impl Vehicle {
    /// Drives by a setpoint of an operator.
    pub(super) fn drive(
        &mut self,
        now: Instant,
        operator: &Owner,
        order: &DriveOrder,
        client: &mut Client,
    ) -> Result<(), String> {
        let push = Push::new(order.forward, order.turn)
            .ok_or("forward and turn range from -1 to 1; the command is ignored")?;
        self.ownership
            .check(self.number(), operator.page)
            .map_err(|other| other.to_string())?;
        if let Some(why) = self.refuses_to_be_driven() {
            return Err(why);
        }
        let too_old = waited(now, order).map_err(|why| why.to_string());
        let waited = match (too_old, self.picture.stale(now)) {
            (Ok(waited), None) => waited,
            (Err(why), _) | (Ok(_), Some(why)) => {
                self.manual.end(now, why.clone());
                self.steer(now, client);
                return Err(why);
            }
        };
        self.claim(operator)?;
        // The planner's mission is over, so the operator goes on with all parts.
        self.control_drivers(client);
        if let Some(why) = self.driving_obstacle() {
            self.stop_driving(now, client);
            return Err(why);
        }
        self.manual.forget();
        self.manual.stick.handle_push(now, waited, push);
        self.steer(now, client);
        Ok(())
    }

    /// Why it cannot be driven by hand, whatever its parts report.
    fn refuses_to_be_driven(&self) -> Option<String> {
        if self.is_leaving {
            return Some(format!("vehicle {} is being stopped first", self.number()));
        }
        if !self.is_wanted() {
            return Some(NO_CONTROL.to_owned());
        }
        let Some(driver) = self.picture.find(Role::PrimitiveDriver) else {
            return Some("the vehicle has no primitive driver".to_owned());
        };
        if self.alarm.is_wanted() || self.is(driver, State::Emergency) {
            return Some("the vehicle is in emergency; clear it first".to_owned());
        }
        if self.is_driven_by_planner() {
            return Some("a mission drives: take over first".to_owned());
        }
        let is_ready = self.lease.is_ready();
        (!is_ready).then(|| "the vehicle is in standby; resume first".to_owned())
    }

    /// Why the primitive driver is not under control or not ready.
    fn driving_obstacle(&self) -> Option<String> {
        let driver = self.picture.find(Role::PrimitiveDriver)?;
        self.lease.obstacle(driver)
    }

    /// Ends manual drive.
    pub(super) fn stop_driving(&mut self, now: Instant, client: &mut Client) {
        self.manual.stop(now);
        self.steer(now, client);
    }

    /// Ends manual drive when the picture is stale or an emergency begins, and sends the setpoint.
    pub(super) fn handle_driving(&mut self, now: Instant, client: &mut Client) {
        if self.is_stopped() {
            self.manual.stop(now);
        }
        if self.manual.is_driven()
            && let Some(why) = self.picture.stale(now)
        {
            self.manual.end(now, why);
        }
        self.steer(now, client);
    }

    fn steer(&mut self, now: Instant, client: &mut Client) {
        let (number, driver) = (self.number(), self.driver());
        self.manual.steer(now, number, driver, client);
    }
}
