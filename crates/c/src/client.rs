//! A component as a client: discovery, queries and messages.

use std::ffi::c_char;
use std::time::Duration;

use bytes::Bytes;
use jaus::component::{
    Component, ControlError, DeliverError, FindError, ManageError, QueryError, QueryOptions,
    SendError,
};
use jaus::messages::registry;

use crate::argument::{check_out, code_of, limit, message, one_component, priority, put, text};
use crate::component::running;
use crate::status::{Failure, JausStatus, run};
use crate::types::{JausAddress, JausComponent, JausMessage};

/// Why a query has no answer.
fn unanswered(error: &QueryError) -> Failure {
    let status = match error {
        QueryError::NoAnswer { .. } => JausStatus::NoAnswer,
        QueryError::NotOffered { .. } => JausStatus::NotFound,
        QueryError::Stopped => JausStatus::Stopped,
        _ => JausStatus::NotSent,
    };
    Failure::of(status, error)
}

pub(crate) fn not_sent(error: &SendError) -> Failure {
    Failure::of(JausStatus::NotSent, error)
}

pub(crate) fn undelivered(error: &DeliverError) -> Failure {
    Failure::of(JausStatus::NotSent, error)
}

/// Why there is no control, or why it is lost.
pub(crate) fn uncontrolled(error: &ControlError) -> Failure {
    let status = match error {
        ControlError::Refused { .. } => JausStatus::Refused,
        ControlError::Lost { .. } => JausStatus::ControlLost,
        ControlError::NotReady { .. } => JausStatus::NotReady,
        ControlError::Stopped => JausStatus::Stopped,
        _ => JausStatus::NotSent,
    };
    Failure::of(status, error)
}

/// Why a peer did not reach a state.
pub(crate) fn unmanaged(error: &ManageError) -> Failure {
    match error {
        ManageError::State { .. } => Failure::of(JausStatus::Refused, error),
        ManageError::Control(control) => uncontrolled(control),
        ManageError::Query(query) => unanswered(query),
        _ => Failure::of(JausStatus::NotSent, error),
    }
}

/// The answer of a peer to a query.
async fn ask(
    component: &Component,
    peer: JausAddress,
    query: Bytes,
    report: u16,
    options: QueryOptions,
) -> Result<Bytes, Failure> {
    let answer = component
        .query_undecoded(options, peer.into(), query, report)
        .await;
    answer.map_err(|error| unanswered(&error))
}

/// The code of the report that answers a query: as given, or by the standard's numbers.
pub(crate) fn report_of(query: &Bytes, given: u16) -> Result<u16, Failure> {
    let code = code_of(query);
    match given {
        0 => registry().report_of(code).ok_or_else(|| {
            Failure::argument(format!(
                "{code:04X}h is not the code of a query: give the code of its report"
            ))
        }),
        given => Ok(given),
    }
}

/// Waits until another component is known that offers a service, in any version, for at most `timeout`
/// milliseconds (0: 10 s). Not in a callback.
///
/// # Safety
/// `urn` is null, or a text that ends with a 0. `found` is null, or can be written.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn jaus_component_find(
    component: JausComponent,
    urn: *const c_char,
    timeout: u32,
    found: *mut JausAddress,
) -> JausStatus {
    run(|| {
        check_out(found, "found")?;
        // SAFETY: as the caller guarantees.
        let urn = unsafe { text(urn, "urn") }?;
        let (entry, component) = running(component)?;
        let limit = limit(timeout, Component::FIND_LIMIT);
        let id = entry.node.runtime.wait(component.find_within(urn, limit))?;
        let id = id.map_err(|error| match error {
            FindError::Stopped => Failure::of(JausStatus::Stopped, &error),
            _ => Failure::of(JausStatus::NotFound, &error),
        })?;
        // SAFETY: as the caller guarantees.
        unsafe { put(found, id.into(), "found") }
    })
}

/// Lists the known components that offer a service: at most `capacity` of them into `addresses`, and
/// how many there are into `count`. Does not wait.
///
/// # Safety
/// `urn` is null, or a text that ends with a 0. `addresses` is null and `capacity` 0, or `capacity`
/// addresses can be written to it. `count` is null, or can be written.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn jaus_component_providers(
    component: JausComponent,
    urn: *const c_char,
    addresses: *mut JausAddress,
    capacity: usize,
    count: *mut usize,
) -> JausStatus {
    run(|| {
        check_out(count, "count")?;
        // SAFETY: as the caller guarantees.
        let urn = unsafe { text(urn, "urn") }?;
        let (_, component) = running(component)?;
        let directory = component.directory();
        let mut total = 0;
        for provider in directory.offering(urn) {
            if total < capacity {
                let place = addresses.wrapping_add(total);
                // SAFETY: as the caller guarantees, there is room for `capacity` of them.
                unsafe { put(place, provider.id.into(), "addresses") }?;
            }
            total += 1;
        }
        // SAFETY: as the caller guarantees.
        unsafe { put(count, total, "count") }
    })
}

