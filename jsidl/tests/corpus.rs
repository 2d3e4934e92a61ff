//! Loads the public definitions, where they are at hand: all of them resolve, except those that
//! are known to be wrong.

use std::env;
use std::path::{Path, PathBuf};

use jsidl::{Loaded, Loader, Severity};

/// The directory of public definitions. Says loudly that it is missing, and fails in CI.
fn corpus() -> Option<PathBuf> {
    let workspace = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let shared = env::var_os("JAUS_SHARED").map_or_else(|| "../shared".into(), PathBuf::from);
    let corpus = workspace.join(shared).join("jsidl-corpus");
    if corpus.is_dir() {
        return Some(corpus);
    }
    eprintln!(
        "NOT TESTED: {} is missing; set JAUS_SHARED",
        corpus.display()
    );
    assert!(
        env::var_os("CI").is_none(),
        "the shared test data is missing in CI"
    );
    None
}

fn load(corpus: &Path, sources: &[&str]) -> Loaded {
    let mut loader = Loader::new();
    for source in sources {
        loader.path(corpus.join(source));
    }
    loader.load()
}

/// The findings of a severity, with the file's name alone.
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
    let alias = "the alias `basicTypes` is used, but only declared by a set that this one refers to: add a `declared_type_set_ref` for it here";
    let blanks = |service: &str| {
        format!("the id `urn:jaus:jss:HMI:{service}` is written with blanks around it: remove them")
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
fn every_definition_of_ffi_resolves_without_a_finding() {
    let Some(corpus) = corpus() else { return };
    let loaded = load(&corpus, &["ffi"]);
    assert_eq!(counts(&loaded), (76, 402));
    assert_eq!(loaded.diagnostics.to_string(), "");
}

/// One of them inherits from `Management`, which the examples do not bring along.
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
            "SkidSteerVehicleSim.xml: the service `urn:jaus:jss:core:Management 1.0` to inherit from is not loaded: load the file that declares it as well"
        ]
    );
}

/// `CBRNDetection` cannot be encoded: 14 optional members and 8 presence bits.
#[test]
fn of_fkie_only_the_message_that_cannot_be_encoded_is_left_out() {
    let Some(corpus) = corpus() else { return };
    let loaded = load(&corpus, &["fkie"]);
    assert_eq!(counts(&loaded), (129, 753));
    assert_eq!(
        findings(&loaded, Severity::Error),
        [
            "CBRNSensor.xml: `urn:jaus:jss:iop:CBRNSensor 1.1` is kept without `CBRNDetection`, because of errors in what defines that: correct them",
            "CBRNSensorClass.xml: the record `CBRNRec` has 14 optional members, but its `presence_vector` has only 8 bits: use a wider `field_type_unsigned`",
        ]
    );
    assert_eq!(
        findings(&loaded, Severity::Warning),
        [
            "CBRNSensor.xml: the code F932 stands for `RNDetailedMeasurement` and `CBDetailedMeasurement`: a receiver cannot tell them apart, so give one another `message_id`",
            "HealthMonitor_V1.4.xml: the service `urn:jaus:jss:exp:aeodrs:HealthReporter 1.4`, of which this one is a client, is not loaded",
            "PlatformState_V1.xml: the service `urn:jaus:jss:iop:RenderUseless 1.1`, of which this one is a client, is not loaded",
        ]
    );
}
