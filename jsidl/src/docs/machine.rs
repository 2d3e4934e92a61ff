//! State machines as nested boxes: each state with its transitions and actions.

use super::block::{Block, Inline, Line, StateBox, code, heading, muted, text};
use crate::behaviour::{Action, ActionKind, Transition, TransitionKind};
use crate::library::Library;
use crate::machine::{Declared, Machine, StateIndex, dot, mermaid};
use crate::model::{Id, Service};

/// The machines of a service, merged with the inherited ones; empty if there are none.
pub(super) fn blocks(library: &Library, service: &Service) -> Vec<Block> {
    let machines = library.machines(service);
    if machines.is_empty() {
        return Vec::new();
    }
    let mut blocks = vec![
        heading(2, "Behaviour", Some("behaviour".to_owned())),
        Block::Paragraph(vec![text(
            "Includes inherited states and transitions. A state's transitions also apply to its \
             inner states; the first whose condition holds is taken.",
        )]),
    ];
    for machine in &machines {
        let name = machine.name().last();
        blocks.push(heading(4, name, None));
        let outermost = machine.states().filter(|(_, state)| state.parent.is_none());
        let boxes = outermost.map(|(index, _)| state(machine, index, &service.id));
        blocks.push(Block::States(boxes.collect()));
        let drawings = [
            ("Drawing for Mermaid", "mermaid", mermaid(machine)),
            ("Drawing for Graphviz (DOT)", "dot", dot(machine)),
        ];
        blocks.extend(drawings.map(|(summary, language, text)| Block::Details {
            summary: summary.to_owned(),
            blocks: vec![Block::Source { language, text }],
        }));
    }
    blocks
}

fn state(machine: &Machine<'_>, index: StateIndex, own: &Id) -> StateBox {
    let state_of = machine.state(index);
    let mut lines = Vec::new();
    lines.extend(effect("on entry", &state_of.entry));
    lines.extend(effect("on exit", &state_of.exit));
    for declared in &state_of.transitions {
        lines.push(transition(machine, index, declared, own));
    }
    for declared in &state_of.default_transitions {
        let mut line = transition(machine, index, declared, own);
        line.insert(0, muted("otherwise "));
        lines.push(line);
    }
    let first = match state_of.parent {
        Some(parent) => machine.state(parent).initial == Some(index),
        None => is_within(machine, machine.start(), index),
    };
    StateBox {
        name: state_of.path.last().to_owned(),
        first,
        lines,
        children: state_of
            .children
            .iter()
            .map(|child| state(machine, *child, own))
            .collect(),
    }
}

fn is_within(machine: &Machine<'_>, inner: StateIndex, outer: StateIndex) -> bool {
    let around = |index: &StateIndex| machine.state(*index).parent;
    std::iter::successors(Some(inner), around).any(|index| index == outer)
}

fn effect(when: &str, actions: &[Declared<'_, Action>]) -> Option<Line> {
    let names: Vec<_> = actions.iter().map(|action| shown(action.item)).collect();
    let line = vec![muted(format!("{when}: ")), code(names.join(", "))];
    (!names.is_empty()).then_some(line)
}

fn transition(
    machine: &Machine<'_>,
    from: StateIndex,
    declared: &Declared<'_, Transition>,
    own: &Id,
) -> Line {
    let transition = declared.item;
    let trigger = &transition.trigger;
    let mut line = vec![match trigger.message().or(trigger.name()) {
        Some(event) => code(event),
        None => text("any other event"),
    }];
    if let Some(guard) = &transition.guard {
        line.extend([muted(" if "), code(guard.to_string())]);
    }
    let target = machine.target(from, transition);
    let target = target.map_or_else(|| "?".to_owned(), |to| distinct(machine, from, to));
    match &transition.kind {
        TransitionKind::Internal => {}
        TransitionKind::To(_) => line.push(text(format!(" → {target}"))),
        TransitionKind::Again => line.push(text(" → again")),
        TransitionKind::Push(push) => {
            let back = push.back.as_ref().map(|back| format!(" to {back}"));
            let back = back.unwrap_or_default();
            line.push(text(format!(" → {target}, with return{back}")));
        }
        TransitionKind::Pop(None) => line.push(text(" → back")),
        TransitionKind::Pop(Some(then)) => {
            line.extend([text(" → back, then "), code(then.name.last())]);
        }
    }
    let actions: Vec<_> = transition.actions.iter().map(shown).collect();
    if !actions.is_empty() {
        line.extend([muted(": "), code(actions.join(", "))]);
    }
    if declared.service.id != *own {
        line.push(inherited(declared.service));
    }
    line
}

/// The path of a state, without the outer states that it shares with another.
fn distinct(machine: &Machine<'_>, from: StateIndex, to: StateIndex) -> String {
    let (from, to) = (&machine.state(from).path, &machine.state(to).path);
    let pairs = from.parts().iter().zip(to.parts());
    let shared = pairs.take_while(|(a, b)| a.eq_ignore_ascii_case(b)).count();
    let shared = shared.min(to.parts().len().saturating_sub(1));
    to.parts()[shared..].join(".")
}

fn inherited(service: &Service) -> Inline {
    muted(format!(" ({})", service.name))
}

/// An action without qualification and without the parameters common to all.
fn shown(action: &Action) -> String {
    let texts = action.arguments.iter().filter_map(|a| a.text());
    let sends = (action.kind == ActionKind::Send).then_some("send");
    let words = sends.into_iter().chain([action.name.last()]).chain(texts);
    words.collect::<Vec<_>>().join(" ")
}
