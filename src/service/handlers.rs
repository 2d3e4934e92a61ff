//! A service made of functions, one per message: what an application offers.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt;
use std::time::Instant;

use super::{Context, Handled, Service, Standing, code_of, read};
use crate::address::JausId;
use crate::codec::{Message, ServiceId};
use crate::endpoint::Received;

type Handler = Box<dyn FnMut(&Received, &mut Context<'_>) + Send>;

/// A service whose messages are answered by functions of the application.
///
/// ```
/// use jaus::messages::mobility::{self, QueryVelocityState, ReportVelocityState};
/// use jaus::service::Handlers;
///
/// let speedometer = Handlers::new(mobility::velocity_state_sensor::LATEST)
///     .answer(|_query: QueryVelocityState| ReportVelocityState::default());
/// ```
pub struct Handlers {
    offers: Vec<ServiceId>,
    by_code: BTreeMap<u16, Handler>,
    told: BTreeSet<u16>,
}

impl Handlers {
    /// A service that handles nothing yet.
    #[must_use]
    pub fn new(id: ServiceId) -> Self {
        Self {
            offers: vec![id],
            by_code: BTreeMap::new(),
            told: BTreeSet::new(),
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
        let handler = move |received: &Received, context: &mut Context<'_>| {
            if let Some(query) = read(received) {
                context.reply(received, &function(query));
            }
        };
        self.by_code.insert(Q::CODE, Box::new(handler));
        self
    }

    /// Takes every message of type `M` with its sender's header, whoever sent it; the context is
    /// for whatever is to be said to it.
    #[must_use]
    pub fn receive<M: Message>(
        self,
        function: impl FnMut(M, &Received, &mut Context<'_>) + Send + 'static,
    ) -> Self {
        self.receive_if(|_, _| true, function)
    }

    /// Takes messages of type `M` from the client in control, and ignores all others: what sets
    /// something up.
    #[must_use]
    pub fn configure<M: Message>(
        self,
        function: impl FnMut(M, &Received, &mut Context<'_>) + Send + 'static,
    ) -> Self {
        self.receive_if(Standing::obeys, function)
    }

    /// Takes messages of type `M` from the client in control while the component is ready, and
    /// ignores all others: what makes something act.
    #[must_use]
    pub fn command<M: Message>(
        self,
        function: impl FnMut(M, &Received, &mut Context<'_>) + Send + 'static,
    ) -> Self {
        self.receive_if(Standing::acts_for, function)
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
        mut function: impl FnMut(M, &Received, &mut Context<'_>) + Send + 'static,
    ) -> Self {
        let handler = move |received: &Received, context: &mut Context<'_>| {
            if !may(context.standing(), received.source) {
                tracing::debug!(source = %received.source, message = M::NAME, "not in control");
            } else if let Some(message) = read(received) {
                function(message, received, context);
            }
        };
        self.by_code.insert(M::CODE, Box::new(handler));
        self
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
        _: Instant,
        message: &Received,
        context: &mut Context<'_>,
    ) -> Handled {
        let handler = code_of(&message.payload).and_then(|code| self.by_code.get_mut(&code));
        let Some(handler) = handler else {
            return Handled::No;
        };
        handler(message, context);
        Handled::Yes
    }

    fn tells_end_of(&self, command: u16) -> bool {
        self.told.contains(&command)
    }
}
