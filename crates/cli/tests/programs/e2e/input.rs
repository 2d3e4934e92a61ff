//! What drives in a real browser, and what ends it: keys, mouse, touch and gamepad, each with every event
//! after which nothing that was held may count.

use std::time::Duration;

use serde_json::json;

use super::browser::{Browser, SCREENS};
use super::by_hand::Running;

/// The number of this test's multicast group.
const TEST: u8 = 12;
/// A held source that does not drive would begin to within this time: it is longer than all repeats.
const HELD_ON: Duration = Duration::from_millis(900);

/// A gamepad as browsers report it. Its time stamp changes with every reading, unless it is out of range.
const GAMEPAD: &str = "(() => { \
    globalThis.pad = { index: 0, connected: true, isHeld: false, isFar: false, forward: 1, stamp: 0 }; \
    navigator.getGamepads = () => { if (!pad.isFar) pad.stamp = performance.now(); \
        return pad.connected ? [{ index: 0, connected: true, timestamp: pad.stamp, axes: [0, -pad.forward], \
            buttons: Array.from({ length: 12 }, (_, it) => ({ pressed: pad.isHeld && it === 5 })) }] : [null]; }; \
    dispatchEvent(new Event('gamepadconnected')); })()";

#[derive(Clone, Copy, Debug, PartialEq)]
enum Source {
    Keys,
    Mouse,
    Touch,
    Gamepad,
}

impl Source {
    const ALL: [Self; 4] = [Self::Keys, Self::Mouse, Self::Touch, Self::Gamepad];

    fn take_up(self, page: &mut Browser) {
        match self {
            Self::Keys => page.hold_key("KeyW", "w"),
            Self::Mouse => page.hold("#stick", (0.0, -0.6)),
            Self::Touch => {
                let (x, y) = middle(page, "#stick");
                touch(page, "touchStart", Some((x, y)));
                touch(page, "touchMove", Some((x, y - 50.0)));
            }
            Self::Gamepad => drop(page.value("pad.isHeld = true")),
        }
    }

    fn let_go(self, page: &mut Browser) {
        match self {
            Self::Keys => page.let_go_of_key("KeyW", "w"),
            Self::Mouse => page.let_go(),
            Self::Touch => touch(page, "touchEnd", None),
            // It is read once with each frame.
            Self::Gamepad => drop(page.value(
                "new Promise((done) => { pad.isHeld = false; \
                 requestAnimationFrame(() => requestAnimationFrame(() => done(0))); })",
            )),
        }
    }

    /// What is true while it drives.
    fn drives(self) -> String {
        format!("document.querySelector('#drive-source').textContent === '{self:?}'")
    }

    #[track_caller]
    fn drive(self, page: &mut Browser, moves: &str) {
        page.drive(|page| self.take_up(page), |page| self.let_go(page), moves);
    }
}

