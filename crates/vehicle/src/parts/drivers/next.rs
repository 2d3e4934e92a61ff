//! The link from one driver to the next: discovery, control, resume, commands, supervision and
//! release.
//!
//! Commands are acknowledged one at a time. While one is in flight, later ones wait, and only the
//! latest is sent. When the next driver restarts or is briefly unreachable, the link is
//! re-established. When it was stopped by an emergency or taken over, the driver stands down: it
//! drops its command and waits for a new one.
#![expect(
    clippy::disallowed_methods,
    reason = "gives the driver its clock and timer"
)]

use std::convert::Infallible;
use std::time::{Duration, Instant};

use tokio::time::{Interval, MissedTickBehavior, interval, sleep, timeout};

use super::remote_platform::{Order, Plan, RemotePlatform};
use super::verdict::{DriverStatus, Verdict, judge};
use super::{FaultMonitor, Watchman};
use crate::ground::{StageBoard, StageReport, StageState};
use crate::messages::ground::QueryStage;
use crate::mobility::Vehicle;
use crate::motion::Motion;
use crate::parts::PartError;
use jaus::address::JausId;
use jaus::codec::Message;
use jaus::component::{
    Audience, Component, Control, ControlError, ControlRefused, ManageError, QueryError, State,
};
use jaus::messages::core::{QueryControl, QueryStatus};

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
    pub(in crate::parts) board: StageBoard,
    pub(in crate::parts) language: L,
    /// The authority used to control the next driver.
    pub(in crate::parts) authority: u8,
    /// After standing down, the driver accepts commands again once its clients have been silent for
    /// this time.
    pub(in crate::parts) settling: Duration,
    /// Monitors sensor faults while the vehicle should move.
    pub(in crate::parts) sensors: FaultMonitor,
}

/// How a link to the next driver ended.
enum End {
    /// Nothing left to do.
    Rest,
    /// The link can be re-established.
    Anew { peer: Option<JausId>, why: String },
    /// The stop was intentional.
    StandDown(String),
}

impl<L: Language> Next<L> {
    /// How long control of the next driver is kept while there is nothing to do.
    const LINGER: Duration = Duration::from_millis(500);
    /// Timeout for the acknowledgement of a command. A later command then replaces it.
    const PATIENCE: Duration = Duration::from_millis(400);
    /// Without any acknowledgement for this time, the link is re-established.
    const SILENCE: Duration = Duration::from_secs(2);
    /// First and longest delay before the link is re-established.
    const PAUSES: (Duration, Duration) = (Duration::from_millis(100), Duration::from_secs(2));

