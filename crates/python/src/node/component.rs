//! Components: description, start, publications, end.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use bytes::Bytes;
use jaus::codec::ServiceId;
use jaus::component::{
    AccessControl, Builder, Component as Runs, Condition, Handlers, Management, UndecodedFunctions,
    Validity,
};
use jaus::messages::registry;
use jaus_binding::{
    Attended, Publications, Running, ServiceKey, follow_discovery, follow_standing, kind,
    service_id,
};
use pyo3::prelude::*;
use tokio::task::AbortHandle;

use super::client::Client;
use super::event::{Answer, Event};
use super::failure::Failure;
use super::id::JausId;
use super::life::{Draft, Guard, Item, Life, Live, ServiceDraft};
use super::program::{Shared, number};
use super::settings::Node;

/// A component. The Python class `jaus.Component` uses it.
#[pyclass(frozen, module = "jaus._jaus")]
pub(crate) struct Component {
    key: ServiceKey,
    publications: Arc<Publications>,
    /// How often it has been stopped.
    stops: Arc<AtomicU64>,
    life: Life,
}

#[pymethods]
impl Component {
    #[new]
    #[pyo3(signature = (number, kind, name, *, management, access_control, authority, timeout, initializes))]
    #[expect(clippy::too_many_arguments, reason = "named arguments of Python")]
    fn new(
        number: u8,
        kind: u16,
        name: String,
        management: bool,
        access_control: bool,
        authority: u8,
        timeout: u8,
        initializes: bool,
    ) -> Result<Self, Failure> {
        if !(1..=254).contains(&number) {
            let text = format!("component {number}: choose 1 to 254");
            return Err(Failure::argument(text));
        }
        let access = AccessControl::new().authority(authority).timeout(timeout);
        let guard = match (management, access_control) {
            (true, _) => {
                let settings = Management::new().access_control(access);
                Guard::Management(match initializes {
                    true => settings.initializes(),
                    false => settings,
                })
            }
            (false, true) => Guard::AccessControl(access),
            (false, false) => Guard::None,
        };
        let draft = Draft {
            number,
            kind,
            name,
            guard,
            services: Vec::new(),
            on_stop: None,
        };
        Ok(Self {
            key: ServiceKey::new(),
            publications: Arc::default(),
            stops: Arc::default(),
            life: Life::new(draft),
        })
    }

    /// Its number in events.
    #[getter]
    fn subject(&self) -> u64 {
        self.key.number()
    }

    /// How often it has been stopped.
    #[getter]
    fn stops(&self) -> u64 {
        self.stops.load(Ordering::SeqCst)
    }

    /// Answers a query with the report that is published last.
    fn publishes(
        &self,
        urn: &str,
        version: (u8, u8),
        query: u16,
        report: Option<u16>,
    ) -> Result<(), Failure> {
        let report = report
            .or_else(|| registry().report_of(query))
            .ok_or_else(|| Failure::argument(format!("{query:04X}h is not the code of a query")))?;
        self.add(urn, version, |_| Ok(Item::Publish(query, report)))?;
        self.publications.admit(query, report);
        Ok(())
    }

    /// Leaves a query without an answer.
    fn declines(&self, urn: &str, version: (u8, u8), query: u16) -> Result<(), Failure> {
        self.add(urn, version, |_| Ok(Item::Decline(query)))
    }

    /// Lets messages with a code wait as events; returns the number of the handler. `how` is `"receive"`,
    /// `"configure"` or `"command"`.
    #[pyo3(signature = (urn, version, code, how, validity))]
    fn handles(
        &self,
        urn: &str,
        version: (u8, u8),
        code: u16,
        how: &str,
        validity: Option<&str>,
    ) -> Result<u64, Failure> {
        let handler = number();
        let validity = match validity {
            None => Validity::of(code),
            Some("brief") => Validity::Brief,
            Some("while-alive") => Validity::WhileAlive,
            Some("until-done") => Validity::UntilDone,
            Some(other) => {
                return Err(Failure::argument(format!(
                    "validity {other:?}: choose \"brief\", \"while-alive\" or \"until-done\""
                )));
            }
        };
        self.add(urn, version, |id| {
            match how {
                "configure" => return Ok(Item::Configure(code, handler)),
                "command" => return Ok(Item::Command(code, validity, handler)),
                _ => {}
            }
            // Refused already here, where the program sees which call is wrong.
            let tried = Handlers::undecoded(id).receive(code, |_, _| {});
            tried.map_err(|error| Failure::of("UnsafeServiceError", &error))?;
            Ok(Item::Receive(code, handler))
        })?;
        Ok(handler)
    }

