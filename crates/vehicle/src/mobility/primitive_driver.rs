//! Primitive Driver: controls the vehicle's drives and brakes directly, without feedback.

use super::behaviour::Behaviour;
use super::both_versions;
use super::controls::Controls;
use super::exchange::{Command, Exchange};
use super::wanted::Wanted;
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
            QueryWrenchEffort::CODE => exchange.answer(|query, exchange| {
                self.forget_what_others_replaced(exchange.controls);
                self.report(query)
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
    fn report(&self, query: &QueryWrenchEffort) -> ReportWrenchEffort {
        let wanted = Wanted(query.presence_vector.into());
        let effort = &self.effort;
        let or_none = Option::unwrap_or_default;
        ReportWrenchEffort {
            propulsive_linear_effort_x: wanted.real(
                0,
                or_none(effort.propulsive_linear_effort_x_percent()),
                fields::PropulsiveLinearEffortX::new,
            ),
            propulsive_linear_effort_y: wanted.real(
                1,
                or_none(effort.propulsive_linear_effort_y_percent()),
                fields::PropulsiveLinearEffortY::new,
            ),
            propulsive_linear_effort_z: wanted.real(
                2,
                or_none(effort.propulsive_linear_effort_z_percent()),
                fields::PropulsiveLinearEffortZ::new,
            ),
            propulsive_rotational_effort_x: wanted.real(
                3,
                or_none(effort.propulsive_rotational_effort_x_percent()),
                fields::PropulsiveRotationalEffortX::new,
            ),
            propulsive_rotational_effort_y: wanted.real(
                4,
                or_none(effort.propulsive_rotational_effort_y_percent()),
                fields::PropulsiveRotationalEffortY::new,
            ),
            propulsive_rotational_effort_z: wanted.real(
                5,
                or_none(effort.propulsive_rotational_effort_z_percent()),
                fields::PropulsiveRotationalEffortZ::new,
            ),
            resistive_linear_effort_x: wanted.real(
                6,
                or_none(effort.resistive_linear_effort_x_percent()),
                fields::ResistiveLinearEffortX::new,
            ),
            resistive_linear_effort_y: wanted.real(
                7,
                or_none(effort.resistive_linear_effort_y_percent()),
                fields::ResistiveLinearEffortY::new,
            ),
            resistive_linear_effort_z: wanted.real(
                8,
                or_none(effort.resistive_linear_effort_z_percent()),
                fields::ResistiveLinearEffortZ::new,
            ),
            resistive_rotational_effort_x: wanted.real(
                9,
                or_none(effort.resistive_rotational_effort_x_percent()),
                fields::ResistiveRotationalEffortX::new,
            ),
            resistive_rotational_effort_y: wanted.real(
                10,
                or_none(effort.resistive_rotational_effort_y_percent()),
                fields::ResistiveRotationalEffortY::new,
            ),
            resistive_rotational_effort_z: wanted.real(
                11,
                or_none(effort.resistive_rotational_effort_z_percent()),
                fields::ResistiveRotationalEffortZ::new,
            ),
        }
    }
}
