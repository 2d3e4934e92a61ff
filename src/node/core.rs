//! The state of a running node: endpoint, links and mailboxes behind one lock.
//!
//! The lock is held for single steps and never across an `await`. So a sending component runs the
//! endpoint in its own task, down to the socket, and gets errors at once; there is no queue in
//! between. The [driver](super::driver) receives and waits.

use std::any::Any;
use std::hash::{BuildHasher, RandomState};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::task::{Context, Poll, Waker};
use std::time::{Duration, Instant};

use tokio::sync::watch;

use super::Config;
use super::awaiting::{Awaiting, Waiter};
use super::clock::{now, time_of_day};
use super::components::{Components, Departure};
use super::error::SendError;
use super::events::{EventSender, Recorder};
use super::link::Link;
use super::links::{Links, Survey};
use super::mailbox::Mailbox;
use super::resident::Residents;
use crate::address::JausId;
use crate::endpoint::{
    self, AttachError, Endpoint, Event, LinkId, MessageHandle, Outgoing, first_sequence_at,
};
#[cfg(unix)]
use crate::link::junior::Claim;
use crate::link::local::Process;
use crate::link::udp::UdpLink;
use crate::link::{Interface, Slab};
use crate::wire::Priority;

/// Limit of messages in a burst that leave together.
const BURST: usize = 64;
/// How long a node that shuts down tries to send queued messages.
pub(super) const LAST_WORDS: Duration = Duration::from_millis(250);

/// The state that handles, ports and the driver share.
#[derive(Debug)]
pub(super) struct Shared {
    pub(super) config: Arc<Config>,
    core: Mutex<Core>,
    /// Whether the node has stopped. Set by the driver.
    pub(super) stopped: watch::Sender<bool>,
    pub(super) residents: Residents,
    /// Where component processes may attach, if anywhere.
    pub(super) local_place: Option<String>,
    /// The listener for component processes has a receiver as long as it is open.
    pub(super) listening: watch::Sender<()>,
    commons: Mutex<Vec<Arc<dyn Any + Send + Sync>>>,
}

impl Shared {
    pub(super) fn new(config: Arc<Config>, links: Links, local_place: Option<String>) -> Self {
        let endpoint = Endpoint::new(endpoint::Config {
            // The keys of `RandomState` come from the operating system.
            challenge_key: RandomState::new().hash_one(0),
            ..config.endpoint(first_sequence_at(time_of_day()))
        });
        Self {
            config,
            core: Mutex::new(Core::new(endpoint, links)),
            stopped: watch::Sender::new(false),
            residents: Residents::default(),
            local_place,
            listening: watch::Sender::new(()),
            commons: Mutex::default(),
        }
    }

    /// Waits until the node has stopped.
    pub(super) async fn stopped(&self) {
        let mut stopped = self.stopped.subscribe();
        // This cannot fail: `self` holds the sender.
        let _ = stopped.wait_for(|stopped| *stopped).await;
    }

    /// Data that the components of this process share on the node: one value of each type.
    pub(super) fn common<T: Any + Send + Sync + Default>(&self) -> Arc<T> {
        let mut commons = self.commons.lock().unwrap_or_else(PoisonError::into_inner);
        let known = commons.iter().find_map(|it| it.clone().downcast().ok());
        known.unwrap_or_else(|| {
            let common = Arc::<T>::default();
            commons.push(common.clone());
            common
        })
    }

    /// Attaches a component; `process` is its process if it is not this one. File system access
    /// happens without the lock.
    pub(super) fn attach(
        &self,
        id: JausId,
        process: Option<Process>,
    ) -> Result<Arc<Mailbox>, AttachError> {
        let mailbox = Arc::new(Mailbox::new(self.config.mailbox));
        let mut core = self.lock();
        core.endpoint.attach(id)?;
        if core.stopped {
            mailbox.close();
        }
        core.components.add(id, mailbox.clone(), process);
        drop(core);
        #[cfg(unix)]
        if let Some(folder) = &self.config.junior {
            let claim = Claim::new(folder, id);
            let mut core = self.lock();
            match (claim, core.links.junior()) {
                (Ok(claim), Some(junior)) => junior.admit(claim),
                // The node has stopped.
                (Ok(_), None) => {}
                (Err(error), _) => {
                    core.detach(id, &mailbox, Departure::Left);
                    return Err(AttachError::Link(error.to_string()));
                }
            }
            core.wake_driver();
        }
        Ok(mailbox)
    }

