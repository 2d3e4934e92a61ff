//! The session's lease on the vehicle: which parts it wants under control, which it holds, and what is
//! in the way of the others.

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

/// The control lease: which parts are wanted under control, and which are held.
#[derive(Default)]
pub(super) struct Lease {
    wanted: Wanted,
    /// Whether what is held is to act on commands, also after it was started again; nothing while
    /// nobody has said so since this station was started.
    ready: Option<bool>,
    /// Whether parts are to stand by as soon as they are held, because what drove them is lost.
    stops: bool,
    holds: BTreeMap<JausId, Hold>,
    /// Who asked for control and waits for the answers of the parts.
    waiting: Vec<Reply>,
}

/// Of what control is wanted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) enum Wanted {
    #[default]
    Nothing,
    /// Of all drivers and the planner: the operator drives.
    Everything,
    /// Of the planner, which controls the drivers itself.
    Planner,
}

enum Hold {
    Asking,
    Held {
        control: Arc<Control>,
        since: Instant,
        /// When it was last told to act on commands.
        resumed: Instant,
    },
    /// Why it is not held, and when it may be asked for again.
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
    /// Before a part that could not be controlled is asked again, if nobody else controls it.
    const AGAIN: Duration = Duration::from_secs(1);
    /// A part that has just granted control, or was told to act, may still report what was before.
    const SETTLED: Duration = Duration::from_secs(1);
    /// How many may wait for control; more are answered at once.
    const MOST_WAITING: usize = 64;

    pub(super) const fn wanted(&self) -> Wanted {
        self.wanted
    }

    pub(super) fn is_ready(&self) -> bool {
        self.ready == Some(true)
    }

    /// What this operator left ready when the station before this one ended is to stay so: decided
    /// when control is taken, or as soon as the driver tells whom it obeys.
    fn go_on_ready(&mut self, now: Instant, picture: &Picture, client: &mut Client) {
        if self.ready.is_some() || self.wanted == Wanted::Nothing {
            return;
        }
        let known = picture.find(Role::PrimitiveDriver);
        let known = known.and_then(|id| Some((id, picture.parts().get(&id)?)));
        let Some((id, driver)) = known else {
            return;
        };
        // Right after the grant it may still say what it was for somebody else.
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

    /// The control over a part, if it is held.
    pub(super) fn held(&self, part: JausId) -> Option<Arc<Control>> {
        match self.holds.get(&part)? {
            Hold::Held { control, .. } if control.is_held() => Some(Arc::clone(control)),
            _ => None,
        }
    }

    /// Everything that is held.
    pub(super) fn all_held(&self) -> Vec<Arc<Control>> {
        self.holds
            .keys()
            .filter_map(|part| self.held(*part))
            .collect()
    }

    /// Why a part is not held though it is wanted.
    pub(super) fn obstacle(&self, part: JausId) -> Option<String> {
        match self.holds.get(&part)? {
            Hold::Not { why, .. } => Some(why.clone()),
            Hold::Asking | Hold::Held { .. } => None,
        }
    }

    /// An operator takes control; the answer comes when every part has answered.
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
        // Whoever has it: it is asked for anew.
        self.holds
            .retain(|_, hold| !matches!(hold, Hold::Not { .. }));
        if self.waiting.len() < Self::MOST_WAITING {
            self.waiting.push(reply);
        } else {
            reply(Err("too many ask for control".to_owned()));
        }
        let wanted = self.wanted_parts(picture);
        for (part, _) in wanted {
            self.ask(part, client);
        }
        self.handle_time(now, picture, client);
    }

    /// What is wanted changes without anybody waiting for it. What is not wanted any more is handed
    /// out, to be given back.
    pub(super) fn want(&mut self, wanted: Wanted, picture: &Picture) -> Vec<Arc<Control>> {
        self.wanted = wanted;
        self.let_go(picture)
    }

