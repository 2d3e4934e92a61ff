//! The operator: real input events on the page, and what can happen to them. All selectors and texts of the page that
//! these measurements depend on are in this file.

use std::thread::sleep;
use std::time::{Duration, Instant};

use serde_json::json;

use super::bed::{Bed, within};
use crate::e2e::browser::Browser;
use crate::e2e::{FAR, FAR_BACK, SLOW, approve, plan};

/// What drives the vehicle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Source {
    Keys,
    Mouse,
    Touch,
    Gamepad,
}

impl Source {
    pub(crate) const ALL: [Self; 4] = [Self::Keys, Self::Mouse, Self::Touch, Self::Gamepad];

    pub(crate) const fn name(self) -> &'static str {
        match self {
            Self::Keys => "keys",
            Self::Mouse => "mouse",
            Self::Touch => "touch",
            Self::Gamepad => "gamepad",
        }
    }

    /// When a hand that holds it has shown that it is still there: a key by its first repetition, for which the page
    /// waits longer than for the others.
    pub(crate) const fn first_sign(self) -> Duration {
        match self {
            Self::Keys => Duration::from_millis(750),
            Self::Mouse | Self::Touch | Self::Gamepad => Duration::ZERO,
        }
    }
}

/// What happens to what is held.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Event {
    /// It is let go.
    Release,
    /// It is let go, and no event of it reaches the page any more: an input method, a remote desktop. A gamepad's data
    /// stay as they are.
    Lost,
    /// A context menu opens, and it is let go under it.
    ContextMenu,
    /// The page loses the pointer, or the gamepad its cable.
    LostCapture,
    /// The address bar has the focus.
    Blur,
    /// Another tab is in front.
    Hidden,
    /// Another page is loaded.
    LeftPage,
    ClosedTab,
    KilledBrowser,
    /// The window has another size.
    Resize,
    /// The screen is turned.
    Rotation,
    AltKey,
    SuperKey,
    /// A dialog of the page opens.
    Dialog,
    /// A dialog of the browser opens, and nothing runs on the page.
    Alert,
    LeftView,
    /// The operator touches the stick, or a key if it is the stick that is held.
    OtherSource,
}

impl Event {
    pub(crate) const ALL: [Self; 17] = [
        Self::Release,
        Self::Lost,
        Self::ContextMenu,
        Self::LostCapture,
        Self::Blur,
        Self::Hidden,
        Self::LeftPage,
        Self::ClosedTab,
        Self::KilledBrowser,
        Self::Resize,
        Self::Rotation,
        Self::AltKey,
        Self::SuperKey,
        Self::Dialog,
        Self::Alert,
        Self::LeftView,
        Self::OtherSource,
    ];

    pub(crate) const fn name(self) -> &'static str {
        match self {
            Self::Release => "released",
            Self::Lost => "released, and the release is lost",
            Self::ContextMenu => "context menu, released under it",
            Self::LostCapture => "capture lost, gamepad unplugged",
            Self::Blur => "focus in the address bar",
            Self::Hidden => "another tab",
            Self::LeftPage => "another page",
            Self::ClosedTab => "tab closed",
            Self::KilledBrowser => "browser killed",
            Self::Resize => "window resized",
            Self::Rotation => "screen turned",
            Self::AltKey => "Alt pressed",
            Self::SuperKey => "Super pressed",
            Self::Dialog => "dialog of the page",
            Self::Alert => "dialog of the browser",
            Self::LeftView => "another view",
            Self::OtherSource => "another source",
        }
    }

    pub(crate) fn can_happen_to(self, source: Source) -> bool {
        self != Self::LostCapture || source != Source::Keys
    }
}

/// How the operator stops at once.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Stop {
    Escape,
    RedButton,
    /// The gamepad's B.
    PadButton,
}

const STICK: &str = "#stick";
/// How often the operator presses it.
const PRESSES: usize = 4;
const DRIVE_BY_HAND: &str = "#by-hand";
const IS_LIVE: &str = "document.body.dataset.link === 'live'";
const DRIVE_VIEW: &str = "[data-show=drive]";
const IS_READY: &str = "document.querySelector('#by-hand').hidden && document.body.dataset.control === 'held' \
    && document.querySelector('#state-word').textContent === 'Ready'";
