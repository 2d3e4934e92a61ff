//! Queries whose answers come late, in another order, or not.

use super::*;
use crate::codec::Message;
use crate::messages::core::{QueryElement, ReportElement};

const US: JausId = JausId::new(101, 1, 1);
const PEER: JausId = JausId::new(102, 1, 1);

#[test]
fn a_question_too_many_fails_at_once_and_the_others_take_their_turns() {
    let (mut inquiries, now) = (Inquiries::default(), Instant::now());
    let mut out = Outbox::new(US);
    let ask = |inquiries: &mut Inquiries, out: &mut Outbox| {
        let options = QueryOptions::default();
        inquiries.ask(now, PEER, Question::new(Bytes::new(), 0x4202), options, out)
    };
    for _ in 0..Inquiries::MOST {
        ask(&mut inquiries, &mut out);
    }
    assert!(inquiries.poll_failure().is_none());
    let last = ask(&mut inquiries, &mut out);
    let failed = inquiries.poll_failure().map(|(inquiry, _)| inquiry);
    assert_eq!(failed, Some(last));
    assert!(out.pop().is_some() && out.pop().is_none(), "one at a time");
    inquiries.cancel(now, Inquiry(2), &mut out);
    inquiries.cancel(now, Inquiry(1), &mut out);
    assert!(
        out.pop().is_none(),
        "the answer to the first may still come"
    );
    inquiries.handle_timeout(now + Patience::default().interval, &mut out);
    assert!(out.pop().is_some() && out.pop().is_none(), "the third");
    assert_eq!(inquiries.waiting.len(), Inquiries::MOST - 2);
}

/// A peer that answers each query after this time.
struct Peer {
    takes: Duration,
    /// When each answer arrives.
    answers: VecDeque<(Instant, Bytes)>,
}

impl Peer {
    fn new(milliseconds: u64) -> Self {
        let takes = Duration::from_millis(milliseconds);
        let answers = VecDeque::new();
        Self { takes, answers }
    }

    /// Answers a query by its own octets, with the code of the report.
    fn hear(&mut self, now: Instant, out: &mut Outbox) {
        while let Some(query) = out.pop() {
            let answer = [&REPORT.to_le_bytes()[..], &query.payload[2..]].concat();
            self.answers.push_back((now + self.takes, answer.into()));
        }
    }
}

const QUERY: u16 = 0xD1F0;
const REPORT: u16 = 0xD1F1;
/// One octet behind the code.
const ECHO: &[Echo] = &[Echo {
    query: 2,
    report: 2,
    octets: 1,
}];

fn question(number: u8, echoes: &'static [Echo]) -> Question {
    let [low, high] = QUERY.to_le_bytes();
    Question::new(Bytes::from(vec![low, high, number]), REPORT).echoing(echoes)
}

fn from_peer(payload: Bytes) -> Received {
    Received {
        source: PEER,
        destination: US,
        to: US,
        priority: Priority::Standard,
        broadcast: crate::wire::Broadcast::None,
        sequence: None,
        payload,
        path: None,
        acknowledged: false,
    }
}

/// Asks these numbers, and returns the answer to each, and the time that all took.
fn run(
    peer: &mut Peer,
    asked: &[u8],
    options: QueryOptions,
    echoes: &'static [Echo],
) -> (BTreeMap<u64, Result<u8, NoAnswer>>, Duration) {
    let (mut inquiries, start) = (Inquiries::default(), Instant::now());
    let (mut out, mut now, mut answers) = (Outbox::new(US), start, BTreeMap::new());
    for &number in asked {
        inquiries.ask(now, PEER, question(number, echoes), options, &mut out);
    }
    let mut last = start;
    loop {
        peer.hear(now, &mut out);
        while let Some((Inquiry(number), ended)) = inquiries.poll_failure() {
            answers.insert(number, Err(ended));
            last = now;
        }
        let arrives = peer.answers.front().map(|it| it.0);
        let due = inquiries.poll_timeout();
        let Some(next) = arrives.into_iter().chain(due).min() else {
            return (answers, last - start);
        };
        now = next.max(now);
        if arrives == Some(now) {
            let Some((_, payload)) = peer.answers.pop_front() else {
                continue;
            };
            let message = from_peer(payload.clone());
            if let Some(Inquiry(number)) = inquiries.handle_message(now, &message, &mut out) {
                answers.insert(number, Ok(payload[2]));
                last = now;
            }
        }
        inquiries.handle_timeout(now, &mut out);
    }
}

