//! The stack as a client of other components: queries, subscriptions, control and sessions.

use std::time::Instant;

use super::{Event, Stack};
use crate::address::JausId;
use crate::endpoint::Received;
use crate::service::client::{Introduction, Sessions, Surroundings};
use crate::service::{
    Audience, CannotSubscribe, ControlId, ControlNews, ControlRefused, Handled, Inquiry, Patience,
    QueryOptions, Question, SessionId, SessionOrder, SessionSettings, SubscriptionId, Topic,
};

impl Stack {
    /// Sends a query to a peer and waits for its first report that answers it. If the peer id has
    /// wildcards, the first answer of any matching component counts.
    pub fn ask(
        &mut self,
        now: Instant,
        peer: JausId,
        question: Question,
        options: impl Into<QueryOptions>,
    ) -> Inquiry {
        self.inquiries
            .ask(now, peer, question, options.into(), &mut self.out)
    }

    /// The peers whose queries would be repeated now, or time out, unless the owner reports
    /// [progress](Self::handle_progress).
    pub fn overdue(&self, now: Instant) -> impl Iterator<Item = JausId> {
        self.inquiries.overdue(now)
    }

    /// Postpones the next try of the queries to a peer that is sending a large message, of which a
    /// part arrived at `latest`. It may be the report.
    pub fn handle_progress(&mut self, now: Instant, peer: JausId, latest: Instant) {
        self.inquiries.handle_progress(now, peer, latest);
    }

    /// Cancels a query.
    pub fn cancel(&mut self, now: Instant, inquiry: Inquiry) {
        self.inquiries.cancel(now, inquiry, &mut self.out);
    }

    /// Subscribes to a peer's reports. [`Event::Subscription`] brings the news of it, beginning
    /// with the peer's confirmation; `patience` limits the wait for that.
    ///
    /// # Errors
    /// If no valid request can be made of `topic`.
    pub fn subscribe(
        &mut self,
        now: Instant,
        topic: &Topic,
        patience: Patience,
    ) -> Result<SubscriptionId, CannotSubscribe> {
        self.subscriptions
            .subscribe(now, topic, patience, &mut self.out)
    }

    /// Ends a subscription.
    pub fn unsubscribe(&mut self, now: Instant, subscription: SubscriptionId) {
        self.subscriptions
            .unsubscribe(now, subscription, &mut self.out);
    }

    /// Requests control of a peer and keeps renewing it. [`Event::Control`] reports whether it was
    /// granted, and when it is lost.
    ///
    /// # Errors
    /// If it cannot even be requested.
    pub fn request_control(
        &mut self,
        now: Instant,
        peer: JausId,
        authority: u8,
        patience: Patience,
    ) -> Result<ControlId, ControlRefused> {
        let (own, directory) = (self.life.own(), self.discovery.directory());
        let introduction = Introduction::new(own, &directory, peer);
        let (controls, out) = (&mut self.controls, &mut self.out);
        controls.request(now, peer, authority, patience, introduction, out)
    }

    /// Releases control, or cancels a request for it.
    pub fn release_control(&mut self, now: Instant, control: ControlId) {
        self.controls.release(now, control, &mut self.out);
    }

    /// Begins a session: control of a member of the audience, kept through restarts and losses.
    /// [`Event::Session`] brings its progress.
    pub fn begin_session(
        &mut self,
        now: Instant,
        audience: Audience,
        settings: SessionSettings,
        patience: Patience,
    ) -> SessionId {
        let (sessions, mut around) = self.sessions();
        let session = sessions.begin(now, audience, settings, patience, &mut around);
        self.collect(now);
        session
    }

    /// Changes what the application wants of a session.
    pub fn order_session(&mut self, now: Instant, session: SessionId, order: SessionOrder) {
        let (sessions, mut around) = self.sessions();
        sessions.order(now, session, order, &mut around);
        self.collect(now);
    }

    /// Ends a session and releases its peer.
    pub fn release_session(&mut self, now: Instant, session: SessionId) {
        let (sessions, mut around) = self.sessions();
        sessions.release(now, session, &mut around);
        self.collect(now);
    }

    fn sessions(&mut self) -> (&mut Sessions, Surroundings<'_>) {
        let around = Surroundings {
            directory: self.discovery.directory(),
            own: self.life.own(),
            controls: &mut self.controls,
            out: &mut self.out,
        };
        (&mut self.sessions, around)
    }

    fn is_for_session(&mut self, now: Instant, control: ControlId, news: ControlNews) -> bool {
        if self.sessions.is_empty() {
            return false;
        }
        let (sessions, mut around) = self.sessions();
        sessions.handle_control(now, control, news, &mut around)
    }

    /// Passes the time, the directory and news of control on to sessions, and all news on to the
    /// application.
    pub(super) fn collect_client_news(&mut self, now: Instant) {
        while let Some((inquiry, failure)) = self.inquiries.poll_failure() {
            self.events.push_back(Event::Answer(inquiry, Err(failure)));
        }
        while let Some((subscription, news)) = self.subscriptions.poll_news() {
            self.events
                .push_back(Event::Subscription(subscription, news));
        }
        if !self.sessions.is_empty() {
            let (sessions, mut around) = self.sessions();
            sessions.proceed(now, &mut around);
        }
        while let Some((control, news)) = self.controls.poll_news() {
            if !self.is_for_session(now, control, news) {
                self.events.push_back(Event::Control(control, news));
            }
        }
        while let Some((session, state)) = self.sessions.poll_news() {
            self.events.push_back(Event::Session(session, state));
        }
    }

    pub(super) fn handle_as_client(&mut self, now: Instant, message: &Received) -> Handled {
        let Self {
            subscriptions,
            controls,
            sessions,
            out,
            ..
        } = self;
        sessions.handle_message(message);
        controls.watch_for_restart(now, message);
        match subscriptions.handle_message(now, message, out) {
            Handled::Yes => Handled::Yes,
            Handled::No => controls.handle_message(now, message, out),
        }
    }
}
