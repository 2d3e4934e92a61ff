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
    peers: BTreeMap<JausId, ClockEstimator>,
    /// The last peer that was asked.
    latest: Option<JausId>,
}

impl PeerClocks {
    /// Maximum number of peers.
    pub const MOST: usize = 64;
    /// Maximum number of peers asked in one round.
    const PER_ROUND: usize = 16;
    /// Pause between two rounds. Longer than an answer waits anywhere, so that none is taken for
    /// that of a later query.
    const PAUSE: Duration = Duration::from_secs(4);
    /// Pause while there are no peers.
    const LOOK: Duration = Duration::from_millis(200);
    /// Time to wait for an answer.
    const PATIENCE: Duration = Duration::from_secs(1);

    /// The estimate for a peer.
    #[must_use]
    pub fn offset(&self, peer: JausId) -> Option<ClockOffset> {
        self.lock().peers.get(&peer)?.offset()
    }

    /// The age of a report with this time stamp of a peer. `None` before the peer's first answer.
    ///
    /// Only the peer's own Time service counts. Another component of its node may report any time:
    /// Set Time changes the time of one component, and on a plain network any sender can claim a
    /// component id.
    #[must_use]
    pub fn age(&self, peer: JausId, stamp: TimeStamp) -> Option<Age> {
        self.lock().peers.get(&peer)?.age(stamp, time_of_day())
    }

    /// The estimates of all peers that have answered, in order of their ids.
    #[must_use]
    pub fn offsets(&self) -> Vec<(JausId, ClockOffset)> {
        let table = self.lock();
        let offset = |(&peer, it): (&JausId, &ClockEstimator)| Some((peer, it.offset()?));
        table.peers.iter().filter_map(offset).collect()
    }

    /// Measures for as long as it is polled.
    pub async fn measure(&self, component: &Component) -> Infallible {
        loop {
            let pause = match self.round(component).await {
                0 => Self::LOOK,
                _ => Self::PAUSE,
            };
            sleep(pause).await;
        }
    }

    /// Asks the next peers, and returns their number.
    async fn round(&self, component: &Component) -> usize {
        let providers = providers(component);
        let asked = self.lock().next_peers(&providers);
        let number = asked.len();
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
        number
    }

    fn lock(&self) -> MutexGuard<'_, Table> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Table {
    /// Forgets peers that are gone, adds new ones, and returns those whose turn it is.
    fn next_peers(&mut self, providers: &BTreeSet<JausId>) -> Vec<JausId> {
        self.peers.retain(|id, _| providers.contains(id));
        for &id in providers {
            if self.peers.len() < PeerClocks::MOST {
                self.peers.entry(id).or_default();
            }
        }
        let ids: Vec<JausId> = self.peers.keys().copied().collect();
        let begin = ids.partition_point(|&id| Some(id) <= self.latest);
        let in_turn = ids.iter().copied().cycle().skip(begin);
        let next: Vec<JausId> = in_turn.take(PeerClocks::PER_ROUND.min(ids.len())).collect();
        self.latest = next.last().copied().or(self.latest);
        next
    }

    fn handle_answer(&mut self, answer: &Answer) -> Option<Exchange> {
        let estimator = self.peers.get_mut(&answer.peer)?;
        let Answer {
            sent,
            received,
            time_of_day,
            ..
        } = *answer;
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
        clocks.lock().next_peers(&BTreeSet::from([neighbour]));
        let now = Instant::now().into_std();
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
        for _ in 0..4 {
            let next = table.next_peers(&many);
            assert_eq!(next.len(), PeerClocks::PER_ROUND);
            asked.extend(next);
        }
        assert_eq!(asked.len(), PeerClocks::MOST);
        let few: BTreeSet<JausId> = many.into_iter().take(3).collect();
        assert_eq!(table.next_peers(&few).len(), 3);
        assert_eq!(table.peers.len(), 3);
    }
}
