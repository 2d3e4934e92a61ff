//! The link from one driver to the next: a session, its commands, and standing down.
//!
//! Setpoints are sent without acknowledgement: a retransmission would come after newer ones, and
//! nothing on the wire tells the age of a setpoint. For the same reason none is sent whose command
//! is about to expire. Stops are delivered: sent until they are acknowledged.
//!
//! When a sensor fails, or when the next driver restarts, fails or is unreachable, the driver halts:
//! it drops its command and waits for a new one, also when the fault is gone. When the next driver
//! was stopped by an emergency or taken over, it stands down in the same way.
#![expect(
    clippy::disallowed_methods,
    reason = "gives the driver its clock and timer"
)]

use std::convert::Infallible;
use std::time::{Duration, Instant};

use tokio::sync::watch;
use tokio::time::{Interval, MissedTickBehavior, interval, sleep, timeout};

use super::remote_platform::{Order, Plan, RemotePlatform};
use super::{FaultMonitor, Watchman, lent_authority};
use crate::ground::{StageBoard, StageReport, StageState};
use crate::messages::ground::QueryStage;
use crate::mobility::Vehicle;
use crate::motion::{Fence, Motion};
use crate::parts::PartError;
use jaus::address::JausId;
use jaus::codec::Message;
use jaus::component::{
    Audience, Component, Retake, Session, SessionLoss, SessionSettings, SessionState,
};
use jaus::messages::core::QueryStatus;
use jaus::node::now;

/// The next driver counts the validity of a setpoint from its arrival. So none is sent whose own
/// command is valid for less than this: a stop is sent instead.
const LEAST_BUDGET: Duration = Duration::from_millis(200);

/// The command interface of the next driver.
pub(in crate::parts) trait Language: Send + 'static {
    /// The command message.
    type Command: Message + Send + Sync;
    /// URN of the next driver's service.
    const URN: &'static str;
    /// Name of the next driver in log messages.
    const NAME: &'static str;
    /// Interval between two commands.
    const PAUSE: Duration;

    /// The command that carries out an order.
    fn command(&mut self, now: Instant, order: Order, motion: &Motion) -> Self::Command;

    /// The command to stop.
    fn halt(&mut self) -> Self::Command;
}

/// A driver's link to the next one.
pub(in crate::parts) struct Next<L> {
    pub(in crate::parts) component: Component,
    pub(in crate::parts) vehicle: Vehicle,
    pub(in crate::parts) remote_platform: RemotePlatform,
    pub(in crate::parts) fence: Fence,
    pub(in crate::parts) board: StageBoard,
    pub(in crate::parts) language: L,
    /// The authority used to control the next driver, where the client has no less.
    pub(in crate::parts) authority: u8,
    /// After standing down, the driver accepts commands again once its clients have been silent for
    /// this time.
    pub(in crate::parts) settling: Duration,
    /// Monitors sensor faults while the vehicle should move.
    pub(in crate::parts) sensors: FaultMonitor,
}

impl<L: Language> Next<L> {
    /// How long control of the next driver is kept while there is nothing to do.
    const LINGER: Duration = Duration::from_millis(500);
    /// Timeout for the acknowledgement of a stop. A later command then replaces it.
    const PATIENCE: Duration = Duration::from_millis(400);
    /// Interval of the queries whether the next driver lives.
    const PULSE: Duration = Duration::from_millis(500);
    /// Without any answer for this time, the driver halts.
    const SILENCE: Duration = Duration::from_secs(2);

    /// Runs until the component has stopped. The owner also notices that by other means.
    pub(in crate::parts) async fn run(mut self) -> Result<Infallible, PartError> {
        let mut ticks = interval(L::PAUSE);
        ticks.set_missed_tick_behavior(MissedTickBehavior::Delay);
        let mut watchman = Watchman::default();
        let mut down: Option<Down> = None;
        loop {
            self.rest(&mut ticks, &mut watchman, down.take()).await;
            down = self.work(&mut ticks, &mut watchman).await?;
            if let Some(why) = &down {
                tracing::warn!("motion suspended: {}", why.reason());
                if self.stand_down(&mut ticks, &mut watchman, why).await {
                    down = None;
                }
            }
        }
    }