/// An event that ends a drive: its name, and how it happens.
type Ending = (&'static str, fn(&mut Browser));

/// What ends a drive, apart from letting go.
const ENDINGS: [Ending; 9] = [
    ("a menu on the map", |page| {
        let (x, y) = middle(page, "#map");
        for kind in ["mousePressed", "mouseReleased"] {
            let event = json!({ "type": kind, "x": x, "y": y, "button": "right", "clickCount": 1 });
            page.call("Input.dispatchMouseEvent", &event);
        }
    }),
    ("another tab", |page| {
        let other = page.call("Target.createTarget", &json!({ "url": "about:blank" }));
        page.wait("document.hidden || !document.hasFocus()");
        page.call(
            "Target.closeTarget",
            &json!({ "targetId": other["targetId"] }),
        );
        page.call("Page.bringToFront", &json!({}));
        page.wait("!document.hidden");
    }),
    ("a rotated screen", |page| {
        page.look_on(SCREENS[2]);
        page.wait("innerHeight > innerWidth");
        page.look_on(SCREENS[0]);
        page.wait("innerHeight < innerWidth");
    }),
    ("Control", |page| {
        page.key_down("ControlLeft", "Control");
        page.key_up("ControlLeft", "Control");
    }),
    ("Meta", |page| {
        page.key_down("MetaLeft", "Meta");
        page.key_up("MetaLeft", "Meta");
    }),
    ("another view", |page| {
        page.value("document.querySelector('[data-show=system]').click()");
        page.value("document.querySelector('[data-show=drive]').click()");
    }),
    ("a dialog", |page| {
        page.value("(document.querySelector('#token-sheet').hidden = false)");
        page.value("(document.querySelector('#token-sheet').hidden = true)");
    }),
    ("a page that stands still", |page| {
        page.value(
            "(() => { const end = performance.now() + 700; while (performance.now() < end); })()",
        );
    }),
    ("an old page", |page| {
        page.value("dispatchEvent(new Event('pagehide'))");
    }),
];

pub(crate) fn run() {
    let (_vehicle, _) = Running::start(TEST, "jaus", &["vehicle", "--name", "G-Bat"], "Ctrl-C");
    let (_station, address) = Running::station(TEST, &["--listen", "127.0.0.1:0"]);
    let mut page = Browser::start(None);
    let page = &mut page;
    page.look_on(SCREENS[0]);
    page.open(&address);
    page.wait("document.body.dataset.link === 'live'");
    page.press("#by-hand");
    page.wait("document.activeElement.id === 'stick'");
    page.value(GAMEPAD);

    for source in Source::ALL {
        moves_while_it_is_held(page, source);
        for (ending, happen) in ENDINGS {
            ends(page, source, ending, happen);
        }
        for other in Source::ALL.into_iter().filter(|it| *it != source) {
            ends(page, source, &format!("{other:?}"), |page| {
                other.take_up(page);
            });
            other.let_go(page);
        }
    }
    a_key_whose_release_got_lost_stops(page);
    a_gamepad_that_is_out_of_range_or_gone_stops(page);
    a_finger_that_rests_drives_and_its_place_is_the_centre(page);
    a_second_finger_stops_in_an_emergency(page);
    assert!(page.complaints().is_empty(), "{:?}", page.complaints());
}

fn moves_while_it_is_held(page: &mut Browser, source: Source) {
    let moves = "parseFloat(document.querySelector('#speed').textContent) > 0.1";
    source.drive(page, &format!("{} && {moves}", source.drives()));
    source.let_go(page);
    is_idle(page, "let go");
    page.wait("Math.abs(parseFloat(document.querySelector('#speed').textContent)) < 0.05");
}

/// The drive ends, and does not begin again before its source was let go.
#[track_caller]
fn ends(page: &mut Browser, source: Source, ending: &str, happen: impl FnOnce(&mut Browser)) {
    source.drive(page, &source.drives());
    page.value("(globalThis.isDriven = new Set(), clearInterval(globalThis.watching), 0)");
    happen(page);
    is_idle(page, ending);
    page.value(
        "(globalThis.watching = setInterval(() => \
         isDriven.add(document.querySelector('#drive-source').textContent), 20), 0)",
    );
    std::thread::sleep(HELD_ON);
    let seen = page.value("[...isDriven].join()");
    assert_eq!(seen, "Idle", "{source:?} goes on after: {ending}");
    source.let_go(page);
}

#[track_caller]
fn is_idle(page: &mut Browser, ending: &str) {
    let idle = "document.querySelector('#drive-source').textContent === 'Idle'";
    let is_idle = page.holds_within(Duration::from_secs(5), idle);
    assert!(is_idle, "{ending}: {}", page.text("#drive-source"));
}

fn a_key_whose_release_got_lost_stops(page: &mut Browser) {
    page.drive_by_key(("KeyW", "w"), 0.1);
    page.stop_repeats();
    is_idle(page, "no repeats any more");
    page.wait("document.querySelector('#drive-line').textContent.includes('press again')");
    page.wait("Math.abs(parseFloat(document.querySelector('#speed').textContent)) < 0.05");
    page.key_up("KeyW", "w");
}

fn a_gamepad_that_is_out_of_range_or_gone_stops(page: &mut Browser) {
    for (loss, ending) in [
        ("pad.isFar = true", "pad.isFar = false"),
        (
            "pad.connected = false",
            "(pad.connected = true, dispatchEvent(new Event('gamepadconnected')))",
        ),
    ] {
        Source::Gamepad.drive(page, &Source::Gamepad.drives());
        page.value(loss);
        is_idle(page, loss);
        page.value(ending);
        std::thread::sleep(HELD_ON);
        is_idle(page, ending);
        Source::Gamepad.let_go(page);
    }
}

/// A phone: the first touch, at the stick's rim, is its centre. A long press asks for a menu, and gets none.
fn a_finger_that_rests_drives_and_its_place_is_the_centre(page: &mut Browser) {
    page.look_on(SCREENS[3]);
    let (x, y) = middle(page, "#stick");
    let rim = page.value("document.querySelector('#stick').getBoundingClientRect().y");
    let rim = rim.as_f64().unwrap() + 6.0;
    page.drive(
        |page| touch(page, "touchStart", Some((x, rim))),
        |page| touch(page, "touchEnd", None),
        &Source::Touch.drives(),
    );
    assert_eq!(page.text("#forward-value"), "0 %");
    std::thread::sleep(2 * HELD_ON);
    page.wait(&Source::Touch.drives());
    page.screenshot("input-phone");
    page.look_on(SCREENS[4]);
    is_idle(page, "rotated");
    touch(page, "touchMove", Some((x + 1.0, y + 1.0)));
    std::thread::sleep(HELD_ON);
    is_idle(page, "moved by a pixel after the rotation");
    touch(page, "touchEnd", None);
    page.look_on(SCREENS[0]);
}

/// Browsers make no click of a second finger.
fn a_second_finger_stops_in_an_emergency(page: &mut Browser) {
    let point = |(x, y): (f64, f64), id: u8| json!({ "x": x, "y": y, "id": id });
    let stick = point(middle(page, "#stick"), 1);
    let button = point(middle(page, "#estop"), 2);
    for (kind, points) in [
        ("touchStart", json!([stick])),
        ("touchStart", json!([stick, button])),
        ("touchEnd", json!([button])),
    ] {
        let event = json!({ "type": kind, "touchPoints": points });
        page.call("Input.dispatchTouchEvent", &event);
    }
    page.wait("document.body.dataset.emergency === 'stopped'");
    is_idle(page, "emergency");
    touch(page, "touchEnd", None);
}

fn middle(page: &mut Browser, selector: &str) -> (f64, f64) {
    let place = page.value(&format!(
        "(() => {{ const b = document.querySelector('{selector}').getBoundingClientRect(); \
         return [b.x + b.width / 2, b.y + b.height / 2]; }})()"
    ));
    (place[0].as_f64().unwrap(), place[1].as_f64().unwrap())
}

fn touch(page: &mut Browser, kind: &str, place: Option<(f64, f64)>) {
    let points: Vec<_> = place
        .iter()
        .map(|(x, y)| json!({ "x": x, "y": y }))
        .collect();
    let event = json!({ "type": kind, "touchPoints": points });
    page.call("Input.dispatchTouchEvent", &event);
}
