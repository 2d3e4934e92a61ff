//! What the page says of a vehicle that is held, stops, and has stopped; and what it says of the past.

use std::process::Command;
use std::time::Duration;

use serde_json::{Value, json};

use super::browser::Browser;
use super::comes_alive;
use super::steps::{look_from_all_screens, take_control};
use super::system::{PAGE, System, program};

/// The speed shown, in metres per second.
const SPEED: &str =
    "Math.abs(parseFloat(document.querySelector('#speed').textContent.replace('−', '-')))";
/// The notices of an ended drive.
const ENDINGS: &str = "[...document.querySelectorAll('#toasts .toast')] \
    .filter(it => it.textContent.includes('Driving ended')).length";

pub(crate) fn run(system: &System, page: &mut Browser) {
    sets_a_zone(system, page);
    take_control(page);
    page.press("[data-show=drive]");
    page.press("#limit [data-limit='1']");
    says_why_the_vehicle_is_held(page);
    says_stopped_only_at_rest(page);
    lists_the_events(page);
    tells_once_why_a_drive_has_ended(page);
}

/// An operating zone that ends 2 m before and behind the vehicle.
fn sets_a_zone(system: &System, page: &mut Browser) {
    page.wait("document.querySelector('#tree').textContent.includes('Knowledge Store')");
    let store = page.value(
        "[...document.querySelectorAll('#tree summary')] \
         .find(it => it.textContent.includes('Knowledge Store')).querySelector('.tree-id').textContent",
    );
    let corner = |x: f64, y: f64| json!({ "X": x, "Y": y });
    let corners = [(-2.0, -2.0), (-2.0, 2.0), (2.0, 2.0), (2.0, -2.0)];
    let corners = corners.map(|(x, y)| corner(x, y));
    let zone = json!({ "LocalOperatingZone": corners, "LocalExclusionZones": [] });
    let sent = Command::new("ip")
        .args(["netns", "exec", system.operator()])
        .arg(program("jaus"))
        .args(["send", store.as_str().unwrap(), "SetLocalOperatingZone"])
        .args([&zone.to_string(), "--control", "10"])
        .output()
        .unwrap();
    assert!(sent.status.success(), "{sent:?}");
    // The station has the zone before the vehicle can reach its edge.
    page.value(
        "(globalThis.zones = 0), (globalThis.asking = new WebSocket(`ws://${location.host}/ws`)), \
         (asking.onmessage = ({ data }) => { \
         globalThis.zones = JSON.parse(data).overlay?.zones.length ?? globalThis.zones; }), \
         setInterval(() => asking.readyState === 1 && \
         asking.send('{\"type\":\"overlay\",\"vehicle\":101}'), 200), 0",
    );
    page.wait("globalThis.zones === 1");
}

fn says_why_the_vehicle_is_held(page: &mut Browser) {
    page.drive(
        |page| page.hold("#stick", (0.0, -0.9)),
        Browser::let_go,
        "!document.querySelector('#held').hidden",
    );
    page.wait("document.querySelector('#held').textContent.includes('the operating zone')");
    page.wait("document.querySelector('#drive-line').textContent.startsWith('Held: ')");
    page.screenshot("8-held");
    page.let_go();
    page.wait("document.querySelector('#held').hidden");
}

/// While the vehicle moves, the button says that it stops, and how fast it still is.
fn says_stopped_only_at_rest(page: &mut Browser) {
    const ATTEMPTS: u32 = 4;
    const STOPPING: &str = "said.some(([text]) => /Stopping[0-9.]+ m\\/s/.test(text))";
    page.value(&format!(
        "(globalThis.said = []), setInterval(() => said.push([document.querySelector('#estop').textContent, \
         {SPEED}]), 20), 0"
    ));
    stops_while_it_drives(page);
    for _ in 1..ATTEMPTS {
        if page.value(STOPPING) == json!(true) {
            break;
        }
        // A busy machine confirms the stop when the vehicle rests already.
        clears_the_emergency(page);
        take_control(page);
        page.press("[data-show=drive]");
        stops_while_it_drives(page);
    }
    let wrong =
        page.value("said.filter(([text, speed]) => text.includes('is stopped') && speed >= 0.1)");
    assert_eq!(wrong, json!([]));
    assert_eq!(page.value(STOPPING), true, "{}", page.value("said"));
    look_from_all_screens(page, "8-stopped");
    clears_the_emergency(page);
}

fn stops_while_it_drives(page: &mut Browser) {
    page.drive(
        |page| page.hold("#stick", (0.0, 0.9)),
        Browser::let_go,
        &format!("{SPEED} > 0.3"),
    );
    page.key_down("Escape", "Escape");
    page.key_up("Escape", "Escape");
    page.wait("document.body.dataset.emergency === 'stopped'");
    page.wait("document.body.dataset.alarm === 'bad'");
    page.let_go();
}

fn clears_the_emergency(page: &mut Browser) {
    page.press("#estop-clear");
    page.press("#clear-yes");
    page.wait("document.body.dataset.emergency === 'ready'");
}

fn lists_the_events(page: &mut Browser) {
    page.press("[data-show=events]");
    let texts = "document.querySelector('#events').textContent";
    for text in [
        "Held: the edge of the operating zone",
        "Emergency stop requested by operator",
        "Emergency is over",
    ] {
        page.wait(&format!("{texts}.includes('{text}')"));
    }
    look_from_all_screens(page, "8-events");
    page.press("[data-show=drive]");
}

/// The page that sees the end of a drive says so once, and a page that is opened later does not.
fn tells_once_why_a_drive_has_ended(page: &mut Browser) {
    take_control(page);
    page.drive(
        |page| page.hold("#stick", (0.0, -0.5)),
        Browser::let_go,
        &format!("{SPEED} > 0.2"),
    );
    page.value("(until => { while (performance.now() < until); })(performance.now() + 900), 0");
    page.wait(&format!("{ENDINGS} === 1"));
    page.let_go();
    page.press("#sound-button");
    page.wait("document.querySelector('#sound-button').ariaPressed === 'true'");
    let again = page.holds_within(Duration::from_secs(1), &format!("{ENDINGS} > 1"));
    assert!(!again, "{}", page.value(ENDINGS));
    page.open(PAGE);
    comes_alive(page);
    let muted = page.value("document.querySelector('#sound-button').ariaPressed");
    assert_eq!(muted, "true", "it is kept on this device");
    let later = page.holds_within(Duration::from_secs(2), &format!("{ENDINGS} > 0"));
    assert!(!later, "{}", Value::from(page.text("#toasts")));
}