    /// Waits for an order. Reports why the driver stood down until control changes or it is
    /// resumed.
    async fn rest(
        &mut self,
        ticks: &mut Interval,
        watchman: &mut Watchman,
        mut down: Option<Down>,
    ) {
        let before = self.component.standing();
        while self.remote_platform.plan(now()) == Plan::Rest {
            let standing = self.component.standing();
            watchman.note(standing);
            if standing.controller != before.controller {
                down = None;
            }
            self.check_sensors(None).await;
            if let Some(failure) = self.sensors.failure() {
                let reason = format!("failure: {failure}");
                let next = self.component.members(self.providers()).first().copied();
                self.tell(StageState::Blocked, next, reason).await;
            } else if let Some(down) = &down {
                self.tell_down(down).await;
            } else if let Some(reason) = watchman.emergency() {
                self.tell_down(&Down::Deliberate(reason.to_owned())).await;
            } else if let Some(cause) = self.vehicle.last_stop() {
                let why = format!("stopped: {cause}");
                self.tell(StageState::Idle, None, why).await;
            } else if self.vehicle.has_arrived() {
                self.tell(StageState::Done, None, String::new()).await;
            } else {
                self.tell(StageState::Idle, None, String::new()).await;
            }
            ticks.tick().await;
        }
    }

    /// Drops commands until the client has been silent for the settling time or control changes, and
    /// as long as a sensor's fault has not become a failure. Returns whether control has changed.
    async fn stand_down(
        &mut self,
        ticks: &mut Interval,
        watchman: &mut Watchman,
        why: &Down,
    ) -> bool {
        let controller = self.component.standing().controller;
        self.vehicle.stop();
        let mut since = now();
        loop {
            let standing = self.component.standing();
            watchman.note(standing);
            if standing.controller != controller {
                return true;
            }
            let lack = match why {
                Down::Fault(_) => self.remote_platform.lack(now()),
                Down::Deliberate(_) => None,
            };
            let is_settled = now() - since >= self.settling;
            if is_settled && (lack.is_none() || self.sensors.failure().is_some()) {
                return false;
            }
            self.tell_down(why).await;
            if lack.is_some() {
                self.check_sensors(lack.as_ref().map(|lack| lack.why.as_str()))
                    .await;
            }
            ticks.tick().await;
            if self.vehicle.is_under_way() {
                self.vehicle.stop();
                since = now();
            }
        }
    }

    /// Takes control of the next driver and commands it as long as there is work. Returns the
    /// reason if the driver has to stand down.
    async fn work(
        &mut self,
        ticks: &mut Interval,
        watchman: &mut Watchman,
    ) -> Result<Option<Down>, PartError> {
        let authority = lent_authority(&self.component.standing(), self.authority);
        let settings = SessionSettings::new(authority).retake(Retake::WhenFree);
        let session = self.component.session(self.providers(), settings).await;
        let session = session.map_err(|_| PartError::NodeStopped)?;
        let component = self.component.clone();
        let answered = watch::Sender::new(now());
        let end = tokio::select! {
            end = self.command((&session, authority), &answered, ticks, watchman) => end,
            never = note_answers(&component, &session, &answered, Self::PULSE) => match never {},
            why = stood_down(&component, &session) => Some(why),
        };
        // Limit the wait, in case the next driver is gone.
        let _ = timeout(Self::PATIENCE, session.release()).await;
        Ok(end)
    }

    fn providers(&self) -> Audience {
        Audience::providers(L::URN).in_subsystem(self.component.id().subsystem())
    }

