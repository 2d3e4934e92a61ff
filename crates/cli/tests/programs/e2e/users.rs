//! Users over HTTPS: one drives, one observes, an administrator ends a session.

use std::path::Path;
use std::time::SystemTime;

use jaus_ocu::Tls;

use super::browser::{Browser, SCREENS};
use super::by_hand::Running;
use super::steps::{is_accessible, look_from_all_screens, take_control};
use crate::support;

/// The number of this test's multicast group.
const TEST: u8 = 10;
const PASSWORD: &str = "correct horse battery";

/// The observer sees who drives, stops the vehicle and clears nothing. Without a session the page shows the login form.
pub(crate) fn run() {
    let folder = tempfile::tempdir().unwrap();
    let file = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let users = file("users");
    for (name, role) in [
        ("anna", "administer"),
        ("ben", "drive"),
        ("carl", "observe"),
    ] {
        let add = ["users", "add", name, "--role", role, "--users", &users];
        let added = support::run(&add, format!("{PASSWORD}\n").as_bytes());
        assert_eq!(added.status, 0, "{added:?}");
    }
    Tls::load_or_make(folder.path(), &[], SystemTime::now()).unwrap();
    let (_vehicle, _) = Running::start(TEST, "jaus", &["vehicle", "--name", "G-Bat"], "Ctrl-C");
    let (certificate, key, audit) = (file("page.crt"), file("page.key"), file("audit.jsonl"));
    let flags = [
        "--listen",
        "127.0.0.1:0",
        "--users",
        &users,
        "--audit",
        &audit,
    ];
    let tls = ["--tls-certificate", &certificate, "--tls-key", &key];
    let flags = [&flags[..], &tls].concat();
    let (_station, address) = Running::start(TEST, "jaus-ocu", &flags, "page is at ");
    assert!(address.starts_with("https://"), "{address}");

    let mut observer = page_of(&address, "carl");
    let mut driver = page_of(&address, "ben");
    take_control(&mut driver);
    assert_eq!(driver.text("#control-word"), "You have control");
    let word = "document.querySelector('#control-word').textContent";
    observer.wait(&format!("{word} === 'ben has control'"));
    look_from_all_screens(&mut observer, "users-observer");
    observer.press("#estop");
    observer.wait("document.body.dataset.emergency === 'stopped'");
    assert_eq!(
        observer.value("document.querySelector('#estop-clear').hidden"),
        true
    );
    driver.wait("document.body.dataset.emergency === 'stopped'");
    driver.wait("!document.querySelector('#estop-clear').hidden");

    administrator_ends_the_session_of(&address, "ben");
    driver.wait("!document.querySelector('#login-sheet').hidden");
    driver.wait("document.body.dataset.link === 'barred'");
    leaves(&mut observer);
    for page in [&mut driver, &mut observer] {
        assert!(page.complaints().is_empty(), "{:?}", page.complaints());
    }
    says_who_did_what(Path::new(&audit));
}

/// Opens the page and logs in by keyboard.
fn page_of(address: &str, name: &str) -> Browser {
    let mut page = Browser::start(None);
    page.look_on(SCREENS[0]);
    page.open(address);
    page.wait("document.activeElement?.id === 'login-name'");
    is_accessible(&mut page, "Log in");
    page.type_keys(name);
    page.tab();
    page.type_keys("a wrong password");
    page.enter();
    page.wait("document.querySelector('#login-text').textContent.includes('wrong')");
    page.wait("document.activeElement.id === 'login-password'");
    if name == "carl" {
        for screen in SCREENS {
            page.look_on(screen);
            page.screenshot(&format!("users-login-{}", screen.name));
        }
        page.look_on(SCREENS[0]);
    }
    page.type_keys(PASSWORD);
    page.enter();
    page.wait("document.querySelector('#login-sheet').hidden");
    page.wait("document.body.dataset.link === 'live'");
    page.wait("document.querySelector('#vehicle-name').textContent.includes('G-Bat')");
    page
}

fn administrator_ends_the_session_of(address: &str, name: &str) {
    let mut page = page_of(address, "anna");
    page.press("#account-button");
    page.wait("document.querySelectorAll('#sessions li').length === 3");
    is_accessible(&mut page, "anna: Administer");
    page.screenshot("users-sessions");
    page.press(&format!("[aria-label='End the session of {name}']"));
    page.wait("document.querySelectorAll('#sessions li').length === 2");
}

/// Logs out.
fn leaves(page: &mut Browser) {
    page.press("#account-button");
    page.press("#log-out");
    page.wait("document.activeElement?.id === 'login-name'");
}

fn says_who_did_what(audit: &Path) {
    let files = [audit, &jaus_audit::refusals_of(audit)];
    let log = files
        .map(|file| std::fs::read_to_string(file).unwrap())
        .concat();
    for words in [
        ["ben", "control requested", "allowed"],
        ["ben", "session ended", "ended by anna"],
        ["carl", "login", "wrong name or password"],
    ] {
        let has = log
            .lines()
            .any(|it| words.iter().all(|word| it.contains(word)));
        assert!(has, "{words:?} in {log}");
    }
    for secret in [PASSWORD, "a wrong password"] {
        assert!(!log.contains(secret), "{log}");
    }
}
