//! End-to-end tests through the operator's page: real programs as processes on four hosts with two
//! networks, and a real browser with user input. Screenshots of the page are kept in
//! `target/e2e-screenshots`.
//!
//! They need Chromium and network namespaces. Without these, the tests report this prominently and
//! pass, but fail if `JAUS_EVIDENCE=required` is set.

mod accessible;
mod base_map;
pub(crate) mod browser;
mod by_hand;
mod fleet;
mod handover;
mod input;
mod keyboard;
mod pictures;
mod steps;
mod stranger;
pub(crate) mod system;
mod truth;
#[cfg(feature = "https")]
mod users;
mod watching;

use std::time::Duration;

use jaus_test_kit::evidence::{not_tested, this_test};
use jaus_test_kit::hosts::on_hosts;

use self::browser::{Browser, SCREENS};
use self::steps::{emergency, look_from_all_screens, take_control};
use self::system::{PAGE, System};

/// Destinations beyond the obstacles of the demo map, in metres north and east of the origin.
pub(crate) const FAR: (f64, f64) = (4.5, 1.5);
pub(crate) const FAR_BACK: (f64, f64) = (-4.5, -1.5);
/// Speed of missions that a test ends on the way, in m/s: no machine is too slow to do so before they arrive.
pub(crate) const SLOW: f64 = 0.2;

#[test]
fn a_mission_through_the_page_ends_by_the_death_of_the_planner_and_by_a_key() {
    on_system(|system, page| {
        look_from_all_screens(page, "1-start");

        take_control(page);
        plan(page, FAR, Some(SLOW));
        look_from_all_screens(page, "2-approval");
        approve(page);
        page.wait("+document.querySelector('#progress').ariaValueNow > 0");
        look_from_all_screens(page, "3-driving");

        says_that_the_planner_is_gone(system, page);
        take_control(page);
        plan(page, FAR, Some(SLOW));
        approve(page);

        says_that_the_planner_has_restarted(system, page);
        take_control(page);
        plan(page, FAR, Some(SLOW));
        approve(page);

        take_over_by_keyboard(page);
        emergency(page);

        says_when_the_emergency_of_a_mission_is_cleared(page);
        shows_no_position_without_a_driver(system, page);
        says_cleared_only_after_a_reported_emergency(page);
    });
}

#[test]
fn a_mission_through_the_page_survives_the_death_of_every_part() {
    on_system(|system, page| {
        take_control(page);
        for program in system.programs() {
            system.kill(program);
            if program != "jaus-ocu" {
                page.wait("!document.querySelector('#missing').hidden");
            }
            page.screenshot(&format!("5-without-{program}"));
            system.start(program);
            comes_alive(page);
        }
        arrive(page);
        look_from_all_screens(page, "6-arrived");
    });
}

#[test]
fn a_vehicle_is_driven_by_hand_through_the_page_and_stopped_at_once() {
    on_a_station(by_hand::run);
}

#[test]
fn only_an_input_that_proves_itself_drives_and_each_event_ends_it() {
    on_a_station(input::run);
}

#[test]
fn an_operator_chooses_among_vehicles_and_stops_all_of_them() {
    on_a_station(fleet::run);
}

#[test]
fn control_is_handed_over_between_the_pages_of_two_operators() {
    on_a_station(handover::run);
}

#[test]
fn a_page_without_the_token_asks_for_it_or_where_it_may_look_stops_the_vehicle() {
    on_a_station(watching::run);
}

#[test]
fn a_program_that_takes_the_port_of_the_page_gets_no_token_and_is_not_believed() {
    on_a_station(stranger::run);
}

#[cfg(feature = "https")]
#[test]
fn users_log_in_over_https_and_do_what_their_roles_allow() {
    on_a_station(users::run);
}

#[test]
fn tiles_of_a_map_file_lie_where_they_belong_behind_the_vehicle() {
    on_a_station(base_map::pictures);
}

#[test]
fn vector_tiles_show_water_land_and_buildings_and_a_damaged_one_is_named() {
    on_a_station(base_map::vectors);
}

#[test]
fn without_a_global_pose_the_page_says_why_there_is_no_geographic_map() {
    on_a_station(base_map::local_only);
}

#[test]
fn a_mission_is_planned_driven_and_stopped_by_keyboard_alone() {
    on_system(keyboard::run);
}

