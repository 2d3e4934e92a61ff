//! A component's news for its program: its own standing, discovered components, and the queue of events.

use std::ffi::{c_int, c_void};
use std::time::Duration;

use jaus::component::Condition;
use jaus_binding::NOBODY;

use crate::argument::{check_out, message, put};
use crate::component::{COMPONENTS, edit, running};
use crate::status::{Failure, JausStatus, check_may_wait, run};
use crate::types::{
    JAUS_CONDITION_FAILED, JAUS_CONDITION_INITIALIZED, JAUS_CONDITION_SAFE,
    JAUS_CONDITION_STOP_RELEASED, JAUS_CONDITION_STOPPED, JausAddress, JausComponent, JausEvent,
    JausEventCallback,
};

/// Reports each change of the component's own state and of its controller: `JausEventKind_Standing`.
/// Before the start. Without a callback they are events of the component.
///
/// # Safety
/// Until the component is freed, `callback` can be called with `user` on any thread.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn jaus_component_on_standing(
    component: JausComponent,
    callback: JausEventCallback,
    user: *mut c_void,
) -> JausStatus {
    run(|| {
        edit(component.id, |draft, entry| {
            // SAFETY: as the caller guarantees.
            draft.on_standing = Some(unsafe { entry.sink(callback, user) });
            Ok(())
        })
    })
}

/// Reports components that are found and lost. Before the start. Without a callback they are events of
/// the component.
///
/// # Safety
/// Until the component is freed, `callback` can be called with `user` on any thread.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn jaus_component_on_discovery(
    component: JausComponent,
    callback: JausEventCallback,
    user: *mut c_void,
) -> JausStatus {
    run(|| {
        edit(component.id, |draft, entry| {
            // SAFETY: as the caller guarantees.
            draft.on_discovery = Some(unsafe { entry.sink(callback, user) });
            Ok(())
        })
    })
}

/// The address of a component that runs.
///
/// # Safety
/// `address` is null, or can be written.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn jaus_component_address(
    component: JausComponent,
    address: *mut JausAddress,
) -> JausStatus {
    run(|| {
        let (_, component) = running(component)?;
        // SAFETY: as the caller guarantees.
        unsafe { put(address, component.id().into(), "address") }
    })
}

/// The state of a component that runs, `JAUS_STATE_...`, and the client in control (0.0.0: nobody).
///
/// # Safety
/// `state` and `controller` are null, or can be written.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn jaus_component_standing(
    component: JausComponent,
    state: *mut u8,
    controller: *mut JausAddress,
) -> JausStatus {
    run(|| {
        check_out(state, "state")?;
        check_out(controller, "controller")?;
        let standing = running(component)?.1.standing();
        let client = standing.controller.map_or(NOBODY, |it| it.id);
        // SAFETY: as the caller guarantees.
        unsafe { put(state, standing.state as u8, "state") }?;
        // SAFETY: as the caller guarantees.
        unsafe { put(controller, client.into(), "controller") }
    })
}

/// The next event of a component, or null after `timeout` milliseconds without one; a negative timeout
/// waits for ever. The event is valid until the next call, or until the component is freed, so one thread
/// at a time may call this. Fails with `JausStatus_Stopped` when the component has ended and all events
/// are fetched. Only with a timeout of 0 in a callback.
///
/// # Safety
/// `event` is null, or can be written.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn jaus_component_next_event(
    component: JausComponent,
    timeout: i32,
    event: *mut *const JausEvent,
) -> JausStatus {
    run(|| {
        check_out(event, "event")?;
        if timeout != 0 {
            check_may_wait()?;
        }
        let entry = COMPONENTS.get(component.id)?;
        let limit = u64::try_from(timeout).ok().map(Duration::from_millis);
        entry.shown.clear();
        let next = entry.queue.next(limit);
        let next =
            next.map_err(|_| Failure::new(JausStatus::Stopped, "the component has stopped"))?;
        let next = entry.shown.show(next);
        // SAFETY: as the caller guarantees.
        unsafe { put(event, next, "event") }
    })
}

/// A descriptor that is readable while events wait, for `poll`, `select` and the like. It belongs to the
/// library: neither read nor close it. Call `jaus_component_next_event` with a timeout of 0 when it is
/// readable, until there is no event.
///
/// # Safety
/// `descriptor` is null, or can be written.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn jaus_component_descriptor(
    component: JausComponent,
    descriptor: *mut c_int,
) -> JausStatus {
    run(|| {
        let entry = COMPONENTS.get(component.id)?;
        // SAFETY: as the caller guarantees.
        unsafe { put(descriptor, entry.queue.descriptor(), "descriptor") }
    })
}

/// How many events were dropped because more than 1024 waited: the oldest reports first.
///
/// # Safety
/// `count` is null, or can be written.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn jaus_component_dropped_events(
    component: JausComponent,
    count: *mut u64,
) -> JausStatus {
    run(|| {
        let entry = COMPONENTS.get(component.id)?;
        // SAFETY: as the caller guarantees.
        unsafe { put(count, entry.queue.dropped(), "count") }
    })
}

/// Publishes a report, `length` octets from its code: queries are answered with it from now on, and
/// subscribers get it. A service must publish it, see `jaus_service_publish`. Does not wait.
///
/// # Safety
/// `data` is null, or points to `length` octets.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn jaus_component_publish(
    component: JausComponent,
    data: *const u8,
    length: usize,
) -> JausStatus {
    run(|| {
        // SAFETY: as the caller guarantees.
        let report = unsafe { message(data, length) }?;
        let (entry, component) = running(component)?;
        let query = entry.publications.publish(report).map_err(|error| {
            let text = format!("{error}: call jaus_service_publish with the code of its query");
            Failure::new(JausStatus::NotFound, text)
        })?;
        let runtime = entry.node.runtime.handle();
        entry.publications.announce(runtime, component, query);
        Ok(())
    })
}

/// Tells subscribers of the query with this message code that its answer has changed. Does not wait.
#[unsafe(no_mangle)]
pub extern "C" fn jaus_component_changed(component: JausComponent, query: u16) -> JausStatus {
    run(|| {
        let (entry, component) = running(component)?;
        let runtime = entry.node.runtime.handle();
        entry.publications.announce(runtime, component, query);
        Ok(())
    })
}

/// Sets the condition of the component, `JAUS_CONDITION_...`, which Management reports to clients. Does
/// not wait.
#[unsafe(no_mangle)]
pub extern "C" fn jaus_component_set_condition(
    component: JausComponent,
    condition: u8,
) -> JausStatus {
    run(|| {
        let condition = match condition {
            JAUS_CONDITION_INITIALIZED => Condition::Initialized,
            JAUS_CONDITION_FAILED => Condition::Failed,
            JAUS_CONDITION_SAFE => Condition::Safe,
            JAUS_CONDITION_STOPPED => Condition::Stopped,
            JAUS_CONDITION_STOP_RELEASED => Condition::StopReleased,
            other => {
                return Err(Failure::argument(format!(
                    "condition {other}: choose 0 to 4"
                )));
            }
        };
        let (entry, component) = running(component)?;
        let runtime = entry.node.runtime.handle();
        runtime.spawn(async move { component.set_condition(condition).await });
        Ok(())
    })
}
