//! Velocity State Driver: holds a velocity, within limits that clients may narrow.

use super::behaviour::Behaviour;
use super::both_versions;
use super::controls::Controls;
use super::exchange::Exchange;
use crate::motion::{Acceleration, Goal, Limits, Ticket, Velocity};
use jaus::codec::{Message, ServiceId};
use jaus::messages::mobility::report_acceleration_limit as acceleration;
use jaus::messages::mobility::report_velocity_command as command;
use jaus::messages::mobility::report_velocity_command_ext as ext;
use jaus::messages::mobility::{
    QueryAccelerationLimit, QueryVelocityCommand, QueryVelocityCommandExt, ReportAccelerationLimit,
    ReportVelocityCommand, ReportVelocityCommandExt, SetAccelerationLimit, SetVelocityCommand,
    SetVelocityCommandExt, velocity_state_driver,
};
use jaus::service::{Context, Handled, State, Validity};

/// The commanded velocity and the default velocity.
#[derive(Default)]
pub(super) struct VelocityStateDriver {
    current: Velocity,
    default: Velocity,
    ticket: Option<Ticket>,
}

/// The velocity that a message refers to. In still air or water, over ground (0 to 3) and relative
/// to the medium (4 to 7) are the same.
#[derive(Clone, Copy, PartialEq)]
enum Which {
    Current,
    Greatest,
    Least,
    Default,
}

impl Which {
    const fn of(command_type: u8) -> Option<Self> {
        Some(match command_type {
            0 | 4 => Self::Current,
            1 | 5 => Self::Greatest,
            2 | 6 => Self::Least,
            3 | 7 => Self::Default,
            _ => return None,
        })
    }
}

/// Command type of Set Acceleration Limit: acceleration.
const SPEEDING_UP: u8 = 1;
/// Command type of Set Acceleration Limit: deceleration.
const SLOWING_DOWN: u8 = 2;

impl Behaviour for VelocityStateDriver {
    fn offers(&self) -> Vec<ServiceId> {
        both_versions(velocity_state_driver::V1_1).into()
    }

    fn handle(&mut self, code: u16, exchange: &mut Exchange<'_, '_>) -> Handled {
        match code {
            SetVelocityCommand::CODE => {
                if let Some(message) = exchange.configure::<SetVelocityCommand>() {
                    let wanted = |now: Velocity| Velocity {
                        x: message.velocity_x_m_per_s().unwrap_or(now.x),
                        yaw: message.yaw_rate_rad_per_s().unwrap_or(now.yaw),
                        ..now
                    };
                    self.set(message.command_type.0, wanted, exchange);
                }
            }
            SetVelocityCommandExt::CODE => {
                if let Some(message) = exchange.configure::<SetVelocityCommandExt>() {
                    let wanted = |now: Velocity| Velocity {
                        x: message.velocity_x_m_per_s().unwrap_or(now.x),
                        yaw: message.yaw_rate_rad_per_s().unwrap_or(now.yaw),
                        ..now
                    };
                    self.set(message.command_type.0, wanted, exchange);
                }
            }
            SetAccelerationLimit::CODE => {
                if let Some(message) = exchange.configure() {
                    limit_acceleration(&message, exchange);
                }
            }
            QueryVelocityCommand::CODE => {
                if let Some(query) = exchange.query() {
                    self.report(&query, exchange);
                }
            }
            QueryVelocityCommandExt::CODE => {
                if let Some(query) = exchange.query() {
                    self.report_ext(&query, exchange);
                }
            }
            QueryAccelerationLimit::CODE => {
                if let Some(query) = exchange.query() {
                    report_limit(&query, exchange);
                }
            }
            _ => return Handled::No,
        }
        Handled::Yes
    }

    fn acts_on(&self) -> Option<&'static str> {
        Some(SetVelocityCommand::NAME)
    }

    fn handle_control_end(&mut self, controls: &mut Controls) {
        self.default = Velocity::default();
        controls.pilot.reset_limits();
    }

    fn handle_stop(&mut self, controls: &mut Controls, context: &mut Context<'_>) {
        self.current = Velocity::default();
        self.ticket = None;
        if context.standing().state == State::Initialize {
            self.default = Velocity::default();
            controls.pilot.reset_limits();
        }
        changed(context);
    }
}

fn changed(context: &mut Context<'_>) {
    context.changed::<QueryVelocityCommand>();
    context.changed::<QueryVelocityCommandExt>();
    context.changed::<QueryAccelerationLimit>();
}

impl VelocityStateDriver {
    /// Handles a velocity command. Omitted fields keep their values. Driving requires the component
    /// to be ready; limits can be set at any time.
    fn set(
        &mut self,
        command_type: u8,
        wanted: impl Fn(Velocity) -> Velocity,
        exchange: &mut Exchange<'_, '_>,
    ) {
        let source = exchange.message.source;
        let Some(which) = Which::of(command_type) else {
            tracing::debug!(%source, command_type, "unknown kind of velocity command");
            return;
        };
        if matches!(which, Which::Current) && !exchange.is_in_order() {
            return;
        }
        let velocity = wanted(self.velocity(which, exchange.controls));
        let pilot = &mut exchange.controls.pilot;
        let limits = *pilot.limits();
        match which {
            Which::Current => {
                let acts = exchange.context.standing().acts_for(source)
                    && !exchange.controls.is_in_trouble();
                tracing::debug!(%source, x = velocity.x, yaw = velocity.yaw, acts, "velocity set");
                self.current = velocity;
                let goal = Goal::Velocity(velocity);
                self.ticket = acts.then(|| exchange.pursue(goal, Validity::Brief));
            }
            Which::Greatest => pilot.set_limits(Limits {
                speed: velocity.x.max(0.0),
                yaw_rate: velocity.yaw.max(0.0),
                ..limits
            }),
            Which::Least => pilot.set_limits(Limits {
                reverse: (-velocity.x).max(0.0),
                ..limits
            }),
            Which::Default => self.default = velocity,
        }
        changed(exchange.context);
    }