    /// Commands the next driver whenever it is ready, until there is no more work, or the client in control has
    /// another authority.
    async fn command(
        &mut self,
        (session, authority): (&Session, u8),
        answered: &watch::Sender<Instant>,
        ticks: &mut Interval,
        watchman: &mut Watchman,
    ) -> Option<Down> {
        let mut busy = now();
        let mut had_control = false;
        let mut moved_at = None;
        loop {
            let standing = self.component.standing();
            watchman.note(standing);
            if standing.controller.is_some()
                && lent_authority(&standing, self.authority) != authority
            {
                return None;
            }
            let (start, state) = (now(), session.state());
            let plan = self.remote_platform.plan(start);
            if plan != Plan::Rest {
                busy = start;
            } else if start - busy > Self::LINGER {
                return None;
            }
            if let Some(down) = down_in(state, had_control) {
                return Some(down).filter(|down| down.is_deliberate() || plan != Plan::Rest);
            }
            if let SessionState::Ready(peer) = state {
                had_control = true;
                let is_silent = start.saturating_duration_since(*answered.borrow()) > Self::SILENCE;
                if is_silent && plan != Plan::Rest {
                    let why = format!("{peer} does not answer");
                    return Some(Down::Fault(why));
                }
                if let Some(why) = fault_of(start, &plan, &mut moved_at) {
                    return Some(Down::Fault(why));
                }
                match self.carry_out(start, plan, peer).await {
                    Some(setpoint) => {
                        if let Err(error) = session.send(&setpoint) {
                            tracing::debug!(%error, "not sent");
                        }
                    }
                    None => self.halt(session).await,
                }
            } else {
                answered.send_replace(start);
                self.tell_engaging(state).await;
            }
            ticks.tick().await;
        }
    }

    /// Delivers a stop.
    async fn halt(&mut self, session: &Session) {
        let stop = self.language.halt();
        match timeout(Self::PATIENCE, session.deliver(&stop)).await {
            Ok(Ok(())) => {}
            Ok(Err(error)) => tracing::debug!(%error, "not delivered"),
            Err(_) => tracing::debug!("not acknowledged in time"),
        }
    }

    /// Reports what the driver does, and returns the setpoint for it; `None` to stop.
    async fn carry_out(&mut self, now: Instant, plan: Plan, peer: JausId) -> Option<L::Command> {
        match plan {
            Plan::Go(order, motion) => {
                self.check_sensors(None).await;
                let (state, why) = match self.fence.held() {
                    Some(why) => (StageState::Blocked, why),
                    None => (StageState::Active, String::new()),
                };
                self.tell(state, Some(peer), why).await;
                let is_valid = !self.vehicle.expires_within(now, LEAST_BUDGET);
                is_valid.then(|| self.language.command(now, order, &motion))
            }
            Plan::Wait(lack) => {
                self.check_sensors(Some(&lack.why)).await;
                self.tell(StageState::Blocked, Some(peer), lack.why).await;
                None
            }
            Plan::Rest => {
                if self.vehicle.has_arrived() {
                    self.tell(StageState::Done, None, String::new()).await;
                }
                None
            }
        }
    }

    /// A sensor fault that persists while the vehicle should move is a failure of the component,
    /// which stops and releases control. It ends when the sensors report again. The component then
    /// waits in Standby.
    async fn check_sensors(&mut self, lack: Option<&str>) {
        let now = now();
        let condition = match lack {
            Some(why) => self.sensors.lacks(now, why, FaultMonitor::LIMIT),
            None if self.sensors.failure().is_some()
                && self.remote_platform.lack(now).is_some() =>
            {
                None
            }
            None => self.sensors.is_over(),
        };
        if let Some(condition) = condition {
            _ = self.component.set_condition(condition).await;
        }
    }

    /// Reports why the next driver is not ready. Blocked without a next driver would mean standing
    /// down.
    async fn tell_engaging(&self, state: SessionState) {
        let (stage, peer, why) = match state {
            SessionState::Seeking => {
                let why = format!("no {} is known", L::NAME);
                (StageState::Engaging, None, why)
            }
            SessionState::Lost { peer, .. } | SessionState::Disabled { peer, .. } => {
                (StageState::Blocked, Some(peer), state.to_string())
            }
            SessionState::Requesting(peer) => (StageState::Engaging, Some(peer), String::new()),
            _ => (StageState::Engaging, state.held(), String::new()),
        };
        self.tell(stage, peer, why).await;
    }

