//! Generates state machines: enums of the merged machine's states and events, a trait for its
//! actions and guards, and step functions.
//!
//! A machine is generated for each service that extends it, in the module of the service: a single
//! machine in a module `machine`, several in modules with their names, and those of older versions
//! in modules of their version.

mod connection;
mod states;
mod steps;
mod vocabulary;

use std::collections::BTreeSet;

pub(super) use self::connection::Connection;
use self::connection::core_base;
use self::states::States;
use self::steps::Steps;
use self::vocabulary::{Choice, Event, Kind, Method, Vocabulary};
use super::docs;
use super::ident::Names;
use super::plan::{Plan, plan};
use super::queries;
use super::writer::Writer;
use crate::behaviour::TransitionKind;
use crate::library::Library;
use crate::machine::{MOST_REMEMBERED, Machine, StateIndex};
use crate::model::{Message, Service};
use crate::typed::names;

/// Locations of the message types.
#[derive(Clone, Copy)]
pub(super) struct Messages<'m> {
    pub(super) library: &'m Library,
    pub(super) plans: &'m [Plan<'m>],
    pub(super) externs: &'m [Extern<'m>],
}

/// A module of other services.
pub(super) struct Extern<'m> {
    path: String,
    plans: Vec<Plan<'m>>,
}

impl<'m> Extern<'m> {
    /// The module of the services whose URNs have these beginnings.
    pub(super) fn of(library: &'m Library, path: &str, urns: &[String]) -> Self {
        let services = library.services().map(AsRef::<Service>::as_ref);
        let services = services.filter(|it| urns.iter().any(|urn| it.id.urn.starts_with(&**urn)));
        let mut services: Vec<_> = services.collect();
        services.sort_by_key(|service| &service.id);
        Self {
            path: path.to_owned(),
            plans: plan(library, &services, &mut Names::default()),
        }
    }
}

impl Messages<'_> {
    /// The path of a message type of a service's vocabulary from a module where the root of the set is
    /// `root`; `None` for a message of another set.
    fn path(&self, root: &str, service: &Service, name: &str) -> Option<String> {
        let clients = self.library.lineage(service).flat_map(|it| &it.client_of);
        let servers = clients.filter_map(|server| self.library.service(&server.id));
        let servers = servers.flat_map(|server| self.library.vocabulary(server));
        let mut all = self.library.vocabulary(service).chain(servers);
        let (declaring, message) = all.find(|(_, it)| it.name.eq_ignore_ascii_case(name))?;
        if let Some(path) = self.declared(declaring, message) {
            return Some(format!("{root}::{path}"));
        }
        let mut externs = self.externs.iter();
        externs.find_map(|Extern { path, plans }| {
            let plan = of_service(plans, declaring, message)?;
            Some(format!("{path}::{}", plan.definition()))
        })
    }

    fn declared(&self, service: &Service, message: &Message) -> Option<String> {
        self.plan(service, message).map(Plan::path)
    }
}

impl<'m> Messages<'m> {
    /// The type of a message that a service declares.
    pub(super) fn plan(&self, service: &Service, message: &Message) -> Option<&'m Plan<'m>> {
        of_service(self.plans, service, message)
    }
}

/// The type of a message that a service declares.
fn of_service<'p, 'm>(
    plans: &'p [Plan<'m>],
    service: &Service,
    message: &Message,
) -> Option<&'p Plan<'m>> {
    let same =
        |plan: &&Plan<'_>| plan.is_layout_of(message) && plan.services.contains(&&service.id);
    plans.iter().find(same)
}