    pub(super) fn lock(&self) -> MutexGuard<'_, Core> {
        self.core.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[derive(Debug)]
pub(super) struct Core {
    pub(super) endpoint: Endpoint,
    pub(super) links: Links,
    pub(super) components: Components,
    awaiting: Awaiting,
    pub(super) events: EventSender<Event>,
    recorder: Option<Recorder>,
    slab: Slab,
    /// Messages sent since the last [`pump`](Self::pump).
    gathered: usize,
    driver: Option<Waker>,
    /// When it has to have stopped, once it shuts down.
    pub(super) stop_at: Option<Instant>,
    stopped: bool,
}

impl Core {
    fn new(endpoint: Endpoint, links: Links) -> Self {
        let mut core = Self {
            endpoint,
            links,
            components: Components::default(),
            awaiting: Awaiting::default(),
            events: EventSender::default(),
            recorder: None,
            slab: Slab::default(),
            gathered: 0,
            driver: None,
            stop_at: None,
            stopped: false,
        };
        core.announce_links();
        core
    }

    /// Registers the links at the endpoint. A node's own multicast may return on any link, so each
    /// gets the addresses of all.
    fn announce_links(&mut self) {
        for (&id, link) in &self.links.open {
            let own = self.links.udp().map(|(_, link)| link.local());
            self.endpoint.add_link(id, link.profile(own));
        }
        self.endpoint.set_static_peers(self.links.static_peers());
    }

    /// Removes the links whose interfaces are gone. Returns those links, and the interfaces that
    /// need a link. Both are empty after the node has stopped.
    pub(super) fn retire_links(
        &mut self,
        survey: &Survey,
    ) -> (Vec<(LinkId, Link)>, Vec<Interface>) {
        if self.stopped {
            return Default::default();
        }
        let (gone, came) = self.links.retire(survey);
        for &(id, _) in &gone {
            self.endpoint.remove_link(id);
        }
        (gone, came)
    }

    /// Adds links that were opened on new interfaces, unless the node has stopped meanwhile.
    pub(super) fn adopt_links(&mut self, links: Vec<UdpLink>, survey: Survey) {
        if !self.stopped {
            self.links.adopt(links, survey);
            self.announce_links();
            self.wake_driver();
        }
    }

    /// Detaches a component, unless its id belongs to another mailbox by now.
    pub(super) fn detach(&mut self, id: JausId, mailbox: &Arc<Mailbox>, why: Departure) {
        if self.components.has(id, mailbox) {
            self.endpoint.detach(id);
            self.awaiting.forget_source(id);
            #[cfg(unix)]
            if let Some(junior) = self.links.junior() {
                junior.release(id);
            }
            self.components.remove(id, why);
        }
    }

    /// Sends a message. If it requests an acknowledgement, `waiter` gets the outcome.
    pub(super) fn send(
        &mut self,
        message: Outgoing,
        waiter: Option<Waiter>,
    ) -> Result<MessageHandle, SendError> {
        let (ends, deadline) = ((message.source, message.destination), self.deadline());
        let urgent = message.priority > Priority::Standard;
        let now = now();
        let mut result = self
            .endpoint
            .send(now, message.clone(), &mut self.components);
        if let Err(endpoint::SendError::QueueFull { .. }) = result {
            // Perhaps only the gathered messages fill the queue.
            self.pump(now);
            result = self.endpoint.send(now, message, &mut self.components);
        }
        if let (Ok(handle), Some(waiter)) = (&result, waiter) {
            // The endpoint has the same limit.
            let _ = self.awaiting.insert(*handle, ends, waiter);
        }
        // The first message of a burst leaves at once, and so do urgent ones. The others leave
        // together in the driver's next turn, for which the first one woke it.
        if self.driver.is_none() && !urgent && self.gathered < BURST {
            self.gathered += 1;
            return Ok(result?);
        }
        // Messages between components of this node do not concern the driver.
        if self.pump(now) || self.deadline() != deadline {
            self.wake_driver();
        }
        Ok(result?)
    }

    /// Sends what was gathered of a burst.
    pub(super) fn send_gathered(&mut self) {
        if self.pump(now()) {
            self.wake_driver();
        }
    }

    /// Passes decisions on messages of plain links to the recorder.
    pub(super) fn record_decisions(&mut self, recorder: Recorder) {
        self.endpoint.record_decisions();
        self.recorder = Some(recorder);
    }

    /// Cancels a message whose sender no longer waits for its outcome.
    pub(super) fn cancel(&mut self, destination: JausId, message: MessageHandle) {
        self.awaiting.remove(message);
        self.endpoint.cancel(destination, message);
    }

