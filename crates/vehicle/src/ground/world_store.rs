//! A world shared by several services of one component, which report and change it.
//!
//! Changes wait briefly for others, so that one disk write serves all of them. Replies are sent
//! once everything is on disk, and queries return what is on disk. The component's own task
//! performs the write. This keeps changes and replies in one order, and a store must not reply
//! anyway while it is uncertain whether the changes will be kept. The services of one store wait a
//! few milliseconds for the disk; other components have their own tasks.

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
use jaus::codec::Text;
use jaus::endpoint::Received;
use jaus::messages::mobility::{QueryExcursion, QueryGlobalOperatingZone, QueryLocalOperatingZone};
use jaus::service::Context;

use super::{OperatingZones, RasterMaps, VectorKnowledgeStore};

/// A world shared by the services that use it.
#[derive(Clone)]
pub struct WorldStore {
    shared: Arc<Mutex<Shared>>,
    frame: Frame,
    fail: Arc<dyn Fn(&KeepError) + Send + Sync>,
    /// Whether any client may change objects and maps.
    open: bool,
}

struct Shared {
    world: World,
    waiting: Vec<Waiting>,
    /// When the waiting changes are written.
    due: Option<Instant>,
}

/// A change and the request for it.
struct Waiting {
    request: Received,
    change: Change,
    answer: Answer,
}

/// The reply to a change after it is kept or refused.
#[derive(Debug, Clone, Copy)]
pub(super) enum Answer {
    /// No reply.
    None,
    /// Report VKS Objects Creation for `count` objects.
    Creation { request_id: u8, count: usize },
    /// Report Raster Change for a map, 0 if it does not exist yet.
    Raster { request_id: u8, map: u16 },
    /// The end of the command with this code.
    Command(u16),
}

impl WorldStore {
    /// How long the first change waits for others.
    pub const LINGER: Duration = Duration::from_millis(2);
    /// Maximum number of waiting changes. At this number they are written immediately.
    pub const MOST_WAITING: usize = 64;
    /// Maximum size of waiting changes in octets. At this size they are written immediately.
    const MOST_OCTETS: usize = 4 << 20;

    /// Creates a store for a world whose local frame is `frame`. `fail` is called when a change
    /// cannot be kept. After that the world answers no requests and must be opened again. `fail`
    /// must not block.
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
            open: false,
        }
    }

    /// Lets any client change objects and maps, also behind Access Control. Zones are for the client
    /// in control only.
    #[must_use]
    pub const fn open_to_all(mut self) -> Self {
        self.open = true;
        self
    }

    /// Creates the service Raster Maps.
    #[must_use]
    pub fn raster_maps(&self) -> RasterMaps {
        RasterMaps::new(self.clone())
    }

    /// Creates the service Vector Knowledge Store.
    #[must_use]
    pub fn vector_knowledge_store(&self) -> VectorKnowledgeStore {
        VectorKnowledgeStore::new(self.clone())
    }

    /// Creates the services Local and Global Operating Zone, which need Access Control.
    #[must_use]
    pub fn operating_zones(&self) -> OperatingZones {
        OperatingZones::new(self.clone())
    }

    /// The local frame.
    pub(super) const fn frame(&self) -> &Frame {
        &self.frame
    }

    /// Reads from the world; `None` once it has failed.
    pub(super) fn ask<T>(&self, question: impl FnOnce(&World) -> T) -> Option<T> {
        let shared = self.lock();
        (!shared.world.has_failed()).then(|| question(&shared.world))
    }

    /// Like [`ask`](Self::ask), for reads that access the file.
    pub(super) fn read<T>(
        &self,
        question: impl FnOnce(&World) -> Result<T, KeepError>,
    ) -> Option<T> {
        self.ask(question)?
            .inspect_err(|error| (self.fail)(error))
            .ok()
    }

    /// Queues a change if the client may make it.
    pub(super) fn change(
        &self,
        now: Instant,
        request: &Received,
        change: Change,
        answer: Answer,
        context: &mut Context<'_>,
    ) {
        let is_open = self.open && !matches!(answer, Answer::Command(_));
        if !is_open && !context.standing().obeys(request.source) {
            tracing::debug!(source = %request.source, "ignored a change from a client that is not \
                in control");
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

    /// Writes the waiting changes when they are due.
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

/// Notifies the subscribers of a change.
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
        Done::Zones => {
            context.changed::<QueryLocalOperatingZone>();
            context.changed::<QueryGlobalOperatingZone>();
            context.changed::<QueryExcursion>();
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
        tracing::debug!(source = %request.source, %refusal, "change refused");
    }
    match (answer, result) {
        (Answer::None, _) => {}
        (Answer::Command(code), result) => {
            if let Err(refusal) = result {
                tracing::warn!(source = %request.source, "zones refused: {refusal}");
            }
            context.ended(code, result.is_ok());
        }
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
        Answer::Command(code) => context.ended(code, false),
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

pub(super) fn refused(
    request_id: u8,
    map: u16,
    result: ChangeResult,
    reason: &str,
) -> ReportRasterChange {
    ReportRasterChange {
        request_id,
        map,
        revision: 0,
        result,
        reason: Text::prefix(reason, usize::from(u8::MAX)).into(),
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
