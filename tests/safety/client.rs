//! A scripted controller: it takes control, makes the vehicle ready, and drives. Optionally it
//! continues to send after a loss of control.

use std::collections::VecDeque;
use std::time::{Duration, Instant};

use bytes::Bytes;
use jaus::address::JausId;
use jaus::endpoint::{Event as News, MessageHandle, Outgoing};
use jaus::messages::core::Resume;
use jaus::service::{
    ControlId, ControlNews, Discovery, Event, Kind, Liveness, Patience, Profile, Scope, Stack,
    Timing,
};

use crate::cell::Driver;
use crate::commands;
use crate::sim::{Event as EndpointEvent, OwnedEndpoint, WallClock};
use crate::vehicle::VEHICLE;

/// A controller, or a client that requests control.
pub(crate) struct Client {
    stack: Stack,
    driver: Driver,
    authority: u8,
    control: Option<ControlId>,
    holds: bool,
    /// Whether it wants control, and repeats a refused request.
    wants: bool,
    /// Whether it keeps repeating its setpoints, in control or not.
    insists: bool,
    /// Commands to send in this order, each after the acknowledgement of the previous one.
    queue: VecDeque<Bytes>,
    unacknowledged: Option<MessageHandle>,
    is_driving: bool,
    /// Whether it is of another product: it knows nothing of incarnations.
    is_foreign: bool,
    /// Whether the vehicle has ever reported ready.
    was_ready: bool,
    next: Instant,
    /// When to check whether the vehicle is ready.
    check: Instant,
}

impl Client {
    /// Interval of repeated setpoints.
    const PERIOD: Duration = Duration::from_millis(100);
    /// The vehicle is ready this long after Resume, unless control lapsed while Resume was in
    /// transit.
    const READY_WITHIN: Duration = Duration::from_secs(1);
    /// Ready in Report Status.
    const READY: u8 = 1;

    pub(crate) fn new(
        now: Instant,
        id: JausId,
        driver: Driver,
        authority: u8,
        scope: Scope,
    ) -> Self {
        let profile = Profile::new(Kind::OperatorControlUnit, "Operator");
        let seed = u64::from(id.subsystem());
        let discovery = Discovery::new(id, profile, scope, Timing::default(), seed);
        let mut stack = Stack::new(discovery, vec![Box::new(Liveness::new())]);
        stack.start(now);
        Self {
            stack,
            driver,
            authority,
            control: None,
            holds: false,
            wants: false,
            insists: false,
            queue: VecDeque::new(),
            unacknowledged: None,
            is_driving: false,
            is_foreign: false,
            was_ready: false,
            next: now,
            check: now,
        }
    }

    /// Makes it a client of another product.
    pub(crate) fn foreign(mut self) -> Self {
        self.is_foreign = true;
        self
    }

    /// Whether it does not have this message.
    fn lacks(&self, payload: &Bytes) -> bool {
        self.is_foreign && commands::is_of_incarnation(payload)
    }

    /// Takes control and drives.
    pub(crate) fn begin(&mut self, now: Instant) {
        self.take_control(now);
        self.queue.push_back(commands::encode(&Resume {}));
        self.queue.extend(commands::motion(self.driver));
    }

    /// Takes control and makes the vehicle ready.
    pub(crate) fn make_ready(&mut self, now: Instant) {
        self.take_control(now);
        self.queue.push_back(commands::encode(&Resume {}));
        self.driver = Driver::Waypoint;
    }

    /// Takes control without using it.
    pub(crate) fn take_control(&mut self, now: Instant) {
        self.wants = true;
        self.next = now;
    }

    /// Requests control again if it was lost.
    pub(crate) fn take_control_again(&mut self, now: Instant) {
        if !self.holds {
            self.let_go(now);
            self.take_control(now);
        }
    }

    /// Makes the vehicle ready and drives; the client is already in control.
    pub(crate) fn drive(&mut self) {
        self.queue.push_back(commands::encode(&Resume {}));
        self.queue.extend(commands::motion(self.driver));
    }

