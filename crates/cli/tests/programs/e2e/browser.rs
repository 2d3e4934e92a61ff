//! Chromium, controlled through its DevTools protocol over a pipe: it needs no driver program and no
//! port, and runs in a network namespace, headless or on a display. User actions are real input
//! events: touches and key presses.

use std::io::{BufRead, BufReader, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, Command, Stdio};
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use base64::prelude::{BASE64_STANDARD, Engine};
use serde_json::{Value, json};

pub(crate) use super::accessible::Accessible;

/// Number of browsers started: each has its own profile.
static BROWSERS: AtomicU32 = AtomicU32::new(0);
/// Timeout of any wait; reached only when a test fails.
const LIMIT: Duration = Duration::from_secs(60);
/// Polling interval of a condition.
const PERIOD: Duration = Duration::from_millis(50);
const SECOND: Duration = Duration::from_secs(1);
/// How long something may lie over a button.
const COVERED: Duration = Duration::from_secs(6);
/// Delay of a held key's first repeat, and of each further one.
const REPEATS: [Duration; 2] = [Duration::from_millis(250), Duration::from_millis(33)];

/// A screen size and colour scheme for the page.
#[derive(Clone, Copy)]
pub(crate) struct Screen {
    pub(crate) name: &'static str,
    pub(crate) size: (u32, u32),
    pub(crate) dark: bool,
}

/// The supported screens.
pub(crate) const SCREENS: [Screen; 6] = [
    Screen {
        name: "tablet",
        size: (1280, 800),
        dark: false,
    },
    Screen {
        name: "tablet-dark",
        size: (1280, 800),
        dark: true,
    },
    Screen {
        name: "tablet-upright",
        size: (800, 1280),
        dark: false,
    },
    Screen {
        name: "phone",
        size: (390, 844),
        dark: true,
    },
    Screen {
        name: "phone-across",
        size: (844, 390),
        dark: false,
    },
    Screen {
        name: "desktop",
        size: (1920, 1080),
        dark: false,
    },
];

/// Why no browser can be started, if so.
pub(crate) fn missing() -> Option<String> {
    let found = Command::new("chromium").arg("--version").output();
    found.err().map(|error| format!("chromium: {error}"))
}

/// One browser with one page; killed when dropped.
pub(crate) struct Browser {
    child: Child,
    commands: Arc<Mutex<ChildStdin>>,
    said: Receiver<Value>,
    held_key: Option<HeldKey>,
    session: Option<String>,
    /// Id of the controlled tab.
    tab: Value,
    /// Ids of all tabs that were opened here.
    tabs: Vec<Value>,
    number: u64,
    profile: PathBuf,
    complaints: Vec<String>,
    /// Failed connections, which some tests cause.
    failures: Vec<String>,
}

impl Browser {
    /// Starts a headless browser, in a network namespace if one is given.
    pub(crate) fn start(network: Option<&str>) -> Self {
        Self::start_with(network, &["--headless=new"], &[])
    }

    /// Starts a browser with flags and variables of its environment.
    pub(crate) fn start_with(
        network: Option<&str>,
        flags: &[&str],
        environment: &[(&str, &str)],
    ) -> Self {
        let number = BROWSERS.fetch_add(1, Ordering::Relaxed);
        let profile = format!("chromium-{}-{number}", std::process::id());
        let profile = Path::new(env!("CARGO_TARGET_TMPDIR")).join(profile);
        let mut command = match network {
            Some(network) => {
                let mut command = Command::new("ip");
                command.args(["netns", "exec", network, "sh"]);
                command
            }
            None => Command::new("sh"),
        };
        // The browser reads commands from descriptor 3 and answers on descriptor 4.
        command.args([
            "-c",
            "exec chromium \"$@\" 3<&0 4>&1 </dev/null >/dev/null 2>&1",
            "sh",
        ]);
        command.args(flags).envs(environment.iter().copied());
        command.args(["--no-sandbox", "--disable-gpu", "--remote-debugging-pipe"]);
        command.args([
            "--no-first-run",
            "--disable-extensions",
            "--disable-component-update",
            "--disable-background-networking",
        ]);
        command.args(["--disable-dev-shm-usage", "--hide-scrollbars"]);
        // Stations make certificates that no authority knows.
        command.arg("--ignore-certificate-errors");
        command
            .arg(format!("--user-data-dir={}", profile.display()))
            .arg("about:blank");
        let mut child = command
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        let commands = child.stdin.take().unwrap();
        let mut answers = BufReader::new(child.stdout.take().unwrap());
        let (sender, said) = channel();
        std::thread::spawn(move || {
            let mut line = Vec::new();
            while answers.read_until(0, &mut line).is_ok_and(|read| read > 0) {
                line.pop();
                let value = serde_json::from_slice(&line).unwrap();
                line.clear();
                if sender.send(value).is_err() {
                    break;
                }
            }
        });
        let mut browser = Self {
            child,
            commands: Arc::new(Mutex::new(commands)),
            said,
            held_key: None,
            session: None,
            tab: Value::Null,
            tabs: Vec::new(),
            number: 0,
            profile,
            complaints: Vec::new(),
            failures: Vec::new(),
        };
        browser.open_tab();
        browser
    }

