//! The session's JAUS client: each operation is a separate job that reports its completion.

use std::sync::Arc;
use std::time::Duration;

use bytes::Bytes;
use tokio::task::{AbortHandle, JoinSet};
use tokio::time::{Instant, timeout};

use crate::orders::Reply;
use crate::state::Edition;
use crate::stick::Push;
use jaus::address::JausId;
use jaus::codec::Message;
use jaus::component::{
    Component, QueryOptions, Retake, Session, SessionError, SessionSettings, TargetState,
};
use jaus::messages::core::{QueryStatus, ReportStatus};

/// Completion of a job.
pub(super) enum Finished {
    /// A session with a part has begun.
    Begun {
        peer: JausId,
        result: Result<Session, SessionError>,
    },
    /// A vehicle that was deselected has stopped and was released, or did not answer.
    Left { vehicle: u16 },
    /// Result of a page's request.
    Requested {
        reply: Reply,
        result: Result<(), String>,
    },
    /// The primitive driver has acknowledged the end of manual drive, or has not.
    Stopped { vehicle: u16, acknowledged: bool },
    /// Round trip of a query to a vehicle; `None` without an answer.
    Probed {
        vehicle: u16,
        round_trip: Option<Duration>,
    },
    /// Result of a request for map cells.
    Mapped {
        store: JausId,
        edition: Edition,
        result: Result<Bytes, String>,
    },
    /// A part was told the start or the end of an emergency, with its status afterwards.
    Alarmed {
        peer: JausId,
        /// Whether it has acknowledged the start.
        is_stopped: bool,
        status: Option<ReportStatus>,
    },
}

/// The component and its operations in progress.
pub(super) struct Client {
    component: Component,
    authority: u8,
    jobs: JoinSet<Finished>,
}

/// Whose emergency is cleared.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Cleared {
    /// That of this station.
    Own,
    /// Those of all clients, for which the vehicle requires a right of its own.
    Any,
}

/// What a part is told about an emergency.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum AlarmChange {
    Set,
    Clear(Cleared),
}

/// Timeout of a job that a requester waits for.
const PATIENCE: Duration = Duration::from_secs(3);
/// Timeout of a query that measures the round trip.
const PROBE_PATIENCE: Duration = Duration::from_secs(2);
/// Timeout for a part to confirm an emergency before it is repeated.
const ALARM_PATIENCE: Duration = Duration::from_millis(700);

impl Client {
    pub(super) fn new(component: Component, authority: u8) -> Self {
        Self {
            component,
            authority,
            jobs: JoinSet::new(),
        }
    }

    pub(super) const fn authority(&self) -> u8 {
        self.authority
    }

    pub(super) const fn component(&self) -> &Component {
        &self.component
    }

    /// The next completed job. Pending forever without jobs.
    pub(super) async fn finished(&mut self) -> Option<Finished> {
        loop {
            match self.jobs.join_next().await {
                Some(Ok(finished)) => return Some(finished),
                // What something newer has replaced: the end of a drive, or what was told of an emergency.
                Some(Err(_)) => {}
                None => std::future::pending().await,
            }
        }
    }

    /// Starts a job.
    pub(super) fn start(
        &mut self,
        job: impl Future<Output = Finished> + Send + 'static,
    ) -> AbortHandle {
        self.jobs.spawn(job)
    }

    /// Measures the round trip to a part of a vehicle.
    pub(super) fn probe(&mut self, peer: JausId) {
        let component = self.component.clone();
        self.jobs.spawn(async move {
            let sent = Instant::now();
            let options = QueryOptions::default().within(PROBE_PATIENCE);
            let answer = component.query_with(options, peer, &QueryStatus {}).await;
            Finished::Probed {
                vehicle: peer.subsystem(),
                round_trip: answer.is_ok().then(|| sent.elapsed()),
            }
        });
    }

    /// Begins a session, which leaves the part as it is found. Another client may have taken control
    /// for a reason, so the session does not contend.
    pub(super) fn begin(&mut self, peer: JausId) {
        let component = self.component.clone();
        let settings = SessionSettings::new(self.authority)
            .retake(Retake::WhenFree)
            .target(TargetState::AsFound);
        self.jobs.spawn(async move {
            let result = component.session(peer, settings).await;
            Finished::Begun { peer, result }
        });
    }

