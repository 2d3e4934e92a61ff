//! Groups: a message or query to many components with a result for each, and subscriptions to all
//! providers of a service, including those found later.
//!
//! There is no membership protocol: an [`Audience`] describes the members, and Discovery finds
//! them.

mod member_table;
mod reports;
mod results;

use super::{Component, DeliverError, QueryError, SendError};
use crate::address::JausId;
use crate::codec::{Message, Query};
use crate::endpoint::Outgoing;
use crate::service::{Audience, CannotSubscribe, QueryOptions, Topic, When};
use crate::wire::Priority;

pub use reports::{GroupSubscription, GroupUpdate};
pub use results::Results;

/// How many members are sent to at the same time. A node handles hundreds of acknowledgements, but
/// a slow link should not get more at once.
const AT_ONCE: usize = 32;

impl Component {
    /// The current members of an audience, as far as Discovery has found them, in order of their
    /// ids. Never includes this component.
    #[must_use]
    pub fn members(&self, audience: impl Into<Audience>) -> Vec<JausId> {
        audience.into().members(&self.directory(), self.id())
    }

    /// Sends a message to an audience without acknowledgement; returns how many members were known.
    ///
    /// For an audience without a service this is one message to a destination with wildcards, which
    /// also reaches members that are not known here yet. Each provider of a service gets its own
    /// message.
    ///
    /// # Errors
    /// If the wire cannot carry it, or the node rejects it for one member; the others still get it.
    pub fn send_all<M: Message>(
        &self,
        audience: impl Into<Audience>,
        message: &M,
    ) -> Result<usize, SendError> {
        let audience = audience.into();
        let members = audience.members(&self.directory(), self.id());
        let payload = message.encode()?;
        let send = |destination| {
            let outgoing = Outgoing::new(self.id(), destination, payload.clone());
            self.shared.sender.send(outgoing).map(drop)
        };
        match audience.as_destination() {
            Some(destination) => send(destination)?,
            None => {
                // Send to every member, even after an error.
                let sent: Vec<_> = members.iter().map(|&member| send(member)).collect();
                sent.into_iter().collect::<Result<(), _>>()?;
            }
        }
        Ok(members.len())
    }

    /// Sends a message to each member of an audience, with retransmission until it is acknowledged
    /// or times out. Returns the result for each member. Dropping the future cancels the
    /// messages that are not acknowledged; a copy that is already on the way may still arrive.
    ///
    /// Members that are found meanwhile do not get it.
    pub async fn deliver_all<M: Message>(
        &self,
        audience: impl Into<Audience>,
        message: &M,
    ) -> Results<(), DeliverError> {
        self.deliver_all_with(Priority::Standard, audience, message)
            .await
    }

    /// Like [`deliver_all`](Self::deliver_all), with a priority.
    pub async fn deliver_all_with<M: Message>(
        &self,
        priority: Priority,
        audience: impl Into<Audience>,
        message: &M,
    ) -> Results<(), DeliverError> {
        let members = self.members(audience);
        let deliver = |member| self.deliver_with(priority, member, message);
        results::of_each(members, AT_ONCE, deliver).await
    }

    /// Queries each member of an audience, and waits until each has answered or timed out.
    pub async fn query_all<Q: Query>(
        &self,
        audience: impl Into<Audience>,
        query: &Q,
    ) -> Results<Q::Report, QueryError> {
        self.query_all_with(QueryOptions::default(), audience, query)
            .await
    }

    /// Like [`query_all`](Self::query_all), with a priority and with its own patience for each
    /// member.
    pub async fn query_all_with<Q: Query>(
        &self,
        options: QueryOptions,
        audience: impl Into<Audience>,
        query: &Q,
    ) -> Results<Q::Report, QueryError> {
        let members = self.members(audience);
        let ask = |member| self.query_with(options, member, query);
        results::of_each(members, AT_ONCE, ask).await
    }

    /// Subscribes to a query at every member of an audience, including those that are found later.
    /// A string means the providers of the service with that URN:
    ///
    /// ```no_run
    /// # use jaus::component::{Component, GroupUpdate, When};
    /// # use jaus::messages::mobility::{QueryVelocityState, velocity_state_sensor};
    /// # async fn watch(operator: Component) -> Result<(), Box<dyn std::error::Error>> {
    /// let query = QueryVelocityState::none().with_velocity_x();
    /// let mut speeds = operator
    ///     .subscribe_all(velocity_state_sensor::URN, &query, When::hz(5.0))?;
    /// while let Some((sensor, update)) = speeds.next().await {
    ///     match update {
    ///         GroupUpdate::Report(report) => println!("{sensor}: {:?} m/s", report.velocity_x_m_per_s()),
    ///         other => println!("{sensor}: {other:?}"),
    ///     }
    /// }
    /// # Ok(())
    /// # }
    /// ```
    ///
    /// # Errors
    /// If the wire cannot carry the query or the rate. Refusals of single members arrive as
    /// [`GroupUpdate::NotSubscribed`].
    pub fn subscribe_all<Q: Query>(
        &self,
        audience: impl Into<Audience>,
        query: &Q,
        when: When,
    ) -> Result<GroupSubscription<Q::Report>, CannotSubscribe> {
        let topic = Topic {
            peer: self.id(),
            query: query.encode()?,
            report: Q::Report::CODE,
            when,
        };
        topic.check()?;
        Ok(GroupSubscription::new(
            self.clone(),
            audience.into(),
            topic,
            Q::NAME,
        ))
    }
}
