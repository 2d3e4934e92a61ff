//! The systemd units: what they may do, as whom, and the guides' recipes for them.

use std::collections::BTreeSet;
use std::fs;
use std::net::{TcpListener, UdpSocket};
use std::path::{Path, PathBuf};
use std::process::Command;

use jaus_test_kit::evidence::{not_tested, this_test};
use jaus_test_kit::tools::workspace;

/// The highest exposure of a unit, as `systemd-analyze security` rates it.
const MOST_EXPOSURE: f64 = 1.5;
/// That of one that opens devices.
const MOST_WITH_DEVICES: f64 = 1.8;

/// The units of the package, by the name of an instance, and of the bridges.
fn units() -> Vec<String> {
    let names = |folder: &str| {
        let entries = fs::read_dir(workspace(folder)).unwrap();
        let names = entries.map(|it| it.unwrap().file_name().into_string().unwrap());
        names.collect::<Vec<_>>()
    };
    let settings = ["packaging/etc", "packaging/bridges/etc"].map(names);
    let parts = settings
        .iter()
        .flatten()
        .filter_map(|it| it.strip_suffix(".toml"));
    let parts = parts.map(|part| format!("jaus@{part}"));
    parts.chain(["jaus-black-box@eth0".to_owned()]).collect()
}

/// The unit with its drop-ins.
fn text_of(unit: &str) -> String {
    let (template, _) = unit.split_once('@').unwrap();
    let systemd = workspace("packaging/systemd");
    let mut text = fs::read_to_string(systemd.join(format!("{template}@.service"))).unwrap();
    for folder in [systemd, workspace("packaging/bridges/systemd")] {
        let drop_ins = fs::read_dir(folder.join(format!("{unit}.service.d")));
        for file in drop_ins.into_iter().flatten() {
            text.push_str(&fs::read_to_string(file.unwrap().path()).unwrap());
        }
    }
    text
}

/// The users that sysusers.d creates.
fn users() -> BTreeSet<String> {
    let files = [
        "packaging/sysusers.d/jaus.conf",
        "packaging/bridges/sysusers.d/jaus-zenoh.conf",
        "packaging/bridges/sysusers.d/jaus-ros2.conf",
    ];
    let texts = files.map(|file| fs::read_to_string(workspace(file)).unwrap());
    let lines = texts.iter().flat_map(|text| text.lines());
    let users = lines.filter_map(|line| line.strip_prefix("u ")?.split(' ').next());
    users.map(str::to_owned).collect()
}

#[test]
fn every_unit_has_a_user_of_its_own_that_the_package_creates_and_removes() {
    let users = users();
    let removed = fs::read_to_string(workspace("packaging/debian/postrm")).unwrap();
    let mut of_units = BTreeSet::new();
    for unit in units() {
        let (_, instance) = unit.split_once('@').unwrap();
        let text = text_of(&unit);
        let mut named = text.lines().filter_map(|it| it.strip_prefix("User="));
        let user = named.next().unwrap().replace("%i", instance);
        assert_eq!(named.next(), None, "{unit}");
        assert!(users.contains(&user), "{user} of {unit} is not created");
        let part = user.strip_prefix("jaus-").unwrap();
        let is_bridge = ["zenoh", "ros2"].contains(&part);
        let is_removed = removed
            .split_whitespace()
            .any(|it| it.trim_end_matches(';') == part);
        assert!(is_removed || is_bridge, "{user} remains after purge");
        assert!(of_units.insert(user), "{unit} shares its user");
    }
    // The other one is for programs that are started by hand.
    assert_eq!(users.len(), of_units.len() + 1, "{users:?}");
}

