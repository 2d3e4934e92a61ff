//! Handing over control of a vehicle between operators: our request to the operator in control, and
//! other operators' requests to us. The vehicle carries both, with the messages of Enhanced Access
//! Control.

use std::time::{Duration, Instant};

use jaus::address::JausId;
use jaus::component::{Component, Handlers};
use jaus_vehicle::messages::handoff::confirm_handoff_request::ResponseCode as Answer;
use jaus_vehicle::messages::handoff::confirm_release_control::{
    ReleaseControlRec, ResponseCode as Decision,
};
use jaus_vehicle::messages::handoff::{
    ConfirmHandoffRequest, ConfirmReleaseControl, RemoveHandoffRequest, RequestHandoff,
    RequestReleaseControl, handoff_controller,
};
use tokio::sync::mpsc;

use crate::state;

/// A message about a handover, with the part of the vehicle that has sent it.
pub(super) type Notice = (JausId, Content);

/// Content of a message about a handover.
pub(super) enum Content {
    /// What has become of our request.
    Answer(ConfirmHandoffRequest),
    /// The requests of other operators.
    Requests(RequestReleaseControl),
}

/// The service that receives the messages about handovers. Messages beyond the capacity of the
/// channel are dropped; the vehicle repeats them.
pub(super) fn service(notices: mpsc::Sender<Notice>) -> Handlers {
    let others = notices.clone();
    Handlers::new(handoff_controller::LATEST)
        .receive(move |answer: ConfirmHandoffRequest, from, _| {
            let _ = notices.try_send((from.source, Content::Answer(answer)));
        })
        .receive(move |requests: RequestReleaseControl, from, _| {
            let _ = others.try_send((from.source, Content::Requests(requests)));
        })
}

/// The handovers of one vehicle.
#[derive(Default)]
pub(super) struct Handover {
    asking: Option<Asking>,
    asked: Option<Asked>,
    /// How the last handover ended, for the operator.
    pub(super) ending: Option<String>,
}

/// Our request.
struct Asking {
    /// The part of the vehicle that passes it on.
    part: JausId,
    holder: JausId,
    id: Option<u8>,
    sent: Option<Instant>,
    /// When the vehicle last confirmed it.
    confirmed: Instant,
}

/// The requests of other operators.
struct Asked {
    part: JausId,
    requests: Vec<state::HandoverRequest>,
    told: Instant,
}

impl Handover {
    /// Interval between repetitions of a request.
    const REPEAT: Duration = Duration::from_secs(1);
    /// A vehicle that does not confirm the request for this time does not pass it on.
    const PATIENCE: Duration = Duration::from_secs(5);
    /// Requests of others that the vehicle does not repeat for this time are over.
    const LAPSE: Duration = Duration::from_secs(3);

    /// Requests control from the operator who has it.
    pub(super) fn ask(&mut self, now: Instant, part: JausId, holder: JausId) {
        self.ending = None;
        self.asking = Some(Asking {
            part,
            holder,
            id: None,
            sent: None,
            confirmed: now,
        });
    }

    /// The operator whose control is requested.
    pub(super) fn holder(&self) -> Option<JausId> {
        Some(self.asking.as_ref()?.holder)
    }

    /// Withdraws the request; false if there is none.
    pub(super) fn withdraw(&mut self, component: &Component) -> bool {
        let Some(asking) = self.asking.take() else {
            return false;
        };
        let id = asking.id.unwrap_or_default();
        send(component, asking.part, &RemoveHandoffRequest { id });
        true
    }

    /// Repeats the request, and forgets requests that are over.
    pub(super) fn handle_time(&mut self, now: Instant, authority: u8, component: &Component) {
        self.asked
            .take_if(|it| now.saturating_duration_since(it.told) >= Self::LAPSE);
        let Some(asking) = &mut self.asking else {
            return;
        };
        if now.saturating_duration_since(asking.confirmed) >= Self::PATIENCE {
            self.ending = Some(format!("{} does not answer the request", asking.part));
            self.asking = None;
        } else if asking.sent.is_none_or(|sent| now >= sent + Self::REPEAT) {
            asking.sent = Some(now);
            let request = RequestHandoff {
                authority_code: authority,
                ..RequestHandoff::default()
            };
            send(component, asking.part, &request);
        }
    }

    /// Handles the vehicle's answer to our request. Returns whether control was granted.
    pub(super) fn handle_answer(
        &mut self,
        now: Instant,
        part: JausId,
        answer: &ConfirmHandoffRequest,
    ) -> bool {
        let Some(asking) = self.asking.as_mut().filter(|it| it.part == part) else {
            return false;
        };
        let holder = asking.holder;
        asking.id = Some(answer.id);
        asking.confirmed = now;
        self.ending = Some(match answer.response_code {
            Answer::QUEUED | Answer::DEFERRED => return false,
            Answer::GRANTED => format!("{holder} has handed over control"),
            Answer::DENIED => format!("{holder} has refused to hand over control"),
            Answer::TIMEOUT => format!("{holder} has not answered the request for control"),
            Answer::INSUFFICIENT_AUTHORITY => format!("{part} requires a higher authority"),
            _ => format!("{part} is not available"),
        });
        self.asking = None;
        answer.response_code == Answer::GRANTED
    }

    /// Handles the vehicle's list of other operators' requests.
    pub(super) fn handle_requests(
        &mut self,
        now: Instant,
        part: JausId,
        message: &RequestReleaseControl,
    ) {
        let requests = message.request_release_control_list.iter().map(|it| {
            let operator = JausId::new(it.src_subsystem_id, it.src_node_id, it.src_component_id);
            state::HandoverRequest {
                id: it.id,
                operator: operator.to_string(),
                authority: it.authority_code,
                explanation: it.explanation.to_string(),
            }
        });
        let asked = Asked {
            part,
            requests: requests.collect(),
            told: now,
        };
        self.asked = (!asked.requests.is_empty()).then_some(asked);
    }

    /// The requests of other operators.
    pub(super) fn requests(&self) -> &[state::HandoverRequest] {
        self.asked.as_ref().map_or(&[], |asked| &asked.requests)
    }

    /// Decides about another operator's request. Returns the message for the part that has passed
    /// it on, and the operator; `None` if there is no such request any more.
    pub(super) fn decide(
        &mut self,
        id: u8,
        grant: bool,
    ) -> Option<(JausId, ConfirmReleaseControl, String)> {
        let asked = self.asked.as_mut()?;
        let at = asked.requests.iter().position(|it| it.id == id)?;
        let operator = asked.requests.remove(at).operator;
        let decision = ReleaseControlRec {
            id,
            response_code: if grant {
                Decision::GRANTED
            } else {
                Decision::DENIED
            },
        };
        let message = ConfirmReleaseControl {
            release_control_list: vec![decision],
        };
        Some((asked.part, message, operator))
    }
}

fn send<M: jaus::codec::Message>(component: &Component, part: JausId, message: &M) {
    if let Err(error) = component.send(part, message) {
        tracing::debug!(%part, %error, "not sent");
    }
}
