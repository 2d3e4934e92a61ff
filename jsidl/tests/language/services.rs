//! Our own service definitions: they are sound, they have the wire layouts of the public ones, and
//! their descriptions are not copied from those.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use jaus_test_kit::evidence;
use jsidl::model::{Item, Meaning, Message, Scalar, Service, Shape};
use jsidl::{Library, Loader};

fn load(paths: &[PathBuf]) -> Library {
    let mut loader = Loader::new();
    for path in paths {
        loader.path(path);
    }
    let loaded = loader.load();
    for diagnostic in loaded.diagnostics.iter() {
        eprintln!("{diagnostic}");
    }
    assert!(!loaded.diagnostics.has_errors());
    loaded.library
}

fn ours() -> Library {
    let library = load(&[Path::new(env!("CARGO_MANIFEST_DIR")).join("services")]);
    assert!(library.services().next().is_some());
    library
}

/// The public collections, each with its name.
fn public(corpus: &Path) -> [(&'static str, Library); 3] {
    ["ffi", "jts", "fkie"].map(|source| {
        let mut loader = Loader::new();
        loader.path(corpus.join(source));
        // Some of them have errors; their valid parts count.
        (source, loader.load().library)
    })
}

#[test]
fn every_service_of_each_set_is_there() {
    let library = ours();
    for (set, versions) in [
        // 1.1, 1.0 without List Manager, and the clients of both.
        ("urn:jaus:jss:core:", 8 + 7 + 9),
        // 1.1, 1.0 with its own List Manager, a draft of acceleration, and clients of 1.0.
        ("urn:jaus:jss:mobility:", 21 + 15 + 1 + 8),
        // 2.0, 1.0, and clients of 1.0.
        ("urn:jaus:jss:environmentSensing:", 12 + 5 + 4),
        // 2.0, 1.0 with one service under two names, and the clients of both.
        ("urn:jaus:jss:manipulator:", 25 + 21 + 13),
        ("urn:jaus:jss:ugv:", 10 + 3),
        ("urn:jaus:jss:HMI:", 5),
        ("urn:jaus:jss:missionSpooler:", 1),
        ("urn:jaus:jss:iop:", 10 + 5),
        ("urn:jaus:jss:exp:aeodrs:", 1 + 1),
        ("urn:jaus-rs:core:", 1),
        ("urn:jaus-rs:ground:", 5),
        ("urn:jaus-rs:ra33:", 16),
    ] {
        let ids = library.services().map(|service| &service.id);
        assert_eq!(
            ids.filter(|id| id.urn.starts_with(set)).count(),
            versions,
            "{set}"
        );
    }
    for service in library.services() {
        let root = library
            .lineage(service)
            .last()
            .map(|root| root.name.clone());
        // In the Reference Architecture the transport is not a service.
        let expected = match service.id.urn.strip_prefix("urn:jaus-rs:ra33:") {
            Some(_) => "Core",
            None => "Transport",
        };
        assert_eq!(
            root.as_deref(),
            Some(expected),
            "{} descends from it",
            service.id
        );
    }
}

#[test]
fn every_message_and_field_says_what_it_is_for() {
    for service in ours().services() {
        assert!(!service.description.is_empty(), "{}", service.id);
        for message in service.messages() {
            assert!(
                !message.description.is_empty(),
                "{} {}",
                service.id,
                message.name
            );
            each_field(message, &mut |item| {
                assert!(
                    !item.interpretation.is_empty(),
                    "{} {}",
                    message.name,
                    item.name
                );
            });
        }
    }
}

const LIST_DRIVERS: &[&str] = &[
    "mobility:GlobalPathSegmentDriver 1.0",
    "mobility:GlobalWaypointListDriver 1.0",
    "mobility:LocalPathSegmentDriver 1.0",
    "mobility:LocalWaypointListDriver 1.0",
];
const EXECUTE_LIST: &[&str] = &["041E ExecuteList"];
const WRENCH_EFFORT: &[&str] = &["0405 SetWrenchEffort", "4405 ReportWrenchEffort"];
const VELOCITY_LIMITS: &[&str] = &[
    "0415 SetVelocityCommand",
    "0416 SetAccelerationLimit",
    "4415 ReportVelocityCommand",
    "4416 ReportAccelerationLimit",
];

/// Differences from a public service of the same name and version: the collection, the services,
/// and all messages that differ in each of them. Our definition agrees with the other collections,
/// or is as the comment says.
const DIFFERENT: &[(&str, &[&str], &[&str])] = &[
    // The same octets. As in 1.1, the list is executed only for the client in control, efforts are
    // percent, and the kinds of limits have shorter names.
    ("fkie", LIST_DRIVERS, EXECUTE_LIST),
    ("jts", LIST_DRIVERS, EXECUTE_LIST),
    ("fkie", &["mobility:PrimitiveDriver 1.0"], WRENCH_EFFORT),
    ("jts", &["mobility:PrimitiveDriver 1.0"], WRENCH_EFFORT),
    (
        "fkie",
        &["mobility:VelocityStateDriver 1.0"],
        VELOCITY_LIMITS,
    ),
    (
        "jts",
        &["mobility:VelocityStateDriver 1.0"],
        VELOCITY_LIMITS,
    ),
    // Waypoints of the list drivers are only elements of their lists in another collection.
    (
        "fkie",
        &["mobility:GlobalWaypointListDriver 1.0"],
        &["040C SetGlobalWaypoint", "base"],
    ),
    (
        "fkie",
        &["mobility:LocalWaypointListDriver 1.0"],
        &["040D SetLocalWaypoint", "base"],
    ),
    // The same for clients.
    (
        "fkie",
        &[
            "mobility:GlobalWaypointListDriverClient 1.0",
            "mobility:LocalWaypointListDriverClient 1.0",
        ],
        EXECUTE_LIST,
    ),
    (
        "fkie",
        &["mobility:PrimitiveDriverClient 1.0"],
        WRENCH_EFFORT,
    ),
    // Two collections disagree on whether a vector's speed is optional.
    (
        "jts",
        &["mobility:GlobalVectorDriver 1.0"],
        &["0407 SetGlobalVector", "4407 ReportGlobalVector"],
    ),
    (
        "fkie",
        &["mobility:LocalVectorDriver 1.0"],
        &["0408 SetLocalVector", "4408 ReportLocalVector"],
    ),
    // The maximum force of a prismatic joint has the unit of a torque there.
    (
        "fkie",
        &[
            "manipulator:ManipulatorActuatorForceTorqueDriver 1.0",
            "manipulator:ManipulatorEndEffectorPoseDriver 1.0",
            "manipulator:ManipulatorEndEffectorPoseListDriver 1.0",
            "manipulator:ManipulatorEndEffectorPoseSensor 1.0",
            "manipulator:ManipulatorEndEffectorVelocityStateDriver 1.0",
            "manipulator:ManipulatorEndEffectorVelocityStateSensor 1.0",
            "manipulator:ManipulatorJointForceTorqueSensor 1.0",
            "manipulator:ManipulatorJointPositionDriver 1.0",
            "manipulator:ManipulatorJointPositionSensor 1.0",
            "manipulator:ManipulatorJointPositionsListDriver 1.0",
            "manipulator:ManipulatorJointVelocityDriver 1.0",
            "manipulator:ManipulatorJointVelocitySensor 1.0",
            "manipulator:PrimitiveManipulator 1.0",
            "manipulator:PrimitiveManipulatorClient 1.0",
        ],
        &["4600 ReportManipulatorSpecifications"],
    ),
    // Names in the singular among others in the plural: all of 1.0 is plural here.
    (
        "fkie",
        &["manipulator:ManipulatorJointPositionSensor 1.0"],
        &[
            "2602 QueryJointPosition",
            "2602 QueryJointPositions",
            "4602 ReportJointPosition",
            "4602 ReportJointPositions",
        ],
    ),
    (
        "fkie",
        &[
            "manipulator:PrimitiveManipulator 1.0",
            "manipulator:PrimitiveManipulatorClient 1.0",
        ],
        &[
            "0601 SetJointEffort",
            "0601 SetJointEfforts",
            "2601 QueryJointEffort",
            "2601 QueryJointEfforts",
            "4601 ReportJointEffort",
            "4601 ReportJointEfforts",
        ],
    ),
    (
        "fkie",
        &["manipulator:PrimitivePanTilt 1.0"],
        &[
            "0621 SetPanTiltJointEffort",
            "0621 SetPanTiltJointEfforts",
            "2621 QueryPanTiltJointEffort",
            "2621 QueryPanTiltJointEfforts",
            "4621 ReportPanTiltJointEffort",
            "4621 ReportPanTiltJointEfforts",
        ],
    ),
    // `ParentID` for `ParentId`, which 2.0 has everywhere.
    (
        "fkie",
        &[
            "manipulator:PrimitiveEndEffector 1.0",
            "manipulator:PrimitiveEndEffectorClient 1.0",
        ],
        &["4632 ReportEndEffectorSpecification"],
    ),
    // The lights are not in bit order here, but they are in the newest version.
    (
        "jts",
        &["ugv:IlluminationService 1.0"],
        &["0513 SetIlluminationState", "4513 ReportIlluminationState"],
    ),
    // Inherited from the visual sensor, so it is not declared again.
    (
        "ffi",
        &["environmentSensing:H264VideoEncoding 2.0"],
        &["0801 ConfirmSensorConfiguration"],
    ),
    // The published message cannot be encoded: 14 optional members, 8 presence bits. It is omitted
    // from their service; ours has a wider presence vector.
    ("fkie", &["iop:CBRNSensor 1.1"], &["F931 CBRNDetection"]),
    // Two messages of a service share a code. Ours keeps it for one of them; the other gets the
    // code that its query names.
    (
        "fkie",
        &["iop:CBRNSensor 1.1"],
        &["F932 CBDetailedMeasurement"],
    ),
    (
        "fkie",
        &["iop:CBRNSensor 1.1"],
        &["F933 CBDetailedMeasurement"],
    ),
    (
        "fkie",
        &[
            "ugv:IlluminationService 1.0",
            "ugv:IlluminationServiceClient 1.0",
        ],
        &["0513 SetIlluminationState", "4513 ReportIlluminationState"],
    ),
    // Names start with lower-case letters here, but with capitals in the newest version.
    (
        "jts",
        &["ugv:PlatformSpecifications 1.0"],
        &["4502 ReportPlatformSpecifications"],
    ),
    (
        "fkie",
        &["ugv:PlatformSpecifications 1.0"],
        &["4502 ReportPlatformSpecifications"],
    ),
    // Different capitals, one position instead of two, dimensions from 0 and without a unit, and an
    // older base: apparently a draft, because the other collections agree.
    (
        "fkie",
        &["ugv:StabilizerDriver 1.0", "ugv:StabilizerDriverClient 1.0"],
        &[
            "0503 SetStabilizerEffort",
            "0504 SetStabilizerPosition",
            "2503 QueryStabilizerEffort",
            "2504 QueryStabilizerPosition",
            "4503 ReportStabilizerEffort",
            "4504 ReportStabilizerPosition",
            "4505 ReportStabilizerCapabilities",
            "base",
        ],
    ),
];

#[test]
fn every_service_has_the_octets_that_the_public_ones_have() {
    let Some(corpus) = evidence::outside("jsidl-corpus") else {
        return;
    };
    let ours = ours();
    let mut different = BTreeSet::new();
    for (source, library) in &public(&corpus) {
        for theirs in library.services() {
            let Some(service) = ours.service(&theirs.id) else {
                continue;
            };
            for what in differences(service, theirs) {
                different.insert(format!("{source} {} {what}", theirs.id));
            }
        }
    }
    let mut expected = BTreeSet::new();
    for (source, services, messages) in DIFFERENT {
        for service in *services {
            let each = messages.iter();
            expected.extend(each.map(|what| format!("{source} urn:jaus:jss:{service} {what}")));
        }
    }
    let only = |these: &BTreeSet<String>, those| these - those;
    assert_eq!(
        (only(&different, &expected), only(&expected, &different)),
        (BTreeSet::new(), BTreeSet::new()),
        "differ unexpectedly, and do not differ though expected to"
    );
}

/// The messages that differ between two services, and `base` if their base services differ.
fn differences(ours: &Service, theirs: &Service) -> Vec<String> {
    let (left, right) = (layouts(ours), layouts(theirs));
    let messages: BTreeSet<_> = left.keys().chain(right.keys()).collect();
    let mut different: Vec<_> = messages
        .into_iter()
        .filter(|message| left.get(message) != right.get(message))
        .map(|(code, name)| format!("{code:04X} {name}"))
        .collect();
    let base = |service: &Service| service.inherits_from.as_ref().map(|base| base.id.clone());
    if base(ours) != base(theirs) {
        different.push("base".to_owned());
    }
    different
}

/// A service under a misspelt name, which exists under its correct name.
const MISSPELT: &str = "urn:jaus:jss:core:Liveliness 1.0";

#[test]
fn every_public_service_is_there() {
    let Some(corpus) = evidence::outside("jsidl-corpus") else {
        return;
    };
    let ours = ours();
    let mut missing = BTreeSet::new();
    for (_, library) in &public(&corpus) {
        for theirs in library.services() {
            let id = theirs.id.to_string();
            if ours.service(&theirs.id).is_none() && id != MISSPELT {
                missing.insert(id);
            }
        }
    }
    assert_eq!(missing, BTreeSet::new());
}

#[test]
fn no_sentence_is_taken_from_the_public_definitions() {
    let Some(corpus) = evidence::outside("jsidl-corpus") else {
        return;
    };
    let mut theirs = BTreeSet::new();
    for (_, library) in &public(&corpus) {
        for text in texts(library) {
            theirs.extend(runs(&text));
        }
    }
    let taken: BTreeMap<_, _> = texts(&ours())
        .into_iter()
        .flat_map(|text| {
            runs(&text)
                .map(|run| (run, text.clone()))
                .collect::<Vec<_>>()
        })
        .filter(|(run, _)| theirs.contains(run))
        .collect();
    assert_eq!(taken, BTreeMap::new());
}

/// All sequences of six consecutive words in a text.
fn runs(text: &str) -> impl Iterator<Item = Vec<String>> {
    let words = text
        .split(|c: char| !c.is_alphanumeric())
        .filter(|word| !word.is_empty());
    let words: Vec<_> = words.map(str::to_lowercase).collect();
    words
        .windows(6)
        .map(<[String]>::to_vec)
        .collect::<Vec<_>>()
        .into_iter()
}

fn texts(library: &Library) -> Vec<String> {
    let mut texts = Vec::new();
    for service in library.services() {
        texts.push(service.description.clone());
        for message in service.messages() {
            texts.push(message.description.clone());
            each_field(message, &mut |item| texts.push(item.interpretation.clone()));
        }
    }
    texts
}

fn each_field(message: &Message, visit: &mut impl FnMut(&Item)) {
    message
        .body
        .iter()
        .for_each(|body| each_field_of(body, visit));
}

fn each_field_of(item: &Item, visit: &mut impl FnMut(&Item)) {
    match &item.shape {
        Shape::Group(group) => group
            .members
            .iter()
            .for_each(|member| each_field_of(member, visit)),
        Shape::List(list) => each_field_of(&list.element, visit),
        Shape::Variant(variant) => {
            variant
                .alternatives
                .iter()
                .for_each(|chosen| each_field_of(chosen, visit));
        }
        _ => visit(item),
    }
}

/// The wire layouts of a service's messages: everything except the descriptions and the limits of
/// counts, in which ours are more tolerant.
fn layouts(service: &Service) -> BTreeMap<(u16, String), String> {
    let messages = service.messages().map(|message| {
        let body = message.body.as_ref().map(layout);
        (
            (message.code, message.name.clone()),
            format!("{} {body:?}", message.is_command),
        )
    });
    messages.collect()
}

fn layout(item: &Item) -> String {
    let optional = if item.optional { "?" } else { "" };
    let all = |items: &[Item]| items.iter().map(layout).collect::<Vec<_>>().join(" ");
    let shape = match &item.shape {
        Shape::Group(group) => format!("{:?}({})", group.presence, all(&group.members)),
        Shape::List(list) => format!("{:?}[{}]", list.count.unsigned, layout(&list.element)),
        Shape::Variant(variant) => format!("{:?}<{}>", variant.tag, all(&variant.alternatives)),
        Shape::Scalar(number) => scalar(number),
        Shape::Bits(bits) => {
            let fields = bits
                .fields
                .iter()
                .map(|f| format!("{}:{}..{}", f.name, f.from, f.to));
            format!("{:?} {:?}", bits.base, fields.collect::<Vec<_>>())
        }
        Shape::FixedString { length } => format!("text {length}"),
        Shape::VariableString { count } => format!("text {:?}", count.unsigned),
        Shape::Blob { count, format } => format!("{format} {:?}", count.unsigned),
        Shape::FormattedBlob { formats, count } => format!("{formats:?} {:?}", count.unsigned),
        Shape::Measure { choices } => {
            let choices = choices.iter().map(|choice| {
                format!(
                    "{} {:?} {}",
                    choice.index,
                    choice.name,
                    scalar(&choice.scalar)
                )
            });
            choices.collect::<Vec<_>>().join(" ")
        }
        Shape::Array(array) => format!("{:?}[{}]", array.dimensions, layout(&array.element)),
        shape => format!("{shape:?}"),
    };
    format!("{}{optional}={shape}", item.name)
}

fn scalar(scalar: &Scalar) -> String {
    let meaning = match &scalar.meaning {
        Meaning::Plain => String::new(),
        Meaning::Scaled(scale) => format!("{scale:?}"),
        Meaning::Values(set) => {
            let values: BTreeMap<_, _> = set
                .values
                .iter()
                .map(|value| (value.index, value.name.replace("FEATURE _", "FEATURE_")))
                .collect();
            format!("{values:?}")
        }
    };
    format!("{:?} {} {meaning}", scalar.number, scalar.units)
}

/// The Reference Architecture needs signed scaled numbers, and nodes need to know what the sender of a
/// message must be allowed: the standard has no words for them.
#[test]
fn a_strict_check_of_our_definitions_finds_nothing_but_our_own_attributes() {
    let mut loader = Loader::new();
    loader.strict();
    loader.path(Path::new(env!("CARGO_MANIFEST_DIR")).join("services"));
    let found = loader.load().diagnostics;
    let unknown = found.iter().filter(|finding| {
        let of_ra = finding
            .location
            .file
            .components()
            .any(|it| it.as_os_str() == "ra33");
        let known = ["permission", "authority", "granted", "stops", "destination"].iter();
        let mut known = known.chain(of_ra.then_some(&"bias")).map(|own| {
            format!("the standard has no attribute `{own}` of the namespace `urn:jaus-rs:jsidl`")
        });
        !known.any(|known| finding.message.starts_with(&known))
    });
    let unknown: Vec<_> = unknown.map(ToString::to_string).collect();
    assert_eq!(unknown, Vec::<String>::new());
}
