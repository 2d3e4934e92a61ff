//! Compares the state machines that services declare. They are not on the wire: a change of
//! behaviour does not affect the octets of a message.

use super::Walk;
use crate::behaviour::{Action, ActionKind, State, StateMachine, Transition, TransitionKind};

impl Walk<'_> {
    pub(super) fn machines(&mut self, old: &[StateMachine], new: &[StateMachine]) {
        for machine in old {
            let same = new.iter().find(|it| it.name == machine.name);
            let place = same.map(|it| &it.location);
            let name = machine.name.to_string();
            self.inside(name, Some(&machine.location), place, |walk| match same {
                Some(same) => walk.machine(machine, same),
                None => walk.report(false, "the state machine was removed"),
            });
        }
        for machine in new {
            if old.iter().all(|it| it.name != machine.name) {
                let name = machine.name.to_string();
                self.inside(name, None, Some(&machine.location), |walk| {
                    walk.report(false, "the state machine was added");
                });
            }
        }
    }

    fn machine(&mut self, old: &StateMachine, new: &StateMachine) {
        self.value(false, "the start state", &old.start, &new.start);
        self.states(&old.states, &new.states);
        self.transitions(&old.default_transitions, &new.default_transitions);
    }

    fn states(&mut self, old: &[State], new: &[State]) {
        for state in old {
            let same = new.iter().find(|it| it.name == state.name);
            let place = same.map(|it| &it.location);
            let name = state.name.clone();
            self.inside(name, Some(&state.location), place, |walk| match same {
                Some(same) => walk.state(state, same),
                None => walk.report(false, "the state was removed"),
            });
        }
        for state in new {
            if old.iter().all(|it| it.name != state.name) {
                self.inside(state.name.clone(), None, Some(&state.location), |walk| {
                    walk.report(false, "the state was added");
                });
            }
        }
    }

    fn state(&mut self, old: &State, new: &State) {
        let initial = |state: &State| state.initial.clone().unwrap_or_else(|| "absent".into());
        self.value(false, "the initial state", &initial(old), &initial(new));
        let pairs = [
            ("the list of actions on entry", &old.entry, &new.entry),
            ("the list of actions on exit", &old.exit, &new.exit),
        ];
        for (what, old, new) in pairs {
            self.value(false, what, &actions(old), &actions(new));
        }
        self.transitions(&old.transitions, &new.transitions);
        self.transitions(&old.default_transitions, &new.default_transitions);
        self.states(&old.children, &new.children);
    }

    /// Compares the transitions of a state. Those with the same trigger and guard correspond.
    fn transitions(&mut self, old: &[Transition], new: &[Transition]) {
        let mut kept = Vec::new();
        for transition in old {
            let same =
                |it: &Transition| it.trigger == transition.trigger && it.guard == transition.guard;
            let position = new.iter().position(same);
            let other = position.map(|at| &new[at]);
            kept.extend(position);
            let place = other.map(|it| &it.location);
            let name = label(transition);
            self.inside(
                name,
                Some(&transition.location),
                place,
                |walk| match other {
                    Some(other) => {
                        let (was, is) = (target(transition), target(other));
                        walk.value(false, "the target", &was, &is);
                        let (was, is) = (actions(&transition.actions), actions(&other.actions));
                        walk.value(false, "the list of actions", &was, &is);
                    }
                    None => walk.report(false, "the transition was removed"),
                },
            );
        }
        for (position, transition) in new.iter().enumerate() {
            if !kept.contains(&position) {
                let place = Some(&transition.location);
                self.inside(label(transition), None, place, |walk| {
                    walk.report(false, "the transition was added");
                });
            }
        }
        // Only transitions with the same trigger compete.
        let competes = |two: &&[usize]| new[two[0]].trigger == new[two[1]].trigger;
        let mut neighbours = kept.windows(2).filter(competes);
        if neighbours.any(|two| two[0] > two[1]) {
            self.report(false, "the order in which transitions are tried changed");
        }
    }
}

/// `event [guard]`
fn label(transition: &Transition) -> String {
    let trigger = &transition.trigger;
    let event = trigger.message().or(trigger.name());
    let event = event.unwrap_or("any other event").to_owned();
    match &transition.guard {
        Some(guard) => format!("{event} [{guard}]"),
        None => event,
    }
}

fn target(transition: &Transition) -> String {
    match &transition.kind {
        TransitionKind::Internal => "the same state, without exit and entry".to_owned(),
        TransitionKind::Again => "the same state again".to_owned(),
        TransitionKind::To(end) => format!("`{end}`"),
        TransitionKind::Push(push) => match &push.back {
            Some(back) => format!("`{}` with return to `{back}`", push.to),
            None => format!("`{}` with return", push.to),
        },
        TransitionKind::Pop(None) => "the remembered state".to_owned(),
        TransitionKind::Pop(Some(then)) => format!("the remembered state, then `{then}`"),
    }
}

fn actions(actions: &[Action]) -> String {
    if actions.is_empty() {
        return "nothing".to_owned();
    }
    let shown = actions.iter().map(|action| {
        let sends = match action.kind {
            ActionKind::Call => "",
            ActionKind::Send => "send ",
        };
        let arguments: Vec<_> = action.arguments.iter().map(ToString::to_string).collect();
        format!("`{sends}{}({})`", action.name, arguments.join(", "))
    });
    shown.collect::<Vec<_>>().join(", ")
}
