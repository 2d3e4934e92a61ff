//! `jaus keys`, and commands that reach a vehicle by a secure link alone.

mod approve;
mod certificates;
mod programs;
#[cfg(target_os = "linux")]
mod reported;
mod rights;
mod rotation;
#[cfg(target_os = "linux")]
mod uptake;

use std::path::PathBuf;

use jaus_test_kit::waiting::block_until;
use tempfile::TempDir;

use super::judge::peer::free_port;
use crate::support::{Run, Running, run};

/// The fields of the query: the identification of the subsystem.
const WHICH: &str = r#"{"QueryType":2}"#;

/// What a command says that has changed a file of running programs.
const TAKEN: &str = "have taken the change";

/// The folder with the keys of one host.
struct Host(TempDir);

impl Host {
    fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    fn file(&self, name: &str) -> String {
        let path: PathBuf = self.0.path().join(name);
        path.to_str().unwrap().to_owned()
    }

    /// The audit log: refusals, and then evidence.
    fn audit(&self) -> String {
        let files = ["audit-refused.jsonl", "audit.jsonl"].map(|name| self.file(name));
        files
            .map(|file| std::fs::read_to_string(file).unwrap())
            .concat()
    }

    fn flags(&self) -> [String; 2] {
        let [key, trusted] = ["node.key", "trusted_keys"].map(|name| self.file(name));
        [format!("--key={key}"), format!("--trusted-keys={trusted}")]
    }

    fn keys(&self, arguments: &[&str]) -> Run {
        let flags = self.flags();
        let flags = flags.each_ref().map(String::as_str);
        run(&[&["keys"], arguments, &flags].concat(), b"")
    }

    /// Makes the host's key and returns the public one.
    fn new_key(&self) -> String {
        let made = self.keys(&["new"]);
        assert_eq!(made.status, 0, "{made:?}");
        made.stdout.trim().to_owned()
    }

    fn trust(&self, name: &str, key: &str, ids: &str) {
        let trusted = self.keys(&["trust", name, key, ids]);
        assert_eq!((trusted.status, &*trusted.stdout), (0, ""), "{trusted:?}");
    }
}

/// A vehicle that listens at a port, and the host of an operator, 60.255.255, that it trusts.
fn vehicle_and_operator(id: &str) -> (Running, Host, Host, String) {
    let (at_vehicle, at_operator) = (Host::new(), Host::new());
    let (vehicle_key, operator_key) = (at_vehicle.new_key(), at_operator.new_key());
    at_vehicle.trust("operator", &operator_key, "60.255.255");
    at_operator.trust("rover", &vehicle_key, "115.255.255");
    let address = format!("127.0.0.1:{}", free_port());
    let listen = format!("--secure-listen={address}");
    let flags = at_vehicle.flags();
    let flags = flags.each_ref().map(String::as_str);
    let audit = format!("--audit={}", at_vehicle.file("audit.jsonl"));
    let own = ["--id", id, &listen, &audit];
    let mut vehicle = Running::endless("vehicle", &[&own[..], &flags].concat());
    vehicle.read_until("Ctrl-C");
    (vehicle, at_vehicle, at_operator, address)
}

fn as_operator(host: &Host, address: &str, arguments: &[&str]) -> Run {
    let flags = host.flags();
    let flags = flags.each_ref().map(String::as_str);
    run(
        &[arguments, &["--secure-peer", address], &flags].concat(),
        b"",
    )
}

#[test]
fn a_vehicle_is_found_and_queried_by_a_secure_link_alone() {
    let (_vehicle, _at_vehicle, operator, address) = vehicle_and_operator("115.1.1");
    let query = [
        "query",
        "115.1.1",
        "QueryIdentification",
        WHICH,
        "--id",
        "60.1.1",
    ];
    let answered = as_operator(&operator, &address, &query);
    assert_eq!(answered.status, 0, "{answered:?}");
    assert!(answered.stdout.contains("Rover"), "{answered:?}");

    let plain = run(
        &[
            "query",
            "115.1.1",
            "QueryIdentification",
            WHICH,
            "--loopback",
            "--timeout",
            "500ms",
        ],
        b"",
    );
    assert_eq!((plain.status, &*plain.stdout), (1, ""), "{plain:?}");
}

