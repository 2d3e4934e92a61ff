//! Connects a state machine to the service's trait and server: the server lets the machine handle
//! messages, and the machine's actions and guards are methods of the trait.

use super::super::ident::Names;
use super::{Emitter, Event, Kind, Messages, Method, Plan, Writer, queries};
use crate::machine::Machine;
use crate::model::{Message, Service};

/// The guard that the stack answers.
const IS_CONTROLLING_CLIENT: &str = "isControllingClient";

/// The one state machine of a service, as its trait and its server see it.
pub(in super::super) struct Connection<'a> {
    service: &'a Service,
    messages: Messages<'a>,
    emitter: Emitter<'a>,
}

impl<'a> Connection<'a> {
    /// The connection of a service with its machine.
    pub(in super::super) fn of(
        service: &'a Service,
        messages: Messages<'a>,
        machine: &'a Machine<'a>,
    ) -> Self {
        Self {
            service,
            messages,
            emitter: Emitter::new(machine, service, messages, "super"),
        }
    }

    /// Whether the machine handles a message.
    pub(in super::super) fn handles(&self, message: &Message) -> bool {
        let name = &message.name;
        let emitter = &self.emitter;
        let mut events = emitter.vocabulary.events.iter().filter(|it| is_input(it));
        events.any(|event| {
            event
                .message
                .as_ref()
                .is_some_and(|it| it.eq_ignore_ascii_case(name))
        })
    }

    /// Reserves the names of its methods in the trait.
    pub(in super::super) fn reserve(&self, names: &mut Names) {
        let methods = self.emitter.vocabulary.methods.iter();
        let taken = methods.map(|method| method.ident.trim_start_matches("r#").to_owned());
        names.reserve(&taken.collect::<Vec<_>>());
    }

    /// Writes the methods of the trait: guards and actions.
    pub(in super::super) fn methods(&self, out: &mut Writer) {
        let emitter = &self.emitter;
        for method in emitter
            .vocabulary
            .methods
            .iter()
            .filter(|it| !is_answered(it))
        {
            let (mut parameters, texts) = self.parameters(emitter, method);
            if !method.asks() {
                parameters.push("call: &mut C".to_owned());
            }
            let receiver = if method.asks() { "&self" } else { "&mut self" };
            parameters.insert(0, receiver.to_owned());
            let sent = self.sent(method).map(|path| format!(" -> {path}"));
            let result = match sent {
                Some(sent) => sent,
                None if method.asks() => " -> bool".to_owned(),
                None => String::new(),
            };
            out.gap();
            out.doc([format!("`{}`.", method.name).as_str(), &texts]);
            let ident = &method.ident;
            out.push(format!("fn {ident}({}){result};", parameters.join(", ")));
        }
    }

    /// The parameters of a method of the trait, and what is known of its texts.
    fn parameters(&self, emitter: &Emitter<'_>, method: &Method) -> (Vec<String>, String) {
        let (mut parameters, texts) = emitter.parameters_of(method);
        let envelope = "envelope: &Self::Envelope";
        match parameters.iter().position(|it| it == envelope) {
            Some(place) if method.asks() => parameters[place] = "call: &C".to_owned(),
            Some(place) => _ = parameters.remove(place),
            None => {}
        }
        for parameter in &mut parameters {
            for choice in &emitter.vocabulary.choices {
                let (plain, qualified) = (
                    format!(": {}<'_>", choice.ident),
                    format!(": machine::{}<'_>", choice.ident),
                );
                *parameter = parameter.replace(&plain, &qualified);
            }
        }
        (parameters, texts)
    }

    /// The type of the message that an action sends.
    fn sent(&self, method: &Method) -> Option<String> {
        let name = method.name.strip_prefix("Send ")?;
        self.messages.path("super", self.service, name)
    }

    /// Writes the implementation of `Behaviour` by a service and a call.
    pub(in super::super) fn bridge(&self, out: &mut Writer) {
        let emitter = &self.emitter;
        self.internal(out, emitter);
        out.gap();
        out.push("/// A service and a call, as the state machine sees them.");
        // A machine without actions reads neither.
        out.push("#[allow(dead_code)]");
        out.push("struct Step<'a, T, C> {\nservice: &'a mut T,\ncall: &'a mut C,\n}");
        out.gap();
        out.push("impl<T: Service<C>, C: codec::Call> machine::Behaviour for Step<'_, T, C> {");
        if emitter.vocabulary.has_envelope() {
            out.push("type Envelope = ();");
        }
        for method in &emitter.vocabulary.methods {
            self.bridged(out, emitter, method);
        }
        out.push("}");
    }

