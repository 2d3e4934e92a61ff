//! Draws merged state machines for Graphviz and Mermaid.
//!
//! Both outputs have the same content. An arrow is a change of state, labelled
//! `event [guard] / actions`; internal actions are listed inside the state. To keep labels short,
//! names lose their qualification, and calls lose the event's parameters, which are the same
//! everywhere.

use std::fmt::Write;

use super::{Declared, Machine, StateIndex, Stimulus};
use crate::behaviour::{
    Action, ActionKind, Argument, Call, Guard, Name, Transition, TransitionKind,
};

/// The label of a transition that every event triggers.
const ANY_OTHER: &str = "any other event";

/// The machine as a graph in the language DOT, for `dot -Tsvg`. Composite states are clusters.
pub fn dot(machine: &Machine<'_>) -> String {
    let mut out =
        String::from("digraph machine {\n    compound=true;\n    newrank=true;\n    rankdir=LR;\n");
    out.push_str("    node [shape=box, style=rounded, fontname=\"sans-serif\"];\n");
    out.push_str("    edge [fontname=\"sans-serif\", fontsize=10];\n");
    out.push_str("    graph [fontname=\"sans-serif\", style=rounded, labeljust=l];\n");
    out.push_str("    start [shape=point, width=0.2, label=\"\"];\n");
    for (index, state) in machine.states() {
        if state.parent.is_none() {
            dot_state(&mut out, machine, index, 1);
        }
    }
    let _ = writeln!(out, "    start -> {};", id(machine.start()));
    for arrow in arrows(machine) {
        for from in tails(machine, &arrow) {
            let mut attributes = format!("label=\"{}\"", dot_text(&label(arrow.transition)));
            if !machine.state(from).children.is_empty() {
                let _ = write!(attributes, ", ltail=cluster_{}", id(from));
            }
            let (tail, to) = (machine.leaf(from), arrow.to);
            let _ = writeln!(out, "    {} -> {} [{attributes}];", id(tail), id(to));
        }
    }
    out.push_str("}\n");
    out
}

fn dot_state(out: &mut String, machine: &Machine<'_>, index: StateIndex, depth: usize) {
    let state = machine.state(index);
    let indent = "    ".repeat(depth);
    let mut label = format!("{}\\n", dot_text(state.path.last()));
    for line in inside(machine, index) {
        let _ = write!(label, "{}\\l", dot_text(&line));
    }
    if state.children.is_empty() {
        let _ = writeln!(out, "{indent}{} [label=\"{label}\"];", id(index));
        return;
    }
    let _ = writeln!(out, "{indent}subgraph cluster_{} {{", id(index));
    let _ = writeln!(out, "{indent}    label=\"{label}\";");
    for child in &state.children {
        dot_state(out, machine, *child, depth + 1);
    }
    let _ = writeln!(out, "{indent}}}");
}

/// Escapes a text for a quoted DOT string.
fn dot_text(text: &str) -> String {
    text.replace('\\', "\\\\").replace('"', "\\\"")
}

/// The machine as a Mermaid `stateDiagram-v2`. Internal actions of a state are a note.
pub fn mermaid(machine: &Machine<'_>) -> String {
    let mut out = String::from("stateDiagram-v2\n");
    let _ = writeln!(out, "    [*] --> {}", id(machine.start()));
    for (index, state) in machine.states() {
        if state.parent.is_none() {
            mermaid_state(&mut out, machine, index, 1);
        }
    }
    for arrow in arrows(machine) {
        let label = mermaid_text(&label(arrow.transition));
        for from in tails(machine, &arrow) {
            let _ = writeln!(out, "    {} --> {} : {label}", id(from), id(arrow.to));
        }
    }
    for (index, _) in machine.states() {
        let lines = inside(machine, index);
        if lines.is_empty() {
            continue;
        }
        let _ = writeln!(out, "    note right of {}", id(index));
        for line in lines {
            let _ = writeln!(out, "        {}", mermaid_text(&line));
        }
        out.push_str("    end note\n");
    }
    out
}

fn mermaid_state(out: &mut String, machine: &Machine<'_>, index: StateIndex, depth: usize) {
    let state = machine.state(index);
    let indent = "    ".repeat(depth);
    let name = mermaid_text(state.path.last());
    if state.children.is_empty() {
        let _ = writeln!(out, "{indent}state \"{name}\" as {}", id(index));
        return;
    }
    let _ = writeln!(out, "{indent}state \"{name}\" as {} {{", id(index));
    if let Some(initial) = state.initial {
        let _ = writeln!(out, "{indent}    [*] --> {}", id(initial));
    }
    for child in &state.children {
        mermaid_state(out, machine, *child, depth + 1);
    }
    let _ = writeln!(out, "{indent}}}");
}

/// The states where an arrow begins. Neither program can draw an arrow from a state to one of its
/// substates: it is drawn from each of its leaf states, except where an earlier transition is
/// always taken.
fn tails(machine: &Machine<'_>, arrow: &Arrow<'_>) -> Vec<StateIndex> {
    if !within(machine, arrow.to, arrow.from) {
        return vec![arrow.from];
    }
    let taken = |index: StateIndex| {
        let Some(stimulus) = Stimulus::of(arrow.transition) else {
            return true;
        };
        let candidates = machine.candidates(index, stimulus);
        let first = candidates.iter().map(|declared| declared.item);
        let mut first = first.take_while(|other| !std::ptr::eq(*other, arrow.transition));
        first.all(|other| other.guard.is_some())
    };
    let leaves = machine.states().filter(|(index, state)| {
        within(machine, *index, arrow.from) && state.children.is_empty() && taken(*index)
    });
    leaves.map(|(index, _)| index).collect()
}

