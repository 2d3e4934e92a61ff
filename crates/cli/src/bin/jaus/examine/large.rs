//! Large message exchanges: to the peer, with an acknowledgement per packet; and from the peer, by
//! a list of events with long queries.

use std::time::Duration;

use bytes::{BufMut, Bytes, BytesMut};
use jaus::codec::Message;
use jaus::messages::core::{
    QueryEvents, QueryServices, ReportEvents, query_events::QueryEventsVar,
};
use jaus::wire::{Acknowledgement, DataControl, Flags, Frame, Priority, large};

use super::case::{Case, OpenEvent, PADDING, Question, Send, octets};
use super::discovery::node_seq;
use super::events::{Reply, cancel_all, create, reply};
use super::exchange::{Exchange, Mark, Verdict};
use super::judgement::{Begin, Judgement};
use super::transfer::Transfer;

/// Maximum time without an acknowledgement.
const PATIENCE: Duration = Duration::from_millis(1500);

pub(super) fn to_peer(case: &mut Case, size: u32, now: Duration) -> Begin {
    if let Some(skip) = case.nobody() {
        return Begin::Over(skip);
    }
    if !case.went_well(Exchange::Acknowledgement) {
        return Begin::Over(Verdict::skipped(
            "it acknowledges nothing, so the result could not be observed",
        ));
    }
    let failed = |trial: &&super::exchange::Trial| {
        matches!(trial.exchange, Exchange::Large(_)) && trial.verdict.mark != Mark::Ok
    };
    if let Some(smaller) = case.trials.iter().find(failed) {
        let name = smaller.exchange.name();
        return Begin::Over(Verdict::skipped(format!("not tried after \"{name}\"")));
    }
    let frames = fragments(case, size as usize);
    case.transfer = Some(Transfer::new(frames, case.seen.len()));
    Begin::Ask(question(due(case, now)))
}

fn question(sends: Vec<Send>) -> Question {
    Question {
        sends,
        again: Some(Duration::from_millis(50)),
        patience: PATIENCE,
    }
}

/// The packets of a padded message, each with a request for an acknowledgement.
fn fragments(case: &mut Case, size: usize) -> Vec<Frame> {
    let Some(id) = case.id else {
        return Vec::new();
    };
    let repeats = case.repeats_code();
    let mut rest = padded(size);
    let limit = case.settings.payload_limit;
    let mut payloads = vec![rest.split_to(limit.min(size))];
    let room = if repeats {
        limit - large::CODE_LEN
    } else {
        limit
    };
    while !rest.is_empty() {
        let piece = rest.split_to(room.min(rest.len()));
        payloads.push(if repeats { with_code(&piece) } else { piece });
    }
    let last = payloads.len() - 1;
    let frames = payloads.into_iter().enumerate().map(|(number, payload)| {
        let data = match number {
            0 if last == 0 => DataControl::Single,
            0 => DataControl::First,
            number if number == last => DataControl::Last,
            _ => DataControl::Middle,
        };
        let flags = Flags::new(Priority::Standard).with_data(data);
        let frame = case.frame(id, payload);
        Frame {
            flags: flags.with_acknowledgement(Acknowledgement::Request),
            ..frame
        }
    });
    frames.collect()
}

/// A message without effect, whose octets reveal missing or misplaced parts.
fn padded(size: usize) -> Bytes {
    let mut message: Vec<u8> = (0..size).map(|at| (at * 7 + at / 251) as u8).collect();
    message[..large::CODE_LEN].copy_from_slice(&PADDING.to_le_bytes());
    message.into()
}

fn with_code(piece: &[u8]) -> Bytes {
    let mut payload = BytesMut::with_capacity(large::CODE_LEN + piece.len());
    payload.put_u16_le(PADDING);
    payload.put_slice(piece);
    payload.freeze()
}

fn due(case: &mut Case, now: Duration) -> Vec<Send> {
    let (Some(address), Some(transfer)) = (case.address, &mut case.transfer) else {
        return Vec::new();
    };
    let frames = transfer.due(now).into_iter();
    frames.map(|frame| Send::To(address, frame)).collect()
}

/// The fragments to retransmit.
pub(super) fn again(case: &mut Case, now: Duration) -> Vec<Send> {
    due(case, now)
}