    /// Reports standing down (blocked, without a next driver) or a halt.
    async fn tell_down(&self, why: &Down) {
        let state = match why {
            Down::Deliberate(_) => StageState::Blocked,
            Down::Fault(_) => StageState::Halted,
        };
        self.tell(state, None, why.reason().to_owned()).await;
    }

    async fn tell(&self, state: StageState, next: Option<JausId>, reason: String) {
        let progress = match state {
            StageState::Done => 100,
            StageState::Active | StageState::Blocked | StageState::Halted => {
                self.vehicle.progress()
            }
            StageState::Idle | StageState::Engaging => 0,
        };
        let before = self.board.report();
        let report = StageReport {
            state,
            progress,
            next,
            reason,
        };
        if before.state != state || (before.reason.is_empty() && !report.reason.is_empty()) {
            match report.reason.as_str() {
                "" => tracing::info!("{state}"),
                reason => tracing::info!("{state}: {reason}"),
            }
        }
        if self.board.tell(report) {
            _ = self.component.changed::<QueryStage>().await;
        }
    }
}

/// Why a driver has dropped its command.
#[derive(Debug, Clone, PartialEq, Eq)]
enum Down {
    /// Someone has stopped the next driver, or has taken control of it.
    Deliberate(String),
    /// Something is broken or out of reach.
    Fault(String),
}

impl Down {
    fn reason(&self) -> &str {
        match self {
            Self::Deliberate(why) | Self::Fault(why) => why,
        }
    }

    const fn is_deliberate(&self) -> bool {
        matches!(self, Self::Deliberate(_))
    }
}

/// A gap of samples up to this length is no fault: the vehicle waits, and continues.
const GAP: Duration = Duration::from_millis(500);

/// The fault that ends a command under way: a sensor that is missing for longer than [`GAP`] after
/// the vehicle could move, which `moved_at` records. Before that, the order waits.
fn fault_of(now: Instant, plan: &Plan, moved_at: &mut Option<Instant>) -> Option<String> {
    match plan {
        Plan::Rest => *moved_at = None,
        Plan::Go(..) => *moved_at = Some(now),
        Plan::Wait(lack) => {
            let since = now.saturating_duration_since((*moved_at)?);
            return (since.max(lack.lasts) >= GAP).then(|| lack.why.clone());
        }
    }
    None
}

/// Why the driver must not go on by itself in a state of the session, if so. Before it
/// `had_control`, a session waits until another client releases the next driver, and until that one
/// is well.
fn down_in(state: SessionState, had_control: bool) -> Option<Down> {
    let is_deliberate = match state {
        // A failure is a fault, if `stood_down` does not find otherwise.
        SessionState::Disabled { state, .. } => !SessionLoss::State(state).is_technical(),
        SessionState::Lost { why, .. } if why.is_opposition() => had_control,
        SessionState::Lost { why, .. } => !why.is_technical(),
        SessionState::Standby(_) => true,
        _ => false,
    };
    if is_deliberate {
        return Some(Down::Deliberate(state.to_string()));
    }
    let is_lost = matches!(
        state,
        SessionState::Disabled { .. } | SessionState::Lost { .. } | SessionState::Seeking
    );
    (is_lost && had_control).then(|| Down::Fault(state.to_string()))
}

/// Notes the times at which the next driver answers. Setpoints have no acknowledgements that would
/// tell, and a node also acknowledges for a component that hangs.
async fn note_answers(
    component: &Component,
    session: &Session,
    answered: &watch::Sender<Instant>,
    interval: Duration,
) -> Infallible {
    loop {
        sleep(interval).await;
        if let SessionState::Ready(peer) = session.state()
            && component.query(peer, &QueryStatus {}).await.is_ok()
        {
            answered.send_replace(now());
        }
    }
}

/// Interval between two queries of the next driver's stage.
const LOOK: Duration = Duration::from_millis(250);

