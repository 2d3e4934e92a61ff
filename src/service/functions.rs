//! An application's own service, made of one function per message.

use std::any::TypeId;
use std::collections::{BTreeMap, BTreeSet};
use std::fmt;

use super::publication::Latest;
use super::undecoded::unanswered_query;
use super::{Call, Context, Handlers, Hazards, Publication, Standing, Validity};
use crate::address::JausId;
use crate::codec::machine::Outcome;
use crate::codec::{self, Call as _, DecodeError, Message, Query, ServiceId};
use crate::endpoint::Received;

type Stop = Box<dyn FnMut(&mut Context<'_>) + Send>;

/// Handles one layout of a message.
trait Function: Send {
    /// Handles a message, or fails if its octets are no message of its type.
    fn handle(&mut self, call: &mut Call<'_>) -> Result<(), DecodeError>;

    /// Takes a published report; returns whether it answers queries with it from now on.
    fn publish(&mut self, _publication: &Publication) -> bool {
        false
    }
}

impl<F> Function for F
where
    F: FnMut(&mut Call<'_>) -> Result<(), DecodeError> + Send,
{
    fn handle(&mut self, call: &mut Call<'_>) -> Result<(), DecodeError> {
        self(call)
    }
}

impl<Q: Query> Function for Latest<Q> {
    fn handle(&mut self, call: &mut Call<'_>) -> Result<(), DecodeError> {
        call.received()
            .map_or(Ok(()), |received| self.answer(received, call))
    }

    fn publish(&mut self, publication: &Publication) -> bool {
        self.publish(publication)
    }
}

/// One function per message: what [`Handlers::new`] begins with.
#[derive(Default)]
pub struct Functions {
    offers: Vec<ServiceId>,
    by_code: BTreeMap<u16, Vec<Layout>>,
    queries: BTreeSet<u16>,
    declined: BTreeSet<u16>,
    stops: Vec<Stop>,
    hazards: Hazards,
}

/// The function of one layout of a message.
struct Layout {
    of: TypeId,
    name: &'static str,
    /// The services that have another layout of the message, or of its report.
    others: [&'static [ServiceId]; 2],
    function: Box<dyn Function>,
}

impl Layout {
    /// Whether it is not the layout of a service.
    fn is_not_of(&self, service: ServiceId) -> bool {
        self.others.iter().any(|others| others.contains(&service))
    }
}

impl Handlers {
    /// A service without functions.
    #[must_use]
    pub fn new(id: ServiceId) -> Self {
        let mut handlers = Self::of(Functions {
            offers: vec![id],
            ..Functions::default()
        });
        handlers.publish = Functions::publish;
        handlers
    }

    /// Also offers another version, usually an older one whose clients it understands.
    #[must_use]
    pub fn and_version(mut self, id: ServiceId) -> Self {
        self.provider.offers.push(id);
        self
    }

    /// Answers every query of type `Q` with the latest report that the application
    /// [publishes](super::Stack::publish), and notifies subscribers of each. The report is encoded
    /// once for all clients that request the same fields.
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
        self.handle_query::<Q>(Latest::<Q>::new());
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
        self.handle_query::<Q>(move |call: &mut Call<'_>| {
            call.answer(|query, _| Some(function(query)))
        });
        self
    }

    /// Leaves every query of type `Q` without an answer. A component can be attached only if each
    /// query that a service of [`messages`](crate::messages) defines is answered or declined.
    ///
    /// ```
    /// use jaus::messages::mobility::{QueryVelocityState, QueryVelocityStateExt, velocity_state_sensor};
    /// use jaus::service::Handlers;
    ///
    /// let speedometer = Handlers::new(velocity_state_sensor::LATEST)
    ///     .publishes::<QueryVelocityState>()
    ///     .declines::<QueryVelocityStateExt>();
    /// ```
    #[must_use]
    pub fn declines<Q: Query>(mut self) -> Self {
        self.provider.declined.insert(Q::CODE);
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
        self.receive_if(|_, _| true, None, function)
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
        self.provider.hazards.set_up_by = Some(M::NAME);
        self.receive_if(Standing::obeys, None, function)
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
        self.provider.hazards.acts_on = Some(M::NAME);
        self.receive_if(Standing::acts_for, Some(validity), function)
    }

    /// Calls a function whenever the motion that commands have started must stop: at the end of a
    /// command's validity, when control or readiness is lost, in an emergency, and when the
    /// component ends. It is also called when nothing moves.
    #[must_use]
    pub fn on_stop(mut self, stop: impl FnMut(&mut Context<'_>) + Send + 'static) -> Self {
        self.provider.hazards.stops = true;
        self.provider.stops.push(Box::new(stop));
        self
    }

    fn receive_if<M: Message>(
        mut self,
        may: fn(&Standing, JausId) -> bool,
        validity: Option<Validity>,
        mut function: impl FnMut(M, &Received, &mut Context<'_>) + Send + 'static,
    ) -> Self {
        self.handle::<M>(&[], move |call: &mut Call<'_>| {
            let Some(received) = call.received() else {
                return Ok(());
            };
            if let Some(validity) = validity {
                call.set_validity(validity);
            }
            call.guarded(may, validity.is_some(), |message, call| {
                function(message, received, call);
                Outcome::Handled
            })
        });
        self
    }

    fn handle_query<Q: Query>(&mut self, function: impl Function + 'static) {
        self.provider.queries.insert(Q::CODE);
        self.handle::<Q>(Q::Report::OTHER_LAYOUTS, function);
    }

    /// Sets the handler of a layout, after those of other layouts with the same code. `reports` are
    /// the services with another layout of the report.
    fn handle<M: Message>(
        &mut self,
        reports: &'static [ServiceId],
        function: impl Function + 'static,
    ) {
        let layout = Layout {
            of: TypeId::of::<M>(),
            name: M::NAME,
            others: [M::OTHER_LAYOUTS, reports],
            function: Box::new(function),
        };
        let layouts = self.provider.by_code.entry(M::CODE).or_default();
        match layouts.iter_mut().find(|known| known.of == layout.of) {
            Some(place) => *place = layout,
            None => layouts.push(layout),
        }
    }
}

impl Functions {
    /// Passes a published report on; returns the codes of the queries that it answers.
    fn publish(&mut self, publication: &Publication) -> Vec<u16> {
        let takes = |layouts: &mut Vec<Layout>| {
            let taken = layouts
                .iter_mut()
                .map(|it| it.function.publish(publication));
            taken.fold(false, |any, it| any | it)
        };
        let queries = self.by_code.iter_mut();
        queries
            .filter_map(|(&code, layouts)| takes(layouts).then_some(code))
            .collect()
    }
}

impl fmt::Debug for Functions {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Functions")
            .field("offers", &self.offers)
            .field("codes", &self.by_code.keys())
            .finish()
    }
}

impl<'a> codec::Provider<Call<'a>> for Functions {
    fn offers(&self) -> Vec<ServiceId> {
        self.offers.clone()
    }

    fn hazards(&self) -> Hazards {
        self.hazards.clone()
    }

    fn unhandled_version(&self) -> Option<(ServiceId, &'static str)> {
        self.offers.iter().find_map(|&offer| {
            let mut messages = self.by_code.values();
            let unhandled = messages.find(|it| it.iter().all(|layout| layout.is_not_of(offer)))?;
            Some((offer, unhandled.first()?.name))
        })
    }

    fn unanswered_query(&self) -> Option<(ServiceId, &'static str)> {
        let is_known = |code: &u16| self.by_code.contains_key(code) || self.declined.contains(code);
        unanswered_query(&self.offers, is_known)
    }

    fn answers(&self, query: u16) -> bool {
        self.queries.contains(&query)
    }

    fn receive(&mut self, code: u16, call: &mut Call<'a>) -> Option<Result<(), DecodeError>> {
        let layouts = self.by_code.get_mut(&code)?.iter_mut();
        let mut result = Ok(());
        for layout in layouts {
            result = layout.function.handle(call);
            if result.is_ok() {
                break;
            }
        }
        Some(result)
    }

    fn stop(&mut self, call: &mut Call<'a>) {
        for stop in &mut self.stops {
            stop(call);
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;
    use std::sync::atomic::{AtomicU32, Ordering};

    use super::*;
    use crate::messages;
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
            .command(move |_: messages::core::Reset, _, _| count(&acted))
            .on_stop(move |_| count(&stopped));
        (Rig::new(vec![Box::new(handlers)]), counts)
    }

    fn say_everything(rig: &mut Rig, source: JausId) {
        rig.send(source, &QueryTimeout);
        rig.send(source, &SetAuthority::default());
        rig.send(source, &messages::core::Reset);
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
