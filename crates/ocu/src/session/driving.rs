//! Manual drive of one vehicle: setpoints of the operator's page go to the primitive driver, until
//! the stick is released, the page falls silent, or something else ends it.

use std::time::{Duration, Instant};

use super::client::Client;
use super::control::NO_CONTROL;
use super::vehicle::Vehicle;
use crate::orders::DriveOrder;
use crate::ownership::Owner;
use crate::page_link::{PageLink, TooOld};
use crate::role::Role;
use crate::stick::Push;
use jaus::service::State;

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
        self.manual.stick.handle_push(now, waited, order.hand, push);
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