    /// Opens a tab in front of the others, and controls it from now on.
    pub(crate) fn open_tab(&mut self) {
        self.tab = self.cover_tab();
        let target = json!({ "targetId": self.tab, "flatten": true });
        let session = self.call_browser("Target.attachToTarget", &target);
        self.session = Some(session["sessionId"].as_str().unwrap().to_owned());
        for domain in ["Runtime", "Log", "Page"] {
            self.call(&format!("{domain}.enable"), &json!({}));
        }
    }

    /// Opens an empty tab in front of the controlled one. Returns its id.
    pub(crate) fn cover_tab(&mut self) -> Value {
        let blank = json!({ "url": "about:blank" });
        let tab = self.call_browser("Target.createTarget", &blank)["targetId"].clone();
        self.tabs.push(tab.clone());
        tab
    }

    /// Closes every tab that was opened here.
    pub(crate) fn close_tabs(&mut self) {
        self.session = None;
        for tab in std::mem::take(&mut self.tabs) {
            // It may be closed already.
            let _ = self.try_call("Target.closeTarget", &json!({ "targetId": tab }));
        }
    }

    /// Closes the controlled tab.
    pub(crate) fn close_tab(&mut self) {
        let tab = json!({ "targetId": self.tab });
        self.call_browser("Target.closeTarget", &tab);
    }

    /// Kills the browser with all its processes.
    pub(crate) fn kill(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }

    /// Sends a command to the browser rather than to the tab.
    #[track_caller]
    fn call_browser(&mut self, method: &str, parameters: &Value) -> Value {
        let session = self.session.take();
        let answer = self.call(method, parameters);
        self.session = session;
        answer
    }

    /// Sends a command and waits for its answer.
    #[track_caller]
    pub(crate) fn call(&mut self, method: &str, parameters: &Value) -> Value {
        let answer = self.try_call(method, parameters);
        answer.unwrap_or_else(|error| panic!("{method}: {error}"))
    }

    /// Like [`Self::call`], but returns the browser's error.
    fn try_call(&mut self, method: &str, parameters: &Value) -> Result<Value, Value> {
        self.number += 1;
        let mut command = json!({ "id": self.number, "method": method, "params": parameters });
        if let Some(session) = &self.session {
            command["sessionId"] = json!(session);
        }
        write(&self.commands, &command);
        loop {
            let said = self.said.recv_timeout(LIMIT);
            let said = said.unwrap_or_else(|e| panic!("{method}: the browser is silent: {e}"));
            if said["id"] == self.number {
                let error = said["error"].clone();
                return if error.is_null() {
                    Ok(said["result"].clone())
                } else {
                    Err(error)
                };
            }
            self.note(&said);
        }
    }

    /// Collects errors of the page, and apart from them failed connections: some tests cause them.
    fn note(&mut self, said: &Value) {
        let parameters = &said["params"];
        match said["method"].as_str() {
            Some("Runtime.exceptionThrown") => self
                .complaints
                .push(parameters["exceptionDetails"].to_string()),
            Some("Log.entryAdded") => {
                let entry = &parameters["entry"];
                let text = entry["text"].as_str().unwrap_or_default();
                if entry["source"] == "network" || text.contains("WebSocket connection to") {
                    let address = entry["url"].as_str().unwrap_or_default();
                    self.failures.push(format!("{text} ({address})"));
                } else {
                    self.complaints.push(text.to_owned());
                }
            }
            _ => {}
        }
    }

    /// The page's errors so far: exceptions and policy violations.
    pub(crate) fn complaints(&mut self) -> &[String] {
        while let Ok(said) = self.said.try_recv() {
            self.note(&said);
        }
        &self.complaints
    }

