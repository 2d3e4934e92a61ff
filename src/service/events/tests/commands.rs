//! Command events: each runs once, and its end is reported once.

use super::super::commands::MOST_COMMANDS;
use super::super::{CommandTrial, Events};
use super::*;
use crate::endpoint::Received;
use crate::messages::core::command_event::CommandResult;
use crate::messages::core::reject_event_request::ResponseCode;
use crate::service::Outbox;
use crate::service::stack_rig::US;
use crate::wire::{Broadcast, Priority};

const FIRST: CommandResult = CommandResult::SUCCESSFUL;
const FAILED: CommandResult = CommandResult::UNSUCCESSFUL;

/// A component that `CLIENT` has made ready, with a job that its application completes.
fn ready() -> Rig {
    let mut rig = Rig::new();
    let job = Handlers::new(ServiceId {
        urn: "urn:test:Job",
        ..COUNTER
    });
    let done = rig.number.clone();
    let job = job
        .command(move |_: DeleteElement, _, _| _ = done.fetch_add(1, Ordering::Relaxed))
        .on_stop(|_| {})
        .tell_end_of::<DeleteElement>();
    let now = rig.now;
    rig.stack.offer(now, Box::new(job)).unwrap();
    let authority_code = 100;
    rig.hear(CLIENT, &RequestControl { authority_code });
    rig.hear(CLIENT, &Resume);
    rig.said();
    rig
}

fn job(request_id: u8, seconds: u32) -> CreateCommandEvent {
    CreateCommandEvent {
        request_id,
        maximum_allowed_duration: seconds,
        command_message: DeleteElement::default().encode().unwrap(),
    }
}

fn results(said: &[(JausId, Bytes)]) -> Vec<(JausId, u8, CommandResult)> {
    said.iter()
        .filter_map(|(to, octets)| Some((*to, CommandEvent::decode(octets).ok()?)))
        .map(|(to, it)| (to, it.event_id, it.command_result))
        .collect()
}

impl Rig {
    fn done(&self) -> u16 {
        self.number.load(Ordering::Relaxed)
    }

    fn end_job(&mut self, successful: bool) -> Vec<(JausId, u8, CommandResult)> {
        let now = self.now;
        self.stack.end_command(now, DeleteElement::CODE, successful);
        results(&self.said())
    }
}

#[test]
fn a_command_is_carried_out_at_once_and_its_end_told_once() {
    for (successful, result) in [(true, FIRST), (false, FAILED)] {
        let mut rig = ready();
        let said = rig.hear(CLIENT, &job(7, 0));
        let confirm: ConfirmEventRequest = answer(&said);
        assert_eq!((confirm.request_id, confirm.event_id), (7, 1));
        assert_eq!((rig.done(), results(&said).len()), (1, 0));
        rig.run(60 * SECOND);
        assert_eq!(rig.end_job(successful), [(CLIENT, 1, result)]);
        assert_eq!(rig.end_job(successful), []);
    }
}

#[test]
fn what_takes_too_long_has_failed() {
    let mut rig = ready();
    rig.hear(CLIENT, &job(7, 10));
    let said = rig.run(60 * SECOND);
    let [(at, to, octets)] = &said[..] else {
        panic!("{said:?}");
    };
    let event = CommandEvent::decode(octets).unwrap();
    assert_eq!(
        (*at, *to, event.command_result),
        (10 * SECOND, CLIENT, FAILED)
    );
    assert_eq!(rig.end_job(true), [], "nobody waits for it any more");
}

#[test]
fn only_the_client_that_may_command_has_something_carried_out() {
    let mut rig = ready();
    let reject: RejectEventRequest = answer(&rig.hear(OTHER, &job(7, 0)));
    let refused = Some(ResponseCode::CONNECTION_REFUSED);
    assert_eq!((reject.request_id, reject.response_code), (7, refused));
    rig.hear(CLIENT, &Standby);
    let reject: RejectEventRequest = answer(&rig.hear(CLIENT, &job(8, 0)));
    assert_eq!(reject.response_code, refused, "it would not act");
    assert_eq!(rig.done(), 0);
}

