//! Generates steps from a service's state machine: in each reachable state, every message about
//! control and state, by the client in control and by another one.
//!
//! The required answers are the messages that the machine's transitions send, or none; the state
//! afterwards must be the transition's target. The subject is brought into a state by the shortest
//! path.

use std::collections::VecDeque;
use std::time::Duration;

use bytes::Bytes;
use jaus::codec::Message;
use jaus::messages::core::{
    ClearEmergency, QueryControl, QueryStatus, RejectControl, ReleaseControl, ReportControl,
    ReportStatus, RequestControl, Reset, Resume, SetAuthority, SetEmergency, Standby,
    clear_emergency, management, set_emergency,
};
use jsidl::Library;
use jsidl::behaviour::{Action, Guard, Transition, TransitionKind};
use jsidl::machine::{Machine, StateIndex, Stimulus};
use jsidl::model::Service;

use super::super::memory::Memory;
use super::super::step::{
    Act, Exchange, Expectation,
    Speaker::{self, First, Fourth, Main},
    equal,
};

/// Required silence where no message is sent.
const NOTHING: Duration = Duration::from_millis(100);
/// Time limit of a reset, including initialization.
const RESET: Duration = Duration::from_millis(1500);
/// Authority of every control request, also set by the client in control.
const STRONG: u8 = 200;
const WEAK: u8 = 100;

/// A message to the subject.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Saying {
    RequestControl,
    ReleaseControl,
    SetAuthority,
    Resume,
    Standby,
    Reset,
    SetEmergency,
    ClearEmergency,
}

impl Saying {
    const ALL: [Self; 8] = [
        Self::RequestControl,
        Self::ReleaseControl,
        Self::SetAuthority,
        Self::Resume,
        Self::Standby,
        Self::Reset,
        Self::SetEmergency,
        Self::ClearEmergency,
    ];

    const fn name(self) -> &'static str {
        match self {
            Self::RequestControl => RequestControl::NAME,
            Self::ReleaseControl => ReleaseControl::NAME,
            Self::SetAuthority => SetAuthority::NAME,
            Self::Resume => Resume::NAME,
            Self::Standby => Standby::NAME,
            Self::Reset => Reset::NAME,
            Self::SetEmergency => SetEmergency::NAME,
            Self::ClearEmergency => ClearEmergency::NAME,
        }
    }

    fn by(self, speaker: Speaker) -> Exchange {
        let authority_code = if speaker == First { STRONG } else { WEAK };
        match self {
            Self::RequestControl => Exchange::new(speaker, RequestControl { authority_code }),
            Self::ReleaseControl => Exchange::new(speaker, ReleaseControl),
            Self::SetAuthority => {
                // Unchanged, so that the machine need not track it.
                let authority_code = STRONG;
                Exchange::new(speaker, SetAuthority { authority_code })
            }
            Self::Resume => Exchange::new(speaker, Resume),
            Self::Standby => Exchange::new(speaker, Standby),
            Self::Reset => Exchange::new(speaker, Reset),
            Self::SetEmergency => {
                let emergency_code = set_emergency::EmergencyCode(1);
                Exchange::new(speaker, SetEmergency { emergency_code })
            }
            Self::ClearEmergency => {
                let emergency_code = clear_emergency::EmergencyCode(1);
                Exchange::new(speaker, ClearEmergency { emergency_code })
            }
        }
    }
}

/// The subject's state, as far as the machine's guards depend on it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Situation {
    state: StateIndex,
    /// Target of a pop.
    pushed: Option<StateIndex>,
    controller: Option<Speaker>,
    /// The client that has set an emergency.
    emergency: Option<Speaker>,
}

/// Result of a message.
struct Reaction {
    after: Situation,
    answers: Vec<Answer>,
}

/// A required message.
struct Answer {
    to: Speaker,
    message: String,
    code: String,
}

/// Titles and acts of the steps of a service's machine; none if the service declares no states of
/// its own and leaves them to its bases, which can be tested separately.
pub(super) fn walk(library: &Library, service: &Service) -> Vec<(String, Vec<Act>)> {
    if service.behaviour.is_empty() {
        return Vec::new();
    }
    let machines = library.machines(service);
    let Some(machine) = machines.iter().find(|it| is_about_control(it)) else {
        return Vec::new();
    };
    let mut lineage = library.lineage(service);
    let tells_status = lineage.any(|it| &*it.id.urn == management::URN);
    steps(machine, tells_status)
}

