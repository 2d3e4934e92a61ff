//! Pages that have not shown the station's token.

use super::browser::{Browser, SCREENS};
use super::by_hand::Running;
use super::steps::{is_accessible, look_from_all_screens};

/// The number of this test's multicast group.
const TEST: u8 = 5;
/// And that of the station that may be watched.
const OTHER_TEST: u8 = 25;
const TOKEN: &str = "a-token-of-the-tests";

/// The page is loaded anew until all of its files are there.
///
/// Without the token nothing is shown, and the emergency stop does not look alive: it asks for the
/// token by touch and by key, and says that nothing is sent. Once it has the token it stops the vehicle.
/// Where pages may watch without the token, they may also stop the vehicle, and clear no emergency.
pub(crate) fn run() {
    let file = std::env::temp_dir().join(format!("jaus-e2e-token-{}", std::process::id()));
    jaus_files::replace(&file, jaus_files::Readers::Owner, TOKEN.as_bytes()).unwrap();
    let (_vehicle, _) = Running::start(TEST, "jaus", &["vehicle", "--name", "G-Bat"], "Ctrl-C");
    let station = [
        "--listen",
        "127.0.0.1:0",
        "--token-file",
        file.to_str().unwrap(),
    ];
    let (_station, address) = Running::start(TEST, "jaus-ocu", &station, "page is at ");
    let mut page = Browser::start(None);
    page.look_on(SCREENS[0]);
    page.withhold(&["*/map.js"]);
    // What follows the # is the token.
    page.open(address.split('#').next().unwrap());
    page.wait("document.querySelector('#link-word').textContent === 'Not loaded'");
    page.withhold(&[]);
    page.wait("!document.querySelector('#token-sheet').hidden");
    page.wait("document.querySelector('#token-no').hidden");
    page.wait("document.body.dataset.emergency === 'barred'");
    assert_eq!(page.text("#estop-detail"), "enter the token to use it");
    assert_eq!(
        page.value("document.querySelector('#by-hand').hidden"),
        true
    );
    // On a phone the question covers the panels.
    page.screenshot("token-required");

    page.press("#estop");
    page.wait("document.activeElement.id === 'token'");
    assert_eq!(
        page.text("#estop-detail"),
        "NOT SENT: enter the token to use it"
    );
    is_accessible(&mut page, "Token required");
    page.key_down("Escape", "Escape");
    page.key_up("Escape", "Escape");
    page.wait("!document.querySelector('#token-sheet').hidden");
    page.write("#token", TOKEN);
    page.press("#token-form .primary");
    // The stop that was pressed before is sent now.
    page.wait("document.body.dataset.emergency === 'stopped'");
    assert!(page.complaints().is_empty(), "{:?}", page.complaints());
    page.press("#estop-clear");
    page.press("#clear-yes");
    page.wait("document.body.dataset.emergency === 'ready'");

    let watched = [&station[..], &["--watch-without-token"]].concat();
    let (_watched, address) = Running::start(OTHER_TEST, "jaus-ocu", &watched, "page is at ");
    let vehicle = ["vehicle", "--name", "G-Bat"];
    let (_vehicle, _) = Running::start(OTHER_TEST, "jaus", &vehicle, "Ctrl-C");
    may_watch_and_stop(&address);
    std::fs::remove_file(file).unwrap();
}

fn may_watch_and_stop(address: &str) {
    let mut page = Browser::start(None);
    page.look_on(SCREENS[0]);
    page.open(address);
    page.press("#token-no");
    page.wait("document.querySelector('#state-word').textContent === 'Standby'");
    page.wait("document.body.dataset.emergency === 'ready'");
    page.press("#estop");
    page.wait("document.body.dataset.emergency === 'stopped'");
    page.wait("document.querySelector('#estop-clear').hidden");
    look_from_all_screens(&mut page, "watching-stopped");
    assert!(page.complaints().is_empty(), "{:?}", page.complaints());
}