    /// Runs an operation for a page.
    pub(super) fn tell(
        &mut self,
        reply: Reply,
        deed: impl Future<Output = Result<(), String>> + Send + 'static,
    ) {
        self.jobs.spawn(async move {
            let result = timeout(PATIENCE, deed).await;
            let result = result.unwrap_or_else(|_| {
                let waited = PATIENCE.as_secs();
                Err(format!("the vehicle has not answered for {waited} s"))
            });
            Finished::Requested { reply, result }
        });
    }

    /// Stops and releases a vehicle that was deselected: its primitive driver, if held, confirms
    /// the end of manual drive first.
    pub(super) fn leave(
        &mut self,
        vehicle: u16,
        driver: Option<Arc<Session>>,
        sessions: Vec<Arc<Session>>,
    ) {
        let stop = Push::NONE.effort().ok();
        self.jobs.spawn(async move {
            let stopped = async {
                if let Some((driver, stop)) = driver.zip(stop) {
                    // Fails if it is not ready, and then it is at rest.
                    let _ = driver.deliver(&stop).await;
                }
                release_all(sessions).await;
            };
            if timeout(PATIENCE, stopped).await.is_err() {
                tracing::warn!("vehicle {vehicle} has not confirmed its release");
            }
            Finished::Left { vehicle }
        });
    }

    /// Sends the start or the end of an emergency to a part, then queries its status.
    pub(super) fn alarm(&mut self, peer: JausId, change: AlarmChange) -> AbortHandle {
        let component = self.component.clone();
        self.jobs.spawn(async move {
            // Some peers never acknowledge. Their status decides.
            let told = timeout(ALARM_PATIENCE, emergency::deliver(&component, peer, change));
            let told = told.await;
            if let Ok(Err(error)) = &told {
                tracing::debug!(%peer, %error, "not acknowledged");
            }
            let is_stopped = change == AlarmChange::Set && matches!(told, Ok(Ok(())));
            let status = component.query(peer, &QueryStatus {});
            let status = timeout(ALARM_PATIENCE, status).await;
            let status = status.ok().and_then(Result::ok);
            Finished::Alarmed {
                peer,
                is_stopped,
                status,
            }
        })
    }

    /// Sends an emergency without waiting for an acknowledgement.
    pub(super) fn shout(&self, peer: JausId) {
        if let Err(error) = emergency::send(&self.component, peer) {
            tracing::warn!(%peer, %error, "cannot send the emergency");
        }
    }
}

/// Delivers a command with acknowledgement. Errors are returned as text.
pub(super) async fn deliver<M: Message>(session: &Session, command: &M) -> Result<(), String> {
    let delivered = session.deliver(command).await;
    delivered.map_err(|error| error.to_string())
}

/// The only functions that send an emergency, so that its priority is set in one place.
mod emergency {
    use jaus::address::JausId;
    use jaus::component::{CLEAR_ALL, Component, DeliverError, SendError};
    use jaus::messages::core::set_emergency::EmergencyCode;
    use jaus::messages::core::{ClearEmergency, SetEmergency};
    use jaus::wire::Priority;

    use super::{AlarmChange, Cleared};

    const PRIORITY: Priority = Priority::SafetyCritical;
    const SET: SetEmergency = SetEmergency {
        emergency_code: EmergencyCode(1),
    };

    /// Sends a Set Emergency without acknowledgement.
    pub(super) fn send(component: &Component, peer: JausId) -> Result<(), SendError> {
        component.send_with(PRIORITY, peer, &SET)
    }

    /// Sets or clears an emergency, with acknowledgement.
    pub(super) async fn deliver(
        component: &Component,
        peer: JausId,
        change: AlarmChange,
    ) -> Result<(), DeliverError> {
        let emergency_code = match change {
            AlarmChange::Set => return component.deliver_with(PRIORITY, peer, &SET).await,
            AlarmChange::Clear(Cleared::Own) => 1.into(),
            AlarmChange::Clear(Cleared::Any) => CLEAR_ALL.into(),
        };
        let clear = ClearEmergency { emergency_code };
        component.deliver_with(PRIORITY, peer, &clear).await
    }
}

/// Releases these parts and waits for the confirmations. If a job still uses a session, that job
/// releases it at its end.
pub(super) async fn release_all(sessions: Vec<Arc<Session>>) {
    for session in sessions {
        if let Ok(session) = Arc::try_unwrap(session) {
            session.release().await;
        }
    }
}
