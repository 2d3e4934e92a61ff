//! User actions on the page.

use std::time::Duration;

use super::browser::{Accessible, Browser, SCREENS, Screen};

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
    is_accessible(page, "Clear the emergency?");
    is_announced(page, "Emergency");
    page.press("#clear-yes");
    page.wait("document.body.dataset.emergency === 'ready'");
    take_control(page);
}

/// The labels of visible buttons that are wider than their buttons. A vehicle's name is shortened.
const OVERFLOWING: &str = "[...document.querySelectorAll('button:not(#vehicle-button)')] \
    .filter(it => it.getClientRects().length && it.scrollWidth > it.clientWidth) \
    .map(it => it.textContent).join(', ')";

/// The controls and values that no screen hides or cuts, as selectors; those that are, as text.
const HIDDEN: &str = "['#estop', '#state-word', '#state-detail', '#speed', '#heading', '#north', '#east'] \
    .filter(it => { const e = document.querySelector(it), b = e.getBoundingClientRect(); \
    const top = document.elementFromPoint(b.x + b.width / 2, b.y + b.height / 2); \
    return e.textContent && (b.width === 0 || b.left < 0 || b.top < 0 || b.right > innerWidth \
        || b.bottom > innerHeight || e.scrollWidth > Math.ceil(b.width) || !e.contains(top)); }).join(', ')";

/// Takes a screenshot on every screen. On each one, the emergency stop and the vehicle's state, speed,
/// heading and position are visible, and no text is wider than its place.
pub(crate) fn look_from_all_screens(page: &mut Browser, name: &str) {
    for screen in SCREENS {
        page.look_on(screen);
        look_from(page, screen, name);
    }
    page.look_on(SCREENS[0]);
}

/// The same on one screen, which the page is shown on.
pub(crate) fn look_from(page: &mut Browser, screen: Screen, name: &str) {
    page.wait("document.documentElement.scrollWidth <= innerWidth");
    page.wait("document.querySelector('#state-word').getClientRects().length");
    let fits = page.holds_within(Duration::from_secs(5), &format!("{OVERFLOWING} === ''"));
    assert!(
        fits,
        "{name} on {}: {}",
        screen.name,
        page.value(OVERFLOWING)
    );
    let fits = page.holds_within(Duration::from_secs(5), &format!("{HIDDEN} === ''"));
    if !fits {
        page.screenshot(&format!("{name}-{}-hidden", screen.name));
    }
    assert!(fits, "{name} on {}: {}", screen.name, page.value(HIDDEN));
    std::thread::sleep(Duration::from_millis(120));
    page.screenshot(&format!("{name}-{}", screen.name));
}

/// A dialog with this name is shown, and everything that can have the focus has a name.
#[track_caller]
pub(crate) fn is_accessible(page: &mut Browser, dialog: &str) {
    let nodes = page.accessibility();
    let is_dialog = |it: &&Accessible| matches!(&*it.role, "dialog" | "alertdialog");
    let dialogs: Vec<_> = nodes.iter().filter(is_dialog).map(|it| &*it.name).collect();
    assert!(dialogs.iter().any(|it| it.contains(dialog)), "{dialogs:?}");
    every_control_has_a_name(&nodes);
}

/// A screen reader has a name for each control that can have the focus.
#[track_caller]
pub(crate) fn every_control_has_a_name(nodes: &[Accessible]) {
    let controls: Vec<_> = nodes.iter().filter(|it| it.is_focusable).collect();
    assert!(controls.len() > 10, "{controls:?}");
    for control in &controls {
        assert!(!control.name.is_empty(), "without a name: {control:?}");
    }
}

/// A screen reader announces a text, because it is in a live region.
#[track_caller]
pub(crate) fn is_announced(page: &mut Browser, text: &str) {
    let nodes = page.accessibility();
    let live: Vec<_> = nodes.iter().filter(|it| !it.live.is_empty()).collect();
    assert!(
        live.iter().any(|it| it.text.contains(text)),
        "{text}: {live:?}"
    );
}
