//! Components: description and start.

use std::ffi::{c_char, c_void};
use std::sync::{Arc, Mutex, MutexGuard};

use jaus::component::{
    AccessControl, AttachError, Builder, Component, Handlers, Management, UndecodedFunctions,
};
use jaus::node::Port;
use jaus::service::UnsafeService;
use jaus_binding::{
    Attended, NOBODY, NotStarted, Publications, Running, ServiceKey, follow_discovery,
    follow_standing, kind, lock,
};
use tokio::task::AbortHandle;

use crate::argument::{check_out, put, text};
use crate::event::{Event, Events, Shown};
use crate::node::{NODES, NodeEntry};
use crate::sink::Sink;
use crate::status::{Failure, JausStatus, check_may_wait, run};
use crate::table::Table;
use crate::types::{JausComponent, JausEventCallback, JausEventKind, JausNode};
use crate::watchdog::Watchdog;

pub(crate) static COMPONENTS: Table<ComponentEntry> = Table::new("component");

/// A component of the program.
pub(crate) struct ComponentEntry {
    pub(crate) node: Arc<NodeEntry>,
    pub(crate) queue: Arc<Events>,
    pub(crate) shown: Shown,
    pub(crate) publications: Arc<Publications>,
    stage: Mutex<Stage>,
    /// Close the callbacks that the component may call.
    closers: Mutex<Vec<Box<dyn Fn() + Send>>>,
}

enum Stage {
    Draft(Box<Draft>),
    /// Waits for the node of the host.
    Starts,
    Runs {
        running: Running,
        notices: Vec<AbortHandle>,
    },
    Ended,
}

/// A component before its start.
pub(crate) struct Draft {
    number: u8,
    kind: u16,
    name: String,
    guard: Guard,
    pub(crate) services: Vec<ServiceDraft>,
    pub(crate) on_standing: Option<Sink>,
    pub(crate) on_discovery: Option<Sink>,
}

/// A service that is being described.
pub(crate) struct ServiceDraft {
    /// `None` after a call that failed.
    pub(crate) handlers: Option<Handlers<UndecodedFunctions>>,
    /// Names it in the queue of events.
    pub(crate) key: ServiceKey,
    /// Whether messages of it wait for the program in the queue of events.
    pub(crate) is_polled: bool,
}

enum Guard {
    None,
    AccessControl(AccessControl),
    Management(Management),
}

impl ComponentEntry {
    fn stage(&self) -> MutexGuard<'_, Stage> {
        lock(&self.stage)
    }

    pub(crate) fn watchdog(&self) -> Arc<Watchdog> {
        self.node.runtime.watchdog()
    }

    /// Calls `close` when the component has ended.
    pub(crate) fn close_at_end(&self, close: impl Fn() + Send + 'static) {
        lock(&self.closers).push(Box::new(close));
    }

    /// The receiver of events: a callback, which is closed with the component, or its queue.
    ///
    /// # Safety
    /// Until the component is freed, `callback` can be called with `user` on any thread.
    pub(crate) unsafe fn sink(&self, callback: JausEventCallback, user: *mut c_void) -> Sink {
        // SAFETY: as the caller guarantees; it is closed when the component has ended.
        let sink = unsafe { Sink::new(callback, user, &self.queue, self.watchdog()) };
        self.close_at_end({
            let sink = sink.clone();
            move || sink.close()
        });
        sink
    }

    pub(crate) fn running(&self) -> Result<Component, Failure> {
        match &*self.stage() {
            Stage::Runs { running, .. } => Ok(running.component().clone()),
            Stage::Draft(_) => Err(Failure::new(
                JausStatus::WrongState,
                "the component does not run: call jaus_component_start first",
            )),
            Stage::Starts => Err(Failure::new(
                JausStatus::WrongState,
                "the component does not run yet: jaus_component_start has not returned",
            )),
            Stage::Ended => Err(stopped()),
        }
    }

    fn start(&self) -> Result<(), Failure> {
        check_may_wait()?;
        let place = self.node.place()?;
        let draft = self.begin()?;
        let runtime = &self.node.runtime;
        // Not under the lock: a callback that waits for it would hold up the runtime, and this with it.
        let port = runtime.wait(place.attach(draft.number))?;
        let mut stage = self.stage();
        if !matches!(*stage, Stage::Starts) {
            return Err(stopped());
        }
        *stage = Stage::Ended;
        let port = port.map_err(not_started)?;
        *stage = runtime.wait(async { draft.start(port, &self.queue) })??;
        Ok(())
    }

    /// Takes the description, for the start.
    fn begin(&self) -> Result<Box<Draft>, Failure> {
        let mut stage = self.stage();
        match std::mem::replace(&mut *stage, Stage::Starts) {
            Stage::Draft(draft) => Ok(draft),
            other => {
                *stage = other;
                let text = "the component was started before";
                Err(Failure::new(JausStatus::WrongState, text))
            }
        }
    }

    /// Ends the component and its callbacks.
    pub(crate) fn end(&self) -> Result<(), Failure> {
        let stage = std::mem::replace(&mut *self.stage(), Stage::Ended);
        if let Stage::Runs { running, notices } = stage {
            for notices in &notices {
                notices.abort();
            }
            // If it takes too long, its callbacks end all the same.
            self.node.runtime.wait(running.end())?;
        }
        self.queue.end();
        let closers = std::mem::take(&mut *lock(&self.closers));
        for close in closers {
            close();
        }
        Ok(())
    }
}