#[test]
fn each_answer_of_a_slow_peer_belongs_to_its_query() {
    let asked: Vec<u8> = (1..=8).collect();
    for takes in [10, 600, 1100, 1400] {
        for echoes in [&[][..], ECHO] {
            let options = QueryOptions::default().within(Duration::from_secs(3));
            let (answers, _) = run(&mut Peer::new(takes), &asked, options, echoes);
            let answers: Vec<_> = answers.into_values().collect();
            let expected: Vec<_> = asked.iter().map(|it| Ok(*it)).collect();
            assert_eq!(answers, expected, "{takes} ms, {} echoes", echoes.len());
        }
    }
}

#[test]
fn many_queries_that_tell_their_answers_apart_do_not_wait_for_those_that_are_owed() {
    let asked: Vec<u8> = (0..=254).collect();
    let options = QueryOptions::default().within(Duration::from_secs(3));
    let (answers, took) = run(&mut Peer::new(600), &asked, options, ECHO);
    let right = answers.values().zip(&asked);
    assert_eq!(right.filter(|(it, asked)| **it == Ok(**asked)).count(), 255);
    assert!(took < Duration::from_secs(155), "{took:?}");
}

#[test]
fn the_answer_to_a_cancelled_query_is_not_that_of_the_next() {
    let (mut inquiries, start) = (Inquiries::default(), Instant::now());
    let (mut out, options) = (Outbox::new(US), QueryOptions::default());
    let first = inquiries.ask(start, PEER, question(1, &[]), options, &mut out);
    inquiries.ask(start, PEER, question(2, &[]), options, &mut out);
    assert!(out.pop().is_some());
    inquiries.cancel(start, first, &mut out);
    assert!(out.pop().is_none(), "an answer is owed");
    let at = start + Duration::from_millis(100);
    let late = from_peer(Bytes::from_static(&[0xF1, 0xD1, 1]));
    assert_eq!(inquiries.handle_message(at, &late, &mut out), None);
    let second = out.pop().unwrap();
    assert_eq!(second.payload[2], 2);
    // If it is lost, the next one waits no longer than the peer would be given.
    let (mut inquiries, mut out) = (Inquiries::default(), Outbox::new(US));
    let first = inquiries.ask(start, PEER, question(1, &[]), options, &mut out);
    inquiries.ask(start, PEER, question(2, &[]), options, &mut out);
    inquiries.cancel(start, first, &mut out);
    out.pop().unwrap();
    let due = inquiries.poll_timeout().unwrap();
    assert_eq!(due, start + Duration::from_millis(500));
    inquiries.handle_timeout(due, &mut out);
    assert_eq!(out.pop().unwrap().payload[2], 2);
}

#[test]
fn the_patience_of_a_query_holds_for_that_query_alone() {
    let (mut inquiries, start) = (Inquiries::default(), Instant::now());
    let mut out = Outbox::new(US);
    let (usual, patient) = (QueryOptions::default(), QueryOptions::default());
    let patient = patient.within(Duration::from_secs(5));
    for (report, options) in [(0x4202, usual), (0x4203, patient), (0x4204, usual)] {
        inquiries.ask(
            start,
            PEER,
            Question::new(Bytes::new(), report),
            options,
            &mut out,
        );
    }
    let mut ends = Vec::new();
    while let Some(now) = inquiries.poll_timeout() {
        inquiries.handle_timeout(now, &mut out);
        while let Some((Inquiry(number), failure)) = inquiries.poll_failure() {
            ends.push((number, failure.tries, failure.waited.as_millis()));
        }
    }
    assert_eq!(ends, [(1, 3, 1500), (3, 3, 1500), (2, 10, 5000)]);
}

