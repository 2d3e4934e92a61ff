//! Control and authority, 000Dh to 0010h and their queries and reports.
//!
//! Authority codes are octets on both sides; a greater one outranks a smaller one, and they convert
//! unchanged. The answers to a request correspond one to one: *not supported* is our *not
//! available*, *not accepted* our *insufficient authority*. Reject Component Control only says that
//! the receiver has no control: OpenJAUS sends it after a denied request and after a loss of
//! control. Ours gives a reason; converted from RA it is *control released*, to RA the reason is
//! lost.

use super::carry::{Counterpart, same_fields};
use super::pair::Pair;
use super::{Context, Refusal};
use crate::RaId;
use crate::messages::ra33;
use jaus::address::JausId;
use jaus::messages::core;

pub(super) const PAIRS: &[Pair] = &[
    Pair::of::<ra33::RequestComponentControl, core::RequestControl>(),
    Pair::of::<ra33::ReleaseComponentControl, core::ReleaseControl>(),
    Pair::of::<ra33::ConfirmComponentControl, core::ConfirmControl>(),
    Pair::of::<ra33::RejectComponentControl, core::RejectControl>(),
    Pair::of::<ra33::QueryComponentControl, core::QueryControl>(),
    Pair::of::<ra33::ReportComponentControl, core::ReportControl>(),
    Pair::of::<ra33::SetComponentAuthority, core::SetAuthority>(),
    Pair::of::<ra33::QueryComponentAuthority, core::QueryAuthority>(),
    Pair::of::<ra33::ReportComponentAuthority, core::ReportAuthority>(),
];

same_fields! {
    ra33::ReleaseComponentControl, core::ReleaseControl {}
    ra33::QueryComponentControl, core::QueryControl {}
    ra33::QueryComponentAuthority, core::QueryAuthority {}
    ra33::RequestComponentControl, core::RequestControl { authority_code }
    ra33::SetComponentAuthority, core::SetAuthority { authority_code }
    ra33::ReportComponentAuthority, core::ReportAuthority { authority_code }
}

/// Accepted, not supported or available, not accepted for lack of authority.
const MOST_RESPONSE: u8 = 2;

fn response(code: u8) -> Result<u8, Refusal> {
    match code {
        0..=MOST_RESPONSE => Ok(code),
        _ => Err(Refusal::UnknownValue {
            field: "ResponseCode",
            value: code.into(),
        }),
    }
}

impl Counterpart<core::ConfirmControl> for ra33::ConfirmComponentControl {
    fn counterpart(self, _: Context<'_>) -> Result<core::ConfirmControl, Refusal> {
        let code = response(self.response_code.0)?;
        Ok(core::ConfirmControl {
            response_code: core::confirm_control::ResponseCode(code),
        })
    }
}

impl Counterpart<ra33::ConfirmComponentControl> for core::ConfirmControl {
    fn counterpart(self, _: Context<'_>) -> Result<ra33::ConfirmComponentControl, Refusal> {
        let code = response(self.response_code.0)?;
        Ok(ra33::ConfirmComponentControl {
            response_code: ra33::confirm_component_control::ResponseCode(code),
        })
    }
}

impl Counterpart<core::RejectControl> for ra33::RejectComponentControl {
    fn counterpart(self, _: Context<'_>) -> Result<core::RejectControl, Refusal> {
        Ok(core::RejectControl {
            response_code: core::reject_control::ResponseCode::CONTROL_RELEASED,
        })
    }
}

impl Counterpart<ra33::RejectComponentControl> for core::RejectControl {
    fn counterpart(self, _: Context<'_>) -> Result<ra33::RejectComponentControl, Refusal> {
        Ok(ra33::RejectComponentControl)
    }
}

/// No controller: an id of zeros, on both sides.
impl Counterpart<core::ReportControl> for ra33::ReportComponentControl {
    fn counterpart(self, context: Context<'_>) -> Result<core::ReportControl, Refusal> {
        let id = RaId {
            subsystem: self.subsystem_id,
            node: self.node_id,
            component: self.component_id,
            instance: self.instance_id,
        };
        let seen = match JausId::from(id).to_u32() {
            0 => JausId::from_u32(0),
            _ => context.jaus_id(id).ok_or(UNKNOWN_CONTROLLER)?,
        };
        Ok(core::ReportControl {
            subsystem_id: seen.subsystem(),
            node_id: seen.node(),
            component_id: seen.component(),
            authority_code: self.authority_code,
        })
    }
}

impl Counterpart<ra33::ReportComponentControl> for core::ReportControl {
    fn counterpart(self, context: Context<'_>) -> Result<ra33::ReportComponentControl, Refusal> {
        let id = JausId::new(self.subsystem_id, self.node_id, self.component_id);
        let seen = match id.to_u32() {
            0 => RaId::from(id),
            _ => context.ra_id(id).ok_or(UNKNOWN_CONTROLLER)?,
        };
        Ok(ra33::ReportComponentControl {
            subsystem_id: seen.subsystem,
            node_id: seen.node,
            component_id: seen.component,
            instance_id: seen.instance,
            authority_code: self.authority_code,
        })
    }
}

const UNKNOWN_CONTROLLER: Refusal = Refusal::UnknownId {
    field: "SubsystemID, NodeID, ComponentID",
};
