//! The JAUS client of the session: each operation is a job of its own, which reports its end.

use std::sync::Arc;
use std::time::{Duration, Instant};

use bytes::Bytes;
use tokio::task::{AbortHandle, JoinSet};
use tokio::time::timeout;

use super::Reply;
use crate::state::Edition;
use crate::stick::Push;
use jaus::address::JausId;
use jaus::codec::{Message, OutOfRange};
use jaus::component::{Component, Control, ControlError, DeliverError};
use jaus::messages::core::{QueryStatus, ReportStatus};
use jaus::messages::mobility::SetWrenchEffort;

/// A job's end.
pub(super) enum Finished {
    /// Control was asked for.
    Taken {
        peer: JausId,
        result: Result<Control, ControlError>,
    },
    /// What a page wished has been done, or not.
    Told {
        reply: Reply,
        result: Result<(), String>,
    },
    /// The primitive driver was told what the stick says.
    Steered { push: Push, acknowledged: bool },
    /// The cells of a map were asked for.
    Mapped {
        edition: Edition,
        result: Result<Bytes, String>,
    },
    /// A part was told that there is an emergency, or that it is over; what its status is then.
    Alarmed {
        peer: JausId,
        status: Option<ReportStatus>,
    },
}

/// The component, and the operations under way.
pub(super) struct Client {
    component: Component,
    authority: u8,
    jobs: JoinSet<Finished>,
    effort: Option<Effort>,
}

/// The last effort that was sent, until it is acknowledged or a newer one takes its place.
struct Effort {
    push: Push,
    sent: Instant,
    job: AbortHandle,
}

/// How long a job that somebody waits for may take.
const PATIENCE: Duration = Duration::from_secs(3);
/// How long a part may take to say what became of an emergency, before it is told again.
const ALARM_PATIENCE: Duration = Duration::from_millis(700);

impl Client {
    /// An effort that is not acknowledged for so long gives way to a newer one.
    const EFFORT_PATIENCE: Duration = Duration::from_millis(100);

    pub(super) fn new(component: Component, authority: u8) -> Self {
        Self {
            component,
            authority,
            jobs: JoinSet::new(),
            effort: None,
        }
    }

    pub(super) const fn component(&self) -> &Component {
        &self.component
    }

    /// The next end of a job; waits for ever if there is none.
    pub(super) async fn finished(&mut self) -> Option<Finished> {
        loop {
            match self.jobs.join_next().await {
                Some(Ok(finished)) => return Some(finished),
                // An effort that a newer one has replaced.
                Some(Err(_)) => {}
                None => std::future::pending().await,
            }
        }
    }

    /// Starts a job.
    pub(super) fn start(&mut self, job: impl Future<Output = Finished> + Send + 'static) {
        self.jobs.spawn(job);
    }

    /// Asks for control.
    pub(super) fn take(&mut self, peer: JausId) {
        let (component, authority) = (self.component.clone(), self.authority);
        self.jobs.spawn(async move {
            let result = component.control(peer, authority).await;
            Finished::Taken { peer, result }
        });
    }

    /// Does something for a page.
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
            Finished::Told { reply, result }
        });
    }

    /// Tells the primitive driver what the stick says. The newest word counts: an older one that is
    /// still on its way is given up once it is late, and at once if the vehicle is to stop.
    pub(super) fn steer(&mut self, now: Instant, control: &Arc<Control>, push: Push) {
        if let Some(effort) = self.effort.take_if(|it| !it.job.is_finished()) {
            let stops = push == Push::NONE && effort.push != Push::NONE;
            let late = now.saturating_duration_since(effort.sent) >= Self::EFFORT_PATIENCE;
            if !stops && !late {
                self.effort = Some(effort);
                return;
            }
            effort.job.abort();
        }
        let Ok(message) = effort(push) else {
            // A push is within the range of the message.
            return;
        };
        let control = Arc::clone(control);
        let job = self.jobs.spawn(async move {
            let acknowledged = control.deliver(&message).await.is_ok();
            Finished::Steered { push, acknowledged }
        });
        self.effort = Some(Effort {
            push,
            sent: now,
            job,
        });
    }

    /// Tells a part that there is an emergency or that ours is over, and asks how it is.
    pub(super) fn alarm(&mut self, peer: JausId, on: bool) {
        let component = self.component.clone();
        self.jobs.spawn(async move {
            let deed = async {
                note(peer, emergency::deliver(&component, peer, on).await);
            };
            // Some peers never acknowledge: what counts is their status.
            let _ = timeout(ALARM_PATIENCE, deed).await;
            let status = component.query(peer, &QueryStatus {});
            let status = timeout(ALARM_PATIENCE, status).await;
            let status = status.ok().and_then(Result::ok);
            Finished::Alarmed { peer, status }
        });
    }

    /// Shouts that there is an emergency, without waiting for anything.
    pub(super) fn shout(&self, peer: JausId) {
        if let Err(error) = emergency::send(&self.component, peer) {
            tracing::warn!(%peer, %error, "emergency could not be sent");
        }
    }
}

fn note(peer: JausId, delivered: Result<(), DeliverError>) {
    if let Err(error) = delivered {
        tracing::debug!(%peer, %error, "not acknowledged");
    }
}

/// Sends a command, acknowledged, in words if it fails.
pub(super) async fn deliver<M: Message>(control: &Control, command: &M) -> Result<(), String> {
    let delivered = control.deliver(command).await;
    delivered.map_err(|error| error.to_string())
}

/// Gives control back and waits until that is confirmed, unless a job still uses it, which lets go
/// of it in the end.
pub(super) async fn release(control: Arc<Control>) {
    if let Ok(control) = Arc::try_unwrap(control) {
        control.release().await;
    }
}

/// The only ways in which an emergency leaves this station, so that its priority is decided here.
mod emergency {
    use jaus::address::JausId;
    use jaus::component::{Component, DeliverError, SendError};
    use jaus::messages::core::set_emergency::EmergencyCode;
    use jaus::messages::core::{ClearEmergency, SetEmergency};
    use jaus::wire::Priority;

    const PRIORITY: Priority = Priority::SafetyCritical;
    const SET: SetEmergency = SetEmergency {
        emergency_code: EmergencyCode(1),
    };
    const CLEAR: ClearEmergency = ClearEmergency {
        emergency_code: EmergencyCode(1),
    };

    /// Sets an emergency at once, without an acknowledgement.
    pub(super) fn send(component: &Component, peer: JausId) -> Result<(), SendError> {
        component.send_with(PRIORITY, peer, &SET)
    }

    /// Sets an emergency or clears it, acknowledged.
    pub(super) async fn deliver(
        component: &Component,
        peer: JausId,
        on: bool,
    ) -> Result<(), DeliverError> {
        if on {
            component.deliver_with(PRIORITY, peer, &SET).await
        } else {
            component.deliver_with(PRIORITY, peer, &CLEAR).await
        }
    }
}

/// Propulsion as the stick says; a stick that is let go brakes, because a vehicle without effort may
/// roll on.
fn effort(push: Push) -> Result<SetWrenchEffort, OutOfRange> {
    let brake = if push == Push::NONE { 100.0 } else { 0.0 };
    let mut effort = SetWrenchEffort::default();
    effort.set_propulsive_linear_effort_x_percent(100.0 * push.forward())?;
    effort.set_propulsive_rotational_effort_z_percent(100.0 * push.turn())?;
    effort.set_resistive_linear_effort_x_percent(brake)?;
    effort.set_resistive_rotational_effort_z_percent(brake)?;
    Ok(effort)
}
