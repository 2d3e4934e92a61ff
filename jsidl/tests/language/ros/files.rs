//! Snapshots of some files.

use std::path::Path;

use jaus_test_kit::snapshot;
use jsidl::Library;

use super::definitions::{constructs, package};
use crate::support::catalogue;

/// Compares the files of these types.
fn check(library: &Library, names: &[&str]) {
    let directory = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/language/ros");
    let files = package(library).files();
    for name in names {
        let path = format!("jaus_msgs/msg/{name}.msg");
        let found = files.iter().find(|(known, _)| *known == path);
        let (_, text) = found.unwrap_or_else(|| panic!("{name} is not among the files"));
        snapshot::check(directory.join(format!("{name}.msg")), text);
    }
}

#[test]
fn built_in_messages_are_written_as_agreed() {
    let names = [
        "CoreReportStatusV1p0",
        "CoreQueryStatusV1p0",
        "MobilityReportGlobalPoseV1p0",
        "MobilityReportGlobalPoseV1p0TimeStamp",
    ];
    check(&catalogue(), &names);
}

#[test]
fn constructs_are_written_as_agreed() {
    let names = [
        "ExampleReportListOfListsV1p0",
        "ExampleReportListOfListsV1p0Inner",
        "ExampleReportMotionV1p0VelocityVar",
        "ExampleReportTimeV1p0Flags",
    ];
    check(&constructs(), &names);
}
