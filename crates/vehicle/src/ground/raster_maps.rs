//! Raster Maps: lists the maps, reports their cells and changes them.

use std::time::Instant;

use bytes::Bytes;

use crate::messages::ground::report_raster_change::Result_ as ChangeResult;
use crate::messages::ground::report_raster_maps::MapRec;
use crate::messages::ground::{
    CreateRasterMap, DeleteRasterMap, QueryRasterCells, QueryRasterMaps, ReportRasterCells,
    ReportRasterMaps, SetRasterCells, raster_maps,
};
use crate::world::{Change, MapId, Raster, Window};
use jaus::codec::{Message, ServiceId};
use jaus::endpoint::Received;
use jaus::service::{Context, Handled, Service, code_of, read};

use super::WorldStore;
use super::world_store::{Answer, refused};

/// Reports maps and cells to any client, and accepts changes from clients that may command the
/// component. Every change is answered once it is on disk, or with the reason for the refusal.
#[derive(Debug)]
pub struct RasterMaps {
    store: WorldStore,
}

impl RasterMaps {
    /// The most cells of one report. For a larger window the report holds as many whole rows as
    /// fit, from the south, and states their number.
    pub const MOST_TOLD: usize = 2048 * 2048;

    pub(super) const fn new(store: WorldStore) -> Self {
        Self { store }
    }

    fn maps(&self, message: &Received, context: &mut Context<'_>) {
        let report = self.store.ask(|world| {
            let maps = world.rasters().iter();
            ReportRasterMaps {
                map_list: maps.map(|(&map, raster)| listed(map, raster)).collect(),
            }
        });
        if let Some(report) = report {
            context.reply(message, &report);
        }
    }

    fn cells(&self, message: &Received, query: &QueryRasterCells, context: &mut Context<'_>) {
        let map = MapId(query.map);
        let asked = Window {
            row: query.row,
            column: query.column,
            rows: query.maximum_rows,
            columns: query.maximum_columns,
        };
        let report = self.store.read(|world| {
            let none = ReportRasterCells {
                map: query.map,
                row: query.row,
                column: query.column,
                ..ReportRasterCells::default()
            };
            let Some(raster) = world.rasters().get(&map) else {
                return Ok(none);
            };
            let none = ReportRasterCells {
                revision: raster.revision,
                ..none
            };
            let Some(mut window) = raster.window(asked) else {
                return Ok(none);
            };
            let fit = Self::MOST_TOLD / usize::from(window.columns.max(1));
            window.rows = window.rows.min(fit.try_into().unwrap_or(u16::MAX));
            Ok(match world.cells(map, window)? {
                Ok(cells) => ReportRasterCells {
                    rows: window.rows,
                    columns: window.columns,
                    cells: cells.into(),
                    ..none
                },
                Err(_) => none,
            })
        });
        if let Some(report) = report {
            context.reply_until_acknowledged(message, &report);
        }
    }

    /// Queues a change together with the number of its request and the map concerned.
    fn change(
        &self,
        now: Instant,
        message: &Received,
        (request_id, map): (u8, u16),
        change: Change,
        context: &mut Context<'_>,
    ) {
        let answer = Answer::Raster { request_id, map };
        self.store.change(now, message, change, answer, context);
    }
}

impl Service for RasterMaps {
    fn offers(&self) -> Vec<ServiceId> {
        vec![raster_maps::LATEST]
    }

    fn handle_message(
        &mut self,
        now: Instant,
        message: &Received,
        context: &mut Context<'_>,
    ) -> Handled {
        match code_of(&message.payload) {
            Some(QueryRasterMaps::CODE) => self.maps(message, context),
            Some(QueryRasterCells::CODE) => {
                if let Some(query) = read(message) {
                    self.cells(message, &query, context);
                }
            }
            Some(CreateRasterMap::CODE) => {
                if let Some(create) = read::<CreateRasterMap>(message) {
                    let change = Change::AddRaster(wanted(&create), Bytes::new());
                    self.change(now, message, (create.request_id, 0), change, context);
                }
            }
            Some(SetRasterCells::CODE) => {
                if let Some(set) = read::<SetRasterCells>(message) {
                    let about = (set.request_id, set.map);
                    let window = Window {
                        row: set.row,
                        column: set.column,
                        rows: set.rows,
                        columns: set.columns,
                    };
                    let change = Change::SetCells(MapId(set.map), window, set.cells);
                    self.change(now, message, about, change, context);
                }
            }
            Some(DeleteRasterMap::CODE) => {
                if let Some(delete) = read::<DeleteRasterMap>(message) {
                    let change = Change::RemoveRaster(MapId(delete.map));
                    let about = (delete.request_id, delete.map);
                    self.change(now, message, about, change, context);
                }
            }
            _ => return Handled::No,
        }
        Handled::Yes
    }

