//! An application's own service: messages reach it through the guard of its commands.

use std::collections::BTreeSet;
use std::fmt;
use std::time::Instant;

use super::functions::Functions;
use super::{
    Call, Context, Handled, Hazards, MotionGuard, MotionPolicy, Publication, Service, Standing,
    StopCause, code_of,
};
use crate::address::JausId;
use crate::codec::{Message, Provider, ServiceId};
use crate::endpoint::Received;

/// A service whose messages are handled by functions of the application.
///
/// ```
/// use jaus::messages::mobility::{
///     QueryVelocityState, QueryVelocityStateExt, ReportVelocityState, velocity_state_sensor,
/// };
/// use jaus::service::Handlers;
///
/// let speedometer = Handlers::new(velocity_state_sensor::LATEST)
///     .answer(|_query: QueryVelocityState| ReportVelocityState::default())
///     .declines::<QueryVelocityStateExt>();
/// ```
///
/// # A type instead of functions
///
/// For every service, [`messages`](crate::messages) has a trait with a method for each message.
/// [`Handlers::of`] offers a type that implements it. The definition of the service decides which
/// messages are commands, and its state machine, if there is one, when they are accepted.
///
/// ```
/// use jaus::messages::mobility::{QueryVelocityState, ReportVelocityState, velocity_state_sensor};
/// # use jaus::messages::mobility::{QueryVelocityStateExt, ReportVelocityStateExt};
/// use jaus::service::{Call, Handlers};
///
/// struct Speedometer {
///     speed: f64,
/// }
///
/// impl velocity_state_sensor::Service<Call<'_>> for Speedometer {
///     fn query_velocity_state(
///         &mut self,
///         _: QueryVelocityState,
///         _: &mut Call<'_>,
///     ) -> Option<ReportVelocityState> {
///         let mut report = ReportVelocityState::default();
///         report.set_velocity_x_m_per_s(self.speed).ok()?;
///         Some(report)
///     }
/// #
/// #     fn query_velocity_state_ext(
/// #         &mut self,
/// #         _: QueryVelocityStateExt,
/// #         _: &mut Call<'_>,
/// #     ) -> Option<ReportVelocityStateExt> {
/// #         None
/// #     }
/// }
///
/// let server = velocity_state_sensor::Server::new(Speedometer { speed: 0.5 });
/// let speedometer = Handlers::of(server);
/// ```
///
/// # Commands of functions
///
/// | method | for messages that | accepted from |
/// |---|---|---|
/// | [`command`](Self::command) | move something | the client in control while the component is ready |
/// | [`configure`](Self::configure) | configure something | the client in control |
/// | [`receive`](Self::receive) | do neither | anyone |
///
/// A command that moves something needs a stop action, [`on_stop`](Self::on_stop). It is called
/// when the command is not repeated within 500 ms (or as set by [`Validity`](super::Validity) and
/// [`MotionPolicy`]), when control or readiness is lost, in an emergency, and when the component
/// ends. Attaching a command fails if the component has no Management or the handlers have no stop
/// action.
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
pub struct Handlers<P = Functions> {
    pub(super) provider: P,
    /// Passes a published report on; returns the codes of the queries that it answers.
    pub(super) publish: fn(&mut P, &Publication) -> Vec<u16>,
    guard: MotionGuard,
    /// Codes of the commands whose end is reported.
    reported: BTreeSet<u16>,
    timers: Timers,
    last_call: Option<Instant>,
}

impl<P> Handlers<P> {
    /// A service that a generated `Server` handles.
    #[must_use]
    pub fn of(provider: P) -> Self {
        Self {
            provider,
            publish: |_, _| Vec::new(),
            guard: MotionGuard::default(),
            reported: BTreeSet::new(),
            timers: Timers::default(),
            last_call: None,
        }
    }

    /// Sets how long brief commands are valid; the default is 500 ms.
    #[must_use]
    pub const fn motion_policy(mut self, policy: MotionPolicy) -> Self {
        self.guard.set_policy(policy);
        self
    }

    /// Allows clients to run commands of type `M` as command events (AS5710 1.1). The application
    /// must report the end of each command with [`Context::ended`] or
    /// [`Stack::end_command`](super::Stack::end_command).
    #[must_use]
    pub fn tell_end_of<M: Message>(mut self) -> Self {
        self.reported.insert(M::CODE);
        self
    }

