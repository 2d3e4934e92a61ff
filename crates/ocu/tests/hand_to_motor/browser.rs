//! The browser: a process of `node` that runs the page's own JavaScript, in lock-step. Each thread of
//! the test has one, for all pages of all its trials.

use std::cell::RefCell;
use std::io::{BufRead, BufReader, Write};
use std::path::Path;
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};

use serde_json::{Value, json};

/// What the station wants to be shown by those who may drive.
pub(crate) const TOKEN: &str = "the-token-of-this-simulation";

struct Browser {
    process: Child,
    input: ChildStdin,
    output: BufReader<ChildStdout>,
}

thread_local! {
    static BROWSER: RefCell<Option<Browser>> = const { RefCell::new(None) };
}

/// What to do with a tab.
#[derive(Clone, Copy)]
pub(crate) enum Load {
    /// Go on.
    No,
    /// Load the page again, as the user does.
    Again,
    /// Open the page in a new tab.
    New,
}

/// What a page has done until a time, and when it wants to be called again, in milliseconds of its
/// clock.
pub(crate) struct Deeds {
    pub(crate) out: Vec<Value>,
    pub(crate) next: Option<f64>,
    pub(crate) view: Value,
}

/// What a page learns of first after it stood still.
#[derive(Clone, Copy)]
pub(crate) enum Thaw {
    /// It did not stand still.
    No,
    Timers,
    Events,
}

/// Lets a page live until `now` in milliseconds of its clock, and then brings it the events.
///
/// # Panics
/// If `node` does not run, or the page's code throws.
pub(crate) fn run(page: usize, now: f64, load: Load, thaw: Thaw, events: &[Value]) -> Deeds {
    let open = match load {
        Load::No => json!(false),
        Load::Again => json!("again"),
        Load::New => json!("new"),
    };
    let thaws = match thaw {
        Thaw::No => "",
        Thaw::Timers => "timers",
        Thaw::Events => "events",
    };
    let order = json!({"page": page, "now": now, "open": open, "thaws": thaws, "events": events});
    let mut answer =
        BROWSER.with_borrow_mut(|browser| browser.get_or_insert_with(Browser::start).ask(&order));
    if let Some(error) = answer["error"].as_str() {
        BROWSER.with_borrow_mut(|browser| *browser = None);
        panic!("the page fails: {error}\nafter {order}");
    }
    let Value::Array(out) = answer["out"].take() else {
        panic!("no answer of the page: {answer}");
    };
    Deeds {
        out,
        next: answer["next"].as_f64(),
        view: answer["view"].take(),
    }
}

impl Browser {
    fn start() -> Self {
        let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/hand_to_motor/browser");
        let mut process = Command::new("node")
            .args(["--experimental-vm-modules", "--no-warnings"])
            .arg(script.join("browser.mjs"))
            .arg(TOKEN)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .expect("node: install nodejs");
        Self {
            input: process.stdin.take().expect("piped"),
            output: BufReader::new(process.stdout.take().expect("piped")),
            process,
        }
    }

    fn ask(&mut self, order: &Value) -> Value {
        let written = self.input.write_all(format!("{order}\n").as_bytes());
        let mut line = String::new();
        let read = written.and_then(|()| self.output.read_line(&mut line));
        match read {
            Ok(octets) if octets > 0 => serde_json::from_str(&line).expect("JSON"),
            _ => json!({"error": "node has ended"}),
        }
    }
}

impl Drop for Browser {
    fn drop(&mut self) {
        // It may have ended already.
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}