const IS_IN_EMERGENCY: &str = "document.body.dataset.emergency === 'stopped'";
const IS_NO_EMERGENCY: &str = "document.body.dataset.emergency === 'ready'";
const OPEN_DIALOG: &str = "document.querySelector('#clear-sheet').hidden = false";
const LINE: &str = "#drive-line";
/// A position of the map that has no control, as fractions of its size.
const OF_THE_MAP: &str = "(() => { const b = document.querySelector('#map').getBoundingClientRect(); \
    return { x: b.x + b.width * 0.3, y: b.y + b.height * 0.5 }; })()";

/// Runs before the page's own scripts: lets events get lost, remembers captured pointers, and plays a gamepad, because
/// browsers offer no other way to a virtual one than a device of the kernel.
const BEFORE_LOAD: &str = r"(() => {
    const test = globalThis.test = { lost: false, pointer: null };
    for (const type of ['keydown', 'keyup', 'pointermove', 'pointerup', 'pointercancel', 'lostpointercapture',
        'mousemove', 'mouseup', 'touchmove', 'touchend', 'touchcancel']) {
        addEventListener(type, (event) => test.lost && event.stopImmediatePropagation(), true);
    }
    addEventListener('gotpointercapture', (event) => { test.pointer = event.pointerId; }, true);
    const pad = { id: 'Test pad', index: 0, connected: false, mapping: 'standard', timestamp: 0, axes: [0, 0, 0, 0],
        buttons: Array.from({ length: 17 }, () => false) };
    navigator.getGamepads = () => {
        if (!test.lost) pad.timestamp = performance.now();
        const buttons = pad.buttons.map((pressed) => ({ pressed, touched: pressed, value: Number(pressed) }));
        return pad.connected ? [{ ...pad, axes: [...pad.axes], buttons }, null, null, null] : [null, null, null, null];
    };
    test.plug = (on) => {
        pad.connected = on;
        dispatchEvent(Object.assign(new Event(on ? 'gamepadconnected' : 'gamepaddisconnected'), { gamepad: pad }));
    };
    test.pad = (held, ahead, stop) => {
        if (test.lost) return;
        [pad.buttons[5], pad.axes[1], pad.buttons[1]] = [held, -ahead, stop];
    };
})()";

/// An operator at a browser.
pub(crate) struct Operator<'a> {
    bed: &'a Bed,
    browser: Browser,
    page: Page,
}

/// What has become of the operator's page.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Page {
    /// It is as it was opened.
    Intact,
    /// It is still there; something has happened to it.
    Changed,
    /// It is closed, or a dialog keeps it from running.
    Closed,
    /// Its browser is gone.
    Killed,
}

impl<'a> Operator<'a> {
    pub(crate) fn new(bed: &'a Bed) -> Self {
        Self {
            bed,
            browser: bed.browser(),
            page: Page::Closed,
        }
    }

    /// Whether the page is as it was opened.
    pub(crate) fn is_intact(&self) -> bool {
        self.page == Page::Intact
    }

    /// Makes the vehicle ready to be driven by hand. An emergency is cleared.
    pub(crate) fn engage(&mut self) {
        self.browser.wait(IS_LIVE);
        self.clear_emergency();
        // The vehicle may still be ready from the time before.
        let begins = format!("{IS_READY} || !document.querySelector('{DRIVE_BY_HAND}').hidden");
        self.browser.wait(&begins);
        // A request may get lost on a link that has just been mended: then the operator presses again.
        for _ in 0..PRESSES {
            if self.browser.value(IS_READY) == true {
                break;
            }
            self.browser.press(DRIVE_BY_HAND);
            let browser = &mut self.browser;
            within(Duration::from_secs(10), || browser.value(IS_READY) == true);
        }
        self.browser.wait(IS_READY);
        self.browser.press(DRIVE_VIEW);
        self.bed.display.input("mousemove 300 400");
    }

    /// Opens the page in a new tab or browser.
    pub(crate) fn open(&mut self) {
        if self.page == Page::Killed {
            self.browser = self.bed.browser();
        } else {
            self.browser.close_tabs();
            self.browser.open_tab();
        }
        self.page = Page::Intact;
        let script = json!({ "source": BEFORE_LOAD });
        let add = "Page.addScriptToEvaluateOnNewDocument";
        self.browser.call(add, &script);
        self.browser.open(&self.bed.page());
        self.browser.wait(IS_LIVE);
        self.browser
            .wait("document.querySelectorAll('#parts .part').length >= 4");
    }

    /// Clears the emergency if there is one.
    pub(crate) fn clear_emergency(&mut self) {
        // A link that has just been mended may not have brought it yet.
        let is_known = format!("{IS_IN_EMERGENCY} || {IS_NO_EMERGENCY}");
        self.browser.wait(&is_known);
        if self.browser.value(IS_IN_EMERGENCY) == true {
            self.browser.press("#estop-clear");
            self.browser.press("#clear-yes");
            self.browser.wait(IS_NO_EMERGENCY);
        }
    }