    /// Switches to a screen size and colour scheme.
    pub(crate) fn look_on(&mut self, screen: Screen) {
        let (width, height) = screen.size;
        let metrics =
            json!({ "width": width, "height": height, "deviceScaleFactor": 1, "mobile": false });
        self.call("Emulation.setDeviceMetricsOverride", &metrics);
        let scheme = if screen.dark { "dark" } else { "light" };
        let features = json!({ "features": [{ "name": "prefers-color-scheme", "value": scheme }] });
        self.call("Emulation.setEmulatedMedia", &features);
    }

    /// Opens an address, as soon as a server answers there.
    pub(crate) fn open(&mut self, address: &str) {
        let deadline = Instant::now() + LIMIT;
        loop {
            let answer = self.call("Page.navigate", &json!({ "url": address }));
            match answer["errorText"].as_str() {
                None => break,
                Some(why) if Instant::now() > deadline => panic!("{address}: {why}"),
                Some(_) => std::thread::sleep(PERIOD),
            }
        }
        self.wait("document.readyState === 'complete'");
    }

    /// Lets the loading of files fail whose addresses match one of these patterns.
    pub(crate) fn withhold(&mut self, patterns: &[&str]) {
        self.call("Network.enable", &json!({}));
        self.call("Network.setBlockedURLs", &json!({ "urls": patterns }));
    }

    /// The value of a JavaScript expression in the page.
    #[track_caller]
    pub(crate) fn value(&mut self, expression: &str) -> Value {
        let value = self.try_value(expression);
        value.unwrap_or_else(|error| panic!("{expression}: {error}"))
    }

    /// Like [`Self::value`], but returns an error: the page may be loading anew.
    fn try_value(&mut self, expression: &str) -> Result<Value, Value> {
        let wanted =
            json!({ "expression": expression, "returnByValue": true, "awaitPromise": true });
        let answer = self.try_call("Runtime.evaluate", &wanted)?;
        match &answer["exceptionDetails"] {
            Value::Null => Ok(answer["result"]["value"].clone()),
            exception => Err(exception.clone()),
        }
    }

    /// Text of the first element that matches a selector.
    #[track_caller]
    pub(crate) fn text(&mut self, selector: &str) -> String {
        let value = self.value(&format!(
            "document.querySelector({})?.textContent ?? ''",
            json!(selector)
        ));
        value.as_str().unwrap_or_default().to_owned()
    }

    /// The nodes of the accessibility tree: what a screen reader knows of the page.
    pub(crate) fn accessibility(&mut self) -> Vec<Accessible> {
        let tree = self.call("Accessibility.getFullAXTree", &json!({}));
        let nodes = tree["nodes"].as_array().unwrap();
        let shown = nodes.iter().filter(|node| node["ignored"] == false);
        shown.map(|node| Accessible::of(node, nodes)).collect()
    }

    /// Waits until an expression is true.
    #[track_caller]
    pub(crate) fn wait(&mut self, expression: &str) {
        assert!(
            self.holds_within(LIMIT, expression),
            "never: {expression}\n{}",
            self.situation()
        );
    }

    /// Whether an expression becomes true within the limit.
    #[track_caller]
    pub(crate) fn holds_within(&mut self, limit: Duration, expression: &str) -> bool {
        let deadline = Instant::now() + limit;
        let expression = format!("Boolean({expression})");
        while self.try_value(&expression) != Ok(Value::Bool(true)) {
            if Instant::now() > deadline {
                return false;
            }
            std::thread::sleep(PERIOD);
        }
        true
    }

    /// The page's text and errors, for the message of a failed test; takes a screenshot.
    fn situation(&mut self) -> String {
        self.screenshot("failed");
        let page = self.value("document.body.innerText.replace(/\\n+/g, ' | ')");
        format!(
            "{}\n{:?}\nconnections that failed: {:?}",
            page.as_str().unwrap_or_default(),
            self.complaints,
            self.failures
        )
    }

    /// Touches the middle of an element, once it is visible and enabled.
    #[track_caller]
    pub(crate) fn press(&mut self, selector: &str) {
        let place = format!("document.querySelector({})", json!(selector));
        self.wait(&format!(
            "{place} && !{place}.disabled && {place}.getClientRects().length"
        ));
        let measure = format!(
            "(() => {{ const e = {place}; e.scrollIntoView({{block: 'nearest'}}); const b = e.getBoundingClientRect(); \
             const [x, y] = [b.x + b.width / 2, b.y + b.height / 2]; \
             const top = document.elementFromPoint(x, y); \
             return {{ x, y, free: e === top || e.contains(top) }}; }})()"
        );
        // What the state shows and hides beside a button moves it, and a notice may lie over it for a while: a hand waits
        // until it rests and is free.
        let mut middle = self.value(&measure);
        // Nothing may lie over a stop.
        let is_stop = selector.starts_with("#estop");
        let patience = if is_stop { SECOND } else { COVERED };
        let deadline = Instant::now() + patience;
        while Instant::now() < deadline {
            std::thread::sleep(PERIOD);
            let before = std::mem::replace(&mut middle, self.value(&measure));
            if before == middle && middle["free"] == true {
                break;
            }
        }
        assert_eq!(
            middle["free"], true,
            "{selector} is covered or not on the screen"
        );
        self.touch(middle["x"].as_f64().unwrap(), middle["y"].as_f64().unwrap());
    }