fn stopped() -> Failure {
    Failure::new(JausStatus::Stopped, "the component has stopped")
}

fn not_started(error: NotStarted) -> Failure {
    match error {
        NotStarted::Attach(error) => refused(&error),
        NotStarted::Host(error) => Failure::of(JausStatus::NotStarted, &error),
    }
}

impl Draft {
    /// On the library's runtime.
    fn start(self, port: Port, queue: &Arc<Events>) -> Result<Stage, Failure> {
        let (on_standing, on_discovery) = (self.on_standing.clone(), self.on_discovery.clone());
        let running = Running::on(self.builder(queue)?, port).map_err(|error| refused(&error))?;
        let component = running.component();
        let standing = on_standing.map(|sink| tell_standing(component, sink));
        let discovery = on_discovery.map(|sink| tell_discovery(component, sink));
        let notices = standing.into_iter().chain(discovery).collect();
        Ok(Stage::Runs { running, notices })
    }

    fn builder(self, queue: &Arc<Events>) -> Result<Builder, Failure> {
        let mut builder = Component::builder(kind(self.kind), self.name);
        builder = match self.guard {
            Guard::None => builder,
            Guard::AccessControl(settings) => builder.access_control(settings),
            Guard::Management(settings) => builder.management(settings),
        };
        for service in self.services {
            let handlers = service.handlers.ok_or_else(|| {
                let text = "a call for a service of the component has failed";
                Failure::new(JausStatus::WrongState, text)
            })?;
            builder = match service.is_polled {
                true => builder.offer(Attended::new(handlers, service.key, queue.clone())),
                false => builder.offer(handlers),
            };
        }
        Ok(builder)
    }
}

fn tell_standing(component: &Component, sink: Sink) -> AbortHandle {
    follow_standing(component, move |standing| {
        let controller = standing.controller.map_or(NOBODY, |it| it.id);
        sink.tell(Event {
            value: standing.state as u8,
            ..Event::new(JausEventKind::Standing, controller)
        });
    })
}

fn tell_discovery(component: &Component, sink: Sink) -> AbortHandle {
    follow_discovery(component, move |id, is_found| {
        let kind = match is_found {
            true => JausEventKind::Found,
            false => JausEventKind::Lost,
        };
        sink.tell(Event::new(kind, id));
    })
}

/// Why a component was not attached, in the words of this interface.
fn refused(error: &AttachError) -> Failure {
    let AttachError::Unsafe(unsafe_service) = error else {
        return Failure::of(JausStatus::NotStarted, error);
    };
    let text = match unsafe_service {
        UnsafeService::NoManagement { service, command } => format!(
            "{service} acts on {command}, but without Management the component would obey any \
             client: call jaus_component_use_management"
        ),
        UnsafeService::NoStop { service, command } => {
            format!("{service} acts on {command}, but nothing stops it: call jaus_service_on_stop")
        }
        UnsafeService::NoAccessControl { service, command } => format!(
            "{command} configures {service}, but without Access Control the component would obey \
             any client: call jaus_component_use_access_control or jaus_component_use_management"
        ),
        UnsafeService::QueryNotAnswered { service, query } => format!(
            "{service} is offered, but nothing answers {query}: call jaus_service_answer, \
             jaus_service_publish or jaus_service_decline for it"
        ),
        other => other.to_string(),
    };
    Failure::new(JausStatus::Unsafe, text)
}

