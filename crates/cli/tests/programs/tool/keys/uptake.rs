//! Changes that a running program has not taken.

use std::io::{BufRead as _, BufReader, Read as _};
use std::os::unix::fs::{PermissionsExt as _, chown};
use std::os::unix::process::CommandExt as _;
use std::process::{Child, ChildStdout, Command, Stdio};

use super::*;
use crate::support::jaus;

/// A user without rights.
const NOBODY: u32 = 65534;

#[track_caller]
fn is_not_taken(run: &Run) {
    assert_eq!(run.status, 1, "{run:?}");
    assert!(
        run.stderr.contains("still used by jaus (process "),
        "{run:?}"
    );
}

#[test]
fn a_vehicle_that_hangs_is_named_by_each_change_until_it_runs_again() {
    let (vehicle, at_vehicle, operator, address) = vehicle_and_operator("115.1.10");
    let tablet = stranger(&at_vehicle);
    let key = tablet.keys(&["show"]).stdout;
    at_vehicle.trust("tablet", key.trim(), "61.255.255");
    vehicle.signal("-STOP");
    is_not_taken(&at_vehicle.keys(&["revoke", "operator"]));
    let listed = at_vehicle.keys(&["list"]).stdout;
    assert!(!listed.contains("operator"), "it is revoked: {listed}");
    is_not_taken(&at_vehicle.keys(&["allow", "tablet", "command"]));
    vehicle.signal("-CONT");
    let revoked = at_vehicle.keys(&["revoke", "tablet"]);
    assert_eq!(revoked.status, 0, "{revoked:?}");
    assert!(revoked.stderr.contains(TAKEN), "{revoked:?}");
    let query = [
        "query",
        "115.1.10",
        "QueryIdentification",
        WHICH,
        "--timeout",
        "1s",
        "--id",
        "60.1.1",
    ];
    assert_eq!(as_operator(&operator, &address, &query).status, 1);
}

/// A vehicle that runs as another user, until it is dropped.
struct OfNobody {
    vehicle: Child,
    /// It ends when its output is closed.
    output: BufReader<ChildStdout>,
}

impl OfNobody {
    /// `None` if this user may not start it.
    fn start(host: &Host) -> Option<Self> {
        let listen = format!("--secure-listen=127.0.0.1:{}", free_port());
        let own = ["vehicle", "--id", "115.1.11", "--for", "60s", &listen];
        chown(host.file("node.key"), Some(NOBODY), Some(NOBODY)).ok()?;
        let mut command = jaus();
        command.args(own).args(host.flags());
        command.uid(NOBODY).gid(NOBODY).stdout(Stdio::piped());
        let mut vehicle = command.env("HOME", host.file("")).spawn().ok()?;
        let output = BufReader::new(vehicle.stdout.take().unwrap());
        let mut vehicle = Self { vehicle, output };
        let mut lines = vehicle.output.by_ref().lines();
        assert!(lines.any(|line| line.unwrap().contains("Ctrl-C")));
        Some(vehicle)
    }
}

impl Drop for OfNobody {
    fn drop(&mut self) {
        self.vehicle.kill().unwrap();
        self.vehicle.wait().unwrap();
    }
}

/// A host that trusts an operator's key, which is returned, and a vehicle of another user there.
fn vehicle_of_nobody() -> Option<(Host, String, OfNobody)> {
    let host = Host::new();
    host.new_key();
    let key = Host::new().new_key();
    host.trust("operator", &key, "60.255.255");
    set_mode(&host, "", 0o755);
    let vehicle = OfNobody::start(&host);
    if vehicle.is_none() {
        eprintln!("SKIPPED: only root can start a program as another user");
    }
    Some((host, key, vehicle?))
}

fn set_mode(host: &Host, name: &str, mode: u32) {
    let mode = std::fs::Permissions::from_mode(mode);
    std::fs::set_permissions(host.file(name), mode).unwrap();
}

#[test]
fn root_revokes_a_key_with_a_private_umask_and_the_service_of_another_user_takes_it() {
    let Some((host, _key, _vehicle)) = vehicle_of_nobody() else {
        return;
    };
    let revoked = Command::new("sh")
        .args(["-c", "umask 077; exec \"$0\" keys revoke operator \"$@\""])
        .arg(env!("CARGO_BIN_EXE_jaus"))
        .args(host.flags())
        .output()
        .unwrap();
    let said = String::from_utf8(revoked.stderr).unwrap();
    assert!(revoked.status.success() && said.contains(TAKEN), "{said}");
}

#[test]
fn a_vehicle_whose_container_keeps_the_first_content_is_named_by_each_change() {
    let (inside, outside) = (Host::new(), Host::new());
    inside.new_key();
    let key = Host::new().new_key();
    outside.trust("operator", &key, "60.255.255");
    // The file that is mounted there stays, though another one has its name here.
    std::fs::write(inside.file("trusted_keys"), "").unwrap();
    let listen = format!("--secure-listen=127.0.0.1:{}", free_port());
    let script = "mount --bind \"$1\" \"$2\" || exit 9; shift 2; exec \"$0\" \"$@\"";
    let mut vehicle = Command::new("unshare")
        .args(["--mount", "sh", "-c", script, env!("CARGO_BIN_EXE_jaus")])
        .args([outside.file("trusted_keys"), inside.file("trusted_keys")])
        .args(["vehicle", "--id", "115.1.12", "--for", "60s", &listen])
        .args(inside.flags())
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    let mut output = BufReader::new(vehicle.stdout.take().unwrap());
    let mut lines = output.by_ref().lines();
    if !lines.any(|line| line.unwrap().contains("Ctrl-C")) {
        vehicle.wait().unwrap();
        return eprintln!("SKIPPED: no mount here");
    }
    is_not_taken(&outside.keys(&["revoke", "operator"]));
    for name in ["tablet", "laptop"] {
        is_not_taken(&outside.keys(&["trust", name, &key, "61.255.255"]));
        is_not_taken(&outside.keys(&["revoke", name]));
    }
    vehicle.kill().unwrap();
    vehicle.wait().unwrap();
}

#[test]
fn a_vehicle_that_cannot_read_its_trusted_keys_any_more_is_named() {
    let Some((host, key, _vehicle)) = vehicle_of_nobody() else {
        return;
    };
    // The slip of an administrator, before the key is stolen.
    let path = host.file("trusted_keys");
    let copy = host.file("copy");
    std::fs::copy(&path, &copy).unwrap();
    set_mode(&host, "copy", 0o600);
    std::fs::rename(copy, path).unwrap();
    is_not_taken(&host.keys(&["revoke", "operator"]));
    set_mode(&host, "trusted_keys", 0o644);
    let trusted = host.keys(&["trust", "tablet", &key, "61.255.255"]);
    assert_eq!(trusted.status, 0, "{trusted:?}");
    assert!(trusted.stderr.contains(TAKEN), "{trusted:?}");
}
