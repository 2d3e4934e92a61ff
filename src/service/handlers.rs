//! An application's own service, made of one function per message.

use std::any::TypeId;
use std::collections::{BTreeMap, BTreeSet};
use std::fmt;
use std::time::Instant;

use super::publication::Latest;
use super::{
    Context, Handled, Hazards, MotionGuard, MotionPolicy, Publication, Service, Standing,
    StopCause, Validity, code_of,
};
use crate::address::JausId;
use crate::codec::{DecodeError, Message, Query, ServiceId};
use crate::endpoint::Received;

type Stop = Box<dyn FnMut(&mut Context<'_>) + Send>;

/// The handlers of one message code, each for the layout that is a type.
type Layouts = Vec<(TypeId, Box<dyn Handler>)>;

/// A handler of one layout of a message.
trait Handler: Send {
    /// Handles a message, or fails if its octets are no message of its type.
    fn handle(
        &mut self,
        message: &Received,
        context: &mut Context<'_>,
    ) -> Result<Taken, DecodeError>;

    /// Takes a published report; returns whether it answers queries with it from now on.
    fn publish(&mut self, _publication: &Publication) -> bool {
        false
    }
}

impl<F> Handler for F
where
    F: FnMut(&Received, &mut Context<'_>) -> Result<Taken, DecodeError> + Send,
{
    fn handle(
        &mut self,
        message: &Received,
        context: &mut Context<'_>,
    ) -> Result<Taken, DecodeError> {
        self(message, context)
    }
}

impl<Q: Query> Handler for Latest<Q> {
    fn handle(
        &mut self,
        message: &Received,
        context: &mut Context<'_>,
    ) -> Result<Taken, DecodeError> {
        self.answer(message, context).map(|()| Taken::Message)
    }

    fn publish(&mut self, publication: &Publication) -> bool {
        self.publish(publication)
    }
}

/// Result of a handler.
#[derive(Clone, Copy)]
enum Taken {
    /// It moves nothing, or its sender may not command.
    Message,
    /// A command that was carried out and is in force for this validity.
    Command(Validity),
}

/// A service whose messages are handled by functions of the application.
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
/// | method | for messages that | accepted from |
/// |---|---|---|
/// | [`command`](Self::command) | move something | the client in control while the component is ready |
/// | [`configure`](Self::configure) | configure something | the client in control |
/// | [`receive`](Self::receive) | do neither | anyone |
///
/// A command that moves something needs a stop action, [`on_stop`](Self::on_stop). It is called
/// when the command is not repeated within 500 ms (or as set by [`Validity`] and [`MotionPolicy`]),
/// when control or readiness is lost, in an emergency, and when the component ends. Attaching a
/// command fails if the component has no Management or the handlers have no stop action.
///
/// A command of a service that inherits Access Control cannot be accepted from anyone by mistake:
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
/// A component can offer several versions of a service. If versions lay out a message differently
/// under the same code, each layout is a type with its own handler. A message does not carry its
/// version. So the layouts are tried in the order in which they were added, newest first; the first
/// that fits the octets exactly handles the message.
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
    by_code: BTreeMap<u16, Layouts>,
    told: BTreeSet<u16>,
    stops: Vec<Stop>,
    guard: MotionGuard,
    hazards: Hazards,
}

impl Handlers {
    /// A service without handlers.
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

    /// Also offers another version, usually an older one whose clients it understands.
    #[must_use]
    pub fn and_version(mut self, id: ServiceId) -> Self {
        self.offers.push(id);
        self
    }

    /// Answers every query of type `Q` with the latest report that the application
    /// [publishes](super::Stack::publish), and notifies subscribers of each. The report is encoded once for
    /// all clients that request the same fields.
    ///
    /// Until the first report is published, the answer is a report without values. If the
    /// definition requires values, the query has no answer until then, and events are rejected.
    ///
    /// ```
    /// use jaus::messages::mobility::{QueryVelocityState, velocity_state_sensor};
    /// use jaus::service::Handlers;
    ///
    /// let speedometer =
    ///     Handlers::new(velocity_state_sensor::LATEST).publishes::<QueryVelocityState>();
    /// ```
    #[must_use]
    pub fn publishes<Q: Query>(mut self) -> Self {
        self.handle::<Q>(Latest::<Q>::new());
        self
    }

    /// Answers every query of type `Q` with a report that is made for it. The report goes to the sender of the query, and to
    /// subscribers, without the optional fields that they did not
    /// [request](Query::drop_unrequested). To report in the layout of an older version,
    /// [`receive`](Self::receive) the query and [reply](Context::reply).
    #[must_use]
    pub fn answer<Q: Query>(
        mut self,
        mut function: impl FnMut(Q) -> Q::Report + Send + 'static,
    ) -> Self {
        self.handle::<Q>(move |received: &Received, context: &mut Context<'_>| {
            let query = Q::decode(&received.payload)?;
            let mut report = function(query.clone());
            query.drop_unrequested(&mut report);
            context.reply(received, &report);
            Ok(Taken::Message)
        });
        self
    }

    /// Handles every message of type `M` from any sender. Replies go through the context.
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
                "this is a command of a service with Access Control: register it with `command` \
                 or `configure`, or for any client with `receive_unguarded`"
            );
        }
        self.receive_unguarded(function)
    }

    /// Like [`receive`](Self::receive), but also for a command that needs control: anyone may send
    /// it at any time, and nothing stops it.
    #[must_use]
    pub fn receive_unguarded<M: Message>(
        self,
        function: impl FnMut(M, &Received, &mut Context<'_>) + Send + 'static,
    ) -> Self {
        self.receive_if(|_, _| true, Taken::Message, function)
    }

    /// Handles messages of type `M` from the client in control, and ignores all others: for
    /// commands that configure something. The component must offer Access Control or Management.
    /// Not for commands that move something: the command is obeyed in every state, and nothing
    /// stops it.
    #[must_use]
    pub fn configure<M: Message>(
        mut self,
        function: impl FnMut(M, &Received, &mut Context<'_>) + Send + 'static,
    ) -> Self {
        self.hazards.set_up_by = Some(M::NAME);
        self.receive_if(Standing::obeys, Taken::Message, function)
    }

    /// Handles messages of type `M` from the client in control while the component is ready, and
    /// ignores all others: for commands that move something. The component must offer Management,
    /// and there must be a stop action, [`on_stop`](Self::on_stop).
    ///
    /// The command is valid as given by [`Validity::of`] for its code: 500 ms unless it is one of
    /// the standard's vectors or goals.
    #[must_use]
    pub fn command<M: Message>(
        self,
        function: impl FnMut(M, &Received, &mut Context<'_>) + Send + 'static,
    ) -> Self {
        self.command_valid(Validity::of(M::CODE), function)
    }

    /// Like [`command`](Self::command), with an explicit validity.
    #[must_use]
    pub fn command_valid<M: Message>(
        mut self,
        validity: Validity,
        function: impl FnMut(M, &Received, &mut Context<'_>) + Send + 'static,
    ) -> Self {
        self.hazards.acts_on = Some(M::NAME);
        self.receive_if(Standing::acts_for, Taken::Command(validity), function)
    }

    /// Sets how long brief commands are valid; the default is 500 ms.
    #[must_use]
    pub const fn motion_policy(mut self, policy: MotionPolicy) -> Self {
        self.guard.set_policy(policy);
        self
    }

    /// Calls a function whenever the motion that commands have started must stop: at the end of a
    /// command's validity, when control or readiness is lost, in an emergency, and when the
    /// component ends. It is also called when nothing moves.
    #[must_use]
    pub fn on_stop(mut self, stop: impl FnMut(&mut Context<'_>) + Send + 'static) -> Self {
        self.hazards.stops = true;
        self.stops.push(Box::new(stop));
        self
    }

    /// Allows clients to run commands of type `M` as command events (AS5710 1.1). The application
    /// must report the end of each command with [`Context::ended`] or
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
        self.handle::<M>(move |received: &Received, context: &mut Context<'_>| {
            if may(context.standing(), received.source) {
                function(M::decode(&received.payload)?, received, context);
                return Ok(taken);
            }
            tracing::debug!(source = %received.source, message = M::NAME, "ignored: sender not in \
                control");
            Ok(Taken::Message)
        });
        self
    }

    fn stop(&mut self, context: &mut Context<'_>) {
        for stop in &mut self.stops {
            stop(context);
        }
    }

    /// Sets the handler of a layout, after those of other layouts with the same code.
    fn handle<M: Message>(&mut self, handler: impl Handler + 'static) {
        let (layout, handler): (_, Box<dyn Handler>) = (TypeId::of::<M>(), Box::new(handler));
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
            match handler.handle(message, context) {
                Ok(Taken::Message) => break,
                Ok(Taken::Command(validity)) => {
                    self.guard.accept(now, message.source, validity);
                    break;
                }
                Err(error) => {
                    tracing::debug!(source = %message.source, %error, "cannot decode the message");
                }
            }
        }
        Handled::Yes
    }

    fn handle_publication(
        &mut self,
        publication: &Publication,
        context: &mut Context<'_>,
    ) -> Handled {
        let mut handled = Handled::No;
        for (&code, layouts) in &mut self.by_code {
            for (_, handler) in layouts {
                if handler.publish(publication) {
                    context.answer_changed(code);
                    handled = Handled::Yes;
                }
            }
        }
        handled
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
    use crate::messages::core::report_time::{DateStamp, TimeStamp};
    use crate::messages::core::{
        QueryTime, QueryTimeout, ReportTime, SetAuthority, list_manager, time,
    };
    use crate::service::State;
    use crate::service::rig::{CLIENT, Rig, STRANGER};

    /// Handlers that count unguarded messages, configuration, commands and stops.
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
    fn an_answer_has_the_optional_fields_that_the_query_requests() {
        let everything = ReportTime {
            time_stamp: Some(TimeStamp::default()),
            date_stamp: Some(DateStamp::default()),
        };
        let clock = Handlers::new(time::LATEST).answer(move |_: QueryTime| everything.clone());
        let mut rig = Rig::new(vec![Box::new(clock)]);
        for (query, has_time, has_date) in [
            (QueryTime::all(), true, true),
            (QueryTime::none(), false, false),
            (QueryTime::none().with_time_stamp(), true, false),
            (QueryTime::none().with_date_stamp(), false, true),
        ] {
            let report: ReportTime = rig.ask(&query).unwrap();
            let has = (report.time_stamp.is_some(), report.date_stamp.is_some());
            assert_eq!(has, (has_time, has_date), "{query:?}");
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