    /// Lets go of everything.
    pub(crate) fn let_go_of_all(&mut self) {
        self.bed
            .display
            .input("keyup w keyup Alt_L keyup Super_L mouseup 1 mouseup 3");
    }

    /// Holds a source so that it drives ahead.
    pub(crate) fn hold(&mut self, source: Source) {
        match source {
            Source::Keys => self.bed.display.input("keydown w"),
            Source::Mouse => {
                let (x, y) = self.on_screen(STICK);
                let display = &self.bed.display;
                display.input(&format!("mousemove {x} {y} mousedown 1"));
                display.input(&format!("mousemove {x} {}", y - 30));
                display.input(&format!("mousemove {x} {}", y - 60));
            }
            Source::Touch => {
                let (x, y) = self.middle(STICK);
                self.touch("touchStart", Some((x, y)));
                self.touch("touchMove", Some((x, y - 30.0)));
                self.touch("touchMove", Some((x, y - 60.0)));
            }
            Source::Gamepad => {
                self.browser.value("test.plug(true)");
                // The page must see it at rest first.
                sleep(Duration::from_millis(200));
                self.browser.value("test.pad(true, 0.9, false)");
            }
        }
    }

    /// Lets go of it.
    pub(crate) fn let_go(&mut self, source: Source) {
        match source {
            Source::Keys => self.bed.display.input("keyup w"),
            Source::Mouse => self.bed.display.input("mouseup 1"),
            Source::Touch => self.touch("touchEnd", None),
            Source::Gamepad => drop(self.browser.value("test.pad(false, 0, false)")),
        }
    }

    /// Holds a source for some time, until the vehicle is driven, with a few attempts: the link may end a drive. Returns
    /// whether it is.
    pub(crate) fn drive(
        &mut self,
        source: Source,
        held: Duration,
        is_driven: impl Fn() -> bool,
    ) -> bool {
        let deadline = Instant::now() + Duration::from_secs(8);
        while Instant::now() < deadline {
            self.hold(source);
            let begun = Instant::now();
            let left = deadline.saturating_duration_since(begun);
            let is_held = || begun.elapsed() >= held && is_driven();
            if within(left.min(Duration::from_secs(3)), is_held) {
                return true;
            }
            self.let_go(source);
            sleep(Duration::from_millis(300));
        }
        false
    }

    /// Lets an event happen to a source that is held. Returns the time of the last sign of life.
    pub(crate) fn happen(&mut self, event: Event, source: Source) -> Instant {
        self.page = match event {
            Event::Release => Page::Intact,
            Event::KilledBrowser => Page::Killed,
            Event::LeftPage | Event::ClosedTab | Event::Alert => Page::Closed,
            _ => Page::Changed,
        };
        let sign = Instant::now();
        match event {
            Event::Release => self.let_go(source),
            Event::Lost => {
                self.browser.value("test.lost = true");
                self.let_go(source);
            }
            Event::ContextMenu => self.open_menu(source),
            Event::LostCapture if source == Source::Gamepad => {
                drop(self.browser.value("test.plug(false)"));
            }
            Event::LostCapture => {
                let release =
                    "document.querySelector('#stick').releasePointerCapture(test.pointer)";
                self.browser.value(release);
            }
            Event::Blur => self.bed.display.input("key F6"),
            Event::Hidden => drop(self.browser.cover_tab()),
            Event::LeftPage => {
                let blank = json!({ "url": "about:blank" });
                self.browser.call("Page.navigate", &blank);
            }
            Event::ClosedTab => self.browser.close_tab(),
            Event::KilledBrowser => {
                self.browser.kill();
            }
            Event::Resize => self.resize(),
            Event::Rotation => self.rotate(),
            Event::AltKey => self.bed.display.input("keydown Alt_L"),
            Event::SuperKey => self.bed.display.input("keydown Super_L"),
            Event::Dialog => drop(self.browser.value(OPEN_DIALOG)),
            Event::Alert => drop(self.browser.value("setTimeout(() => alert('A dialog'))")),
            Event::LeftView => drop(
                self.browser
                    .value("document.querySelector('[data-show=mission]').click()"),
            ),
            Event::OtherSource => match source {
                Source::Keys | Source::Gamepad => self.hold(Source::Mouse),
                Source::Mouse | Source::Touch => self.bed.display.input("keydown w"),
            },
        }
        sign
    }