/// Writes the machines of all versions of a service, the newest first.
pub(super) fn machines(out: &mut Writer, messages: Messages<'_>, versions: &[&Service]) {
    let with = versions.iter().filter(|it| !it.behaviour.is_empty());
    for (age, service) in with.enumerate() {
        let machines = machines_of(messages.library, service);
        if machines.is_empty() {
            continue;
        }
        let version = (age > 0).then(|| names::version(service.id.version));
        if let Some(version) = &version {
            out.gap();
            out.push(format!("/// Machines of version {}.", service.id.version));
            out.push(format!("pub mod {version} {{\nuse super::codec;"));
        }
        let root = if age > 0 {
            "super::super::super"
        } else {
            "super::super"
        };
        machines_in(out, messages, service, &machines, root);
        if version.is_some() {
            out.push("}");
        }
    }
}

/// States times events of the largest machine that is generated.
const MOST_STEPS: usize = 1 << 16;

/// Whether the code of a machine would be too long, and why.
pub(super) fn excess(machine: &Machine<'_>) -> Option<String> {
    let states = machine.states().filter(|(_, it)| it.children.is_empty());
    let states = states.count();
    let events = machine.transitions().filter_map(|it| {
        let trigger = &it.item.trigger;
        Some(vocabulary::event_key(trigger.name()?, trigger.message()))
    });
    let events = events.collect::<BTreeSet<_>>().len();
    (states.saturating_mul(events) > MOST_STEPS).then(|| {
        format!(
            "the state machine {} has {states} states and {events} events, more than {MOST_STEPS} \
             reactions: divide it",
            machine.name()
        )
    })
}

/// The machines of a service. Those of other services than the core ones are without the parts of
/// the core services, which the component itself handles.
pub(super) fn machines_of<'a>(library: &'a Library, service: &'a Service) -> Vec<Machine<'a>> {
    let machines = library.machines(service);
    if service.is_core() {
        return machines;
    }
    let own = machines.into_iter().map(|it| it.without(Service::is_core));
    own.filter(Machine::has_transitions).collect()
}

fn machines_in(
    out: &mut Writer,
    messages: Messages<'_>,
    service: &Service,
    machines: &[Machine<'_>],
    root: &str,
) {
    let mut modules = Names::reserving(&["codec"]);
    for machine in machines {
        let name = match machines {
            [_] => "machine",
            _ => machine.name().last(),
        };
        let module = modules.snake(name);
        if let Some(reason) = excess(machine) {
            out.push(format!("compile_error!({reason:?});"));
            continue;
        }
        Emitter::new(machine, service, messages, root).write(out, &module);
    }
}

/// Writes one machine.
struct Emitter<'a> {
    machine: &'a Machine<'a>,
    service: &'a Service,
    messages: Messages<'a>,
    root: &'a str,
    states: States,
    vocabulary: Vocabulary,
    remembers: bool,
}

impl<'a> Emitter<'a> {
    fn new(
        machine: &'a Machine<'a>,
        service: &'a Service,
        messages: Messages<'a>,
        root: &'a str,
    ) -> Self {
        let mut types = Names::reserving(&[
            "codec",
            "State",
            "Event",
            "Behaviour",
            "Machine",
            "Outcome",
            "Memory",
        ]);
        let mut transitions = machine.transitions();
        let remembers = transitions.any(|it| {
            matches!(
                it.item.kind,
                TransitionKind::Push(_) | TransitionKind::Pop(_)
            )
        });
        Self {
            machine,
            service,
            messages,
            root,
            states: States::of(machine),
            vocabulary: Vocabulary::of(machine, &mut types),
            remembers,
        }
    }

    fn write(&self, out: &mut Writer, module: &str) {
        out.gap();
        out.doc([format!(
            "The state machine `{}` of version {}, with what it inherits.",
            self.machine.name(),
            self.service.id.version
        )
        .as_str()]);
        out.push("#[allow(unused_variables, unreachable_patterns)]");
        out.push("#[allow(clippy::if_same_then_else, clippy::nonminimal_bool)]");
        out.push("#[allow(clippy::needless_pass_by_value)]");
        out.push(format!("pub mod {module} {{"));
        let memory = if self.remembers {
            "{Memory, Outcome}"
        } else {
            "Outcome"
        };
        out.push(format!("use super::codec::machine::{memory};"));
        self.state(out);
        self.event(out);
        self.behaviour(out);
        self.struct_(out);
        self.functions(out);
        out.push("}");
    }

