//! The page by keyboard alone: Tab, Enter, Escape and digits.

use super::browser::Browser;
use super::system::System;

/// Limit of presses of Tab on the way to a control: more than the page has controls.
const MOST_STEPS: usize = 120;

/// Why the element with the focus is not visible as such; empty if it is. Beyond the last control the
/// browser itself has the focus.
const HIDDEN_FOCUS: &str = "(() => { const e = document.activeElement; \
    if (!e || e === document.body) return ''; \
    const b = e.getBoundingClientRect(), style = getComputedStyle(e); \
    const name = e.id || e.textContent; \
    if (b.width === 0 || b.height === 0) return name + ' is not shown'; \
    if (b.right < 1 || b.bottom < 1 || b.left > innerWidth - 1 || b.top > innerHeight - 1) return name + ' is off the screen'; \
    if (!e.matches(':focus-visible')) return name + ' is not marked'; \
    if (style.outlineStyle === 'none' || parseFloat(style.outlineWidth) < 2) return name + ' has no outline'; \
    const x = Math.min(Math.max(b.x + b.width / 2, 1), innerWidth - 1); \
    const y = Math.min(Math.max(b.y + Math.min(b.height / 2, 20), 1), innerHeight - 1); \
    const top = document.elementFromPoint(x, y); \
    return e === top || e.contains(top) || top?.contains(e) ? '' : name + ' is covered'; })()";

/// Presses Tab until a control has the focus. On the way the focus is always visible.
#[track_caller]
fn tab_to(page: &mut Browser, selector: &str) {
    let is_there = format!("document.activeElement?.matches('{selector}')");
    for _ in 0..MOST_STEPS {
        if page.value(&is_there) == true {
            return;
        }
        page.tab();
        focus_is_visible(page);
    }
    let focused = page.value("document.activeElement?.outerHTML.slice(0, 200)");
    panic!("Tab does not lead to {selector}, but to {focused}");
}

#[track_caller]
fn focus_is_visible(page: &mut Browser) {
    // A list that is kept up to date may move the element once more.
    let is_visible = page.holds_within(
        std::time::Duration::from_secs(2),
        &format!("{HIDDEN_FOCUS} === ''"),
    );
    assert!(is_visible, "{}", page.value(HIDDEN_FOCUS));
}

/// Tabs to a control and presses Enter.
#[track_caller]
fn enter(page: &mut Browser, selector: &str) {
    page.wait(&format!("!document.querySelector('{selector}').disabled"));
    tab_to(page, selector);
    page.enter();
}

/// After the pressed control was disabled or hidden, another one has the focus.
#[track_caller]
fn something_has_the_focus(page: &mut Browser) {
    page.wait("document.activeElement && document.activeElement !== document.body");
    focus_is_visible(page);
}

/// Takes control, plans, approves, stops, ends in an emergency and clears it.
pub(crate) fn run(_: &System, page: &mut Browser) {
    enter(page, "#control-button");
    page.wait("document.body.dataset.control === 'held'");
    focus_is_visible(page);
    enter(page, "#resume");
    page.wait("document.querySelector('#state-word').textContent === 'Ready'");
    something_has_the_focus(page);

    tab_to(page, "#destination-x");
    page.type_keys("4.5");
    tab_to(page, "#destination-y");
    page.type_keys("1.5");
    tab_to(page, "#destination-speed");
    page.type_keys("0.2");
    enter(page, "#plan");
    page.wait("!document.querySelector('#approve').disabled");
    enter(page, "#approve");
    page.wait(
        "document.querySelector('#stages [aria-current] .stage-name')?.textContent === 'Driving'",
    );
    something_has_the_focus(page);
    page.screenshot("keyboard-driving");
    enter(page, "#stop");
    page.wait("document.querySelector('#mission-line').dataset.state === 'stopped'");
    something_has_the_focus(page);

    page.key_down("Escape", "Escape");
    page.key_up("Escape", "Escape");
    page.wait("document.body.dataset.emergency === 'stopped'");
    enter(page, "#estop-clear");
    page.wait("document.activeElement.id === 'clear-no'");
    focus_is_visible(page);
    page.screenshot("keyboard-clear");
    enter(page, "#clear-yes");
    page.wait("document.body.dataset.emergency === 'ready'");
    something_has_the_focus(page);
}
