//! Replies of the Vector Knowledge Store to its clients.

use redb::backends::InMemoryBackend;

use super::*;
use crate::messages::ground::create_vks_objects::{
    Attribute, BufferedObjectSeq, BufferedSeq, ByteRec, FeatureClassRec, FeatureClassSeq,
    ObjectRec, ObjectType, Objects as NewObjects, PlainObjectSeq, PlainSeq, PointRec, RequestRec,
};
use crate::messages::ground::query_vks_objects::{
    FeatureClassCountRec, ObjectIdRec, RegionRec, RegionType,
};
use crate::messages::ground::report_vks_objects::{BufferRec, Objects};
use crate::messages::ground::{
    QueryRasterMaps, ReportVksObjects, ReportVksObjectsCreation, ReportVksTraversability,
};
use crate::motion::Frame;
use crate::world::{Picture, Place, Raster};
use jaus::codec::Message;
use jaus::service::rig::{CLIENT, Rig, STRANGER};

fn rig() -> Rig {
    rig_over(World::on(InMemoryBackend::new()).unwrap())
}

fn rig_over(world: World) -> Rig {
    let store = WorldStore::new(world, Frame::at(52.5, 13.4), |error| panic!("{error}"));
    Rig::new(vec![
        Box::new(store.vector_knowledge_store()),
        Box::new(store.raster_maps()),
    ])
}

fn point(latitude: f64, longitude: f64) -> PointRec {
    let place = Place::from_degrees(latitude, longitude);
    PointRec {
        latitude: place.latitude,
        longitude: place.longitude,
    }
}

fn class(id: u16, value: u8) -> FeatureClassSeq {
    FeatureClassSeq {
        feature_class_rec: FeatureClassRec {
            feature_class_id: id,
        },
        attribute: Attribute::ByteRec(ByteRec { value }),
    }
}

fn plain(object_type: ObjectType, class: FeatureClassSeq, points: Vec<PointRec>) -> PlainObjectSeq {
    PlainObjectSeq {
        object_rec: ObjectRec { object_type },
        feature_class_list: vec![class],
        point_list: points,
    }
}

fn create(message_properties: u8, plain_list: Vec<PlainObjectSeq>) -> CreateVksObjects {
    CreateVksObjects {
        objects: NewObjects::PlainSeq(PlainSeq {
            request_rec: RequestRec {
                message_properties,
                request_id: 77,
            },
            plain_list,
        }),
    }
}

/// Sends a change and waits until it is on disk.
fn change(rig: &mut Rig, message: &impl Message) {
    assert!(rig.send(CLIENT, message));
    rig.run(WorldStore::LINGER);
}

/// Two points of classes 5 and 6, and a line of both.
fn some(rig: &mut Rig) {
    let line = PlainObjectSeq {
        feature_class_list: vec![class(5, 1), class(6, 2)],
        ..plain(
            ObjectType::LINE,
            class(0, 0),
            vec![point(1.0, 1.0), point(2.0, 2.0)],
        )
    };
    let objects = vec![
        plain(ObjectType::POINT, class(5, 1), vec![point(1.0, 1.0)]),
        plain(ObjectType::POINT, class(6, 1), vec![point(3.0, 3.0)]),
        line,
    ];
    change(rig, &create(0, objects));
    assert_eq!(rig.answer_code(), None, "no confirmation was wanted");
}

fn query() -> QueryVksObjects {
    let mut query = QueryVksObjects::default();
    query.request_rec.response_presence_vector = 1;
    query.request_rec.request_id = 9;
    query
}

fn numbers(report: ReportVksObjects) -> Vec<u32> {
    match report.objects {
        Objects::DataSeq(data) => {
            assert_eq!(data.request_rec.request_id, 9);
            data.object_list
                .iter()
                .map(|it| it.object_id_rec.object_id)
                .collect()
        }
        Objects::CountRec(count) => panic!("{count:?}"),
    }
}

fn find(rig: &mut Rig, query: &QueryVksObjects) -> Vec<u32> {
    numbers(rig.ask(query).unwrap())
}

#[test]
fn a_creation_is_confirmed_with_numbers_and_zero_for_what_is_no_object() {
    let mut rig = rig();
    let good = plain(ObjectType::POINT, class(5, 1), vec![point(1.0, 1.0)]);
    let pointless = plain(ObjectType::POLYGON, class(5, 1), vec![point(1.0, 1.0)]);
    let strange = plain(ObjectType(99), class(5, 1), vec![point(1.0, 1.0)]);
    assert!(rig.send(
        CLIENT,
        &create(1, vec![good.clone(), pointless, strange, good])
    ));
    assert_eq!(rig.answer_code(), None, "it is not on the disk yet");
    rig.run(WorldStore::LINGER);
    let report: ReportVksObjectsCreation = rig.answer().unwrap();
    assert_eq!(report.request_rec.request_id, 77);
    let ids: Vec<u32> = report
        .object_id_list
        .iter()
        .map(|it| it.object_id)
        .collect();
    assert_eq!(ids, [1, 0, 0, 2]);
    assert!(rig.changed().contains(&QueryVksObjects::CODE));
    assert!(rig.changed().contains(&QueryVksBounds::CODE));
    assert!(!rig.changed().contains(&QueryRasterMaps::CODE));
}