    /// Whether the machine follows the component's control.
    fn follows(&self) -> bool {
        !self.inherited().is_empty()
    }

    /// The innermost states of the component's control.
    fn inherited(&self) -> Vec<StateIndex> {
        let base = core_base(self.messages, self.service).filter(|_| !self.service.is_core());
        let Some(base) = base else {
            return Vec::new();
        };
        let machines = self.messages.library.machines(base);
        let known = |index: StateIndex| {
            let path = &self.machine.state(index).path;
            machines.iter().any(|machine| machine.find(path).is_some())
        };
        let innermost = |index: &StateIndex| {
            let mut children = self.machine.state(*index).children.iter();
            known(*index) && !children.any(|child| known(*child))
        };
        let states = self.machine.states().map(|(index, _)| index);
        states.filter(innermost).collect()
    }

    fn state(&self, out: &mut Writer) {
        out.gap();
        out.push("/// The states, which hold no others.");
        out.push("#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]\npub enum State {");
        for &leaf in self.states.leaves() {
            let path = &self.machine.state(leaf).path;
            out.push(format!("/// `{path}`\n{},", self.states.ident(leaf)));
        }
        out.push("}");
        out.gap();
        let leaves = self.states.leaves().iter();
        let idents = leaves.map(|&leaf| format!("Self::{}", self.states.ident(leaf)));
        let idents: Vec<_> = idents.collect();
        out.push(format!(
            "impl State {{\n/// All states.\npub const ALL: [Self; {}] = [{}];",
            idents.len(),
            idents.join(", ")
        ));
        out.gap();
        out.push("/// The names of the states around it and its own, from outside inwards.");
        out.push("#[must_use]\npub const fn path(self) -> &'static [&'static str] {\nmatch self {");
        for &leaf in self.states.leaves() {
            let path = self.machine.state(leaf).path.parts();
            out.push(format!("Self::{} => &{path:?},", self.states.ident(leaf)));
        }
        out.push("}\n}");
        out.gap();
        out.push("/// Whether it is the state with this path, or lies in it.");
        out.push("#[must_use]\npub fn is_in(self, path: &[&str]) -> bool {");
        out.push("self.path().starts_with(path)\n}\n}");
    }

    fn event(&self, out: &mut Writer) {
        let events = &self.vocabulary.events;
        out.gap();
        out.push("/// What happens to the machine.");
        out.push("#[derive(Debug)]");
        out.push(format!(
            "pub enum Event{} {{",
            self.event_generics("'a", "E")
        ));
        for event in events {
            out.push(format!("/// {}", self.event_doc(event)));
            let mut parts = Vec::new();
            parts.extend(
                event
                    .message
                    .as_deref()
                    .map(|it| self.message_type(it, "'a ")),
            );
            parts.extend(event.envelope.then(|| "&'a E".to_owned()));
            parts.extend((0..event.numbers).map(|_| "i64".to_owned()));
            if parts.is_empty() {
                out.push(format!("{},", event.ident));
            } else {
                out.push(format!("{}({}),", event.ident, parts.join(", ")));
            }
        }
        out.push("}");
    }

    fn event_doc(&self, event: &Event) -> String {
        let Some(message) = &event.message else {
            return format!("`{}`.", event.name);
        };
        let what = match self.messages.path(self.root, self.service, message) {
            Some(_) => format!("`{message}`"),
            None => format!("`{message}`, whose type is in another set: its octets"),
        };
        let envelope = if event.envelope {
            ", and what the transport knows of it"
        } else {
            ""
        };
        match event.name.as_str() {
            "Receive" => format!("The message {what}{envelope}."),
            name => format!("`{name}`: {what}{envelope}."),
        }
    }

