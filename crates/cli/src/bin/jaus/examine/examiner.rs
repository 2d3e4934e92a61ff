//! Runs an examination: sends, evaluates and records one exchange after the other. Driven by
//! datagrams and time; it has no sockets and no clock.

use std::net::SocketAddr;
use std::time::Duration;

use super::case::{Case, Question, Send, Settings};
use super::exchange::{Exchange, Trial, Verdict};
use super::judgement::{Begin, Judgement};
use super::seen::{Arrival, Refusal, TcpAnswer};
use super::silence::CLOSED_PORT;
use super::{discovery, events, large, manners, ra, reach, reserved, silence, standing};

/// An active exchange.
struct Running {
    exchange: Exchange,
    began: Duration,
    /// Number of messages received before its query.
    mark: usize,
    /// Index of its query.
    stage: u8,
    question: Question,
    next: Option<Duration>,
    deadline: Duration,
}

/// One examination.
pub(super) struct Examiner {
    case: Case,
    plan: std::array::IntoIter<Exchange, 33>,
    running: Option<Running>,
    /// Number of trials returned so far.
    returned: usize,
    done: bool,
}

impl Examiner {
    pub(super) fn new(settings: Settings) -> Self {
        Self {
            case: Case::new(settings),
            plan: Exchange::ALL.into_iter(),
            running: None,
            returned: 0,
            done: false,
        }
    }

    /// Sends the first query. `now` is the time since the examination began.
    pub(super) fn start(&mut self, now: Duration) {
        self.go_on(now);
    }

    pub(super) fn handle_arrival(&mut self, now: Duration, arrival: &Arrival) {
        let count = self.case.seen.take(now, arrival);
        let first = self.case.seen.len() - count;
        for heard in self.case.seen.since(first).to_vec() {
            let answer = self.case.acknowledge(&heard);
            self.case.unsent.extend(answer);
        }
        self.judge(now);
    }

    /// Handles a refusal: the system reports that the port or host of an address is unreachable.
    pub(super) fn handle_refusal(&mut self, now: Duration, address: SocketAddr, refusal: Refusal) {
        let seen = &mut self.case.seen;
        if address.port() == CLOSED_PORT {
            seen.closed_port_refused |= refusal == Refusal::Port;
        } else {
            seen.refused.get_or_insert(refusal);
        }
        self.judge(now);
    }

    pub(super) fn handle_tcp(&mut self, now: Duration, answer: TcpAnswer) {
        self.case.seen.tcp = Some(answer);
        self.judge(now);
    }

    pub(super) fn handle_timeout(&mut self, now: Duration) {
        let Some(running) = &mut self.running else {
            return;
        };
        if now >= running.deadline {
            let (exchange, mark, stage) = (running.exchange, running.mark, running.stage);
            let judgement = at_the_end(exchange, &mut self.case, mark, stage);
            self.carry_on(now, judgement);
        } else if running.next.is_some_and(|next| now >= next) {
            running.next = running.question.again.map(|again| now + again);
            let sends = match running.exchange {
                Exchange::Large(_) => large::again(&mut self.case, now),
                _ => self.case.anew(&running.question.sends),
            };
            self.case.unsent.extend(sends);
        }
    }

    /// When to call [`handle_timeout`](Self::handle_timeout).
    pub(super) fn poll_timeout(&self) -> Option<Duration> {
        let running = self.running.as_ref()?;
        let next = running.next.unwrap_or(running.deadline);
        Some(next.min(running.deadline))
    }

    pub(super) fn poll_send(&mut self) -> Option<Send> {
        self.case.unsent.pop_front()
    }

    /// The next completed exchange, and the one before it.
    pub(super) fn poll_trial(&mut self) -> Option<(&Trial, Option<&Trial>)> {
        let trial = self.case.trials.get(self.returned)?;
        let before = self.returned.checked_sub(1);
        self.returned += 1;
        Some((
            trial,
            before.and_then(|before| self.case.trials.get(before)),
        ))
    }

    /// Whether all exchanges are complete.
    pub(super) const fn is_done(&self) -> bool {
        self.done
    }

    pub(super) const fn case(&self) -> &Case {
        &self.case
    }

