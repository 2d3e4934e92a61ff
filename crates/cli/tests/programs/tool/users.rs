//! `jaus users`, and a station that requires users to log in.

use std::fs;
use std::io::{Read, Write};
use std::net::TcpStream;
use std::process::{Command, Stdio};
use std::time::Duration;

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

/// Sends a login to a station. Returns the response.
fn log_in(address: &str, password: &str) -> String {
    let body = format!("{{\"name\":\"anna\",\"password\":\"{}\"}}", password.trim());
    let mut stream = TcpStream::connect(address).unwrap();
    let head = "POST /login HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n";
    write!(stream, "{head}Content-Length: {}\r\n\r\n{body}", body.len()).unwrap();
    let mut answer = String::new();
    stream.read_to_string(&mut answer).unwrap();
    answer
}

#[test]
fn no_log_level_shows_a_password_or_a_cookie() {
    const WRONG: &str = "a wrong password";
    let host = Host::new();
    host.add("anna", "drive");
    // A file takes the output of this level at any speed.
    let log = host.file("log");
    let mut station = Command::new(env!("CARGO_BIN_EXE_jaus-ocu"))
        .args(["--listen", "127.0.0.1:0", "--users", &host.file("users")])
        .args(own_group())
        .env("JAUS_LOG", "trace")
        .env("STATE_DIRECTORY", host.0.path())
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(fs::File::create(&log).unwrap())
        .spawn()
        .unwrap();
    let address = loop {
        assert_eq!(station.try_wait().unwrap(), None, "it runs");
        let text = fs::read_to_string(&log).unwrap();
        if let Some((_, rest)) = text.split_once("page is at http://")
            && let Some((address, _)) = rest.split_once('/')
        {
            break address.to_owned();
        }
        std::thread::sleep(Duration::from_millis(20));
    };
    assert!(log_in(&address, WRONG).starts_with("HTTP/1.1 401"));
    let answer = log_in(&address, PASSWORD);
    let (_, cookie) = answer.split_once("set-cookie: ").unwrap();
    let (_, secret) = cookie.split_once('=').unwrap();
    let secret = secret.split(';').next().unwrap();
    station.kill().unwrap();
    station.wait().unwrap();
    let text = fs::read_to_string(&log).unwrap();
    assert!(text.contains("login of anna"), "{text}");
    for word in [WRONG, PASSWORD.trim(), secret] {
        assert!(!text.contains(word), "{word} is in {text}");
    }
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