    /// Runs until the component has stopped. The owner also notices that by other means.
    pub(in crate::parts) async fn run(mut self) -> Result<Infallible, PartError> {
        let mut ticks = interval(L::PAUSE);
        ticks.set_missed_tick_behavior(MissedTickBehavior::Delay);
        let mut watchman = Watchman::default();
        let mut down: Option<String> = None;
        let mut pause = Self::PAUSES.0;
        loop {
            self.rest(&mut ticks, &mut watchman, down.take()).await;
            let begun = Instant::now();
            match self.work(&mut ticks, &mut watchman).await {
                End::Rest => pause = Self::PAUSES.0,
                End::Anew { peer, why } => {
                    if begun.elapsed() > Self::PAUSES.1 {
                        pause = Self::PAUSES.0;
                    }
                    // Blocked without a next driver would mean standing down.
                    let state = peer.map_or(StageState::Engaging, |_| StageState::Blocked);
                    self.tell(state, peer, why).await;
                    sleep(pause).await;
                    pause = (pause * 2).min(Self::PAUSES.1);
                }
                End::StandDown(why) => {
                    tracing::warn!("motion suspended: {why}");
                    self.stand_down(&mut ticks, &mut watchman, &why).await;
                    down = Some(why);
                    pause = Self::PAUSES.0;
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
        mut down: Option<String>,
    ) {
        let before = self.component.standing();
        while self.remote_platform.plan(Instant::now()) == Plan::Rest {
            let standing = self.component.standing();
            watchman.note(standing);
            if standing.controller != before.controller {
                down = None;
            }
            self.check_sensors(None).await;
            if let Some(failure) = self.sensors.failure() {
                let reason = format!("failure: {failure}");
                self.tell(StageState::Blocked, self.find(), reason).await;
            } else if let Some(reason) = down.as_deref().or(watchman.emergency()) {
                self.tell_down(reason).await;
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

    /// Drops commands until the client has been silent for the settling time or control changes.
    async fn stand_down(&self, ticks: &mut Interval, watchman: &mut Watchman, why: &str) {
        let controller = self.component.standing().controller;
        self.vehicle.stop();
        let mut since = Instant::now();
        while since.elapsed() < self.settling {
            let standing = self.component.standing();
            watchman.note(standing);
            self.tell_down(why).await;
            ticks.tick().await;
            if standing.controller != controller {
                return;
            }
            if self.vehicle.is_under_way() {
                self.vehicle.stop();
                since = Instant::now();
            }
        }
    }

    /// Takes control of the next driver and commands it until the link ends.
    async fn work(&mut self, ticks: &mut Interval, watchman: &mut Watchman) -> End {
        let Some(peer) = self.find() else {
            let why = format!("no {} is known", L::NAME);
            return End::Anew { peer: None, why };
        };
        self.tell(StageState::Engaging, Some(peer), String::new())
            .await;
        let control = match self.engage(peer).await {
            Ok(control) => control,
            Err(end) => return end,
        };
        tracing::info!("in control of {peer}");
        let component = self.component.clone();
        let end = tokio::select! {
            end = self.command(&control, ticks, watchman) => end,
            end = supervise(&component, peer) => end,
        };
        // Limit the wait, in case the next driver is gone.
        let _ = timeout(Self::PATIENCE, control.release()).await;
        end
    }

    fn find(&self) -> Option<JausId> {
        let subsystem = self.component.id().subsystem();
        let providers = Audience::providers(L::URN).in_subsystem(subsystem);
        self.component.members(providers).first().copied()
    }

    async fn engage(&self, peer: JausId) -> Result<Control, End> {
        let anew = |why: String| End::Anew {
            peer: Some(peer),
            why,
        };
        let control = match self.component.control(peer, self.authority).await {
            Ok(control) => control,
            Err(ControlError::Refused {
                why: ControlRefused::NotAvailable,
                ..
            }) => {
                // A failure also refuses control, but it ends without intervention.
                return Err(match examine(&self.component, peer).await {
                    Ok(Verdict::Anew) => anew(format!("{peer} failed or was restarted")),
                    _ => End::StandDown(format!(
                        "{peer} refuses control, for example because of an emergency"
                    )),
                });
            }
            Err(error) => {
                return Err(match examine(&self.component, peer).await {
                    Ok(Verdict::StandDown(why)) => anew(why),
                    _ => anew(error.to_string()),
                });
            }
        };
        match control.resume().await {
            Ok(()) => Ok(control),
            Err(ManageError::State { found, .. }) if found == State::Emergency as u8 => {
                Err(End::StandDown(format!("{peer} is stopped by an emergency")))
            }
            Err(error) => Err(anew(error.to_string())),
        }
    }

    /// Commands the next driver as long as there is work.
    async fn command(
        &mut self,
        control: &Control,
        ticks: &mut Interval,
        watchman: &mut Watchman,
    ) -> End {
        let peer = control.peer();
        let mut busy = Instant::now();
        let mut acknowledged = Instant::now();
        loop {
            watchman.note(self.component.standing());
            let now = Instant::now();
            let command = match self.remote_platform.plan(now) {
                Plan::Go(order, motion) => {
                    busy = now;
                    self.check_sensors(None).await;
                    self.tell(StageState::Active, Some(peer), String::new())
                        .await;
                    self.language.command(now, order, &motion)
                }
                Plan::Wait(why) => {
                    busy = now;
                    self.check_sensors(Some(&why)).await;
                    self.tell(StageState::Blocked, Some(peer), why).await;
                    self.language.halt()
                }
                Plan::Rest if now - busy > Self::LINGER => return End::Rest,
                Plan::Rest => {
                    if self.vehicle.has_arrived() {
                        self.tell(StageState::Done, None, String::new()).await;
                    }
                    self.language.halt()
                }
            };
            match timeout(Self::PATIENCE, control.deliver(&command)).await {
                Ok(Ok(())) => acknowledged = Instant::now(),
                Ok(Err(ControlError::Lost { why, .. })) => {
                    let why = format!("control of {peer} is lost: {why}");
                    return self.after_loss(peer, why).await;
                }
                Ok(Err(_)) | Err(_) if acknowledged.elapsed() > Self::SILENCE => {
                    let why = format!("{peer} does not acknowledge commands");
                    return End::Anew {
                        peer: Some(peer),
                        why,
                    };
                }
                Ok(Err(error)) => tracing::debug!(%error, "not delivered"),
                Err(_) => tracing::debug!(%peer, "not acknowledged in time"),
            }
            ticks.tick().await;
        }
    }

    /// A sensor fault that persists while the vehicle should move is a failure of the component,
    /// which stops and releases control. It ends when the sensors report again. The component then
    /// waits in Standby.
    async fn check_sensors(&mut self, lack: Option<&str>) {
        let now = Instant::now();
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
            self.component.set_condition(condition).await;
        }
    }

    /// Determines why control was lost.
    async fn after_loss(&self, peer: JausId, why: String) -> End {
        match examine(&self.component, peer).await {
            Ok(Verdict::StandDown(why)) => End::StandDown(why),
            _ => End::Anew {
                peer: Some(peer),
                why,
            },
        }
    }

    /// Reports standing down: blocked, without a next driver.
    async fn tell_down(&self, why: &str) {
        self.tell(StageState::Blocked, None, why.to_owned()).await;
    }

    async fn tell(&self, state: StageState, next: Option<JausId>, reason: String) {
        let progress = match state {
            StageState::Done => 100,
            StageState::Active | StageState::Blocked => self.vehicle.progress(),
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
            self.component.changed::<QueryStage>().await;
        }
    }
}

/// Interval between two status checks of the next driver.
const LOOK: Duration = Duration::from_millis(250);

/// Supervises the next driver until it needs a reaction.
async fn supervise(component: &Component, peer: JausId) -> End {
    // Status from before the resume does not count.
    sleep(2 * LOOK).await;
    loop {
        sleep(LOOK).await;
        match examine(component, peer).await {
            // Silence shows in missing acknowledgements.
            Ok(Verdict::GoOn) | Err(_) => {}
            Ok(Verdict::Anew) => {
                let why = format!("{peer} failed or was restarted");
                return End::Anew {
                    peer: Some(peer),
                    why,
                };
            }
            Ok(Verdict::StandDown(why)) => return End::StandDown(why),
        }
    }
}

/// Queries the status of the next driver.
async fn examine(component: &Component, peer: JausId) -> Result<Verdict, QueryError> {
    let status = component.query(peer, &QueryStatus {}).await?;
    let control = component.query(peer, &QueryControl {}).await?;
    let stage = component.query(peer, &QueryStage {}).await?;
    let controller = JausId::new(control.subsystem_id, control.node_id, control.component_id);
    let told = DriverStatus {
        status: status.status.0,
        controller: controller.is_unicast().then_some(controller),
        stage: StageReport::from(&stage),
    };
    Ok(judge(component.id(), peer, &told))
}
