//! The session's control lease on the vehicle: which parts are wanted, which are held, and why
//! others are not.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::{Duration, Instant};

use super::Reply;
use super::client::{self, Client};
use crate::picture::{Part, Picture};
use crate::role::Role;
use crate::state;
use jaus::address::JausId;
use jaus::component::{Control, ControlError};
use jaus::service::State;

/// The control lease: wanted and held parts.
#[derive(Default)]
pub(super) struct Lease {
    wanted: Wanted,
    /// Whether held parts should act on commands, also after they restart. `None` from the start of
    /// this station until the operator or the vehicle's reported state has decided it.
    ready: Option<bool>,
    /// Whether parts go to standby as soon as they are held, because their previous client is lost.
    stops: bool,
    holds: BTreeMap<JausId, Hold>,
    /// Requesters of control, waiting for the answers of the parts.
    waiting: Vec<Reply>,
}

/// The parts to control.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) enum Wanted {
    #[default]
    Nothing,
    /// All drivers and the planner: the operator drives.
    Everything,
    /// The planner only, which controls the drivers itself.
    Planner,
}

enum Hold {
    Asking,
    Held {
        control: Arc<Control>,
        since: Instant,
        /// Time of the last resume.
        resumed: Instant,
    },
    /// Why the part is not held, and when the next request is due.
    Not {
        why: String,
        again: Instant,
    },
}

impl Wanted {
    const fn takes_in(self, role: Role) -> bool {
        match self {
            Self::Nothing => false,
            Self::Everything => role.is_commanded(),
            Self::Planner => matches!(role, Role::Planner),
        }
    }
}

impl Lease {
    /// Delay before a refused request is repeated, unless another client is in control.
    const AGAIN: Duration = Duration::from_secs(1);
    /// After a grant or resume, a part may report its previous state for this time.
    const SETTLED: Duration = Duration::from_secs(1);
    /// Limit of waiting requesters. Further ones are answered immediately.
    const MOST_WAITING: usize = 64;

    pub(super) const fn wanted(&self) -> Wanted {
        self.wanted
    }

    pub(super) fn is_ready(&self) -> bool {
        self.ready == Some(true)
    }

    /// Keeps the vehicle ready if this operator left it ready before the station restarted. Decided
    /// when control is taken, or as soon as the driver reports its controller.
    fn go_on_ready(&mut self, now: Instant, picture: &Picture, client: &mut Client) {
        if self.ready.is_some() || self.wanted == Wanted::Nothing {
            return;
        }
        let known = picture.find(Role::PrimitiveDriver);
        let known = known.and_then(|id| Some((id, picture.parts().get(&id)?)));
        let Some((id, driver)) = known else {
            return;
        };
        // Immediately after the grant, the part may still report its state under another client.
        let settled = match self.holds.get(&id) {
            Some(Hold::Held { since, .. }) => now >= *since + Self::SETTLED,
            _ => true,
        };
        let own = Some(client.component().id());
        match driver.told_controller() {
            Some(told) if told != own => self.ready = Some(false),
            Some(_) if driver.is(State::Ready) && settled => {
                self.set_ready(now, true);
                self.resume_all(client);
            }
            _ => {}
        }
    }

    fn resume_all(&self, client: &mut Client) {
        for hold in self.holds.values() {
            if let Hold::Held { control, .. } = hold {
                resume(control, client);
            }
        }
    }

    /// The control over a part, if held.
    pub(super) fn held(&self, part: JausId) -> Option<Arc<Control>> {
        match self.holds.get(&part)? {
            Hold::Held { control, .. } if control.is_held() => Some(Arc::clone(control)),
            _ => None,
        }
    }

    /// All held controls.
    pub(super) fn all_held(&self) -> Vec<Arc<Control>> {
        self.holds
            .keys()
            .filter_map(|part| self.held(*part))
            .collect()
    }

    /// Why a wanted part is not held.
    pub(super) fn obstacle(&self, part: JausId) -> Option<String> {
        match self.holds.get(&part)? {
            Hold::Not { why, .. } => Some(why.clone()),
            Hold::Asking | Hold::Held { .. } => None,
        }
    }