pub(super) fn acknowledged(case: &mut Case, size: u32, mark: usize, now: Duration) -> Judgement {
    let answers: Vec<u16> = case
        .received(mark)
        .filter(|heard| heard.frame.flags.acknowledgement() == Acknowledgement::Positive)
        .map(|heard| heard.frame.sequence)
        .collect();
    let done = |transfer: &Transfer| transfer.done() == transfer.parts.len();
    if case.transfer.as_ref().is_some_and(done) {
        return match is_back(case, size) {
            true => Judgement::Over(came_whole(case, size)),
            false => Judgement::Wait,
        };
    }
    let Some(transfer) = &mut case.transfer else {
        return Judgement::Wait;
    };
    let before = transfer.done();
    answers
        .into_iter()
        .for_each(|sequence| transfer.take(sequence));
    let (done, all) = (transfer.done(), transfer.parts.len());
    if done == before {
        return Judgement::Wait;
    }
    if done < all {
        return Judgement::Ask(question(due(case, now)));
    }
    // A program at the peer may echo messages, and may have done so already.
    if is_back(case, size) {
        return Judgement::Over(came_whole(case, size));
    }
    let patience = match (whole(size, case), case.echoes) {
        (true, _) => ECHO,
        (false, true) => LONG_ECHO,
        (false, false) => return Judgement::Over(arrived(case, size)),
    };
    Judgement::Ask(Question::silence(patience))
}

/// Timeout of a short echo and of a large one.
const ECHO: Duration = Duration::from_millis(200);
const LONG_ECHO: Duration = Duration::from_secs(2);

/// Whether a message of that size fits one packet.
fn whole(size: u32, case: &Case) -> bool {
    size as usize <= case.settings.payload_limit
}

/// Whether the message has been echoed since its start.
fn is_back(case: &Case, size: u32) -> bool {
    let mark = case.transfer.as_ref().map_or(0, |transfer| transfer.since);
    let message = padded(size as usize);
    let mut single = case
        .received(mark)
        .filter(|heard| heard.code() == Some(PADDING));
    let large = || case.id.and_then(|id| case.seen.large_from(id, mark));
    single.any(|heard| heard.frame.payload == message)
        || large().is_some_and(|(whole, _, _)| whole == message)
}

fn arrived(case: &mut Case, size: u32) -> Verdict {
    let parts = case
        .transfer
        .take()
        .map_or(0, |transfer| transfer.parts.len());
    Verdict::ok(match parts {
        1 => format!("{size} octets in one packet, acknowledged"),
        _ => format!("{size} octets in {parts} fragments, each acknowledged"),
    })
}

/// The echo has arrived completely.
fn came_whole(case: &mut Case, size: u32) -> Verdict {
    case.echoes = true;
    let mut verdict = arrived(case, size);
    verdict.what.push_str(", and echoed completely");
    verdict
}

pub(super) fn unacknowledged(case: &mut Case, size: u32) -> Verdict {
    let count = |transfer: &Transfer| (transfer.done(), transfer.parts.len());
    let (done, all) = case.transfer.as_ref().map_or((0, 0), count);
    if done == all && !(case.echoes && all > 1) {
        return arrived(case, size);
    }
    case.transfer = None;
    if done == all {
        return Verdict::failed(
            format!(
                "all {all} fragments of {size} octets are acknowledged, but the message is lost"
            ),
            "the peer discards the first fragments before the last arrive: Junior keeps \
             MaxMsgHistory of them, by default 50",
            "set payload_limit = 4079 on our side for fewer fragments, or raise MaxMsgHistory \
             there",
        );
    }
    if whole(size, case) {
        return Verdict::failed(
            format!("a message of {size} octets is not acknowledged, but a short one is"),
            "the network drops packets of that size: an MTU below 1500 without fragmentation \
             (VPN, tunnel), or a firewall that drops IP fragments",
            "find the limit with `ping -M do -s 1400 ADDRESS` and set payload_limit below it",
        );
    }
    Verdict::failed(
        format!("{done} of {all} fragments were acknowledged, then no more"),
        "the peer does not accept messages of that size, or no fragments at all, or its receive \
         buffer is too small for several at a time (Junior's MaxBufferSize)",
        "keep messages to it below the last size that passed; enlarge its buffers",
    )
}

/// Number of events that make a list of several fragments on any peer.
const EVENTS: u8 = 5;
/// The first of their request ids.
const FIRST: u8 = 16;

/// Four nodes with 220 components each: 891 octets, a long but valid query.
fn long_query(which: u8) -> Bytes {
    let components: Vec<u8> = (1..=220).collect();
    let node = |node| node_seq(node, components.clone());
    let first = 100 + 4 * which;
    octets(&QueryServices {
        node_list: (first..first + 4).map(node).collect(),
    })
}