#[test]
fn an_emergency_of_another_client_is_cleared_by_a_key_with_the_right_alone() {
    let (_vehicle, at_vehicle, operator, address) = vehicle_and_operator("115.1.7");
    let viewer = Host::new();
    at_vehicle.trust("viewer", &viewer.new_key(), "61.255.255");
    let shown = at_vehicle.keys(&["show"]);
    viewer.trust("rover", shown.stdout.trim(), "115.255.255");
    let control = |host: &Host, id: &str, action: &str| {
        let command = ["control", "115.1.7", action, "--id", id, "--timeout", "2s"];
        as_operator(host, &address, &command)
    };
    // The command waits for the running vehicle.
    let allow = |name: &str, rules: &[&str]| {
        let allowed = at_vehicle.keys(&[&["allow", name], rules].concat());
        assert_eq!(allowed.status, 0, "{allowed:?}");
        assert!(allowed.stderr.contains(TAKEN), "{allowed:?}");
    };
    let stopped = control(&viewer, "61.1.1", "emergency");
    assert_eq!(stopped.status, 0, "{stopped:?}");

    allow("operator", &["control=200", "clear-emergency"]);
    let refused = control(&operator, "60.1.1", "clear-all");
    assert_eq!(refused.status, 1, "{refused:?}");
    assert!(
        refused.stderr.contains("clear-emergency=any"),
        "{refused:?}"
    );
    allow("operator", &["control=200", "clear-emergency=any"]);
    let cleared = control(&operator, "60.1.1", "clear-all");
    assert_eq!(cleared.status, 0, "{cleared:?}");

    allow("viewer", &["observe", "except=SetEmergency"]);
    let refused = control(&viewer, "61.1.1", "emergency");
    assert_ne!(refused.status, 0, "{refused:?}");
    let audit = at_vehicle.audit();
    let entries: Vec<_> = audit.lines().filter(|it| it.contains("of all")).collect();
    let has = |result: &str| entries.iter().any(|it| it.contains(result));
    assert!(has("allowed") && has("refused"), "{audit}");
}

#[test]
fn two_commands_on_each_host_give_a_vehicle_and_an_operator() {
    let (vehicle, operator) = (Host::new(), Host::new());
    let (vehicle_key, operator_key) = (vehicle.new_key(), operator.new_key());
    let address = format!("127.0.0.1:{}", free_port());
    let listen = format!("--secure-listen={address}");
    let trust = format!("operator {operator_key} 60.255.255");
    let flags = vehicle.flags();
    let flags = flags.each_ref().map(String::as_str);
    let trusting = ["--id", "115.1.6", &listen, "--trust", &trust];
    let mut running = Running::command("vehicle", &[&trusting[..], &flags].concat());
    running.read_until("Ctrl-C");

    let trust = format!("rover {vehicle_key} 115.255.255");
    let query = [
        "query",
        "115.1.6",
        "QueryIdentification",
        WHICH,
        "--id",
        "60.1.1",
    ];
    for _ in 0..2 {
        let trusting = [&query[..], &["--trust", &trust]].concat();
        let answered = as_operator(&operator, &address, &trusting);
        assert_eq!(answered.status, 0, "{answered:?}");
    }
    assert_eq!(operator.keys(&["revoke", "rover"]).status, 0);
    let again = as_operator(
        &operator,
        &address,
        &[&query[..], &["--trust", &trust]].concat(),
    );
    assert_eq!(again.status, 2, "{again:?}");
    assert!(again.stderr.contains("was it revoked?"), "{again:?}");
}

#[test]
fn an_id_for_which_a_key_may_not_speak_gets_no_answer() {
    let (_vehicle, _at_vehicle, operator, address) = vehicle_and_operator("115.1.2");
    let query = [
        "query",
        "115.1.2",
        "QueryIdentification",
        WHICH,
        "--timeout",
        "2s",
        "--id",
    ];
    let foreign = as_operator(&operator, &address, &[&query[..], &["61.1.1"]].concat());
    assert_eq!((foreign.status, &*foreign.stdout), (1, ""), "{foreign:?}");
}

#[test]
fn a_revoked_key_loses_its_link_and_gets_no_other() {
    let (_vehicle, at_vehicle, operator, address) = vehicle_and_operator("115.1.3");
    let flags = operator.flags();
    let flags = flags.each_ref().map(String::as_str);
    let watch = ["--watch", "--id", "60.1.1", "--secure-peer", &address];
    let mut watching = Running::command("discover", &[&watch[..], &flags].concat());
    watching.read_until("115.1.3");
    let revoked = at_vehicle.keys(&["revoke", "operator"]);
    assert_eq!(revoked.status, 0, "{revoked:?}");
    assert!(revoked.stderr.contains(TAKEN), "{revoked:?}");
    let query = [
        "query",
        "115.1.3",
        "QueryIdentification",
        WHICH,
        "--timeout",
        "1s",
        "--id",
        "60.1.1",
    ];
    assert_eq!(as_operator(&operator, &address, &query).status, 1);
    watching.read_until("lost");
}

