//! A service made of functions, one per message: what an application offers.

use std::any::TypeId;
use std::collections::{BTreeMap, BTreeSet};
use std::fmt;
use std::time::Instant;

use super::{
    Context, Handled, Hazards, MotionGuard, MotionPolicy, Service, Standing, StopCause, Validity,
    code_of,
};
use crate::address::JausId;
use crate::codec::{DecodeError, Message, ServiceId};
use crate::endpoint::Received;

type Stop = Box<dyn FnMut(&mut Context<'_>) + Send>;
/// Handles a message, or says why its octets are no message of its type.
type Handler = Box<dyn FnMut(&Received, &mut Context<'_>) -> Result<Taken, DecodeError> + Send>;

/// What became of a message.
#[derive(Clone, Copy)]
enum Taken {
    /// It moves nothing, or its sender may not give it.
    Message,
    /// It is a command, carried out and valid for a while.
    Command(Validity),
}

/// A service whose messages are answered by functions of the application.
///
/// ```
/// use jaus::messages::mobility::{self, QueryVelocityState, ReportVelocityState};
/// use jaus::service::Handlers;
///
/// let speedometer = Handlers::new(mobility::velocity_state_sensor::LATEST)
///     .answer(|_query: QueryVelocityState| ReportVelocityState::default());
/// ```
///
/// # Commands
///
/// | method | for | obeys |
/// |---|---|---|
/// | [`command`](Self::command) | what makes something act | the client in control while the component is ready |
/// | [`configure`](Self::configure) | what sets something up | the client in control |
/// | [`receive`](Self::receive) | everything else | anyone |
///
/// A command that moves something needs a stop action, [`on_stop`](Self::on_stop). It is called when
/// the command is not repeated within 500 ms (or as [`Validity`] and [`MotionPolicy`] say), when
/// control or readiness is lost, in an emergency, and when the component ends. A component without
/// Management, or handlers without a stop action, cannot be attached with a command.
///
/// A command of a service that inherits Access Control cannot be taken from anyone by mistake:
///
/// ```compile_fail
/// use jaus::messages::mobility::{SetWrenchEffort, primitive_driver};
/// use jaus::service::Handlers;
///
/// Handlers::new(primitive_driver::LATEST).receive(|effort: SetWrenchEffort, _, _| {});
/// ```
///
/// # Several versions
///
/// A component can offer a service at several versions. Where they lay a message out differently
/// under the same code, each layout is a type with a handler of its own; nothing in a message says
/// its version, so the layouts are tried in the order in which they were given, the newest first,
/// and the first that fits the octets exactly has the message.
///
/// ```
/// use jaus::messages::mobility::{self, v1_0};
/// use jaus::service::Handlers;
///
/// let driver = Handlers::new(mobility::local_vector_driver::V1_1)
///     .and_version(mobility::local_vector_driver::V1_0)
///     .command(|vector: mobility::SetLocalVector, _, _| println!("{vector:?}"))
///     .command(|vector: v1_0::SetLocalVector, _, _| println!("{vector:?}"));
/// ```
pub struct Handlers {
    offers: Vec<ServiceId>,
    by_code: BTreeMap<u16, Vec<(TypeId, Handler)>>,
    told: BTreeSet<u16>,
    stops: Vec<Stop>,
    guard: MotionGuard,
    hazards: Hazards,
}

impl Handlers {
    /// A service that handles nothing yet.
    #[must_use]
    pub fn new(id: ServiceId) -> Self {
        Self {
            offers: vec![id],
            by_code: BTreeMap::new(),
            told: BTreeSet::new(),
            stops: Vec::new(),
            guard: MotionGuard::default(),
            hazards: Hazards::default(),
        }
    }

    /// Also offers an older version, whose clients it understands as well.
    #[must_use]
    pub fn and_version(mut self, id: ServiceId) -> Self {
        self.offers.push(id);
        self
    }

    /// Answers every query of type `Q`; the answer goes to whoever asked.
    #[must_use]
    pub fn answer<Q: Message, R: Message>(
        mut self,
        mut function: impl FnMut(Q) -> R + Send + 'static,
    ) -> Self {
        const {
            assert!(
                !Q::NEEDS_CONTROL,
                "this is a command of a service with Access Control, not a query: take it with \
                 `command` or `configure`"
            );
        }
        self.handle::<Q>(move |received, context| {
            let query = Q::decode(&received.payload)?;
            context.reply(received, &function(query));
            Ok(Taken::Message)
        });
        self
    }

    /// Takes every message of type `M` from any sender; the context sends answers.
    ///
    /// Does not compile for a [command that needs control](Message::NEEDS_CONTROL).
    #[must_use]
    pub fn receive<M: Message>(
        self,
        function: impl FnMut(M, &Received, &mut Context<'_>) + Send + 'static,
    ) -> Self {
        const {
            assert!(
                !M::NEEDS_CONTROL,
                "this is a command of a service with Access Control: take it with `command` or \
                 `configure`, or from anyone with `receive_unguarded`"
            );
        }
        self.receive_unguarded(function)
    }

    /// The same for any message, also for a command that needs control: anyone may give it at any
    /// time, and nothing stops it.
    #[must_use]
    pub fn receive_unguarded<M: Message>(
        self,
        function: impl FnMut(M, &Received, &mut Context<'_>) + Send + 'static,
    ) -> Self {
        self.receive_if(|_, _| true, Taken::Message, function)
    }

    /// Takes messages of type `M` from the client in control, and ignores all others: what sets
    /// something up. The component must offer Access Control or Management. It is not for what moves
    /// something: the command is obeyed in every state, and nothing stops it.
    #[must_use]
    pub fn configure<M: Message>(
        mut self,
        function: impl FnMut(M, &Received, &mut Context<'_>) + Send + 'static,
    ) -> Self {
        self.hazards.set_up_by = Some(M::NAME);
        self.receive_if(Standing::obeys, Taken::Message, function)
    }

    /// Takes messages of type `M` from the client in control while the component is ready, and
    /// ignores all others: what makes something act. The component must offer Management, and there
    /// must be a stop action, [`on_stop`](Self::on_stop).
    ///
    /// The command is valid for as long as [`Validity::of`] its code says: 500 ms unless it is one of
    /// the standard's vectors or goals.
    #[must_use]
    pub fn command<M: Message>(
        self,
        function: impl FnMut(M, &Received, &mut Context<'_>) + Send + 'static,
    ) -> Self {
        self.command_valid(Validity::of(M::CODE), function)
    }

    /// The same as [`command`](Self::command), with a validity of one's own choice.
    #[must_use]
    pub fn command_valid<M: Message>(
        mut self,
        validity: Validity,
        function: impl FnMut(M, &Received, &mut Context<'_>) + Send + 'static,
    ) -> Self {
        self.hazards.acts_on = Some(M::NAME);
        self.receive_if(Standing::acts_for, Taken::Command(validity), function)
    }

    /// How long brief commands are valid; 500 ms without this.
    #[must_use]
    pub const fn motion_policy(mut self, policy: MotionPolicy) -> Self {
        self.guard.set_policy(policy);
        self
    }

    /// Calls a function whenever what the commands have set in motion must stop: at the end of a
    /// command's validity, when control or readiness is lost, in an emergency, and when the component
    /// ends. It may be called when nothing moves.
    #[must_use]
    pub fn on_stop(mut self, stop: impl FnMut(&mut Context<'_>) + Send + 'static) -> Self {
        self.hazards.stops = true;
        self.stops.push(Box::new(stop));
        self
    }

    /// Lets clients have commands of type `M` carried out as command events (AS5710 1.1). The
    /// application promises to say when one has ended, by [`Context::ended`] or
    /// [`Stack::end_command`](super::Stack::end_command).
    #[must_use]
    pub fn tell_end_of<M: Message>(mut self) -> Self {
        self.told.insert(M::CODE);
        self
    }

    fn receive_if<M: Message>(
        mut self,
        may: fn(&Standing, JausId) -> bool,
        taken: Taken,
        mut function: impl FnMut(M, &Received, &mut Context<'_>) + Send + 'static,
    ) -> Self {
        self.handle::<M>(move |received, context| {
            if may(context.standing(), received.source) {
                function(M::decode(&received.payload)?, received, context);
                return Ok(taken);
            }
            tracing::debug!(source = %received.source, message = M::NAME, "not in control");
            Ok(Taken::Message)
        });
        self
    }

    fn stop(&mut self, context: &mut Context<'_>) {
        for stop in &mut self.stops {
            stop(context);
        }
    }

    /// Sets the handler of a layout, behind those of other layouts with the same code.
    fn handle<M: Message>(
        &mut self,
        handler: impl FnMut(&Received, &mut Context<'_>) -> Result<Taken, DecodeError> + Send + 'static,
    ) {
        let (layout, handler) = (TypeId::of::<M>(), Box::new(handler));
        let layouts = self.by_code.entry(M::CODE).or_default();
        match layouts.iter_mut().find(|(known, _)| *known == layout) {
            Some(place) => place.1 = handler,
            None => layouts.push((layout, handler)),
        }
    }
}

impl fmt::Debug for Handlers {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Handlers")
            .field("offers", &self.offers)
            .field("codes", &self.by_code.keys())
            .finish()
    }
}

impl Service for Handlers {
    fn offers(&self) -> Vec<ServiceId> {
        self.offers.clone()
    }

    fn handle_message(
        &mut self,
        now: Instant,
        message: &Received,
        context: &mut Context<'_>,
    ) -> Handled {
        let layouts = code_of(&message.payload).and_then(|code| self.by_code.get_mut(&code));
        let Some(layouts) = layouts else {
            return Handled::No;
        };
        for (_, handler) in layouts {
            match handler(message, context) {
                Ok(Taken::Message) => break,
                Ok(Taken::Command(validity)) => {
                    self.guard.accept(now, message.source, validity);
                    break;
                }
                Err(error) => {
                    tracing::debug!(source = %message.source, %error, "message cannot be read");
                }
            }
        }
        Handled::Yes
    }

    fn handle_timeout(&mut self, now: Instant, context: &mut Context<'_>) {
        self.guard.note_life(|owner| context.last_sign(owner));
        if self.guard.expire(now).is_some() {
            self.stop(context);
        }
    }

    fn handle_stop(&mut self, cause: &StopCause, context: &mut Context<'_>) {
        self.guard.stop(cause.clone());
        self.stop(context);
    }

    fn depends_on(&self) -> Option<JausId> {
        self.guard.depends_on()
    }

    fn is_moving(&self) -> bool {
        self.guard.is_active()
    }

    fn hazards(&self) -> Hazards {
        self.hazards.clone()
    }

    fn tells_end_of(&self, command: u16) -> bool {
        self.told.contains(&command)
    }

    fn poll_timeout(&self) -> Option<Instant> {
        self.guard.expires_at()
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;
    use std::sync::atomic::{AtomicU32, Ordering};

    use super::*;
    use crate::messages::core::{QueryTimeout, SetAuthority, list_manager};
    use crate::service::State;
    use crate::service::rig::{CLIENT, Rig, STRANGER};

    /// Handlers that count: what anyone may say, what sets up, what acts, and stops.
    fn counting() -> (Rig, [Arc<AtomicU32>; 4]) {
        let counts: [Arc<AtomicU32>; 4] = Default::default();
        let [heard, set_up, acted, stopped] = counts.clone();
        let count = |counter: &AtomicU32| _ = counter.fetch_add(1, Ordering::Relaxed);
        let handlers = Handlers::new(list_manager::LATEST)
            .receive(move |_: QueryTimeout, _, _| count(&heard))
            .configure(move |_: SetAuthority, _, _| count(&set_up))
            .command(move |_: crate::messages::core::Reset, _, _| count(&acted))
            .on_stop(move |_| count(&stopped));
        (Rig::new(vec![Box::new(handlers)]), counts)
    }

    fn say_everything(rig: &mut Rig, source: JausId) {
        rig.send(source, &QueryTimeout);
        rig.send(source, &SetAuthority::default());
        rig.send(source, &crate::messages::core::Reset);
    }

    #[test]
    fn each_message_is_taken_from_whom_and_when_it_may_be() {
        for (state, source, expected) in [
            (State::Ready, CLIENT, [1, 1, 1]),
            (State::Standby, CLIENT, [1, 1, 0]),
            (State::Ready, STRANGER, [1, 0, 0]),
        ] {
            let (mut rig, counts) = counting();
            rig.stand(state, Some(CLIENT));
            say_everything(&mut rig, source);
            let counted = [0, 1, 2].map(|i: usize| counts[i].load(Ordering::Relaxed));
            assert_eq!(counted, expected, "{state}, {source}");
        }
    }

    #[test]
    fn what_moves_is_stopped_when_the_component_may_no_longer_act() {
        let (mut rig, counts) = counting();
        let stops = || counts[3].load(Ordering::Relaxed);
        let before = stops();
        rig.stand(State::Ready, Some(CLIENT));
        assert_eq!(stops(), before, "nothing has changed");
        rig.stand(State::Emergency, Some(CLIENT));
        assert_eq!(stops(), before + 1);
        rig.stand(State::Ready, Some(CLIENT));
        rig.stand(State::Ready, Some(STRANGER));
        assert_eq!(stops(), before + 2, "another client is in control");
    }
}