#[test]
fn the_octets_of_a_creation_are_those_of_the_draft() {
    let mut rig = rig();
    let buffered = CreateVksObjects {
        objects: NewObjects::BufferedSeq(BufferedSeq {
            request_rec: RequestRec {
                message_properties: 1,
                request_id: 3,
            },
            buffered_list: vec![BufferedObjectSeq {
                object_rec: ObjectRec {
                    object_type: ObjectType::POINT,
                },
                buffer_rec: BufferRec { buffer: 1.0 },
                feature_class_list: vec![class(0x0201, 7)],
                point_list: vec![PointRec {
                    latitude: 1,
                    longitude: -1,
                }],
            }],
        }),
    };
    let octets = buffered.encode().unwrap();
    let expected = [
        &[0x20, 0x0A, 1, 1, 3, 1, 0, 0][..],
        &[0, 0, 0x80, 0x3F, 1, 1, 2, 0, 7],
        &[1, 0, 1, 0, 0, 0, 0xFF, 0xFF, 0xFF, 0xFF],
    ];
    assert_eq!(octets, expected.concat());
    change(&mut rig, &buffered);
    let confirmation: ReportVksObjectsCreation = rig.answer().unwrap();
    let octets = confirmation.encode().unwrap();
    assert_eq!(octets[..], [0x20, 0x4A, 3, 1, 0, 1, 0, 0, 0]);
}

#[test]
fn objects_are_found_by_number_region_class_and_attribute() {
    let mut rig = rig();
    some(&mut rig);
    assert_eq!(find(&mut rig, &query()), [1, 2, 3]);
    let ids = QueryVksObjects {
        object_id_list: Some([3, 8].map(|object_id| ObjectIdRec { object_id }).into()),
        ..query()
    };
    assert_eq!(find(&mut rig, &ids), [3]);
    let mut of_class = query();
    of_class.feature_class_count_rec = Some(FeatureClassCountRec {
        feature_class_count: 1,
    });
    of_class.feature_class_rec = Some(FeatureClassRec {
        feature_class_id: 6,
    });
    assert_eq!(find(&mut rig, &of_class), [2, 3]);
    of_class.attribute = Some(Attribute::ByteRec(ByteRec { value: 2 }));
    assert_eq!(find(&mut rig, &of_class), [3]);
    let mut region = query();
    region.region_rec = Some(RegionRec {
        region_type: RegionType::POINT,
    });
    region.point_list = Some(vec![point(3.001, 3.0)]);
    assert_eq!(find(&mut rig, &region), [0_u32; 0]);
    region.buffer_rec = Some(BufferRec { buffer: 112.0 });
    assert_eq!(find(&mut rig, &region), [2]);
}

#[test]
fn conditions_that_make_no_sense_together_find_nothing() {
    let mut rig = rig();
    some(&mut rig);
    let buffer_without_region = QueryVksObjects {
        buffer_rec: Some(BufferRec { buffer: 1.0 }),
        ..query()
    };
    let region_without_points = QueryVksObjects {
        region_rec: Some(RegionRec {
            region_type: RegionType::POLYGON,
        }),
        ..query()
    };
    let class_without_count = QueryVksObjects {
        feature_class_rec: Some(FeatureClassRec {
            feature_class_id: 5,
        }),
        ..query()
    };
    for wrong in [
        buffer_without_region,
        region_without_points,
        class_without_count,
    ] {
        assert_eq!(find(&mut rig, &wrong), [0_u32; 0]);
    }
}

#[test]
fn only_the_count_is_told_if_only_that_is_wanted() {
    let mut rig = rig();
    some(&mut rig);
    let mut query = query();
    query.request_rec.response_presence_vector = 0;
    let report: ReportVksObjects = rig.ask(&query).unwrap();
    assert_eq!(report.encode().unwrap()[..], [0x23, 0x4A, 0, 9, 3, 0]);
}

#[test]
fn what_is_deleted_is_found_no_more_and_a_deletion_without_sense_deletes_nothing() {
    let mut rig = rig();
    some(&mut rig);
    let mut delete = DeleteVksObjects {
        feature_class_rec: Some(FeatureClassRec {
            feature_class_id: 5,
        }),
        ..DeleteVksObjects::default()
    };
    change(&mut rig, &delete);
    assert_eq!(find(&mut rig, &query()), [1, 2, 3]);
    delete.feature_class_count_rec = Some(FeatureClassCountRec {
        feature_class_count: 1,
    });
    change(&mut rig, &delete);
    assert_eq!(find(&mut rig, &query()), [2]);
}

#[test]
fn changes_are_taken_from_whoever_may_command_only() {
    let mut rig = rig();
    let object = plain(ObjectType::POINT, class(5, 1), vec![point(1.0, 1.0)]);
    assert!(rig.send(STRANGER, &create(1, vec![object])));
    rig.run(WorldStore::LINGER);
    assert_eq!(rig.answer_code(), None);
    assert_eq!(find(&mut rig, &query()), [0_u32; 0]);
}

