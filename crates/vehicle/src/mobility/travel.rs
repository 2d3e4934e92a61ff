//! What the drivers that go to places do with the messages that all of them have: the travel speed,
//! and the execution of a list.

use super::controls::changed;
use super::exchange::{Command, Exchange};
use jaus::codec::Message;
use jaus::messages::mobility::set_travel_speed_ext::{Speed, SpeedSpeedOverGround};
use jaus::messages::mobility::{
    ExecuteList, ExecuteListExt, QueryActiveElement, QueryTravelSpeed, QueryTravelSpeedExt,
    ReportActiveElement, ReportTravelSpeed, ReportTravelSpeedExt, SetTravelSpeed,
    SetTravelSpeedExt,
};
use jaus::service::{Handled, Validity};

/// What drivers to a single place do with messages about the travel speed.
pub(super) fn handle_speed(code: u16, exchange: &mut Exchange<'_, '_>) -> Handled {
    match code {
        SetTravelSpeed::CODE => {
            if let Some(Command { message, acts }) = exchange.command::<SetTravelSpeed>() {
                set_speed(message.speed_m_per_s(), acts, exchange);
            }
        }
        SetTravelSpeedExt::CODE => {
            if let Some(Command { message, acts }) = exchange.command::<SetTravelSpeedExt>()
                && let Some(speed) = metres_per_second(message.speed)
            {
                set_speed(speed, acts, exchange);
            }
        }
        _ => return handle_query(code, exchange),
    }
    Handled::Yes
}

/// Whether drivers along a list tell the end of a command with this code.
pub(super) const fn tells_end_of(command: u16) -> bool {
    matches!(command, ExecuteList::CODE | ExecuteListExt::CODE)
}

/// What drivers along a list do with messages about its execution.
pub(super) fn handle_list(code: u16, exchange: &mut Exchange<'_, '_>) -> Handled {
    match code {
        ExecuteList::CODE => {
            if let Some(Command { message, acts }) = exchange.command::<ExecuteList>() {
                let speed = message.speed_m_per_s();
                execute(code, message.element_uid, speed, acts, exchange);
            }
        }
        ExecuteListExt::CODE => {
            if let Some(Command { message, acts }) = exchange.command::<ExecuteListExt>()
                && let Some(speed) = metres_per_second(message.speed)
            {
                execute(code, message.element_uid, speed, acts, exchange);
            }
        }
        QueryActiveElement::CODE => {
            let element_uid = exchange.controls.travel.active().unwrap_or_default();
            exchange.reply(&ReportActiveElement { element_uid });
        }
        _ => return handle_query(code, exchange),
    }
    Handled::Yes
}

fn handle_query(code: u16, exchange: &mut Exchange<'_, '_>) -> Handled {
    let speed = exchange.controls.travel.speed();
    match code {
        QueryTravelSpeed::CODE => {
            let mut report = ReportTravelSpeed::default();
            let report = report.set_speed_m_per_s(speed).map(|()| report);
            exchange.reply_if(report);
        }
        QueryTravelSpeedExt::CODE => {
            let speed = SpeedSpeedOverGround::new(speed).map(Speed::SpeedOverGround);
            exchange.reply_if(speed.map(|speed| ReportTravelSpeedExt { speed }));
        }
        _ => return Handled::No,
    }
    Handled::Yes
}

/// A speed for a place; without a place there is nothing to drive to.
fn set_speed(speed: f64, acts: bool, exchange: &mut Exchange<'_, '_>) {
    let source = exchange.message.source;
    if exchange.controls.travel.has_place() {
        tracing::info!(%source, speed, acts, "travel speed set");
        exchange.controls.set_speed(speed, acts);
        accept(exchange);
        changed(exchange.context);
    } else {
        tracing::info!(%source, "travel speed ignored: there is no waypoint yet");
    }
}

/// Begins with an element of the list; without one, the speed of a list that is being worked off
/// is changed.
fn execute(code: u16, uid: Option<u16>, speed: f64, acts: bool, exchange: &mut Exchange<'_, '_>) {
    let source = exchange.message.source;
    match uid {
        Some(uid) if !exchange.controls.execute(uid, speed, acts) => {
            tracing::info!(%source, uid, "list not executed: there is no such element");
            return;
        }
        Some(uid) => {
            tracing::info!(%source, uid, speed, acts, "list executed");
            exchange.controls.take_up(code, exchange.context);
        }
        None if exchange.controls.travel.active().is_some() => {
            tracing::info!(%source, speed, "travel speed of the list set");
            exchange.controls.set_speed(speed, acts);
        }
        None => tracing::info!(%source, "travel speed ignored: no list is executed"),
    }
    accept(exchange);
    changed(exchange.context);
}

/// A journey that has been set out on is in force until it is done.
pub(super) fn accept(exchange: &mut Exchange<'_, '_>) {
    if exchange.controls.is_travelling() {
        exchange.accept(Validity::UntilDone);
    }
}

/// A speed over ground. Through still air that is also the one relative to the medium; rotations
/// are no speed of this vehicle, and it does not travel backwards.
pub(super) fn metres_per_second(speed: Speed) -> Option<f64> {
    let speed = match speed {
        Speed::SpeedOverGround(speed) => speed.value(),
        Speed::SpeedRelativeToMedium(speed) => speed.value(),
        Speed::IndicatedSpeed(speed) => speed.value(),
        Speed::RotationsPerMinute(_) => return None,
    };
    // The step of the field next to 0 is not exactly 0.
    (speed > -0.005).then_some(speed.max(0.0))
}