#[test]
fn no_unit_is_more_exposed_than_it_must_be() {
    if Command::new("systemd-analyze")
        .arg("--version")
        .output()
        .is_err()
    {
        return not_tested(&this_test(), "no systemd-analyze here: install systemd");
    }
    let root = tempfile::tempdir().unwrap();
    let folder = root.path().join("etc/systemd/system");
    fs::create_dir_all(&folder).unwrap();
    for unit in units() {
        // As one file: systemd-analyze merges drop-ins in the same way.
        fs::write(folder.join(format!("{unit}.service")), text_of(&unit)).unwrap();
        let rated = Command::new("systemd-analyze")
            .args(["security", "--offline=true", "--no-pager"])
            .arg(format!("--root={}", root.path().display()))
            .arg(format!("{unit}.service"))
            .output()
            .unwrap();
        let said = String::from_utf8_lossy(&rated.stdout).into_owned();
        let (_, level) = said
            .split_once("Overall exposure level")
            .unwrap_or_else(|| panic!("{unit}: {said}{}", String::from_utf8_lossy(&rated.stderr)));
        let mut words = level.split_whitespace();
        let exposure: f64 = words.find_map(|it| it.parse().ok()).unwrap();
        let opens_devices = text_of(&unit).contains("DevicePolicy=closed");
        let most = if opens_devices {
            MOST_WITH_DEVICES
        } else {
            MOST_EXPOSURE
        };
        assert!(exposure <= most, "{unit}: {exposure}\n{said}");
    }
}

#[test]
fn a_port_that_another_program_has_at_a_start_ends_no_service_for_good() {
    for unit in units() {
        let text = text_of(&unit);
        assert!(text.contains("\nRestart=on-failure\n"), "{unit}");
        assert!(text.contains("\nRestartPreventExitStatus=2\n"), "{unit}");
    }
    let folder = tempfile::tempdir().unwrap();
    let file = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let [key, trusted, settings] = ["node.key", "trusted_keys", "settings.toml"].map(file);
    let made = Command::new(env!("CARGO_BIN_EXE_jaus"))
        .args(["keys", "new", "--key", &key])
        .output();
    assert!(made.unwrap().status.success());
    fs::write(&trusted, "").unwrap();
    let (udp, tcp) = (
        UdpSocket::bind("127.0.0.1:0"),
        TcpListener::bind("127.0.0.1:0"),
    );
    let (udp, tcp) = (udp.unwrap(), tcp.unwrap());
    let [udp, tcp] = [udp.local_addr(), tcp.local_addr()].map(|it| it.unwrap().to_string());
    fs::write(&settings, format!("[tcp]\nlisten = \"{tcp}\"\n")).unwrap();
    let start = |flags: &[&str]| {
        let ended = Command::new(env!("CARGO_BIN_EXE_jaus-communicator"))
            .args(["--loopback", "--port", "0", "--for", "5s"])
            .args(flags)
            .output()
            .unwrap();
        ended.status.code()
    };
    let listen = format!("--secure-listen={udp}");
    let secure = ["--key", &key, "--trusted-keys", &trusted, &listen];
    assert_eq!(start(&secure), Some(1));
    assert_eq!(start(&["--config", &settings]), Some(1));
    assert_eq!(start(&["--metrics", &tcp]), Some(1));
    assert_eq!(start(&["--metrics", "192.0.2.1:9"]), Some(2), "a mistake");
}

/// Follows a recipe on a host with the units' users and views of the file system.
fn follow(recipe: &str) {
    let namespaces = Command::new("unshare")
        .args(["--mount", "--net", "true"])
        .status();
    let has = |program: &str| Command::new(program).arg("--version").output().is_ok();
    if !namespaces.is_ok_and(|it| it.success()) || !has("systemd-sysusers") || !has("setpriv") {
        let reason = "it needs root, namespaces, setpriv and systemd-sysusers";
        return not_tested(&this_test(), reason);
    }
    let scripts: PathBuf = workspace("crates/cli/tests/programs/units");
    let programs = Path::new(env!("CARGO_BIN_EXE_jaus")).parent().unwrap();
    let followed = Command::new("unshare")
        .args(["--mount", "--net", "bash"])
        .args([
            &scripts.join("host.sh"),
            programs,
            &workspace(""),
            &scripts.join(recipe),
        ])
        .output()
        .unwrap();
    let said = [followed.stdout, followed.stderr].concat();
    assert!(
        followed.status.success(),
        "{recipe}: {}",
        String::from_utf8_lossy(&said)
    );
}

#[test]
fn the_recipe_for_a_secure_service_works_as_its_users() {
    follow("secure.sh");
}

#[test]
fn the_recipe_for_the_black_box_works_as_its_user() {
    follow("black-box.sh");
}

#[test]
fn a_program_without_grants_says_at_its_start_that_every_host_may_command() {
    follow("plain.sh");
}

#[test]
fn the_parts_of_a_board_run_as_users_of_their_own_on_one_node() {
    follow("parts.sh");
}
