//! Requests for control at a component with Management, in virtual time.

use bytes::Bytes;
use jaus::endpoint::{LinkId, Path, Remote, SessionId};
use jaus::messages::core::{ReleaseControl, RequestControl, Resume, SetEmergency};
use jaus::service::{AccessControl, Discovery, Kind, Management, Profile, Scope, Stack, Timing};
use jaus::wire::{Broadcast, Priority};

use super::*;
use crate::messages::handoff::confirm_release_control::ReleaseControlRec;

const ROVER: JausId = JausId::new(101, 1, 1);
const HOLDER: JausId = JausId::new(42, 1, 1);
const OTHER: JausId = JausId::new(43, 1, 1);
const THIRD: JausId = JausId::new(44, 1, 1);

/// A component that HOLDER controls, ready.
struct Rover {
    stack: Stack,
    now: Instant,
    sent: Vec<(JausId, Bytes)>,
}

impl Rover {
    fn new() -> Self {
        Self::with(Management::new())
    }

    fn with(management: Management) -> Self {
        let profile = Profile::new(Kind::Vehicle, "Rover");
        let discovery = Discovery::new(ROVER, profile, Scope::Nobody, Timing::default(), 1);
        let stack = Stack::new(discovery, vec![Box::new(Handoff::new())]);
        let mut rover = Self {
            stack: stack.management(management),
            now: Instant::now(),
            sent: Vec::new(),
        };
        rover.stack.start(rover.now);
        rover.hear(
            HOLDER,
            &RequestControl {
                authority_code: 200,
            },
        );
        rover.hear(HOLDER, &Resume {});
        rover
    }

    fn hear<M: Message>(&mut self, source: JausId, message: &M) {
        self.hear_on(None, source, message);
    }

    fn hear_on<M: Message>(&mut self, path: Option<Path>, source: JausId, message: &M) {
        let received = Received {
            source,
            destination: ROVER,
            to: ROVER,
            priority: Priority::Standard,
            broadcast: Broadcast::None,
            payload: message.encode().unwrap(),
            sequence: None,
            path,
            acknowledged: false,
        };
        self.sent.clear();
        self.stack.handle_message(self.now, &received);
        self.note();
    }

    fn note(&mut self) {
        while let Some(out) = self.stack.poll_transmit() {
            self.sent.push((out.destination, out.payload));
        }
    }

    /// Lets time pass in steps of 1 s, in which OTHER repeats its request if it `insists`. HOLDER
    /// renews its control.
    fn pass(&mut self, seconds: u8, insists: bool) {
        let mut sent = Vec::new();
        for _ in 0..seconds {
            self.now += Duration::from_secs(1);
            self.hear(
                HOLDER,
                &RequestControl {
                    authority_code: 200,
                },
            );
            sent.append(&mut self.sent);
            if insists {
                self.hear(OTHER, &request(200));
                sent.append(&mut self.sent);
            }
            self.stack.handle_timeout(self.now);
            self.note();
            sent.append(&mut self.sent);
        }
        self.sent = sent;
    }

    /// The messages of a type that were sent last to a client.
    fn sent_to<M: Message>(&self, client: JausId) -> Vec<M> {
        let sent = self.sent.iter().filter(|(to, _)| *to == client);
        sent.filter_map(|(_, octets)| M::decode(octets).ok())
            .collect()
    }

    /// The last answer to a client.
    fn answer_to(&self, client: JausId) -> Option<Answer> {
        let answers = self.sent_to::<ConfirmHandoffRequest>(client);
        answers.last().map(|it| it.response_code)
    }

    /// The clients whose requests the client in control was told of last.
    fn told(&self, holder: JausId) -> Option<Vec<u16>> {
        let told = self.sent_to::<RequestReleaseControl>(holder);
        let requests = told.last()?.request_release_control_list.iter();
        Some(requests.map(|it| it.src_subsystem_id).collect())
    }

    fn stands(&self) -> (State, Option<JausId>) {
        let standing = self.stack.standing();
        (standing.state, standing.controller.map(|it| it.id))
    }
}

fn request(authority_code: u8) -> RequestHandoff {
    RequestHandoff {
        authority_code,
        ..RequestHandoff::default()
    }
}

