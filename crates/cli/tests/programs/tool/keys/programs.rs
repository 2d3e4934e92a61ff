//! Several programs with one key, and the tests of a peer by a secure link.

use super::*;

/// A vehicle with this id, and a host whose key may do everything for the ids 42.255.255.
fn vehicle_and_judge(id: &str) -> (Running, [Host; 2], String) {
    let (vehicle, at_vehicle, _, address) = vehicle_and_operator(id);
    let judge = Host::new();
    let rules = [
        "command",
        "control=255",
        "clear-emergency=any",
        "configure",
        "also=any",
    ];
    let trust = ["trust", "judge", &judge.new_key(), "42.255.255"];
    let trusted = at_vehicle.keys(&[&trust[..], &rules].concat());
    assert_eq!(trusted.status, 0, "{trusted:?}");
    assert!(trusted.stderr.contains(TAKEN), "{trusted:?}");
    let shown = at_vehicle.keys(&["show"]);
    judge.trust("rover", shown.stdout.trim(), "115.255.255");
    (vehicle, [at_vehicle, judge], address)
}

#[test]
fn two_programs_with_one_key_do_not_throw_each_other_out() {
    let (mut vehicle, at_vehicle, operator, address) = vehicle_and_operator("115.1.8");
    let allowed = at_vehicle.keys(&["allow", "operator", "control=127"]);
    assert_eq!(allowed.status, 0, "{allowed:?}");
    let flags = operator.flags();
    let link = ["--secure-peer", &address, &flags[0], &flags[1]];
    let effort = [
        "115.1.8",
        "SetWrenchEffort",
        r#"{"PropulsiveLinearEffortX":20}"#,
        "--control",
        "127",
        "--hz",
        "10",
        "--id",
        "60.1.1",
    ];
    let driving = Running::endless("send", &[&effort[..], &link].concat());
    vehicle.read_until("m/s");
    let ping = [
        "ping",
        "115.1.8",
        "--count",
        "20",
        "--interval",
        "100ms",
        "--id",
        "60.1.9",
    ];
    let pinged = as_operator(&operator, &address, &ping);
    assert_eq!(pinged.status, 0, "{pinged:?}");
    let audit = std::fs::read_to_string(at_vehicle.file("audit.jsonl")).unwrap();
    let count = |what: &str| audit.lines().filter(|line| line.contains(what)).count();
    assert_eq!(count(r#""what":"connect""#), 2, "{audit}");
    assert_eq!(count("another session"), 0, "{audit}");
    assert_eq!(driving.terminate(), Some(0));
}

#[test]
fn a_vehicle_is_examined_by_a_secure_link() {
    let (_vehicle, [_at_vehicle, judge], address) = vehicle_and_judge("115.1.9");
    let examine = ["examine", "115.1.9", "--control", "--json"];
    let nameless = as_operator(&judge, &address, &examine);
    assert_eq!(nameless.status, 2, "{nameless:?}");
    assert!(nameless.stderr.contains("--id"), "{nameless:?}");
    let examined = as_operator(
        &judge,
        &address,
        &[&examine[..], &["--id", "42.1.9"]].concat(),
    );
    let report = examined.only_line();
    let with = |verdict: &str| -> Vec<_> {
        let all = report["exchanges"].as_array().unwrap().iter();
        let of_it = all.filter(|it| it["verdict"] == verdict);
        of_it.map(|it| it["exchange"].as_str().unwrap()).collect()
    };
    assert_eq!(with("failed"), [""; 0], "{report:#}");
    let of_sockets = [
        "UDP port",
        "source port",
        "multicast from it",
        "JTCP port",
        "stacks there",
    ];
    assert_eq!(with("skipped"), of_sockets, "{report:#}");
    assert_eq!(examined.status, 0);
}

#[test]
fn a_vehicle_is_judged_by_a_secure_link() {
    let (_vehicle, [_at_vehicle, judge], address) = vehicle_and_judge("115.1.10");
    // All steps of all five components of the judge, which are on two nodes with one key. The first step is that
    // the vehicle discovers the judge, which it does once.
    for how in [&["--unicast"][..], &["--multicast", "--only=B1-B12"]] {
        let judged = [&["judge", "115.1.10"], how].concat();
        let judged = as_operator(&judge, &address, &judged);
        assert_eq!(judged.status, 0, "{}\n{}", judged.stdout, judged.stderr);
        assert!(
            judged.stdout.contains(" ok, 0 failed, 0 skipped"),
            "{}",
            judged.stdout
        );
    }
    let listening = ["judge", "115.1.10", "--secure-listen=127.0.0.1"];
    let refused = as_operator(&judge, &address, &listening);
    assert_eq!(refused.status, 2, "{refused:?}");
    assert!(
        refused.stderr.contains("omit --secure-listen"),
        "{refused:?}"
    );
}
