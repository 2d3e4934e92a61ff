//! A world that several services of one component tell of and change.
//!
//! Changes wait a moment for others, so that one write to the disk serves all of them; the answers
//! follow when everything is on the disk. A query is answered with what is on the disk. The write
//! itself happens in the component's task: order and answers need no second place then, and a store
//! has nothing to say while it does not know whether it keeps what it was told. The services of one
//! store wait for the disk, a few milliseconds; other components have tasks of their own.

use std::fmt;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use crate::messages::ground::report_raster_change::Result_ as ChangeResult;
use crate::messages::ground::report_vks_objects_creation::{ObjectIdRec, RequestRec};
use crate::messages::ground::{
    QueryRasterCells, QueryRasterMaps, QueryVksBounds, QueryVksFeatureClassMetadata,
    QueryVksObjects, QueryVksTraversability, ReportRasterChange, ReportVksObjectsCreation,
};
use crate::motion::Frame;
use crate::world::{Change, Done, KeepError, MapId, Refusal, World};
use jaus::endpoint::Received;
use jaus::service::Context;

use super::{RasterMaps, VectorKnowledgeStore};

/// A world, shared by the services over it.
#[derive(Clone)]
pub struct WorldStore {
    shared: Arc<Mutex<Shared>>,
    frame: Frame,
    fail: Arc<dyn Fn(&KeepError) + Send + Sync>,
}

struct Shared {
    world: World,
    waiting: Vec<Waiting>,
    /// When those that wait are written.
    due: Option<Instant>,
}

/// A change, and who wants it.
struct Waiting {
    request: Received,
    change: Change,
    answer: Answer,
}

/// What is answered once a change is kept or refused.
#[derive(Debug, Clone, Copy)]
pub(super) enum Answer {
    /// Nothing.
    None,
    /// Report VKS Objects Creation for so many objects.
    Creation { request_id: u8, count: usize },
    /// Report Raster Change about a map, 0 if there is none yet.
    Raster { request_id: u8, map: u16 },
}

impl WorldStore {
    /// How long the first change waits for others.
    pub const LINGER: Duration = Duration::from_millis(2);
    /// How many changes wait at most; then they are written at once.
    pub const MOST_WAITING: usize = 64;
    /// How many octets of changes wait at most; then they are written at once.
    const MOST_OCTETS: usize = 4 << 20;

    /// A world whose local frame lies at `frame`. `fail` is called when something can not be kept,
    /// after which the world answers nothing more and has to be opened again; it must not wait for
    /// anything.
    #[must_use]
    pub fn new(
        world: World,
        frame: Frame,
        fail: impl Fn(&KeepError) + Send + Sync + 'static,
    ) -> Self {
        let shared = Shared {
            world,
            waiting: Vec::new(),
            due: None,
        };
        Self {
            shared: Arc::new(Mutex::new(shared)),
            frame,
            fail: Arc::new(fail),
        }
    }

    /// The service Raster Maps.
    #[must_use]
    pub fn raster_maps(&self) -> RasterMaps {
        RasterMaps::new(self.clone())
    }

    /// The service Vector Knowledge Store.
    #[must_use]
    pub fn vector_knowledge_store(&self) -> VectorKnowledgeStore {
        VectorKnowledgeStore::new(self.clone())
    }

    /// Where the local frame is.
    pub(super) const fn frame(&self) -> &Frame {
        &self.frame
    }

    /// Asks the world; `None` once it has failed.
    pub(super) fn ask<T>(&self, question: impl FnOnce(&World) -> T) -> Option<T> {
        let shared = self.lock();
        (!shared.world.has_failed()).then(|| question(&shared.world))
    }

    /// The same for questions that the file has to be read for.
    pub(super) fn read<T>(
        &self,
        question: impl FnOnce(&World) -> Result<T, KeepError>,
    ) -> Option<T> {
        self.ask(question)?
            .inspect_err(|error| (self.fail)(error))
            .ok()
    }

    /// Takes a change from a client that may make it.
    pub(super) fn change(
        &self,
        now: Instant,
        request: &Received,
        change: Change,
        answer: Answer,
        context: &mut Context<'_>,
    ) {
        if !context.standing().obeys(request.source) {
            tracing::debug!(source = %request.source, "a change from a client not in control");
            return;
        }
        let full = {
            let mut shared = self.lock();
            shared.waiting.push(Waiting {
                request: request.clone(),
                change,
                answer,
            });
            shared.due.get_or_insert(now + Self::LINGER);
            let octets: usize = shared
                .waiting
                .iter()
                .map(|it| it.request.payload.len())
                .sum();
            shared.waiting.len() >= Self::MOST_WAITING || octets >= Self::MOST_OCTETS
        };
        if full {
            self.write(context);
        }
    }

    /// Writes what waits, if its time has come.
    pub(super) fn handle_timeout(&self, now: Instant, context: &mut Context<'_>) {
        if self.lock().due.is_some_and(|due| due <= now) {
            self.write(context);
        }
    }