    /// Sets the function that stops what commands have started. It must not raise.
    fn on_stop(&self, function: Py<PyAny>) -> Result<(), Failure> {
        self.life.edit(|draft| draft.on_stop = Some(function))
    }

    /// Starts the component on a node: a request.
    fn start(&self, py: Python<'_>, node: &Bound<'_, Node>) -> Result<u64, Failure> {
        let program = node.get().program()?;
        let draft = self.life.take_draft()?;
        if let Some(function) = &draft.on_stop {
            let stopper = &program.shared.stopper;
            stopper.add(self.key.number(), function.clone_ref(py));
        }
        let (place, number) = (program.place.clone(), draft.number);
        let builder = self.builder(&draft, &program.shared)?;
        let (life, subject) = (self.life.clone(), self.key.number());
        let live_program = program.clone();
        program.begin(async move |_, shared: Arc<Shared>| {
            let started = Running::start(builder, &place, number).await;
            let running = match started {
                Ok(running) => running,
                Err(error) => {
                    life.end();
                    shared.stopper.settle(subject).await;
                    return Err((&error).into());
                }
            };
            let notices = follow(running.component(), subject, &shared);
            let id = running.component().id();
            life.begin(Live {
                program: live_program,
                running,
                notices,
            });
            Ok(Answer::Id(id))
        })
    }

    /// Ends the component: a request, or `None` if it does not run.
    fn close(&self) -> Result<Option<u64>, Failure> {
        let Some(live) = self.life.end() else {
            return Ok(None);
        };
        let Live {
            program,
            running,
            notices,
        } = live;
        for notices in notices {
            notices.abort();
        }
        let subject = self.key.number();
        let begun = program.begin(async move |_, shared: Arc<Shared>| {
            running.end().await;
            shared.stopper.settle(subject).await;
            Ok(Answer::Nothing)
        });
        begun.map(Some)
    }

    /// Calls the stop function, beside the event loop.
    fn stop(&self) -> Result<(), Failure> {
        self.stops.fetch_add(1, Ordering::SeqCst);
        let (program, _) = self.life.running()?;
        program.shared.stopper.stop(self.key.number());
        Ok(())
    }

    /// Waits a moment until the stop function has returned, if it is due or runs. Whether it has: a command
    /// must not be handled before that.
    fn settle(&self, py: Python<'_>) -> Result<bool, Failure> {
        let (program, _) = self.life.running()?;
        let subject = self.key.number();
        Ok(py.detach(|| program.shared.stopper.settle_quickly(subject)))
    }

    /// Publishes a report, from its message code.
    fn publish(&self, report: Vec<u8>) -> Result<(), Failure> {
        let (program, component) = self.life.running()?;
        let published = self.publications.publish(Bytes::from(report));
        let query = published.map_err(|error| {
            let text = format!("{error}: call publishes with its query before the start");
            Failure::new("NotFoundError", text)
        })?;
        let runtime = program.thread.handle();
        self.publications.announce(runtime, component, query);
        Ok(())
    }

    /// Sets the condition: `"initialized"`, `"failed"`, `"stopped"`, `"stop released"` or `"safe"`.
    fn set_condition(&self, condition: &str) -> Result<(), Failure> {
        let condition = match condition {
            "initialized" => Condition::Initialized,
            "failed" => Condition::Failed,
            "stopped" => Condition::Stopped,
            "stop released" => Condition::StopReleased,
            "safe" => Condition::Safe,
            other => {
                return Err(Failure::argument(format!(
                    "condition {other:?}: choose \"initialized\", \"failed\", \"stopped\", \"stop \
                     released\" or \"safe\""
                )));
            }
        };
        let (program, component) = self.life.running()?;
        let runtime = program.thread.handle();
        runtime.spawn(async move { component.set_condition(condition).await });
        Ok(())
    }

    /// The state and the client in control.
    fn standing(&self) -> Result<(u8, Option<JausId>), Failure> {
        let standing = self.life.running()?.1.standing();
        let controller = standing.controller.map(|it| JausId(it.id));
        Ok((standing.state as u8, controller))
    }

