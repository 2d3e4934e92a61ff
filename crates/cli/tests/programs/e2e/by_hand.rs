//! Manual driving: the page and its station with the simulated vehicle of `jaus vehicle`, all on
//! this host.

use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

use super::browser::{Browser, SCREENS};
use super::steps::{
    emergency, every_control_has_a_name, is_announced, look_from, look_from_all_screens,
    take_control,
};
use super::system::program;

/// The number of this test's multicast group.
const TEST: u8 = 2;

/// What stations keep is the tests' own, and not the user's.
fn state_folder() -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("e2e-state");
    std::fs::create_dir_all(&folder).unwrap();
    folder
}

/// A process; killed when dropped.
pub(crate) struct Running(Child);

impl Running {
    /// Starts a program on a test's own multicast group, 239.255.77.`test`, and waits for a line that
    /// contains `beginning`. Returns the trimmed rest of that line.
    pub(crate) fn start(test: u8, name: &str, flags: &[&str], beginning: &str) -> (Self, String) {
        let group = Self::group(test);
        let mut command = Command::new(program(name));
        command.args(flags).args(["--loopback", "--group", &group]);
        command.env("STATE_DIRECTORY", state_folder());
        let mut child = command
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let (stdout, stderr) = (child.stdout.take().unwrap(), child.stderr.take().unwrap());
        let (sender, lines) = std::sync::mpsc::channel();
        let read = |source: Box<dyn std::io::Read + Send>| {
            let sender = sender.clone();
            std::thread::spawn(move || {
                // The program may keep printing after the reader is gone.
                for line in BufReader::new(source).lines().map_while(Result::ok) {
                    let _ = sender.send(line);
                }
            })
        };
        read(Box::new(stdout));
        read(Box::new(stderr));
        drop(sender);
        let running = Self(child);
        let found = lines
            .iter()
            .find_map(|line| Some(line.split_once(beginning)?.1.trim().to_owned()));
        (
            running,
            found.unwrap_or_else(|| panic!("{name} did not say `{beginning}`")),
        )
    }
}

impl Running {
    /// Starts a station. Returns the address that its operator opens, with the token.
    pub(crate) fn station(test: u8, flags: &[&str]) -> (Self, String) {
        Self::start(test, "jaus-ocu", flags, "to control vehicles, open ")
    }

    /// The multicast group of a test.
    pub(crate) fn group(test: u8) -> String {
        let port = 20_000 + std::process::id() % 40_000;
        format!("239.255.77.{test}:{port}")
    }

