//! Groups: a message for many, with what became of it at each of them; and the reports of all who
//! offer a service, whoever they are at the time.
//!
//! Nobody joins a group and nobody keeps one: an [`Audience`] says who is meant, and Discovery says
//! who that is now.

mod audience;
mod member_table;
mod reports;
mod results;

use super::{Component, DeliverError, QueryError, SendError};
use crate::address::JausId;
use crate::codec::Message;
use crate::endpoint::Outgoing;
use crate::service::{CannotSubscribe, Topic, When};

pub use audience::Audience;
pub use reports::{GroupSubscription, GroupUpdate};
pub use results::Results;

/// How many members are told or asked at the same time. A node acknowledges with hundreds, but a
/// slow link should not be given more at once.
const AT_ONCE: usize = 32;

impl Component {
    /// Who belongs to an audience now, as far as Discovery has found them, in order of their ids;
    /// never this component itself.
    #[must_use]
    pub fn members(&self, audience: impl Into<Audience>) -> Vec<JausId> {
        audience.into().members(&self.directory(), self.id())
    }

    /// Sends a message to all of an audience, and forgets it; says how many members were known.
    ///
    /// An audience without a service is one message to a destination with wildcards: it also
    /// reaches members that are not known here yet. The providers of a service get one each.
    ///
    /// # Errors
    /// If the wire cannot carry it, or the node would not take it for one of them; the others get
    /// it all the same.
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
                // Everybody gets it, whatever became of it for the one before.
                let sent: Vec<_> = members.iter().map(|&member| send(member)).collect();
                sent.into_iter().collect::<Result<(), _>>()?;
            }
        }
        Ok(members.len())
    }

    /// Sends a message to each member of an audience, again and again if need be, until each has
    /// acknowledged it or is not known to have it; says which. Dropping the future forgets the
    /// message, which may still arrive.
    ///
    /// Who comes while it runs is not told.
    pub async fn deliver_all<M: Message>(
        &self,
        audience: impl Into<Audience>,
        message: &M,
    ) -> Results<(), DeliverError> {
        let members = self.members(audience);
        results::of_each(members, AT_ONCE, |member| self.deliver(member, message)).await
    }

    /// Asks each member of an audience, and waits until each has answered or has been asked often
    /// enough.
    pub async fn query_all<R: Message, Q: Message>(
        &self,
        audience: impl Into<Audience>,
        query: &Q,
    ) -> Results<R, QueryError> {
        let members = self.members(audience);
        results::of_each(members, AT_ONCE, |member| self.query(member, query)).await
    }

    /// Has every member of an audience answer a query again and again, also those that are not
    /// there yet. A text stands for the providers of the service with that URN:
    ///
    /// ```no_run
    /// # use jaus::component::{Component, GroupUpdate, When};
    /// # use jaus::messages::mobility::{QueryVelocityState, ReportVelocityState, velocity_state_sensor};
    /// # async fn watch(operator: Component) -> Result<(), Box<dyn std::error::Error>> {
    /// let query = QueryVelocityState { presence_vector: 1 };
    /// let mut speeds = operator
    ///     .subscribe_all::<ReportVelocityState, _>(velocity_state_sensor::URN, &query, When::hz(5.0))?;
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
    /// If the wire cannot carry the query or the rate. What a single member has against it comes as
    /// [`GroupUpdate::NotSubscribed`].
    pub fn subscribe_all<R: Message, Q: Message>(
        &self,
        audience: impl Into<Audience>,
        query: &Q,
        when: When,
    ) -> Result<GroupSubscription<R>, CannotSubscribe> {
        let topic = Topic {
            peer: self.id(),
            query: query.encode()?,
            report: R::CODE,
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