#[test]
fn bounds_and_metadata_are_told() {
    let mut rig = rig();
    some(&mut rig);
    let bounds: ReportVksBounds = rig
        .ask(&QueryVksBounds {
            request_id: 4,
            feature_class_id: 6,
        })
        .unwrap();
    let (low, high) = (point(1.0, 1.0), point(3.0, 3.0));
    assert_eq!(bounds.request_id, 4);
    assert_eq!(bounds.south_west_latitude, low.latitude);
    assert_eq!(bounds.north_east_longitude, high.longitude);
    for (class, text) in [(6, "rock"), (7, "tree")] {
        let set = SetVksFeatureClassMetadata {
            option: HowToSet::APPEND,
            feature_class_id: class,
            metadata: text.into(),
        };
        change(&mut rig, &set);
    }
    let ask = |feature_class_id| QueryVksFeatureClassMetadata { feature_class_id };
    let told: ReportVksFeatureClassMetadata = rig.ask(&ask(6)).unwrap();
    assert_eq!(told.metadata, "rock");
    let told: ReportVksFeatureClassMetadata = rig.ask(&ask(8)).unwrap();
    assert_eq!((told.feature_class_id, told.metadata.len()), (8, 0));
    let all = ask(FeatureClass::ALL);
    let first: ReportVksFeatureClassMetadata = rig.ask(&all).unwrap();
    let second: ReportVksFeatureClassMetadata = rig.answer().unwrap();
    assert_eq!((first.feature_class_id, second.feature_class_id), (6, 7));
}

/// More objects than one report can hold: 40 lines of 2000 points.
fn many(rig: &mut Rig) {
    let line = plain(ObjectType::LINE, class(5, 1), vec![point(1.0, 1.0); 2000]);
    change(rig, &create(0, vec![line; 40]));
}

#[test]
fn a_long_answer_comes_in_parts() {
    let mut rig = rig();
    many(&mut rig);
    let mut told = find(&mut rig, &query());
    assert!(told.len() < 40, "{} at once", told.len());
    rig.run(std::time::Duration::from_secs(1));
    while let Some(report) = rig.answer() {
        told.extend(numbers(report));
    }
    assert_eq!(told, (1..=40).collect::<Vec<u32>>());
    assert_eq!(rig.poll_timeout(), None);
}

#[test]
fn a_long_answer_ends_when_its_client_wants_that() {
    let mut rig = rig();
    many(&mut rig);
    find(&mut rig, &query());
    assert!(rig.send(CLIENT, &TerminateVksDataTransfer));
    assert!(
        rig.poll_timeout().is_some(),
        "another client's transfer goes on"
    );
    rig.answer_code();
    assert!(rig.send(STRANGER, &TerminateVksDataTransfer));
    assert_eq!(
        rig.answer_code(),
        Some(ReportVksDataTransferTermination::CODE)
    );
    rig.run(std::time::Duration::from_secs(1));
    assert_eq!(rig.answer_code(), None);
}

#[test]
fn the_traversability_map_is_told_as_objects_under_the_other_code() {
    let mut world = World::on(InMemoryBackend::new()).unwrap();
    let picture = Picture::read(b"##\n..").unwrap();
    let raster = picture.at("traversability".to_owned(), 1.0, (0.0, 0.0));
    let change = Change::AddRaster(raster, picture.cells.into());
    world.apply(vec![change]).unwrap();
    let mut rig = rig_over(world);
    let ask = QueryVksTraversability {
        request_rec: query().request_rec,
        ..QueryVksTraversability::default()
    };
    let octets = ask.encode().unwrap();
    assert_eq!(octets[..], [0x23, 0x24, 0, 1, 9]);
    let report: ReportVksTraversability = rig.ask(&ask).unwrap();
    assert_eq!(report.encode().unwrap()[..3], [0x23, 0x44, 1]);
    let Objects::DataSeq(data) = report.objects else {
        panic!("no data");
    };
    let values: Vec<_> = data
        .object_list
        .iter()
        .map(|it| it.feature_class_list[0].attribute.clone())
        .collect();
    let byte = |value| Attribute::ByteRec(ByteRec { value });
    assert_eq!(values, [byte(255), byte(0)], "from the south");
    assert_eq!(data.object_list[0].point_list[0], point(52.5, 13.4));
}

#[test]
fn a_map_too_large_for_objects_is_only_counted() {
    let mut world = World::on(InMemoryBackend::new()).unwrap();
    let raster = Picture::demo().at("big".to_owned(), 1.0, (0.0, 0.0));
    let raster = Raster {
        rows: 257,
        columns: 256,
        ..raster
    };
    world
        .apply(vec![Change::AddRaster(raster, bytes::Bytes::new())])
        .unwrap();
    let mut rig = rig_over(world);
    let ask = QueryVksTraversability {
        request_rec: query().request_rec,
        ..QueryVksTraversability::default()
    };
    let report: ReportVksTraversability = rig.ask(&ask).unwrap();
    assert!(matches!(report.objects, Objects::CountRec(count) if count.object_count == u16::MAX));
}
