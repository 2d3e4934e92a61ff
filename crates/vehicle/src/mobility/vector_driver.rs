//! Local and Global Vector Driver: hold a speed and a heading.

use super::behaviour::Behaviour;
use super::controls::Controls;
use super::exchange::{Command, Exchange};
use crate::mobility::travel::metres_per_second;
use crate::motion::{Goal, Heading, Ticket};
use jaus::codec::{Message, OutOfRange, ServiceId};
use jaus::messages::mobility::{
    QueryGlobalVector, QueryGlobalVectorExt, QueryLocalVector, QueryLocalVectorExt,
    ReportGlobalVector, ReportGlobalVectorExt, ReportLocalVector, ReportLocalVectorExt,
    SetGlobalVector, SetGlobalVectorExt, SetLocalVector, SetLocalVectorExt, global_vector_driver,
    local_vector_driver, report_global_vector, report_global_vector_ext, report_local_vector,
    report_local_vector_ext,
};
use jaus::service::{Context, Handled, Validity};

/// The requested speed and heading.
#[derive(Debug, Default, Clone, Copy)]
struct Vector {
    /// Speed in metres per second.
    speed: f64,
    /// Heading in radians clockwise from the local X axis or from north. `None` drives straight
    /// ahead.
    heading: Option<f64>,
    ticket: Option<Ticket>,
}

/// Holds a heading in the local frame.
#[derive(Default)]
pub(super) struct LocalVectorDriver(Vector);

/// Holds a heading on the globe.
#[derive(Default)]
pub(super) struct GlobalVectorDriver(Vector);

impl Vector {
    /// Stores a vector, and starts if `acts` is set. `origin` is the reference of this driver's
    /// headings.
    fn set(
        &mut self,
        (speed, heading): (f64, Option<f64>),
        origin: fn(f64) -> Heading,
        acts: bool,
        exchange: &mut Exchange<'_, '_>,
    ) {
        tracing::debug!(source = %exchange.message.source, speed, heading, acts, "vector set");
        let goal = Goal::Vector {
            speed,
            heading: heading.map(origin),
        };
        *self = Self {
            speed,
            heading,
            ticket: acts.then(|| exchange.pursue(goal, Validity::WhileAlive)),
        };
        changed(exchange.context);
    }

    /// The vector in force or stored in standby; the default if another driver has replaced it.
    fn current(&self, controls: &Controls) -> Self {
        match self.ticket {
            Some(ticket) if !controls.pilot.pursues(ticket) => Self::default(),
            _ => *self,
        }
    }
}

fn changed(context: &mut Context<'_>) {
    context.changed::<QueryLocalVector>();
    context.changed::<QueryLocalVectorExt>();
    context.changed::<QueryGlobalVector>();
    context.changed::<QueryGlobalVectorExt>();
}

impl Behaviour for LocalVectorDriver {
    fn offers(&self) -> Vec<ServiceId> {
        vec![local_vector_driver::V1_1]
    }

    fn handle(&mut self, code: u16, exchange: &mut Exchange<'_, '_>) -> Handled {
        match code {
            SetLocalVector::CODE => {
                if let Some(Command { message, acts }) = exchange.command::<SetLocalVector>() {
                    let vector = (message.speed_m_per_s(), message.heading_rad());
                    self.0.set(vector, Heading::Local, acts, exchange);
                }
            }
            SetLocalVectorExt::CODE => {
                if let Some(Command { message, acts }) = exchange.command::<SetLocalVectorExt>()
                    && let Some(speed) = metres_per_second(message.speed)
                {
                    let vector = (speed, message.heading_rad());
                    self.0.set(vector, Heading::Local, acts, exchange);
                }
            }
            QueryLocalVector::CODE => exchange.answer_if(|_: &QueryLocalVector, exchange| {
                let vector = self.0.current(exchange.controls);
                local(&vector)
            }),
            QueryLocalVectorExt::CODE => {
                exchange.answer_if(|_: &QueryLocalVectorExt, exchange| {
                    let vector = self.0.current(exchange.controls);
                    local_ext(&vector)
                });
            }
            _ => return Handled::No,
        }
        Handled::Yes
    }

