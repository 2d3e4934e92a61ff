//! Control of peers.

use std::ffi::c_void;
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use jaus::component::Control;
use jaus::node::now;
use jaus_binding::{HeldControl, lock};
use tokio::task::JoinHandle;

use crate::argument::{check_out, message, one_component, priority, put};
use crate::client::{not_sent, uncontrolled, undelivered, unmanaged};
use crate::component::{ComponentEntry, check_not_freed, running};
use crate::event::Event;
use crate::sink::Sink;
use crate::status::{Failure, JausStatus, run};
use crate::table::Table;
use crate::types::{
    JAUS_STATE_UNKNOWN, JausAddress, JausComponent, JausControl, JausEventCallback, JausEventKind,
};

static CONTROLS: Table<ControlEntry> = Table::new("control");

/// Control of the program over a peer.
struct ControlEntry {
    component: Arc<ComponentEntry>,
    sink: Sink,
    held: Arc<Held>,
    tasks: Mutex<Vec<JoinHandle<()>>>,
}

/// The control, and when the program last showed that it runs.
struct Held {
    control: HeldControl,
    shown: Mutex<Instant>,
}

impl Held {
    /// The control, for a call of the program, which shows that it runs.
    fn used(&self) -> Result<Arc<Control>, Failure> {
        *lock(&self.shown) = now();
        self.control.get().ok_or_else(|| {
            let text = "control was released, because the program did not show that it runs";
            Failure::new(JausStatus::ControlLost, text)
        })
    }

    /// Releases control when the program has not used it for this time.
    async fn expire(self: Arc<Self>, limit: Duration, event: Event, sink: Sink) {
        if self
            .control
            .watch(limit, || *lock(&self.shown))
            .await
            .is_some()
        {
            let reason = format!(
                "the program has not used control for {:.1} s",
                limit.as_secs_f64()
            );
            sink.tell(event.because(&reason));
        }
    }

    /// Passes on the states that the peer reports, and then why control was lost.
    async fn follow(
        self: Arc<Self>,
        event: impl Fn(JausEventKind) -> Event + Send + Sync,
        sink: Sink,
    ) {
        let tell = |status: Option<u8>| {
            sink.tell(Event {
                value: status.unwrap_or(JAUS_STATE_UNKNOWN),
                ..event(JausEventKind::ControlStatus)
            });
        };
        if let Some(error) = self.control.follow(tell).await {
            sink.tell(event(JausEventKind::ControlLost).because(&error));
        }
    }
}

impl ControlEntry {
    /// Releases control. Waits for the peer's confirmation, but not in a callback.
    fn end(&self) {
        let control = self.held.control.take();
        // Not under the lock: a task can be in a callback that waits for it.
        let tasks = std::mem::take(&mut *lock(&self.tasks));
        for task in tasks {
            self.component.node.runtime.end(task);
        }
        if let Some(control) = control.and_then(Arc::into_inner) {
            // Without waiting, dropping it does the same.
            let _ = self.component.node.runtime.wait(control.release());
        }
        self.sink.close();
    }
}

/// Ends the control of a component over its peers, and frees it.
pub(crate) fn end_all_of(component: &Arc<ComponentEntry>) {
    for controlled in CONTROLS.remove_all(|it| Arc::ptr_eq(&it.component, component)) {
        controlled.end();
    }
}

/// Requests control of a peer, and waits until it is granted. `authority` is 0 to 255; the higher one
/// wins. Control renews itself until it is freed. Not in a callback.
///
/// Its events are `JausEventKind_ControlStatus` and `..._ControlLost`. Without a callback they are events
/// of the component.
///
/// # Safety
/// Until the control or the component is freed, `callback` can be called with `user` on any thread.
/// `control` is null, or can be written.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn jaus_component_control(
    component: JausComponent,
    peer: JausAddress,
    authority: u8,
    callback: JausEventCallback,
    user: *mut c_void,
    control: *mut JausControl,
) -> JausStatus {
    run(|| {
        check_out(control, "control")?;
        let peer = one_component(peer)?;
        CONTROLS.check_room()?;
        let (entry, running) = running(component)?;
        let runtime = entry.node.runtime.handle().clone();
        let granted = entry.node.runtime.wait(running.control(peer, authority))?;
        let granted = granted.map_err(|error| uncontrolled(&error))?;
        // SAFETY: as the caller guarantees; it is closed with the control.
        let sink = unsafe { Sink::new(callback, user, &entry.queue, entry.watchdog()) };
        let id = Table::<ControlEntry>::reserve();
        // Before the first event, which names it.
        // SAFETY: as the caller guarantees.
        unsafe { put(control, JausControl { id }, "control") }?;
        let held = Arc::new(Held {
            control: HeldControl::new(granted),
            shown: Mutex::new(now()),
        });
        let event = move |kind| Event {
            subject: id,
            ..Event::new(kind, peer)
        };
        let following = held.clone().follow(event, sink.clone());
        let controlled = ControlEntry {
            component: entry,
            sink,
            held,
            tasks: Mutex::default(),
        };
        let controlled = CONTROLS.insert(id, controlled);
        // From now on freeing the component ends this control, too, so that no callback follows.
        if let Err(freed) = check_not_freed(component) {
            if let Ok(controlled) = CONTROLS.remove(id) {
                controlled.end();
            }
            return Err(freed);
        }
        lock(&controlled.tasks).push(runtime.spawn(following));
        Ok(())
    })
}

