//! Two operators with a page each: one asks the other for control, who refuses and then grants it.

use super::browser::{Browser, SCREENS};
use super::by_hand::Running;
use super::steps::{is_accessible, is_announced, look_from_all_screens, take_control};

/// The number of this test's multicast group.
const TEST: u8 = 4;

/// Starts a station, and a browser that shows its page.
fn operator(id: &str) -> (Running, Browser) {
    let flags = ["--id", id, "--listen", "127.0.0.1:0"];
    let (station, address) = Running::station(TEST, &flags);
    let mut page = Browser::start(None);
    page.look_on(SCREENS[0]);
    page.open(&address);
    page.wait("document.querySelector('#vehicle-name').textContent.includes('G-Bat')");
    (station, page)
}

/// Asks for control, and waits until the other page shows the request.
fn ask(from: &mut Browser, to: &mut Browser) {
    from.wait("document.querySelector('#control-button').textContent === 'Request control'");
    from.press("#control-button");
    from.wait("document.body.dataset.control === 'asking'");
    to.wait(
        "document.querySelector('#handover-text').textContent.includes('43.1.1 requests control')",
    );
    to.wait("!document.querySelector('#handover').hidden");
}

pub(crate) fn run() {
    let vehicle = ["vehicle", "--name", "G-Bat"];
    let (_vehicle, _) = Running::start(TEST, "jaus", &vehicle, "Ctrl-C");
    let (_first_station, mut first) = operator("42.1.1");
    let (_second_station, mut second) = operator("43.1.1");
    take_control(&mut first);

    ask(&mut second, &mut first);
    is_accessible(&mut first, "43.1.1 requests control");
    is_announced(&mut first, "43.1.1 requests control");
    look_from_all_screens(&mut first, "handover-request");
    look_from_all_screens(&mut second, "handover-asking");
    first.wait("!document.querySelector('#handover-no').disabled");
    first.press("#handover-no");
    second.wait("document.querySelector('#toasts').textContent.includes('refused')");
    is_announced(&mut second, "refused");
    second.wait("document.body.dataset.control === 'none'");

    ask(&mut second, &mut first);
    first.wait("!document.querySelector('#handover-yes').disabled");
    first.press("#handover-yes");
    second.wait("document.body.dataset.control === 'held'");
    first.wait("document.body.dataset.control === 'none'");
    first.wait("document.querySelector('#toasts').textContent.includes('handed over to 43.1.1')");
    second.wait("document.querySelector('#state-word').textContent === 'Standby'");
    take_control(&mut second);
    look_from_all_screens(&mut first, "handover-done");
    for page in [&mut first, &mut second] {
        assert!(page.complaints().is_empty(), "{:?}", page.complaints());
    }
}