/// Whether the machine tracks the controller.
fn is_about_control(machine: &Machine<'_>) -> bool {
    let request = Stimulus::received(RequestControl::NAME);
    !machine.candidates(machine.start(), request).is_empty()
}

fn steps(machine: &Machine<'_>, tells_status: bool) -> Vec<(String, Vec<Act>)> {
    let start = Situation {
        state: machine.start(),
        pushed: None,
        controller: None,
        emergency: None,
    };
    let takes = |saying: &Saying| {
        let stimulus = Stimulus::received(saying.name());
        let mut states = machine.states();
        states.any(|(state, _)| !machine.candidates(state, stimulus).is_empty())
    };
    let sayings: Vec<_> = Saying::ALL.into_iter().filter(takes).collect();
    let mut steps = Vec::new();
    let mut seen = vec![start];
    let mut waiting = VecDeque::from([(start, Vec::new())]);
    while let Some((situation, way)) = waiting.pop_front() {
        for speaker in [First, Fourth] {
            for &saying in &sayings {
                let Some(reaction) = react(machine, situation, saying, speaker) else {
                    continue;
                };
                let mut way: Vec<(Situation, Saying, Speaker)> = way.clone();
                way.push((situation, saying, speaker));
                let title = title(machine, situation, saying, speaker);
                let acts = acts(machine, &way, tells_status);
                steps.push((title, acts));
                let after = reaction.after;
                // One controller and one emergency at a time cover all transitions.
                let further = after.controller != Some(Fourth)
                    && (situation.emergency.is_none() || after.emergency.is_none());
                if further && !seen.contains(&after) {
                    seen.push(after);
                    waiting.push_back((after, way));
                }
            }
        }
    }
    steps
}

fn title(machine: &Machine<'_>, from: Situation, saying: Saying, speaker: Speaker) -> String {
    let state = machine.state(from.state).path.last().to_owned();
    let whose = match from.controller {
        None if speaker == First => "uncontrolled",
        None => "uncontrolled, by another client",
        Some(controller) if controller == speaker => "controlled by the sender",
        Some(_) => "controlled by another",
    };
    let emergency = match from.emergency {
        Some(who) if who == speaker => ", set by the sender",
        _ => "",
    };
    let state = match &*state {
        "Available" => "".to_owned(),
        state => format!("{state}{emergency}, "),
    };
    format!("{} when {state}{whose}", saying.name())
}

/// All messages on the way, with the required answers; the last one is under test.
fn acts(
    machine: &Machine<'_>,
    way: &[(Situation, Saying, Speaker)],
    tells_status: bool,
) -> Vec<Act> {
    let mut acts = Vec::new();
    let mut after = None;
    for &(situation, saying, speaker) in way {
        let Some(reaction) = react(machine, situation, saying, speaker) else {
            continue;
        };
        let mut exchange = saying.by(speaker);
        exchange.expects = reaction.answers.iter().map(expectation).collect();
        if exchange.expects.is_empty() {
            let lasting = NOTHING;
            acts.push(Act::Ignored { exchange, lasting });
        } else {
            acts.push(Act::Exchange(exchange));
        }
        if saying == Saying::Reset && situation.controller == Some(speaker) {
            acts.push(Act::Pause(RESET));
        }
        after = Some(reaction.after);
    }
    if let Some(after) = after {
        acts.extend(look(machine, after, tells_status));
    }
    acts
}

/// Queries the state that the subject must have now.
fn look(machine: &Machine<'_>, after: Situation, tells_status: bool) -> Vec<Act> {
    let controller = after.controller;
    let asked = Exchange::new(Main, QueryControl).expect(
        Main,
        "the controller",
        move |report: &ReportControl, memory: &mut Memory| {
            let is = (report.subsystem_id, report.node_id, report.component_id);
            let must_be = controller.map_or((0, 0, 0), |speaker| {
                let id = memory.id(speaker);
                (id.subsystem(), id.node(), id.component())
            });
            let text = |(subsystem, node, component)| format!("{subsystem}.{node}.{component}");
            equal("the client in control", text(is), text(must_be))
        },
    );
    let mut acts = vec![Act::Exchange(asked)];
    let status = match machine.state(after.state).path.last() {
        "Ready" => Some(1),
        "Standby" => Some(2),
        "Emergency" => Some(5),
        _ => None,
    };
    if let Some(status) = status.filter(|_| tells_status) {
        let asked = Exchange::new(Main, QueryStatus).expect(
            Main,
            "the state",
            move |report: &ReportStatus, _: &mut Memory| {
                equal("the status", report.status.0, status)
            },
        );
        acts.push(Act::Exchange(asked));
    }
    acts
}

