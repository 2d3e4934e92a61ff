//! Handwritten expectations for the generated state machines and the dynamic ones: a state, an
//! event, the guards that hold, the actions and the new state.

use super::recorder::{Generated, Recorder, dynamic, run_at, step, stimulus};
use crate::codec::machine::Outcome::{self, Handled, Ignored, Rejected};
use crate::messages::core::{access_control, events, management};

/// State, event, guards that hold: outcome, actions, new state (`""` if unchanged).
type Row<'r> = (
    &'r str,
    &'r str,
    &'r [&'r str],
    Outcome,
    &'r [&'r str],
    &'r str,
);

/// Both kinds of state machine must do what the rows say. Paths are those within `Receiving`.
fn check<G: Generated>(rows: &[Row<'_>]) {
    let machine = dynamic(G::URN);
    for &(from, event, holds, outcome, actions, to) in rows {
        let from = format!("Receiving.{from}");
        let to = match to {
            "" => from.clone(),
            to => format!("Receiving.{to}"),
        };
        let recorder = || Recorder {
            holds: holds.iter().map(|&it| it.to_owned()).collect(),
            done: Vec::new(),
        };
        let row = format!("{event} in {from} with {holds:?}");

        let mut recorded = recorder();
        let mut generated = G::within(&from).expect("a state");
        assert_eq!(generated.hear(event, &mut recorded), outcome, "{row}");
        assert_eq!(recorded.done, actions, "{row}");
        assert_eq!(generated.path(), to, "{row}");

        let mut recorded = recorder();
        let mut run = run_at(&machine, &from);
        assert_eq!(
            step(&mut run, stimulus::<G>(event), &mut recorded),
            outcome,
            "{row}"
        );
        assert_eq!(recorded.done, actions, "{row}");
        assert_eq!(machine.state(run.state()).path.to_string(), to, "{row}");
    }
}

#[test]
fn events_confirm_what_they_can_do_and_reject_the_rest() {
    let confirm = "Send ConfirmEventRequest";
    let reject: &[&str] = &["Send RejectEventRequest"];
    let store: &[&str] = &["storeEvent", confirm, "sendEvent"];
    check::<events::machine::Machine>(&[
        (
            "Ready",
            "QueryEvents",
            &[],
            Handled,
            &["Send ReportEvents"],
            "",
        ),
        (
            "Ready",
            "QueryEventTimeout",
            &[],
            Handled,
            &["Send ReportEventTimeout"],
            "",
        ),
        ("Ready", "CreateEvent", &["isSupported"], Handled, store, ""),
        ("Ready", "CreateEvent", &[], Handled, reject, ""),
        (
            "Ready",
            "UpdateEvent",
            &["eventExists", "isSupported"],
            Handled,
            store,
            "",
        ),
        (
            "Ready",
            "UpdateEvent",
            &["eventExists"],
            Handled,
            reject,
            "",
        ),
        (
            "Ready",
            "UpdateEvent",
            &["isSupported"],
            Handled,
            reject,
            "",
        ),
        (
            "Ready",
            "CancelEvent",
            &["eventExists"],
            Handled,
            &["removeEvent", confirm],
            "",
        ),
        ("Ready", "CancelEvent", &[], Handled, reject, ""),
        (
            "Ready",
            "CreateCommandEvent",
            &["isCommandSupported"],
            Handled,
            &["storeCommandEvent", confirm],
            "",
        ),
        ("Ready", "CreateCommandEvent", &[], Handled, reject, ""),
    ]);
}

const FREE: &str = "Ready.NotControlled.Available";
const HELD: &str = "Ready.Controlled.Available";
const FREE_AWAY: &str = "Ready.NotControlled.NotAvailable";
const HELD_AWAY: &str = "Ready.Controlled.NotAvailable";

const ACCEPTED: &str = "Send ConfirmControl CONTROL_ACCEPTED";
const TOO_WEAK: &str = "Send ConfirmControl INSUFFICIENT_AUTHORITY";
const AWAY: &str = "Send ConfirmControl NOT_AVAILABLE";
const RELEASED: &str = "Send RejectControl CONTROL_RELEASED";
const KEPT: &str = "Send RejectControl NOT_AVAILABLE";
const WEAK: &str = "isDefaultAuthorityGreater";
const CLIENT: &str = "isControllingClient";
const STRONGER: &str = "isCurrentAuthorityLess";

#[test]
fn access_control_goes_to_the_strongest_and_is_kept_while_not_available() {
    let take: &[&str] = &["storeAddress", "setAuthority", "resetTimer", ACCEPTED];
    let take_over: &[&str] = &[
        "releaseController",
        "storeAddress",
        "setAuthority",
        "resetTimer",
        ACCEPTED,
    ];
    let renew: &[&str] = &["setAuthority", "resetTimer", ACCEPTED];
    check::<access_control::machine::Machine>(&[
        (FREE, "RequestControl", &[WEAK], Handled, &[TOO_WEAK], ""),
        (FREE, "RequestControl", &[], Handled, take, HELD),
        (FREE, "ReleaseControl", &[], Handled, &[RELEASED], ""),
        (
            FREE,
            "SetAuthority",
            &[CLIENT, "isAuthorityValid"],
            Ignored,
            &[],
            "",
        ),
        (FREE, "Timedout", &[], Ignored, &[], ""),
        (
            FREE,
            "QueryControl",
            &[],
            Handled,
            &["Send ReportControl"],
            "",
        ),
        (FREE_AWAY, "RequestControl", &[], Handled, &[AWAY], ""),
        (FREE_AWAY, "ReleaseControl", &[], Handled, &[RELEASED], ""),
        (
            HELD,
            "RequestControl",
            &[CLIENT, WEAK],
            Handled,
            &[RELEASED],
            FREE,
        ),
        (HELD, "RequestControl", &[CLIENT], Handled, renew, ""),
        (HELD, "RequestControl", &[STRONGER], Handled, take_over, ""),
        (HELD, "RequestControl", &[], Handled, &[TOO_WEAK], ""),
        (
            HELD,
            "ReleaseControl",
            &[CLIENT],
            Handled,
            &[RELEASED],
            FREE,
        ),
        (HELD, "ReleaseControl", &[], Rejected, &[], ""),
        (
            HELD,
            "SetAuthority",
            &[CLIENT, "isAuthorityValid"],
            Handled,
            &["setAuthority"],
            "",
        ),
        (HELD, "SetAuthority", &[CLIENT], Rejected, &[], ""),
        (HELD, "Timedout", &[], Handled, &["releaseController"], FREE),
        (
            HELD,
            "QueryAuthority",
            &[],
            Handled,
            &["Send ReportAuthority"],
            "",
        ),
        (
            HELD,
            "QueryEvents",
            &[],
            Handled,
            &["Send ReportEvents"],
            "",
        ),
        (HELD_AWAY, "RequestControl", &[CLIENT], Handled, &[AWAY], ""),
        (HELD_AWAY, "ReleaseControl", &[CLIENT], Handled, &[KEPT], ""),
        (HELD_AWAY, "Timedout", &[], Handled, &["resetTimer"], ""),
        (
            HELD_AWAY,
            "QueryTimeout",
            &[],
            Handled,
            &["Send ReportTimeout"],
            "",
        ),
    ]);
}

#[test]
fn management_stops_in_an_emergency_and_ends_control_where_it_ends() {
    let standby = &format!("{FREE}.Standby");
    let (held, ready) = (&format!("{HELD}.Standby"), &format!("{HELD}.Ready"));
    let [init, failure, shutdown, emergency] =
        &["Init", "Failure", "Shutdown", "Emergency"].map(|it| format!("{FREE_AWAY}.{it}"));
    let stopped = &format!("{HELD_AWAY}.Emergency");
    let last: &[&str] = &["isIDStored", "isLastID"];
    let take: &[&str] = &["storeAddress", "setAuthority", "resetTimer", ACCEPTED];
    check::<management::machine::Machine>(&[
        (standby, "RequestControl", &[], Handled, take, held),
        (standby, "Resume", &[CLIENT], Ignored, &[], ""),
        (standby, "Failure", &[], Handled, &[], failure),
        (
            standby,
            "SetEmergency",
            &[],
            Handled,
            &["storeID"],
            emergency,
        ),
        (
            standby,
            "QueryStatus",
            &[],
            Handled,
            &["Send ReportStatus"],
            "",
        ),
        (init, "Initialized", &[], Handled, &[], standby),
        (init, "RequestControl", &[], Handled, &[AWAY], ""),
        (init, "SetEmergency", &[], Handled, &["storeID"], emergency),
        (failure, "Initialized", &[], Handled, &[], standby),
        (shutdown, "Failure", &[], Handled, &[], ""),
        (shutdown, "Initialized", &[], Ignored, &[], ""),
        (emergency, "SetEmergency", &[], Handled, &["storeID"], ""),
        (
            emergency,
            "ClearEmergency",
            &["isIDStored"],
            Handled,
            &["deleteID"],
            "",
        ),
        // There is no state to return to.
        (emergency, "ClearEmergency", last, Rejected, &[], ""),
        (emergency, "ClearEmergency", &[], Rejected, &[], ""),
        (emergency, "ReleaseControl", &[], Handled, &[KEPT], ""),
        (emergency, "Failure", &[], Handled, &["rememberFailure"], ""),
        (held, "Resume", &[CLIENT], Handled, &[], ready),
        (held, "Resume", &[], Rejected, &[], ""),
        (held, "Standby", &[CLIENT], Ignored, &[], ""),
        (ready, "Standby", &[CLIENT], Handled, &[], held),
        (ready, "Reset", &[CLIENT], Handled, &[RELEASED], standby),
        (
            ready,
            "Reset",
            &[CLIENT, "initializes"],
            Handled,
            &[RELEASED],
            init,
        ),
        (ready, "Reset", &["initializes"], Rejected, &[], ""),
        (ready, "Shutdown", &[CLIENT], Handled, &[RELEASED], shutdown),
        (ready, "SetEmergency", &[], Handled, &["storeID"], stopped),
        (
            ready,
            "Failure",
            &[],
            Handled,
            &["releaseController"],
            failure,
        ),
        (
            ready,
            "Timedout",
            &[],
            Handled,
            &["releaseController"],
            standby,
        ),
        (
            ready,
            "ReleaseControl",
            &[CLIENT],
            Handled,
            &[RELEASED],
            standby,
        ),
        (
            stopped,
            "ClearEmergency",
            last,
            Handled,
            &["deleteID"],
            held,
        ),
        (
            stopped,
            "ClearEmergency",
            &["isIDStored"],
            Handled,
            &["deleteID"],
            "",
        ),
        (stopped, "RequestControl", &[CLIENT], Handled, &[AWAY], ""),
        (stopped, "Timedout", &[], Handled, &["resetTimer"], ""),
        (stopped, "Shutdown", &[CLIENT], Ignored, &[], ""),
        (stopped, "Failure", &[], Handled, &["rememberFailure"], ""),
        (
            stopped,
            "CreateEvent",
            &[],
            Handled,
            &["Send RejectEventRequest"],
            "",
        ),
    ]);
}

/// Continues what was interrupted, except motion.
#[test]
fn after_an_emergency_management_goes_back_to_what_it_was_doing() {
    let mut recorder = Recorder::default();
    recorder
        .holds
        .extend(["isIDStored", "isLastID"].map(str::to_owned));
    for state in ["Init", "Failure", "Shutdown"] {
        let path = format!("Receiving.{FREE_AWAY}.{state}");
        let mut machine = management::machine::Machine::within(&path).expect("a state");
        for (event, within) in [("SetEmergency", "Emergency"), ("ClearEmergency", state)] {
            assert_eq!(machine.hear(event, &mut recorder), Handled);
            assert_eq!(machine.path(), format!("Receiving.{FREE_AWAY}.{within}"));
        }
    }
}