    /// Releases everything held at the peer, for an early end.
    pub(super) fn leave(&mut self) {
        let mut sends = events::cancel_all(&mut self.case);
        sends.extend(standing::release(&mut self.case));
        self.case.unsent.extend(sends);
    }

    /// Starts exchanges until one has to wait.
    fn go_on(&mut self, now: Duration) {
        while self.running.is_none() {
            let Some(exchange) = self.plan.next() else {
                self.done = true;
                return;
            };
            let mark = self.case.seen.len();
            let running = |question: Question| Running {
                exchange,
                began: now,
                mark,
                stage: 0,
                next: question.again.map(|again| now + again),
                deadline: now + question.patience,
                question,
            };
            match begin(exchange, &mut self.case, now) {
                Begin::Ask(question) => {
                    self.case.unsent.extend(question.sends.iter().cloned());
                    self.running = Some(running(question));
                }
                Begin::Over(verdict) => {
                    self.running = Some(running(Question::silence(Duration::ZERO)));
                    self.close(now, verdict);
                }
            }
        }
    }

    /// Checks whether the received messages decide the exchange.
    fn judge(&mut self, now: Duration) {
        let Some(running) = &self.running else {
            return;
        };
        let (exchange, mark, stage) = (running.exchange, running.mark, running.stage);
        let judgement = judge(exchange, &mut self.case, mark, stage, now);
        self.carry_on(now, judgement);
    }

    fn carry_on(&mut self, now: Duration, judgement: Judgement) {
        match judgement {
            Judgement::Wait => {}
            Judgement::Ask(question) => {
                let Some(running) = &mut self.running else {
                    return;
                };
                self.case.unsent.extend(question.sends.iter().cloned());
                running.mark = self.case.seen.len();
                running.stage = running.stage.saturating_add(1);
                running.next = question.again.map(|again| now + again);
                running.deadline = now + question.patience;
                running.question = question;
            }
            Judgement::Over(verdict) => {
                self.close(now, verdict);
                self.go_on(now);
            }
        }
    }

    fn close(&mut self, now: Duration, verdict: Verdict) {
        if let Some(running) = self.running.take() {
            self.case.trials.push(Trial {
                exchange: running.exchange,
                verdict,
                took: now.saturating_sub(running.began),
            });
        }
    }
}

fn begin(exchange: Exchange, case: &mut Case, now: Duration) -> Begin {
    if case.settings.is_secure && exchange.is_about_sockets() {
        return Begin::Over(Verdict::skipped("it is reached by a secure link"));
    }
    match exchange {
        Exchange::Find => reach::find(case),
        Exchange::Reach => reach::reach(case),
        Exchange::Answer => reach::answer(case),
        Exchange::Framing => reach::framing(case),
        Exchange::SourcePort => reach::source_port(case),
        Exchange::Identification => discovery::identification(case),
        Exchange::Multicast => discovery::multicast(case),
        Exchange::MulticastBack => discovery::multicast_back(case, now),
        Exchange::Heartbeat => standing::heartbeat(case),
        Exchange::Acknowledgement => standing::acknowledgement(case),
        Exchange::Configuration => discovery::configuration(case),
        Exchange::ServicesWildcard | Exchange::ServicesNamed | Exchange::ServicesAll => {
            discovery::services(case, exchange)
        }
        Exchange::Authority => standing::authority(case),
        Exchange::Status => standing::status(case),
        Exchange::Control => standing::control(case),
        Exchange::TakeControl => standing::take_control(case),
        Exchange::EventPeriodic => events::periodic(case),
        Exchange::EventArrives => events::arrival(case),
        Exchange::EventCancel => events::cancel(case),
        Exchange::EventOnChange => events::on_change(case),
        Exchange::Large(octets) => large::to_peer(case, octets, now),
        Exchange::LargeBack => large::from_peer(case),
        Exchange::Tcp => manners::tcp(case),
        Exchange::Rate => manners::rate(case),
        Exchange::Reserved => reserved::begin(case),
        Exchange::Sequence => Begin::Over(manners::sequence(case)),
        Exchange::Stacks => Begin::Over(manners::stacks(case)),
        Exchange::Ids => Begin::Over(manners::ids(case)),
    }
}