    /// Keeps repeating its setpoints from now on, in control or not.
    pub(crate) fn insist(&mut self) {
        self.insists = true;
    }

    /// Releases control and stops sending.
    pub(crate) fn let_go(&mut self, now: Instant) {
        self.wants = false;
        self.is_driving = false;
        self.holds = false;
        if let Some(control) = self.control.take() {
            self.stack.release_control(now, control);
        }
    }

    /// Sets the vehicle's time to the client's wall clock.
    pub(crate) fn set_time(&mut self, clock: &WallClock) {
        let set_time = commands::set_time(clock.since_1970());
        self.stack.send_octets(VEHICLE, set_time);
    }

    pub(crate) fn handle_event(
        &mut self,
        now: Instant,
        endpoint: &mut OwnedEndpoint,
        event: EndpointEvent,
    ) {
        match event {
            EndpointEvent::Received(message) if self.lacks(&message.payload) => {}
            EndpointEvent::Received(message) => self.stack.handle_message(now, &message),
            EndpointEvent::News(News::Acknowledged { message, .. })
                if self.unacknowledged == Some(message) =>
            {
                self.unacknowledged = None;
                self.queue.pop_front();
                self.is_driving = self.queue.is_empty();
                self.next = now;
                self.check = now + Self::READY_WITHIN;
            }
            EndpointEvent::News(News::NotAcknowledged { message, .. })
                if self.unacknowledged == Some(message) =>
            {
                self.unacknowledged = None;
            }
            _ => {}
        }
        self.settle(now, endpoint);
    }

    pub(crate) fn handle_timeout(&mut self, now: Instant, endpoint: &mut OwnedEndpoint) {
        self.stack.handle_timeout(now);
        self.settle(now, endpoint);
    }

    pub(crate) fn poll_timeout(&self) -> Option<Instant> {
        let is_active = self.wants || self.insists;
        let next = is_active.then_some(self.next);
        self.stack.poll_timeout().into_iter().chain(next).min()
    }

    /// Performs due actions, and sends all pending messages.
    pub(crate) fn settle(&mut self, now: Instant, endpoint: &mut OwnedEndpoint) {
        self.note_news(now);
        if self.next <= now {
            self.next = now + Self::PERIOD;
            self.act(now, endpoint);
        }
        while let Some(message) = self.stack.poll_transmit() {
            if self.lacks(&message.payload) {
                continue;
            }
            // There may be no route to the vehicle yet.
            let _ = endpoint.send(now, message);
        }
    }

    fn note_news(&mut self, now: Instant) {
        while let Some(event) = self.stack.poll_event() {
            let Event::Control(id, news) = event else {
                continue;
            };
            if self.control != Some(id) {
                continue;
            }
            match news {
                ControlNews::Status(status) => {
                    self.was_ready |= status == Self::READY;
                    continue;
                }
                ControlNews::Granted => self.next = now,
                ControlNews::Refused(_) | ControlNews::Released => self.control = None,
                ControlNews::Lost(_) => {}
            }
            self.holds = news == ControlNews::Granted;
        }
    }

    fn act(&mut self, now: Instant, endpoint: &mut OwnedEndpoint) {
        if self.wants && self.control.is_none() {
            let patience = Patience::default();
            let request = self
                .stack
                .request_control(now, VEHICLE, self.authority, patience);
            self.control = request.ok();
        }
        if self.is_driving && !self.was_ready && self.check <= now {
            self.is_driving = false;
            self.drive();
        }
        if self.holds
            && self.unacknowledged.is_none()
            && let Some(payload) = self.queue.front()
        {
            let message = Outgoing {
                acknowledge: true,
                ..Outgoing::new(self.stack.id(), VEHICLE, payload.clone())
            };
            self.unacknowledged = endpoint.send(now, message).ok();
        }
        let repeats = self.is_driving && self.holds && self.driver.is_streamed();
        if repeats || self.insists {
            for payload in commands::motion(self.driver) {
                self.stack.send_octets(VEHICLE, payload);
            }
        }
    }
}
