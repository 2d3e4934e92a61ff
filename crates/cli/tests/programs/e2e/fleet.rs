//! Several vehicles on one page: the list, by keyboard and by touch, on a tablet and on a phone.

use super::browser::{Browser, SCREENS, Screen};
use super::by_hand::Running;
use super::steps::{look_from_all_screens, take_control};

/// The number of this test's multicast group.
const TEST: u8 = 3;

/// A screen by its name.
fn screen(name: &str) -> Screen {
    SCREENS.into_iter().find(|it| it.name == name).unwrap()
}

/// The row of a vehicle in the list, as a JavaScript expression.
fn row(name: &str) -> String {
    format!(
        "[...document.querySelectorAll('#fleet button')].find(it => it.textContent.includes('{name}'))"
    )
}

/// Chooses vehicles, drives one of them, and stops all; then one vanishes and comes back.
pub(crate) fn run() {
    let first = ["vehicle", "--name", "G-Bat"];
    let second = ["vehicle", "--name", "Mole", "--id", "102.1.1"];
    let (_first, _) = Running::start(TEST, "jaus", &first, "Ctrl-C");
    let (mole, _) = Running::start(TEST, "jaus", &second, "Ctrl-C");
    let station = [
        "--listen",
        "127.0.0.1:0",
        "--vehicle",
        "101",
        "--vehicle",
        "102",
    ];
    let (_station, address) = Running::station(TEST, &station);
    let mut page = Browser::start(None);
    page.look_on(screen("tablet"));
    page.open(&address);
    page.wait("document.body.dataset.link === 'live'");
    page.wait("document.querySelector('#vehicle-name').textContent.includes('G-Bat')");
    page.wait("document.querySelector('#vehicle-count').textContent === 'of 2'");
    take_control(&mut page);

    chooses_by_keyboard(&mut page);
    take_control(&mut page);
    page.wait(&format!(
        "{}.textContent.includes('you control it')",
        row("Mole")
    ));
    page.wait(&format!(
        "{}.textContent.includes('nobody controls it')",
        row("G-Bat")
    ));
    look_from_all_screens(&mut page, "fleet");

    page.look_on(screen("phone"));
    stops_all(&mut page);
    drop(mole);
    page.press("#vehicle-button");
    page.wait(&format!("{}.dataset.state === 'gone'", row("Mole")));
    look_from_all_screens(&mut page, "fleet-gone");
    page.look_on(screen("phone"));
    chooses_by_touch(&mut page);
    let (_mole, _) = Running::start(TEST, "jaus", &second, "Ctrl-C");
    page.wait(&format!("{}.dataset.state === 'standby'", row("Mole")));
    assert!(page.complaints().is_empty(), "{:?}", page.complaints());
}

/// V opens the list, arrows move along it without driving, and Enter chooses.
fn chooses_by_keyboard(page: &mut Browser) {
    page.key_down("KeyV", "v");
    page.key_up("KeyV", "v");
    page.wait("document.activeElement.textContent.includes('G-Bat')");
    page.key_down("ArrowDown", "ArrowDown");
    page.key_up("ArrowDown", "ArrowDown");
    page.wait("document.activeElement.textContent.includes('Mole')");
    assert_eq!(page.text("#drive-source"), "Idle");
    page.enter();
    page.wait("document.querySelector('#vehicle-name').textContent.includes('Mole')");
    page.wait("document.body.dataset.control === 'none'");
}

fn chooses_by_touch(page: &mut Browser) {
    page.press("#fleet li:first-child button");
    page.wait("document.querySelector('#vehicle-name').textContent.includes('G-Bat')");
}

/// Shift and Escape stop all vehicles; the sheet clears all of them.
fn stops_all(page: &mut Browser) {
    page.shift_key("Escape", "Escape");
    page.wait("document.querySelector('#estop-all-detail').textContent === 'all are stopped'");
    for name in ["G-Bat", "Mole"] {
        page.wait(&format!("{}.dataset.state === 'emergency'", row(name)));
    }
    look_from_all_screens(page, "fleet-stopped");
    page.press("#estop-clear");
    page.press("#clear-all");
    for name in ["G-Bat", "Mole"] {
        page.wait(&format!("{}.dataset.state === 'standby'", row(name)));
    }
}
