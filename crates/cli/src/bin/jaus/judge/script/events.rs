//! Part B, steps 3 to 10 and 36: event streams.

use std::time::Duration;

use bytes::Bytes;
use jaus::codec::{Message, OutOfRange};
use jaus::messages::core::query_events::{AllEventsRec, EventIdRec, QueryEventsVar};
use jaus::messages::core::{
    CancelEvent, ConfirmEventRequest, CreateEvent, QueryControl, QueryEvents, QueryHeartbeatPulse,
    QueryStatus, RejectEventRequest, ReportControl, ReportEvents, ReportHeartbeatPulse,
    ReportStatus, UpdateEvent,
};
use jaus::messages::mobility::{ReportGlobalPose, ReportLocalPose, ReportVelocityState};

use super::super::memory::Memory;
use super::super::step::{
    Act, Check, Exchange, Part, Speaker::Main, Step, Stream, Watch, equal, near, step,
};
use super::VELOCITY_STATE_SENSOR;
use super::mobility::{EVERY_POSE_BIT, EVERY_VELOCITY_BIT};
use super::{ACCESS_CONTROL, EVENTS, LIVENESS, LOCAL_POSE_SENSOR, MANAGEMENT};

/// Tolerance of a confirmed rate, in hertz: one step of the field.
const RATE_STEP: f64 = 1092.0 / u16::MAX as f64;

const SECOND: Duration = Duration::from_secs(1);

/// Steps 3 to 10.
pub(super) fn steps() -> Vec<Step> {
    vec![
        step(Part::B, 3, "Query Events before any exist")
            .needs(&[EVENTS])
            .ask(
                Main,
                all_events(),
                "no events",
                |report: &ReportEvents, _| {
                    equal("the number of events", report.event_list.len(), 0)
                },
            ),
        step(Part::B, 4, "Create Event: heartbeat at 1 Hz")
            .needs(&[EVENTS, LIVENESS])
            .act(create_heartbeat().into())
            .act(Act::Watch(Watch {
                streams: the_event,
                period: SECOND,
                events: 3,
            })),
        step(Part::B, 5, "Query Events by event id")
            .needs(&[EVENTS, LIVENESS])
            .rests_on(&[4])
            .act(query_event(|report, memory| {
                equal("the number of events", report.event_list.len(), 1)?;
                let id = memory.event()?;
                equal("the event id", report.event_list[0].event_id, id)
            })),
        step(Part::B, 6, "Query Heartbeat Pulse during the event")
            .needs(&[LIVENESS])
            .ask(
                Main,
                QueryHeartbeatPulse,
                "",
                |_: &ReportHeartbeatPulse, _| Ok(()),
            ),
        step(
            Part::B,
            7,
            "Create Event for a report instead of a query is rejected",
        )
        .needs(&[EVENTS])
        .act(create_on_a_report().into()),
        step(Part::B, 8, "Update Event: 0.5 Hz")
            .needs(&[EVENTS, LIVENESS])
            .rests_on(&[4])
            .act(update_heartbeat().into())
            .act(Act::Watch(Watch {
                streams: the_event,
                period: 2 * SECOND,
                events: 2,
            })),
        step(Part::B, 9, "Cancel Event stops the reports")
            .needs(&[EVENTS, LIVENESS])
            .rests_on(&[4])
            .act(cancel_heartbeat().into())
            .act(Act::Silence {
                streams: the_event,
                lasting: Duration::from_millis(2500),
            }),
        step(Part::B, 10, "Query Events after cancellation")
            .needs(&[EVENTS, LIVENESS])
            .rests_on(&[4, 9])
            .act(query_event(|report, _| {
                equal("the number of events", report.event_list.len(), 0)
            })),
    ]
}

/// Step 36: all subscriptions of the operator's display at the same time.
pub(super) fn observer() -> Vec<Step> {
    let heartbeat = subscribe(21, QueryHeartbeatPulse, ReportHeartbeatPulse::CODE);
    let control = subscribe(22, QueryControl, ReportControl::CODE);
    let velocity = subscribe(23, EVERY_VELOCITY_BIT, ReportVelocityState::CODE);
    let pose = subscribe(24, EVERY_POSE_BIT, ReportLocalPose::CODE);
    let status = subscribe(25, QueryStatus, ReportStatus::CODE);
    let mut observer = step(
        Part::B,
        36,
        "Five event streams, as an operator's display needs them",
    )
    .needs(&[
        EVENTS,
        LIVENESS,
        ACCESS_CONTROL,
        MANAGEMENT,
        VELOCITY_STATE_SENSOR,
        LOCAL_POSE_SENSOR,
    ])
    .by_unicast_only();
    for exchange in [heartbeat, control, velocity, pose, status] {
        observer = observer.act(exchange.into());
    }
    observer = observer.act(Act::Watch(Watch {
        streams: |memory| Ok(memory.streams.clone()),
        period: SECOND,
        events: 3,
    }));
    for request_id in 31..=35 {
        observer = observer.act(cancel_the_oldest(request_id).into());
    }
    vec![observer]
}

