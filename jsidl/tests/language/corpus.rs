//! Loads the public definitions, if available: all of them resolve, except those known to be
//! wrong.

use std::f64::consts::PI;
use std::fs;
use std::path::{Path, PathBuf};

use jaus_test_kit::evidence;
use jsidl::model::{Meaning, Shape, Unsigned};
use jsidl::{Loaded, Loader, Severity};

fn corpus() -> Option<PathBuf> {
    evidence::outside("jsidl-corpus")
}

fn load(corpus: &Path, sources: &[&str]) -> Loaded {
    let mut loader = Loader::new();
    for source in sources {
        loader.path(corpus.join(source));
    }
    loader.load()
}

/// The findings of a severity, each with its file name but without the directory.
fn findings(loaded: &Loaded, severity: Severity) -> Vec<String> {
    let found = loaded.diagnostics.iter().filter(|d| d.severity == severity);
    found
        .map(|d| {
            let file = d.location.file.file_name().unwrap_or_default();
            format!("{}: {}", file.display(), d.message)
        })
        .collect()
}

fn counts(loaded: &Loaded) -> (usize, usize) {
    let services = loaded.library.services();
    let messages = services.clone().map(|s| s.messages().count()).sum();
    (services.count(), messages)
}

#[test]
fn every_definition_of_jts_resolves() {
    let Some(corpus) = corpus() else { return };
    let loaded = load(&corpus, &["jts"]);
    assert_eq!(counts(&loaded), (97, 506));
    assert_eq!(findings(&loaded, Severity::Error), Vec::<String>::new());
    let alias = "the alias `basicTypes` is declared only in a referenced set: add a `declared_type_set_ref` for it here";
    let blanks = |service: &str| {
        format!("the id `urn:jaus:jss:HMI:{service}` has surrounding spaces: remove them")
    };
    assert_eq!(
        findings(&loaded, Severity::Warning),
        [
            format!("AnalogControl.xml: {}", blanks("AnalogControl")),
            format!("DrawingService.xml: {}", blanks("Drawing")),
            format!("CommandClass.xml: {alias}"),
            format!("InformClass.xml: {alias}"),
            format!("QueryClass.xml: {alias}"),
            format!("PointingDevice.xml: {}", blanks("PointingDevice")),
        ]
    );
}

#[test]
fn every_definition_of_ffi_resolves() {
    let Some(corpus) = corpus() else { return };
    let loaded = load(&corpus, &["ffi"]);
    assert_eq!(counts(&loaded), (76, 402));
    let again = "H264VideoEncoding.xml: `ConfirmSensorConfiguration` is declared again: the service inherits it from `urn:jaus:jss:environmentSensing:VisualSensor 2.0`, so remove it here";
    assert_eq!(findings(&loaded, Severity::Error), Vec::<String>::new());
    assert_eq!(
        findings(&loaded, Severity::Warning),
        [format!("urn_jaus_jss_environmentSensing_{again}")]
    );
}

/// Their transitions use events of the core services, which the built-in ones declare as well.
#[test]
fn published_services_resolve_beside_the_built_in_core() {
    let Some(corpus) = corpus() else { return };
    let mut loader = Loader::new();
    loader.path(corpus.join("ffi/urn.jaus.jss.mobility"));
    loader.catalogue();
    let loaded = loader.load();
    assert_eq!(findings(&loaded, Severity::Error), Vec::<String>::new());
}

/// One example inherits from `Management`, which the examples do not include.
#[test]
fn every_example_resolves_beside_the_core_services() {
    let Some(corpus) = corpus() else { return };
    let loaded = load(&corpus, &["jts", "jts-examples"]);
    assert_eq!(counts(&loaded), (97 + 8, 506 + 51));
    assert_eq!(findings(&loaded, Severity::Error), Vec::<String>::new());

    let alone = load(&corpus, &["jts-examples"]);
    assert_eq!(counts(&alone), (7, 46));
    assert_eq!(
        findings(&alone, Severity::Error),
        [
            "SkidSteerVehicleSim.xml: the base service `urn:jaus:jss:core:Management 1.0` is not loaded: load the file that declares it as well"
        ]
    );
}