    /// Touches a point of the screen.
    pub(crate) fn touch(&mut self, x: f64, y: f64) {
        for kind in ["mousePressed", "mouseReleased"] {
            let event = json!({ "type": kind, "x": x, "y": y, "button": "left", "clickCount": 1 });
            self.call("Input.dispatchMouseEvent", &event);
        }
    }

    /// Puts a finger on the middle of an element and drags it by fractions of half its size to the
    /// right and down; the finger stays there.
    #[track_caller]
    pub(crate) fn hold(&mut self, selector: &str, (right, down): (f64, f64)) {
        let place = format!(
            "document.querySelector({}).getBoundingClientRect()",
            json!(selector)
        );
        let place = self.value(&format!("{place}.toJSON()"));
        let [left, top, width, height] =
            ["x", "y", "width", "height"].map(|it| place[it].as_f64().unwrap());
        let (x, y) = (left + width / 2.0, top + height / 2.0);
        let down_here =
            json!({ "type": "mousePressed", "x": x, "y": y, "button": "left", "clickCount": 1 });
        self.call("Input.dispatchMouseEvent", &down_here);
        let (x, y) = (x + right * width / 2.0, y + down * height / 2.0);
        let there = json!({ "type": "mouseMoved", "x": x, "y": y, "button": "left", "buttons": 1 });
        self.call("Input.dispatchMouseEvent", &there);
    }

    /// Lifts the finger.
    pub(crate) fn let_go(&mut self) {
        let event =
            json!({ "type": "mouseReleased", "x": 1, "y": 1, "button": "left", "clickCount": 1 });
        self.call("Input.dispatchMouseEvent", &event);
    }

    /// Writes text into a field.
    #[track_caller]
    pub(crate) fn write(&mut self, selector: &str, text: &str) {
        let field = json!(selector);
        self.value(&format!(
            "document.querySelector({field}).focus(); document.querySelector({field}).select()"
        ));
        self.call("Input.insertText", &json!({ "text": text }));
        self.value("document.activeElement.blur()");
    }

    /// Presses and releases a key while Shift is held.
    pub(crate) fn shift_key(&mut self, code: &str, key: &str) {
        for kind in ["keyDown", "keyUp"] {
            let event = json!({ "type": kind, "code": code, "key": key, "modifiers": 8 });
            self.call("Input.dispatchKeyEvent", &event);
        }
    }

    /// Moves the focus to the next control.
    pub(crate) fn tab(&mut self) {
        for kind in ["rawKeyDown", "keyUp"] {
            let event =
                json!({ "type": kind, "code": "Tab", "key": "Tab", "windowsVirtualKeyCode": 9 });
            self.call("Input.dispatchKeyEvent", &event);
        }
    }

    /// Types text into the focused field, key by key.
    pub(crate) fn type_keys(&mut self, text: &str) {
        for letter in text.chars() {
            let key = letter.to_string();
            let down = json!({ "type": "keyDown", "key": key, "text": key });
            self.call("Input.dispatchKeyEvent", &down);
            let up = json!({ "type": "keyUp", "key": key });
            self.call("Input.dispatchKeyEvent", &up);
        }
    }

    /// Presses Enter on the focused element, as a browser's own keyboard would.
    pub(crate) fn enter(&mut self) {
        let text = json!({ "type": "keyDown", "code": "Enter", "key": "Enter", "text": "\r",
            "windowsVirtualKeyCode": 13 });
        self.call("Input.dispatchKeyEvent", &text);
        self.key_up("Enter", "Enter");
    }