    /// The same for a message that a component process knows by this handle of its own.
    pub(super) fn cancel_of_process(&mut self, source: JausId, handle: u64) {
        if let Some((message, destination)) = self.awaiting.of_process(source, handle) {
            self.cancel(destination, message);
        }
    }

    /// Starts to shut down; the driver completes it.
    pub(super) fn stop(&mut self) {
        self.stop_at.get_or_insert_with(|| now() + LAST_WORDS);
        self.wake_driver();
    }

    /// One turn of the driver. Ready when the node has stopped. Wakes itself while there is more to
    /// receive.
    pub(super) fn turn(&mut self, cx: &mut Context<'_>) -> Poll<()> {
        self.driver = Some(cx.waker().clone());
        let now = now();
        let more = self.receive(now, cx);
        if let Some(deadline) = self.endpoint.poll_timeout()
            && deadline <= now
        {
            self.endpoint.handle_timeout(now);
        }
        self.pump(now);
        let flushed = self.flush(cx, now);
        if let Some(deadline) = self.stop_at
            && (flushed && self.hang_up() || deadline <= now)
        {
            self.finish();
            return Poll::Ready(());
        }
        if more {
            cx.waker().wake_by_ref();
        }
        Poll::Pending
    }

    /// When the driver needs its next turn if nothing else happens.
    pub(super) fn deadline(&self) -> Option<Instant> {
        [
            self.endpoint.poll_timeout(),
            self.links.poll_timeout(),
            self.stop_at,
        ]
        .into_iter()
        .flatten()
        .min()
    }

    /// Sends queued datagrams and publishes events; returns whether there were any datagrams.
    fn pump(&mut self, now: Instant) -> bool {
        let mut transmitted = false;
        self.gathered = 0;
        while let Some(transmit) = self.endpoint.poll_transmit(now) {
            if let Some(link) = self.links.open.get_mut(&transmit.link) {
                self.components.taps.transmit(link.framing(), &transmit);
                link.transmit(&transmit);
            }
            transmitted = true;
        }
        if transmitted {
            self.links.open.values_mut().for_each(Link::send_waiting);
        }
        announce(
            &mut self.endpoint,
            &mut self.awaiting,
            (&self.events, &mut self.recorder),
        );
        transmitted
    }

    /// Receives datagrams; returns whether a link had more than its share.
    fn receive(&mut self, now: Instant, cx: &mut Context<'_>) -> bool {
        let mut more = false;
        if let Some(recorder) = &self.recorder {
            self.endpoint.refuse_commands(recorder.refuses_commands());
        }
        for (&id, link) in &mut self.links.open {
            let into = (&mut self.endpoint, &mut self.components);
            more |= link.receive(cx, now, id, &mut self.slab, into);
            // Before the next link: all links together may produce more events than the queue
            // holds.
            announce(
                &mut self.endpoint,
                &mut self.awaiting,
                (&self.events, &mut self.recorder),
            );
        }
        more
    }

    /// Sends what waits for the network; returns whether nothing is left.
    fn flush(&mut self, cx: &mut Context<'_>, now: Instant) -> bool {
        let links = self.links.open.values_mut();
        let flushed = links.map(|link| link.poll_flush(cx, now));
        flushed.filter(Poll::is_pending).count() == 0
    }

    /// Closes connections properly; returns whether the peers have done so too.
    fn hang_up(&mut self) -> bool {
        let hung_up = self.links.open.values_mut().map(Link::hang_up);
        hung_up.filter(Poll::is_pending).count() == 0
    }

    /// Closes everything. Idempotent.
    pub(super) fn finish(&mut self) {
        self.stopped = true;
        for id in self.components.end() {
            self.endpoint.detach(id);
        }
        self.awaiting.clear();
        for (id, _) in std::mem::take(&mut self.links.open) {
            self.endpoint.remove_link(id);
        }
        self.events.end();
    }

    fn wake_driver(&mut self) {
        if let Some(driver) = self.driver.take() {
            driver.wake();
        }
    }
}

/// Publishes the endpoint's events and decisions.
fn announce(
    endpoint: &mut Endpoint,
    awaiting: &mut Awaiting,
    (events, recorder): (&EventSender<Event>, &mut Option<Recorder>),
) {
    while let Some(event) = endpoint.poll_event() {
        awaiting.handle_event(&event);
        events.send(event);
    }
    if let Some(recorder) = recorder {
        recorder.record_all(std::iter::from_fn(|| endpoint.poll_decision()));
    }
}