#[test]
fn the_page_says_why_a_vehicle_is_held_and_that_it_has_stopped_only_when_it_has() {
    on_system(truth::run);
}

#[test]
fn a_picture_of_the_monitor_is_taken_for_the_documentation() {
    on_a_station(pictures::monitor);
}

/// Runs a test that starts its own vehicles and stations.
fn on_a_station(body: impl FnOnce()) {
    if let Some(reason) = browser::missing() {
        return not_tested(&this_test(), &reason);
    }
    if !system::program("jaus-ocu").exists() {
        return not_tested(&this_test(), "not built: jaus-ocu");
    }
    body();
}

/// Runs the body of a test with a complete system and its operator's page.
fn on_system(body: impl FnOnce(&System, &mut Browser)) {
    if let Some(reason) = browser::missing() {
        return not_tested(&this_test(), &reason);
    }
    let missing = system::missing();
    if !missing.is_empty() {
        return not_tested(&this_test(), &format!("not built: {}", missing.join(", ")));
    }
    on_hosts(System::new, |system| {
        system.start_all();
        let mut page = Browser::start(Some(system.operator()));
        page.look_on(SCREENS[0]);
        page.open(PAGE);
        comes_alive(&mut page);
        body(system, &mut page);
        assert!(page.complaints().is_empty(), "{:?}", page.complaints());
    });
}

/// Waits until the page has connected by itself and shows a complete vehicle.
fn comes_alive(page: &mut Browser) {
    page.wait("document.body.dataset.link === 'live'");
    page.wait("document.querySelectorAll('#parts .part').length >= 4");
    page.wait("document.querySelector('#north').textContent !== '–'");
    page.wait("document.querySelector('#map-empty').hidden");
    page.wait("document.querySelector('#missing').hidden");
}

/// Touches the map, corrects the destination by hand, and waits for a route.
pub(crate) fn plan(page: &mut Browser, (north, east): (f64, f64), speed: Option<f64>) {
    page.press("[data-show=mission]");
    page.press("#map");
    page.wait("document.querySelector('#destination-x').value !== ''");
    page.write("#destination-x", &north.to_string());
    page.write("#destination-y", &east.to_string());
    if let Some(speed) = speed {
        page.write("#destination-speed", &speed.to_string());
    }
    // Right after control is taken the planner may not be ready. The page then says so, and the
    // operator presses again.
    let planned = "!document.querySelector('#approve').disabled";
    page.press("#plan");
    if !page.holds_within(Duration::from_secs(5), planned) {
        page.press("#plan");
    }
    page.wait(planned);
}

pub(crate) fn approve(page: &mut Browser) {
    page.press("#approve");
    page.wait(
        "document.querySelector('#stages [aria-current] .stage-name')?.textContent === 'Driving'",
    );
}

/// When a planner dies while driving, the page names it and the station stops the vehicle.
fn says_that_the_planner_is_gone(system: &System, page: &mut Browser) {
    system.kill("jaus-planner");
    let line = "document.querySelector('#mission-line').textContent";
    page.wait(&format!("/planner [0-9.]+ is (gone|silent)/.test({line})"));
    page.wait(&format!("{line}.includes('was stopped')"));
    page.wait("document.querySelector('#missing').textContent.includes('Planner')");
    look_from_all_screens(page, "3-planner-gone");
    page.wait("Math.abs(parseFloat(document.querySelector('#speed').textContent)) < 0.05");
    system.start("jaus-planner");
    comes_alive(page);
}

/// A planner that is killed while it drives and is back at once is another one: the vehicle stops,
/// and the page says why.
fn says_that_the_planner_has_restarted(system: &System, page: &mut Browser) {
    page.wait("Math.abs(parseFloat(document.querySelector('#speed').textContent)) > 0.1");
    system.kill("jaus-planner");
    system.start("jaus-planner");
    let rests = "Math.abs(parseFloat(document.querySelector('#speed').textContent)) < 0.05";
    assert!(
        page.holds_within(Duration::from_secs(2), rests),
        "it drives on"
    );
    let line = "document.querySelector('#mission-line').textContent";
    page.wait(&format!(
        "/planner [0-9.]+ restarted while it drove. The vehicle was stopped/.test({line})"
    ));
    page.wait(
        "document.querySelector('#missing').textContent.includes('restarted while it drove')",
    );
    look_from_all_screens(page, "3-planner-restarted");
}