    /// A reference to a message, or to its octets if its type is in another set.
    fn message_type(&self, message: &str, lifetime: &str) -> String {
        match self.messages.path(self.root, self.service, message) {
            Some(path) => format!("&{lifetime}{path}"),
            None => format!("&{lifetime}[u8]"),
        }
    }

    /// Generic parameters of `Event`: a lifetime if it has references, and the envelope's type.
    fn event_generics(&self, lifetime: &str, envelope: &str) -> String {
        let borrows = |event: &Event| event.message.is_some() || event.envelope;
        let mut generics = Vec::new();
        if self.vocabulary.events.iter().any(borrows) {
            generics.push(lifetime);
        }
        if self.vocabulary.has_envelope() {
            generics.push(envelope);
        }
        if generics.is_empty() {
            String::new()
        } else {
            format!("<{}>", generics.join(", "))
        }
    }

    fn behaviour(&self, out: &mut Writer) {
        let methods = &self.vocabulary.methods;
        for choice in &self.vocabulary.choices {
            self.choice(out, choice);
        }
        out.gap();
        out.push(
            "/// What the machine asks and does: a question for each condition of a guard, and",
        );
        out.push("/// a method for each action. Questions change nothing.");
        out.push("pub trait Behaviour {");
        if self.vocabulary.has_envelope() {
            out.push("/// What the transport knows of a message, such as its sender.");
            out.push("type Envelope;");
        }
        for asks in [true, false] {
            for method in methods.iter().filter(|it| it.asks() == asks) {
                out.gap();
                self.method(out, method);
            }
        }
        out.push("}");
    }

    fn choice(&self, out: &mut Writer, choice: &Choice) {
        out.gap();
        out.push("/// One of several messages that are treated alike.");
        out.push("#[derive(Debug, Clone, Copy)]");
        out.push(format!("pub enum {}<'a> {{", choice.ident));
        for &event in &choice.events {
            let event = &self.vocabulary.events[event];
            let message = event.message.as_deref().unwrap_or_default();
            let ty = self.message_type(message, "'a ");
            out.push(format!("/// `{message}`\n{}({ty}),", event.ident));
        }
        out.push("}");
    }

    fn method(&self, out: &mut Writer, method: &Method) {
        let (mut parameters, texts) = self.parameters_of(method);
        let receiver = if method.asks() { "&self" } else { "&mut self" };
        parameters.insert(0, receiver.to_owned());
        let first = format!("`{}`.", method.name);
        out.doc([first.as_str(), &texts]);
        let answer = if method.asks() { " -> bool" } else { "" };
        out.push(format!(
            "fn {}({}){answer};",
            method.ident,
            parameters.join(", ")
        ));
    }

    /// The parameters of a method, and what is known of its texts.
    fn parameters_of(&self, method: &Method) -> (Vec<String>, String) {
        let mut parameters = Vec::new();
        let mut names = Names::default();
        let mut texts = Vec::new();
        for (kind, given) in method.parameters() {
            let (name, ty) = match kind {
                Kind::Message => ("message", self.parameter_type(method, &given.events)),
                Kind::Envelope => ("envelope", "&Self::Envelope".to_owned()),
                Kind::Number => ("number", "i64".to_owned()),
                Kind::Text => ("text", "&'static str".to_owned()),
            };
            let name = names.snake(name);
            if kind == Kind::Text {
                let known: Vec<_> = given.texts.iter().map(|text| format!("{text:?}")).collect();
                texts.push(format!(
                    "`{name}` is one of {}.",
                    docs::prose(&known.join(", "))
                ));
            }
            parameters.push(format!("{name}: {ty}"));
        }
        (parameters, texts.join(" "))
    }

    fn parameter_type(&self, method: &Method, events: &BTreeSet<usize>) -> String {
        if events.len() > 1 {
            return format!("{}<'_>", method.message_type);
        }
        let event = events
            .first()
            .and_then(|&it| self.vocabulary.events.get(it));
        let message = event.and_then(|event| event.message.as_deref());
        self.message_type(message.unwrap_or_default(), "")
    }

