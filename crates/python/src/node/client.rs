//! A component as a client of others: discovery, queries, messages, subscriptions, control.

use std::sync::Arc;
use std::time::Duration;

use bytes::Bytes;
use jaus::component::{Component, QueryOptions, When};
use jaus::messages::registry;
use jaus::node::now;
use jaus::service::{Topic, code_of};

use jaus_binding::{HeldControl, Step, follow_reports};
use pyo3::prelude::*;

use super::control::{Control, priority};
use super::event::{Answer, Event};
use super::failure::Failure;
use super::id::{JausId, id_of, one_component};
use super::life::Life;
use super::program::{Begun, Shared};

/// A component as a client. The Python class `jaus.Component` uses it.
#[pyclass(frozen, module = "jaus._jaus")]
pub(crate) struct Client {
    life: Life,
}

/// A time limit in seconds.
fn limit(seconds: f64) -> Result<Duration, Failure> {
    let limit = Duration::try_from_secs_f64(seconds);
    limit.map_err(|_| Failure::argument(format!("a time limit of {seconds} s: give seconds")))
}

/// The code of the report that answers a query: as given, or by the standard's numbers.
fn report_of(query: &[u8], given: Option<u16>) -> Result<u16, Failure> {
    let code = code_of(query).unwrap_or_default();
    given.or_else(|| registry().report_of(code)).ok_or_else(|| {
        Failure::argument(format!(
            "{code:04X}h is not the code of a query: send it instead"
        ))
    })
}

/// When reports are sent: `hz` is a rate, or `None` for every change.
fn when(hz: Option<f64>, at_least: Option<f64>) -> Result<When, Failure> {
    let least = at_least.unwrap_or_default();
    match hz {
        None => Ok(When::OnChange),
        Some(hz) if hz > 0.0 && least >= 0.0 => Ok(When::hz(hz).at_least(least)),
        Some(hz) => Err(Failure::argument(format!(
            "{hz} Hz, at least {least} Hz: give positive rates, or hz=None for every change"
        ))),
    }
}

impl Client {
    pub(crate) const fn new(life: Life) -> Self {
        Self { life }
    }

    /// Begins a request that uses the component.
    fn begin<F>(
        &self,
        request: impl FnOnce(Component, u64, Arc<Shared>) -> F,
    ) -> Result<u64, Failure>
    where
        F: Future<Output = Result<Answer, Failure>> + Send + 'static,
    {
        let (program, component) = self.life.running()?;
        program.begin(|number, shared| request(component, number, shared))
    }
}

#[pymethods]
impl Client {
    /// Finds another component that offers a service: a request for its id.
    fn find(&self, urn: String, seconds: f64) -> Result<u64, Failure> {
        let limit = limit(seconds)?;
        self.begin(async move |component, _, _| {
            let found = component.find_within(urn.as_str(), limit).await;
            found.map(Answer::Id).map_err(|error| (&error).into())
        })
    }

    /// The known components that offer a service.
    fn providers(&self, urn: &str) -> Result<Vec<JausId>, Failure> {
        let directory = self.life.running()?.1.directory();
        let found = directory.offering(urn);
        Ok(found.map(|it| JausId(it.id)).collect())
    }

    /// Sends a query, from its message code: a request for the octets of its report.
    fn query(
        &self,
        peer: &Bound<'_, PyAny>,
        query: Vec<u8>,
        report: Option<u16>,
        seconds: Option<f64>,
    ) -> PyResult<u64> {
        let peer = id_of(peer)?;
        let report = report_of(&query, report)?;
        let options = match seconds {
            None => QueryOptions::default(),
            Some(seconds) => QueryOptions::default().within(limit(seconds)?),
        };
        Ok(self.begin(async move |component, _, _| {
            let answer = component.query_undecoded(options, peer, Bytes::from(query), report);
            let answer = answer.await;
            answer.map(Answer::Octets).map_err(|error| (&error).into())
        })?)
    }

    /// Sends a message without acknowledgement.
    fn send(
        &self,
        destination: &Bound<'_, PyAny>,
        urgency: &str,
        message: Vec<u8>,
    ) -> PyResult<()> {
        let (destination, urgency) = (id_of(destination)?, priority(urgency)?);
        let (program, component) = self.life.running()?;
        let _on_runtime = program.thread.handle().enter();
        let sent = component.send_undecoded(urgency, destination, Bytes::from(message));
        Ok(sent.map_err(|error| Failure::from(&error))?)
    }

    /// Sends a message until it is acknowledged: a request.
    fn deliver(
        &self,
        destination: &Bound<'_, PyAny>,
        urgency: &str,
        message: Vec<u8>,
    ) -> PyResult<u64> {
        let (destination, urgency) = (one_component(destination)?, priority(urgency)?);
        Ok(self.begin(async move |component, _, _| {
            let message = Bytes::from(message);
            let delivered = component.deliver_undecoded(urgency, destination, message);
            let delivered = delivered.await;
            Answer::nothing(delivered)
        })?)
    }