/// Whether a state is `outer` or lies within it.
fn within(machine: &Machine<'_>, inner: StateIndex, outer: StateIndex) -> bool {
    let around = |index: &StateIndex| machine.state(*index).parent;
    std::iter::successors(Some(inner), around).any(|index| index == outer)
}

/// Replaces Mermaid's special characters by their codes.
fn mermaid_text(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for c in text.chars() {
        if matches!(c, ':' | ';' | '#' | '<' | '>' | '"' | '{' | '}') {
            let _ = write!(escaped, "#{};", u32::from(c));
        } else {
            escaped.push(c);
        }
    }
    escaped
}

/// Identifier of a state in a drawing. Names of the definition need not be unique.
fn id(index: StateIndex) -> String {
    format!("s{}", index.number())
}

/// A change of state.
struct Arrow<'a> {
    from: StateIndex,
    to: StateIndex,
    transition: &'a Transition,
}

/// All changes of state, in the order of the states. The target of a `pop` depends on the history:
/// it is listed [inside](inside) the state.
fn arrows<'a>(machine: &Machine<'a>) -> Vec<Arrow<'a>> {
    let mut arrows = Vec::new();
    for (from, _) in machine.states() {
        for transition in transitions(machine, from) {
            let to = match &transition.kind {
                TransitionKind::Internal | TransitionKind::Pop(_) => None,
                TransitionKind::Again => Some(machine.leaf(from)),
                TransitionKind::To(_) | TransitionKind::Push(_) => machine.target(from, transition),
            };
            arrows.extend(to.map(|to| Arrow {
                from,
                to,
                transition,
            }));
        }
    }
    arrows
}

/// Entry, exit and internal actions of a state, one per line.
fn inside(machine: &Machine<'_>, index: StateIndex) -> Vec<String> {
    let state = machine.state(index);
    let effect = |word: &str, declared: &[Declared<'_, Action>]| {
        let actions = declared.iter().map(|declared| action(declared.item));
        let actions: Vec<_> = actions.collect();
        (!actions.is_empty()).then(|| format!("{word} / {}", actions.join(", ")))
    };
    let effects = [effect("entry", &state.entry), effect("exit", &state.exit)];
    let mut lines: Vec<_> = effects.into_iter().flatten().collect();
    for transition in transitions(machine, index) {
        if matches!(
            transition.kind,
            TransitionKind::Internal | TransitionKind::Pop(_)
        ) {
            lines.push(label(transition));
        }
    }
    lines
}

fn transitions<'a>(
    machine: &Machine<'a>,
    index: StateIndex,
) -> impl Iterator<Item = &'a Transition> {
    let state = machine.state(index);
    let all = state.transitions.iter().chain(&state.default_transitions);
    all.map(|declared| declared.item)
}

/// `event [guard] / actions`.
fn label(transition: &Transition) -> String {
    let trigger = &transition.trigger;
    let event = trigger.message().or(trigger.name());
    let mut label = event.unwrap_or(ANY_OTHER).to_owned();
    if let Some(guard) = &transition.guard {
        let _ = write!(label, " [{}]", short(guard));
    }
    let actions: Vec<_> = transition.actions.iter().map(action).collect();
    if !actions.is_empty() {
        let _ = write!(label, " / {}", actions.join(", "));
    }
    match &transition.kind {
        TransitionKind::Push(push) => match &push.back {
            Some(back) => _ = write!(label, ", with return to {back}"),
            None => label.push_str(", with return"),
        },
        TransitionKind::Pop(Some(then)) => {
            let _ = write!(label, ", then return and {}", shortened(then));
        }
        TransitionKind::Pop(None) => label.push_str(", then return"),
        TransitionKind::Internal | TransitionKind::To(_) | TransitionKind::Again => {}
    }
    label
}

fn action(action: &Action) -> String {
    let call = Call {
        name: action.name.clone(),
        arguments: action.arguments.clone(),
    };
    let sends = match action.kind {
        ActionKind::Call => "",
        ActionKind::Send => "send ",
    };
    format!("{sends}{}", shortened(&call))
}

/// A guard with shortened calls.
fn short(guard: &Guard) -> Guard {
    let inner = |guard: &Guard| Box::new(short(guard));
    match guard {
        Guard::Call(call) => Guard::Call(shortened(call)),
        Guard::Not(operand) => Guard::Not(inner(operand)),
        Guard::And(left, right) => Guard::And(inner(left), inner(right)),
        Guard::Or(left, right) => Guard::Or(inner(left), inner(right)),
        Guard::Name(_) | Guard::Literal(_) | Guard::Compare(..) => guard.clone(),
    }
}

fn shortened(call: &Call) -> Call {
    let said = call.arguments.iter();
    let said = said.filter(|argument| !matches!(argument, Argument::Variable(_)));
    Call {
        name: Name::of(vec![call.name.last()]),
        arguments: said.cloned().collect(),
    }
}
