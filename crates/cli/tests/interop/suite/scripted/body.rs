//! Messages of scripted peers, octet by octet.

use jaus::address::JausId;

pub(super) const STANDBY: u16 = 0x0003;
pub(super) const RESUME: u16 = 0x0004;
pub(super) const REQUEST_CONTROL: u16 = 0x000D;
pub(super) const RELEASE_CONTROL: u16 = 0x000E;
pub(super) const CONFIRM_CONTROL: u16 = 0x000F;
pub(super) const REJECT_CONTROL: u16 = 0x0010;
pub(super) const CREATE_EVENT: u16 = 0x01F0;
pub(super) const UPDATE_EVENT: u16 = 0x01F1;
pub(super) const CANCEL_EVENT: u16 = 0x01F2;
pub(super) const CONFIRM_EVENT: u16 = 0x01F3;
pub(super) const SET_WRENCH_EFFORT: u16 = 0x0405;
pub(super) const REGISTER_SERVICES: u16 = 0x0B00;
pub(super) const QUERY_AUTHORITY: u16 = 0x2001;
pub(super) const QUERY_STATUS: u16 = 0x2002;
pub(super) const QUERY_TIMEOUT: u16 = 0x2003;
pub(super) const QUERY_CONTROL: u16 = 0x200D;
pub(super) const QUERY_EVENTS: u16 = 0x21F0;
pub(super) const QUERY_HEARTBEAT: u16 = 0x2202;
pub(super) const QUERY_VELOCITY: u16 = 0x2404;
pub(super) const QUERY_IDENTIFICATION: u16 = 0x2B00;
pub(super) const QUERY_CONFIGURATION: u16 = 0x2B01;
pub(super) const QUERY_SERVICES: u16 = 0x2B03;
pub(super) const EVENT: u16 = 0x41F1;
pub(super) const TEST: u16 = 0xD7F0;

/// Code of the report that answers a query.
pub(super) const fn report(query: u16) -> u16 {
    query + 0x2000
}

/// Full scale of Set Wrench Effort: ±100 percent.
const EFFORT: f64 = 100.0;
/// The velocity encoded as 0, and the step.
const SLOWEST: f64 = -327.68;
const STEP: f64 = 655.35 / u32::MAX as f64;

/// A message: its code, then its fields.
pub(super) fn message(code: u16, parts: &[&[u8]]) -> Vec<u8> {
    let mut message = code.to_le_bytes().to_vec();
    parts.iter().for_each(|part| message.extend(*part));
    message
}

/// The code of a message, if there is one.
pub(super) fn code(message: &[u8]) -> Option<u16> {
    Some(u16::from_le_bytes(*message.first_chunk()?))
}

/// Report Velocity State with the forward velocity only, in m/s.
pub(super) fn velocity(x: f64) -> Vec<u8> {
    let raw = ((x - SLOWEST) / STEP).round() as u32;
    message(report(QUERY_VELOCITY), &[&[1, 0], &raw.to_le_bytes()])
}

/// The forward velocity in a report whose first field it is.
pub(super) fn velocity_in(report: &[u8]) -> Option<f64> {
    let present = report.get(2)? & 1 == 1;
    let raw = u32::from_le_bytes(*report.get(4..)?.first_chunk()?);
    present.then_some(SLOWEST + f64::from(raw) * STEP)
}

/// Set Wrench Effort with the forward effort only, in percent.
pub(super) fn push(percent: f64) -> Vec<u8> {
    let raw = ((percent + EFFORT) / (2.0 * EFFORT) * f64::from(u16::MAX)).round() as u16;
    message(SET_WRENCH_EFFORT, &[&[1, 0], &raw.to_le_bytes()])
}

/// The forward effort of a command whose first field it is, in percent.
pub(super) fn push_in(command: &[u8]) -> Option<f64> {
    let present = command.get(2)? & 1 == 1;
    let raw = u16::from_le_bytes(*command.get(4..)?.first_chunk()?);
    present.then_some(f64::from(raw) / f64::from(u16::MAX) * 2.0 * EFFORT - EFFORT)
}

/// Create Event for a query: periodic at a rate in hertz, or on every change.
pub(super) fn create_event(request: u8, hz: Option<f64>, query: &[u8]) -> Vec<u8> {
    // 0 is periodic, 1 on every change; the rate ranges from 0 to 1092 Hz.
    let rate = (hz.unwrap_or(0.0) / 1092.0 * f64::from(u16::MAX)).round() as u16;
    let head = [request, u8::from(hz.is_none())];
    let length = (query.len() as u32).to_le_bytes();
    message(CREATE_EVENT, &[&head, &rate.to_le_bytes(), &length, query])
}

/// The report inside an event.
pub(super) fn report_in(event: &[u8]) -> Option<&[u8]> {
    event.get(8..)
}

/// A test message: octets that differ from packet to packet.
pub(super) fn test(size: usize) -> Vec<u8> {
    let octet = |index: usize| (index.wrapping_mul(7) + index / 251) as u8;
    let mut test: Vec<u8> = (0..size).map(octet).collect();
    test[..2].copy_from_slice(&TEST.to_le_bytes());
    test
}

/// A service list of one component, as in Register Services and Report Services.
pub(super) fn services(urns: &[&str]) -> Vec<u8> {
    let mut list = vec![urns.len() as u8];
    for urn in urns {
        list.push(urn.len() as u8);
        list.extend(urn.as_bytes());
        // Version 1.0.
        list.extend([1, 0]);
    }
    list
}

/// A report about this component only: one node, one component, instance 0.
pub(super) fn alone(code: u16, id: JausId, rest: &[u8]) -> Vec<u8> {
    message(code, &[&[1, id.node(), 1, id.component(), 0], rest])
}