/// Changes the description of a component before its start.
pub(crate) fn edit<T>(
    component: u64,
    change: impl FnOnce(&mut Draft, &ComponentEntry) -> Result<T, Failure>,
) -> Result<T, Failure> {
    let entry = COMPONENTS.get(component)?;
    match &mut *entry.stage() {
        Stage::Draft(draft) => change(draft, &entry),
        Stage::Starts | Stage::Runs { .. } | Stage::Ended => Err(Failure::new(
            JausStatus::WrongState,
            "the component was started: describe it before jaus_component_start",
        )),
    }
}

/// A component that runs, with its entry.
pub(crate) fn running(
    component: JausComponent,
) -> Result<(Arc<ComponentEntry>, Component), Failure> {
    let entry = COMPONENTS.get(component.id)?;
    let component = entry.running()?;
    Ok((entry, component))
}

/// Fails if the component was freed during the call.
pub(crate) fn check_not_freed(component: JausComponent) -> Result<(), Failure> {
    COMPONENTS.get(component.id).map(drop).map_err(|_| {
        let text = "the component was freed during the call";
        Failure::new(JausStatus::Stopped, text)
    })
}

/// Describes a component of a node: its number within the node, 1 to 254, the kind and the name of its
/// subsystem. Start it with `jaus_component_start`, and free it with `jaus_component_free`.
///
/// # Safety
/// `name` is null, or a text that ends with a 0. `component` is null, or can be written.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn jaus_component_create(
    node: JausNode,
    number: u8,
    kind: u16,
    name: *const c_char,
    component: *mut JausComponent,
) -> JausStatus {
    run(|| {
        check_out(component, "component")?;
        let node = NODES.get(node.id)?;
        // SAFETY: as the caller guarantees.
        let name = unsafe { text(name, "name") }?.to_owned();
        if !(1..=254).contains(&number) {
            return Err(Failure::argument(format!(
                "component {number}: choose 1 to 254"
            )));
        }
        COMPONENTS.check_room()?;
        let queue = Events::new();
        let queue = queue.map_err(|error| Failure::of(JausStatus::NotStarted, &error))?;
        let draft = Draft {
            number,
            kind,
            name,
            guard: Guard::None,
            services: Vec::new(),
            on_standing: None,
            on_discovery: None,
        };
        let id = Table::<ComponentEntry>::reserve();
        let entry = ComponentEntry {
            node,
            queue: Arc::new(queue),
            shown: Shown::default(),
            publications: Arc::default(),
            stage: Mutex::new(Stage::Draft(Box::new(draft))),
            closers: Mutex::default(),
        };
        COMPONENTS.insert(id, entry);
        // SAFETY: as the caller guarantees.
        unsafe { put(component, JausComponent { id }, "component") }
    })
}

/// Offers Access Control: only the client in control may command. Clients with an authority below
/// `authority` do not get control, which ends a quarter of `timeout` late when it is not renewed for
/// `timeout` seconds. Usual values are 1 and 4.
#[unsafe(no_mangle)]
pub extern "C" fn jaus_component_use_access_control(
    component: JausComponent,
    authority: u8,
    timeout: u8,
) -> JausStatus {
    run(|| {
        edit(component.id, |draft, _| {
            draft.guard = Guard::AccessControl(access(authority, timeout));
            Ok(())
        })
    })
}

/// Offers Management, which includes Access Control: the component acts only while a client controls it
/// and has made it ready. With `initializes` it starts in the state Initialize, until
/// `jaus_component_set_condition` ends that.
#[unsafe(no_mangle)]
pub extern "C" fn jaus_component_use_management(
    component: JausComponent,
    authority: u8,
    timeout: u8,
    initializes: bool,
) -> JausStatus {
    run(|| {
        edit(component.id, |draft, _| {
            let settings = Management::new().access_control(access(authority, timeout));
            draft.guard = Guard::Management(match initializes {
                true => settings.initializes(),
                false => settings,
            });
            Ok(())
        })
    })
}

const fn access(authority: u8, timeout: u8) -> AccessControl {
    AccessControl::new().authority(authority).timeout(timeout)
}

/// Starts a component of a node that runs. When this fails, the component can only be freed. Not in a
/// callback.
#[unsafe(no_mangle)]
pub extern "C" fn jaus_component_start(component: JausComponent) -> JausStatus {
    run(|| COMPONENTS.get(component.id)?.start())
}