#[test]
fn commands_whose_end_nobody_tells_are_refused_and_not_carried_out() {
    let mut rig = ready();
    for (command, why) in [
        (Reset.encode().unwrap(), ResponseCode::MESSAGE_NOT_SUPPORTED),
        (Bytes::new(), ResponseCode::INVALID_EVENT_SETUP),
    ] {
        let create = CreateCommandEvent {
            command_message: command,
            ..job(7, 0)
        };
        let reject: RejectEventRequest = answer(&rig.hear(CLIENT, &create));
        assert_eq!(reject.response_code, Some(why));
    }
    assert!(rig.stack.standing().may_act(), "no reset");
}

#[test]
fn another_command_of_the_same_code_takes_the_place_of_the_first() {
    let mut rig = ready();
    rig.hear(CLIENT, &job(7, 0));
    let said = rig.hear(CLIENT, &DeleteElement::default());
    assert_eq!(results(&said), [(CLIENT, 1, FAILED)]);
    assert_eq!(rig.done(), 2);
    assert_eq!(rig.end_job(true), []);
}

#[test]
fn asking_again_is_the_same_event_with_a_new_command() {
    let mut rig = ready();
    for request in [7, 8] {
        let said = rig.hear(CLIENT, &job(request, 0));
        let confirm: ConfirmEventRequest = answer(&said);
        assert_eq!((confirm.request_id, confirm.event_id), (request, 1));
        assert_eq!(results(&said), []);
    }
    assert_eq!(
        (rig.done(), rig.end_job(true)),
        (2, vec![(CLIENT, 1, FIRST)])
    );
}

#[test]
fn a_cancelled_command_event_is_not_told_of_and_numbers_are_shared_with_events() {
    let mut rig = ready();
    rig.create(CLIENT, &periodic(1, 1.0, &QueryHeartbeatPulse));
    let confirm: ConfirmEventRequest = answer(&rig.hear(CLIENT, &job(7, 0)));
    assert_eq!(confirm.event_id, 2);
    let cancel = CancelEvent {
        request_id: 8,
        event_id: 2,
    };
    let confirm: ConfirmEventRequest = answer(&rig.hear(CLIENT, &cancel));
    assert_eq!((confirm.request_id, confirm.event_id), (8, 2));
    assert_eq!(rig.end_job(true), []);
}

/// Begins a command event for a command with this code; returns whether the command runs.
fn begin(events: &mut Events, rig: &Rig, source: JausId, code: u16, out: &mut Outbox) -> bool {
    let request = Received {
        source,
        destination: US,
        to: US,
        priority: Priority::Standard,
        broadcast: Broadcast::None,
        payload: Bytes::new(),
        sequence: None,
        path: None,
        acknowledged: false,
    };
    let create = CreateCommandEvent {
        command_message: Bytes::copy_from_slice(&code.to_le_bytes()),
        ..job(1, 0)
    };
    let trial = CommandTrial::new(&request, create).unwrap();
    events.begin_command(rig.now, &trial, None, out)
}

#[test]
fn running_commands_are_bounded_and_a_running_one_can_be_sent_again() {
    let (mut events, rig) = (Events::new(EventSettings::default()), Rig::new());
    let mut out = Outbox::new(US);
    let mut begin = |code| begin(&mut events, &rig, CLIENT, code, &mut out);
    for code in 0..MOST_COMMANDS as u16 {
        assert!(begin(code), "{code}");
    }
    assert!(!begin(MOST_COMMANDS as u16));
    assert!(begin(0));
}

#[test]
fn only_the_commands_of_a_client_that_is_gone_are_forgotten() {
    let (mut events, rig) = (Events::new(EventSettings::default()), Rig::new());
    let mut out = Outbox::new(US);
    begin(&mut events, &rig, CLIENT, 1, &mut out);
    begin(&mut events, &rig, OTHER, 2, &mut out);
    events.forget(CLIENT);
    let mut out = Outbox::new(US);
    events.end_command(1, true, &mut out);
    events.end_command(2, true, &mut out);
    let told: Vec<_> = std::iter::from_fn(|| out.pop())
        .map(|it| (it.destination, it.payload))
        .collect();
    assert_eq!(results(&told), [(OTHER, 1, FIRST)]);
}
