//! The clocks of peers: asks those that offer the Time service, in turn, and estimates their
//! offsets and drifts.

use std::collections::{BTreeMap, BTreeSet};
use std::convert::Infallible;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use tokio::task::JoinSet;
use tokio::time::{Instant, sleep};

use super::{Component, QueryOptions};
use crate::address::JausId;
use crate::messages::core::report_time::TimeStamp;
use crate::messages::core::{QueryTime, ReportTime, time};
use crate::node::time_of_day;
use crate::service::{Age, ClockEstimator, ClockOffset, Exchange};

/// The clocks of a component's peers. Cheap to clone; all clones share one state.
///
/// ```no_run
/// # use jaus::component::{Component, PeerClocks};
/// # use jaus::messages::core::report_time::TimeStamp;
/// # use jaus::messages::mobility::ReportLocalPose;
/// # async fn example(operator: Component, rover: jaus::address::JausId, pose: ReportLocalPose) {
/// let clocks = PeerClocks::default();
/// let measuring = clocks.clone();
/// let component = operator.clone();
/// tokio::spawn(async move { measuring.measure(&component).await });
/// // Later, when a report arrives:
/// if let Some(age) = pose.time_stamp.and_then(|stamp| clocks.age(rover, TimeStamp(stamp.0))) {
///     println!("{} s old, give or take {} s", age.seconds, age.uncertainty);
/// }
/// # }
/// ```
#[derive(Clone, Debug, Default)]
pub struct PeerClocks(Arc<Mutex<Table>>);

#[derive(Debug, Default)]
struct Table {
    peers: BTreeMap<JausId, PeerClock>,
    /// The peers whose ages the application has queried lately, and when.
    wanted: BTreeMap<JausId, Instant>,
}

#[derive(Debug, Default)]
struct PeerClock {
    estimator: ClockEstimator,
    /// When to ask next; at once if it was never asked.
    due: Option<Instant>,
}

impl PeerClocks {
    /// Maximum number of peers. Those whose ages are queried come first.
    pub const MOST: usize = 64;
    /// Maximum number of peers asked in one round.
    const PER_ROUND: usize = 16;
    /// Pause between two queries to one peer. Longer than an answer waits anywhere, so that none is
    /// taken for that of a later query.
    const PAUSE: Duration = Duration::from_secs(4);
    /// The same for a peer whose ages are queried: a slewed clock may be wrong by 83 ms after it.
    const WANTED_PAUSE: Duration = Duration::from_secs(1);
    /// An answer after this time may be the one to a repeated query, and another one may follow. The
    /// peer is then asked again after the long pause only.
    const PROMPT: Duration = Duration::from_millis(400);
    /// A peer whose age was not queried for this time is not wanted any more.
    const INTEREST: Duration = Duration::from_secs(10);
    /// Pause between two rounds.
    const LOOK: Duration = Duration::from_millis(200);
    /// Time to wait for an answer.
    const PATIENCE: Duration = Duration::from_secs(1);

    /// The estimate for a peer.
    #[must_use]
    pub fn offset(&self, peer: JausId) -> Option<ClockOffset> {
        self.lock().peers.get(&peer)?.estimator.offset()
    }

    /// The age of a report with this time stamp of a peer. `None` before the peer's first answer.
    /// The clocks of peers whose ages are queried are measured every second, and before others.
    ///
    /// Only the peer's own Time service counts. Another component of its node may report any time:
    /// Set Time changes the time of one component, and on a plain network any sender can claim a
    /// component id.
    #[must_use]
    pub fn age(&self, peer: JausId, stamp: TimeStamp) -> Option<Age> {
        let now = Instant::now();
        let mut table = self.lock();
        table.want(now, peer);
        let clock = table.peers.get(&peer)?;
        clock.estimator.age(stamp, now.into_std())
    }

    /// The estimates of all peers that have answered, in order of their ids.
    #[must_use]
    pub fn offsets(&self) -> Vec<(JausId, ClockOffset)> {
        let table = self.lock();
        let offset = |(&peer, it): (&JausId, &PeerClock)| Some((peer, it.estimator.offset()?));
        table.peers.iter().filter_map(offset).collect()
    }

