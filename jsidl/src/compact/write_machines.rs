//! Writes protocol behaviour in the compact form.

use super::cursor::Place;
use super::machines::TARGETS;
use super::tree::Element;
use super::words;
use super::writer::{Inexpressible, Writer, Written, explained};

impl Writer {
    /// Writes an element of protocol behaviour; `false` if it is none.
    pub(super) fn behaviour(&mut self, element: &Element, indent: usize) -> Written<bool> {
        let name = element.value("name");
        match element.name {
            "protocol_behavior" => {
                let stateless = if element.value("is_stateless") == "true" {
                    "stateless "
                } else {
                    ""
                };
                self.block(
                    &format!("{stateless}protocol"),
                    element,
                    Place::Protocol,
                    indent,
                    "",
                )?;
            }
            "state_machine" => {
                let mut bare = element.clone();
                let start = bare.children.iter().position(|it| it.name == "start");
                let start = bare.children.remove(start.ok_or(Inexpressible)?);
                let head = format!(
                    "state_machine {name} ({}start {})",
                    explained(&start),
                    start.value("state_name")
                );
                self.block(&head, &bare, Place::Machine, indent, "")?;
            }
            "state" if name == "default" => return Err(Inexpressible),
            "state" => {
                let initial = if element.attribute("initial").is_some() {
                    "initial "
                } else {
                    ""
                };
                self.block(
                    &format!("{initial}state {name}"),
                    element,
                    Place::State,
                    indent,
                    "",
                )?;
            }
            "default_state" => self.block("state default", element, Place::State, indent, "")?,
            "entry" | "exit" => {
                self.line(indent, &format!("{} {{", element.name));
                self.actions(element, indent + 2)?;
                self.line(indent, "}");
            }
            "transition" | "default_transition" => self.transition(element, indent)?,
            "guard" => {
                self.line(indent, &format!("guard: {};", element.value("condition")));
            }
            "action" | "send_action" => {
                self.line(indent, &format!("{name}{};", arguments(element)));
            }
            _ => return Ok(false),
        }
        Ok(true)
    }

    fn transition(&mut self, element: &Element, indent: usize) -> Written<()> {
        let target = element
            .children
            .iter()
            .find(|it| TARGETS.contains(&it.name));
        let target = target.ok_or(Inexpressible)?;
        let head = if element.name == "transition" {
            format!(
                "{} transition {} ({})",
                target.name,
                element.value("name"),
                parameters(element)
            )
        } else {
            format!("default {} transition", target.name)
        };
        self.line(indent, &format!("{head} {{"));
        if let Some(guard) = element.child("guard") {
            self.item(guard, Place::Transition, indent + 2)?;
        }
        self.actions(element, indent + 2)?;
        self.target(target, indent + 2)?;
        self.comments(&element.trailing, indent + 2);
        self.line(indent, "}");
        Ok(())
    }

    /// Actions in order, in as many lists as that needs.
    fn actions(&mut self, element: &Element, indent: usize) -> Written<()> {
        let actions: Vec<_> = element
            .children
            .iter()
            .filter(|it| it.name.ends_with("action"))
            .collect();
        for group in actions.chunk_by(|a, b| a.name == b.name) {
            let (word, place) = match group.first().map(|it| it.name) {
                Some("send_action") => ("send actions {", Place::SendActions),
                _ => ("actions {", Place::Actions),
            };
            self.line(indent, word);
            for action in group {
                self.item(action, place, indent + 2)?;
            }
            self.line(indent, "}");
        }
        Ok(())
    }

    fn target(&mut self, target: &Element, indent: usize) -> Written<()> {
        let explained = explained(target);
        let explained = explained.trim_end();
        if !explained.is_empty() {
            self.line(indent, explained);
        }
        let end = |of: &Element| {
            let end = of.child("end_state").ok_or(Inexpressible)?;
            Ok(format!("-> {};", end.value("state")))
        };
        match target.name {
            "internal" => {}
            "pop" => {
                let secondary = match target.value("transition") {
                    "" if target.children.is_empty() => String::new(),
                    "" => return Err(Inexpressible),
                    name => format!("secondary {name}{}", arguments(target)),
                };
                self.line(indent, &format!("{secondary};"));
            }
            "push" => {
                let line = end(target)?;
                let back = target.child("simple").map(end).transpose()?;
                let back = back.map_or_else(String::new, |it| format!(" popto {it}"));
                self.line(indent, &format!("{line}{back}"));
            }
            _ => {
                let line = end(target)?;
                self.line(indent, &line);
            }
        }
        Ok(())
    }
}

fn arguments(element: &Element) -> String {
    let arguments = element.children.iter().filter(|it| it.name == "argument");
    let arguments: Vec<_> = arguments
        .map(|it| format!("{}{}", explained(it), it.value("value")))
        .collect();
    format!("({})", arguments.join(", "))
}

fn parameters(element: &Element) -> String {
    let parameters = element.children.iter().filter(|it| it.name == "parameter");
    let parameters: Vec<_> = parameters
        .map(|it| {
            let kind = it.value("type");
            let kind = words::parameter_word(kind).unwrap_or(kind);
            format!("{}{kind} {}", explained(it), it.value("value"))
        })
        .collect();
    parameters.join(", ")
}
