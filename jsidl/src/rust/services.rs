//! Generates for each service the trait that an application implements, and the server that passes
//! messages to it.
//!
//! Both are generated for the newest version of a service. The component itself implements the core
//! services, and a service inherits their messages only to name them, so neither has a place here.

use super::ident::{Names, version_constant};
use super::machine::{Connection, Messages, excess, machines_of};
use super::plan::Plan;
use super::queries;
use super::writer::Writer;
use crate::model::{Message, Service};

/// A message that the service receives.
struct Input<'a> {
    plan: &'a Plan<'a>,
    method: String,
    /// The type of its report, if it is a query.
    report: Option<String>,
}

/// Writes the trait and the server of a service, given all its versions, the newest first.
pub(super) fn service(out: &mut Writer, messages: Messages<'_>, versions: &[&Service]) {
    let service = versions[0];
    if service.inputs.is_empty() || service.is_core() {
        return;
    }
    let machines = match service.behaviour.is_empty() {
        true => Vec::new(),
        false => machines_of(messages.library, service),
    };
    // Several machines have no common trait.
    let connection = match &*machines {
        [] => None,
        [machine] if excess(machine).is_some() => return,
        [machine] => Some(Connection::of(service, messages, machine)),
        _ => return,
    };
    let generator = Generator {
        service,
        versions,
        messages,
        inputs: Vec::new(),
        connection,
    };
    generator.with_inputs().write(out);
}

struct Generator<'a> {
    service: &'a Service,
    versions: &'a [&'a Service],
    messages: Messages<'a>,
    /// Those that the state machine does not handle.
    inputs: Vec<Input<'a>>,
    /// The state machine, if there is one.
    connection: Option<Connection<'a>>,
}

impl<'a> Generator<'a> {
    fn with_inputs(mut self) -> Self {
        let mut names = Names::reserving(&["stop"]);
        if let Some(connection) = &self.connection {
            connection.reserve(&mut names);
        }
        for message in &self.service.inputs {
            let handled = self
                .connection
                .as_ref()
                .is_some_and(|it| it.handles(message));
            let Some(plan) = self.messages.plan(self.service, message) else {
                continue;
            };
            if handled || self.inputs.iter().any(|it| it.plan.path() == plan.path()) {
                continue;
            }
            let report = queries::report(plan, self.messages.plans);
            self.inputs.push(Input {
                plan,
                method: names.snake(&message.name),
                report: report.map(Plan::path),
            });
        }
        self
    }

    fn write(&self, out: &mut Writer) {
        self.service_trait(out);
        self.server(out);
        if let Some(connection) = &self.connection {
            connection.bridge(out);
        }
        self.provider(out);
    }

    fn service_trait(&self, out: &mut Writer) {
        out.gap();
        out.push("/// The service, as an application implements it. `C` is the type of a call.");
        out.push("pub trait Service<C> {");
        for input in &self.inputs {
            let (name, ty) = (&input.plan.message.name, input.plan.path());
            let (doc, parameter, result) = match &input.report {
                Some(report) => (
                    format!("Answers `{name}`; `None` is for no answer, or a later one."),
                    "query",
                    format!(" -> Option<super::{report}>"),
                ),
                None => (
                    format!("Handles `{name}`{}.", permitted(input.plan)),
                    "message",
                    String::new(),
                ),
            };
            out.gap();
            out.doc([doc.as_str()]);
            out.push(format!(
                "fn {}(&mut self, {parameter}: super::{ty}, call: &mut C){result};",
                input.method
            ));
        }
        if let Some(connection) = &self.connection {
            connection.methods(out);
        }
        if self.guarded(|plan| plan.needs_readiness).is_some() {
            out.gap();
            out.push(
                "/// Stops everything that the commands move. Also called when nothing moves.",
            );
            out.push("fn stop(&mut self, call: &mut C);");
        }
        out.push("}");
    }

    fn server(&self, out: &mut Writer) {
        let (what, field, start) = match self.connection {
            Some(_) => (
                "Passes to a [`Service`] what its state machine accepts.",
                "\nmachine: Option<machine::Machine>,",
                "service,\nmachine: None,",
            ),
            None => ("Passes messages to a [`Service`].", "", "service"),
        };
        out.gap();
        out.push(format!("/// {what}"));
        out.push(format!(
            "#[derive(Debug)]\npub struct Server<T> {{\nservice: T,{field}\n}}"
        ));
        out.gap();
        out.push("impl<T> Server<T> {\n/// A server of this service.");
        out.push("#[must_use]\npub const fn new(service: T) -> Self {");
        match self.connection {
            Some(_) => out.push(format!("Self {{\n{start}\n}}\n}}\n}}")),
            None => out.push(format!("Self {{ {start} }}\n}}\n}}")),
        }
    }