/// Sends a query, `length` octets from its code, and waits for the report with the code `report` (0: the
/// code that the standard's numbers give). Repeats the query until `timeout` milliseconds have passed
/// (0: 1.5 s). Not in a callback. Free the answer with `jaus_message_free`.
///
/// # Safety
/// `data` is null, or points to `length` octets. `answer` is null, or can be written.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn jaus_component_query(
    component: JausComponent,
    peer: JausAddress,
    data: *const u8,
    length: usize,
    report: u16,
    timeout: u32,
    answer: *mut JausMessage,
) -> JausStatus {
    run(|| {
        check_out(answer, "answer")?;
        // SAFETY: as the caller guarantees.
        let query = unsafe { message(data, length) }?;
        let report = report_of(&query, report)?;
        let (entry, component) = running(component)?;
        let options = match timeout {
            0 => QueryOptions::default(),
            timeout => QueryOptions::default().within(Duration::from_millis(timeout.into())),
        };
        let asking = ask(&component, peer, query, report, options);
        let octets: Box<[u8]> = entry.node.runtime.wait(asking)??.to_vec().into();
        let length = octets.len();
        let data = Box::into_raw(octets).cast();
        // SAFETY: as the caller guarantees.
        unsafe { put(answer, JausMessage { data, length }, "answer") }
    })
}

/// Frees the answer to a query, and sets it to null. Without effect if it is null.
///
/// # Safety
/// `message` is null, or one that `jaus_component_query` has written and that was not changed.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn jaus_message_free(message: *mut JausMessage) {
    // SAFETY: as the caller guarantees.
    let Some(message) = (unsafe { message.as_mut() }) else {
        return;
    };
    let data = std::mem::replace(&mut message.data, std::ptr::null_mut());
    let length = std::mem::take(&mut message.length);
    if !data.is_null() {
        let octets = std::ptr::slice_from_raw_parts_mut(data, length);
        // SAFETY: `jaus_component_query` made it of a box of this length, and it was not freed since.
        drop(unsafe { Box::from_raw(octets) });
    }
}

/// Sends a message, `length` octets from its code, with `JAUS_PRIORITY_...`. Does not wait. Success does
/// not mean that it arrives. `destination` may have wildcards.
///
/// # Safety
/// `data` is null, or points to `length` octets.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn jaus_component_send(
    component: JausComponent,
    destination: JausAddress,
    urgency: u8,
    data: *const u8,
    length: usize,
) -> JausStatus {
    run(|| {
        // SAFETY: as the caller guarantees.
        let message = unsafe { message(data, length) }?;
        let urgency = priority(urgency)?;
        let (entry, component) = running(component)?;
        let _on_runtime = entry.node.runtime.handle().enter();
        let sent = component.send_undecoded(urgency, destination.into(), message);
        sent.map_err(|error| not_sent(&error))
    })
}

/// Like `jaus_component_send`, with retransmission, and waits until the receiver acknowledges. Not in a
/// callback.
///
/// # Safety
/// `data` is null, or points to `length` octets.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn jaus_component_deliver(
    component: JausComponent,
    destination: JausAddress,
    urgency: u8,
    data: *const u8,
    length: usize,
) -> JausStatus {
    run(|| {
        // SAFETY: as the caller guarantees.
        let message = unsafe { message(data, length) }?;
        let urgency = priority(urgency)?;
        let destination = one_component(destination)?;
        let (entry, component) = running(component)?;
        let delivery = component.deliver_undecoded(urgency, destination, message);
        let delivered = entry.node.runtime.wait(delivery)?;
        delivered.map_err(|error| undelivered(&error))
    })
}

/// Sets an emergency at a peer that offers Management, and waits until it reports that. The peer stops
/// until `jaus_component_clear_emergency`. This needs no control. Not in a callback.
#[unsafe(no_mangle)]
pub extern "C" fn jaus_component_set_emergency(
    component: JausComponent,
    peer: JausAddress,
) -> JausStatus {
    run(|| {
        let peer = one_component(peer)?;
        let (entry, component) = running(component)?;
        let set = entry.node.runtime.wait(component.set_emergency(peer))?;
        set.map_err(|error| unmanaged(&error))
    })
}

/// Clears an emergency that this component has set. Not in a callback.
#[unsafe(no_mangle)]
pub extern "C" fn jaus_component_clear_emergency(
    component: JausComponent,
    peer: JausAddress,
) -> JausStatus {
    run(|| {
        let peer = one_component(peer)?;
        let (entry, component) = running(component)?;
        let cleared = entry.node.runtime.wait(component.clear_emergency(peer))?;
        cleared.map_err(|error| unmanaged(&error))
    })
}
