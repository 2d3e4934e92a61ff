//! The services that a component offers, as functions of the program.

use std::ffi::{c_char, c_void};
use std::sync::Arc;

use jaus::component::{Handlers, UndecodedFunctions, Validity};
use jaus::endpoint::Received;
use jaus::messages::registry;
use jaus_binding::{ServiceKey, service_id};

use crate::argument::{check_out, message, put, text};
use crate::callback::Callback;
use crate::component::{ComponentEntry, ServiceDraft, edit};
use crate::event::Event;
use crate::status::{Failure, JausStatus, run};
use crate::types::{
    JAUS_VALIDITY_BRIEF, JAUS_VALIDITY_BY_CODE, JAUS_VALIDITY_UNTIL_DONE,
    JAUS_VALIDITY_WHILE_ALIVE, JausAnswer, JausAnswerCallback, JausComponent, JausEventCallback,
    JausService, JausStopCallback,
};

type ServiceHandlers = Handlers<UndecodedFunctions>;

fn validity(number: u8, code: u16) -> Result<Validity, Failure> {
    Ok(match number {
        JAUS_VALIDITY_BY_CODE => Validity::of(code),
        JAUS_VALIDITY_BRIEF => Validity::Brief,
        JAUS_VALIDITY_WHILE_ALIVE => Validity::WhileAlive,
        JAUS_VALIDITY_UNTIL_DONE => Validity::UntilDone,
        _ => {
            return Err(Failure::argument(format!(
                "validity {number}: choose 0 to 3"
            )));
        }
    })
}

/// Adds to a service before its component starts.
fn extend(
    service: JausService,
    extension: impl FnOnce(
        ServiceHandlers,
        &ComponentEntry,
        ServiceKey,
    ) -> Result<ServiceHandlers, Failure>,
    is_polled: bool,
) -> Result<(), Failure> {
    edit(service.component, |draft, component| {
        let place = service.place as usize;
        let Some(draft) = draft.services.get_mut(place) else {
            let text = format!("the component has no service {place}");
            return Err(Failure::new(JausStatus::InvalidHandle, text));
        };
        let Some(handlers) = draft.handlers.take() else {
            let text = "an earlier call for this service has failed: create the component anew";
            return Err(Failure::new(JausStatus::WrongState, text));
        };
        draft.handlers = Some(extension(handlers, component, draft.key)?);
        draft.is_polled |= is_polled;
        Ok(())
    })
}

fn event_of(received: &Received) -> Event {
    Event::message(received.source, received.payload.clone())
}

/// Offers a service. The version is that of its definition. Describe the service with the functions
/// `jaus_service_...` before the component starts; each query of a service of the standard must be
/// answered, published or declined.
///
/// # Safety
/// `urn` is null, or a text that ends with a 0. `service` is null, or can be written.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn jaus_component_offer(
    component: JausComponent,
    urn: *const c_char,
    major: u8,
    minor: u8,
    service: *mut JausService,
) -> JausStatus {
    run(|| {
        check_out(service, "service")?;
        // SAFETY: as the caller guarantees.
        let urn = unsafe { text(urn, "urn") }?;
        let id = service_id(urn, major, minor)
            .map_err(|error| Failure::of(JausStatus::TooMany, &error))?;
        let place = edit(component.id, |draft, _| {
            let place = draft.services.len();
            // Report Services has one octet for their number, and some are always there.
            if place >= 200 {
                let text = "a component offers at most 200 services";
                return Err(Failure::new(JausStatus::TooMany, text));
            }
            draft.services.push(ServiceDraft {
                handlers: Some(Handlers::undecoded(id)),
                key: ServiceKey::new(),
                is_polled: false,
            });
            Ok(place as u32)
        })?;
        let offered = JausService {
            component: component.id,
            place,
        };
        // SAFETY: as the caller guarantees.
        unsafe { put(service, offered, "service") }
    })
}

/// Answers queries with this message code by a callback, also for subscriptions to it.
///
/// # Safety
/// Until the component is freed, `callback` can be called with `user` on any thread.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn jaus_service_answer(
    service: JausService,
    query: u16,
    callback: JausAnswerCallback,
    user: *mut c_void,
) -> JausStatus {
    run(|| {
        let function = callback.ok_or_else(|| no_callback("callback"))?;
        let extension = |handlers: ServiceHandlers, component: &ComponentEntry, _| {
            // SAFETY: as the caller guarantees.
            let callback = unsafe { Callback::new(function, user, component.watchdog()) };
            let callback = Arc::new(callback);
            component.close_at_end({
                let callback = callback.clone();
                move || callback.close()
            });
            Ok(handlers.answer(query, move |received| {
                callback.answer(&event_of(received)).report
            }))
        };
        extend(service, extension, false)
    })
}

fn no_callback(name: &str) -> Failure {
    Failure::new(JausStatus::NullPointer, format!("{name} is null"))
}

