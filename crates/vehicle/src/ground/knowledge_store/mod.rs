//! Vector Knowledge Store: objects on the globe, with the message codes and layouts of a draft that
//! was never published as a standard.
//!
//! | request | reply |
//! |---|---|
//! | create objects, with confirmation | their numbers; 0 for each refused object |
//! | objects by number, region, class or attribute | the matching objects, in parts if many |
//! | contradictory conditions | a count of 0 objects |
//! | count only | the number of objects |
//! | the traversability map under 2423h | the cells of a raster map as objects |

mod convert;
#[cfg(test)]
mod tests;
mod transfer;

use std::sync::Arc;
use std::time::Instant;

use crate::messages::ground::set_vks_feature_class_metadata::Option_ as HowToSet;
use crate::messages::ground::{
    CreateVksObjects, DeleteVksObjects, QueryVksBounds, QueryVksFeatureClassMetadata,
    QueryVksObjects, QueryVksTraversability, ReportVksBounds, ReportVksDataTransferTermination,
    ReportVksFeatureClassMetadata, SetVksFeatureClassMetadata, TerminateVksDataTransfer,
    vector_knowledge_store,
};
use crate::world::{
    self, Change, Collection, Describe, FeatureClass, KeepError, Object, ObjectId, Selection,
    Window, World,
};
use jaus::codec::{Message, ServiceId, Text};
use jaus::endpoint::Received;
use jaus::service::{Context, Handled, Service, code_of, read};

use super::WorldStore;
use super::world_store::Answer;
use transfer::{Code, Transfer, Transfers};

/// Reports objects to any client, and accepts changes from clients that may command it.
#[derive(Debug)]
pub struct VectorKnowledgeStore {
    store: WorldStore,
    transfers: Transfers,
}

/// Result of a query.
enum Found {
    Objects(Vec<(ObjectId, Arc<Object>)>),
    /// Too many objects to report.
    TooMany,
}

impl VectorKnowledgeStore {
    /// Name of the raster map reported as objects. Without a map of this name, the first map is
    /// used.
    pub const TRAVERSABILITY: &'static str = "traversability";
    /// The most cells of a raster map reported as objects. For a larger map the reply is only the
    /// maximum count; the cells are available from Raster Maps.
    pub const MOST_CELLS: usize = 256 * 256;

    pub(super) fn new(store: WorldStore) -> Self {
        Self {
            store,
            transfers: Transfers::default(),
        }
    }

    fn create(&self, now: Instant, message: &Received, context: &mut Context<'_>) {
        let Some(create) = read::<CreateVksObjects>(message) else {
            return;
        };
        let create = convert::creation(&create);
        let answer = if create.confirm {
            Answer::Creation {
                request_id: create.request_id,
                count: create.objects.len(),
            }
        } else {
            Answer::None
        };
        let change = Change::AddObjects(create.objects);
        self.store.change(now, message, change, answer, context);
    }

    fn delete(&self, now: Instant, message: &Received, context: &mut Context<'_>) {
        let Some(delete) = read::<DeleteVksObjects>(message).map(convert::as_query) else {
            return;
        };
        match convert::selection(&delete) {
            Some(selection) => {
                let change = Change::RemoveObjects(selection);
                self.store
                    .change(now, message, change, Answer::None, context);
            }
            None => tracing::debug!(source = %message.source, "conditions that make no sense"),
        }
    }

    fn describe(&self, now: Instant, message: &Received, context: &mut Context<'_>) {
        let Some(set) = read::<SetVksFeatureClassMetadata>(message) else {
            return;
        };
        let text = set.metadata.to_string_lossy().into_owned();
        let how = match set.option {
            HowToSet::APPEND => Describe::Append(text),
            HowToSet::PREPEND => Describe::Prepend(text),
            HowToSet::OVERWRITE => Describe::Overwrite(text),
            HowToSet::ERASE => Describe::Erase,
            HowToSet(option) => {
                tracing::debug!(source = %message.source, option, "no way to set metadata");
                return;
            }
        };
        let change = Change::DescribeClass(set.feature_class_id, how);
        self.store
            .change(now, message, change, Answer::None, context);
    }

    /// Sends one report for the class, or one for each described class.
    fn metadata(&self, message: &Received, context: &mut Context<'_>) {
        let Some(query) = read::<QueryVksFeatureClassMetadata>(message) else {
            return;
        };
        let wanted = query.feature_class_id;
        let texts = self.store.ask(|world| {
            let classes = world.classes().iter();
            let of_it = classes.filter(|(class, _)| [**class, FeatureClass::ALL].contains(&wanted));
            let texts = of_it.map(|(&class, text)| (class, text.clone()));
            texts.collect::<Vec<_>>()
        });
        let Some(mut texts) = texts else { return };
        if texts.is_empty() {
            texts.push((wanted, String::new()));
        }
        for (feature_class_id, text) in texts {
            let report = ReportVksFeatureClassMetadata {
                feature_class_id,
                metadata: Text::from(text),
            };
            context.reply(message, &report);
        }
    }