    /// Sets an emergency at a peer: a request.
    fn set_emergency(&self, peer: &Bound<'_, PyAny>) -> PyResult<u64> {
        let peer = one_component(peer)?;
        Ok(self.begin(async move |component, _, _| {
            let set = component.set_emergency(peer).await;
            Answer::nothing(set)
        })?)
    }

    /// Clears an emergency that this component has set: a request.
    fn clear_emergency(&self, peer: &Bound<'_, PyAny>) -> PyResult<u64> {
        let peer = one_component(peer)?;
        Ok(self.begin(async move |component, _, _| {
            let cleared = component.clear_emergency(peer).await;
            Answer::nothing(cleared)
        })?)
    }

    /// Subscribes to the answers to a query: a request, whose number is then that of the subscription.
    fn subscribe(
        &self,
        peer: &Bound<'_, PyAny>,
        query: Vec<u8>,
        report: Option<u16>,
        hz: Option<f64>,
        at_least: Option<f64>,
    ) -> PyResult<u64> {
        let topic = Topic {
            peer: one_component(peer)?,
            report: report_of(&query, report)?,
            query: Bytes::from(query),
            when: when(hz, at_least)?,
        };
        Ok(
            self.begin(async move |component, number, shared: Arc<Shared>| {
                let reports = component.subscribe_undecoded(topic).await;
                let reports = reports.map_err(|error| Failure::from(&error))?;
                drop(component);
                let queue = shared.queue.clone();
                let following = follow_reports(reports, move |reports, step| {
                    queue.push(match step {
                        Step::Report(message) => Event::Report {
                            subscription: number,
                            message,
                            arrived: now() - reports.age().unwrap_or_default(),
                            lost: reports.lost(),
                        },
                        Step::Up => Event::Up {
                            subscription: number,
                            rate: reports.hz(),
                        },
                        Step::Down(why) => Event::Down {
                            subscription: number,
                            why,
                        },
                        Step::Ended(why) => Event::Over {
                            subscription: number,
                            why: Some(why),
                        },
                        Step::Stopped => Event::Over {
                            subscription: number,
                            why: None,
                        },
                    });
                });
                let task = tokio::runtime::Handle::current().spawn(following);
                shared.become_lasting(number, Begun::Subscription(task));
                Ok(Answer::Nothing)
            })?,
        )
    }

    /// Requests control of a peer: a request, whose number is then that of the control. With `watch`, in
    /// seconds, control is released when the event loop has not run for that time.
    fn control(&self, peer: &Bound<'_, PyAny>, authority: u8, watch: Option<f64>) -> PyResult<u64> {
        let peer = one_component(peer)?;
        let watch = watch.map(limit).transpose()?;
        if let Some(watch) = watch.filter(|it| *it < Duration::from_millis(100)) {
            let text = format!("watch of {} s: choose at least 0.1", watch.as_secs_f64());
            return Err(Failure::argument(text).into());
        }
        Ok(
            self.begin(async move |component, number, shared: Arc<Shared>| {
                let granted = component.control(peer, authority).await;
                let granted = granted.map_err(|error| Failure::from(&error))?;
                drop(component);
                let held = Arc::new(HeldControl::new(granted));
                let runtime = tokio::runtime::Handle::current();
                let mut tasks = vec![runtime.spawn(follow(held.clone(), number, shared.clone()))];
                if let Some(limit) = watch {
                    let watching = watch_loop(held.clone(), limit, number, shared.clone());
                    tasks.push(runtime.spawn(watching));
                }
                shared.become_lasting(number, Begun::Control(held, tasks));
                Ok(Answer::Nothing)
            })?,
        )
    }

    /// The control that was granted to a request.
    fn controlled(&self, number: u64) -> Result<Control, Failure> {
        let held = self.life.running()?.0.shared.control(number);
        let held = held.ok_or_else(|| Failure::closed("control"))?;
        Ok(Control::new(self.life.clone(), held, number))
    }
}

/// Passes on the states of a controlled peer, and the loss of control.
async fn follow(held: Arc<HeldControl>, control: u64, shared: Arc<Shared>) {
    let tell = |state| shared.queue.push(Event::ControlStatus { control, state });
    if let Some(error) = held.follow(tell).await {
        let failure = (&error).into();
        shared.queue.push(Event::ControlLost { control, failure });
    }
}

/// Releases control when the event loop has not run for a time.
async fn watch_loop(held: Arc<HeldControl>, limit: Duration, control: u64, shared: Arc<Shared>) {
    let granted = now();
    let shown = || {
        shared.queue.beat();
        shared.queue.attention().fetched.max(granted)
    };
    if let Some(reason) = held.watch(limit, shown).await {
        let failure = super::control::not_used(reason);
        tracing::error!("{}", failure.text());
        shared.queue.push(Event::ControlLost { control, failure });
    }
}