    /// The component as a client of others.
    fn client(&self) -> Result<Client, Failure> {
        self.life.running()?;
        Ok(Client::new(self.life.clone()))
    }
}

impl Component {
    /// Adds to the service with this URN. The highest version that is given counts.
    fn add(
        &self,
        urn: &str,
        (major, minor): (u8, u8),
        item: impl FnOnce(ServiceId) -> Result<Item, Failure>,
    ) -> Result<(), Failure> {
        /// Report Services has one octet for their number, and some are always there.
        const MOST: usize = 200;
        let id = service_id(urn, major, minor);
        let id = id.map_err(|error| Failure::of("LimitError", &error))?;
        let item = item(id)?;
        self.life.edit(|draft| {
            let services = &mut draft.services;
            if let Some(service) = services.iter_mut().find(|it| it.id.urn == urn) {
                service.id = service.id.max(id);
                service.items.push(item);
            } else if services.len() < MOST {
                let items = vec![item];
                services.push(ServiceDraft { id, items });
            } else {
                let text = format!("a component offers at most {MOST} services");
                return Err(Failure::new("LimitError", text));
            }
            Ok(())
        })?
    }

    fn builder(&self, draft: &Draft, shared: &Arc<Shared>) -> Result<Builder, Failure> {
        let mut builder = Runs::builder(kind(draft.kind), draft.name.clone());
        builder = match draft.guard {
            Guard::None => builder,
            Guard::AccessControl(settings) => builder.access_control(settings),
            Guard::Management(settings) => builder.management(settings),
        };
        for service in &draft.services {
            let mut handlers = Handlers::undecoded(service.id);
            for item in &service.items {
                handlers = self.extend(handlers, *item, shared)?;
            }
            if draft.on_stop.is_some() {
                handlers = self.stopped_by(handlers, shared);
            }
            builder = builder.offer(Attended::new(handlers, self.key, shared.queue.clone()));
        }
        Ok(builder)
    }

    fn extend(
        &self,
        handlers: Handlers<UndecodedFunctions>,
        item: Item,
        shared: &Arc<Shared>,
    ) -> Result<Handlers<UndecodedFunctions>, Failure> {
        let (queue, key, stops) = (shared.queue.clone(), self.key, self.stops.clone());
        let event = move |handler, message: &jaus::endpoint::Received| Event::Message {
            handler,
            sender: message.source,
            message: message.payload.clone(),
            stops: stops.load(Ordering::SeqCst),
        };
        Ok(match item {
            Item::Publish(query, report) => {
                let publications = self.publications.clone();
                handlers.answer(query, move |_| publications.latest(report))
            }
            Item::Decline(query) => handlers.declines(query),
            Item::Receive(code, handler) => {
                let received = handlers.receive(code, move |message, _| {
                    queue.push_in_time(event(handler, message));
                });
                return received.map_err(|error| Failure::of("UnsafeServiceError", &error));
            }
            Item::Configure(code, handler) => handlers.configure(code, move |message, _| {
                queue.push_in_time(event(handler, message));
            }),
            Item::Command(code, validity, handler) => {
                handlers.command(code, validity, move |message, _| {
                    queue.push_command(key, event(handler, message));
                })
            }
        })
    }

    fn stopped_by(
        &self,
        handlers: Handlers<UndecodedFunctions>,
        shared: &Arc<Shared>,
    ) -> Handlers<UndecodedFunctions> {
        let (stops, subject) = (self.stops.clone(), self.key.number());
        let stopper = shared.stopper.clone();
        handlers.on_stop(move |_| {
            // First, so that no handler begins that does not know of it.
            stops.fetch_add(1, Ordering::SeqCst);
            stopper.stop(subject);
        })
    }
}

/// Passes on the standing of a component, and the components that it finds.
fn follow(component: &Runs, subject: u64, shared: &Arc<Shared>) -> Vec<AbortHandle> {
    let queue = shared.queue.clone();
    let standing = follow_standing(component, move |standing| {
        queue.push(Event::Standing {
            component: subject,
            state: standing.state as u8,
            controller: standing.controller.map(|it| it.id),
        });
    });
    let queue = shared.queue.clone();
    let discovery = follow_discovery(component, move |id, is_found| {
        queue.push(Event::Discovery {
            component: subject,
            id,
            is_found,
        });
    });
    vec![standing, discovery]
}
