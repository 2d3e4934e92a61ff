//! An application's own service whose messages are octets: for programs that read definitions at run
//! time, and for the interfaces to other languages.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt;

use bytes::Bytes;

use super::{Call, Context, Handlers, Hazards, Standing, Validity};
use crate::address::JausId;
use crate::codec::{self, DecodeError, Registry, ServiceId, ServiceInfo};
use crate::endpoint::Received;
use crate::messages::{self, core};

type Function = Box<dyn FnMut(&mut Call<'_>) + Send>;
type Stop = Box<dyn FnMut(&mut Context<'_>) + Send>;

/// One function per message code: what [`Handlers::undecoded`] begins with.
#[derive(Default)]
pub struct UndecodedFunctions {
    offers: Vec<ServiceId>,
    by_code: BTreeMap<u16, Function>,
    queries: BTreeSet<u16>,
    declined: BTreeSet<u16>,
    stops: Vec<Stop>,
    hazards: Hazards,
}

/// A command of a service with Access Control was to be accepted from any client.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error(
    "{command} ({code:04X}h) is a command of a service with Access Control: handle it as a command \
     or as a setting, so that only the client in control can send it"
)]
pub struct NeedsControl {
    /// Its message code.
    pub code: u16,
    /// Its name.
    pub command: &'static str,
}

impl Handlers<UndecodedFunctions> {
    /// A service whose functions get and return octets, which begin with the message code. The
    /// octets are as received: no definition is checked.
    ///
    /// ```
    /// use bytes::Bytes;
    /// use jaus::messages::mobility::velocity_state_sensor;
    /// use jaus::service::Handlers;
    ///
    /// // Query and Report Velocity State; the report has no fields.
    /// let speedometer = Handlers::undecoded(velocity_state_sensor::LATEST)
    ///     .answer(0x2404, |_query| Some(Bytes::from_static(&[0x04, 0x44, 0, 0])))
    ///     .declines(0x24A4);
    /// ```
    #[must_use]
    pub fn undecoded(id: ServiceId) -> Self {
        Self::of(UndecodedFunctions {
            offers: vec![id],
            ..UndecodedFunctions::default()
        })
    }

    /// Also offers another version, usually an older one whose clients it understands.
    #[must_use]
    pub fn and_version(mut self, id: ServiceId) -> Self {
        self.provider.offers.push(id);
        self
    }

    /// Answers every query with this code with the octets that the function returns, if any, both
    /// to the sender and to subscribers. The function decides which optional fields the query
    /// requests.
    #[must_use]
    pub fn answer(
        mut self,
        query: u16,
        mut function: impl FnMut(&Received) -> Option<Bytes> + Send + 'static,
    ) -> Self {
        self.provider.queries.insert(query);
        self.handle(query, move |call| {
            if let Some(received) = call.received()
                && let Some(report) = function(received)
            {
                call.reply_octets(received, report);
            }
        });
        self
    }

    /// Leaves every query with this code without an answer. A component can be attached only if each
    /// query that a service of [`messages`] defines is answered or declined.
    #[must_use]
    pub fn declines(mut self, query: u16) -> Self {
        self.provider.declined.insert(query);
        self
    }

