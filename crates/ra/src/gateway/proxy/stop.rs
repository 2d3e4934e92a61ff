//! Stop commands of RA drivers. Drivers based on OpenJAUS's library keep the last command in every
//! state, so the stop is a command of the kind that moved them. They also keep the fields that a
//! command leaves out, so every effort names all of them: the next one releases the brakes again.

use bytes::Bytes;

use super::codes::{SET_GLOBAL_VECTOR, SET_LOCAL_VECTOR};
use super::lease::Halt;
use crate::ids::RaComponent;
use crate::messages::ra33::{SetGlobalVector, SetLocalVector, SetTravelSpeed, SetWrenchEffort};
use jaus::codec::{Message, OutOfRange};

/// Stop procedure of a component of this type; `None` if it is no driver.
pub(super) fn halt(part: RaComponent) -> Option<Halt> {
    part.is_driver().then(|| Halt {
        command: command(part),
    })
}

/// The stop command of a component type, where it depends on the type alone.
pub(super) fn command(part: RaComponent) -> Option<(u16, Bytes)> {
    match part {
        RaComponent::PRIMITIVE_DRIVER => encoded(&no_effort().ok()?),
        RaComponent::GLOBAL_VECTOR_DRIVER => encoded(&no_global_speed().ok()?),
        RaComponent::LOCAL_VECTOR_DRIVER => encoded(&no_local_speed().ok()?),
        RaComponent::GLOBAL_WAYPOINT_DRIVER
        | RaComponent::LOCAL_WAYPOINT_DRIVER
        | RaComponent::GLOBAL_PATH_SEGMENT_DRIVER
        | RaComponent::LOCAL_PATH_SEGMENT_DRIVER => encoded(&SetTravelSpeed::default()),
        _ => None,
    }
}

/// The stop command after another command: a vector keeps its heading to avoid a turn.
pub(super) fn after(part: RaComponent, (code, data): (u16, &Bytes)) -> Option<(u16, Bytes)> {
    match code {
        SET_LOCAL_VECTOR => {
            let mut vector = decoded::<SetLocalVector>(code, data)?;
            vector.set_speed_m_per_s(0.0).ok()?;
            encoded(&vector)
        }
        SET_GLOBAL_VECTOR => {
            let mut vector = decoded::<SetGlobalVector>(code, data)?;
            vector.set_speed_m_per_s(0.0).ok()?;
            encoded(&vector)
        }
        _ => command(part),
    }
}

/// A client's effort with 0 in each field that it leaves out, as JAUS drivers take it.
pub(super) fn with_every_field(data: &Bytes) -> Option<Bytes> {
    let given = decoded::<SetWrenchEffort>(SetWrenchEffort::CODE, data)?;
    let zero = zero_effort().ok()?;
    macro_rules! or_zero {
        ($($field:ident)*) => { SetWrenchEffort { $($field: given.$field.or(zero.$field)),* } };
    }
    let effort = or_zero! {
        propulsive_linear_effort_x propulsive_linear_effort_y propulsive_linear_effort_z
        propulsive_rotational_effort_x propulsive_rotational_effort_y propulsive_rotational_effort_z
        resistive_linear_effort_x resistive_linear_effort_y resistive_linear_effort_z
        resistive_rotational_effort_x resistive_rotational_effort_y resistive_rotational_effort_z
    };
    encoded(&effort).map(|(_, data)| data)
}

/// No propulsion, and full brakes.
fn no_effort() -> Result<SetWrenchEffort, OutOfRange> {
    let mut effort = zero_effort()?;
    effort.set_resistive_linear_effort_x_percent(100.0)?;
    Ok(effort)
}

/// Neither propulsion nor brakes.
fn zero_effort() -> Result<SetWrenchEffort, OutOfRange> {
    let mut effort = SetWrenchEffort::default();
    effort.set_propulsive_linear_effort_x_percent(0.0)?;
    effort.set_propulsive_linear_effort_y_percent(0.0)?;
    effort.set_propulsive_linear_effort_z_percent(0.0)?;
    effort.set_propulsive_rotational_effort_x_percent(0.0)?;
    effort.set_propulsive_rotational_effort_y_percent(0.0)?;
    effort.set_propulsive_rotational_effort_z_percent(0.0)?;
    effort.set_resistive_linear_effort_x_percent(0.0)?;
    effort.set_resistive_linear_effort_y_percent(0.0)?;
    effort.set_resistive_linear_effort_z_percent(0.0)?;
    effort.set_resistive_rotational_effort_x_percent(0.0)?;
    effort.set_resistive_rotational_effort_y_percent(0.0)?;
    effort.set_resistive_rotational_effort_z_percent(0.0)?;
    Ok(effort)
}

fn no_global_speed() -> Result<SetGlobalVector, OutOfRange> {
    let mut vector = SetGlobalVector::default();
    vector.set_speed_m_per_s(0.0)?;
    Ok(vector)
}

/// The heading is mandatory. The heading of the current vector is unknown here, and standing still
/// matters more than the direction.
fn no_local_speed() -> Result<SetLocalVector, OutOfRange> {
    let mut vector = SetLocalVector::default();
    vector.set_speed_m_per_s(0.0)?;
    vector.set_heading_rad(0.0)?;
    Ok(vector)
}

/// Code and data of a message.
fn encoded<M: Message>(message: &M) -> Option<(u16, Bytes)> {
    let payload = message.encode().ok()?;
    Some((M::CODE, payload.slice(2..)))
}

fn decoded<M: Message>(code: u16, data: &Bytes) -> Option<M> {
    let payload = [&code.to_le_bytes()[..], data].concat();
    M::decode(&Bytes::from(payload)).ok()
}
