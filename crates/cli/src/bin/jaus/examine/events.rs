//! Events exchanges: create, receive, cancel, and the same on change.

use std::time::Duration;

use bytes::Bytes;
use jaus::messages::core::{
    CancelEvent, ConfirmEventRequest, CreateEvent, Event, RejectEventRequest, create_event,
};

use super::case::{Case, OpenEvent, Question, Send};
use super::discovery::{malformed, shown};
use super::exchange::{Exchange, Mark, Verdict};
use super::judgement::{Begin, Judgement};
use super::standing::answered_query;

/// Requested rate, in hertz.
const RATE: f64 = 5.0;
/// Number of reports that show a rate.
const ENOUGH: usize = 4;
/// Required silence after a cancellation.
const QUIET: Duration = Duration::from_millis(700);

const PERIODIC: u8 = 1;
const CANCEL: u8 = 2;
const ON_CHANGE: u8 = 3;

/// A Create Event with this request id.
pub(super) fn create(request_id: u8, query: Bytes, periodic: bool) -> CreateEvent {
    let mut create = CreateEvent {
        request_id,
        event_type: if periodic {
            create_event::EventType::PERIODIC_SC
        } else {
            create_event::EventType::EVERY_CHANGE
        },
        query_message: query,
        ..CreateEvent::default()
    };
    if periodic {
        // The rate is within the field's range.
        let _ = create.set_requested_periodic_rate_hz(RATE);
    }
    create
}

pub(super) fn periodic(case: &mut Case) -> Begin {
    if let Some(skip) = case.nobody().or_else(|| case.lacks("Events")) {
        return Begin::Over(skip);
    }
    subscribe(case, PERIODIC)
}

fn subscribe(case: &mut Case, request_id: u8) -> Begin {
    let Some((query, _, _)) = answered_query(case) else {
        return Begin::Over(Verdict::skipped(
            "it answers no query that could be subscribed to",
        ));
    };
    let create = create(request_id, query, request_id == PERIODIC);
    match case.ask_peer(&create) {
        // A repeated request may create the event twice.
        Some(send) => Begin::Ask(Question::new(send).once()),
        None => Begin::Over(Verdict::skipped("no component id is known at that address")),
    }
}

/// Answer to a request.
pub(super) enum Reply {
    Confirmed(ConfirmEventRequest),
    Rejected(RejectEventRequest),
}

pub(super) fn reply(case: &Case, mark: usize, request_id: u8) -> Option<Reply> {
    let confirmed = case.reports::<ConfirmEventRequest>(mark);
    let mut confirmed = confirmed.filter(|reply| reply.request_id == request_id);
    if let Some(reply) = confirmed.next() {
        return Some(Reply::Confirmed(reply));
    }
    let rejected = case.reports::<RejectEventRequest>(mark);
    let mut rejected = rejected.filter(|reply| reply.request_id == request_id);
    rejected.next().map(Reply::Rejected)
}

pub(super) fn created(case: &mut Case, mark: usize) -> Judgement {
    match reply(case, mark, PERIODIC) {
        None => Judgement::Wait,
        Some(Reply::Rejected(reject)) => Judgement::Over(rejected(case, &reject, "periodic")),
        Some(Reply::Confirmed(confirm)) => {
            let (id, rate) = (confirm.event_id, confirm.confirmed_periodic_rate.value());
            case.open_events.push(OpenEvent { id });
            let query = answered_query(case).map_or("", |(_, _, name)| name);
            Judgement::Over(Verdict::ok(format!(
                "{query} at {RATE} Hz: number {id}, {rate:.1} Hz"
            )))
        }
    }
}

fn rejected(case: &Case, reject: &RejectEventRequest, kind: &str) -> Verdict {
    const NAMES: [&str; 7] = [
        "0, which is not a code of the standard (JAUS++ counts its codes from 0)",
        "1, periodic events are not supported",
        "2, events on change are not supported",
        "3, the connection is refused",
        "4, the set-up is invalid",
        "5, the message is not supported",
        "6, there is no such event",
    ];
    let code = reject.response_code.map(|code| code.0);
    let why = match code.and_then(|code| NAMES.get(usize::from(code))) {
        Some(name) => (*name).to_owned(),
        None => code.map_or_else(|| "no reason given".to_owned(), |code| code.to_string()),
    };
    Verdict::failed(
        format!("{} refuses a {kind} event: {why}", shown(case)),
        "the peer does not support such events for this query, or has no room for more",
        "poll instead of subscribing",
    )
}

pub(super) fn not_created(case: &Case, mark: usize) -> Verdict {
    let confirmation = case.unreadable::<ConfirmEventRequest>(mark);
    let error = confirmation.or_else(|| case.unreadable::<RejectEventRequest>(mark));
    if let Some(error) = error {
        return malformed("answer to Create Event", &error);
    }
    if case.report::<Event>(mark).is_some() {
        return Verdict::failed(
            "Create Event is not confirmed, but its events arrive",
            "the confirmation is lost, or the peer sends none",
            "a client that waits for the confirmation assumes that the event was refused",
        );
    }
    Verdict::failed(
        "Create Event is not answered",
        "the component has no Events service, or answers too late",
        "poll instead of subscribing",
    )
}

pub(super) fn arrival(case: &mut Case) -> Begin {
    if let Some(skip) = case.nobody() {
        return Begin::Over(skip);
    }
    if case.mark_of(Exchange::EventPeriodic) != Some(Mark::Ok) {
        return Begin::Over(Verdict::skipped("there is no event to wait for"));
    }
    Begin::Ask(Question::silence(Duration::from_secs(2)))
}

