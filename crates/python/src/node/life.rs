//! The life of a component: described, started, ended.

use std::sync::{Arc, Mutex};

use jaus::codec::ServiceId;
use jaus::component::{AccessControl, Component as Runs, Management, Validity};
use jaus_binding::{Running, lock};
use pyo3::prelude::*;
use tokio::task::AbortHandle;

use super::failure::Failure;
use super::program::Program;

/// The life of a component, for all that use it: none of them keeps it alive.
#[derive(Clone)]
pub(crate) struct Life(Arc<Mutex<Stage>>);

enum Stage {
    Draft(Box<Draft>),
    Starts,
    Runs(Live),
    Ended,
}

/// A component that runs, and the tasks that pass on its news.
pub(super) struct Live {
    pub(super) program: Arc<Program>,
    pub(super) running: Running,
    pub(super) notices: Vec<AbortHandle>,
}

/// What a component is to be, until its start.
pub(super) struct Draft {
    pub(super) number: u8,
    pub(super) kind: u16,
    pub(super) name: String,
    pub(super) guard: Guard,
    pub(super) services: Vec<ServiceDraft>,
    pub(super) on_stop: Option<Py<PyAny>>,
}

#[derive(Clone, Copy)]
pub(super) enum Guard {
    None,
    AccessControl(AccessControl),
    Management(Management),
}

pub(super) struct ServiceDraft {
    pub(super) id: ServiceId,
    pub(super) items: Vec<Item>,
}

/// A part of a service.
#[derive(Clone, Copy)]
pub(super) enum Item {
    Publish(u16, u16),
    Decline(u16),
    Receive(u16, u64),
    Configure(u16, u64),
    Command(u16, Validity, u64),
}

impl Life {
    pub(super) fn new(draft: Draft) -> Self {
        Self(Arc::new(Mutex::new(Stage::Draft(Box::new(draft)))))
    }

    /// Changes the description, until the component is started.
    pub(super) fn edit<T>(&self, change: impl FnOnce(&mut Draft) -> T) -> Result<T, Failure> {
        match &mut *lock(&self.0) {
            Stage::Draft(draft) => Ok(change(draft)),
            _ => Err(Failure::new(
                "StateError",
                "the component was started: describe it before",
            )),
        }
    }

    /// Takes the description in order to start the component.
    pub(super) fn take_draft(&self) -> Result<Draft, Failure> {
        let mut stage = lock(&self.0);
        match std::mem::replace(&mut *stage, Stage::Starts) {
            Stage::Draft(draft) => Ok(*draft),
            other => {
                *stage = other;
                let text = "a component is started once: create a new one";
                Err(Failure::new("StateError", text))
            }
        }
    }

    /// The component has started. It may have been ended meanwhile: then it ends at once.
    pub(super) fn begin(&self, live: Live) {
        let mut stage = lock(&self.0);
        if matches!(*stage, Stage::Starts) {
            *stage = Stage::Runs(live);
        }
    }

    /// Ends it. Returns the component, if it runs.
    pub(super) fn end(&self) -> Option<Live> {
        match std::mem::replace(&mut *lock(&self.0), Stage::Ended) {
            Stage::Runs(live) => Some(live),
            _ => None,
        }
    }

    /// The component that runs.
    pub(crate) fn running(&self) -> Result<(Arc<Program>, Runs), Failure> {
        match &*lock(&self.0) {
            Stage::Runs(live) if live.program.thread.is_of_other_process() => {
                Err(Failure::forked("component"))
            }
            Stage::Runs(live) => Ok((live.program.clone(), live.running.component().clone())),
            Stage::Draft(_) | Stage::Starts => Err(Failure::new(
                "StateError",
                "the component does not run: use `async with`, or await its start()",
            )),
            Stage::Ended => Err(Failure::closed("component")),
        }
    }
}
