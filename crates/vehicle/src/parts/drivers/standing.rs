//! How a driver stands with those who command it: told to people, and remembered after an emergency.

use std::convert::Infallible;

use crate::parts::PartError;
use jaus::component::{AccessControl, Component, Management, Standing, State};

/// Management and Access Control of a driver: control ends after so many seconds unless its client
/// asks for it again; 0 is for ever.
pub(in crate::parts) fn guard(control_timeout: u8) -> Management {
    Management::new().access_control(AccessControl::new().timeout(control_timeout))
}

/// Waits until a client has shut the component down; its program ends then.
pub(in crate::parts) async fn shut_down(component: &Component) -> Result<Infallible, PartError> {
    let mut standings = component.watch_standing();
    let is_down = |standing: &Standing| standing.state == State::Shutdown;
    match standings.wait_for(is_down).await {
        Ok(_) => Err(PartError::ShutDown),
        Err(_) => Err(PartError::NodeStopped),
    }
}

/// Notes every change of a component's standing, and says what keeps it from acting.
#[derive(Debug, Default)]
pub(in crate::parts) struct Watchman {
    last: Standing,
    /// Whether there was an emergency since the component was ready last.
    was_stopped: bool,
}

impl Watchman {
    /// The standing may be another now. Tells people if it is.
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
                None => tracing::info!("nobody is in control"),
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

    /// Why it does not act although it may have been told to: an emergency, until it is resumed.
    pub(in crate::parts) fn emergency(&self) -> Option<&'static str> {
        match self.last.state {
            State::Emergency => Some("stopped by an emergency"),
            _ if self.was_stopped => Some("stopped by an emergency, and not resumed since"),
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
