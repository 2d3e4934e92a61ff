//! `jaus users`, and a station that requires users to log in.

use std::fs;
use std::io::{Read, Write};
use std::net::TcpStream;
use std::process::{Child, Command, Stdio};
use std::time::Duration;

#[cfg(target_os = "linux")]
use jaus_test_kit::waiting::block_until;
use tempfile::TempDir;

use crate::support::{Run, own_group, run};

const PASSWORD: &str = "correct horse battery\n";

struct Host(TempDir);

impl Host {
    fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    fn file(&self, name: &str) -> String {
        self.0.path().join(name).to_str().unwrap().to_owned()
    }

    fn users(&self, arguments: &[&str], input: &str) -> Run {
        let file = self.file("users");
        let arguments = [&["users"], arguments, &["--users", &file]].concat();
        run(&arguments, input.as_bytes())
    }

    fn add(&self, name: &str, role: &str) -> Run {
        self.users(&["add", name, "--role", role], PASSWORD)
    }

    /// Standard error of a station that cannot start.
    fn refused_station(&self, flags: &[&str]) -> String {
        let program = env!("CARGO_BIN_EXE_jaus-ocu");
        let output = Command::new(program)
            .args(["--loopback", "--listen", "127.0.0.1:0", "--for", "1s"])
            .args(flags)
            .env("STATE_DIRECTORY", self.0.path())
            .stdin(Stdio::null())
            .output()
            .unwrap();
        assert_eq!(output.status.code(), Some(2), "{output:?}");
        String::from_utf8(output.stderr).unwrap()
    }
}

#[test]
fn users_are_added_listed_and_removed_and_their_passwords_are_not_kept() {
    let host = Host::new();
    for (name, role) in [("anna", "administer"), ("ben", "drive")] {
        let added = host.add(name, role);
        assert_eq!(added.status, 0, "{added:?}");
    }
    let listed = host.users(&["list", "--json"], "");
    let lines = [
        r#"{"name":"anna","role":"administer"}"#,
        r#"{"name":"ben","role":"drive"}"#,
    ];
    assert_eq!(listed.stdout.lines().collect::<Vec<_>>(), lines);
    let text = fs::read_to_string(host.file("users")).unwrap();
    assert!(!text.contains(PASSWORD.trim()), "{text}");

    let twice = host.add("ben", "observe");
    assert!(twice.stderr.contains("`ben` exists: remove"), "{twice:?}");
    assert_eq!(host.users(&["remove", "ben"], "").status, 0);
    let gone = host.users(&["remove", "ben"], "");
    assert_eq!(gone.status, 1, "{gone:?}");
    assert!(gone.stderr.contains("jaus users list"), "{gone:?}");
}

#[test]
fn a_short_password_an_invalid_name_and_an_unknown_role_are_refused() {
    let host = Host::new();
    let short = host.users(&["add", "anna", "--role", "drive"], "short\n");
    assert!(short.stderr.contains("choose 10 to 128"), "{short:?}");
    let name = host.add("an na", "drive");
    assert!(name.stderr.contains("is not a user name"), "{name:?}");
    let role = host.add("anna", "fly");
    assert!(role.stderr.contains("administer"), "{role:?}");
    assert!(!fs::exists(host.file("users")).unwrap());
}

/// A station whose log goes to a file, which takes any level of it at any speed.
struct Station {
    child: Child,
    log: String,
    address: String,
}

impl Station {
    fn start(host: &Host, level: &str) -> Self {
        let log = host.file("log");
        let mut child = Command::new(env!("CARGO_BIN_EXE_jaus-ocu"))
            .args(["--listen", "127.0.0.1:0", "--users", &host.file("users")])
            .args(own_group())
            .env("JAUS_LOG", level)
            .env("STATE_DIRECTORY", host.0.path())
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(fs::File::create(&log).unwrap())
            .spawn()
            .unwrap();
        let address = loop {
            assert_eq!(child.try_wait().unwrap(), None, "it runs");
            let text = fs::read_to_string(&log).unwrap();
            if let Some((_, rest)) = text.split_once("page is at http://")
                && let Some((address, _)) = rest.split_once('/')
            {
                break address.to_owned();
            }
            std::thread::sleep(Duration::from_millis(20));
        };
        Self {
            child,
            log,
            address,
        }
    }

    fn log(&self) -> String {
        fs::read_to_string(&self.log).unwrap()
    }

    /// Sends a login. Returns the response.
    fn log_in(&self, name: &str, password: &str) -> String {
        let password = password.trim();
        let body = format!("{{\"name\":\"{name}\",\"password\":\"{password}\"}}");
        let mut stream = TcpStream::connect(&self.address).unwrap();
        let head = "POST /login HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n";
        write!(stream, "{head}Content-Length: {}\r\n\r\n{body}", body.len()).unwrap();
        let mut answer = String::new();
        stream.read_to_string(&mut answer).unwrap();
        answer
    }

    #[cfg(target_os = "linux")]
    fn signal(&self, signal: &str) {
        let id = self.child.id().to_string();
        let kill = Command::new("kill").args([signal, &id]).status();
        assert!(kill.unwrap().success());
    }
}

impl Drop for Station {
    fn drop(&mut self) {
        self.child.kill().unwrap();
        self.child.wait().unwrap();
    }
}