    /// Everything is wanted, and to stand by: what drove the vehicle is lost.
    pub(super) fn want_stopped(&mut self, now: Instant, picture: &Picture) {
        drop(self.want(Wanted::Everything, picture));
        self.set_ready(now, false);
        self.stops = true;
    }

    /// Whether the vehicle was stopped because what drove it is lost, and its drivers are held.
    pub(super) fn is_stopped(&self, picture: &Picture) -> bool {
        self.stops && self.state(picture).held
    }

    /// Everything is to be given back.
    pub(super) fn release(&mut self, picture: &Picture) -> Vec<Arc<Control>> {
        self.ready = Some(false);
        self.stops = false;
        self.want(Wanted::Nothing, picture)
    }

    /// Whether what is held is to act on commands; it is being told so.
    pub(super) fn set_ready(&mut self, now: Instant, ready: bool) {
        self.ready = Some(ready);
        self.stops &= !ready;
        for hold in self.holds.values_mut() {
            if let Hold::Held { resumed, .. } = hold {
                *resumed = now;
            }
        }
    }

    /// A part has granted control, or not.
    pub(super) fn handle_taken(
        &mut self,
        now: Instant,
        part: JausId,
        result: Result<Control, ControlError>,
        client: &mut Client,
    ) {
        let is_ready = self.is_ready();
        // Otherwise it is not wanted any more, and given back by dropping it.
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

    /// Asks for what is wanted and not held, lets go of what is not wanted, and notices what was
    /// lost.
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
                    // Whoever else took it had a reason.
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

    /// Forgets what is not wanted or not there, and returns what was held of it.
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

    /// Tells those who asked for control, once every part has answered.
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
                Err("control was released meanwhile".to_owned())
            } else {
                Err(state.reason.clone())
            });
        }
    }

    /// The part without which the operator can do nothing.
    fn principal(&self, picture: &Picture) -> Option<JausId> {
        let driver = || picture.find(Role::PrimitiveDriver);
        let planner = || picture.find(Role::Planner);
        match self.wanted {
            Wanted::Planner => planner(),
            Wanted::Everything | Wanted::Nothing => driver().or_else(planner),
        }
    }

    /// As pages show it.
    pub(super) fn state(&self, picture: &Picture) -> state::Control {
        let principal = self.principal(picture);
        let held = principal.is_some_and(|part| self.held(part).is_some());
        let wanted = self.wanted != Wanted::Nothing;
        let reason = if wanted && principal.is_none() {
            "the vehicle has no primitive driver and no planner at present".to_owned()
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

/// Notices that control is lost, also when only the part knows it, because it was started again.
fn look_after(now: Instant, own: JausId, part: &Part, hold: &mut Hold) {
    let Hold::Held { control, since, .. } = hold else {
        return;
    };
    if let Err(error) = control.check() {
        tracing::info!("{error}");
        *hold = not(now, &error);
    } else if let Some(controller) = part.disowns(own, *since + Lease::SETTLED) {
        let why = match controller {
            Some(id) => format!("{id} controls it now"),
            None => {
                "it has forgotten who controls it, probably because it was started again".into()
            }
        };
        tracing::info!("control over {} is lost: {why}", control.peer());
        *hold = Hold::Not { why, again: now };
    }
}

/// Notices that a part does not act on commands though it should: control that is renewed outlives
/// that the part was started again.
fn keep_ready(now: Instant, part: &Part, hold: &mut Hold, client: &mut Client) {
    if let Hold::Held {
        control, resumed, ..
    } = hold
        && part.stands_by(*resumed + Lease::SETTLED)
    {
        tracing::info!("{} stands by, and is made ready again", control.peer());
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

/// Makes a part act on commands as the others do; nobody waits for it.
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

/// Makes a part stop acting on commands; nobody waits for it.
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

/// Gives control of all these back, and waits until that is confirmed.
pub(super) async fn release_all(controls: Vec<Arc<Control>>) {
    for control in controls {
        client::release(control).await;
    }
}