    fn velocity(&self, which: Which, controls: &Controls) -> Velocity {
        let limits = controls.pilot.limits();
        match which {
            Which::Current => match self.ticket {
                Some(ticket) if !controls.pilot.pursues(ticket) => Velocity::default(),
                _ => self.current,
            },
            Which::Greatest => Velocity::forward(limits.speed, limits.yaw_rate),
            Which::Least => Velocity::forward(-limits.reverse, -limits.yaw_rate),
            Which::Default => self.default,
        }
    }

    fn report(&self, query: &QueryVelocityCommand, exchange: &mut Exchange<'_, '_>) {
        let Some(which) = Which::of(query.command_type) else {
            return;
        };
        let velocity = self.velocity(which, exchange.controls);
        let report = ReportVelocityCommand {
            command_type: command::CommandType(query.command_type),
            velocity_x: command::VelocityX::new(velocity.x).ok(),
            velocity_y: command::VelocityY::new(velocity.y).ok(),
            velocity_z: command::VelocityZ::new(velocity.z).ok(),
            roll_rate: command::RollRate::new(velocity.roll).ok(),
            pitch_rate: command::PitchRate::new(velocity.pitch).ok(),
            yaw_rate: command::YawRate::new(velocity.yaw).ok(),
        };
        exchange.report(query, report);
    }

    fn report_ext(&self, query: &QueryVelocityCommandExt, exchange: &mut Exchange<'_, '_>) {
        let Some(which) = Which::of(query.command_type) else {
            return;
        };
        let velocity = self.velocity(which, exchange.controls);
        let report = ReportVelocityCommandExt {
            command_type: ext::CommandType(query.command_type),
            velocity_x: ext::VelocityX::new(velocity.x).ok(),
            velocity_y: ext::VelocityY::new(velocity.y).ok(),
            velocity_z: ext::VelocityZ::new(velocity.z).ok(),
            roll_rate: ext::RollRate::new(velocity.roll).ok(),
            pitch_rate: ext::PitchRate::new(velocity.pitch).ok(),
            yaw_rate: ext::YawRate::new(velocity.yaw).ok(),
        };
        exchange.report(query, report);
    }
}

/// Narrows the acceleration limits. A deceleration limit may have either sign. A limit of 0 would
/// disable the brakes and is ignored.
fn limit_acceleration(message: &SetAccelerationLimit, exchange: &mut Exchange<'_, '_>) {
    let pilot = &mut exchange.controls.pilot;
    let limits = *pilot.limits();
    let along = message.acceleration_x_m_per_s2().map(f64::abs);
    let along = along.filter(|&along| along > LEAST_ACCELERATION);
    let about = message.yaw_acceleration_rad_per_s2().map(f64::abs);
    let about = about.filter(|&about| about > LEAST_ACCELERATION);
    let yaw_acceleration = about.unwrap_or(limits.yaw_acceleration);
    match message.command_type.0 {
        SPEEDING_UP => pilot.set_limits(Limits {
            acceleration: along.unwrap_or(limits.acceleration),
            yaw_acceleration,
            ..limits
        }),
        SLOWING_DOWN => pilot.set_limits(Limits {
            deceleration: along.unwrap_or(limits.deceleration),
            yaw_acceleration,
            ..limits
        }),
        _ => return,
    }
    changed(exchange.context);
}

const LEAST_ACCELERATION: f64 = 0.01;

fn report_limit(query: &QueryAccelerationLimit, exchange: &mut Exchange<'_, '_>) {
    let limits = *exchange.controls.pilot.limits();
    let (x, yaw) = match query.command_type {
        SPEEDING_UP => (limits.acceleration, limits.yaw_acceleration),
        SLOWING_DOWN => (-limits.deceleration, -limits.yaw_acceleration),
        _ => return,
    };
    let limit = Acceleration {
        x,
        yaw,
        ..Acceleration::default()
    };
    let report = ReportAccelerationLimit {
        command_type: acceleration::CommandType(query.command_type),
        acceleration_x: acceleration::AccelerationX::new(limit.x).ok(),
        acceleration_y: acceleration::AccelerationY::new(limit.y).ok(),
        acceleration_z: acceleration::AccelerationZ::new(limit.z).ok(),
        roll_acceleration: acceleration::RollAcceleration::new(limit.roll).ok(),
        pitch_acceleration: acceleration::PitchAcceleration::new(limit.pitch).ok(),
        yaw_acceleration: acceleration::YawAcceleration::new(limit.yaw).ok(),
    };
    exchange.report(query, report);
}