    /// Measures the clocks of all peers for as long as it is polled.
    pub async fn measure(&self, component: &Component) -> Infallible {
        loop {
            self.round(component, providers(component)).await;
            sleep(Self::LOOK).await;
        }
    }

    /// Measures the clocks of the peers whose ages are queried, for as long as it is polled.
    pub async fn measure_wanted(&self, component: &Component) -> Infallible {
        loop {
            let mut providers = providers(component);
            providers.retain(|id| self.lock().wanted.contains_key(id));
            self.round(component, providers).await;
            sleep(Self::LOOK).await;
        }
    }

    /// Asks those of these peers whose turn it is.
    async fn round(&self, component: &Component, providers: BTreeSet<JausId>) {
        let asked = self.lock().due_peers(Instant::now(), &providers);
        let exchanges = asked.into_iter();
        let exchanges = exchanges.map(|peer| exchange(component.clone(), peer));
        let answers = exchanges.collect::<JoinSet<_>>().join_all().await;
        for answer in answers.into_iter().flatten() {
            if self.lock().handle_answer(&answer) == Some(Exchange::Stepped) {
                tracing::info!(
                    "the clock of {} was stepped, or that of this host",
                    answer.peer
                );
            }
        }
    }

    fn lock(&self) -> MutexGuard<'_, Table> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Table {
    /// Notes that the age of a report of a peer was queried. Their number is bounded.
    fn want(&mut self, now: Instant, peer: JausId) {
        if self.wanted.len() < PeerClocks::MOST || self.wanted.contains_key(&peer) {
            self.wanted.insert(peer, now);
        }
    }

    /// Forgets peers that are gone, adds new ones, and returns those whose turn it is. They are asked
    /// again after the long pause, unless they answer promptly.
    fn due_peers(&mut self, now: Instant, providers: &BTreeSet<JausId>) -> Vec<JausId> {
        self.wanted
            .retain(|_, at| now.saturating_duration_since(*at) < PeerClocks::INTEREST);
        self.peers.retain(|id, _| providers.contains(id));
        let (wanted, others): (Vec<JausId>, Vec<JausId>) = providers
            .iter()
            .partition(|id| self.wanted.contains_key(id));
        for &id in &wanted {
            self.add_wanted(id);
        }
        for &id in &others {
            if self.peers.len() < PeerClocks::MOST {
                self.peers.entry(id).or_default();
            }
        }
        let mut due: Vec<(bool, Option<Instant>, JausId)> = self
            .peers
            .iter()
            .filter(|(_, clock)| clock.due.is_none_or(|due| due <= now))
            .map(|(&id, clock)| (!self.wanted.contains_key(&id), clock.due, id))
            .collect();
        // Wanted ones first, then those that have waited longest.
        due.sort_unstable();
        due.truncate(PeerClocks::PER_ROUND);
        // With many peers, each is asked less often, so that the load stays the same.
        let turns = u32::try_from(self.peers.len().div_ceil(PeerClocks::PER_ROUND)).unwrap_or(1);
        for (is_other, _, id) in &due {
            if let Some(clock) = self.peers.get_mut(id) {
                let turns = if *is_other { turns } else { 1 };
                clock.due = Some(now + PeerClocks::PAUSE * turns);
            }
        }
        due.into_iter().map(|(_, _, id)| id).collect()
    }

    /// Adds a peer, in the place of one that is not wanted if there are too many.
    fn add_wanted(&mut self, id: JausId) {
        if self.peers.len() >= PeerClocks::MOST && !self.peers.contains_key(&id) {
            let unwanted = self.peers.keys().find(|it| !self.wanted.contains_key(it));
            let Some(unwanted) = unwanted.copied() else {
                return;
            };
            self.peers.remove(&unwanted);
        }
        self.peers.entry(id).or_default();
    }