    /// A key or a button that stops the vehicle at once. Returns the time of it.
    pub(crate) fn stop(&mut self, how: Stop) -> Instant {
        if how != Stop::Escape {
            self.page = Page::Changed;
        }
        let place = (how == Stop::RedButton).then(|| self.on_screen("#estop"));
        let sign = Instant::now();
        match (how, place) {
            (Stop::PadButton, _) => drop(self.browser.value("test.pad(true, 0.9, true)")),
            (_, Some((x, y))) => self
                .bed
                .display
                .input(&format!("mousemove {x} {y} click 1")),
            _ => self.bed.display.input("key Escape"),
        }
        sign
    }

    /// Waits until the page shows the emergency, which is repeated until the vehicle confirms it.
    pub(crate) fn wait_for_emergency(&mut self) {
        self.browser.wait(IS_IN_EMERGENCY);
    }

    /// What the page says about driving; nothing if it is closed.
    pub(crate) fn line(&mut self) -> String {
        match self.page {
            Page::Intact | Page::Changed => self.browser.text(LINE),
            Page::Closed | Page::Killed => String::new(),
        }
    }

    /// Starts a slow mission to the farther one of two destinations, and waits until the motors turn.
    pub(crate) fn start_mission(&mut self) {
        let north = self
            .browser
            .value("parseFloat(document.querySelector('#north').textContent.replace('−', '-'))");
        let destination = if north.as_f64().unwrap_or(0.0) < 0.0 {
            FAR
        } else {
            FAR_BACK
        };
        plan(&mut self.browser, destination, Some(SLOW));
        approve(&mut self.browser);
        let drives = within(Duration::from_secs(30), || self.bed.motors.drive());
        assert!(drives, "the mission drives");
    }

    /// Opens a context menu with the mouse, and lets go under it: on the map, or on the stick if the mouse holds it.
    fn open_menu(&mut self, source: Source) {
        if source == Source::Mouse {
            self.bed.display.input("click 3");
        } else {
            let place = self.browser.value(OF_THE_MAP);
            let place = (place["x"].as_f64().unwrap(), place["y"].as_f64().unwrap());
            let (x, y) = self.on_display(place);
            self.bed
                .display
                .input(&format!("mousemove {x} {y} click 3"));
        }
        sleep(Duration::from_millis(300));
        self.let_go(source);
    }

    /// Gives the window another size than it has, which its next tab keeps.
    fn resize(&mut self) {
        let window = self.browser.call("Browser.getWindowForTarget", &json!({}));
        let width = if window["bounds"]["width"] == 1000 {
            1200
        } else {
            1000
        };
        let bounds =
            json!({ "windowId": window["windowId"], "bounds": { "width": width, "height": 860 } });
        self.browser.call("Browser.setWindowBounds", &bounds);
    }

    fn rotate(&mut self) {
        let turned = json!({ "width": 800, "height": 1180, "deviceScaleFactor": 1, "mobile": true,
            "screenOrientation": { "type": "portraitPrimary", "angle": 90 } });
        self.browser
            .call("Emulation.setDeviceMetricsOverride", &turned);
    }

    fn touch(&mut self, kind: &str, place: Option<(f64, f64)>) {
        let points: Vec<_> = place
            .iter()
            .map(|(x, y)| json!({ "x": x, "y": y }))
            .collect();
        let event = json!({ "type": kind, "touchPoints": points });
        self.browser.call("Input.dispatchTouchEvent", &event);
    }

    /// The middle of an element on the page.
    fn middle(&mut self, selector: &str) -> (f64, f64) {
        let measure =
            format!("document.querySelector('{selector}').getBoundingClientRect().toJSON()");
        let place = self.browser.value(&measure);
        let [x, y, width, height] =
            ["x", "y", "width", "height"].map(|it| place[it].as_f64().unwrap());
        (x + width / 2.0, y + height / 2.0)
    }

    /// The middle of an element on the display.
    fn on_screen(&mut self, selector: &str) -> (i64, i64) {
        let middle = self.middle(selector);
        self.on_display(middle)
    }

    fn on_display(&mut self, (x, y): (f64, f64)) -> (i64, i64) {
        let edges =
            "[screenX + (outerWidth - innerWidth) / 2, screenY + outerHeight - innerHeight]";
        let edges = self.browser.value(edges);
        let edge = |axis: usize| edges[axis].as_f64().unwrap();
        ((x + edge(0)).round() as i64, (y + edge(1)).round() as i64)
    }
}
