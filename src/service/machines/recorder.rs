//! A behaviour that records its actions, and a common way to run the generated state machines and
//! the dynamic ones with it.

use std::collections::BTreeSet;
use std::sync::LazyLock;

use jsidl::Library;
use jsidl::behaviour::{Action, Guard, Name};
use jsidl::machine::{self, Run, Stimulus};

use crate::codec::machine::Outcome;
use crate::messages::core::{self, access_control, events, management};

/// Answers guards from a list, and records actions.
#[derive(Debug, Default)]
pub(super) struct Recorder {
    /// The guards that hold, unqualified.
    pub(super) holds: BTreeSet<String>,
    /// The actions, unqualified, with their text arguments.
    pub(super) done: Vec<String>,
}

impl Recorder {
    fn holds(&self, question: &str) -> bool {
        self.holds.contains(question)
    }

    fn note(&mut self, action: &str) {
        self.done.push(action.to_owned());
    }
}

/// The guards and actions of Events, for a type with `holds` and `note`.
macro_rules! of_events {
    ($machine:ident) => {
        fn is_supported(&self, _: $machine::CreateEventOrUpdateEvent<'_>) -> bool {
            self.holds("isSupported")
        }
        fn event_exists(
            &self,
            _: $machine::UpdateEventOrCancelEvent<'_>,
            _: &Self::Envelope,
        ) -> bool {
            self.holds("eventExists")
        }
        fn is_command_supported(&self, _: &$crate::messages::core::CreateCommandEvent) -> bool {
            self.holds("isCommandSupported")
        }
        fn send_report_events(&mut self, _: &Self::Envelope) {
            self.note("Send ReportEvents");
        }
        fn send_report_event_timeout(&mut self, _: &Self::Envelope) {
            self.note("Send ReportEventTimeout");
        }
        fn store_event(&mut self, _: $machine::CreateEventOrUpdateEvent<'_>, _: &Self::Envelope) {
            self.note("storeEvent");
        }
        fn send_confirm_event_request(&mut self, _: &Self::Envelope) {
            self.note("Send ConfirmEventRequest");
        }
        fn send_event(&mut self, _: $machine::CreateEventOrUpdateEvent<'_>, _: &Self::Envelope) {
            self.note("sendEvent");
        }
        fn send_reject_event_request(&mut self, _: &Self::Envelope) {
            self.note("Send RejectEventRequest");
        }
        fn remove_event(&mut self, _: &$crate::messages::core::CancelEvent, _: &Self::Envelope) {
            self.note("removeEvent");
        }
        fn store_command_event(
            &mut self,
            _: &$crate::messages::core::CreateCommandEvent,
            _: &Self::Envelope,
        ) {
            self.note("storeCommandEvent");
        }
    };
}
pub(super) use of_events;

/// The guards and actions of Access Control.
macro_rules! of_access_control {
    ($machine:ident) => {
        fn is_default_authority_greater(&self, _: &$crate::messages::core::RequestControl) -> bool {
            self.holds("isDefaultAuthorityGreater")
        }
        fn is_controlling_client(&self, (): &()) -> bool {
            self.holds("isControllingClient")
        }
        fn is_current_authority_less(&self, _: &$crate::messages::core::RequestControl) -> bool {
            self.holds("isCurrentAuthorityLess")
        }
        fn is_authority_valid(&self, _: &$crate::messages::core::SetAuthority) -> bool {
            self.holds("isAuthorityValid")
        }
        fn send_report_control(&mut self, (): &()) {
            self.note("Send ReportControl");
        }
        fn send_report_authority(&mut self, (): &()) {
            self.note("Send ReportAuthority");
        }
        fn send_report_timeout(&mut self, (): &()) {
            self.note("Send ReportTimeout");
        }
        fn send_reject_control(&mut self, text: &'static str, (): &()) {
            self.note(&format!("Send RejectControl {text}"));
        }
        fn send_confirm_control(&mut self, text: &'static str, (): &()) {
            self.note(&format!("Send ConfirmControl {text}"));
        }
        fn store_address(&mut self, (): &()) {
            self.note("storeAddress");
        }
        fn set_authority(&mut self, _: $machine::RequestControlOrSetAuthority<'_>) {
            self.note("setAuthority");
        }
        fn reset_timer(&mut self) {
            self.note("resetTimer");
        }
        fn release_controller(&mut self) {
            self.note("releaseController");
        }
    };
}

impl events::machine::Behaviour for Recorder {
    type Envelope = ();
    of_events!(events_machine);
}

impl access_control::machine::Behaviour for Recorder {
    type Envelope = ();
    of_events!(access_control_machine);
    of_access_control!(access_control_machine);
}

impl management::machine::Behaviour for Recorder {
    type Envelope = ();
    of_events!(management_machine);
    of_access_control!(management_machine);

