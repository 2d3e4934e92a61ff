//! Part B, steps 12 to 26: control and states.

use std::time::Duration;

use jaus::messages::core::confirm_control::ResponseCode;
use jaus::messages::core::report_status::Status;
use jaus::messages::core::{
    ClearEmergency, ConfirmControl, QueryAuthority, QueryControl, QueryStatus, QueryTimeout,
    RejectControl, ReleaseControl, ReportAuthority, ReportControl, ReportStatus, ReportTimeout,
    RequestControl, Reset, Resume, SetAuthority, SetEmergency, Standby, clear_emergency,
    set_emergency,
};

use super::super::memory::Memory;
use super::super::step::{
    Act, Check, Part,
    Speaker::{First, Fourth, Second, Third},
    Step, equal, step,
};
use super::challenge::{
    accepted, is_in, is_in_standby, is_ready, nobody_in_control, released, responds,
};
use super::{ACCESS_CONTROL, MANAGEMENT};

pub(super) fn steps() -> Vec<Step> {
    let mut steps = access_control();
    steps.extend(management());
    steps
}

/// Steps 12 to 19.
fn access_control() -> Vec<Step> {
    let access = |number, title| step(Part::B, number, title).needs(&[ACCESS_CONTROL]);
    vec![
        access(12, "Query Timeout").ask(First, QueryTimeout, "seconds", |_: &ReportTimeout, _| {
            Ok(())
        }),
        access(13, "Query Control while uncontrolled").ask(
            First,
            QueryControl,
            "uncontrolled (0.0.0), authority 0",
            nobody_in_control,
        ),
        access(14, "Request Control below the default authority is refused").ask(
            First,
            request(0),
            "2, insufficient authority",
            insufficient,
        ),
        access(15, "Request Control with authority 220 is granted")
            .ask(First, request(220), "control accepted", accepted)
            .ask(
                First,
                QueryControl,
                "42.2.1, authority 220",
                |report, memory| {
                    in_control(report, memory, First)?;
                    equal("the authority", report.authority_code, 220)
                },
            ),
        access(16, "Set Authority changes the authority")
            .rests_on(&[15])
            .tell(
                First,
                SetAuthority {
                    authority_code: 219,
                },
            )
            .ask(
                First,
                QueryAuthority,
                "219",
                |report: &ReportAuthority, _| equal("the authority", report.authority_code, 219),
            ),
        access(17, "Request Control with a lower authority is refused")
            .rests_on(&[15])
            .ask(
                Second,
                request(200),
                "2, insufficient authority",
                insufficient,
            )
            .ask(First, QueryControl, "still 42.2.1", |report, memory| {
                in_control(report, memory, First)
            }),
        access(
            18,
            "A higher authority takes control, and the former controller is notified",
        )
        .rests_on(&[15])
        .ask(Third, request(231), "control accepted", accepted)
        .also(First, "control released", released)
        .ask(
            First,
            QueryControl,
            "42.2.3, authority 231",
            |report, memory| {
                in_control(report, memory, Third)?;
                equal("the authority", report.authority_code, 231)
            },
        ),
        access(19, "Release Control").rests_on(&[18]).ask(
            Third,
            ReleaseControl,
            "control released",
            released,
        ),
    ]
}

/// Steps 20 to 26.
fn management() -> Vec<Step> {
    let management = |number, title| step(Part::B, number, title).needs(&[MANAGEMENT]);
    vec![
        management(20, "Set Emergency")
            .tell(Fourth, set_emergency())
            .ask(First, QueryStatus, "5, emergency", is_in_emergency),
        management(21, "Request Control in an emergency: not available")
            .rests_on(&[20])
            .ask(
                First,
                request(210),
                "1, not available",
                |report: &ConfirmControl, _| responds(report, ResponseCode::NOT_AVAILABLE),
            ),
        management(22, "Clear Emergency")
            .rests_on(&[20])
            .tell(Fourth, clear_emergency())
            .ask(First, request(220), "control accepted", accepted)
            .ask(First, QueryStatus, "2, standby", is_in_standby),
        management(23, "Resume")
            .rests_on(&[20, 22])
            .tell(First, Resume)
            .ask(First, QueryStatus, "1, ready", is_ready),
        management(24, "Standby")
            .rests_on(&[20, 22, 23])
            .tell(First, Standby)
            .ask(First, QueryStatus, "2, standby", is_in_standby),
        management(25, "Reset returns to Standby through Initialize")
            .rests_on(&[20, 22])
            .ask(First, Reset, "control released", released)
            .act(Act::Pause(Duration::from_millis(1500)))
            .ask(First, QueryStatus, "2, standby", is_in_standby)
            .ask(
                First,
                QueryControl,
                "uncontrolled: a reset ends control",
                nobody_in_control,
            ),
        management(26, "Release Control in an emergency, then Clear Emergency")
            .tell(Fourth, set_emergency())
            .ask(First, QueryStatus, "5, emergency", is_in_emergency)
            // After the reset no client is in control; the standard then requires 0, the contests'
            // tool expects 1.
            .ask(
                First,
                ReleaseControl,
                "0, released, or 1, not available",
                |report: &RejectControl, _| match report.response_code.0 {
                    0 | 1 => Ok(()),
                    code => Err(format!("the response code is {code}, not 0 or 1")),
                },
            )
            .tell(Fourth, clear_emergency())
            .ask(First, QueryStatus, "2, standby", is_in_standby),
    ]
}

const fn request(authority_code: u8) -> RequestControl {
    RequestControl { authority_code }
}

const fn set_emergency() -> SetEmergency {
    SetEmergency {
        emergency_code: set_emergency::EmergencyCode(1),
    }
}

const fn clear_emergency() -> ClearEmergency {
    ClearEmergency {
        emergency_code: clear_emergency::EmergencyCode(1),
    }
}

fn insufficient(report: &ConfirmControl, _: &mut Memory) -> Check {
    responds(report, ResponseCode::INSUFFICIENT_AUTHORITY)
}

fn is_in_emergency(report: &ReportStatus, _: &mut Memory) -> Check {
    is_in(report, Status::EMERGENCY)?;
    equal("the reserved field", report.reserved, 0)
}

fn in_control(
    report: &ReportControl,
    memory: &Memory,
    speaker: super::super::step::Speaker,
) -> Check {
    let id = (report.subsystem_id, report.node_id, report.component_id);
    let must_be = memory.id(speaker);
    let (subsystem, node, component) = id;
    if id == (must_be.subsystem(), must_be.node(), must_be.component()) {
        return Ok(());
    }
    Err(format!(
        "{subsystem}.{node}.{component} is in control, not {must_be}"
    ))
}