    /// Handles every message with this code from any sender.
    ///
    /// # Errors
    /// If a service of [`messages`] defines it as a command that needs control.
    pub fn receive(
        mut self,
        code: u16,
        function: impl FnMut(&Received, &mut Context<'_>) + Send + 'static,
    ) -> Result<Self, NeedsControl> {
        if let Some(command) = self.provider.command_that_needs_control(code) {
            return Err(NeedsControl { code, command });
        }
        self.receive_if(code, |_, _| true, None, function);
        Ok(self)
    }

    /// Handles messages with this code from the client in control, and ignores all others: for
    /// commands that configure something. Otherwise as for messages with types.
    #[must_use]
    pub fn configure(
        mut self,
        code: u16,
        function: impl FnMut(&Received, &mut Context<'_>) + Send + 'static,
    ) -> Self {
        self.provider.hazards.set_up_by = Some(name_of(code));
        self.receive_if(code, Standing::obeys, None, function);
        self
    }

    /// Handles messages with this code from the client in control while the component is ready, and
    /// ignores all others: for commands that move something. Otherwise as for messages with types.
    #[must_use]
    pub fn command(
        mut self,
        code: u16,
        validity: Validity,
        function: impl FnMut(&Received, &mut Context<'_>) + Send + 'static,
    ) -> Self {
        self.provider.hazards.acts_on = Some(name_of(code));
        self.receive_if(code, Standing::acts_for, Some(validity), function);
        self
    }

    /// Calls a function whenever the motion that commands have started must stop, and when nothing
    /// moves.
    #[must_use]
    pub fn on_stop(mut self, stop: impl FnMut(&mut Context<'_>) + Send + 'static) -> Self {
        self.provider.hazards.stops = true;
        self.provider.stops.push(Box::new(stop));
        self
    }

    fn receive_if(
        &mut self,
        code: u16,
        may: fn(&Standing, JausId) -> bool,
        validity: Option<Validity>,
        mut function: impl FnMut(&Received, &mut Context<'_>) + Send + 'static,
    ) {
        let name = name_of(code);
        self.handle(code, move |call| {
            call.guarded_undecoded(may, validity, name, &mut function);
        });
    }

    fn handle(&mut self, code: u16, function: impl FnMut(&mut Call<'_>) + Send + 'static) {
        self.provider.by_code.insert(code, Box::new(function));
    }
}

impl UndecodedFunctions {
    /// The name of the message with this code, if an offered service defines it as a command and
    /// inherits Access Control.
    fn command_that_needs_control(&self, code: u16) -> Option<&'static str> {
        let registry = messages::registry();
        self.offers.iter().find_map(|&offer| {
            let info = find(&registry, offer)?;
            let is_guarded = inherits_access_control(&registry, info);
            let message = registry.in_service(offer, code)?;
            (is_guarded && message.is_command).then_some(message.name)
        })
    }
}

/// The name of a message for people.
fn name_of(code: u16) -> &'static str {
    let known = messages::registry().by_code(code).next();
    known.map_or("a message of its own", |info| info.name)
}

fn find(registry: &Registry, id: ServiceId) -> Option<&'static ServiceInfo> {
    registry.services().find(|info| info.id == id)
}

fn inherits_access_control(registry: &Registry, info: &ServiceInfo) -> bool {
    info.inherits_from.is_some_and(|parent| {
        parent.urn == core::access_control::URN
            || find(registry, parent).is_some_and(|it| inherits_access_control(registry, it))
    })
}

impl fmt::Debug for UndecodedFunctions {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("UndecodedFunctions")
            .field("offers", &self.offers)
            .field("codes", &self.by_code.keys())
            .finish()
    }
}

impl<'a> codec::Provider<Call<'a>> for UndecodedFunctions {
    fn offers(&self) -> Vec<ServiceId> {
        self.offers.clone()
    }

    fn hazards(&self) -> Hazards {
        self.hazards.clone()
    }

    fn unanswered_query(&self) -> Option<(ServiceId, &'static str)> {
        let is_known = |code: &u16| self.by_code.contains_key(code) || self.declined.contains(code);
        unanswered_query(&self.offers, is_known)
    }

    fn answers(&self, query: u16) -> bool {
        self.queries.contains(&query)
    }

    fn receive(&mut self, code: u16, call: &mut Call<'a>) -> Option<Result<(), DecodeError>> {
        self.by_code.get_mut(&code)?(call);
        Some(Ok(()))
    }

    fn stop(&mut self, call: &mut Call<'a>) {
        for stop in &mut self.stops {
            stop(call);
        }
    }
}

/// The first query of the offered services that is not known, and its service.
pub(super) fn unanswered_query(
    offers: &[ServiceId],
    is_known: impl Fn(&u16) -> bool,
) -> Option<(ServiceId, &'static str)> {
    let registry = messages::registry();
    let of_ours = |info: &&ServiceInfo| offers.contains(&info.id);
    let services = registry.services().filter(of_ours);
    let mut messages = services.flat_map(|info| info.inputs.iter().map(|&code| (info.id, code)));
    let (service, query) =
        messages.find(|(_, code)| registry.report_of(*code).is_some() && !is_known(code))?;
    Some((service, registry.in_service(service, query)?.name))
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;
    use std::sync::atomic::{AtomicU32, Ordering};
    use std::time::Duration;

    use super::*;
    use crate::codec::Message;
    use crate::messages::core::{QueryTime, ReportTime, Reset, SetTime, time, transport};
    use crate::service::rig::{CLIENT, Rig, STRANGER};
    use crate::service::{Service, State};

    #[test]
    fn a_query_is_answered_with_the_octets_of_its_function() {
        let report = ReportTime::default().encode().unwrap();
        let clock = Handlers::undecoded(time::LATEST)
            .answer(QueryTime::CODE, move |_| Some(report.clone()));
        let mut rig = Rig::new(vec![Box::new(clock)]);
        let answer: Option<ReportTime> = rig.ask(&QueryTime::all());
        assert_eq!(answer, Some(ReportTime::default()));
    }

    #[test]
    fn a_command_is_taken_from_the_client_in_control_and_its_motion_ends_in_time() {
        let counts: [Arc<AtomicU32>; 2] = Default::default();
        let [acted, stopped] = counts.clone();
        let count = |counter: &AtomicU32| _ = counter.fetch_add(1, Ordering::Relaxed);
        let driver = Handlers::undecoded(transport::LATEST)
            .command(Reset::CODE, Validity::Brief, move |_, _| count(&acted))
            .on_stop(move |_| count(&stopped));
        let mut rig = Rig::new(vec![Box::new(driver)]);
        rig.stand(State::Ready, Some(CLIENT));
        let counted = || counts.each_ref().map(|it| it.load(Ordering::Relaxed));
        rig.send(STRANGER, &Reset);
        assert_eq!(counted()[0], 0, "another client");
        let [_, stops] = counted();
        rig.send(CLIENT, &Reset);
        rig.run(Duration::from_millis(499));
        assert_eq!(counted(), [1, stops]);
        rig.run(Duration::from_millis(1));
        assert_eq!(counted(), [1, stops + 1]);
    }

    #[test]
    fn a_command_that_needs_control_is_not_accepted_from_everyone() {
        let refused = Handlers::undecoded(time::LATEST).receive(SetTime::CODE, |_, _| {});
        let error = refused.unwrap_err();
        assert_eq!((error.code, error.command), (SetTime::CODE, SetTime::NAME));
        assert!(
            Handlers::undecoded(transport::LATEST)
                .receive(SetTime::CODE, |_, _| {})
                .is_ok()
        );
    }

    #[test]
    fn hazards_and_unanswered_queries_are_found_as_with_types() {
        let clock = || Handlers::undecoded(time::LATEST);
        let query = Some((time::LATEST, QueryTime::NAME));
        assert_eq!(clock().unanswered_query(), query);
        assert_eq!(clock().declines(QueryTime::CODE).unanswered_query(), None);
        let set = clock().configure(SetTime::CODE, |_, _| {}).hazards();
        assert_eq!(set.set_up_by, Some(SetTime::NAME));
        let driven = clock().command(0xD001, Validity::Brief, |_, _| {});
        assert!(driven.hazards().acts_on.is_some() && !driven.hazards().stops);
        assert!(driven.on_stop(|_| {}).hazards().stops);
    }
}