    fn handle_timeout(&mut self, now: Instant, context: &mut Context<'_>) {
        self.store.handle_timeout(now, context);
    }

    fn poll_timeout(&self) -> Option<Instant> {
        self.store.poll_timeout()
    }
}

/// Answers a change of a map that is refused for this reason.
pub(crate) fn refuse_map_change(message: &Received, why: &str, context: &mut Context<'_>) {
    let about = match code_of(&message.payload) {
        Some(CreateRasterMap::CODE) => read(message).map(|it: CreateRasterMap| (it.request_id, 0)),
        Some(SetRasterCells::CODE) => {
            read(message).map(|it: SetRasterCells| (it.request_id, it.map))
        }
        _ => read(message).map(|it: DeleteRasterMap| (it.request_id, it.map)),
    };
    if let Some((request_id, map)) = about {
        let answer = refused(request_id, map, ChangeResult::FAILED, why);
        context.reply_until_acknowledged(message, &answer);
    }
}

fn wanted(create: &CreateRasterMap) -> Raster {
    Raster {
        name: create.name.to_string_lossy().into_owned(),
        rows: create.rows,
        columns: create.columns,
        cell: create.cell_size,
        x: create.x,
        y: create.y,
        fill: create.fill,
        revision: 0,
    }
}

fn listed(MapId(map): MapId, raster: &Raster) -> MapRec {
    MapRec {
        map,
        name: raster.name.clone().into(),
        rows: raster.rows,
        columns: raster.columns,
        cell_size: raster.cell,
        x: raster.x,
        y: raster.y,
        revision: raster.revision,
    }
}

#[cfg(test)]
mod tests {
    use redb::backends::InMemoryBackend;

    use super::*;
    use crate::messages::ground::ReportRasterChange;
    use crate::motion::Frame;
    use crate::world::World;
    use jaus::service::rig::{CLIENT, Rig};

    fn rig() -> Rig {
        let world = World::on(InMemoryBackend::new()).unwrap();
        let store = WorldStore::new(world, Frame::default(), |error| panic!("{error}"));
        Rig::new(vec![Box::new(store.raster_maps())])
    }

    fn change(rig: &mut Rig, message: &impl Message) -> ReportRasterChange {
        assert!(rig.send(CLIENT, message));
        rig.run(WorldStore::LINGER);
        rig.answer().unwrap()
    }

    fn create(rows: u16, columns: u16) -> CreateRasterMap {
        CreateRasterMap {
            request_id: 5,
            name: "yard".into(),
            rows,
            columns,
            cell_size: 0.5,
            fill: 9,
            ..CreateRasterMap::default()
        }
    }

    fn set(map: u16, row: u16, cells: &[u8]) -> SetRasterCells {
        SetRasterCells {
            request_id: 6,
            map,
            row,
            rows: 1,
            columns: cells.len() as u16,
            cells: Bytes::copy_from_slice(cells),
            ..SetRasterCells::default()
        }
    }

    fn cells(rig: &mut Rig, query: &QueryRasterCells) -> (u16, u16, Vec<u8>) {
        let report: ReportRasterCells = rig.ask(query).unwrap();
        (report.rows, report.columns, report.cells.to_vec())
    }

    fn all_of(map: u16) -> QueryRasterCells {
        QueryRasterCells {
            map,
            ..QueryRasterCells::default()
        }
    }