#[test]
fn while_the_trust_file_is_broken_links_remain_and_no_other_key_gets_one() {
    let (_vehicle, at_vehicle, operator, address) = vehicle_and_operator("115.1.9");
    let tablet = stranger(&at_vehicle);
    let key = tablet.keys(&["show"]).stdout;
    at_vehicle.trust("tablet", key.trim(), "61.255.255");
    let flags = operator.flags();
    let flags = flags.each_ref().map(String::as_str);
    let watch = ["--watch", "--id", "60.1.1", "--secure-peer", &address];
    let mut watching = Running::command("discover", &[&watch[..], &flags].concat());
    watching.read_until("115.1.9");
    let query = [
        "query",
        "115.1.9",
        "QueryIdentification",
        WHICH,
        "--timeout",
        "2s",
        "--id",
        "61.1.1",
    ];
    let status = || as_operator(&tablet, &address, &query).status;
    assert_eq!(status(), 0);

    let path = at_vehicle.file("trusted_keys");
    let good = std::fs::read_to_string(&path).unwrap();
    std::fs::write(&path, format!("{good}half a line\n")).unwrap();
    // The vehicle reads the file within a second.
    block_until(|| status() == 1);
    let audit = || at_vehicle.audit();
    block_until(|| audit().contains("new sessions are refused here until a file can be used"));
    let ended = r#""who":"operator","what":"disconnect""#;
    assert!(!audit().contains(ended), "the operator's link remains");
    std::fs::write(&path, good).unwrap();
    block_until(|| status() == 0);
    assert!(!audit().contains(ended), "the operator's link remains");
}

#[test]
fn keys_are_made_shown_listed_and_revoked_with_clear_errors() {
    let host = Host::new();
    let missing = host.keys(&["show"]);
    assert_eq!(missing.status, 2, "{missing:?}");
    let key = host.new_key();
    assert_eq!(host.keys(&["show"]).stdout.trim(), key);
    let again = host.keys(&["new"]);
    assert_eq!(again.status, 2);
    assert!(again.stderr.contains("peers trust its key"), "{again:?}");

    host.trust("rover", &key, "101.255.255");
    let listed = host.keys(&["list", "--json"]);
    assert_eq!(listed.json()[0]["ids"][0], "101.255.255", "{listed:?}");
    let twice = host.keys(&["trust", "other", &key, "102.255.255"]);
    assert!(
        twice.status == 2 && twice.stderr.contains("already"),
        "{twice:?}"
    );
    assert_eq!(host.keys(&["revoke", "nobody"]).status, 1);
    let revoked = host.keys(&["revoke", "rover"]);
    assert_eq!(revoked.status, 0, "{revoked:?}");
    let unused = format!("no running service uses {}", host.file("trusted_keys"));
    assert!(revoked.stderr.contains(&unused), "{revoked:?}");
    assert_eq!(host.keys(&["list"]).status, 1, "no key is left");
}

#[test]
fn a_node_without_a_key_says_how_to_make_one() {
    let host = Host::new();
    let query = [
        "query",
        "115.1.4",
        "QueryIdentification",
        WHICH,
        "--id",
        "60.1.1",
    ];
    let refused = as_operator(&host, "127.0.0.1", &query);
    assert_eq!(refused.status, 2, "{refused:?}");
    assert!(refused.stderr.contains("jaus keys new"), "{refused:?}");
    host.new_key();
    let refused = as_operator(&host, "127.0.0.1", &query);
    assert!(refused.stderr.contains("jaus keys trust"), "{refused:?}");
}

/// The operator's host, with another key that the vehicle does not trust.
fn stranger(vehicle: &Host) -> Host {
    let stranger = Host::new();
    stranger.new_key();
    let shown = vehicle.keys(&["show"]);
    stranger.trust("rover", shown.stdout.trim(), "115.255.255");
    stranger
}