/// JAUS has no echo (although a test program at the peer may provide one), but a list of events
/// repeats their queries.
pub(super) fn from_peer(case: &mut Case) -> Begin {
    if let Some(verdict) = echoed(case) {
        return Begin::Over(verdict);
    }
    if let Some(skip) = case.nobody().or_else(|| case.lacks("Events")) {
        return Begin::Over(skip);
    }
    if !case.went_well(Exchange::EventOnChange) {
        return Begin::Over(Verdict::skipped(
            "no large message can be provoked: it has no events on change",
        ));
    }
    let mut sends = Vec::new();
    for number in 0..EVENTS {
        let create = create(FIRST + number, long_query(number), false);
        sends.extend(case.ask_peer(&create));
    }
    Begin::Ask(Question {
        sends,
        ..Question::silence(Duration::from_millis(1500))
    })
}

fn echoed(case: &Case) -> Option<Verdict> {
    let (message, fragments, _) = case.seen.large_from(case.id?, 0)?;
    let length = message.len();
    (message == padded(length))
        .then(|| Verdict::ok(format!("{length} octets echoed in {fragments} fragments")))
}

pub(super) fn came_back(case: &mut Case, mark: usize, stage: u8) -> Judgement {
    if stage == 0 {
        return subscribed(case, mark);
    }
    let Some(id) = case.id else {
        return Judgement::Wait;
    };
    let whole = case.received(mark).find(|heard| {
        heard.code() == Some(ReportEvents::CODE)
            && ReportEvents::decode(&heard.frame.payload).is_ok()
    });
    let verdict = if let Some(heard) = whole {
        let length = heard.frame.payload.len();
        Verdict::ok(format!("{length} octets in one packet"))
    } else if let Some((message, fragments, repeats)) = case.seen.large_from(id, mark) {
        judge_large(&message, fragments, repeats)
    } else {
        return Judgement::Wait;
    };
    let cancels = cancel_all(case);
    case.unsent.extend(cancels);
    Judgement::Over(verdict)
}

fn judge_large(message: &Bytes, fragments: usize, repeats: bool) -> Verdict {
    let length = message.len();
    let style = if repeats { ", the code in each" } else { "" };
    match ReportEvents::decode(message) {
        Ok(_) => Verdict::ok(format!("{length} octets in {fragments} fragments{style}")),
        Err(error) => Verdict::failed(
            format!(
                "{fragments} fragments reassemble to {length} octets that cannot be decoded: \
                {error}"
            ),
            "the peer fragments large messages in a non-standard way",
            "keep its reports short: query less at a time",
        ),
    }
}

/// Waits until all are confirmed, then queries the list.
fn subscribed(case: &mut Case, mark: usize) -> Judgement {
    let mut confirmed = Vec::new();
    for number in FIRST..FIRST + EVENTS {
        match reply(case, mark, number) {
            Some(Reply::Confirmed(confirm)) => confirmed.push(confirm.event_id),
            Some(Reply::Rejected(_)) => {
                note(case, &confirmed);
                let cancels = cancel_all(case);
                case.unsent.extend(cancels);
                return Judgement::Over(Verdict::skipped(
                    "no large message can be provoked: it has no events of Query Services",
                ));
            }
            None => return Judgement::Wait,
        }
    }
    note(case, &confirmed);
    let query = QueryEvents {
        query_events_var: QueryEventsVar::AllEventsRec(Default::default()),
    };
    match case.ask_peer(&query) {
        Some(send) => Judgement::Ask(Question::new(send)),
        None => Judgement::Wait,
    }
}

fn note(case: &mut Case, confirmed: &[u8]) {
    let events = confirmed.iter().map(|&id| OpenEvent { id });
    case.open_events.extend(events);
}

pub(super) fn not_back(case: &mut Case, mark: usize, stage: u8) -> Verdict {
    if stage == 0 {
        let cancels = cancel_all(case);
        case.unsent.extend(cancels);
        return Verdict::skipped(
            "no large message can be provoked: it does not answer long events",
        );
    }
    let fragments = case
        .received(mark)
        .filter(|heard| heard.frame.flags.data() != DataControl::Single);
    let fragments = fragments.count();
    let cancels = cancel_all(case);
    case.unsent.extend(cancels);
    if fragments == 0 {
        return Verdict::skipped(
            "no large message can be provoked: it does not answer Query Events",
        );
    }
    Verdict::failed(
        format!("{fragments} fragments arrived, but the message is incomplete"),
        "fragments are lost (buffers, or a firewall that drops IP fragments), or the last one is \
         not marked as such (JAUS++, at exact multiples of its fragment size)",
        "keep its reports short: query less at a time",
    )
}
