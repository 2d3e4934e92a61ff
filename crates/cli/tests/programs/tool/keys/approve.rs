//! Dual control of the trusted keys.

use std::fs;

use jaus_test_kit::waiting::block_until;

use super::super::judge::peer::free_port;
use super::{Host, TAKEN, WHICH, as_operator};
use crate::support::{Run, Running};

fn assert_refused(run: &Run, status: i32, words: &str) {
    assert_eq!(run.status, status, "{run:?}");
    assert!(run.stderr.contains(words), "{run:?}");
}

#[test]
fn a_key_that_one_person_trusts_gets_in_when_another_person_approves() {
    let [at_vehicle, operator, anna, ben] = [(); 4].map(|()| Host::new());
    let operator_key = operator.new_key();
    operator.trust("rover", &at_vehicle.new_key(), "115.255.255");
    let approvers = format!("anna {}\nben {}\n", anna.new_key(), ben.new_key());
    fs::write(at_vehicle.file("approvers"), approvers).unwrap();
    let trusted_keys = at_vehicle.file("trusted_keys");
    fs::write(&trusted_keys, "").unwrap();

    let address = format!("127.0.0.1:{}", free_port());
    let listen = format!("--secure-listen={address}");
    let audit = format!("--audit={}", at_vehicle.file("audit.jsonl"));
    let flags = at_vehicle.flags();
    let flags = flags.each_ref().map(String::as_str);
    let own = ["--id", "115.1.9", &listen, &audit];
    let mut vehicle = Running::endless("vehicle", &[&own[..], &flags].concat());
    vehicle.read_until("Ctrl-C");
    let query = || {
        let query = ["query", "115.1.9", "QueryIdentification", WHICH];
        let timing = ["--id", "60.1.1", "--timeout", "3s"];
        as_operator(&operator, &address, &[&query[..], &timing].concat())
    };

    let trust = ["trust", "operator", &operator_key, "60.255.255"];
    assert_refused(&at_vehicle.keys(&trust), 2, "two people");
    let sign = |host: &Host| format!("--sign={}", host.file("node.key"));
    let proposed = at_vehicle.keys(&[&trust[..], &[&sign(&anna)]].concat());
    assert_eq!(proposed.status, 0, "{proposed:?}");
    let id = proposed.stdout.trim();
    let waiting = at_vehicle.keys(&["approve"]);
    assert!(
        waiting.stdout.contains(&format!("{id}  by anna")),
        "{waiting:?}"
    );
    assert_ne!(query().status, 0);
    let approve = |host: &Host| at_vehicle.keys(&["approve", id, &sign(host)]);
    assert_refused(&approve(&anna), 2, "`anna` has signed this already");
    assert_refused(&approve(&operator), 2, "no approver");
    let approved = approve(&ben);
    assert_refused(&approved, 0, TAKEN);
    let answered = query();
    assert_eq!(answered.status, 0, "{answered:?}");

    // To write the file by hand ends new sessions, and gains nothing.
    let text = fs::read_to_string(&trusted_keys).unwrap();
    fs::write(
        &trusted_keys,
        text.replace("255.255\n", "255.255 control=255\n"),
    )
    .unwrap();
    block_until(|| query().status != 0);
    block_until(|| at_vehicle.audit().contains("is not approved by two people"));
    fs::write(&trusted_keys, text).unwrap();
    block_until(|| query().status == 0);
    // One person is enough to revoke.
    assert_refused(&at_vehicle.keys(&["revoke", "operator"]), 0, TAKEN);
    assert_ne!(query().status, 0);
}