/// `CBRNDetection` cannot be encoded: 14 optional members and 8 presence bits. `Management` 1.0 has
/// a transition on an undeclared event.
#[test]
fn of_fkie_only_what_cannot_be_is_an_error() {
    let Some(corpus) = corpus() else { return };
    let loaded = load(&corpus, &["fkie"]);
    assert_eq!(counts(&loaded), (129, 753));
    assert_eq!(
        findings(&loaded, Severity::Error),
        [
            "Management.xml: nothing triggers this transition: `Ready` is neither an event nor a \
             message of the service or a service it inherits from: declare it in the \
             `internal_events_set`, or correct the name",
            "CBRNSensor.xml: `CBRNDetection` is omitted from `urn:jaus:jss:iop:CBRNSensor 1.1`, because a definition it refers to is missing or has errors",
            "CBRNSensorClass.xml: the record `CBRNRec` has 14 optional members, but its `presence_vector` has only 8 bits: use a wider `field_type_unsigned`",
        ]
    );
    // `behaviour.rs` counts the findings about state machines.
    let mut warnings = findings(&loaded, Severity::Warning);
    warnings.retain(|w| !w.contains("`initial_state`") && !w.contains(": start there"));
    warnings.retain(|w| !w.contains("`is_stateless`"));
    assert_eq!(
        warnings,
        [
            "CBRNSensor.xml: `CBDetailedMeasurement` has the code F932, which is also that of `RNDetailedMeasurement`: a receiver cannot tell them apart, so change one `message_id`",
            "HealthMonitor_V1.4.xml: this service is a client of `urn:jaus:jss:exp:aeodrs:HealthReporter 1.4`, which is not loaded: load the file that declares it as well",
            "PlatformState_V1.xml: this service is a client of `urn:jaus:jss:iop:RenderUseless 1.1`, which is not loaded: load the file that declares it as well",
        ]
    );
}

/// The golden vectors cover every message that their generator could encode. Each is known here
/// under the same code, name, service and version.
#[test]
fn every_message_of_the_golden_vectors_is_known() {
    let Some(corpus) = evidence::outside("jsidl-corpus") else {
        return;
    };
    let libraries = ["jts", "fkie", "ffi"].map(|source| (source, load(&corpus, &[source])));
    let examples = load(&corpus, &["jts-examples", "jts"]);
    let mut vectors = 0;
    for file in fs::read_dir(evidence::golden()).expect("the folder exists") {
        let text = fs::read_to_string(file.expect("readable").path()).expect("UTF-8");
        for line in text.lines().filter(|line| line.contains("\"message_id\"")) {
            let vector: serde_json::Value = serde_json::from_str(line).expect("JSON");
            let field = |name: &str| vector[name].as_str().unwrap_or_default();
            let loaded = match field("source") {
                "jts-examples" => &examples,
                source => {
                    let found = libraries.iter().find(|(name, _)| source.starts_with(name));
                    &found.expect("a known source").1
                }
            };
            let code = u16::from_str_radix(field("message_id"), 16).expect("hexadecimal");
            let service = format!("{} {}", field("service_id").trim(), field("version"));
            let declared = loaded.library.by_code(code).any(|(declaring, message)| {
                message.name == field("message") && declaring.id.to_string() == service
            });
            assert!(declared, "{} {code:04X} of {service}", field("message"));
            vectors += 1;
        }
    }
    assert!(vectors > 2000, "{vectors} vectors are not all");
}

#[test]
fn what_a_definition_says_arrives_in_the_model() {
    let Some(corpus) = corpus() else { return };
    let loaded = load(&corpus, &["jts"]);
    let (_, pose) = loaded
        .library
        .by_code(0x4402)
        .find(|(service, _)| service.id.to_string() == "urn:jaus:jss:mobility:GlobalPoseSensor 1.0")
        .expect("GlobalPoseSensor reports its pose");
    assert_eq!(
        (pose.name.as_str(), pose.is_command),
        ("ReportGlobalPose", false)
    );
    assert_eq!(pose.header, None);
    let Some(Shape::Group(record)) = pose.body.as_ref().map(|body| &body.shape) else {
        panic!("the body is a record");
    };
    assert_eq!(record.presence, Some(Unsigned::U16));
    let names: Vec<_> = record.members.iter().map(|m| m.name.as_str()).collect();
    assert_eq!(
        names,
        [
            "Latitude",
            "Longitude",
            "Altitude",
            "Position_RMS",
            "Roll",
            "Pitch",
            "Yaw",
            "Attitude_RMS",
            "TimeStamp"
        ]
    );
    // A reference has its own name and optionality, and the bits of its target.
    let stamp = record.members.last().expect("nine members");
    assert!(stamp.optional);
    let Shape::Bits(bits) = &stamp.shape else {
        panic!("a time stamp is a bit field");
    };
    let last = bits.fields.last().expect("five fields");
    assert_eq!((last.name.as_str(), last.from, last.to), ("Day", 27, 31));
    // A limit computed from a constant in another file.
    let Shape::Scalar(yaw) = &record.members[6].shape else {
        panic!("yaw is a number");
    };
    let Meaning::Scaled(scale) = yaw.meaning else {
        panic!("yaw is scaled");
    };
    assert_eq!((scale.lower, scale.upper), (-PI, PI));
}