pub(super) fn arrived(case: &mut Case, mark: usize) -> Judgement {
    let times = times(case, mark);
    let (Some(first), Some(last)) = (times.first(), times.get(ENOUGH)) else {
        return Judgement::Wait;
    };
    let rate = ENOUGH as f64 / (*last - *first).as_secs_f64().max(0.001);
    Judgement::Over(Verdict::ok(format!("{rate:.1} Hz")))
}

/// Times of the reports of the first open event; simultaneous ones count once, as JAUS++ sends up
/// to four copies.
fn times(case: &Case, mark: usize) -> Vec<Duration> {
    use jaus::codec::Message;

    const AT_ONCE: Duration = Duration::from_millis(25);
    let Some(event) = case.open_events.first() else {
        return Vec::new();
    };
    let report = answered_query(case).map(|(_, report, _)| report.to_le_bytes());
    let all = case
        .received(mark)
        .filter(|heard| heard.code() == Some(Event::CODE));
    let came = all.filter_map(|heard| {
        let event_report = Event::decode(&heard.frame.payload).ok()?;
        let of_it = report.is_some_and(|code| event_report.report_message.starts_with(&code));
        (event_report.event_id == event.id && of_it).then_some(heard.at)
    });
    let mut times: Vec<_> = came.collect();
    times.dedup_by(|later, before| later.saturating_sub(*before) < AT_ONCE);
    times
}

pub(super) fn not_arrived(case: &Case, mark: usize) -> Verdict {
    if let Some(error) = case.unreadable::<Event>(mark) {
        return malformed("Event", &error);
    }
    match times(case, mark).len() {
        0 => Verdict::failed(
            "the event was confirmed, but none of its reports arrive",
            "they are sent to another address than the confirmation, or with another event id",
            "run `jaus record` on both sides to see where they go",
        ),
        some => Verdict::failed(
            format!(
                "{some} reports arrived in 2 s; {} were confirmed",
                2.0 * RATE
            ),
            "the peer is busy, or its timer drifts (known of JAUS++)",
            "request twice the required rate, and do not treat a late report as lost",
        ),
    }
}

pub(super) fn cancel(case: &mut Case) -> Begin {
    if let Some(skip) = case.nobody() {
        return Begin::Over(skip);
    }
    let Some(event) = case.open_events.first().copied() else {
        return Begin::Over(Verdict::skipped("there is no event to cancel"));
    };
    match cancellation(case, event) {
        Some(send) => Begin::Ask(Question::new(send)),
        None => Begin::Over(Verdict::skipped("no component id is known at that address")),
    }
}

fn cancellation(case: &mut Case, event: OpenEvent) -> Option<Send> {
    case.ask_peer(&CancelEvent {
        request_id: CANCEL,
        event_id: event.id,
    })
}

/// First the confirmation; then no further report may arrive.
pub(super) fn cancelled(case: &mut Case, mark: usize, stage: u8) -> Judgement {
    if stage > 0 {
        return Judgement::Wait;
    }
    match reply(case, mark, CANCEL) {
        None => Judgement::Wait,
        Some(Reply::Rejected(reject)) => Judgement::Over(rejected(case, &reject, "cancelled")),
        Some(Reply::Confirmed(_)) => Judgement::Ask(Question::silence(QUIET)),
    }
}

pub(super) fn after_cancel(case: &mut Case, mark: usize, stage: u8) -> Verdict {
    if stage == 0 {
        return Verdict::failed(
            "Cancel Event is not answered",
            "the peer lost the event, or does not confirm cancellations",
            "cancel again; expect reports of cancelled events",
        );
    }
    // One may have been in transit.
    let late = times(case, mark).len();
    if late > 1 {
        return Verdict::failed(
            format!("{late} reports arrived after the confirmed cancellation"),
            "its event ids are not unique and another event was cancelled (JAUS++), or there were \
             two events",
            "cancel all events, then create the required ones again",
        );
    }
    case.open_events.clear();
    Verdict::ok("confirmed, and no more reports arrive")
}

pub(super) fn on_change(case: &mut Case) -> Begin {
    if let Some(skip) = case.nobody().or_else(|| case.lacks("Events")) {
        return Begin::Over(skip);
    }
    subscribe(case, ON_CHANGE)
}

/// First the confirmation, then the cancellation.
pub(super) fn changes(case: &mut Case, mark: usize, stage: u8) -> Judgement {
    if stage > 0 {
        return match reply(case, mark, CANCEL) {
            Some(_) => {
                case.open_events.clear();
                Judgement::Over(Verdict::ok("confirmed and cancelled"))
            }
            None => Judgement::Wait,
        };
    }
    match reply(case, mark, ON_CHANGE) {
        None => Judgement::Wait,
        Some(Reply::Rejected(reject)) => Judgement::Over(rejected(case, &reject, "change-based")),
        Some(Reply::Confirmed(confirm)) => {
            let event = OpenEvent {
                id: confirm.event_id,
            };
            case.open_events.push(event);
            match cancellation(case, event) {
                Some(send) => Judgement::Ask(Question::new(send)),
                None => Judgement::Wait,
            }
        }
    }
}

pub(super) fn not_on_change(case: &Case, mark: usize, stage: u8) -> Verdict {
    if stage == 0 {
        return not_created(case, mark);
    }
    Verdict::failed(
        "confirmed, but its cancellation is not answered",
        "the peer does not confirm cancellations",
        "cancel again; expect reports of cancelled events",
    )
}

/// Cancels all open events.
pub(super) fn cancel_all(case: &mut Case) -> Vec<Send> {
    let open = std::mem::take(&mut case.open_events);
    let cancel = |event| cancellation(case, event);
    open.into_iter().filter_map(cancel).collect()
}
