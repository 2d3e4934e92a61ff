//! Management: the states of a component, and emergencies.

use std::time::Instant;

use super::{Condition, Control};
use crate::address::JausId;
use crate::codec::Message;
use crate::endpoint::Received;
use crate::messages::core::{
    ClearEmergency, QueryStatus, ReportStatus, Reset, Resume, SetEmergency, Shutdown, Standby,
    report_status,
};
use crate::rights::clears_all;
use crate::service::order::{Mark, mark_of};
use crate::service::{Handled, Outbox, State};

/// Limit of remembered clients with an emergency. The next one replaces one that shows no life. If
/// there is none, it is only noted, and the client in control clears it.
pub(super) const MOST_EMERGENCIES: usize = 1024;

impl Condition {
    const fn leads_from(self, state: State) -> State {
        match (self, state) {
            (Self::Initialized, State::Initialize | State::Failure) => State::Standby,
            (Self::Failed, State::Shutdown) => state,
            (Self::Failed, _) => State::Failure,
            (Self::Initialized | Self::Stopped | Self::StopReleased | Self::Safe, _) => state,
        }
    }
}

impl Control {
    pub(super) fn handle_management(
        &mut self,
        now: Instant,
        code: u16,
        message: &Received,
        is_alive: impl Fn(JausId) -> bool,
        out: &mut Outbox,
    ) -> Handled {
        let client = message.source;
        match code {
            QueryStatus::CODE => out.reply(message, &self.report_status()),
            Resume::CODE => self.resume(client),
            Standby::CODE => self.stand_by(client),
            Reset::CODE => self.reset(client, out),
            Shutdown::CODE => self.shut_down(client, out),
            // The emergency code does not matter: stopping is always right.
            SetEmergency::CODE => self.set_emergency((client, mark_of(now, message)), is_alive),
            ClearEmergency::CODE if may_clear_all(message) => self.clear_all(client, out),
            ClearEmergency::CODE => {
                self.clear_emergency((client, mark_of(now, message)), is_alive, out);
            }
            _ => return Handled::No,
        }
        Handled::Yes
    }

    /// Handles the application's report of its condition.
    pub(in crate::service) fn handle_condition(&mut self, condition: Condition, out: &mut Outbox) {
        if self.management.is_none() {
            return;
        }
        match condition {
            Condition::Safe if self.standing.state == State::Emergency => {
                tracing::warn!(id = %out.source(), "emergency cleared by the vehicle");
                self.is_stopped = false;
                self.forget_emergencies();
                self.end_emergency(out);
            }
            Condition::Stopped => {
                self.is_stopped = true;
                self.begin_emergency();
            }
            Condition::StopReleased if std::mem::take(&mut self.is_stopped) => {
                self.end_emergency(out);
            }
            _ => {}
        }
        // During an emergency, other reports take effect afterwards.
        let state = match &mut self.standing.state {
            State::Emergency => &mut self.resting,
            state => state,
        };
        *state = condition.leads_from(*state);
        if *state == State::Failure {
            self.drop_controller(out);
        }
    }

    pub(super) fn first_state(&self) -> State {
        let initializes = self.management.is_some_and(|it| it.initializes);
        if initializes {
            State::Initialize
        } else {
            State::Standby
        }
    }

    fn report_status(&self) -> ReportStatus {
        ReportStatus {
            status: report_status::Status(self.standing.state as u8),
            reserved: 0,
        }
    }

    fn resume(&mut self, client: JausId) {
        if self.is_controller(client) && self.standing.state == State::Standby {
            self.standing.state = State::Ready;
        }
    }

    fn stand_by(&mut self, client: JausId) {
        if self.is_controller(client) && self.standing.state == State::Ready {
            self.standing.state = State::Standby;
        }
    }

    fn reset(&mut self, client: JausId, out: &mut Outbox) {
        if self.is_controller(client) && self.standing.state != State::Emergency {
            self.drop_controller(out);
            self.standing.state = self.first_state();
        }
    }