fn decide(id: u8, response_code: Decision) -> ConfirmReleaseControl {
    ConfirmReleaseControl {
        release_control_list: vec![ReleaseControlRec { id, response_code }],
    }
}

#[test]
fn a_grant_hands_control_over_in_standby_and_refuses_the_others() {
    let mut rover = Rover::new();
    rover.hear(OTHER, &request(200));
    assert_eq!(rover.answer_to(OTHER), Some(Answer::QUEUED));
    rover.hear(THIRD, &request(100));
    assert_eq!(rover.told(HOLDER), Some(vec![43, 44]));
    assert_eq!(rover.stands(), (State::Ready, Some(HOLDER)), "not yet");

    rover.hear(HOLDER, &decide(1, Decision::GRANTED));
    assert_eq!(rover.stands(), (State::Standby, Some(OTHER)));
    assert_eq!(rover.answer_to(OTHER), Some(Answer::GRANTED));
    assert_eq!(rover.answer_to(THIRD), Some(Answer::DENIED));
    rover.hear(HOLDER, &Resume {});
    assert_eq!(rover.stands(), (State::Standby, Some(OTHER)));
}

#[test]
fn a_refusal_changes_nothing_and_only_the_client_in_control_decides() {
    let mut rover = Rover::new();
    rover.hear(OTHER, &request(200));
    for stranger in [OTHER, THIRD] {
        rover.hear(stranger, &decide(1, Decision::GRANTED));
        assert_eq!(rover.stands(), (State::Ready, Some(HOLDER)));
    }
    rover.hear(HOLDER, &decide(1, Decision::DENIED));
    assert_eq!(rover.answer_to(OTHER), Some(Answer::DENIED));
    assert_eq!(rover.told(HOLDER), Some(vec![]), "the display empties");
    rover.hear(HOLDER, &decide(1, Decision::GRANTED));
    assert_eq!(rover.stands(), (State::Ready, Some(HOLDER)), "it is over");
}

#[test]
fn a_request_lapses_without_repetition_and_ends_without_a_decision() {
    let mut rover = Rover::new();
    rover.hear(OTHER, &request(200));
    rover.pass(Handoff::LAPSE - 1, false);
    assert_eq!(rover.told(HOLDER), Some(vec![43]), "told again and again");
    rover.pass(1, false);
    assert_eq!(rover.answer_to(OTHER), Some(Answer::TIMEOUT));
    assert_eq!(rover.told(HOLDER), Some(vec![]));

    rover.hear(OTHER, &request(200));
    rover.pass(Handoff::ANSWER - 1, true);
    assert_eq!(rover.answer_to(OTHER), Some(Answer::QUEUED));
    rover.hear(HOLDER, &decide(2, Decision::WAIT));
    assert_eq!(rover.answer_to(OTHER), Some(Answer::DEFERRED));
    rover.pass(Handoff::ANSWER - 1, true);
    assert_eq!(rover.answer_to(OTHER), Some(Answer::QUEUED), "later");
    rover.pass(1, true);
    let answers = rover.sent_to::<ConfirmHandoffRequest>(OTHER);
    assert!(answers.iter().any(|it| it.response_code == Answer::TIMEOUT));
    assert_eq!(rover.stands(), (State::Ready, Some(HOLDER)));
}

#[test]
fn control_that_is_released_or_free_goes_to_the_client_that_waits() {
    let mut rover = Rover::new();
    rover.hear(OTHER, &request(1));
    rover.hear(HOLDER, &ReleaseControl {});
    assert_eq!(rover.stands(), (State::Standby, Some(OTHER)));
    assert_eq!(rover.answer_to(OTHER), Some(Answer::GRANTED));
    rover.hear(OTHER, &ReleaseControl {});
    rover.hear(THIRD, &request(1));
    assert_eq!(rover.answer_to(THIRD), Some(Answer::GRANTED));
    assert_eq!(rover.stands(), (State::Standby, Some(THIRD)));
}

#[test]
fn who_has_too_little_authority_for_the_component_is_not_told_that_it_has_control() {
    let access = AccessControl::new().authority(50);
    let mut rover = Rover::with(Management::new().access_control(access));
    rover.hear(HOLDER, &ReleaseControl {});
    rover.hear(OTHER, &request(49));
    assert_eq!(rover.answer_to(OTHER), Some(Answer::INSUFFICIENT_AUTHORITY));
    assert_eq!(rover.stands(), (State::Standby, None));
    rover.hear(OTHER, &request(50));
    assert_eq!(rover.answer_to(OTHER), Some(Answer::GRANTED));
    assert_eq!(rover.stands(), (State::Standby, Some(OTHER)));
}