    fn bounds(&self, message: &Received, context: &mut Context<'_>) {
        let Some(query) = read::<QueryVksBounds>(message) else {
            return;
        };
        let class = query.feature_class_id;
        let Some(bounds) = self.store.ask(|world| world.objects().bounds(class)) else {
            return;
        };
        let (south_west, north_east) = bounds.unwrap_or_default();
        let report = ReportVksBounds {
            request_id: query.request_id,
            feature_class_id: class,
            south_west_latitude: south_west.latitude,
            south_west_longitude: south_west.longitude,
            north_east_latitude: north_east.latitude,
            north_east_longitude: north_east.longitude,
        };
        context.reply(message, &report);
    }

    /// Answers a query under either code with the result of `find`.
    fn answer(
        &mut self,
        now: Instant,
        (message, code): (&Received, Code),
        query: &QueryVksObjects,
        find: impl FnOnce(&World, &Selection) -> Result<Found, KeepError>,
        context: &mut Context<'_>,
    ) {
        let request_id = query.request_rec.request_id;
        let found = match convert::selection(query) {
            Some(selection) => self.store.read(|world| find(world, &selection)),
            None => Some(Found::Objects(Vec::new())),
        };
        let count = match found {
            None => return,
            Some(Found::Objects(objects)) if wants_objects(query) => {
                let transfer = Transfer {
                    request: message.clone(),
                    request_id,
                    code,
                    objects: objects.into(),
                };
                return self.transfers.begin(now, transfer, context);
            }
            Some(Found::Objects(objects)) => objects.len(),
            Some(Found::TooMany) => usize::from(u16::MAX),
        };
        let count = transfer::count_of(request_id, count);
        transfer::reply(message, code, count, context);
    }

    fn objects(&mut self, now: Instant, message: &Received, context: &mut Context<'_>) {
        if let Some(query) = read::<QueryVksObjects>(message) {
            let find = |world: &World, selection: &Selection| {
                Ok(Found::Objects(chosen(world.objects(), selection)))
            };
            self.answer(now, (message, Code::Objects), &query, find, context);
        }
    }

    fn traversability(&mut self, now: Instant, message: &Received, context: &mut Context<'_>) {
        if let Some(query) = read::<QueryVksTraversability>(message) {
            let query = convert::as_objects_query(query);
            let frame = *self.store.frame();
            let find = |world: &World, selection: &Selection| {
                let mut rasters = world.rasters().iter();
                let named = rasters
                    .find(|(_, raster)| raster.name == Self::TRAVERSABILITY)
                    .or_else(|| world.rasters().first_key_value());
                let Some((&map, raster)) = named else {
                    return Ok(Found::Objects(Vec::new()));
                };
                if raster.cells() > Self::MOST_CELLS {
                    return Ok(Found::TooMany);
                }
                let cells = world.cells(map, Window::default())?.unwrap_or_default();
                let objects = world::as_objects(raster, &cells, &frame);
                let objects = Collection::new(objects.into_iter());
                Ok(Found::Objects(chosen(&objects, selection)))
            };
            self.answer(now, (message, Code::Traversability), &query, find, context);
        }
    }
}

/// Whether the client requests the objects, not only their count.
const fn wants_objects(query: &QueryVksObjects) -> bool {
    query.request_rec.response_presence_vector & 1 != 0
}

fn chosen(objects: &Collection, selection: &Selection) -> Vec<(ObjectId, Arc<Object>)> {
    let ids = objects.select(selection).into_iter();
    ids.filter_map(|id| Some((id, Arc::clone(objects.get(id)?))))
        .collect()
}

impl Service for VectorKnowledgeStore {
    fn offers(&self) -> Vec<ServiceId> {
        vec![vector_knowledge_store::LATEST]
    }

    fn handle_message(
        &mut self,
        now: Instant,
        message: &Received,
        context: &mut Context<'_>,
    ) -> Handled {
        match code_of(&message.payload) {
            Some(CreateVksObjects::CODE) => self.create(now, message, context),
            Some(DeleteVksObjects::CODE) => self.delete(now, message, context),
            Some(SetVksFeatureClassMetadata::CODE) => self.describe(now, message, context),
            Some(QueryVksFeatureClassMetadata::CODE) => self.metadata(message, context),
            Some(QueryVksBounds::CODE) => self.bounds(message, context),
            Some(QueryVksObjects::CODE) => self.objects(now, message, context),
            Some(QueryVksTraversability::CODE) => self.traversability(now, message, context),
            Some(TerminateVksDataTransfer::CODE) => {
                self.transfers.terminate(message.source);
                context.reply(message, &ReportVksDataTransferTermination);
            }
            _ => return Handled::No,
        }
        Handled::Yes
    }

    fn handle_timeout(&mut self, now: Instant, context: &mut Context<'_>) {
        self.store.handle_timeout(now, context);
        self.transfers.handle_timeout(now, context);
    }

    fn poll_timeout(&self) -> Option<Instant> {
        let times = [self.store.poll_timeout(), self.transfers.poll_timeout()];
        times.into_iter().flatten().min()
    }
}
