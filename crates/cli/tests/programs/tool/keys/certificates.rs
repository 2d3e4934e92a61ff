//! Nodes with certificates of their team's authority.

use std::time::{Duration, Instant};

use jaus_files::Readers;

use super::*;

/// A host that keeps the authority, and issues certificates for the others.
struct Office(Host);

impl Office {
    fn new() -> Self {
        let office = Self(Host::new());
        let made = office.ca(&["new", "--unencrypted"]);
        assert_eq!(made.status, 0, "{made:?}");
        office
    }

    fn ca(&self, arguments: &[&str]) -> Run {
        let folder = self.0.file("ca");
        let all = [&["keys", "ca"], arguments, &["--folder", &folder]].concat();
        run(&all, b"")
    }

    /// Issues a certificate to a host, for its key, with the files that a node needs.
    fn issue(&self, to: &Host, name: &str, ids: &str, life: &str) {
        let key = to.keys(&["show"]).stdout;
        let issued = self.ca(&["issue", name, key.trim(), ids, "--for", life]);
        assert_eq!(issued.status, 0, "{issued:?}");
        std::fs::write(to.file("node.crt"), issued.stdout).unwrap();
    }

    /// The flags of a node on a host.
    fn flags(&self, host: &Host) -> Vec<String> {
        let file = |name: &str| self.0.file(&format!("ca/{name}"));
        let mut flags = host.flags().to_vec();
        flags.push(format!("--certificate={}", host.file("node.crt")));
        flags.push(format!("--certificate-authority={}", file("ca.crt")));
        flags.push(format!("--revoked={}", file("ca.crl")));
        flags
    }

    fn start(&self, host: &Host, command: &str, arguments: &[&str]) -> Running {
        let flags = self.flags(host);
        let flags: Vec<_> = flags.iter().map(String::as_str).collect();
        Running::command(command, &[arguments, &flags].concat())
    }

    /// Queries a vehicle from a host with a certificate.
    fn query(&self, host: &Host, address: &str, vehicle: &str, timeout: &str) -> Run {
        let flags = self.flags(host);
        let mut all = vec!["query", vehicle, "QueryIdentification", WHICH];
        all.extend([
            "--id",
            "60.1.1",
            "--secure-peer",
            address,
            "--timeout",
            timeout,
        ]);
        all.extend(flags.iter().map(String::as_str));
        run(&all, b"")
    }
}

fn host() -> Host {
    let host = Host::new();
    host.new_key();
    host
}

/// A vehicle with a certificate that listens at a port.
fn vehicle(office: &Office, id: &str) -> (Running, Host, String) {
    let host = host();
    office.issue(&host, "rover", "115.255.255", "30d");
    let address = format!("127.0.0.1:{}", free_port());
    let listen = format!("--secure-listen={address}");
    let mut vehicle = office.start(&host, "vehicle", &["--id", id, &listen]);
    vehicle.read_until("Ctrl-C");
    (vehicle, host, address)
}

#[test]
fn a_certificate_needs_no_trust_file_and_is_revoked_by_one_command() {
    let (office, operator) = (Office::new(), host());
    let (_vehicle, _host, address) = vehicle(&office, "115.1.6");
    office.issue(&operator, "operator", "60.255.255", "30d");
    let answered = office.query(&operator, &address, "115.1.6", "20s");
    assert_eq!(answered.status, 0, "{answered:?}");

    let watch = ["--watch", "--id", "60.1.2", "--secure-peer", &address];
    let mut watching = office.start(&operator, "discover", &watch);
    watching.read_until("115.1.6");
    let revoked = office.ca(&["revoke", "operator"]);
    assert_eq!(revoked.status, 0, "{revoked:?}");
    assert!(revoked.stderr.contains(TAKEN), "{revoked:?}");
    watching.read_until("lost");
    let refused = office.query(&operator, &address, "115.1.6", "1s");
    assert_eq!(refused.status, 2, "its own node notices it: {refused:?}");
    assert!(refused.stderr.contains("is revoked"), "{refused:?}");
}

#[test]
fn a_trust_file_that_is_named_and_missing_is_told_at_the_start() {
    let (office, host) = (Office::new(), host());
    office.issue(&host, "rover", "115.255.255", "30d");
    let mut node = vec!["node", "--loopback", "--id", "115.1.13", "--for", "100ms"];
    let flags = office.flags(&host);
    node.push("--secure-listen=127.0.0.1:0");
    node.extend(flags.iter().map(String::as_str));
    let warning = "missing, so no line narrows a certificate";
    let started = run(&node, b"");
    assert!(started.stderr.contains(warning), "{started:?}");
    std::fs::write(host.file("trusted_keys"), "").unwrap();
    let started = run(&node, b"");
    assert!(!started.stderr.contains(warning), "{started:?}");
    assert_eq!(started.status, 0, "{started:?}");
}

#[test]
fn a_certificate_of_another_authority_gets_no_link() {
    let (office, other, stranger) = (Office::new(), Office::new(), host());
    let (_vehicle, _host, address) = vehicle(&office, "115.1.7");
    other.issue(&stranger, "operator", "60.255.255", "30d");
    let refused = other.query(&stranger, &address, "115.1.7", "1s");
    assert_eq!((refused.status, &*refused.stdout), (1, ""), "{refused:?}");
}