#[test]
fn no_log_level_shows_a_password_or_a_cookie() {
    const WRONG: &str = "a wrong password";
    let host = Host::new();
    host.add("anna", "drive");
    let station = Station::start(&host, "trace");
    assert!(station.log_in("anna", WRONG).starts_with("HTTP/1.1 401"));
    let answer = station.log_in("anna", PASSWORD);
    let (_, cookie) = answer.split_once("set-cookie: ").unwrap();
    let (_, device) = cookie.split_once('=').unwrap();
    let device = device.split(';').next().unwrap();
    let (_, secret) = answer.split_once(r#"{"secret":""#).unwrap();
    let secret = secret.split('"').next().unwrap();
    let text = station.log();
    assert!(text.contains("login of anna"), "{text}");
    for word in [WRONG, PASSWORD.trim(), device, secret] {
        assert!(!text.contains(word), "{word} is in {text}");
    }
}

#[cfg(target_os = "linux")]
#[test]
fn a_removal_is_confirmed_by_the_station_and_one_that_hangs_is_named() {
    const TAKEN: &str = "have taken the change";
    let host = Host::new();
    for name in ["anna", "ben", "carl"] {
        host.add(name, "drive");
    }
    let station = Station::start(&host, "info");
    let status = |name: &str| {
        let answer = station.log_in(name, PASSWORD);
        answer.split(' ').nth(1).unwrap().to_owned()
    };
    assert_eq!(status("ben"), "200");
    let removed = host.users(&["remove", "ben"], "");
    assert_eq!(removed.status, 0, "{removed:?}");
    assert!(removed.stderr.contains(TAKEN), "{removed:?}");
    assert_eq!(status("ben"), "401");
    let log = station.log();
    assert!(log.contains("session of ben has ended"), "{log}");

    station.signal("-STOP");
    let removed = host.users(&["remove", "carl"], "");
    assert_eq!(removed.status, 1, "{removed:?}");
    let named = format!("still used by jaus-ocu (process {})", station.child.id());
    assert!(removed.stderr.contains(&named), "{removed:?}");
    station.signal("-CONT");
    let added = host.add("dora", "observe");
    assert_eq!(added.status, 0, "{added:?}");
    assert!(added.stderr.contains(TAKEN), "{added:?}");
    assert_eq!([status("dora"), status("carl")], ["200", "401"]);
}

#[cfg(target_os = "linux")]
#[test]
fn a_users_file_that_becomes_unusable_refuses_logins_and_the_log_names_who_remains() {
    let host = Host::new();
    host.add("anna", "drive");
    let station = Station::start(&host, "info");
    assert!(station.log_in("anna", PASSWORD).starts_with("HTTP/1.1 200"));
    let good = fs::read(host.file("users")).unwrap();
    fs::write(host.file("users"), "half a line\n").unwrap();
    block_until(|| station.log_in("anna", PASSWORD).starts_with("HTTP/1.1 503"));
    let log = station.log();
    for words in [
        "line 1: `a` is not a role",
        "the sessions of the connected users remain",
        "connected=\"anna\"",
    ] {
        assert!(log.contains(words), "{words} in {log}");
    }
    fs::write(host.file("users"), good).unwrap();
    block_until(|| station.log_in("anna", PASSWORD).starts_with("HTTP/1.1 200"));
}

#[cfg(unix)]
#[test]
fn a_users_file_that_cannot_be_used_is_refused_with_the_remedy() {
    use std::os::unix::fs::PermissionsExt as _;

    let host = Host::new();
    let users = host.file("users");
    let flags = ["--users", &*users];
    let missing = host.refused_station(&flags);
    assert!(missing.contains("--users"), "{missing}");
    host.add("anna", "drive");
    let both = host.refused_station(&["--users", &users, "--watch-without-token"]);
    assert!(both.contains("cannot be used with"), "{both}");
    host.users(&["remove", "anna"], "");
    let empty = host.refused_station(&flags);
    assert!(empty.contains("jaus users add"), "{empty}");
    fs::set_permissions(&users, fs::Permissions::from_mode(0o644)).unwrap();
    let readable = host.refused_station(&flags);
    assert!(readable.contains("chmod 600"), "{readable}");
}

#[cfg(all(unix, feature = "https"))]
#[test]
fn a_certificate_that_cannot_be_used_is_refused_with_the_remedy() {
    use std::os::unix::fs::PermissionsExt as _;
    use std::path::Path;
    use std::time::SystemTime;

    use jaus_ocu::Tls;

    let host = Host::new();
    Tls::load_or_make(Path::new(&host.file("")), &[], SystemTime::now()).unwrap();
    let (certificate, key) = (host.file("page.crt"), host.file("page.key"));
    let alone = host.refused_station(&["--tls-certificate", &certificate]);
    assert!(alone.contains("--tls-key"), "{alone}");
    let swapped = ["--tls-certificate", &key, "--tls-key", &certificate];
    let swapped = host.refused_station(&swapped);
    assert!(swapped.contains("contains no certificate"), "{swapped}");
    fs::set_permissions(&key, fs::Permissions::from_mode(0o644)).unwrap();
    for flags in [
        &["--https"][..],
        &["--tls-certificate", &certificate, "--tls-key", &key],
    ] {
        let readable = host.refused_station(flags);
        assert!(readable.contains("chmod 600"), "{readable}");
    }
}
