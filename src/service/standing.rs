//! A component's standing: its state, and the client that may command it.

use std::fmt;

use crate::address::JausId;

/// The state of a component, as Management reports it in Report Status (4002h).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[repr(u8)]
pub enum State {
    /// Starting; cannot be controlled yet.
    Initialize = 0,
    /// Acts on the commands of the client in control.
    #[default]
    Ready = 1,
    /// Can be controlled, but does not act.
    Standby = 2,
    /// Shutting down.
    Shutdown = 3,
    /// Something is broken. Ends when the application reports the repair
    /// ([`Condition::Initialized`](super::Condition::Initialized)).
    Failure = 4,
    /// Stopped by a client's emergency, until every client that set one has cleared it.
    Emergency = 5,
}

impl State {
    /// The state with a code in Report Status.
    #[must_use]
    pub const fn from_code(code: u8) -> Option<Self> {
        Some(match code {
            0 => Self::Initialize,
            1 => Self::Ready,
            2 => Self::Standby,
            3 => Self::Shutdown,
            4 => Self::Failure,
            5 => Self::Emergency,
            _ => return None,
        })
    }

    /// Its name, in lower case.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Initialize => "initialize",
            Self::Ready => "ready",
            Self::Standby => "standby",
            Self::Shutdown => "shutdown",
            Self::Failure => "failure",
            Self::Emergency => "emergency",
        }
    }
}

impl fmt::Display for State {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// The client in control of a component.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Controller {
    /// The client.
    pub id: JausId,
    /// Its authority code, 0 to 255; the higher one wins.
    pub authority: u8,
}

/// The state of a component and its controller, for every service that takes commands.
///
/// A component without Management is always [`State::Ready`]; one without Access Control obeys
/// anyone.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Standing {
    /// The state of the component.
    pub state: State,
    /// Whether commands need control, that is, whether the component offers Access Control.
    pub exclusive: bool,
    /// Clients with a lower authority do not get control.
    pub least_authority: u8,
    /// The client in control, if any.
    pub controller: Option<Controller>,
}

impl Standing {
    /// Whether `client` may configure the component: it is in control, or control is not needed.
    #[must_use]
    pub fn obeys(&self, client: JausId) -> bool {
        match self.controller {
            Some(controller) => controller.id == client,
            None => !self.exclusive,
        }
    }

    /// Whether `client` may make the component act: the component [obeys](Self::obeys) it and is
    /// ready.
    #[must_use]
    pub fn acts_for(&self, client: JausId) -> bool {
        self.state == State::Ready && self.obeys(client)
    }

    /// The path of this standing in the state machine of Management (AS5710).
    pub(super) const fn path(&self) -> &'static [&'static str] {
        let is_controlled = self.controller.is_some() || !self.exclusive;
        match (self.state, is_controlled) {
            (State::Ready, true) => &["Receiving", "Ready", "Controlled", "Available", "Ready"],
            (State::Standby, true) => &["Receiving", "Ready", "Controlled", "Available", "Standby"],
            (State::Ready | State::Standby, false) => &[
                "Receiving",
                "Ready",
                "NotControlled",
                "Available",
                "Standby",
            ],
            (State::Emergency, true) => &[
                "Receiving",
                "Ready",
                "Controlled",
                "NotAvailable",
                "Emergency",
            ],
            (State::Emergency, false) => &[
                "Receiving",
                "Ready",
                "NotControlled",
                "NotAvailable",
                "Emergency",
            ],
            (State::Initialize, _) => &[
                "Receiving",
                "Ready",
                "NotControlled",
                "NotAvailable",
                "Init",
            ],
            (State::Failure, _) => &[
                "Receiving",
                "Ready",
                "NotControlled",
                "NotAvailable",
                "Failure",
            ],
            (State::Shutdown, _) => &[
                "Receiving",
                "Ready",
                "NotControlled",
                "NotAvailable",
                "Shutdown",
            ],
        }
    }

    /// Whether a change from `before` to this standing must stop motion: the component may no
    /// longer act, or another client is in control.
    #[must_use]
    pub fn stops(&self, before: &Self) -> bool {
        let client = |standing: &Self| standing.controller.map(|controller| controller.id);
        !self.may_act() || client(self) != client(before)
    }

    /// Whether the component may act at all: it is ready, and a client is in control unless control
    /// is not needed.
    #[must_use]
    pub const fn may_act(&self) -> bool {
        matches!(self.state, State::Ready) && (self.controller.is_some() || !self.exclusive)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const CLIENT: JausId = JausId::new(42, 1, 1);
    const STRANGER: JausId = JausId::new(42, 2, 1);

    fn controlled(state: State) -> Standing {
        let controller = Controller {
            id: CLIENT,
            authority: 127,
        };
        Standing {
            state,
            exclusive: true,
            controller: Some(controller),
            ..Standing::default()
        }
    }

    #[test]
    fn only_the_client_in_control_is_obeyed() {
        let standing = controlled(State::Standby);
        assert!(standing.obeys(CLIENT) && !standing.obeys(STRANGER));
        let nobody = Standing {
            exclusive: true,
            ..Standing::default()
        };
        assert!(!nobody.obeys(CLIENT) && !nobody.may_act());
    }

    #[test]
    fn a_component_acts_only_when_ready() {
        assert!(controlled(State::Ready).acts_for(CLIENT));
        for state in [State::Initialize, State::Standby, State::Emergency] {
            assert!(!controlled(state).acts_for(CLIENT) && !controlled(state).may_act());
        }
    }

    #[test]
    fn what_moves_stops_for_another_client_and_when_not_ready_but_not_for_another_authority() {
        let before = controlled(State::Ready);
        let now = |id, state| Standing {
            state,
            controller: Some(Controller { id, authority: 1 }),
            ..before
        };
        assert!(!now(CLIENT, State::Ready).stops(&before));
        assert!(now(STRANGER, State::Ready).stops(&before));
        assert!(now(CLIENT, State::Standby).stops(&before));
        let nobody = Standing {
            controller: None,
            ..before
        };
        assert!(nobody.stops(&before));
    }

    #[test]
    fn without_access_control_anyone_is_obeyed() {
        assert!(Standing::default().acts_for(STRANGER));
    }

    #[test]
    fn a_state_has_its_code_in_report_status_and_its_name() {
        for (code, state, name) in [
            (0, State::Initialize, "initialize"),
            (1, State::Ready, "ready"),
            (2, State::Standby, "standby"),
            (3, State::Shutdown, "shutdown"),
            (4, State::Failure, "failure"),
            (5, State::Emergency, "emergency"),
        ] {
            assert_eq!(State::from_code(code), Some(state));
            assert_eq!((state as u8, state.to_string()), (code, name.to_owned()));
        }
        assert_eq!(State::from_code(6), None);
    }
}