    /// Suspends the program (SIGSTOP) or resumes it (SIGCONT).
    fn suspend(&self, on: bool) {
        let signal = if on { "-STOP" } else { "-CONT" };
        let pid = self.0.id().to_string();
        let sent = Command::new("kill").args([signal, &pid]).status();
        assert!(sent.unwrap().success());
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// Takes control, drives with keys and the stick, and stops in an emergency. Then checks the page
/// when the station is lost, and that the page connects to the next station.
pub(crate) fn run() {
    let (vehicle, _) = Running::start(TEST, "jaus", &["vehicle", "--name", "G-Bat"], "Ctrl-C");
    let (station, address) = Running::station(TEST, &["--listen", "127.0.0.1:0"]);
    let mut page = Browser::start(None);
    page.look_on(SCREENS[0]);
    page.open(&address);
    page.wait("document.body.dataset.link === 'live'");
    page.wait("document.querySelector('#vehicle-name').textContent.includes('G-Bat')");
    one_button_leads_from_arrival_to_driving(&mut page);
    every_view_is_accessible(&mut page);
    shows_the_state_in_the_tree(&mut page, "ready");
    page.drive_by_key(("ArrowUp", "ArrowUp"), 0.1);
    page.screenshot("by-hand-keys");
    page.let_go_of_key("ArrowUp", "ArrowUp");
    page.wait("Math.abs(parseFloat(document.querySelector('#speed').textContent)) < 0.05");

    page.drive(
        |page| page.hold("#stick", (0.0, -0.6)),
        Browser::let_go,
        "parseFloat(document.querySelector('#speed').textContent) > 0.1",
    );
    page.screenshot("by-hand-stick");
    page.key_down("Escape", "Escape");
    page.wait("document.body.dataset.emergency === 'stopped'");
    page.wait("document.querySelector('#drive-source').textContent === 'Idle'");
    page.let_go();
    emergency(&mut page);

    // The next station has the same token, so the page is trusted again.
    let (place, _) = address.split_once("/#token=").unwrap();
    let (_, listen) = place.split_once("http://").unwrap();
    drop(station);
    page.wait("document.body.dataset.link === 'lost'");
    page.screenshot("by-hand-lost");
    is_announced(&mut page, "No connection");
    let (_station, _) = Running::station(TEST, &["--listen", listen]);
    page.wait("document.body.dataset.link === 'live'");
    take_control(&mut page);
    refuses_to_drive_without_news(&mut page, &vehicle);
    names_what_is_gone(&mut page, vehicle);
    assert!(page.complaints().is_empty(), "{:?}", page.complaints());
}

/// The button takes control, resumes, and gives the stick the focus. Its notice lets touches of the
/// map through.
fn one_button_leads_from_arrival_to_driving(page: &mut Browser) {
    look_from_all_screens(page, "by-hand-arrival");
    page.press("#by-hand");
    page.wait("document.activeElement.id === 'stick'");
    assert_eq!(page.text("#state-word"), "Ready");
    assert_eq!(page.value("document.body.dataset.control"), "held");
    assert_eq!(page.value("document.body.dataset.view"), "drive");
    page.wait("document.querySelector('#by-hand').hidden");
    let under_notice = "(() => { const b = document.querySelector('.toast p').getBoundingClientRect(); \
        return document.elementFromPoint(b.x + 5, b.y + 5).id; })()";
    assert_eq!(page.value(under_notice), "map");
    look_from_all_screens(page, "by-hand-ready");
}

/// On every view each control has a name, and changes of the state are announced.
fn every_view_is_accessible(page: &mut Browser) {
    for view in ["vehicles", "system", "messages", "mission", "drive"] {
        page.press(&format!("[data-show={view}]"));
        every_control_has_a_name(&page.accessibility());
        for text in ["Ready", "Live", "control: you"] {
            is_announced(page, text);
        }
    }
}

/// The tree of components shows the state of the vehicle's only one.
fn shows_the_state_in_the_tree(page: &mut Browser, state: &str) {
    page.wait(&format!(
        "document.querySelector('#tree [data-key=\"c101.1.1\"]')?.dataset.state === '{state}'"
    ));
}

/// While the vehicle is suspended, all values on the page are stale: the page says so and does not
/// drive.
fn refuses_to_drive_without_news(page: &mut Browser, vehicle: &Running) {
    for screen in SCREENS {
        // A change of size ends a drive.
        page.look_on(screen);
        page.drive_by_key(("ArrowUp", "ArrowUp"), 0.1);
        look_from(page, screen, "by-hand-driving");
        page.let_go_of_key("ArrowUp", "ArrowUp");
    }
    page.look_on(SCREENS[0]);
    page.drive_by_key(("ArrowUp", "ArrowUp"), 0.1);
    vehicle.suspend(true);
    page.wait("document.querySelector('#drive-line').textContent.includes('picture is stale')");
    page.wait("document.querySelector('#drive-source').textContent === 'Idle'");
    page.let_go_of_key("ArrowUp", "ArrowUp");
    page.key_down("ArrowUp", "ArrowUp");
    page.key_up("ArrowUp", "ArrowUp");
    assert_eq!(page.text("#drive-source"), "Idle");
    page.wait("document.querySelector('#speed').closest('[data-old]')");
    page.wait("document.querySelector('#state-old').textContent.includes('velocity')");
    page.wait("document.querySelector('#missing').textContent.includes('silent')");
    look_from_all_screens(page, "by-hand-stale");
    vehicle.suspend(false);
    page.wait("document.querySelector('#missing').hidden");
    page.wait("document.querySelector('#state-old').textContent === ''");
}

fn names_what_is_gone(page: &mut Browser, vehicle: Running) {
    drop(vehicle);
    page.wait(
        "/^Primitive Driver [0-9.]+ is gone$/.test(document.querySelector('#missing').textContent)",
    );
    page.wait("document.querySelector('#drive-line').textContent.includes('is gone')");
    shows_the_state_in_the_tree(page, "gone");
    is_announced(page, "is gone");
    page.press("[data-show=system]");
    page.screenshot("by-hand-tree-gone");
    look_from_all_screens(page, "by-hand-gone");
}
