//! Access Control: grants, renews and ends control.

use std::time::Instant;

use super::{AccessControl, Control, timeout_field, with};
use crate::address::JausId;
use crate::codec::Message;
use crate::endpoint::Received;
use crate::messages::core::confirm_control::ResponseCode as Confirmation;
use crate::messages::core::reject_control::ResponseCode as Rejection;
use crate::messages::core::{
    ConfirmControl, QueryAuthority, QueryControl, QueryTimeout, RejectControl, ReleaseControl,
    ReportAuthority, ReportControl, ReportTimeout, RequestControl, SetAuthority,
};
use crate::service::order::number_of;
use crate::service::{Controller, Handled, Outbox, State};

impl Control {
    pub(super) fn handle_access(
        &mut self,
        now: Instant,
        access: AccessControl,
        code: u16,
        message: &Received,
        is_alive: impl Fn(JausId) -> bool,
        out: &mut Outbox,
    ) -> Handled {
        match code {
            RequestControl::CODE => with(message, |request: RequestControl| {
                if self.is_available(is_alive) {
                    self.request(now, access, request.authority_code, message, out);
                } else {
                    confirm(message, Confirmation::NOT_AVAILABLE, out);
                }
            }),
            ReleaseControl::CODE => {
                self.release(message, out);
                Handled::Yes
            }
            SetAuthority::CODE => with(message, |set: SetAuthority| {
                self.set_authority(access, set.authority_code, message);
            }),
            QueryControl::CODE => {
                out.reply(message, &self.report_control());
                Handled::Yes
            }
            QueryAuthority::CODE => {
                let controller = self.standing.controller;
                let report = ReportAuthority {
                    authority_code: controller.map_or(access.authority, |it| it.authority),
                };
                out.reply(message, &report);
                Handled::Yes
            }
            QueryTimeout::CODE => {
                let report = ReportTimeout {
                    timeout: timeout_field(access.timeout),
                };
                out.reply(message, &report);
                Handled::Yes
            }
            _ => Handled::No,
        }
    }

    fn request(
        &mut self,
        now: Instant,
        access: AccessControl,
        authority: u8,
        message: &Received,
        out: &mut Outbox,
    ) {
        let client = message.source;
        match self.standing.controller {
            // It has lowered its authority too far to keep control.
            Some(controller) if controller.id == client && authority < access.authority => {
                return self.drop_controller(out);
            }
            Some(controller) if controller.id == client => {}
            Some(controller) if authority <= controller.authority => {
                return confirm(message, Confirmation::INSUFFICIENT_AUTHORITY, out);
            }
            // A client with a higher authority takes over. Its authority is at least the default
            // one, as the controller's is.
            Some(controller) => reject(controller, Rejection::CONTROL_RELEASED, out),
            None if authority < access.authority => {
                return confirm(message, Confirmation::INSUFFICIENT_AUTHORITY, out);
            }
            None => {}
        }
        tracing::debug!(id = %out.source(), %client, authority, "control granted");
        self.standing.controller = Some(Controller {
            id: client,
            authority,
        });
        self.requested = number_of(message);
        self.renew(now);
        confirm(message, Confirmation::CONTROL_ACCEPTED, out);
    }

    /// Gives control to another client, in standby.
    pub(in crate::service) fn hand_over(&mut self, now: Instant, to: Controller, out: &mut Outbox) {
        let is_possible = matches!(self.standing.state, State::Ready | State::Standby)
            && self.access.is_some()
            && to.authority >= self.standing.least_authority;
        if !is_possible || self.is_controller(to.id) {
            return;
        }
        self.drop_controller(out);
        tracing::info!(id = %out.source(), client = %to.id, "control handed over");
        self.standing.controller = Some(to);
        self.renew(now);
    }

    fn release(&mut self, message: &Received, out: &mut Outbox) {
        let client = message.source;
        let answer = |code| RejectControl {
            response_code: code,
        };
        if self.standing.state == State::Emergency {
            out.reply(message, &answer(Rejection::NOT_AVAILABLE));
        } else if self.is_controller(client) {
            self.drop_controller(out);
        } else if self.standing.controller.is_none() {
            // Answer again a client that repeats its release because the answer was lost.
            out.reply(message, &answer(Rejection::CONTROL_RELEASED));
        }
    }

    /// Accepts any authority from the default one up to the current one.
    fn set_authority(&mut self, access: AccessControl, authority: u8, message: &Received) {
        let emergency = self.standing.state == State::Emergency;
        if let Some(controller) = &mut self.standing.controller
            && controller.id == message.source
            && !emergency
            && (access.authority..=controller.authority).contains(&authority)
        {
            controller.authority = authority;
        }
    }

    fn report_control(&self) -> ReportControl {
        self.standing
            .controller
            .map_or_else(ReportControl::default, |controller| ReportControl {
                subsystem_id: controller.id.subsystem(),
                node_id: controller.id.node(),
                component_id: controller.id.component(),
                authority_code: controller.authority,
            })
    }

    /// Whether control can be requested at all. In an emergency only if no client that is known to
    /// have set one is alive, so that a new client in control can clear those of dead clients, and
    /// those that the table did not hold.
    fn is_available(&self, is_alive: impl Fn(JausId) -> bool) -> bool {
        match self.standing.state {
            State::Ready | State::Standby => true,
            State::Emergency => {
                let has_setter = !self.emergencies.is_empty() || self.more_emergencies;
                has_setter && !self.emergencies.keys().any(|&it| is_alive(it))
            }
            State::Initialize | State::Shutdown | State::Failure => false,
        }
    }

    /// Ends control and notifies the client. A ready component falls back to standby.
    pub(in crate::service) fn drop_controller(&mut self, out: &mut Outbox) {
        if let Some(controller) = self.end_control() {
            reject(controller, Rejection::CONTROL_RELEASED, out);
        }
    }

    /// Ends control without a word. A ready component falls back to standby.
    pub(super) fn end_control(&mut self) -> Option<Controller> {
        (self.deadline, self.requested) = (None, None);
        self.fall_back();
        self.standing.controller.take()
    }

    /// A ready component falls back to standby.
    pub(super) fn fall_back(&mut self) {
        if self.management.is_some() && self.standing.state == State::Ready {
            self.standing.state = State::Standby;
        }
    }
}

fn confirm(request: &Received, code: Confirmation, out: &mut Outbox) {
    let confirm = ConfirmControl {
        response_code: code,
    };
    out.reply(request, &confirm);
}

fn reject(controller: Controller, code: Rejection, out: &mut Outbox) {
    let reject = RejectControl {
        response_code: code,
    };
    out.send(controller.id, &reject);
}