    pub(super) fn poll_timeout(&self) -> Option<Instant> {
        self.lock().due
    }

    fn write(&self, context: &mut Context<'_>) {
        let mut shared = self.lock();
        shared.due = None;
        let waiting = std::mem::take(&mut shared.waiting);
        let (changes, askers): (Vec<_>, Vec<_>) = waiting
            .into_iter()
            .map(|it| (it.change, (it.request, it.answer)))
            .unzip();
        let outcome = shared.world.apply(changes);
        drop(shared);
        match outcome {
            Ok(results) => {
                for ((request, answer), result) in askers.iter().zip(&results) {
                    tell(request, *answer, result, context);
                    if let Ok(done) = result {
                        announce(done, context);
                    }
                }
            }
            Err(error) => {
                for (request, answer) in &askers {
                    tell_failed(request, *answer, &error, context);
                }
                (self.fail)(&error);
            }
        }
    }

    fn lock(&self) -> MutexGuard<'_, Shared> {
        self.shared.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl fmt::Debug for WorldStore {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("WorldStore").finish_non_exhaustive()
    }
}

/// Tells whoever subscribed what has changed.
fn announce(done: &Done, context: &mut Context<'_>) {
    match done {
        Done::Added(_) | Done::Removed(_) => {
            context.changed::<QueryVksObjects>();
            context.changed::<QueryVksBounds>();
        }
        Done::Described => context.changed::<QueryVksFeatureClassMetadata>(),
        Done::Raster(..) => {
            context.changed::<QueryRasterMaps>();
            context.changed::<QueryRasterCells>();
            context.changed::<QueryVksTraversability>();
        }
    }
}

fn tell(
    request: &Received,
    answer: Answer,
    result: &Result<Done, Refusal>,
    context: &mut Context<'_>,
) {
    if let Err(refusal) = result {
        tracing::debug!(source = %request.source, %refusal, "a change is refused");
    }
    match (answer, result) {
        (Answer::None, _) => {}
        (Answer::Creation { request_id, .. }, Ok(Done::Added(added))) => {
            let numbers = added.iter().map(|id| id.map_or(0, |id| id.0));
            context.reply_until_acknowledged(request, &creation(request_id, numbers));
        }
        (Answer::Creation { request_id, count }, _) => {
            context.reply_until_acknowledged(
                request,
                &creation(request_id, std::iter::repeat_n(0, count)),
            );
        }
        (Answer::Raster { request_id, .. }, Ok(Done::Raster(MapId(map), revision))) => {
            let done = ReportRasterChange {
                request_id,
                map: *map,
                revision: *revision,
                result: ChangeResult::DONE,
                reason: "".into(),
            };
            context.reply_until_acknowledged(request, &done);
        }
        (Answer::Raster { request_id, map }, result) => {
            let (code, reason) = match result {
                Err(refusal) => (result_of(refusal), refusal.to_string()),
                Ok(_) => (ChangeResult::FAILED, String::new()),
            };
            context.reply_until_acknowledged(request, &refused(request_id, map, code, &reason));
        }
    }
}

fn tell_failed(request: &Received, answer: Answer, error: &KeepError, context: &mut Context<'_>) {
    match answer {
        Answer::None => {}
        Answer::Creation { request_id, count } => {
            context.reply_until_acknowledged(
                request,
                &creation(request_id, std::iter::repeat_n(0, count)),
            );
        }
        Answer::Raster { request_id, map } => {
            let reason = error.to_string();
            context.reply_until_acknowledged(
                request,
                &refused(request_id, map, ChangeResult::FAILED, &reason),
            );
        }
    }
}

fn creation(request_id: u8, numbers: impl Iterator<Item = u32>) -> ReportVksObjectsCreation {
    ReportVksObjectsCreation {
        request_rec: RequestRec { request_id },
        object_id_list: numbers.map(|object_id| ObjectIdRec { object_id }).collect(),
    }
}

fn refused(request_id: u8, map: u16, result: ChangeResult, reason: &str) -> ReportRasterChange {
    ReportRasterChange {
        request_id,
        map,
        revision: 0,
        result,
        reason: beginning(reason, usize::from(u8::MAX)).into(),
    }
}

const fn result_of(refusal: &Refusal) -> ChangeResult {
    match refusal {
        Refusal::NoSuchMap(_) => ChangeResult::NO_SUCH_MAP,
        Refusal::Size(_) | Refusal::Region => ChangeResult::WRONG_SIZE,
        Refusal::Outside { .. } => ChangeResult::OUTSIDE,
        Refusal::Full(_) => ChangeResult::FULL,
    }
}

/// As much of a text as has at most so many octets.
fn beginning(text: &str, most: usize) -> &str {
    let mut end = most.min(text.len());
    while !text.is_char_boundary(end) {
        end -= 1;
    }
    &text[..end]
}