    fn follow(&mut self, now: Instant, context: &mut Context<'_>)
    where
        P: for<'a> Provider<Call<'a>>,
    {
        let path = context.standing().path();
        self.call(now, None, context, |provider, call| {
            provider.follow(path, call);
        });
    }

    /// Calls the provider, and puts an accepted command in force.
    fn call<'c, T>(
        &mut self,
        now: Instant,
        received: Option<&'c Received>,
        context: &'c mut Context<'_>,
        with: impl FnOnce(&mut P, &mut Call<'_>) -> T,
    ) -> T {
        self.last_call = Some(now);
        let mut call = Call::new(now, received, context.reborrow(), &mut self.timers);
        let result = with(&mut self.provider, &mut call);
        if let Some((owner, validity)) = call.command() {
            self.guard.accept(now, owner, validity);
        }
        result
    }
}

impl<P: fmt::Debug> fmt::Debug for Handlers<P> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut debug = f.debug_struct("Handlers");
        debug
            .field("provider", &self.provider)
            .finish_non_exhaustive()
    }
}

impl<P> Service for Handlers<P>
where
    P: for<'a> Provider<Call<'a>> + Send,
{
    fn offers(&self) -> Vec<ServiceId> {
        self.provider.offers()
    }

    fn handle_message(
        &mut self,
        now: Instant,
        message: &Received,
        context: &mut Context<'_>,
    ) -> Handled {
        let Some(code) = code_of(&message.payload) else {
            return Handled::No;
        };
        let receive = |provider: &mut P, call: &mut Call<'_>| provider.receive(code, call);
        match self.call(now, Some(message), context, receive) {
            None => return Handled::No,
            Some(Ok(())) => {}
            Some(Err(error)) => {
                tracing::debug!(source = %message.source, %error, "cannot decode the message");
            }
        }
        Handled::Yes
    }

    fn handle_publication(
        &mut self,
        publication: &Publication,
        context: &mut Context<'_>,
    ) -> Handled {
        let queries = (self.publish)(&mut self.provider, publication);
        for &query in &queries {
            context.answer_changed(query);
        }
        match queries.is_empty() {
            true => Handled::No,
            false => Handled::Yes,
        }
    }

    fn handle_timeout(&mut self, now: Instant, context: &mut Context<'_>) {
        self.follow(now, context);
        while let Some(event) = self.timers.pop(now) {
            self.call(now, None, context, |provider, call| {
                provider.handle_event(event, call);
            });
        }
        self.guard.note_life(|owner| context.last_sign(owner));
        if self.guard.expire(now).is_some() {
            self.call(now, None, context, |provider, call| provider.stop(call));
        }
    }

    fn handle_stop(&mut self, cause: &StopCause, context: &mut Context<'_>) {
        self.guard.stop(cause.clone());
        // Before the first call nothing moves.
        if let Some(now) = self.last_call {
            self.call(now, None, context, |provider, call| provider.stop(call));
        }
    }

    fn handle_standing(&mut self, now: Instant, _: &Standing, context: &mut Context<'_>) {
        self.follow(now, context);
    }

    fn depends_on(&self) -> Option<JausId> {
        self.guard.depends_on()
    }

    fn is_moving(&self) -> bool {
        self.guard.is_active()
    }

    fn hazards(&self) -> Hazards {
        self.provider.hazards()
    }

    fn unhandled_version(&self) -> Option<(ServiceId, &'static str)> {
        self.provider.unhandled_version()
    }

    fn unanswered_query(&self) -> Option<(ServiceId, &'static str)> {
        self.provider.unanswered_query()
    }

    fn answers(&self, query: u16) -> bool {
        self.provider.answers(query)
    }

    fn tells_end_of(&self, command: u16) -> bool {
        self.reported.contains(&command)
    }

    fn poll_timeout(&self) -> Option<Instant> {
        let ends = [self.guard.expires_at(), self.timers.next()];
        ends.into_iter().flatten().min()
    }
}

/// The events that a service's state machine is to get later.
#[derive(Debug, Default)]
pub(super) struct Timers(Vec<(Instant, u16)>);

impl Timers {
    /// Sets the time of an event, in place of an earlier one.
    pub(super) fn set(&mut self, at: Instant, event: u16) {
        self.cancel(event);
        self.0.push((at, event));
    }

    pub(super) fn cancel(&mut self, event: u16) {
        self.0.retain(|(_, known)| *known != event);
    }

    fn next(&self) -> Option<Instant> {
        self.0.iter().map(|(at, _)| *at).min()
    }

    /// Removes and returns the first event that is due.
    fn pop(&mut self, now: Instant) -> Option<u16> {
        let next = self.next().filter(|at| *at <= now)?;
        let place = self.0.iter().position(|(at, _)| *at == next)?;
        Some(self.0.remove(place).1)
    }
}