    fn acts_on(&self) -> Option<&'static str> {
        Some(SetLocalVector::NAME)
    }

    fn handle_stop(&mut self, _: &mut Controls, context: &mut Context<'_>) {
        *self = Self::default();
        changed(context);
    }
}

impl Behaviour for GlobalVectorDriver {
    fn offers(&self) -> Vec<ServiceId> {
        vec![global_vector_driver::V1_1]
    }

    fn handle(&mut self, code: u16, exchange: &mut Exchange<'_, '_>) -> Handled {
        match code {
            SetGlobalVector::CODE => {
                if let Some(Command { message, acts }) = exchange.command::<SetGlobalVector>() {
                    let speed = message.speed_m_per_s();
                    let speed = speed.unwrap_or(self.0.current(exchange.controls).speed);
                    let vector = (speed, message.heading_rad());
                    self.0.set(vector, Heading::North, acts, exchange);
                }
            }
            SetGlobalVectorExt::CODE => {
                if let Some(Command { message, acts }) = exchange.command::<SetGlobalVectorExt>()
                    && let Some(speed) = metres_per_second(message.speed)
                {
                    let vector = (speed, message.heading_rad());
                    self.0.set(vector, Heading::North, acts, exchange);
                }
            }
            QueryGlobalVector::CODE => exchange.answer(|_: &QueryGlobalVector, exchange| {
                let vector = self.0.current(exchange.controls);
                global(&vector)
            }),
            QueryGlobalVectorExt::CODE => {
                exchange.answer_if(|_: &QueryGlobalVectorExt, exchange| {
                    let vector = self.0.current(exchange.controls);
                    global_ext(&vector)
                });
            }
            _ => return Handled::No,
        }
        Handled::Yes
    }

    fn acts_on(&self) -> Option<&'static str> {
        Some(SetGlobalVector::NAME)
    }

    fn handle_stop(&mut self, _: &mut Controls, context: &mut Context<'_>) {
        *self = Self::default();
        changed(context);
    }
}

fn local(vector: &Vector) -> Result<ReportLocalVector, OutOfRange> {
    Ok(ReportLocalVector {
        speed: report_local_vector::Speed::new(vector.speed)?,
        heading: vector
            .heading
            .and_then(|it| report_local_vector::Heading::new(it).ok()),
        ..ReportLocalVector::default()
    })
}

fn local_ext(vector: &Vector) -> Result<ReportLocalVectorExt, OutOfRange> {
    use report_local_vector_ext::{Heading, Speed, SpeedSpeedOverGround};
    Ok(ReportLocalVectorExt {
        speed: Speed::SpeedOverGround(SpeedSpeedOverGround::new(vector.speed)?),
        heading: vector.heading.and_then(|it| Heading::new(it).ok()),
        ..ReportLocalVectorExt::default()
    })
}

fn global(vector: &Vector) -> ReportGlobalVector {
    ReportGlobalVector {
        speed: report_global_vector::Speed::new(vector.speed).ok(),
        heading: vector
            .heading
            .and_then(|it| report_global_vector::Heading::new(it).ok()),
        ..ReportGlobalVector::default()
    }
}

fn global_ext(vector: &Vector) -> Result<ReportGlobalVectorExt, OutOfRange> {
    use report_global_vector_ext::{Heading, Speed, SpeedSpeedOverGround};
    Ok(ReportGlobalVectorExt {
        speed: Speed::SpeedOverGround(SpeedSpeedOverGround::new(vector.speed)?),
        heading: vector.heading.and_then(|it| Heading::new(it).ok()),
        ..ReportGlobalVectorExt::default()
    })
}
