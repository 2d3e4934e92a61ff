//! Set Velocity State, 0404h: our Set Velocity Command, 0415h, that sets the current command.
//!
//! Our other kinds of commands (limits, defaults) have no counterpart. RA uses the record of the
//! report, so the command has deviations and a time stamp; they mean nothing there and are left
//! out.

use super::carry::{Carry, Counterpart};
use super::pair::Pair;
use super::{Context, Refusal};
use crate::messages::ra33;
use jaus::messages::mobility;
use jaus::messages::mobility::set_velocity_command::CommandType;

pub(super) const PAIRS: &[Pair] = &[Pair::of::<
    ra33::SetVelocityState,
    mobility::SetVelocityCommand,
>()];

impl Counterpart<mobility::SetVelocityCommand> for ra33::SetVelocityState {
    fn counterpart(self, _: Context<'_>) -> Result<mobility::SetVelocityCommand, Refusal> {
        Ok(mobility::SetVelocityCommand {
            command_type: CommandType::SET_CURRENT_COMMAND,
            velocity_x: self.velocity_x.carry()?,
            velocity_y: self.velocity_y.carry()?,
            velocity_z: self.velocity_z.carry()?,
            roll_rate: self.roll_rate.carry()?,
            pitch_rate: self.pitch_rate.carry()?,
            yaw_rate: self.yaw_rate.carry()?,
        })
    }
}

impl Counterpart<ra33::SetVelocityState> for mobility::SetVelocityCommand {
    fn counterpart(self, _: Context<'_>) -> Result<ra33::SetVelocityState, Refusal> {
        if self.command_type != CommandType::SET_CURRENT_COMMAND {
            return Err(Refusal::UnknownValue {
                field: "CommandType",
                value: self.command_type.0.into(),
            });
        }
        Ok(ra33::SetVelocityState {
            velocity_x: self.velocity_x.carry()?,
            velocity_y: self.velocity_y.carry()?,
            velocity_z: self.velocity_z.carry()?,
            roll_rate: self.roll_rate.carry()?,
            pitch_rate: self.pitch_rate.carry()?,
            yaw_rate: self.yaw_rate.carry()?,
            ..ra33::SetVelocityState::default()
        })
    }
}