    fn struct_(&self, out: &mut Writer) {
        out.gap();
        out.push("/// The machine: a state, and what it goes back to. It does nothing by itself.");
        out.push("#[derive(Debug, Clone, PartialEq, Eq)]\npub struct Machine {\nstate: State,");
        if self.remembers {
            out.push(format!("remembered: Memory<State, {MOST_REMEMBERED}>,"));
        }
        out.push("}");
    }

    fn functions(&self, out: &mut Writer) {
        let steps = Steps {
            machine: self.machine,
            states: &self.states,
            vocabulary: &self.vocabulary,
        };
        let start = self.machine.start();
        let entering = steps.actions(None, self.machine.entering(None, start));
        let unused = if entering.is_empty() { "_" } else { "" };
        let remembered = if self.remembers {
            "remembered: Memory::new(),\n"
        } else {
            ""
        };
        out.gap();
        out.push("impl Machine {");
        out.push("/// Enters the state in which the machine begins.");
        out.push(format!(
            "pub fn start<B: Behaviour + ?Sized>({unused}behaviour: &mut B) -> Self {{\n{entering}\
             Self::at(State::{})\n}}",
            self.states.ident(start)
        ));
        out.gap();
        out.push("/// A machine in some state, which is entered without any action.");
        out.push(format!(
            "#[must_use]\npub const fn at(state: State) -> Self {{\nSelf {{\nstate,\n{remembered}}}\n}}"
        ));
        out.gap();
        out.push("/// The state that it is in.");
        out.push("#[must_use]\npub const fn state(&self) -> State {\nself.state\n}");
        self.step(out);
        let inherited = self.inherited();
        if !inherited.is_empty() {
            steps.follow(out, &inherited);
        }
        for event in &self.vocabulary.events {
            steps.handler(out, event, &self.handler_signature(event));
        }
        out.push("}");
    }

    fn step(&self, out: &mut Writer) {
        let generics = self.event_generics("'_", "B::Envelope");
        let unused = if self.vocabulary.events.is_empty() {
            "_"
        } else {
            ""
        };
        out.gap();
        out.push("/// Takes the first transition whose guard holds, and does what it and the states that");
        out.push("/// are left and entered ask for.");
        out.push(format!(
            "pub fn step<B: Behaviour + ?Sized>(&mut self, event: Event{generics}, {unused}behaviour: &mut B) -> Outcome {{"
        ));
        out.push("match event {");
        for event in &self.vocabulary.events {
            let names = parameters(event);
            let pattern = if names.is_empty() {
                String::new()
            } else {
                format!("({})", names.join(", "))
            };
            let arguments: Vec<_> = names
                .iter()
                .map(String::as_str)
                .chain(["behaviour"])
                .collect();
            out.push(format!(
                "Event::{}{pattern} => self.{}({}),",
                event.ident,
                event.handler,
                arguments.join(", ")
            ));
        }
        out.push("}\n}");
    }

    fn handler_signature(&self, event: &Event) -> String {
        let mut parameters = Vec::new();
        if let Some(message) = &event.message {
            parameters.push(format!("message: {}", self.message_type(message, "")));
        }
        if event.envelope {
            parameters.push("envelope: &B::Envelope".to_owned());
        }
        parameters.extend((0..event.numbers).map(|number| format!("number_{number}: i64")));
        parameters.push("behaviour: &mut B".to_owned());
        format!(
            "fn {}<B: Behaviour + ?Sized>(&mut self, {}) -> Outcome {{",
            event.handler,
            parameters.join(", ")
        )
    }
}

/// Names of an event's parameters.
fn parameters(event: &Event) -> Vec<String> {
    let message = event.message.iter().map(|_| "message".to_owned());
    let envelope = event.envelope.then(|| "envelope".to_owned());
    let numbers = (0..event.numbers).map(|number| format!("number_{number}"));
    message.chain(envelope).chain(numbers).collect()
}