    /// Takes control. The reply follows when every part has answered.
    pub(super) fn take(
        &mut self,
        now: Instant,
        wanted: Wanted,
        reply: Reply,
        picture: &Picture,
        client: &mut Client,
    ) {
        self.wanted = wanted;
        self.go_on_ready(now, picture, client);
        // Repeat refused requests, regardless of the controller.
        self.holds
            .retain(|_, hold| !matches!(hold, Hold::Not { .. }));
        if self.waiting.len() < Self::MOST_WAITING {
            self.waiting.push(reply);
        } else {
            reply(Err("too many pending requests for control".to_owned()));
        }
        let wanted = self.wanted_parts(picture);
        for (part, _) in wanted {
            self.ask(part, client);
        }
        self.handle_time(now, picture, client);
    }

    /// Changes the wanted parts without a waiting requester. Returns the controls to release.
    pub(super) fn want(&mut self, wanted: Wanted, picture: &Picture) -> Vec<Arc<Control>> {
        self.wanted = wanted;
        self.let_go(picture)
    }

    /// Takes control of everything for standby, because the vehicle's driving client is lost.
    pub(super) fn want_stopped(&mut self, now: Instant, picture: &Picture) {
        drop(self.want(Wanted::Everything, picture));
        self.set_ready(now, false);
        self.stops = true;
    }

    /// Whether the vehicle was stopped because its driving client was lost, and its drivers are
    /// held.
    pub(super) fn is_stopped(&self, picture: &Picture) -> bool {
        self.stops && self.state(picture).held
    }

    /// Releases everything. Returns the controls to release.
    pub(super) fn release(&mut self, picture: &Picture) -> Vec<Arc<Control>> {
        self.ready = Some(false);
        self.stops = false;
        self.want(Wanted::Nothing, picture)
    }

    /// Records whether held parts should act on commands. The caller sends the commands.
    pub(super) fn set_ready(&mut self, now: Instant, ready: bool) {
        self.ready = Some(ready);
        self.stops &= !ready;
        for hold in self.holds.values_mut() {
            if let Hold::Held { resumed, .. } = hold {
                *resumed = now;
            }
        }
    }

    /// Handles the result of a control request.
    pub(super) fn handle_taken(
        &mut self,
        now: Instant,
        part: JausId,
        result: Result<Control, ControlError>,
        client: &mut Client,
    ) {
        let is_ready = self.is_ready();
        // The part is no longer wanted. Dropping the control releases it.
        let Some(hold @ Hold::Asking) = self.holds.get_mut(&part) else {
            return;
        };
        match result {
            Ok(control) => {
                let control = Arc::new(control);
                if is_ready {
                    resume(&control, client);
                } else if self.stops {
                    stand_by(&control, client);
                }
                tracing::info!("in control of {part}");
                *hold = Hold::Held {
                    control,
                    since: now,
                    resumed: now,
                };
            }
            Err(error) => *hold = not(now, &error),
        }
    }

    /// Requests wanted parts, releases unwanted ones, and detects lost control.
    pub(super) fn handle_time(&mut self, now: Instant, picture: &Picture, client: &mut Client) {
        drop(self.let_go(picture));
        self.go_on_ready(now, picture, client);
        let own = client.component().id();
        let is_ready = self.is_ready();
        let wanted = self.wanted_parts(picture);
        for (id, part) in wanted {
            match self.holds.get_mut(&id) {
                Some(Hold::Asking) => {}
                Some(hold @ Hold::Held { .. }) => {
                    look_after(now, own, part, hold);
                    if is_ready {
                        keep_ready(now, part, hold, client);
                    }
                }
                Some(Hold::Not { again, .. }) => {
                    // Another client took control for a reason, so do not contend.
                    let free = part.controller().is_none_or(|id| id == own);
                    if free && *again <= now {
                        self.ask(id, client);
                    }
                }
                None => self.ask(id, client),
            }
        }
        self.answer(picture);
    }

    fn ask(&mut self, part: JausId, client: &mut Client) {
        if !matches!(
            self.holds.get(&part),
            Some(Hold::Asking | Hold::Held { .. })
        ) {
            self.holds.insert(part, Hold::Asking);
            client.take(part);
        }
    }

