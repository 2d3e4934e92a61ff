//! The audit log of a bridge, with two bridges that need no router.

use std::path::Path;
use std::process::Command;

use jaus::component::Priority;
use jaus::messages::core::SetEmergency;
use jaus::service::State;
use jaus_test_kit::waiting::{until, within_limit};

use super::found;
use super::scene::{Process, System, endpoint, operator, rover};

/// The entries of a log that have all of these texts.
fn entries(log: &Path, texts: &[&str]) -> usize {
    let lines = std::fs::read_to_string(log).unwrap_or_default();
    let has_all = |line: &&str| texts.iter().all(|text| line.contains(text));
    lines.lines().filter(has_all).count()
}

/// The same program, but no file that it writes can grow.
fn without_disk(program: &Command) -> Command {
    let mut shell = Command::new("sh");
    shell
        .args(["-c", "trap '' XFSZ; ulimit -f 0; exec \"$0\" \"$@\""])
        .arg(program.get_program())
        .args(program.get_args());
    shell
}

#[tokio::test]
async fn a_client_that_takes_control_is_in_the_log_with_its_bridge() {
    let (network, folder) = (endpoint(), tempfile::tempdir().unwrap());
    let log = folder.path().join("audit.jsonl");
    let (vehicles, operators) = (System::new(), System::new());
    let (at_vehicle, at_operator) = (vehicles.node(101, 1), operators.node(60, 1));
    let (_rover, operator) = (rover(&at_vehicle), operator(&at_operator));
    let flags = ["--listen", &network, "--accept", "60 control=127"];
    let more = ["--trust-network", "--audit", log.to_str().unwrap()];
    let _bridge = vehicles.bridge("101.250.1", &[&flags[..], &more].concat());
    let _other = operators.bridge("60.250.1", &["--connect", &network]);
    let driver = found(&operator).await;

    let control = within_limit(operator.control(driver, 127)).await.unwrap();
    let of_client = ["\"who\":\"zenoh bridge ", "60.1.1", "101.1.33"];
    let with = |what| [&of_client[..], &[what]].concat();
    until(|| entries(&log, &with("ConfirmControl")) > 0).await;
    assert_eq!(entries(&log, &with("RequestControl")), 1);
    control.release().await;
    until(|| entries(&log, &with("ReleaseControl")) > 0).await;

    let refused = folder.path().join("audit-refused.jsonl");
    within_limit(operator.control(driver, 200))
        .await
        .unwrap_err();
    until(|| entries(&refused, &with("RequestControl")) > 0).await;
}

#[tokio::test]
async fn a_client_stops_and_does_nothing_else_while_the_log_cannot_be_written() {
    let (network, folder) = (endpoint(), tempfile::tempdir().unwrap());
    let log = folder.path().join("audit.jsonl");
    let (vehicles, operators) = (System::new(), System::new());
    let (at_vehicle, at_operator) = (vehicles.node(101, 1), operators.node(60, 1));
    let (rover, operator) = (rover(&at_vehicle), operator(&at_operator));
    let flags = ["--listen", &network, "--accept", "60 control=127"];
    let more = ["--trust-network", "--audit", log.to_str().unwrap()];
    let refuses = ["--audit-unwritable", "refuse-commands"];
    let flags = [&flags[..], &more, &refuses].concat();
    let program = without_disk(&vehicles.program("101.250.1", &flags));
    let _bridge = Process::start(program);
    let _other = operators.bridge("60.250.1", &["--connect", &network]);
    let driver = found(&operator).await;

    // The log does not know that it cannot be written before it has to.
    within_limit(async {
        while let Ok(control) = operator.control(driver, 127).await {
            control.release().await;
        }
    })
    .await;
    assert_eq!(rover.standing().controller, None);
    let stop = SetEmergency::default();
    let stopped = operator.deliver_with(Priority::SafetyCritical, driver, &stop);
    within_limit(stopped).await.unwrap();
    until(|| rover.standing().state == State::Emergency).await;
}
