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
    assert_eq!(
        page.value("document.querySelector('#resume').disabled"),
        true
    );
    page.press("#estop-clear");
    page.wait("document.activeElement.id === 'clear-no'");
    page.screenshot("4-emergency-clear");
    page.press("#clear-yes");
    page.wait("document.body.dataset.emergency === 'ready'");
    take_control(page);
}

/// The labels of visible buttons that are wider than their buttons. A vehicle's name is shortened.
const OVERFLOWING: &str = "[...document.querySelectorAll('button:not(#vehicle-button)')] \
    .filter(it => it.getClientRects().length && it.scrollWidth > it.clientWidth) \
    .map(it => it.textContent).join(', ')";

/// Takes a screenshot on every screen. On each one, the vehicle's state is visible, and no text is
/// wider than its place.
pub(crate) fn look_from_all_screens(page: &mut Browser, name: &str) {
    for screen in SCREENS {
        page.look_on(screen);
        page.wait("document.documentElement.scrollWidth <= innerWidth");
        page.wait("document.querySelector('#state-word').getClientRects().length");
        let fits = page.holds_within(Duration::from_secs(5), &format!("{OVERFLOWING} === ''"));
        assert!(
            fits,
            "{name} on {}: {}",
            screen.name,
            page.value(OVERFLOWING)
        );
        std::thread::sleep(Duration::from_millis(120));
        page.screenshot(&format!("{name}-{}", screen.name));
    }
    page.look_on(SCREENS[0]);
}