    #[test]
    fn a_map_is_created_changed_told_and_deleted() {
        let mut rig = rig();
        let created = change(&mut rig, &create(2, 3));
        assert_eq!(created.result, ChangeResult::DONE);
        assert_eq!(
            (created.request_id, created.map, created.revision),
            (5, 1, 1)
        );
        let changed = change(&mut rig, &set(1, 1, &[1, 2, 3]));
        assert_eq!(
            (changed.request_id, changed.map, changed.revision),
            (6, 1, 2)
        );
        assert_eq!(cells(&mut rig, &all_of(1)), (2, 3, vec![9, 9, 9, 1, 2, 3]));
        let corner = QueryRasterCells {
            row: 1,
            column: 2,
            ..all_of(1)
        };
        assert_eq!(cells(&mut rig, &corner), (1, 1, vec![3]));
        let maps: ReportRasterMaps = rig.ask(&QueryRasterMaps).unwrap();
        assert_eq!(maps.map_list.len(), 1);
        assert_eq!(
            (maps.map_list[0].revision, maps.map_list[0].cell_size),
            (2, 0.5)
        );
        let delete = DeleteRasterMap {
            request_id: 7,
            map: 1,
        };
        assert_eq!(change(&mut rig, &delete).result, ChangeResult::DONE);
        assert_eq!(change(&mut rig, &delete).result, ChangeResult::NO_SUCH_MAP);
        let maps: ReportRasterMaps = rig.ask(&QueryRasterMaps).unwrap();
        assert!(maps.map_list.is_empty());
    }

    #[test]
    fn each_change_tells_subscribers_and_a_refused_one_does_not() {
        let mut rig = rig();
        change(&mut rig, &create(0, 3));
        assert!(rig.changed().is_empty());
        change(&mut rig, &create(2, 3));
        let changed = rig.changed();
        assert!(changed.contains(&QueryRasterMaps::CODE));
        assert!(changed.contains(&QueryRasterCells::CODE));
    }

    #[test]
    fn what_can_not_be_done_is_answered_with_the_reason() {
        let mut rig = rig();
        for (rows, columns) in [(0, 1), (1, 0), (4097, 1)] {
            let refused = change(&mut rig, &create(rows, columns));
            assert_eq!((refused.result, refused.map), (ChangeResult::WRONG_SIZE, 0));
            let reason = refused.reason.to_string_lossy().into_owned();
            assert!(reason.contains("1 to 4096"), "{reason}");
        }
        change(&mut rig, &create(2, 3));
        let outcomes = [
            set(9, 0, &[1]),
            set(1, 2, &[1]),
            set(1, 0, &[1, 1, 1, 1]),
            SetRasterCells {
                columns: 2,
                ..set(1, 0, &[1])
            },
        ]
        .map(|set| change(&mut rig, &set).result);
        let expected = [
            ChangeResult::NO_SUCH_MAP,
            ChangeResult::OUTSIDE,
            ChangeResult::OUTSIDE,
            ChangeResult::WRONG_SIZE,
        ];
        assert_eq!(outcomes, expected);
        assert_eq!(cells(&mut rig, &all_of(1)), (2, 3, vec![9; 6]));
        assert_eq!(cells(&mut rig, &all_of(2)), (0, 0, vec![]));
        let outside = QueryRasterCells {
            row: 1,
            maximum_rows: 2,
            ..all_of(1)
        };
        assert_eq!(cells(&mut rig, &outside), (0, 0, vec![]));
    }

    #[test]
    fn changes_that_wait_together_are_answered_in_their_order_at_once() {
        let mut rig = rig();
        change(&mut rig, &create(1, 1));
        for value in 1..=3 {
            assert!(rig.send(CLIENT, &set(1, 0, &[value])));
        }
        assert_eq!(rig.answer_code(), None);
        rig.run(WorldStore::LINGER);
        let revisions = [0; 3].map(|_| rig.answer::<ReportRasterChange>().unwrap().revision);
        assert_eq!(revisions, [2, 3, 4]);
        assert_eq!(cells(&mut rig, &all_of(1)), (1, 1, vec![3]));
    }

    #[test]
    fn changes_do_not_pile_up() {
        let mut rig = rig();
        change(&mut rig, &create(1, 1));
        for _ in 0..WorldStore::MOST_WAITING {
            assert!(rig.send(CLIENT, &set(1, 0, &[1])));
        }
        assert!(rig.answer_code().is_some(), "written at once");
        assert_eq!(rig.poll_timeout(), None);
    }

    #[test]
    fn of_a_map_too_large_for_one_report_the_southern_rows_are_told() {
        let mut rig = rig();
        change(&mut rig, &create(4096, 4096));
        let (rows, columns, octets) = cells(&mut rig, &all_of(1));
        assert_eq!(
            (rows, columns, octets.len()),
            (1024, 4096, RasterMaps::MOST_TOLD)
        );
    }
}