    /// Presses a key and keeps it down: the page gets its repeats, as from a keyboard.
    pub(crate) fn hold_key(&mut self, code: &str, key: &str) {
        self.key_down(code, key);
        let (stop, stopped) = channel();
        let (commands, session) = (Arc::clone(&self.commands), self.session.clone());
        // No call waits for the answers: no call has the number 0.
        let repeat = json!({ "id": 0, "sessionId": session, "method": "Input.dispatchKeyEvent",
            "params": { "type": "keyDown", "code": code, "key": key, "autoRepeat": true } });
        let thread = std::thread::spawn(move || {
            let [mut delay, next] = REPEATS;
            while stopped.recv_timeout(delay) == Err(RecvTimeoutError::Timeout) {
                write(&commands, &repeat);
                delay = next;
            }
        });
        self.held_key = Some(HeldKey { stop, thread });
    }

    /// Holds a key until the page says that it drives and the vehicle moves as fast as this, in metres per
    /// second.
    #[track_caller]
    pub(crate) fn drive_by_key(&mut self, (code, key): (&str, &str), speed: f64) {
        let moves = format!(
            "document.querySelector('#drive-line').textContent.includes('commands are being sent') \
             && parseFloat(document.querySelector('#speed').textContent) > {speed}"
        );
        self.drive(
            |page| page.hold_key(code, key),
            |page| page.let_go_of_key(code, key),
            &moves,
        );
    }

    /// Takes something up until an expression is true. A busy machine may end the drive before: then the
    /// operator lets go and takes it up again.
    #[track_caller]
    pub(crate) fn drive(
        &mut self,
        take_up: impl Fn(&mut Self),
        let_go: impl Fn(&mut Self),
        moves: &str,
    ) {
        const ATTEMPTS: u32 = 4;
        for _ in 1..ATTEMPTS {
            take_up(self);
            if self.holds_within(LIMIT / 10, moves) {
                return;
            }
            let_go(self);
        }
        take_up(self);
        self.wait(moves);
    }

    /// Lets go of the key that is held.
    pub(crate) fn let_go_of_key(&mut self, code: &str, key: &str) {
        self.stop_repeats();
        self.key_up(code, key);
    }

    /// The key that is held repeats no more, and nobody tells the page that it was let go.
    pub(crate) fn stop_repeats(&mut self) {
        if let Some(HeldKey { stop, thread }) = self.held_key.take() {
            drop(stop);
            thread.join().unwrap();
        }
    }

    pub(crate) fn key_down(&mut self, code: &str, key: &str) {
        self.call(
            "Input.dispatchKeyEvent",
            &json!({ "type": "keyDown", "code": code, "key": key }),
        );
    }

    pub(crate) fn key_up(&mut self, code: &str, key: &str) {
        self.call(
            "Input.dispatchKeyEvent",
            &json!({ "type": "keyUp", "code": code, "key": key }),
        );
    }

    /// Shows text as on a terminal.
    pub(crate) fn show_terminal(&mut self, text: &str) {
        self.value(&format!(
            "document.body.style.cssText = 'margin: 0; padding: 16px; background: #1e2127; color: #e6e6e6'; \
             document.body.append(Object.assign(document.createElement('pre'), {{ textContent: {} }})); \
             document.querySelector('pre').style.cssText = 'margin: 0; font: 15px/20px \"DejaVu Sans Mono\", monospace'",
            json!(text)
        ));
    }

    /// Saves a screenshot in `target/e2e-screenshots`.
    pub(crate) fn screenshot(&mut self, name: &str) {
        // While the page resizes, no screenshot is possible.
        let png = json!({ "format": "png" });
        let mut shots = (0..20).map(|_| {
            std::thread::sleep(PERIOD);
            self.try_call("Page.captureScreenshot", &png)
        });
        let shot = shots.find_map(Result::ok).expect("a picture of the page");
        let directory = Path::new(env!("CARGO_TARGET_TMPDIR")).with_file_name("e2e-screenshots");
        std::fs::create_dir_all(&directory).unwrap();
        let octets = BASE64_STANDARD
            .decode(shot["data"].as_str().unwrap())
            .unwrap();
        std::fs::write(directory.join(name).with_extension("png"), octets).unwrap();
    }
}

/// A key that is held: a thread repeats it.
struct HeldKey {
    stop: Sender<()>,
    thread: JoinHandle<()>,
}

/// Writes a command to the browser.
fn write(commands: &Mutex<ChildStdin>, command: &Value) {
    let mut octets = command.to_string().into_bytes();
    octets.push(0);
    commands.lock().unwrap().write_all(&octets).unwrap();
}

impl Drop for Browser {
    fn drop(&mut self) {
        self.stop_repeats();
        let _ = self.child.kill();
        let _ = self.child.wait();
        let _ = std::fs::remove_dir_all(&self.profile);
    }
}