#[test]
fn a_query_is_not_repeated_while_parts_of_a_large_report_arrive() {
    let (mut inquiries, start) = (Inquiries::default(), Instant::now());
    let mut out = Outbox::new(US);
    let options = QueryOptions::default()
        .within(Duration::from_secs(1))
        .priority(Priority::High);
    inquiries.ask(
        start,
        PEER,
        Question::new(Bytes::new(), 0x4202),
        options,
        &mut out,
    );
    assert_eq!(out.pop().map(|it| it.priority), Some(Priority::High));
    let at = |milliseconds| start + Duration::from_millis(milliseconds);
    // Parts arrive for 4 s.
    for milliseconds in (100..=4000).step_by(100) {
        let now = at(milliseconds);
        for peer in inquiries.overdue(now).collect::<Vec<_>>() {
            assert_eq!(peer, PEER);
            inquiries.handle_progress(now, peer, at(milliseconds - 50));
        }
        inquiries.handle_timeout(now, &mut out);
        assert!(out.pop().is_none(), "{milliseconds} ms");
    }
    // Then they stop.
    for (milliseconds, is_sent, has_failed) in [
        (4400, false, false),
        (4500, true, false),
        (5000, false, true),
    ] {
        inquiries.handle_progress(at(milliseconds), PEER, at(3950));
        inquiries.handle_timeout(at(milliseconds), &mut out);
        assert_eq!(out.pop().is_some(), is_sent, "{milliseconds} ms");
        assert_eq!(
            inquiries.poll_failure().is_some(),
            has_failed,
            "{milliseconds} ms"
        );
    }
}

#[test]
fn the_late_answer_to_a_query_to_all_is_not_that_of_one_to_a_component() {
    let (mut inquiries, start) = (Inquiries::default(), Instant::now());
    let (mut out, options) = (Outbox::new(US), QueryOptions::default());
    let all = inquiries.ask(start, JausId::EVERYONE, question(1, &[]), options, &mut out);
    let one = inquiries.ask(start, PEER, question(2, &[]), options, &mut out);
    assert_eq!(out.pop().map(|it| it.payload[2]), Some(1));
    assert!(out.pop().is_none(), "the peer may answer both");
    let from_other = Received {
        source: JausId::new(3, 1, 1),
        ..from_peer(Bytes::from_static(&[0xF1, 0xD1, 1]))
    };
    let hear = |inquiries: &mut Inquiries, message: &Received, out: &mut Outbox| {
        inquiries.handle_message(start, message, out)
    };
    assert_eq!(hear(&mut inquiries, &from_other, &mut out), Some(all));
    let late = from_peer(Bytes::from_static(&[0xF1, 0xD1, 1]));
    assert_eq!(hear(&mut inquiries, &late, &mut out), None);
    let due = inquiries.poll_timeout().unwrap();
    inquiries.handle_timeout(due, &mut out);
    assert_eq!(out.pop().map(|it| it.payload[2]), Some(2));
    let right = from_peer(Bytes::from_static(&[0xF1, 0xD1, 2]));
    assert_eq!(hear(&mut inquiries, &right, &mut out), Some(one));
}

#[test]
fn a_report_about_another_element_is_no_answer() {
    let query = QueryElement { element_uid: 7 }.encode().unwrap();
    let asked = Question::new(query, ReportElement::CODE);
    let report = |uid: u16| {
        let [code, uid] = [ReportElement::CODE, uid].map(u16::to_le_bytes);
        [code, uid, [0; 2]].concat()
    };
    assert!(asked.agrees(&report(7)) && !asked.agrees(&report(8)));
}