fn judge(exchange: Exchange, case: &mut Case, mark: usize, stage: u8, now: Duration) -> Judgement {
    match exchange {
        Exchange::Find => reach::found(case),
        Exchange::Reach => reach::reached(case, stage),
        Exchange::Answer => reach::answered(case, mark),
        Exchange::Framing => ra::named(case),
        Exchange::SourcePort => reach::asked_at_its_source(case, mark),
        Exchange::Identification => discovery::identified(case, mark),
        Exchange::Multicast => discovery::multicast_answered(case, mark),
        Exchange::MulticastBack => discovery::heard_by_multicast(case),
        Exchange::Heartbeat => standing::beats(case, mark),
        Exchange::Acknowledgement => standing::acknowledged(case, mark),
        Exchange::Configuration => discovery::configured(case, mark),
        Exchange::ServicesWildcard | Exchange::ServicesNamed | Exchange::ServicesAll => {
            discovery::serves(case, exchange, mark, stage)
        }
        Exchange::Authority => standing::has_authority(case, mark),
        Exchange::Status => standing::has_status(case, mark),
        Exchange::Control => standing::is_controlled(case, mark),
        Exchange::TakeControl => standing::taking_control(case, mark, stage),
        Exchange::EventPeriodic => events::created(case, mark),
        Exchange::EventArrives => events::arrived(case, mark),
        Exchange::EventCancel => events::cancelled(case, mark, stage),
        Exchange::EventOnChange => events::changes(case, mark, stage),
        Exchange::Large(octets) => large::acknowledged(case, octets, mark, now),
        Exchange::LargeBack => large::came_back(case, mark, stage),
        Exchange::Tcp => manners::tcp_answered(case),
        Exchange::Rate => manners::all_answered(case, mark),
        Exchange::Reserved => reserved::acknowledged(case, mark, stage),
        Exchange::Sequence | Exchange::Stacks | Exchange::Ids => Judgement::Wait,
    }
}

/// The judgement after the timeout of an answer.
fn at_the_end(exchange: Exchange, case: &mut Case, mark: usize, stage: u8) -> Judgement {
    Judgement::Over(match exchange {
        Exchange::Answer => return silence::unanswered(case),
        Exchange::Multicast if !case.multicast_asked => {
            return Judgement::Ask(discovery::ask_by_multicast(case));
        }
        Exchange::Find => reach::not_found(case),
        Exchange::Reach => silence::not_refused(case, stage),
        Exchange::Framing => match case.address {
            Some(address) => ra::verdict(case, address, None),
            None => Verdict::skipped("its address is not known"),
        },
        Exchange::SourcePort => reach::deaf_source(case),
        Exchange::Identification => discovery::not_identified(case, mark),
        Exchange::Multicast => discovery::multicast_unanswered(case),
        Exchange::MulticastBack => discovery::nothing_by_multicast(case),
        Exchange::Heartbeat => standing::no_heartbeat(case),
        Exchange::Acknowledgement => standing::not_acknowledged(case),
        Exchange::Configuration => discovery::not_configured(case, mark),
        Exchange::ServicesWildcard | Exchange::ServicesNamed | Exchange::ServicesAll => {
            discovery::all_listed(case, exchange, mark, stage)
        }
        Exchange::Authority => standing::silent(case, "Query Authority", "AccessControl"),
        Exchange::Status => standing::silent(case, "Query Status", "Management"),
        Exchange::Control => standing::silent(case, "Query Control", "AccessControl"),
        Exchange::TakeControl => standing::control_unanswered(case, stage),
        Exchange::EventPeriodic => events::not_created(case, mark),
        Exchange::EventArrives => events::not_arrived(case, mark),
        Exchange::EventCancel => events::after_cancel(case, mark, stage),
        Exchange::EventOnChange => events::not_on_change(case, mark, stage),
        Exchange::Large(octets) => large::unacknowledged(case, octets),
        Exchange::LargeBack => large::not_back(case, mark, stage),
        Exchange::Tcp => manners::tcp_silent(case),
        Exchange::Rate => manners::some_answered(case, mark),
        Exchange::Reserved => reserved::over(case, mark, stage),
        Exchange::Sequence | Exchange::Stacks | Exchange::Ids => Verdict::skipped("query not sent"),
    })
}
