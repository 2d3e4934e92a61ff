//! Primitive Driver: controls the vehicle's drives and brakes directly, without feedback.

use super::behaviour::Behaviour;
use super::both_versions;
use super::controls::Controls;
use super::exchange::{Command, Exchange};
use crate::motion::{Effort, Goal, Ticket};
use jaus::codec::{Message, ServiceId};
use jaus::messages::mobility::report_wrench_effort as fields;
use jaus::messages::mobility::{
    QueryWrenchEffort, ReportWrenchEffort, SetWrenchEffort, primitive_driver,
};
use jaus::service::{Context, Handled, Validity};

/// A ground vehicle uses four of the twelve efforts in the message: along X, about Z, and their
/// brakes. The others are stored and reported but have no effect.
#[derive(Default)]
pub(super) struct PrimitiveDriver {
    effort: SetWrenchEffort,
    ticket: Option<Ticket>,
}

impl Behaviour for PrimitiveDriver {
    fn offers(&self) -> Vec<ServiceId> {
        both_versions(primitive_driver::V1_1).into()
    }

    fn handle(&mut self, code: u16, exchange: &mut Exchange<'_, '_>) -> Handled {
        match code {
            SetWrenchEffort::CODE => {
                if let Some(command) = exchange.command() {
                    self.set(command, exchange);
                }
            }
            QueryWrenchEffort::CODE => exchange.answer(|_: &QueryWrenchEffort, exchange| {
                self.forget_what_others_replaced(exchange.controls);
                self.report()
            }),
            _ => return Handled::No,
        }
        Handled::Yes
    }

    fn acts_on(&self) -> Option<&'static str> {
        Some(SetWrenchEffort::NAME)
    }

    fn handle_stop(&mut self, _: &mut Controls, context: &mut Context<'_>) {
        *self = Self::default();
        context.changed::<QueryWrenchEffort>();
    }
}

impl PrimitiveDriver {
    fn set(&mut self, command: Command<SetWrenchEffort>, exchange: &mut Exchange<'_, '_>) {
        let Command { message, acts } = command;
        let share = |percent: Option<f64>| percent.unwrap_or_default() / 100.0;
        let effort = Effort {
            forward: share(message.propulsive_linear_effort_x_percent()),
            turn: share(message.propulsive_rotational_effort_z_percent()),
            brake: share(message.resistive_linear_effort_x_percent()),
            turn_brake: share(message.resistive_rotational_effort_z_percent()),
        };
        tracing::debug!(source = %exchange.message.source, ?effort, acts, "wrench effort set");
        self.ticket = acts.then(|| exchange.pursue(Goal::Effort(effort), Validity::Brief));
        self.effort = message;
        exchange.context.changed::<QueryWrenchEffort>();
    }

    /// Clears the effort if another driver has replaced it.
    fn forget_what_others_replaced(&mut self, controls: &Controls) {
        if self
            .ticket
            .is_some_and(|ticket| !controls.pilot.pursues(ticket))
        {
            *self = Self::default();
        }
    }

    /// Reports the efforts that were set, and 0 for the others.
    fn report(&self) -> ReportWrenchEffort {
        let effort = &self.effort;
        let or_none = Option::unwrap_or_default;
        ReportWrenchEffort {
            propulsive_linear_effort_x: fields::PropulsiveLinearEffortX::new(or_none(
                effort.propulsive_linear_effort_x_percent(),
            ))
            .ok(),
            propulsive_linear_effort_y: fields::PropulsiveLinearEffortY::new(or_none(
                effort.propulsive_linear_effort_y_percent(),
            ))
            .ok(),
            propulsive_linear_effort_z: fields::PropulsiveLinearEffortZ::new(or_none(
                effort.propulsive_linear_effort_z_percent(),
            ))
            .ok(),
            propulsive_rotational_effort_x: fields::PropulsiveRotationalEffortX::new(or_none(
                effort.propulsive_rotational_effort_x_percent(),
            ))
            .ok(),
            propulsive_rotational_effort_y: fields::PropulsiveRotationalEffortY::new(or_none(
                effort.propulsive_rotational_effort_y_percent(),
            ))
            .ok(),
            propulsive_rotational_effort_z: fields::PropulsiveRotationalEffortZ::new(or_none(
                effort.propulsive_rotational_effort_z_percent(),
            ))
            .ok(),
            resistive_linear_effort_x: fields::ResistiveLinearEffortX::new(or_none(
                effort.resistive_linear_effort_x_percent(),
            ))
            .ok(),
            resistive_linear_effort_y: fields::ResistiveLinearEffortY::new(or_none(
                effort.resistive_linear_effort_y_percent(),
            ))
            .ok(),
            resistive_linear_effort_z: fields::ResistiveLinearEffortZ::new(or_none(
                effort.resistive_linear_effort_z_percent(),
            ))
            .ok(),
            resistive_rotational_effort_x: fields::ResistiveRotationalEffortX::new(or_none(
                effort.resistive_rotational_effort_x_percent(),
            ))
            .ok(),
            resistive_rotational_effort_y: fields::ResistiveRotationalEffortY::new(or_none(
                effort.resistive_rotational_effort_y_percent(),
            ))
            .ok(),
            resistive_rotational_effort_z: fields::ResistiveRotationalEffortZ::new(or_none(
                effort.resistive_rotational_effort_z_percent(),
            ))
            .ok(),
        }
    }
}