    fn provider(&self, out: &mut Writer) {
        out.gap();
        out.push("impl<T: Service<C>, C: codec::Call> codec::Provider<C> for Server<T> {");
        let offers = self.offers().join(", ");
        out.push(format!(
            "fn offers(&self) -> codec::List<codec::ServiceId> {{\ncodec::List::from([{offers}])\n}}"
        ));
        self.hazards(out);
        self.answers(out);
        out.gap();
        self.receive(out);
        if self.guarded(|plan| plan.needs_readiness).is_some() {
            out.gap();
            out.push("fn stop(&mut self, call: &mut C) {\nself.service.stop(call);\n}");
        }
        if let Some(connection) = &self.connection {
            connection.events(out);
        }
        out.push("}");
    }

    fn answers(&self, out: &mut Writer) {
        let inputs = self.service.inputs.iter();
        let queries = inputs.filter(|it| self.service.report_of(it).is_some());
        let codes: Vec<_> = queries.map(|it| format!("0x{:04X}", it.code)).collect();
        if !codes.is_empty() {
            out.gap();
            out.push(format!(
                "fn answers(&self, query: u16) -> bool {{ [{}].contains(&query) }}",
                codes.join(", ")
            ));
        }
    }

    fn hazards(&self, out: &mut Writer) {
        let acts_on = self.guarded(|plan| plan.needs_readiness);
        let set_up_by = self.guarded(|plan| plan.message.is_command && !plan.needs_readiness);
        let stops = acts_on.is_some();
        if acts_on.is_none() && set_up_by.is_none() {
            return;
        }
        out.gap();
        out.push("fn hazards(&self) -> codec::Hazards {");
        out.push(format!(
            "codec::Hazards {{\nacts_on: {acts_on:?},\nset_up_by: {set_up_by:?},\nstops: {stops},\n}}\n}}"
        ));
    }

    /// The name of an input that is guarded like this.
    fn guarded(&self, how: impl Fn(&Plan<'_>) -> bool) -> Option<&str> {
        let inputs = self.service.inputs.iter();
        let mut plans = inputs.filter_map(|message| self.messages.plan(self.service, message));
        plans.find(|plan| how(plan)).map(|plan| &*plan.message.name)
    }

    fn receive(&self, out: &mut Writer) {
        out.push("fn receive(&mut self, code: u16, call: &mut C) -> Option<Result<(), codec::DecodeError>> {");
        let arms = self.connection.as_ref().map(Connection::arms);
        match &arms {
            Some(arms) if arms.is_empty() => out.push("self.machine.as_ref()?;"),
            Some(_) => {
                out.push("let machine = self.machine.as_mut()?;");
                out.push("let service = &mut self.service;");
            }
            None => {}
        }
        out.push("Some(match code {");
        for Input {
            plan,
            method,
            report,
        } in &self.inputs
        {
            let path = plan.path();
            let (how, parameter) = match report {
                Some(_) => ("answer", "query"),
                None => ("receive", "message"),
            };
            out.push(format!(
                "0x{:04X} => call.{how}(|{parameter}: super::{path}, call| self.service.{method}({parameter}, call)),",
                plan.message.code
            ));
        }
        for arm in arms.iter().flatten() {
            out.push(arm);
        }
        out.push("_ => return None,\n})\n}");
    }

    /// The newest version, and older ones whose messages it understands and answers alike.
    fn offers(&self) -> Vec<String> {
        let layout = |service: &Service, message: &Message| {
            let plan = self.messages.plan(service, message);
            plan.map(Plan::path)
        };
        let newest: Vec<_> = self.service.messages().collect();
        let understood = |version: &&&Service| {
            version.messages().all(|message| {
                let mut newest = newest.iter();
                newest.any(|it| layout(version, message) == layout(self.service, it))
            })
        };
        let understood = self.versions.iter().filter(understood);
        let constants = understood.map(|it| version_constant(it.id.version));
        constants.collect()
    }
}

/// Whose messages the server passes on.
fn permitted(plan: &Plan<'_>) -> &'static str {
    match (plan.needs_readiness, plan.message.is_command) {
        (true, _) => " of the client in control of a ready component",
        (false, true) => " of the client in control",
        (false, false) => "",
    }
}
