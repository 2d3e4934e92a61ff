//! A page that may only watch, because it has not shown the station's token.

use super::browser::{Browser, SCREENS};
use super::by_hand::Running;
use super::steps::{is_accessible, look_from_all_screens};

/// The number of this test's multicast group.
const TEST: u8 = 5;
const TOKEN: &str = "a-token-of-the-tests";

/// The page is loaded anew until all of its files are there.
///
/// The emergency stop does not look alive, and asks for the token by touch and by key. With the token
/// it stops the vehicle.
pub(crate) fn run() {
    let file = std::env::temp_dir().join(format!("jaus-e2e-token-{}", std::process::id()));
    std::fs::write(&file, TOKEN).unwrap();
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
    page.press("#token-no");
    page.wait("document.querySelector('#state-word').textContent === 'Standby'");
    page.wait("document.body.dataset.emergency === 'barred'");
    assert_eq!(page.text("#estop-detail"), "enter the token to use it");
    assert_eq!(
        page.value("document.querySelector('#by-hand').hidden"),
        true
    );
    look_from_all_screens(&mut page, "watching");

    page.press("#estop");
    page.wait("!document.querySelector('#token-sheet').hidden");
    page.wait("document.activeElement.id === 'token'");
    is_accessible(&mut page, "Watching only");
    page.press("#token-no");
    page.key_down("Escape", "Escape");
    page.key_up("Escape", "Escape");
    page.wait("!document.querySelector('#token-sheet').hidden");
    page.write("#token", TOKEN);
    page.press("#token-form .primary");
    page.wait("document.body.dataset.emergency === 'ready'");
    page.press("#estop");
    page.wait("document.body.dataset.emergency === 'stopped'");
    assert!(page.complaints().is_empty(), "{:?}", page.complaints());
    std::fs::remove_file(file).unwrap();
}
