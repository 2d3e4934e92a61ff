//! States, emergencies and time, common to all components.
//!
//! State codes are the same on both sides. The RA secondary status code is left out: its meaning
//! depends on the component, and ours has only a reserved field for it.

use super::carry::{Counterpart, same_bits, same_fields, same_presence};
use super::pair::Pair;
use super::{Context, Refusal};
use crate::messages::ra33;
use jaus::messages::core;

pub(super) const PAIRS: &[Pair] = &[
    Pair::of::<ra33::Shutdown, core::Shutdown>(),
    Pair::of::<ra33::Standby, core::Standby>(),
    Pair::of::<ra33::Resume, core::Resume>(),
    Pair::of::<ra33::Reset, core::Reset>(),
    Pair::of::<ra33::SetEmergency, core::SetEmergency>(),
    Pair::of::<ra33::ClearEmergency, core::ClearEmergency>(),
    Pair::of::<ra33::QueryComponentStatus, core::QueryStatus>(),
    Pair::of::<ra33::ReportComponentStatus, core::ReportStatus>(),
    Pair::of::<ra33::SetTime, core::SetTime>(),
    Pair::of::<ra33::QueryTime, core::QueryTime>(),
    Pair::of::<ra33::ReportTime, core::ReportTime>(),
    Pair::of::<ra33::QueryHeartbeatPulse, core::QueryHeartbeatPulse>(),
    Pair::of::<ra33::ReportHeartbeatPulse, core::ReportHeartbeatPulse>(),
];

same_fields! {
    ra33::Shutdown, core::Shutdown {}
    ra33::Standby, core::Standby {}
    ra33::Resume, core::Resume {}
    ra33::Reset, core::Reset {}
    ra33::QueryComponentStatus, core::QueryStatus {}
    ra33::SetTime, core::SetTime { time_stamp, date_stamp }
    ra33::ReportTime, core::ReportTime { time_stamp, date_stamp }
    ra33::QueryHeartbeatPulse, core::QueryHeartbeatPulse {}
    ra33::ReportHeartbeatPulse, core::ReportHeartbeatPulse {}
}

same_bits! {
    ra33::set_time::TimeStamp, core::set_time::TimeStamp;
    ra33::set_time::DateStamp, core::set_time::DateStamp;
}

/// The only emergency code known on both sides: stop.
const STOP: u16 = 1;

macro_rules! emergency {
    ($($from:path => $to:path, $code:path;)*) => {$(
        impl Counterpart<$to> for $from {
            fn counterpart(self, _: Context<'_>) -> Result<$to, Refusal> {
                type There = $to;
                match self.emergency_code.0 {
                    STOP => Ok(There { emergency_code: $code(STOP) }),
                    other => Err(Refusal::UnknownValue {
                        field: "EmergencyCode",
                        value: other.into(),
                    }),
                }
            }
        }
    )*};
}

emergency! {
    ra33::SetEmergency => core::SetEmergency, core::set_emergency::EmergencyCode;
    core::SetEmergency => ra33::SetEmergency, ra33::set_emergency::EmergencyCode;
    ra33::ClearEmergency => core::ClearEmergency, core::clear_emergency::EmergencyCode;
    core::ClearEmergency => ra33::ClearEmergency, ra33::clear_emergency::EmergencyCode;
}

/// Initialize, ready, standby, shutdown, failure, emergency.
const MOST_STATE: u8 = 5;

fn state(field: &'static str, code: u8) -> Result<u8, Refusal> {
    match code {
        0..=MOST_STATE => Ok(code),
        _ => Err(Refusal::UnknownValue {
            field,
            value: code.into(),
        }),
    }
}

impl Counterpart<core::ReportStatus> for ra33::ReportComponentStatus {
    fn counterpart(self, _: Context<'_>) -> Result<core::ReportStatus, Refusal> {
        let state = state("PrimaryStatusCode", self.primary_status_code.0)?;
        Ok(core::ReportStatus {
            status: core::report_status::Status(state),
            reserved: 0,
        })
    }
}

impl Counterpart<ra33::ReportComponentStatus> for core::ReportStatus {
    fn counterpart(self, _: Context<'_>) -> Result<ra33::ReportComponentStatus, Refusal> {
        use ra33::report_component_status::PrimaryStatusCode;
        Ok(ra33::ReportComponentStatus {
            primary_status_code: PrimaryStatusCode(state("Status", self.status.0)?),
            secondary_status_code: 0,
        })
    }
}

same_presence! {
    ra33::QueryTime, core::QueryTime: 2 fields;
}