fn all_events() -> QueryEvents {
    QueryEvents {
        query_events_var: QueryEventsVar::AllEventsRec(AllEventsRec { all_events: 0 }),
    }
}

fn create_heartbeat() -> Exchange {
    Exchange::with(Main, |_| create(1, 1.0, &QueryHeartbeatPulse)).expect(
        Main,
        "request 1, an event id, 1 Hz",
        |report: &ConfirmEventRequest, memory| {
            memory.event = Some(report.event_id);
            memory.streams.push(Stream {
                id: report.event_id,
                report: ReportHeartbeatPulse::CODE,
            });
            confirms(report, 1, 1.0)
        },
    )
}

fn create_on_a_report() -> Exchange {
    let report = ReportGlobalPose::default();
    Exchange::with(Main, move |_| create(3, 0.5, &report)).expect(
        Main,
        "request 3 and the reason",
        |report: &RejectEventRequest, _| {
            equal("the request id", report.request_id, 3)?;
            match report.response_code {
                Some(code) if (1..=6).contains(&code.0) => Ok(()),
                Some(code) => Err(format!(
                    "{} is not a response code, which is 1 to 6",
                    code.0
                )),
                None => Err("the response code is missing".to_owned()),
            }
        },
    )
}

fn update_heartbeat() -> Exchange {
    let message = |memory: &Memory| {
        let mut message = UpdateEvent {
            request_id: 4,
            event_id: memory.event()?,
            query_message: encoded(&QueryHeartbeatPulse)?,
            ..UpdateEvent::default()
        };
        in_words(message.set_requested_periodic_rate_hz(0.5))?;
        Ok(message)
    };
    Exchange::with(Main, message).expect(
        Main,
        "request 4, the same event, 0.5 Hz",
        |report: &ConfirmEventRequest, memory| {
            equal("the event id", report.event_id, memory.event()?)?;
            confirms(report, 4, 0.5)
        },
    )
}

fn cancel_heartbeat() -> Exchange {
    let message = |memory: &Memory| {
        Ok(CancelEvent {
            request_id: 7,
            event_id: memory.event()?,
        })
    };
    Exchange::with(Main, message).expect(
        Main,
        "request 7, the same event",
        |report: &ConfirmEventRequest, memory| {
            memory.forget_stream(report.event_id);
            equal("the request id", report.request_id, 7)?;
            equal("the event id", report.event_id, memory.event()?)
        },
    )
}

/// Query Events by the id of the event that step 4 created.
fn query_event(check: fn(&ReportEvents, &mut Memory) -> Check) -> Act {
    let message = |memory: &Memory| {
        let event_id = memory.event()?;
        Ok(QueryEvents {
            query_events_var: QueryEventsVar::EventIdRec(EventIdRec { event_id }),
        })
    };
    let exchange = Exchange::with(Main, message);
    exchange.expect(Main, "its running events", check).into()
}

/// Subscribes to a report at 1 Hz.
fn subscribe(request_id: u8, query: impl Message, report: u16) -> Exchange {
    Exchange::with(Main, move |_| create(request_id, 1.0, &query)).expect(
        Main,
        "the request's id, an event id, 1 Hz",
        move |confirmation: &ConfirmEventRequest, memory| {
            memory.streams.push(Stream {
                id: confirmation.event_id,
                report,
            });
            confirms(confirmation, request_id, 1.0)
        },
    )
}

fn cancel_the_oldest(request_id: u8) -> Exchange {
    let message = move |memory: &Memory| {
        let oldest = memory.streams.first();
        let oldest = oldest.ok_or("there is no event to cancel")?;
        Ok(CancelEvent {
            request_id,
            event_id: oldest.id,
        })
    };
    Exchange::with(Main, message).expect(
        Main,
        "the request's id, the event's id",
        move |report: &ConfirmEventRequest, memory| {
            let oldest = memory.streams.first().map(|stream| stream.id);
            memory.forget_stream(report.event_id);
            equal("the request id", report.request_id, request_id)?;
            equal("the event id", report.event_id, oldest.unwrap_or_default())
        },
    )
}

/// Creates a periodic event.
fn create(request_id: u8, hertz: f64, query: &impl Message) -> Result<CreateEvent, String> {
    let mut message = CreateEvent {
        request_id,
        query_message: encoded(query)?,
        ..CreateEvent::default()
    };
    in_words(message.set_requested_periodic_rate_hz(hertz))?;
    Ok(message)
}

fn confirms(report: &ConfirmEventRequest, request_id: u8, hertz: f64) -> Check {
    equal("the request id", report.request_id, request_id)?;
    let rate = report.confirmed_periodic_rate.value();
    near("the confirmed rate in hertz", rate, hertz, RATE_STEP)
}

/// The event of step 4, a heartbeat.
fn the_event(memory: &Memory) -> Result<Vec<Stream>, String> {
    Ok(vec![Stream {
        id: memory.event()?,
        report: ReportHeartbeatPulse::CODE,
    }])
}

fn encoded(message: &impl Message) -> Result<Bytes, String> {
    message.encode().map_err(|error| error.to_string())
}

fn in_words(set: Result<(), OutOfRange>) -> Check {
    set.map_err(|error| error.to_string())
}
