//! Handing over control of a vehicle between operators: our request to the operator in control, and
//! other operators' requests to us. The vehicle carries both, with the messages of Enhanced Access
//! Control.

use std::collections::BTreeMap;
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

use super::state;

/// A message about a handover, with the part of the vehicle that has sent it.
pub(crate) type Notice = (JausId, Content);

/// Content of a message about a handover.
pub(crate) enum Content {
    /// What has become of our request.
    Answer(ConfirmHandoffRequest),
    /// The requests of other operators.
    Requests(RequestReleaseControl),
}

/// The service that receives the messages about handovers. Messages beyond the capacity of the
/// channel are dropped; the vehicle repeats them.
pub(crate) fn service(notices: mpsc::Sender<Notice>) -> Handlers {
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
pub(crate) struct Handover {
    asking: Option<Asking>,
    /// The requests of other operators, by the part of the vehicle that has passed them on.
    asked: BTreeMap<JausId, Asked>,
    /// How the last handover ended, for the operator.
    pub(crate) ending: Option<String>,
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

/// The requests of other operators that one part has passed on.
struct Asked {
    requests: Vec<Request>,
    told: Instant,
}

/// Another operator's request.
struct Request {
    /// Its number at the part.
    id: u8,
    operator: JausId,
    authority: u8,
    explanation: String,
}

impl Handover {
    /// Interval between repetitions of a request.
    const REPEAT: Duration = Duration::from_secs(1);
    /// A vehicle that does not confirm the request for this time does not pass it on.
    const PATIENCE: Duration = Duration::from_secs(5);
    /// Requests of others that the vehicle does not repeat for this time are over.
    const LAPSE: Duration = Duration::from_secs(3);
    /// Limit of requests that one part passes on. Our own parts refuse further ones.
    const MOST: usize = 8;

    /// Requests control from the operator who has it.
    pub(crate) fn ask(&mut self, now: Instant, part: JausId, holder: JausId) {
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
    pub(crate) fn holder(&self) -> Option<JausId> {
        Some(self.asking.as_ref()?.holder)
    }

    /// Withdraws the request; false if there is none.
    pub(crate) fn withdraw(&mut self, component: &Component) -> bool {
        let Some(asking) = self.asking.take() else {
            return false;
        };
        let id = asking.id.unwrap_or_default();
        send(component, asking.part, &RemoveHandoffRequest { id });
        true
    }

    /// Repeats the request, and forgets requests that are over.
    pub(crate) fn handle_time(&mut self, now: Instant, authority: u8, component: &Component) {
        self.forget_lapsed(now);
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

    fn forget_lapsed(&mut self, now: Instant) {
        self.asked
            .retain(|_, it| now.saturating_duration_since(it.told) < Self::LAPSE);
    }

    /// Handles the vehicle's answer to our request. Returns whether control was granted.
    pub(crate) fn handle_answer(
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

    /// Handles a part's list of other operators' requests.
    pub(crate) fn handle_requests(
        &mut self,
        now: Instant,
        part: JausId,
        message: &RequestReleaseControl,
    ) {
        let requests = message.request_release_control_list.iter();
        let requests: Vec<_> = requests
            .take(Self::MOST)
            .map(|it| Request {
                id: it.id,
                operator: JausId::new(it.src_subsystem_id, it.src_node_id, it.src_component_id),
                authority: it.authority_code,
                explanation: it.explanation.to_string(),
            })
            .collect();
        if requests.is_empty() {
            self.asked.remove(&part);
        } else {
            let told = now;
            self.asked.insert(part, Asked { requests, told });
        }
    }

    /// Whether other operators request control.
    pub(crate) fn is_requested(&self) -> bool {
        !self.asked.is_empty()
    }

    /// The requests of other operators.
    pub(crate) fn requests(&self) -> Vec<state::HandoverRequest> {
        let asked = self.asked.iter();
        let requests = asked.flat_map(|(part, it)| it.requests.iter().map(move |it| (part, it)));
        requests
            .map(|(part, request)| state::HandoverRequest {
                part: part.to_string(),
                operator: request.operator.to_string(),
                authority: request.authority,
                explanation: request.explanation.clone(),
            })
            .collect()
    }

    /// Decides about the request of another operator that a part has passed on. Returns the message
    /// for that part; `None` if there is no such request any more.
    pub(crate) fn decide(
        &mut self,
        part: JausId,
        operator: JausId,
        grant: bool,
    ) -> Option<ConfirmReleaseControl> {
        let requests = &mut self.asked.get_mut(&part)?.requests;
        let at = requests.iter().position(|it| it.operator == operator)?;
        let decision = ReleaseControlRec {
            id: requests.remove(at).id,
            response_code: if grant {
                Decision::GRANTED
            } else {
                Decision::DENIED
            },
        };
        if requests.is_empty() {
            self.asked.remove(&part);
        }
        Some(ConfirmReleaseControl {
            release_control_list: vec![decision],
        })
    }
}

fn send<M: jaus::codec::Message>(component: &Component, part: JausId, message: &M) {
    if let Err(error) = component.send(part, message) {
        tracing::debug!(%part, %error, "not sent");
    }
}

#[cfg(test)]
#[expect(
    clippy::disallowed_methods,
    reason = "virtual time starts at any instant"
)]
mod tests {
    use jaus_vehicle::messages::handoff::request_release_control::RequestReleaseControlRec;

    use super::*;

    const PLANNER: JausId = JausId::new(101, 3, 36);
    const DRIVER: JausId = JausId::new(101, 2, 33);
    const SECOND: JausId = JausId::new(43, 1, 1);
    const THIRD: JausId = JausId::new(44, 1, 1);

    fn list(requests: &[(u8, JausId)]) -> RequestReleaseControl {
        let record = |&(id, operator): &(u8, JausId)| RequestReleaseControlRec {
            id,
            src_subsystem_id: operator.subsystem(),
            src_node_id: operator.node(),
            src_component_id: operator.component(),
            authority_code: 200,
            ..RequestReleaseControlRec::default()
        };
        RequestReleaseControl {
            request_release_control_list: requests.iter().map(record).collect(),
        }
    }

    fn shown(handover: &Handover) -> Vec<(String, String)> {
        let requests = handover.requests().into_iter();
        requests.map(|it| (it.part, it.operator)).collect()
    }

    fn pairs(pairs: &[(JausId, JausId)]) -> Vec<(String, String)> {
        let pair = |&(part, operator): &(JausId, JausId)| (part.to_string(), operator.to_string());
        pairs.iter().map(pair).collect()
    }

    /// Both parts have numbered the request of another operator 1.
    fn asked_at_both() -> (Handover, Instant) {
        let (mut handover, now) = (Handover::default(), Instant::now());
        handover.handle_requests(now, PLANNER, &list(&[(1, SECOND)]));
        handover.handle_requests(now, DRIVER, &list(&[(1, THIRD)]));
        (handover, now)
    }

    #[test]
    fn the_list_of_one_part_does_not_replace_that_of_another() {
        let (mut handover, now) = asked_at_both();
        assert_eq!(
            shown(&handover),
            pairs(&[(DRIVER, THIRD), (PLANNER, SECOND)])
        );
        handover.handle_requests(now, DRIVER, &list(&[]));
        assert_eq!(shown(&handover), pairs(&[(PLANNER, SECOND)]));
        handover.handle_requests(now, PLANNER, &list(&[]));
        assert!(!handover.is_requested());
    }

    #[test]
    fn a_decision_goes_to_the_part_and_the_operator_that_it_names() {
        let (mut handover, now) = asked_at_both();
        assert_eq!(handover.decide(PLANNER, THIRD, true), None);
        assert_eq!(handover.decide(JausId::new(101, 1, 1), SECOND, true), None);
        // The part has numbered its requests anew since the page was shown.
        handover.handle_requests(now, PLANNER, &list(&[(1, THIRD), (2, SECOND)]));
        let decision = handover.decide(PLANNER, SECOND, true).unwrap();
        let [decision] = &decision.release_control_list[..] else {
            panic!("{decision:?}");
        };
        assert_eq!(
            (decision.id, decision.response_code),
            (2, Decision::GRANTED)
        );
        assert_eq!(
            shown(&handover),
            pairs(&[(DRIVER, THIRD), (PLANNER, THIRD)])
        );
        assert_eq!(handover.decide(PLANNER, SECOND, false), None, "once only");
    }

    #[test]
    fn a_part_that_does_not_repeat_its_requests_loses_only_those() {
        let (mut handover, now) = asked_at_both();
        let later = now + Handover::LAPSE / 2;
        handover.handle_requests(later, DRIVER, &list(&[(1, THIRD)]));
        handover.forget_lapsed(now + Handover::LAPSE);
        assert_eq!(shown(&handover), pairs(&[(DRIVER, THIRD)]));
    }
}
