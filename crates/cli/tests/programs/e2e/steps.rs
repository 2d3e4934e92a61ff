//! User actions on the page.

use std::time::Duration;

use super::browser::{Browser, SCREENS};

/// Takes control unless it is already held or requested, and makes the vehicle Ready.
pub(crate) fn take_control(page: &mut Browser) {
    // While a request is pending, the button would cancel it.
    if page.value("document.body.dataset.control") == "none" {
        page.press("#control-button");
    }
    page.wait("document.body.dataset.control === 'held'");
    resume(page);
}

fn resume(page: &mut Browser) {
    if page.text("#state-word") != "Ready" {
        page.press("#resume");
    }
    page.wait("document.querySelector('#state-word').textContent === 'Ready'");
}

/// One key stops the vehicle. Clearing the emergency takes two touches, and leaves the vehicle in
/// Standby.
pub(crate) fn emergency(page: &mut Browser) {
    page.key_down("Escape", "Escape");
    page.key_up("Escape", "Escape");
    page.wait("document.body.dataset.emergency === 'stopped'");
    look_from_all_screens(page, "4-emergency");
    page.press("#estop-clear");
    page.wait("document.activeElement.id === 'clear-no'");
    page.screenshot("4-emergency-clear");
    page.press("#clear-yes");
    page.wait("document.body.dataset.emergency === 'ready'");
    take_control(page);
}

/// Takes a screenshot on every screen.
pub(crate) fn look_from_all_screens(page: &mut Browser, name: &str) {
    for screen in SCREENS {
        page.look_on(screen);
        page.wait("document.documentElement.scrollWidth <= innerWidth");
        std::thread::sleep(Duration::from_millis(120));
        page.screenshot(&format!("{name}-{}", screen.name));
    }
    page.look_on(SCREENS[0]);
}
