//! A component's messages as octets: for programs that read definitions at run time, and for the
//! interfaces to other languages.

use bytes::Bytes;

use super::driver::Command;
use super::{
    Component, DeliverError, QueryError, SendError, SubscribeError, Subscription, Undecoded,
};
use crate::address::JausId;
use crate::endpoint::Outgoing;
use crate::messages;
use crate::service::{QueryOptions, Question, Topic, code_of};
use crate::wire::Priority;

impl Component {
    /// Like [`send_with`](Self::send_with), with octets that begin with a message code.
    ///
    /// # Errors
    /// If the node rejects it.
    pub fn send_undecoded(
        &self,
        priority: Priority,
        destination: JausId,
        message: Bytes,
    ) -> Result<(), SendError> {
        let outgoing = self.outgoing(priority, destination, message);
        self.shared.sender.send(outgoing)?;
        Ok(())
    }

    /// Like [`deliver_with`](Self::deliver_with), with octets that begin with a message code.
    ///
    /// # Errors
    /// [`DeliverError`] gives the reason why delivery is not confirmed.
    pub async fn deliver_undecoded(
        &self,
        priority: Priority,
        destination: JausId,
        message: Bytes,
    ) -> Result<(), DeliverError> {
        let outgoing = self.outgoing(priority, destination, message);
        Ok(self.shared.sender.deliver(outgoing).await?)
    }

    fn outgoing(&self, priority: Priority, destination: JausId, message: Bytes) -> Outgoing {
        Outgoing {
            priority,
            ..Outgoing::new(self.id(), destination, message)
        }
    }

    /// Like [`query_with`](Self::query_with), with octets: the query begins with its message code,
    /// and the answer is the report with the code `report`, from its message code.
    ///
    /// # Errors
    /// Those of [`query`](Self::query), but for an unreadable answer.
    pub async fn query_undecoded(
        &self,
        options: QueryOptions,
        peer: JausId,
        query: Bytes,
        report: u16,
    ) -> Result<Bytes, QueryError> {
        let code = code_of(&query).unwrap_or_default();
        let names = (
            name_of(code).unwrap_or("the query"),
            name_of(report).unwrap_or("its report"),
        );
        self.ask(options, peer, Question::new(query, report), names)
            .await
    }

    /// Subscribes to a topic whose messages need no types, and yields its reports
    /// [undecoded](Undecoded).
    ///
    /// # Errors
    /// Those of [`subscribe`](Self::subscribe).
    pub async fn subscribe_undecoded(
        &self,
        topic: Topic,
    ) -> Result<Subscription<Undecoded>, SubscribeError> {
        let code = code_of(&topic.query).unwrap_or_default();
        self.subscribe_to(topic, name_of(code).unwrap_or("the query"))
            .await
    }

    /// Like [`changed`](Self::changed), for the query with this code.
    pub async fn changed_undecoded(&self, query: u16) {
        // An error means that the component has stopped.
        let _ = self.shared.commands.send(Command::Announce(query)).await;
    }
}

fn name_of(code: u16) -> Option<&'static str> {
    let known = messages::registry().by_code(code).next();
    known.map(|info| info.name)
}