#[test]
fn a_node_does_not_start_with_a_certificate_that_peers_would_refuse() {
    let (office, operator) = (Office::new(), host());
    let address = "127.0.0.1:9";
    office.issue(&operator, "operator", "60.255.255", "1s");
    let end = Instant::now() + Duration::from_secs(20);
    let mut refused = office.query(&operator, address, "115.1.8", "100ms");
    while refused.status != 2 && Instant::now() < end {
        refused = office.query(&operator, address, "115.1.8", "100ms");
    }
    assert!(refused.stderr.contains("has expired"), "{refused:?}");
    assert!(refused.stderr.contains("jaus keys ca issue"), "{refused:?}");

    let other = host();
    office.issue(&other, "other", "61.255.255", "30d");
    std::fs::copy(other.file("node.crt"), operator.file("node.crt")).unwrap();
    let refused = office.query(&operator, address, "115.1.8", "100ms");
    assert_eq!(refused.status, 2, "{refused:?}");
    assert!(refused.stderr.contains("another key"), "{refused:?}");
}

#[test]
fn certificates_are_listed_and_bad_requests_say_what_to_do() {
    let nothing = Office(Host::new());
    let key = host().keys(&["show"]).stdout;
    let issue = |office: &Office, ids: &str, life: &str| {
        office.ca(&["issue", "rover", key.trim(), ids, "--for", life])
    };
    let missing = issue(&nothing, "101.255.255", "30d");
    assert!(missing.stderr.contains("jaus keys ca new"), "{missing:?}");

    let office = Office::new();
    let again = office.ca(&["new", "--unencrypted"]);
    assert_eq!(again.status, 2, "an authority is not replaced: {again:?}");
    assert_eq!(office.ca(&["list"]).status, 1, "nothing is issued");
    for (ids, life) in [
        ("101.1", "30d"),
        ("101.255.255", "0d"),
        ("101.255.255", "long"),
    ] {
        let refused = issue(&office, ids, life);
        assert_eq!((refused.status, &*refused.stdout), (2, ""), "{refused:?}");
    }
    assert_eq!(issue(&office, "101.255.255,102.1.1", "2h").status, 0);
    assert_eq!(office.ca(&["revoke", "nobody"]).status, 1);
    let serial = office.ca(&["list", "--json"]).only_line()["serial"].clone();
    assert_eq!(office.ca(&["revoke", serial.as_str().unwrap()]).status, 0);
    let listed = office.ca(&["list", "--json"]).only_line();
    assert_eq!(listed["state"], "revoked");
    assert_eq!(listed["ids"][1], "102.1.1");
}

/// The folder of an authority with files of passphrases.
fn office_with(passphrases: &[(&str, &str)]) -> Office {
    let office = Office(Host::new());
    for (name, passphrase) in passphrases {
        let path = office.0.file(name);
        jaus_files::create(path.as_ref(), Readers::Owner, passphrase.as_bytes()).unwrap();
    }
    office
}

#[test]
fn the_key_of_an_authority_is_encrypted_unless_that_is_refused() {
    let office = office_with(&[
        ("passphrase", "correct horse battery\n"),
        ("wrong", "incorrect horse"),
    ]);
    let refused = office.ca(&["new"]);
    assert_eq!(refused.status, 2, "{refused:?}");
    assert!(
        refused
            .stderr
            .contains("--passphrase-file, or --unencrypted"),
        "{refused:?}"
    );

    let [right, wrong] =
        ["passphrase", "wrong"].map(|it| format!("--passphrase-file={}", office.0.file(it)));
    let made = office.ca(&["new", &right]);
    assert_eq!(made.status, 0, "{made:?}");
    let text = std::fs::read_to_string(office.0.file("ca/ca.key")).unwrap();
    assert!(text.contains("BEGIN ENCRYPTED PRIVATE KEY"), "{text}");

    let key = host().keys(&["show"]).stdout;
    let issue = |flags: &[&str]| {
        office.ca(&[&["issue", "rover", key.trim(), "101.255.255"], flags].concat())
    };
    for (flags, why) in [
        (&[][..], "use --passphrase-file"),
        (&[&*wrong], "with another passphrase"),
    ] {
        let refused = issue(flags);
        assert_eq!((refused.status, &*refused.stdout), (2, ""), "{refused:?}");
        assert!(refused.stderr.contains(why), "{refused:?}");
    }
    assert_eq!(issue(&[&right]).status, 0);
    assert_eq!(office.ca(&["list"]).status, 0, "the list needs no key");
    assert_eq!(office.ca(&["revoke", "rover", &right]).status, 0);
}

#[test]
fn a_key_without_a_passphrase_still_works_and_the_tool_says_how_to_encrypt_it() {
    let office = office_with(&[("passphrase", "correct horse battery\n")]);
    assert_eq!(office.ca(&["new", "--unencrypted"]).status, 0);
    let key = host().keys(&["show"]).stdout;
    let issue = ["issue", "rover", key.trim(), "101.255.255"];
    let issued = office.ca(&issue);
    assert_eq!(issued.status, 0, "{issued:?}");
    assert!(
        issued
            .stderr
            .contains("`jaus keys ca passphrase` encrypts it"),
        "{issued:?}"
    );

    let file = office.0.file("passphrase");
    let encrypted = office.ca(&["passphrase", "--new-passphrase-file", &file]);
    assert_eq!(encrypted.status, 0, "{encrypted:?}");
    assert_eq!(office.ca(&issue).status, 2);
    let given = [&issue[..], &["--passphrase-file", &file]].concat();
    let issued = office.ca(&given);
    assert_eq!((issued.status, &*issued.stderr), (0, ""), "{issued:?}");
    let plain = office.ca(&["passphrase", "--passphrase-file", &file, "--unencrypted"]);
    assert_eq!(plain.status, 0, "{plain:?}");
    assert_eq!(office.ca(&issue).status, 0);
}