/// Keys leave a mission alone, in every view. After *Take over* holding a key drives the vehicle, and releasing
/// it stops it.
fn take_over_by_keyboard(page: &mut Browser) {
    for view in ["system", "drive"] {
        page.press(&format!("[data-show={view}]"));
        page.hold_key("ArrowDown", "ArrowDown");
        std::thread::sleep(Duration::from_secs(1));
        assert_eq!(page.text("#drive-source"), "Idle", "in the view {view}");
        assert_eq!(page.value("document.body.dataset.mission"), "under-way");
        page.let_go_of_key("ArrowDown", "ArrowDown");
    }
    page.wait("document.querySelector('#drive-line').textContent.includes('Take over')");
    look_from_all_screens(page, "4-take-over");
    page.press("#take-over");
    page.wait("document.body.dataset.mission === 'over'");
    page.wait("document.querySelector('#drive-line').textContent.startsWith('Ready')");
    page.drive_by_key(("KeyW", "w"), 0.3);
    page.screenshot("4-keyboard");
    page.let_go_of_key("KeyW", "w");
    page.wait("document.querySelector('#drive-source').textContent === 'Idle'");
    page.wait("Math.abs(parseFloat(document.querySelector('#speed').textContent)) < 0.05");
}

/// An emergency ends a mission, which the page says until it is cleared.
fn says_when_the_emergency_of_a_mission_is_cleared(page: &mut Browser) {
    plan(page, FAR_BACK, Some(SLOW));
    approve(page);
    page.key_down("Escape", "Escape");
    page.key_up("Escape", "Escape");
    let line = "document.querySelector('#mission-line').textContent";
    page.wait(&format!("/^(Stopped|Failed): .*emergency/.test({line})"));
    let reason = page.text("#mission-line");
    assert!(!reason.contains("cleared"), "{reason}");
    page.press("#estop-clear");
    page.press("#clear-yes");
    page.wait("document.body.dataset.emergency === 'ready'");
    page.wait(&format!("{line}.includes('the emergency is cleared')"));
    assert!(!page.text("#mission-line").contains(&reason));
}

/// The planner may report the end of a mission before the vehicle has reported its emergency.
fn says_cleared_only_after_a_reported_emergency(page: &mut Browser) {
    let said = page.value(
        "import('/mission.js').then(({ Mission }) => { \
         const mission = new Mission(() => {}, {}); \
         const said = (stage, emergency) => { \
             const reason = 'emergency of 101.1.33'; \
             mission.update({ mission: { mission: 9, stage, reason }, vehicle: { emergency } }, true); \
             return document.querySelector('#mission-line').textContent.includes('cleared'); }; \
         said('driving', false); \
         return [said('stopped', false), said('stopped', true), said('stopped', false)]; })",
    );
    assert_eq!(said, serde_json::json!([false, false, true]));
}

/// While the primitive driver is dead, the page shows the last position as old or none, and never
/// one that nobody has reported.
fn shows_no_position_without_a_driver(system: &System, page: &mut Browser) {
    let at = ["north", "east"].map(|id| page.text(&format!("#{id}")));
    assert!(at.iter().all(|it| it != "0.00"), "{at:?}");
    page.value(
        "(globalThis.seen = []), setInterval(() => seen.push(['north', 'east', 'heading'] \
         .map(id => document.getElementById(id).textContent).join(' ')), 10), 0",
    );
    system.kill("jaus-primitive-driver");
    page.wait("document.querySelector('#missing').textContent.includes('Primitive Driver')");
    page.wait("document.querySelector('#north').closest('[data-old]')");
    page.screenshot("7-without-driver");
    let wrong = page.value("seen.filter(it => it.includes('0.00')).slice(0, 5)");
    assert_eq!(wrong, serde_json::json!([]), "from {at:?}");
    system.start("jaus-primitive-driver");
    comes_alive(page);
    let wrong = page.value("seen.filter(it => it.includes('0.00')).slice(0, 5)");
    assert_eq!(wrong, serde_json::json!([]), "from {at:?}");
}

/// Drives a mission to its end.
fn arrive(page: &mut Browser) {
    take_control(page);
    plan(page, FAR_BACK, None);
    approve(page);
    page.wait("document.querySelector('#mission-line').dataset.state === 'arrived'");
}