    fn wanted_parts<'p>(&self, picture: &'p Picture) -> Vec<(JausId, &'p Part)> {
        let parts = picture.parts().iter();
        let wanted = parts.filter(|(_, part)| self.wanted.takes_in(part.role));
        wanted.map(|(id, part)| (*id, part)).collect()
    }

    /// Removes parts that are unwanted or absent. Returns the controls to release.
    fn let_go(&mut self, picture: &Picture) -> Vec<Arc<Control>> {
        let mut free = Vec::new();
        let wanted = self.wanted;
        self.holds.retain(|id, hold| {
            let part = picture.parts().get(id);
            let keeps = part.is_some_and(|part| wanted.takes_in(part.role));
            if let (false, Hold::Held { control, .. }) = (keeps, hold) {
                free.push(Arc::clone(control));
            }
            keeps
        });
        free
    }

    /// Answers the requesters once every part has answered.
    fn answer(&mut self, picture: &Picture) {
        let asking = |hold: &Hold| matches!(hold, Hold::Asking);
        if self.waiting.is_empty() || self.holds.values().any(asking) {
            return;
        }
        let state = self.state(picture);
        for reply in self.waiting.drain(..) {
            reply(if state.held {
                Ok(())
            } else if self.wanted == Wanted::Nothing {
                Err("control was released in the meantime".to_owned())
            } else {
                Err(state.reason.clone())
            });
        }
    }

    /// The part without which the operator cannot act.
    fn principal(&self, picture: &Picture) -> Option<JausId> {
        let driver = || picture.find(Role::PrimitiveDriver);
        let planner = || picture.find(Role::Planner);
        match self.wanted {
            Wanted::Planner => planner(),
            Wanted::Everything | Wanted::Nothing => driver().or_else(planner),
        }
    }

    /// Snapshot for pages.
    pub(super) fn state(&self, picture: &Picture) -> state::Control {
        let principal = self.principal(picture);
        let held = principal.is_some_and(|part| self.held(part).is_some());
        let wanted = self.wanted != Wanted::Nothing;
        let reason = if wanted && principal.is_none() {
            "the vehicle has no primitive driver and no planner".to_owned()
        } else {
            self.reasons(picture)
        };
        state::Control {
            held,
            wanted,
            reason,
        }
    }

    fn reasons(&self, picture: &Picture) -> String {
        let reasons = self.holds.iter().filter_map(|(id, hold)| match hold {
            Hold::Not { why, .. } => {
                let role = picture.parts().get(id).map_or(Role::Other, |it| it.role);
                Some(format!("{}: {why}", role.words()))
            }
            Hold::Asking | Hold::Held { .. } => None,
        });
        reasons.collect::<Vec<_>>().join("; ")
    }
}

/// Detects lost control, also if only the part knows because it was restarted.
fn look_after(now: Instant, own: JausId, part: &Part, hold: &mut Hold) {
    let Hold::Held { control, since, .. } = hold else {
        return;
    };
    if let Err(error) = control.check() {
        tracing::info!("{error}");
        *hold = not(now, &error);
    } else if let Some(controller) = part.disowns(own, *since + Lease::SETTLED) {
        let why = match controller {
            Some(id) => format!("{id} is in control now"),
            None => "it no longer knows its controller, probably after a restart".into(),
        };
        tracing::info!("control of {} is lost: {why}", control.peer());
        *hold = Hold::Not { why, again: now };
    }
}

/// Resumes a part that should act on commands but stands by. Renewed control outlives a restart of
/// the part.
fn keep_ready(now: Instant, part: &Part, hold: &mut Hold, client: &mut Client) {
    if let Hold::Held {
        control, resumed, ..
    } = hold
        && part.stands_by(*resumed + Lease::SETTLED)
    {
        tracing::info!("{} is in standby; resuming", control.peer());
        *resumed = now;
        resume(control, client);
    }
}

fn not(now: Instant, error: &ControlError) -> Hold {
    Hold::Not {
        why: error.to_string(),
        again: now + Lease::AGAIN,
    }
}

/// Resumes a part in the background.
fn resume(control: &Arc<Control>, client: &mut Client) {
    let control = Arc::clone(control);
    client.tell(
        Box::new(|result| {
            if let Err(reason) = result {
                tracing::info!("not ready: {reason}");
            }
        }),
        async move { control.resume().await.map_err(|error| error.to_string()) },
    );
}

/// Sends a part to standby in the background.
fn stand_by(control: &Arc<Control>, client: &mut Client) {
    let control = Arc::clone(control);
    client.tell(
        Box::new(|result| {
            if let Err(reason) = result {
                tracing::warn!("not in standby: {reason}");
            }
        }),
        async move { control.standby().await.map_err(|error| error.to_string()) },
    );
}

/// Releases these controls and waits for the confirmations.
pub(super) async fn release_all(controls: Vec<Arc<Control>>) {
    for control in controls {
        client::release(control).await;
    }
}
