//! Resolves messages, events and their sections.

use std::rc::Rc;
use std::sync::Arc;

use super::item::{measure, text};
use super::{Resolved, Resolver, Whole};
use crate::check;
use crate::heads;
use crate::model::{Item, Message};
use crate::permission::{self, Permission};
use crate::source::{Span, Spanned};
use crate::syntax::{Content, Declaration, EventDef, MessageDef, Section, TypeSetIndex};

impl Resolver<'_> {
    /// Resolves a `message_def`.
    pub(super) fn message(
        &mut self,
        scope: TypeSetIndex,
        declaration: &Declaration,
        definition: &MessageDef,
    ) -> Option<Arc<Message>> {
        let message = definition;
        let header = self.section(scope, &message.header);
        let body = self.section(scope, &message.body);
        let footer = self.section(scope, &message.footer);
        let header = self.header(&message.header, header?.as_deref())?;
        let message = Arc::new(Message {
            name: declaration.name.clone(),
            code: message.code,
            is_command: message.is_command,
            is_deprecated: message.is_deprecated,
            permission: message.permission.clone(),
            stops: message.stops,
            destination: message.destination.as_ref().map(|it| it.value.clone()),
            description: message.description.clone(),
            header,
            body: self.taken(body?, &message.body)?,
            footer: self.taken(footer?, &message.footer)?,
            location: self.location(declaration.span),
        });
        let is_found = self.field_of_permission(declaration.span, &message);
        (is_found && self.destination(&definition.destination, &message)).then_some(message)
    }

    /// Checks that a node finds the field that belongs to the permission of a message.
    fn field_of_permission(&mut self, span: Span, message: &Message) -> bool {
        let Some(field) = message.permission.as_ref().and_then(Permission::field) else {
            return true;
        };
        let is_found = heads::place_of(message, field).is_some();
        if !is_found {
            let text = format!(
                "a node cannot find the field `{field}`: name an `unsigned byte` in the body, a record \
                 without optional fields, with nothing of variable length before it"
            );
            self.report.error(span, text);
        }
        is_found
    }

    /// Checks that a node finds the destinations of the messages that a message carries.
    fn destination(&mut self, field: &Option<Spanned<String>>, message: &Message) -> bool {
        let Some(field) = field.as_ref() else {
            return true;
        };
        let is_found = permission::has_destinations(message);
        if !is_found {
            let text = format!(
                "a node cannot find the field `{}`: name a field of 4 octets that is not optional, in the \
                 same record or sequence as the carried message and before it",
                field.value
            );
            self.report.error(field.span, text);
        }
        is_found
    }

    /// Resolves an `event_def`, only to find its mistakes.
    pub(super) fn event(&mut self, scope: TypeSetIndex, event: &EventDef) -> Option<()> {
        let sections: Vec<_> = event
            .sections
            .iter()
            .map(|section| self.section(scope, section))
            .collect();
        sections.iter().all(Option::is_some).then_some(())
    }

    /// Resolves the content of a section; `Some(None)` if it is empty.
    pub(super) fn section(
        &mut self,
        scope: TypeSetIndex,
        section: &Section,
    ) -> Option<Option<Rc<Whole>>> {
        match &section.content {
            Content::Empty => Some(None),
            Content::Node(node) => {
                let whole = self.whole(scope, node);
                let what = "the composite at the top of a message";
                let item = whole.as_ref().map(|whole| &whole.item);
                let sound = check::required(self.report, what, node, item);
                whole.filter(|_| sound).map(Some)
            }
            Content::Reference(target) => match self.follow(scope, target)? {
                Resolved::Section(content) => Some(content),
                _ => None,
            },
            Content::Faulty => None,
        }
    }

    /// The item itself, or a copy if a declaration still holds it.
    fn taken(&mut self, whole: Option<Rc<Whole>>, section: &Section) -> Option<Option<Item>> {
        let Some(whole) = whole else {
            return Some(None);
        };
        match Rc::try_unwrap(whole) {
            Ok(whole) => Some(Some(whole.item)),
            Err(shared) => {
                self.spend(shared.items, section.span)?;
                Some(Some(shared.item.clone()))
            }
        }
    }

    /// The message, renamed as the reference says.
    pub(super) fn renamed(
        &mut self,
        message: Arc<Message>,
        reference: &Declaration,
    ) -> Option<Arc<Message>> {
        if message.name == reference.name {
            return Some(message);
        }
        // With an exhausted budget nothing is measured, as that takes time too.
        self.spend(1, reference.span)?;
        let items = message.body.as_ref().map_or(0, |body| measure(body).0);
        self.spend(items + text(&message.description), reference.span)?;
        let mut renamed = Message::clone(&message);
        renamed.name.clone_from(&reference.name);
        Some(Arc::new(renamed))
    }

    /// The content of a header besides the message code.
    fn header(&mut self, section: &Section, header: Option<&Whole>) -> Option<Option<Item>> {
        match check::header(header.map(|whole| &whole.item)) {
            Ok(rest) => Some(rest),
            Err(message) => {
                self.report.error(section.span, message);
                None
            }
        }
    }
}
