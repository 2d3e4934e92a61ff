//! What a node of the program has: its thread, its queue, and what was begun and has not ended.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex};

use jaus_binding::{EventQueue, HeldControl, NodeThread, Place, ServiceKey, lock};
use tokio::task::JoinHandle;

use super::event::{Answer, Event};
use super::failure::Failure;
use super::stop::Stopper;

/// A node that runs.
pub(crate) struct Program {
    pub(crate) thread: NodeThread,
    pub(crate) place: Place,
    pub(crate) shared: Arc<Shared>,
}

/// What the node's tasks share with the program.
pub(crate) struct Shared {
    pub(crate) queue: Arc<EventQueue<Event>>,
    pub(crate) stopper: Arc<Stopper>,
    begun: Mutex<BTreeMap<u64, Begun>>,
}

/// Something that was begun and has not ended.
pub(crate) enum Begun {
    Request(JoinHandle<()>),
    Subscription(JoinHandle<()>),
    Control(Arc<HeldControl>, Vec<JoinHandle<()>>),
}

/// A number for a handler, a request, a subscription, a control.
pub(crate) fn number() -> u64 {
    ServiceKey::new().number()
}

impl Shared {
    /// Limit of what has begun and not ended. Less than the queue holds, because results are never dropped.
    const MOST: usize = 1000;

    pub(crate) fn new() -> std::io::Result<Self> {
        Ok(Self {
            queue: Arc::new(EventQueue::new()?),
            stopper: Arc::default(),
            begun: Mutex::default(),
        })
    }

    /// Lets a request become a subscription or a control. If it was cancelled meanwhile, what was obtained is
    /// given up.
    pub(crate) fn become_lasting(&self, number: u64, begun: Begun) {
        match lock(&self.begun).get_mut(&number) {
            Some(place) => *place = begun,
            None => begun.abort(),
        }
    }

    pub(crate) fn control(&self, number: u64) -> Option<Arc<HeldControl>> {
        match lock(&self.begun).get(&number) {
            Some(Begun::Control(held, _)) => Some(held.clone()),
            _ => None,
        }
    }

    pub(crate) fn take(&self, number: u64) -> Option<Begun> {
        lock(&self.begun).remove(&number)
    }

    fn finish(&self, request: u64, result: Result<Answer, Failure>) {
        let mut begun = lock(&self.begun);
        if matches!(begun.get(&request), Some(Begun::Request(_))) {
            begun.remove(&request);
        }
        drop(begun);
        self.queue.push(Event::Done { request, result });
    }
}

impl Begun {
    /// Gives it up without waiting.
    pub(crate) fn abort(self) {
        match self {
            Self::Request(task) | Self::Subscription(task) => task.abort(),
            Self::Control(held, tasks) => {
                drop(held.take());
                for task in tasks {
                    task.abort();
                }
            }
        }
    }
}

impl Program {
    /// Begins a request on the node's thread. Its result is an event.
    pub(crate) fn begin<F>(
        &self,
        request: impl FnOnce(u64, Arc<Shared>) -> F,
    ) -> Result<u64, Failure>
    where
        F: Future<Output = Result<Answer, Failure>> + Send + 'static,
    {
        if self.thread.is_of_other_process() {
            return Err(Failure::forked("node"));
        }
        if self.thread.has_ended() {
            return Err(Failure::closed("node"));
        }
        let mut begun = lock(&self.shared.begun);
        if begun.len() >= Shared::MOST {
            let text = format!(
                "{} requests, subscriptions and controls are open: end some",
                Shared::MOST
            );
            return Err(Failure::new("LimitError", text));
        }
        let number = number();
        let shared = self.shared.clone();
        let request = request(number, shared.clone());
        let task = self.thread.handle().spawn(async move {
            let result = request.await;
            shared.finish(number, result);
        });
        begun.insert(number, Begun::Request(task));
        Ok(number)
    }
}

impl Drop for Program {
    fn drop(&mut self) {
        // The thread ends soon: its handle is not joined here, where the interpreter's lock may be held.
        drop(self.thread.end());
        if !self.thread.is_of_other_process() {
            self.shared.stopper.end();
        }
    }
}