/// Messages at the end of each step, whatever its result. Releases are answered; waiting for the
/// answer keeps it out of the next step.
pub(super) fn afterwards() -> Vec<Exchange> {
    let clear = [First, Fourth].map(|speaker| Saying::ClearEmergency.by(speaker));
    let release = [First, Fourth].map(|speaker| {
        let exchange = Saying::ReleaseControl.by(speaker);
        exchange.expect(speaker, "", |_: &RejectControl, _| Ok(()))
    });
    clear.into_iter().chain(release).collect()
}

fn expectation(answer: &Answer) -> Expectation {
    let code = match &*answer.code {
        "NOT_AVAILABLE" => 1,
        "INSUFFICIENT_AUTHORITY" => 2,
        _ => 0,
    };
    let (number, name) = match &*answer.message {
        "ConfirmControl" => (0x000F, "ConfirmControl"),
        _ => (0x0010, "RejectControl"),
    };
    Expectation {
        to: answer.to,
        code: number,
        name: name.into(),
        words: answer.code.to_lowercase().replace('_', " ").into(),
        check: Box::new(move |octets: &Bytes, _| {
            let is = octets.get(2).copied().unwrap_or(u8::MAX);
            equal("the response code", is, code)
        }),
        is_optional: false,
        in_parts: false,
    }
}

/// The machine's reaction to a message; `None` if a guard is undecidable.
fn react(
    machine: &Machine<'_>,
    from: Situation,
    saying: Saying,
    speaker: Speaker,
) -> Option<Reaction> {
    let mut known = true;
    let stimulus = Stimulus::received(saying.name());
    let taken = machine.reaction(from.state, stimulus, &mut |question| {
        let answer = answer(question, from, speaker);
        known &= answer.is_some();
        answer.unwrap_or_default()
    });
    if !known {
        return None;
    }
    let Some(taken) = taken else {
        let answers = Vec::new();
        return Some(Reaction {
            after: from,
            answers,
        });
    };
    let after = follow(machine, from, taken.item, speaker)?;
    let answers = taken.item.actions.iter();
    let answers = answers
        .filter_map(|action| sent(action, from, speaker))
        .collect();
    Some(Reaction { after, answers })
}

/// Evaluates a guard for the situation and the speaker.
fn answer(question: &Guard, from: Situation, speaker: Speaker) -> Option<bool> {
    let Guard::Call(call) = question else {
        return None;
    };
    let authority = |speaker| if speaker == First { STRONG } else { WEAK };
    Some(match call.name.last() {
        "isControllingClient" => from.controller == Some(speaker),
        "isIDStored" | "isLastID" => from.emergency == Some(speaker),
        "isCurrentAuthorityLess" => from
            .controller
            .is_some_and(|controller| authority(controller) < authority(speaker)),
        // Both request with more authority than any known component requires.
        "isDefaultAuthorityGreater" => false,
        "isAuthorityValid" => true,
        // The judge waits for subjects that initialize slowly.
        "initializes" => false,
        _ => return None,
    })
}

fn follow(
    machine: &Machine<'_>,
    from: Situation,
    transition: &Transition,
    speaker: Speaker,
) -> Option<Situation> {
    let mut after = from;
    match &transition.kind {
        TransitionKind::Pop(_) => after.state = after.pushed.take()?,
        TransitionKind::Push(push) => {
            after.pushed = machine.remembered(from.state, push);
            after.state = machine.target(from.state, transition)?;
        }
        _ => after.state = machine.target(from.state, transition)?,
    }
    for action in &transition.actions {
        match &*action.name.last().to_ascii_lowercase() {
            "storeaddress" => after.controller = Some(speaker),
            "storeid" => after.emergency = after.emergency.or(Some(speaker)),
            "deleteid" => after.emergency = None,
            _ => {}
        }
    }
    let path = &machine.state(after.state).path;
    if path.parts().iter().any(|part| part == "NotControlled") {
        after.controller = None;
    }
    Some(after)
}

/// A message sent by an action: to the speaker if the action takes the message's envelope,
/// otherwise to the previous controller.
fn sent(action: &Action, from: Situation, speaker: Speaker) -> Option<Answer> {
    let message = action.sent()?.to_owned();
    let texts: Vec<_> = action.arguments.iter().filter_map(|it| it.text()).collect();
    let to_speaker = texts.len() < action.arguments.len();
    let to = if to_speaker {
        speaker
    } else {
        from.controller?
    };
    let code = (*texts.get(1)?).to_owned();
    Some(Answer { to, message, code })
}