    fn handle_answer(&mut self, answer: &Answer) -> Option<Exchange> {
        let is_wanted = self.wanted.contains_key(&answer.peer);
        let clock = self.peers.get_mut(&answer.peer)?;
        let Answer {
            sent,
            received,
            time_of_day,
            ..
        } = *answer;
        if is_wanted && received.saturating_duration_since(sent) < PeerClocks::PROMPT {
            clock.due = Some(Instant::from_std(received) + PeerClocks::WANTED_PAUSE);
        }
        let estimator = &mut clock.estimator;
        Some(estimator.handle_report(sent, received, time_of_day, &answer.report))
    }
}

/// The other components that offer the Time service.
fn providers(component: &Component) -> BTreeSet<JausId> {
    let directory = component.directory();
    let providers = directory.offering(time::URN).map(|entry| entry.id);
    providers.filter(|&id| id != component.id()).collect()
}

/// A report with the times of its exchange.
struct Answer {
    peer: JausId,
    sent: std::time::Instant,
    received: std::time::Instant,
    time_of_day: Duration,
    report: ReportTime,
}

async fn exchange(component: Component, peer: JausId) -> Option<Answer> {
    let sent = Instant::now().into_std();
    let options = QueryOptions::default().within(PeerClocks::PATIENCE);
    let answered = component.query_with(options, peer, &QueryTime::all()).await;
    let (received, time_of_day) = (Instant::now().into_std(), time_of_day());
    let report = answered.inspect_err(|error| tracing::debug!(%peer, %error, "no time"));
    Some(Answer {
        peer,
        sent,
        received,
        time_of_day,
        report: report.ok()?,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_time_of_another_component_of_its_node_says_nothing_about_a_peer() {
        let (sensor, neighbour) = (JausId::new(101, 1, 41), JausId::new(101, 1, 35));
        let clocks = PeerClocks::default();
        let now = Instant::now();
        clocks.lock().due_peers(now, &BTreeSet::from([neighbour]));
        let now = now.into_std();
        let answer = Answer {
            peer: neighbour,
            sent: now,
            received: now,
            time_of_day: time_of_day(),
            report: ReportTime {
                time_stamp: Some(TimeStamp::default()),
                ..ReportTime::default()
            },
        };
        clocks.lock().handle_answer(&answer);
        assert!(clocks.age(neighbour, TimeStamp::default()).is_some());
        assert!(clocks.age(sensor, TimeStamp::default()).is_none());
    }

    #[test]
    fn all_peers_are_asked_in_turn_and_their_number_is_bounded() {
        let many: BTreeSet<JausId> = (1..=200).map(|it| JausId::new(it, 1, 1)).collect();
        let mut table = Table::default();
        let mut asked = BTreeSet::new();
        let mut now = Instant::now();
        for _ in 0..4 {
            let due = table.due_peers(now, &many);
            assert_eq!(due.len(), PeerClocks::PER_ROUND);
            asked.extend(due);
            now += PeerClocks::LOOK;
        }
        assert_eq!(asked.len(), PeerClocks::MOST);
        assert_eq!(table.due_peers(now, &many), [], "all wait for an answer");
        let few: BTreeSet<JausId> = many.into_iter().take(3).collect();
        now += PeerClocks::PAUSE * 4;
        assert_eq!(table.due_peers(now, &few).len(), 3);
        assert_eq!(table.peers.len(), 3);
    }

    #[test]
    fn a_peer_whose_age_is_wanted_is_asked_first_and_every_second() {
        let many: BTreeSet<JausId> = (1..=200).map(|it| JausId::new(it, 1, 1)).collect();
        let sensor = JausId::new(200, 1, 1);
        let mut table = Table::default();
        let mut now = Instant::now();
        table.due_peers(now, &many);
        table.want(now, sensor);
        now += PeerClocks::LOOK;
        assert_eq!(table.due_peers(now, &many).first(), Some(&sensor));
        let received = now.into_std();
        table.handle_answer(&Answer {
            peer: sensor,
            sent: received,
            received,
            time_of_day: time_of_day(),
            report: ReportTime::default(),
        });
        now += PeerClocks::WANTED_PAUSE;
        assert_eq!(table.due_peers(now, &many).first(), Some(&sensor));
        assert!(table.peers.len() <= PeerClocks::MOST);
    }
}