/// Releases control when the program has not called a function for this control for `limit`
/// milliseconds, at least 100: the library renews control on a thread of its own, also for a program
/// that hangs. Once for each control.
#[unsafe(no_mangle)]
pub extern "C" fn jaus_control_watch_program(control: JausControl, limit: u32) -> JausStatus {
    run(|| {
        if limit < 100 {
            return Err(Failure::argument(format!(
                "{limit} ms: choose at least 100"
            )));
        }
        let entry = CONTROLS.get(control.id)?;
        let peer = entry.held.used()?.peer();
        let mut tasks = lock(&entry.tasks);
        if tasks.len() > 1 {
            let text = "the program is watched already";
            return Err(Failure::new(JausStatus::WrongState, text));
        }
        let lost = Event {
            subject: control.id,
            ..Event::new(JausEventKind::ControlLost, peer)
        };
        let limit = Duration::from_millis(limit.into());
        let watching = entry.held.clone().expire(limit, lost, entry.sink.clone());
        tasks.push(entry.component.node.runtime.handle().spawn(watching));
        Ok(())
    })
}

/// Checks that commands can be sent: control is held, and the peer is ready if it was resumed. Does not
/// wait.
#[unsafe(no_mangle)]
pub extern "C" fn jaus_control_check(control: JausControl) -> JausStatus {
    run(|| {
        let control = CONTROLS.get(control.id)?.held.used()?;
        control.check().map_err(|error| uncontrolled(&error))
    })
}

/// Makes the peer act on commands, and waits until it reports that it is ready. Not in a callback.
#[unsafe(no_mangle)]
pub extern "C" fn jaus_control_resume(control: JausControl) -> JausStatus {
    run(|| {
        let entry = CONTROLS.get(control.id)?;
        let control = entry.held.used()?;
        let resumed = entry.component.node.runtime.wait(control.resume())?;
        resumed.map_err(|error| unmanaged(&error))
    })
}

/// Puts the peer into standby, and waits until it reports that. Not in a callback.
#[unsafe(no_mangle)]
pub extern "C" fn jaus_control_standby(control: JausControl) -> JausStatus {
    run(|| {
        let entry = CONTROLS.get(control.id)?;
        let control = entry.held.used()?;
        let standing = entry.component.node.runtime.wait(control.standby())?;
        standing.map_err(|error| unmanaged(&error))
    })
}

/// Sends a command, `length` octets from its code, if commands can be sent, as `jaus_control_check`
/// says. Does not wait.
///
/// # Safety
/// `data` is null, or points to `length` octets.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn jaus_control_send(
    control: JausControl,
    urgency: u8,
    data: *const u8,
    length: usize,
) -> JausStatus {
    run(|| {
        // SAFETY: as the caller guarantees.
        let command = unsafe { message(data, length) }?;
        let urgency = priority(urgency)?;
        let entry = CONTROLS.get(control.id)?;
        let control = entry.held.used()?;
        control.check().map_err(|error| uncontrolled(&error))?;
        let component = entry.component.running()?;
        let _on_runtime = entry.component.node.runtime.handle().enter();
        let sent = component.send_undecoded(urgency, control.peer(), command);
        sent.map_err(|error| not_sent(&error))
    })
}

/// Like `jaus_control_send`, with retransmission, and waits until the peer acknowledges. Not in a
/// callback.
///
/// # Safety
/// `data` is null, or points to `length` octets.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn jaus_control_deliver(
    control: JausControl,
    urgency: u8,
    data: *const u8,
    length: usize,
) -> JausStatus {
    run(|| {
        // SAFETY: as the caller guarantees.
        let command = unsafe { message(data, length) }?;
        let urgency = priority(urgency)?;
        let entry = CONTROLS.get(control.id)?;
        let control = entry.held.used()?;
        control.check().map_err(|error| uncontrolled(&error))?;
        let component = entry.component.running()?;
        let delivery = component.deliver_undecoded(urgency, control.peer(), command);
        let delivered = entry.component.node.runtime.wait(delivery)?;
        delivered.map_err(|error| undelivered(&error))
    })
}

/// Releases control and frees it. Waits for the peer's confirmation, but not in a callback.
#[unsafe(no_mangle)]
pub extern "C" fn jaus_control_free(control: JausControl) -> JausStatus {
    run(|| {
        CONTROLS.remove(control.id)?.end();
        Ok(())
    })
}