    fn shut_down(&mut self, client: JausId, out: &mut Outbox) {
        if self.is_controller(client) && self.standing.state != State::Emergency {
            self.drop_controller(out);
            self.standing.state = State::Shutdown;
        }
    }

    fn set_emergency(
        &mut self,
        (client, mark): (JausId, Option<Mark>),
        is_alive: impl Fn(JausId) -> bool,
    ) {
        let known = self.emergencies.get_mut(&client);
        let is_known = known.is_some();
        if let Some(last) = known {
            let is_late = last
                .zip(mark)
                .is_some_and(|(last, mark)| last.is_after(mark));
            *last = if is_late { *last } else { mark };
        } else if self.emergencies.len() >= MOST_EMERGENCIES {
            let dead = self.emergencies.keys().find(|&&it| !is_alive(it)).copied();
            match dead {
                Some(dead) => _ = self.emergencies.remove(&dead),
                None => self.more_emergencies = true,
            }
        }
        if !is_known && self.emergencies.len() < MOST_EMERGENCIES {
            tracing::warn!(%client, "emergency");
            self.emergencies.insert(client, mark);
        }
        self.begin_emergency();
    }

    fn begin_emergency(&mut self) {
        let state = self.standing.state;
        if state != State::Emergency {
            self.resting = match state {
                State::Ready => State::Standby,
                other => other,
            };
            self.standing.state = State::Emergency;
        }
    }

    /// Clears the emergencies of all clients, but not the component's own.
    fn clear_all(&mut self, client: JausId, out: &mut Outbox) {
        if self.standing.state == State::Emergency {
            let setters = self.emergencies.keys();
            tracing::warn!(%client, ?setters, "the emergencies of all clients are cleared");
            self.forget_emergencies();
            self.end_emergency(out);
        }
    }

    fn forget_emergencies(&mut self) {
        self.emergencies.clear();
        self.more_emergencies = false;
    }

    /// Clears the emergency of a client, unless that has set it again since. The client in control also
    /// clears those of dead clients.
    fn clear_emergency(
        &mut self,
        (client, mark): (JausId, Option<Mark>),
        is_alive: impl Fn(JausId) -> bool,
        out: &mut Outbox,
    ) {
        let last = self.emergencies.get(&client).copied().flatten();
        if last
            .zip(mark)
            .is_some_and(|(last, mark)| last.is_after(mark))
        {
            tracing::info!(%client, "a late request to clear its emergency: it has set another one since");
            return;
        }
        let mut cleared = self.emergencies.remove(&client).is_some();
        if self.is_controller(client) {
            self.emergencies.retain(|&setter, _| {
                let stays = is_alive(setter);
                if !stays {
                    tracing::warn!(%client, %setter, "cleared the emergency of a silent client");
                    cleared = true;
                }
                stays
            });
            cleared |= self.emergencies.is_empty() && std::mem::take(&mut self.more_emergencies);
        }
        if cleared {
            self.end_emergency(out);
        }
    }

    /// Leaves the emergency once nobody has one. Control may have been granted only to clear it: it
    /// ends if the next state does not allow control.
    fn end_emergency(&mut self, out: &mut Outbox) {
        let is_over = self.emergencies.is_empty() && !self.more_emergencies && !self.is_stopped;
        if is_over && self.standing.state == State::Emergency {
            tracing::warn!(id = %out.source(), "the last emergency is cleared");
            if !matches!(self.resting, State::Standby | State::Ready) {
                self.drop_controller(out);
            }
            self.standing.state = self.resting;
        }
    }
}

/// Whether a Clear Emergency is for those of all clients, and from one who may clear them: a
/// component of this node, or a session of a link that has checked the sender's right.
fn may_clear_all(message: &Received) -> bool {
    let is_checked = match message.path {
        None => true,
        Some(path) => path.peer.is_session(),
    };
    is_checked && clears_all(&message.payload)
}