#[test]
fn a_request_that_is_withdrawn_is_over() {
    let mut rover = Rover::new();
    rover.hear(OTHER, &request(200));
    rover.hear(OTHER, &RemoveHandoffRequest { id: 1 });
    assert_eq!(rover.told(HOLDER), Some(vec![]));
    rover.hear(HOLDER, &ReleaseControl {});
    assert_eq!(rover.stands(), (State::Standby, None));
}

#[test]
fn a_takeover_leaves_requests_to_the_new_client_in_control() {
    let mut rover = Rover::new();
    rover.hear(OTHER, &request(200));
    rover.hear(
        THIRD,
        &RequestControl {
            authority_code: 250,
        },
    );
    assert_eq!(rover.told(THIRD), Some(vec![43]));
    rover.hear(HOLDER, &decide(1, Decision::GRANTED));
    assert_eq!(rover.stands().1, Some(THIRD));
    rover.hear(THIRD, &decide(1, Decision::GRANTED));
    assert_eq!(rover.stands(), (State::Standby, Some(OTHER)));
}

/// The path of a session with this number.
fn session(number: u64) -> Option<Path> {
    let peer = Remote::Session(SessionId(number));
    Some(Path {
        link: LinkId(1),
        peer,
    })
}

#[test]
fn neither_the_ids_of_a_session_nor_the_sessions_of_a_subsystem_take_all_places() {
    for is_one_session in [true, false] {
        let mut rover = Rover::new();
        for number in 0..10_u8 {
            let path = session(if is_one_session { 1 } else { number.into() });
            let client = JausId::new(50, 1, number + 1);
            rover.hear_on(path, client, &request(1));
            let is_full = usize::from(number) >= Handoff::MOST;
            let expected = match is_full {
                true => Answer::NOT_AVAILABLE,
                false => Answer::QUEUED,
            };
            assert_eq!(rover.answer_to(client), Some(expected));
        }
        for (number, colleague) in [(20, OTHER), (21, THIRD)] {
            rover.hear_on(session(number), colleague, &request(100));
            assert_eq!(rover.answer_to(colleague), Some(Answer::QUEUED));
        }
        let told = rover.told(HOLDER).unwrap();
        let expected = [50, 50, 50, 50, 50, 50, 43, 44];
        assert_eq!(told, expected, "the newest have given way");
        rover.hear_on(session(1), JausId::new(50, 1, 1), &request(1));
        rover.hear_on(session(20), OTHER, &request(100));
        assert_eq!(rover.answer_to(OTHER), Some(Answer::QUEUED));
    }
}

#[test]
fn an_emergency_and_a_full_list_refuse_requests() {
    let mut rover = Rover::new();
    for number in 0..=Handoff::MOST {
        let client = JausId::new(50 + u16::try_from(number).unwrap(), 1, 1);
        rover.hear(client, &request(200));
        let is_full = number == Handoff::MOST;
        let expected = if is_full {
            Answer::NOT_AVAILABLE
        } else {
            Answer::QUEUED
        };
        assert_eq!(rover.answer_to(client), Some(expected), "{number}");
    }
    let mut rover = Rover::new();
    rover.hear(
        HOLDER,
        &SetEmergency {
            emergency_code: 1.into(),
        },
    );
    rover.hear(OTHER, &request(200));
    assert_eq!(rover.answer_to(OTHER), Some(Answer::NOT_AVAILABLE));
    assert_eq!(rover.stands(), (State::Emergency, Some(HOLDER)));
}

#[test]
fn no_two_undecided_requests_have_one_number() {
    let mut rover = Rover::new();
    rover.hear(OTHER, &request(200));
    let number = |rover: &Rover, client| rover.sent_to::<ConfirmHandoffRequest>(client)[0].id;
    let first = number(&rover, OTHER);
    for _ in 0..=u8::MAX {
        rover.hear(THIRD, &request(100));
        let id = number(&rover, THIRD);
        assert_ne!(id, first);
        rover.hear(THIRD, &RemoveHandoffRequest { id });
    }
}