/// Waits until the next driver reports that it has stood down or halted itself.
async fn stood_down(component: &Component, session: &Session) -> Down {
    let mut looks = 0;
    loop {
        sleep(LOOK).await;
        let (peer, is_current) = match session.state() {
            SessionState::Ready(peer) => (peer, looks >= 2),
            SessionState::Disabled { peer, .. } => (peer, true),
            SessionState::Lost {
                peer,
                why: SessionLoss::State(_),
                ..
            } => (peer, true),
            _ => {
                looks = 0;
                continue;
            }
        };
        looks += 1;
        // A stage from before the resume does not count.
        if is_current && let Ok(report) = component.query(peer, &QueryStage {}).await {
            let stage = StageReport::from(&report);
            let why = format!("{peer}: {}", stage.reason);
            if stage.stands_down() {
                return Down::Deliberate(why);
            }
            if stage.state == StageState::Halted {
                return Down::Fault(why);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::parts::drivers::remote_platform::Lack;
    use jaus::component::{ControlLost, State};

    const PEER: JausId = JausId::new(101, 2, 33);
    const OPERATOR: JausId = JausId::new(42, 1, 1);

    const fn lost(why: SessionLoss) -> SessionState {
        SessionState::Lost {
            peer: PEER,
            why,
            continues: true,
        }
    }

    fn disabled(state: State) -> SessionState {
        SessionState::Disabled {
            peer: PEER,
            state: state as u8,
        }
    }

    #[test]
    fn a_restart_or_failure_of_the_next_driver_ends_the_command() {
        for state in [
            SessionState::Seeking,
            disabled(State::Failure),
            disabled(State::Shutdown),
            lost(SessionLoss::State(State::Failure as u8)),
            lost(SessionLoss::Control(ControlLost::Restarted)),
            lost(SessionLoss::Dropped),
            lost(SessionLoss::Gone),
        ] {
            assert_eq!(down_in(state, true), Some(Down::Fault(state.to_string())));
            assert_eq!(down_in(state, false), None, "it waits until it is well");
        }
        for state in [SessionState::Ready(PEER), SessionState::Preparing(PEER)] {
            assert_eq!(down_in(state, true), None);
        }
    }

    #[test]
    #[expect(
        clippy::disallowed_methods,
        reason = "virtual time starts at any instant"
    )]
    fn a_gap_of_samples_ends_a_command_only_after_half_a_second_and_only_once_it_drives() {
        let order = Order::Heading {
            heading: 0.0,
            speed: 1.0,
        };
        let start = Instant::now();
        let lacks = |millis: u64| {
            Plan::Wait(Lack {
                why: "no pose".to_owned(),
                lasts: Duration::from_millis(millis),
            })
        };
        let mut moved_at = None;
        let later = start + 10 * GAP;
        assert_eq!(fault_of(later, &lacks(9000), &mut moved_at), None);
        let go = Plan::Go(order, Motion::default());
        assert_eq!(fault_of(later, &go, &mut moved_at), None);
        for (millis, lasts, is_fault) in [
            (40, 0, false),
            (460, 0, false),
            (500, 0, true),
            (40, 600, true),
        ] {
            let at = later + Duration::from_millis(millis);
            let fault = fault_of(at, &lacks(lasts), &mut moved_at);
            assert_eq!(fault.is_some(), is_fault, "{millis} {lasts}");
        }
        assert_eq!(fault_of(later, &Plan::Rest, &mut moved_at), None);
        assert_eq!(fault_of(later + 2 * GAP, &lacks(600), &mut moved_at), None);
    }

    #[test]
    fn it_stands_down_after_an_emergency_or_a_take_over() {
        for (state, reason) in [
            (disabled(State::Emergency), "101.2.33 reports emergency"),
            (
                lost(SessionLoss::State(State::Emergency as u8)),
                "no control of 101.2.33: it reports emergency",
            ),
            (
                lost(SessionLoss::Taken(OPERATOR)),
                "no control of 101.2.33: 42.1.1 is in control of it",
            ),
            (
                SessionState::Standby(PEER),
                "101.2.33 is under control and stands by",
            ),
        ] {
            let down = Down::Deliberate(reason.to_owned());
            assert_eq!(down_in(state, true), Some(down));
        }
    }

    #[test]
    fn it_waits_for_a_driver_that_another_client_has_from_the_beginning() {
        assert_eq!(down_in(lost(SessionLoss::Taken(OPERATOR)), false), None);
    }
}
