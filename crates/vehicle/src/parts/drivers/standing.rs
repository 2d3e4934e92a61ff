//! A driver's standing: control and state changes, and the memory of an emergency.

use std::convert::Infallible;

use crate::parts::PartError;
use jaus::component::{AccessControl, Component, Management, Standing, State};

/// Management and Access Control of a driver. Control times out after this many seconds unless its
/// client renews it; 0 disables the timeout.
pub(in crate::parts) fn guard(control_timeout: u8) -> Management {
    Management::new().access_control(AccessControl::new().timeout(control_timeout))
}

/// The authority with which a stage controls the next one: its own, and not more than its client has.
pub(in crate::parts) fn lent_authority(standing: &Standing, own: u8) -> u8 {
    let client = standing.controller.map_or(own, |it| it.authority);
    client.min(own)
}

/// Waits until a client has shut the component down. Its program then ends.
pub(in crate::parts) async fn shut_down(component: &Component) -> Result<Infallible, PartError> {
    let mut standings = component.watch_standing();
    let is_down = |standing: &Standing| standing.state == State::Shutdown;
    match standings.wait_for(is_down).await {
        Ok(_) => Err(PartError::ShutDown),
        Err(_) => Err(PartError::NodeStopped),
    }
}

/// Logs every change of a component's standing, and remembers emergencies.
#[derive(Debug, Default)]
pub(in crate::parts) struct Watchman {
    last: Standing,
    /// Whether an emergency occurred since the component was last ready.
    was_stopped: bool,
}

impl Watchman {
    /// Updates the standing and logs changes.
    pub(in crate::parts) fn note(&mut self, now: Standing) {
        let before = std::mem::replace(&mut self.last, now);
        if before.controller != now.controller {
            match now.controller {
                Some(client) => {
                    tracing::info!(
                        "{} is in control, authority {}",
                        client.id,
                        client.authority
                    );
                }
                None => tracing::info!("no client is in control"),
            }
        }
        if before.state != now.state {
            tracing::info!("the state is {}", now.state);
        }
        match now.state {
            State::Emergency => self.was_stopped = true,
            State::Ready => self.was_stopped = false,
            _ => {}
        }
    }

    /// Why the component does not act on commands: an emergency, until it is resumed.
    pub(in crate::parts) fn emergency(&self) -> Option<&'static str> {
        match self.last.state {
            State::Emergency => Some("stopped by an emergency"),
            _ if self.was_stopped => Some("stopped by an emergency and not resumed"),
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn standing(state: State) -> Standing {
        Standing {
            state,
            ..Standing::default()
        }
    }

    #[test]
    fn an_emergency_is_remembered_until_the_component_is_resumed() {
        let mut watchman = Watchman::default();
        watchman.note(standing(State::Ready));
        assert_eq!(watchman.emergency(), None);
        watchman.note(standing(State::Emergency));
        assert_eq!(watchman.emergency(), Some("stopped by an emergency"));
        watchman.note(standing(State::Standby));
        assert!(
            watchman
                .emergency()
                .is_some_and(|it| it.contains("not resumed"))
        );
        watchman.note(standing(State::Ready));
        assert_eq!(watchman.emergency(), None);
    }
}
