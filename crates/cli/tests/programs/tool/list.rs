//! `jaus list`.

use crate::support::run;

#[test]
fn messages_are_listed_with_code_and_service_and_found_by_a_part_of_the_name() {
    let found = run(&["list", "messages", "query_velocity"], b"");
    let line = found.stdout.lines().find(|it| it.starts_with("2404h"));
    let line = line.unwrap_or_else(|| panic!("{found:?}"));
    assert!(line.contains("  QueryVelocityState  "), "{line}");
    assert!(
        line.contains("urn:jaus:jss:mobility:VelocityStateSensor@1.1"),
        "{line}"
    );
    assert!(!found.stdout.contains("Report"), "{found:?}");
    assert_eq!(found.status, 0);

    let by_code = run(&["list", "messages", "4404", "--json"], b"").only_line();
    assert_eq!(by_code["message"], "ReportVelocityState");
    let none = run(&["list", "messages", "warp"], b"");
    assert!(none.stderr.contains("--jsidl PATH"), "{none:?}");
    assert_eq!((none.status, &*none.stdout), (1, ""));
}

#[test]
fn services_are_listed_with_their_base_and_those_of_a_definition_too() {
    let found = run(&["list", "services", "primitivedriver"], b"");
    let inherits = "urn:jaus:jss:mobility:PrimitiveDriver@1.1";
    assert!(found.stdout.contains(inherits), "{found:?}");
    assert!(
        found
            .stdout
            .contains("inherits urn:jaus:jss:core:Management"),
        "{found:?}"
    );

    let lamp = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../../examples/own-service/services"
    );
    let own = run(
        &["list", "services", "lamp", "--jsidl", lamp, "--json"],
        b"",
    );
    assert!(own.stdout.contains("Lamp"), "{own:?}");
}

#[test]
fn fields_are_listed_with_bits_units_ranges_and_named_values() {
    let velocity = run(&["list", "fields", "ReportVelocityState"], b"").stdout;
    let line = velocity
        .lines()
        .find(|it| it.contains("Velocity_X optional bit 0"));
    let line = line.unwrap_or_else(|| panic!("{velocity}"));
    assert!(
        line.contains("m/s") && line.contains("-327.68 to 327.67"),
        "{line}"
    );
    let status = run(&["list", "fields", "ReportStatus"], b"").stdout;
    assert!(status.contains("2 STANDBY"), "{status}");
    let wrong = run(&["list", "fields", "ReportStatsu"], b"");
    assert!(
        wrong.stderr.contains("did you mean ReportStatus?"),
        "{wrong:?}"
    );
    assert_eq!(wrong.status, 2);
}
