//! Control of a peer.

use std::sync::Arc;

use bytes::Bytes;
use jaus::component::{self, Priority};
use jaus_binding::{HeldControl, NotUsed};
use pyo3::prelude::*;

use super::event::Answer;
use super::failure::Failure;
use super::life::Life;
use super::program::Begun;

/// Control of a peer. The Python class `jaus.Control` uses it.
#[pyclass(frozen, module = "jaus._jaus")]
pub(crate) struct Control {
    life: Life,
    held: Arc<HeldControl>,
    number: u64,
}

/// The priority of a message, by its name.
pub(crate) fn priority(name: &str) -> Result<Priority, Failure> {
    Ok(match name {
        "low" => Priority::Low,
        "standard" => Priority::Standard,
        "high" => Priority::High,
        "safety-critical" => Priority::SafetyCritical,
        _ => {
            return Err(Failure::argument(format!(
                "priority {name:?}: choose \"low\", \"standard\", \"high\" or \"safety-critical\""
            )));
        }
    })
}

/// Why control was released.
pub(crate) fn not_used(reason: NotUsed) -> Failure {
    let text = format!(
        "control was released: the event loop did not run for {:.1} s",
        reason.limit.as_secs_f64()
    );
    Failure::new("ControlLostError", text)
}

impl Control {
    pub(crate) const fn new(life: Life, held: Arc<HeldControl>, number: u64) -> Self {
        Self { life, held, number }
    }

    fn get(&self) -> Result<Arc<component::Control>, Failure> {
        self.held.get().ok_or_else(|| {
            let not_used = self.held.not_used().map(not_used);
            not_used.unwrap_or_else(|| Failure::closed("control"))
        })
    }

    /// The control, if commands can be sent.
    fn ready(&self) -> Result<Arc<component::Control>, Failure> {
        let control = self.get()?;
        let checked = control.check();
        checked.map_err(|error| Failure::from(&error))?;
        Ok(control)
    }
}

#[pymethods]
impl Control {
    /// Checks that commands can be sent.
    fn check(&self) -> Result<(), Failure> {
        self.ready().map(drop)
    }

    /// Makes the peer act on commands: a request.
    fn resume(&self) -> Result<u64, Failure> {
        let control = self.get()?;
        let (program, _) = self.life.running()?;
        program.begin(async move |_, _| {
            let resumed = control.resume().await;
            Answer::nothing(resumed)
        })
    }

    /// Puts the peer into standby: a request.
    fn standby(&self) -> Result<u64, Failure> {
        let control = self.get()?;
        let (program, _) = self.life.running()?;
        program.begin(async move |_, _| {
            let standing = control.standby().await;
            Answer::nothing(standing)
        })
    }

    /// Sends a command without acknowledgement.
    fn send(&self, urgency: &str, command: Vec<u8>) -> Result<(), Failure> {
        let urgency = priority(urgency)?;
        let control = self.ready()?;
        let (program, component) = self.life.running()?;
        let _on_runtime = program.thread.handle().enter();
        let sent = component.send_undecoded(urgency, control.peer(), Bytes::from(command));
        sent.map_err(|error| (&error).into())
    }

    /// Sends a command until it is acknowledged: a request.
    fn deliver(&self, urgency: &str, command: Vec<u8>) -> Result<u64, Failure> {
        let urgency = priority(urgency)?;
        let control = self.ready()?;
        let (program, component) = self.life.running()?;
        program.begin(async move |_, _| {
            let command = Bytes::from(command);
            let delivery = component.deliver_undecoded(urgency, control.peer(), command);
            let delivered = delivery.await;
            Answer::nothing(delivered)
        })
    }

    /// Releases control: a request.
    fn release(&self) -> Result<u64, Failure> {
        let (program, _) = self.life.running()?;
        let begun = program.shared.take(self.number);
        let held = self.held.clone();
        program.begin(async move |_, _| {
            let control = held.take();
            if let Some(Begun::Control(_, tasks)) = begun {
                for task in tasks {
                    task.abort();
                    // Its end by the abort is what is waited for.
                    let _ = task.await;
                }
            }
            // If a command is still being sent, the end of that releases control.
            if let Some(control) = control.and_then(Arc::into_inner) {
                control.release().await;
            }
            Ok(Answer::Nothing)
        })
    }
}