/// Sets the answer to a query. Copies `length` octets, which begin with the code of the report.
///
/// # Safety
/// `answer` is null, or that of the callback that runs. `data` is null, or points to `length` octets.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn jaus_answer_set(
    answer: *mut JausAnswer,
    data: *const u8,
    length: usize,
) -> JausStatus {
    run(|| {
        // SAFETY: as the caller guarantees.
        let answer = unsafe { answer.as_mut() }.ok_or_else(|| no_callback("answer"))?;
        // SAFETY: as the caller guarantees.
        answer.report = Some(unsafe { message(data, length) }?);
        Ok(())
    })
}

/// Answers queries with this message code with the report that was last given to
/// `jaus_component_publish`. Until then the query has no answer.
#[unsafe(no_mangle)]
pub extern "C" fn jaus_service_publish(service: JausService, query: u16) -> JausStatus {
    run(|| {
        let Some(report) = registry().report_of(query) else {
            return Err(Failure::argument(format!(
                "{query:04X}h is not the code of a query"
            )));
        };
        let extension = |handlers: ServiceHandlers, component: &ComponentEntry, _| {
            let publications = component.publications.clone();
            publications.admit(query, report);
            Ok(handlers.answer(query, move |_| publications.latest(report)))
        };
        extend(service, extension, false)
    })
}

/// Leaves queries with this message code without an answer.
#[unsafe(no_mangle)]
pub extern "C" fn jaus_service_decline(service: JausService, query: u16) -> JausStatus {
    run(|| {
        extend(
            service,
            |handlers, _, _| Ok(handlers.declines(query)),
            false,
        )
    })
}

/// Handles messages with this code from any sender. Without a callback they are events of the
/// component. Refused for commands of services that need control.
///
/// # Safety
/// Until the component is freed, `callback` can be called with `user` on any thread.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn jaus_service_receive(
    service: JausService,
    code: u16,
    callback: JausEventCallback,
    user: *mut c_void,
) -> JausStatus {
    run(|| {
        let extension = |handlers: ServiceHandlers, component: &ComponentEntry, _| {
            // SAFETY: as the caller guarantees.
            let sink = unsafe { component.sink(callback, user) };
            let received =
                handlers.receive(code, move |message, _| sink.tell_message(event_of(message)));
            received.map_err(|error| Failure::of(JausStatus::Unsafe, &error))
        };
        extend(service, extension, callback.is_none())
    })
}

/// Handles messages with this code from the client in control: for commands that configure something.
/// The component needs Access Control or Management. Otherwise as `jaus_service_receive`.
///
/// # Safety
/// Until the component is freed, `callback` can be called with `user` on any thread.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn jaus_service_configure(
    service: JausService,
    code: u16,
    callback: JausEventCallback,
    user: *mut c_void,
) -> JausStatus {
    run(|| {
        let extension = |handlers: ServiceHandlers, component: &ComponentEntry, _| {
            // SAFETY: as the caller guarantees.
            let sink = unsafe { component.sink(callback, user) };
            Ok(handlers.configure(code, move |message, _| sink.tell_message(event_of(message))))
        };
        extend(service, extension, callback.is_none())
    })
}

/// Handles messages with this code from the client in control while the component is ready: for
/// commands that move something. The component needs Management, and the service a stop callback,
/// `jaus_service_on_stop`. `valid` is one of `JAUS_VALIDITY_...`; the stop callback is called when the
/// command is not repeated in time.
///
/// Without a callback commands are events of the component. A program that does not fetch them for
/// 500 ms hangs: the stop callback is called, and the component goes to the state Failure, which ends
/// control, until the program fetches events again. While a command is in force the program must call
/// `jaus_component_next_event` at least every 500 ms even if there are none; the descriptor becomes
/// readable every 200 ms for this.
///
/// # Safety
/// Until the component is freed, `callback` can be called with `user` on any thread.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn jaus_service_command(
    service: JausService,
    code: u16,
    valid: u8,
    callback: JausEventCallback,
    user: *mut c_void,
) -> JausStatus {
    run(|| {
        let valid = validity(valid, code)?;
        let extension = |handlers: ServiceHandlers, component: &ComponentEntry, key| {
            // SAFETY: as the caller guarantees.
            let sink = unsafe { component.sink(callback, user) };
            Ok(handlers.command(code, valid, move |message, _| {
                sink.tell_command(key, event_of(message));
            }))
        };
        extend(service, extension, callback.is_none())
    })
}

/// Sets the callback that stops everything that commands of this service have started: at the end of a
/// command's validity, when control or readiness is lost, in an emergency, when the component ends,
/// and when a callback or the program hangs.
///
/// # Safety
/// Until the component is freed, `callback` can be called with `user` on any thread.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn jaus_service_on_stop(
    service: JausService,
    callback: JausStopCallback,
    user: *mut c_void,
) -> JausStatus {
    run(|| {
        let function = callback.ok_or_else(|| no_callback("callback"))?;
        let extension = |handlers: ServiceHandlers, component: &ComponentEntry, _| {
            let watchdog = component.watchdog();
            // SAFETY: as the caller guarantees.
            let stop = Arc::new(unsafe { Callback::new(function, user, watchdog.clone()) });
            let hung = Arc::downgrade(&stop);
            watchdog.add_stop(hung);
            component.close_at_end({
                let stop = stop.clone();
                move || stop.close()
            });
            Ok(handlers.on_stop(move |_| stop.stop()))
        };
        extend(service, extension, false)
    })
}
