//! The stick of a vehicle that is driven by hand, and its setpoints on their way to the primitive
//! driver.

use std::sync::Arc;
use std::time::Instant;

use tokio::task::AbortHandle;

use super::client::{Client, Finished};
use crate::state::Drive;
use crate::stick::Stick;
use jaus::component::Session;

/// The stick of a vehicle, and its setpoints on their way.
#[derive(Default)]
pub(super) struct ManualDrive {
    pub(super) stick: Stick,
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
    pub(super) fn end(&mut self, now: Instant, why: String) {
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
    pub(super) fn steer(
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
        // A lossy link must lose both copies of each stop to let the vehicle move on for a beat.
        for _copy in 0..if self.is_driven() { 1 } else { 2 } {
            if let Err(error) = driver.send(&effort) {
                tracing::debug!(%error, "setpoint not sent");
            }
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
            return "no command from the page in time: the vehicle was stopped".to_owned();
        }
        self.ended.clone().unwrap_or_default()
    }
}