    fn is_id_stored(&self, (): &()) -> bool {
        self.holds("isIDStored")
    }
    fn is_last_id(&self, (): &()) -> bool {
        self.holds("isLastID")
    }
    fn initializes(&self) -> bool {
        self.holds("initializes")
    }
    fn send_report_status(&mut self, (): &()) {
        self.note("Send ReportStatus");
    }
    fn store_id(&mut self, (): &()) {
        self.note("storeID");
    }
    fn delete_id(&mut self, (): &()) {
        self.note("deleteID");
    }
    fn remember_failure(&mut self) {
        self.note("rememberFailure");
    }
}

use access_control::machine as access_control_machine;
use events::machine as events_machine;
use management::machine as management_machine;

/// A generated state machine with string names.
pub(super) trait Generated: Sized {
    const URN: &'static str;
    /// Its events: messages by name, then others.
    const MESSAGES: &'static [&'static str];
    const OTHERS: &'static [&'static str];

    fn begin(recorder: &mut Recorder) -> Self;
    fn within(path: &str) -> Option<Self>;
    fn path(&self) -> String;
    fn hear(&mut self, event: &str, recorder: &mut Recorder) -> Outcome;
}

macro_rules! generated {
    ($service:ident: [$($message:ident),* $(,)?], [$($other:ident),* $(,)?]) => {
        impl Generated for $service::machine::Machine {
            const URN: &'static str = $service::URN;
            const MESSAGES: &'static [&'static str] = &[$(stringify!($message)),*];
            const OTHERS: &'static [&'static str] = &[$(stringify!($other)),*];

            fn begin(recorder: &mut Recorder) -> Self {
                Self::start(recorder)
            }

            fn within(path: &str) -> Option<Self> {
                let all = $service::machine::State::ALL;
                let state = all.into_iter().find(|state| state.path().join(".") == path);
                state.map(Self::at)
            }

            fn path(&self) -> String {
                self.state().path().join(".")
            }

            fn hear(&mut self, event: &str, recorder: &mut Recorder) -> Outcome {
                use $service::machine::Event;
                match event {
                    $(stringify!($message) => {
                        self.step(Event::$message(&core::$message::default(), &()), recorder)
                    })*
                    $(stringify!($other) => self.step(Event::$other, recorder),)*
                    other => panic!("{other} is no event"),
                }
            }
        }
    };
}

generated!(events: [
    QueryEvents, QueryEventTimeout, CreateEvent, UpdateEvent, CancelEvent, CreateCommandEvent,
], []);

generated!(access_control: [
    QueryEvents, QueryEventTimeout, CreateEvent, UpdateEvent, CancelEvent, CreateCommandEvent,
    RequestControl, ReleaseControl, SetAuthority, QueryControl, QueryAuthority, QueryTimeout,
], [Timedout]);

generated!(management: [
    QueryEvents, QueryEventTimeout, CreateEvent, UpdateEvent, CancelEvent, CreateCommandEvent,
    RequestControl, ReleaseControl, SetAuthority, QueryControl, QueryAuthority, QueryTimeout,
    Resume, Standby, Reset, Shutdown, SetEmergency, ClearEmergency, QueryStatus,
], [Timedout, Initialized, Failure]);

/// The definitions that come with this library.
pub(super) static LIBRARY: LazyLock<Library> = LazyLock::new(|| {
    let mut loader = jsidl::Loader::new();
    loader.catalogue();
    loader.load().library
});

/// The dynamic state machine of the newest version of a service.
pub(super) fn dynamic(urn: &str) -> machine::Machine<'static> {
    let service = LIBRARY.versions(urn).last().expect("it is ours");
    LIBRARY.machines(service).remove(0)
}

/// A stimulus by the name of its message or event.
pub(super) fn stimulus<G: Generated>(event: &str) -> Stimulus<'_> {
    if G::MESSAGES.contains(&event) {
        Stimulus::received(event)
    } else {
        Stimulus::event(event)
    }
}

/// One step of a dynamic state machine, with the same names.
pub(super) fn step(
    run: &mut Run<'_, '_>,
    stimulus: Stimulus<'_>,
    recorder: &mut Recorder,
) -> Outcome {
    let Recorder { holds, done } = recorder;
    let mut ask = |question: &Guard| match question {
        Guard::Call(call) => holds.contains(call.name.last()),
        _ => false,
    };
    let outcome = run.step(stimulus, &mut ask, &mut |action| done.push(words(action)));
    match outcome {
        machine::Outcome::Handled => Outcome::Handled,
        machine::Outcome::Ignored => Outcome::Ignored,
        machine::Outcome::Rejected => Outcome::Rejected,
    }
}

fn words(action: &Action) -> String {
    let texts = action
        .arguments
        .iter()
        .filter_map(|argument| argument.text());
    let words: Vec<_> = [action.name.last()].into_iter().chain(texts).collect();
    words.join(" ")
}

/// A dynamic state machine in the state with this path.
pub(super) fn run_at<'m, 'a>(machine: &'m machine::Machine<'a>, path: &str) -> Run<'m, 'a> {
    let name = Name::parse(path).expect("a path");
    let state = machine.find(&name).expect("a state");
    Run::at(machine, state)
}