    fn bridged(&self, out: &mut Writer, emitter: &Emitter<'_>, method: &Method) {
        let ident = &method.ident;
        let (mut given, _) = self.parameters(emitter, method);
        let names: Vec<_> = given.iter().map(|it| name_of(it).to_owned()).collect();
        // The trait's parameters in the order and with the types of `Behaviour`.
        let mut kinds = method.parameters().map(|(kind, _)| kind);
        if let Some(place) = kinds.position(|kind| kind == Kind::Envelope) {
            let envelope = "_: &Self::Envelope".to_owned();
            match method.asks() {
                true => given[place] = envelope,
                false => given.insert(place, envelope),
            }
        }
        if is_answered(method) {
            for parameter in &mut given {
                *parameter = parameter.replacen(name_of(parameter), "_", 1);
            }
        }
        let receiver = if method.asks() { "&self" } else { "&mut self" };
        given.insert(0, receiver.to_owned());
        let result = if method.asks() { " -> bool" } else { "" };
        out.gap();
        out.push(format!("fn {ident}({}){result} {{", given.join(", ")));
        let mut arguments = names;
        for argument in &mut arguments {
            if argument == "call" {
                "self.call".clone_into(argument);
            }
        }
        if is_answered(method) {
            out.push("self.call.is_controlling_client()\n}");
            return;
        }
        if !method.asks() {
            arguments.push("self.call".to_owned());
        }
        let call = format!("self.service.{ident}({})", arguments.join(", "));
        match self.sent(method) {
            Some(path) => {
                out.push(format!("let message = {call};"));
                let of_path = |plan: &&Plan<'_>| format!("super::{}", plan.path()) == path;
                let plan = self.messages.plans.iter().find(of_path);
                let query = plan.and_then(|plan| queries::query_of(plan, self.messages.plans));
                match query {
                    Some(query) => out.push(format!(
                        "self.call.send_report::<super::{}>(message);",
                        query.path()
                    )),
                    None => out.push("self.call.send(&message);"),
                }
            }
            None if method.asks() => out.push(call),
            None => out.push(format!("{call};")),
        }
        out.push("}");
    }

    /// Writes the enum of the events that the service raises itself.
    fn internal(&self, out: &mut Writer, emitter: &Emitter<'_>) {
        let events: Vec<_> = emitter
            .vocabulary
            .events
            .iter()
            .filter(|it| is_internal(it))
            .collect();
        if events.is_empty() {
            return;
        }
        out.gap();
        out.push("/// The events that the service raises itself.");
        out.push("#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]\npub enum Internal {");
        for event in &events {
            out.push(format!("/// `{}`.\n{},", event.name, event.ident));
        }
        out.push("}");
        out.gap();
        out.push("impl codec::InternalEvent for Internal {");
        out.push("fn number(self) -> u16 {\nself as u16\n}\n}");
    }

    /// The cases of the messages that the machine handles.
    pub(in super::super) fn arms(&self) -> Vec<String> {
        let inputs = self.service.inputs.iter();
        inputs.filter_map(|message| self.arm(message)).collect()
    }

    fn arm(&self, message: &Message) -> Option<String> {
        let named = |event: &&Event| {
            let name = event.message.as_ref().filter(|_| is_input(event));
            name.is_some_and(|it| it.eq_ignore_ascii_case(&message.name))
        };
        let event = self.emitter.vocabulary.events.iter().find(named)?;
        let path = self.messages.declared(self.service, message)?;
        let envelope = if event.envelope { ", &()" } else { "" };
        Some(format!(
            "0x{:04X} => call.step(|message: super::{path}, call| {{\n\
             let event = machine::Event::{}(&message{envelope});\n\
             machine.step(event, &mut Step {{ service, call }})\n}}),",
            message.code, event.ident
        ))
    }

    /// Writes the functions for the service's own events and for the component's control.
    pub(in super::super) fn events(&self, out: &mut Writer) {
        let emitter = &self.emitter;
        let internal: Vec<_> = emitter
            .vocabulary
            .events
            .iter()
            .filter(|it| is_internal(it))
            .collect();
        if !internal.is_empty() {
            out.gap();
            out.push("fn handle_event(&mut self, number: u16, call: &mut C) {");
            out.push("let Some(machine) = &mut self.machine else {\nreturn;\n};");
            out.push("let event = match number {");
            for (number, event) in internal.iter().enumerate() {
                out.push(format!("{number} => machine::Event::{},", event.ident));
            }
            out.push("_ => return,\n};");
            out.push("let service = &mut self.service;");
            out.push("let _ = machine.step(event, &mut Step { service, call });\n}");
        }
        out.gap();
        let follows = emitter.follows();
        let unused = if follows { "" } else { "_" };
        out.push(format!(
            "fn follow(&mut self, {unused}path: &[&str], call: &mut C) {{"
        ));
        out.push("let service = &mut self.service;\nlet mut step = Step { service, call };");
        out.push("let machine = &mut self.machine;");
        let machine = "machine.get_or_insert_with(|| machine::Machine::start(&mut step))";
        match follows {
            true => out.push(format!("{machine}.follow(path, &mut step);\n}}")),
            false => out.push(format!("{machine};\n}}")),
        }
    }
}

/// Whether the event is the arrival of a message, and nothing more.
fn is_input(event: &Event) -> bool {
    event.name == "Receive" && event.message.is_some() && event.numbers == 0
}

/// Whether the service can raise the event itself.
fn is_internal(event: &Event) -> bool {
    event.message.is_none() && !event.envelope && event.numbers == 0
}

/// Whether the stack answers a guard.
fn is_answered(method: &Method) -> bool {
    method.asks() && method.name == IS_CONTROLLING_CLIENT
}

/// The name of a parameter.
fn name_of(parameter: &str) -> &str {
    parameter.split(':').next().unwrap_or(parameter)
}

/// Whether the machine can follow the component's control: it extends that of a core service.
pub(super) fn core_base<'a>(messages: Messages<'a>, service: &'a Service) -> Option<&'a Service> {
    let mut bases = messages.library.lineage(service).skip(1);
    bases.find(|base| base.is_core())
}
