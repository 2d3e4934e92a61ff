//! The rules on messages of the catalogue.
#![cfg(feature = "mobility")]

mod carried;
mod definitions;
mod fragments;
mod groups;
mod properties;
mod selections;
mod words;

use bytes::Bytes;

use crate::codec::Message;
use crate::messages::core::{
    ClearEmergency, QueryIdentification, RequestControl, SetEmergency, Shutdown, Standby,
};
use crate::messages::mobility::{QueryVelocityState, SetTravelSpeed, SetWrenchEffort};
use crate::wire::{Flags, Version};

use super::*;

const VEHICLE: JausId = JausId::new(101, 1, 1);

fn frame(payload: impl Into<Bytes>) -> Frame {
    Frame::new(JausId::new(60, 1, 1), VEHICLE, payload.into())
}

fn check(rules: &str, message: &impl Message) -> Result<(), Refusal> {
    let payload = message.encode().unwrap();
    rules
        .parse::<Rules>()
        .unwrap()
        .check(&frame(payload), &Table::default())
}

/// Whether rules of this text let octets pass to the vehicle.
fn check_octets(rules: &str, message: &[u8]) -> Result<(), Refusal> {
    check_to(rules, VEHICLE, message)
}

/// Whether rules of this text let octets pass to these ids.
fn check_to(rules: &str, destination: JausId, message: &[u8]) -> Result<(), Refusal> {
    let frame = Frame {
        destination,
        ..frame(message.to_vec())
    };
    let rules: Rules = rules.parse().unwrap();
    rules.check(&frame, &Table::default())
}

/// Set Element: request 1, one element: 1 between 0 and 0, and this message.
fn element(message: &[u8]) -> Vec<u8> {
    let head = [0x1A, 0x04, 1, 1, 1, 0, 0, 0, 0, 0, 0];
    [&head[..], &(message.len() as u16).to_le_bytes(), message].concat()
}

/// Spool Mission: mission 1 of 60.1.1, and one task for each message, to this component.
fn mission_to(messages: &[(JausId, &[u8])]) -> Vec<u8> {
    let tasks = (messages.len() as u16).to_le_bytes();
    let mut octets = [&[0x00, 0x0E, 1, 0, 1, 1, 60, 0][..], &tasks].concat();
    for (to, message) in messages {
        octets.extend([1, 0, 1, 0, 1, 0]);
        octets.extend(to.to_wire());
        octets.extend((message.len() as u32).to_le_bytes());
        octets.extend_from_slice(message);
        // It does not block, and has no tasks below it.
        octets.extend([0, 0, 0]);
    }
    octets
}

/// Spool Mission with one message to the vehicle.
fn mission(message: &[u8]) -> Vec<u8> {
    mission_to(&[(VEHICLE, message)])
}

/// Create Command Event: request 1, 10 s, and this message.
fn command_event(message: &[u8]) -> Vec<u8> {
    let length = (message.len() as u32).to_le_bytes();
    [&[0xF6, 0x01, 1, 10, 0, 0, 0][..], &length, message].concat()
}

/// Create Event: request 1, periodic, and this message.
fn event(message: &[u8]) -> Vec<u8> {
    let length = (message.len() as u32).to_le_bytes();
    [&[0xF0, 0x01, 1, 0, 0, 1][..], &length, message].concat()
}

fn request(authority_code: u8) -> RequestControl {
    RequestControl { authority_code }
}
