//! Security findings as they were reported: the command lines, and what they do now. docs/security.md says which
//! test is for which finding.

use std::fs;
use std::net::UdpSocket;
use std::os::unix::fs::{FileTypeExt as _, PermissionsExt as _, symlink};
use std::path::Path;
use std::process::Command;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use super::*;

fn mode(path: impl AsRef<Path>) -> u32 {
    fs::metadata(path).unwrap().permissions().mode() & 0o777
}

fn set_mode(path: impl AsRef<Path>, mode: u32) {
    fs::set_permissions(path, fs::Permissions::from_mode(mode)).unwrap();
}

/// A command that is to be refused, with these words.
#[track_caller]
fn is_refused(arguments: &[&str], words: &str) {
    let refused = run(arguments, b"");
    assert_eq!(refused.status, 2, "{refused:?}");
    assert!(refused.stderr.contains(words), "{refused:?}");
}

/// A node on this host that listens for secure links, for a moment.
fn node<'a>(host: &'a [String], more: &[&'a str]) -> Vec<&'a str> {
    let own = ["node", "--loopback", "--id", "115.1.60", "--for", "100ms"];
    let flags = host.iter().map(String::as_str);
    own.into_iter()
        .chain(["--secure-listen=127.0.0.1:0"])
        .chain(more.iter().copied())
        .chain(flags)
        .collect()
}

#[test]
fn a_key_that_observes_takes_no_control_by_a_request_for_handover() {
    let (vehicle, at_vehicle, operator, address) = vehicle_and_operator("115.1.61");
    let send = |message: &str, body: &str| {
        let send = ["send", "115.1.61", message, body, "--id", "60.1.1"];
        as_operator(&operator, &address, &send)
    };
    for (message, body) in [
        ("RequestControl", r#"{"AuthorityCode":255}"#),
        (
            "RequestHandoff",
            r#"{"AuthorityCode":255,"Explanation":"x"}"#,
        ),
    ] {
        let refused = send(message, body);
        assert_eq!(refused.status, 1, "{refused:?}");
        let words = format!("{message} from 60.1.1 to 115.1.61: its sender may not");
        assert!(refused.stderr.contains(&words), "{refused:?}");
    }
    let query = ["query", "115.1.61", "QueryControl", "--id", "60.1.1"];
    let control = as_operator(&operator, &address, &query);
    assert!(control.stdout.contains(r#""SubsystemID":0"#), "{control:?}");
    let except = ["allow", "operator", "control=9", "except=RequestHandoff"];
    let allowed = at_vehicle.keys(&except);
    assert_eq!(allowed.status, 0, "its name is known: {allowed:?}");
    drop(vehicle);
    let refused = r#""what":"control requested","message":"RequestHandoff","to":"115.1.61","result":"refused""#;
    assert!(at_vehicle.audit().contains(refused));
}

#[test]
fn rubbish_from_the_address_of_an_operator_keeps_no_new_link_out() {
    let (_vehicle, _at_vehicle, operator, address) = vehicle_and_operator("115.1.62");
    let is_over = AtomicBool::new(false);
    std::thread::scope(|scope| {
        scope.spawn(|| {
            let socket = UdpSocket::bind("127.0.0.1:0").unwrap();
            // A first packet of QUIC 1 by its header.
            let mut rubbish = [0xC3; 1200];
            rubbish[1..6].copy_from_slice(&[0, 0, 0, 1, 8]);
            rubbish[14..18].copy_from_slice(&[0, 0, 0x44, 0x9E]);
            for number in 0_u64.. {
                if is_over.load(Ordering::Relaxed) {
                    break;
                }
                rubbish[6..14].copy_from_slice(&number.to_be_bytes());
                socket.send_to(&rubbish, &address).unwrap();
                std::thread::sleep(Duration::from_millis(2));
            }
        });
        let query = ["query", "115.1.62", "QueryIdentification", WHICH];
        let query = [&query[..], &["--id", "60.1.1", "--timeout", "10s"]].concat();
        let answers = [(); 3].map(|()| as_operator(&operator, &address, &query));
        is_over.store(true, Ordering::Relaxed);
        for answer in answers {
            assert_eq!(answer.status, 0, "{answer:?}");
        }
    });
}

#[test]
fn the_audit_log_is_no_device_and_nothing_behind_a_link() {
    let host = Host::new();
    host.new_key();
    fs::write(host.file("trusted_keys"), "").unwrap();
    let [device, victim, link] = ["null", "victim", "link"].map(|name| host.file(name));
    fs::write(&victim, "precious").unwrap();
    set_mode(&victim, 0o644);
    symlink(&victim, &link).unwrap();
    let made = Command::new("mknod")
        .args([&*device, "c", "1", "3"])
        .status();
    let mut refused = vec![&link];
    if made.is_ok_and(|it| it.success()) {
        assert!(fs::metadata(&device).unwrap().file_type().is_char_device());
        set_mode(&device, 0o666);
        refused.push(&device);
    }
    let flags = host.flags();
    for file in refused {
        let before = mode(file);
        is_refused(&node(&flags, &["--audit", file]), file);
        assert_eq!(mode(file), before);
    }
    assert_eq!(fs::read(&victim).unwrap(), b"precious");
}

#[test]
fn files_that_other_users_can_change_are_refused_and_locks_are_private() {
    let host = Host::new();
    let key = host.new_key();
    let [trusted, victim, draft] =
        ["trusted_keys", "victim", "trusted_keys.new"].map(|name| host.file(name));
    fs::write(&victim, "precious").unwrap();
    symlink(&victim, &draft).unwrap();
    host.trust("rover", &key, "115.255.255");
    assert_eq!(fs::read(&victim).unwrap(), b"precious");
    assert!(!fs::symlink_metadata(&trusted).unwrap().is_symlink());
    let locks = fs::read_dir(host.file("")).unwrap();
    let locks = locks.map(|it| it.unwrap().path());
    let is_lock = |it: &PathBuf| it.extension().is_some_and(|it| it == "lock");
    let locks: Vec<_> = locks.filter(is_lock).collect();
    assert!(!locks.is_empty() && locks.iter().all(|it| mode(it) == 0o600));

    let flags = host.flags();
    set_mode(&trusted, 0o666);
    is_refused(&node(&flags, &[]), "chmod go-w");
    set_mode(&trusted, 0o644);
    set_mode(host.file(""), 0o775);
    is_refused(&node(&flags, &[]), "chmod go-w");
    set_mode(host.file(""), 0o755);
    let started = run(&node(&flags, &[]), b"");
    assert_eq!(started.status, 0, "{started:?}");

    let token = host.file("token");
    fs::write(&token, "0123456789abcdefghijklmnopqrstuv\n").unwrap();
    set_mode(&token, 0o644);
    let station = Command::new(env!("CARGO_BIN_EXE_jaus-ocu"))
        .args(["--loopback", "--listen", "127.0.0.1:0", "--for", "1s"])
        .args(["--token-file", &token])
        .output()
        .unwrap();
    let said = String::from_utf8(station.stderr).unwrap();
    assert_eq!(station.status.code(), Some(2), "{said}");
    assert!(said.contains("chmod 600"), "{said}");
}

#[test]
fn a_restart_with_narrower_rules_keeps_no_wider_ones() {
    let host = Host::new();
    host.new_key();
    let key = Host::new().new_key();
    let flags = host.flags();
    let trusting = |rules: &str| {
        let trust = format!("operator {key} 60.255.255 {rules}");
        run(&node(&flags, &["--trust", &trust]), b"")
    };
    for _ in 0..2 {
        let started = trusting("control=127");
        assert_eq!(started.status, 0, "{started:?}");
    }
    let narrower = trusting("observe");
    assert_eq!(narrower.status, 2, "{narrower:?}");
    assert!(
        narrower.stderr.contains("jaus keys allow operator"),
        "{narrower:?}"
    );
}

#[test]
fn the_log_of_the_traffic_is_for_its_owner_and_group() {
    let folder = tempfile::tempdir().unwrap();
    let log = folder.path().join("log");
    fs::create_dir(&log).unwrap();
    let communicator = env!("CARGO_BIN_EXE_jaus-communicator");
    let script = "umask 022; exec \"$0\" --loopback --port 0 --group off --for 1s --log \"$1\"";
    let ran = Command::new("sh")
        .args(["-c", script, communicator])
        .arg(&log)
        .env_remove("JAUS_LOG")
        .output()
        .unwrap();
    assert!(ran.status.success(), "{ran:?}");
    let files: Vec<_> = fs::read_dir(&log)
        .unwrap()
        .map(|it| it.unwrap().path())
        .collect();
    assert!(!files.is_empty());
    for file in files {
        assert_eq!(mode(&file) & 0o137, 0, "{}", file.display());
    }
}

#[test]
fn users_that_are_added_at_once_are_all_there() {
    let host = Host::new();
    let users = format!("--users={}", host.file("users"));
    let names = ["anna", "ben", "carl", "dora", "emil", "fay"];
    std::thread::scope(|scope| {
        for name in names {
            let users = &users;
            scope.spawn(move || {
                let add = ["users", "add", name, "--role", "drive", users];
                let added = run(&add, b"correct horse battery\n");
                assert_eq!(added.status, 0, "{added:?}");
            });
        }
    });
    let listed = run(&["users", "list", &users], b"").stdout;
    for name in names {
        assert!(listed.contains(name), "{name} in {listed}");
    }
}

#[test]
fn ids_that_two_keys_share_are_named_when_the_second_is_trusted() {
    let host = Host::new();
    let keys = [(); 3].map(|()| Host::new().new_key());
    host.trust("operator", &keys[0], "60.1.255");
    let viewer = host.keys(&["trust", "viewer", &keys[1], "60.255.255"]);
    assert_eq!(viewer.status, 0, "{viewer:?}");
    let words = "`viewer` (60.255.255) shares ids with `operator` (60.1.255)";
    assert!(viewer.stderr.contains(words), "{viewer:?}");
    let rover = host.keys(&["trust", "rover", &keys[2], "115.255.255"]);
    assert!(!rover.stderr.contains("shares ids"), "{rover:?}");
}