#[test]
fn a_key_without_rules_observes_and_both_sides_say_why_it_commands_nothing() {
    let (vehicle, at_vehicle, operator, address) = vehicle_and_operator("115.1.4");
    let query = [
        "query",
        "115.1.4",
        "QueryIdentification",
        WHICH,
        "--id",
        "60.1.1",
    ];
    assert_eq!(as_operator(&operator, &address, &query).status, 0);
    let drive = [
        "send",
        "115.1.4",
        "SetWrenchEffort",
        r#"{"PropulsiveLinearEffortX":30}"#,
        "--control",
        "127",
        "--id",
        "60.1.1",
    ];
    let refused = as_operator(&operator, &address, &drive);
    assert_eq!(refused.status, 1, "{refused:?}");
    let words = "RequestControl from 60.1.1 to 115.1.4: its sender may not take control";
    assert!(refused.stderr.contains(words), "{refused:?}");

    let allowed = at_vehicle.keys(&["allow", "operator", "control=100"]);
    assert_eq!(allowed.status, 0, "{allowed:?}");
    let listed = at_vehicle.keys(&["list"]);
    assert!(
        listed.stdout.contains("60.255.255  control=100"),
        "{listed:?}"
    );
    let refused = as_operator(&operator, &address, &drive);
    let words = "authority 127, but its sender may take control with at most 100";
    assert!(refused.stderr.contains(words), "{refused:?}");
    let within = drive.map(|it| if it == "127" { "100" } else { it });
    let sent = as_operator(&operator, &address, &within);
    assert_eq!(sent.status, 0, "{sent:?}");

    drop(vehicle);
    let audit = at_vehicle.audit();
    for part in [
        r#""who":"operator","what":"connect","result":"allowed""#,
        r#""who":"operator","what":"control requested","message":"RequestControl","to":"115.1.4","result":"refused","why":"its sender may not take control"#,
        r#""who":"operator","what":"control granted","message":"ConfirmControl","to":"115.1.4","result":"allowed""#,
        r#""id":"60.1.1""#,
    ] {
        assert!(audit.contains(part), "{part} in {audit}");
    }
}

#[test]
fn doctor_finds_what_keeps_a_secure_link_from_standing() {
    let (_vehicle, at_vehicle, operator, address) = vehicle_and_operator("115.1.5");
    let doctor = |host: &Host, arguments: &[&str]| {
        let arguments = [&["doctor", "--for", "2s", "--secure-peer"], arguments].concat();
        let flags = host.flags();
        run(
            &[&arguments[..], &flags.each_ref().map(String::as_str)].concat(),
            b"",
        )
    };
    let words = |run: &Run| run.stdout.split_whitespace().collect::<Vec<_>>().join(" ");

    let sound = doctor(&operator, &[&address]);
    assert_eq!(sound.status, 0, "{sound:?}");
    assert!(
        words(&sound).contains("is `rover`; round trip"),
        "{sound:?}"
    );

    // The vehicle does not trust this key.
    let refused = doctor(&stranger(&at_vehicle), &[&address]);
    assert_eq!(refused.status, 1);
    let remedy = "on the peer's host, `jaus keys trust` the key that `jaus keys show` prints here";
    assert!(words(&refused).contains(remedy), "{refused:?}");

    // Nor is the vehicle's key trusted here.
    operator.keys(&["revoke", "rover"]);
    let other = Host::new().new_key();
    operator.trust("other", &other, "116.255.255");
    let untrusted = doctor(&operator, &[&address]);
    assert!(
        words(&untrusted).contains("is not trusted here"),
        "{untrusted:?}"
    );
    operator.keys(&["revoke", "other"]);
    let nobody = doctor(&operator, &[&address]);
    assert!(words(&nobody).contains("no key is trusted"), "{nobody:?}");

    // Nothing listens there.
    let silent = doctor(
        &stranger(&at_vehicle),
        &[&format!("127.0.0.1:{}", free_port())],
    );
    assert!(
        words(&silent).contains("is the peer running with --secure-listen"),
        "{silent:?}"
    );

    let settings = operator.file("node.toml");
    std::fs::write(&settings, "[tcp]\nlisten = \"127.0.0.1:0\"\n").unwrap();
    operator.trust("rover", &other, "115.255.255");
    let contradiction = doctor(&operator, &[&address, "--config", &settings]);
    assert!(
        words(&contradiction).contains("contradict each other"),
        "{contradiction:?}"
    );

    use std::os::unix::fs::PermissionsExt as _;
    let readable = std::fs::Permissions::from_mode(0o644);
    std::fs::set_permissions(operator.file("node.key"), readable).unwrap();
    let exposed = doctor(&operator, &[&address]);
    assert!(words(&exposed).contains("chmod 600"), "{exposed:?}");
}
