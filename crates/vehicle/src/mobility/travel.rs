//! Messages common to all waypoint and list drivers: travel speed and list execution.

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

/// Handles travel speed messages for drivers to a single place.
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

/// Whether list drivers report the completion of commands with this code.
pub(super) const fn tells_end_of(command: u16) -> bool {
    matches!(command, ExecuteList::CODE | ExecuteListExt::CODE)
}

/// Handles list execution messages for list drivers.
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
        QueryTravelSpeed::CODE => exchange.answer_if(|_: &QueryTravelSpeed, _| {
            let mut report = ReportTravelSpeed::default();
            report.set_speed_m_per_s(speed).map(|()| report)
        }),
        QueryTravelSpeedExt::CODE => exchange.answer_if(|_: &QueryTravelSpeedExt, _| {
            let speed = SpeedSpeedOverGround::new(speed).map(Speed::SpeedOverGround);
            speed.map(|speed| ReportTravelSpeedExt { speed })
        }),
        _ => return Handled::No,
    }
    Handled::Yes
}

/// Sets the speed to the place. Ignored if there is no place.
fn set_speed(speed: f64, acts: bool, exchange: &mut Exchange<'_, '_>) {
    let source = exchange.message.source;
    if exchange.controls.travel.has_place() {
        tracing::info!(%source, speed, acts, "travel speed set");
        exchange.controls.set_speed(speed, acts);
        accept(exchange);
        changed(exchange.context);
    } else {
        tracing::info!(%source, "travel speed ignored: no waypoint is set");
    }
}

/// Starts the list at an element. Without an element, changes the speed of the list being executed.
fn execute(code: u16, uid: Option<u16>, speed: f64, acts: bool, exchange: &mut Exchange<'_, '_>) {
    let source = exchange.message.source;
    match uid {
        Some(uid) if !exchange.controls.execute(uid, speed, acts) => {
            tracing::info!(%source, uid, "list not executed: no such element");
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
        None => tracing::info!(%source, "travel speed ignored: no list is executing"),
    }
    accept(exchange);
    changed(exchange.context);
}

/// Keeps the command in force until the journey is done.
pub(super) fn accept(exchange: &mut Exchange<'_, '_>) {
    if exchange.controls.is_travelling() {
        exchange.accept(Validity::UntilDone);
    }
}

/// The speed over ground. In still air it equals the speed relative to the medium. Rotation speeds
/// do not apply to this vehicle, and it does not travel backwards.
pub(super) fn metres_per_second(speed: Speed) -> Option<f64> {
    let speed = match speed {
        Speed::SpeedOverGround(speed) => speed.value(),
        Speed::SpeedRelativeToMedium(speed) => speed.value(),
        Speed::IndicatedSpeed(speed) => speed.value(),
        Speed::RotationsPerMinute(_) => return None,
    };
    // The step of the field nearest to 0 is not exactly 0.
    (speed > -0.005).then_some(speed.max(0.0))
}
