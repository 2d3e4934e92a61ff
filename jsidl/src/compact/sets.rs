//! Reads whole files of the compact form: services, type sets and constant sets, and messages.

use super::cursor::{Cursor, Place, Read};
use super::lexer::{Fault, Kind};
use super::tree::Element;

/// Words with which a file begins.
pub(super) const ROOTS: [&str; 3] = ["service", "typeset", "constants"];

impl Cursor<'_> {
    /// The one construct of a file.
    pub(super) fn file(&mut self) -> Read<Element> {
        let start = self.begin(Vec::new());
        let mut root = self.root()?;
        if self.kind() != Kind::End {
            return Err(self.unexpected("the end: a file holds one service or set"));
        }
        root.trailing.append(&mut self.rest());
        self.finish(start, root)
    }

    pub(super) fn root(&mut self) -> Read<Element> {
        let root = match self.next() {
            "service" => self.service(),
            "typeset" => self.type_set(),
            "constants" => self.const_set(),
            _ => Err(self.unexpected("`service`, `typeset` or `constants`")),
        }?;
        self.accept(";");
        Ok(root)
    }

    fn service(&mut self) -> Read<Element> {
        let (_, at) = self.take();
        let mut service = Element::new("service_def", at);
        let (name, at) = self.name()?;
        service.set("name", name, at);
        self.identity(&mut service)?;
        self.fill(&mut service, Place::Service)?;
        one_of_each(&service)?;
        Ok(service)
    }

    pub(super) fn section_of_service(&mut self) -> Read<Element> {
        let element = match self.next() {
            "description" => self.prose("description"),
            "assumptions" => self.prose("assumptions"),
            "references" => self.holding("references", Place::References),
            "constants" => self.const_set(),
            "typeset" => self.type_set(),
            "messages" => self.holding("message_set", Place::Messages),
            "eventset" => self.holding("internal_events_set", Place::Events),
            "protocol" | "stateless" => self.protocol(),
            _ => Err(self.unexpected(
                "a part of a service, such as `description`, `messages` or `protocol`",
            )),
        }?;
        self.accept(";");
        one_of_each(&element)?;
        Ok(element)
    }

    /// A word and what is in braces.
    fn holding(&mut self, name: &'static str, place: Place) -> Read<Element> {
        let (_, at) = self.take();
        let mut element = Element::new(name, at);
        self.fill(&mut element, place)?;
        Ok(element)
    }

    /// `(id = …, version = …)`
    fn identity(&mut self, element: &mut Element) -> Read<()> {
        for sign in ["(", "id", "="] {
            self.expect(sign)?;
        }
        let (id, at) = self.path()?;
        element.set("id", id.replace('.', ":"), at);
        for sign in [",", "version", "="] {
            self.expect(sign)?;
        }
        let (version, at) = self.number()?;
        element.set("version", version, at);
        self.expect(")")
    }

    /// A word, a text and `;`.
    fn prose(&mut self, name: &'static str) -> Read<Element> {
        let (_, at) = self.take();
        let mut element = Element::new(name, at);
        let text = self.text()?;
        self.expect(";")?;
        if !text.value.trim().is_empty() {
            element.text = Some(text);
        }
        Ok(element)
    }

    /// `inherits_from import URN as name;`
    pub(super) fn service_reference(&mut self) -> Read<Element> {
        let name = match self.next() {
            "inherits_from" => "inherits_from",
            "client_of" => "client_of",
            _ => return Err(self.unexpected("`inherits_from` or `client_of`")),
        };
        self.take();
        let interpretation = self.interpretation();
        self.expect("import")?;
        let mut element = self.alias(name)?;
        if let Some(text) = interpretation {
            element.set("interpretation", text.value, text.at);
        }
        Ok(element)
    }

    /// `URN as name;`
    fn alias(&mut self, element: &'static str) -> Read<Element> {
        let (id, at) = self.path()?;
        self.expect("as")?;
        let (name, name_at) = self.name()?;
        self.expect(";")?;
        Ok(Element::new(element, at).with("name", name, name_at).with(
            "id",
            id.replace('.', ":"),
            at,
        ))
    }

    /// The name of a set and its identity, which a set in a service may lack.
    fn set(&mut self, element: &'static str, place: Place) -> Read<Element> {
        let (_, at) = self.take();
        let (name, name_at) = self.name()?;
        let mut set = Element::new(element, at).with("name", name, name_at);
        if self.next() == "(" {
            self.identity(&mut set)?;
        }
        self.fill(&mut set, place)?;
        Ok(set)
    }

    fn const_set(&mut self) -> Read<Element> {
        self.set("declared_const_set", Place::ConstSet)
    }

    fn type_set(&mut self) -> Read<Element> {
        self.set("declared_type_set", Place::TypeSet)
    }

    fn using(&mut self) -> Read<Element> {
        self.take();
        if self.accept("constants") {
            self.alias("declared_const_set_ref")
        } else if self.accept("typeset") {
            self.alias("declared_type_set_ref")
        } else {
            Err(self.unexpected("`constants` or `typeset`"))
        }
    }

    /// `uint8 NAME = 0 one;`, or a reference to a set.
    pub(super) fn constant(&mut self) -> Read<Element> {
        if self.next() == "using" {
            return self.using();
        }
        let (number, at) = self.number_type()?;
        let (name, name_at) = self.name()?;
        self.expect("=")?;
        let value_at = self.here();
        while self.kind() != Kind::End && self.ahead(1) != ";" && self.next() != ";" {
            self.take();
        }
        let value = self.text.get(value_at..self.end()).unwrap_or_default();
        if value.is_empty() {
            return Err(self.unexpected("a value and its unit"));
        }
        let (unit, unit_at) = self.unit()?;
        self.expect(";")?;
        Ok(Element::new("const_def", at)
            .with("name", name, name_at)
            .with("const_type", number, at)
            .with("const_value", value, value_at)
            .with("field_units", unit, unit_at))
    }

    pub(super) fn declaration(&mut self, optional: bool) -> Read<Element> {
        let element = match (self.next(), self.ahead(1)) {
            (_, ".") => self.member(optional),
            ("using", _) => self.using(),
            ("command" | "message", _) => self.message(),
            ("header" | "body" | "footer", _) => self.part_of_message(),
            ("event", _) => self.event(),
            _ => self.member(optional),
        }?;
        self.accept(";");
        Ok(element)
    }

    /// The incoming or the outgoing messages.
    pub(super) fn direction(&mut self) -> Read<Element> {
        let element = match self.next() {
            "input" => self.holding("input_set", Place::TypeSet),
            "output" => self.holding("output_set", Place::TypeSet),
            _ => Err(self.unexpected("`input` or `output`")),
        }?;
        self.accept(";");
        Ok(element)
    }

    pub(super) fn internal_event(&mut self) -> Read<Element> {
        let element = match self.next() {
            "event" => self.event(),
            "eventset" => self.declared("declared_event_def"),
            _ => Err(self.unexpected("`event`")),
        }?;
        self.accept(";");
        Ok(element)
    }

    /// A word, a path, a name.
    fn declared(&mut self, element: &'static str) -> Read<Element> {
        let (_, at) = self.take();
        let (path, path_at) = self.path()?;
        let (name, name_at) = self.name()?;
        let name = name.strip_suffix(super::words::SAME_NAME).unwrap_or(name);
        Ok(Element::new(element, at).with("name", name, name_at).with(
            "declared_type_ref",
            path,
            path_at,
        ))
    }

    fn message(&mut self) -> Read<Element> {
        let at = self.here();
        let is_command = self.accept("command");
        if self.next() != "message" {
            return Err(self.unexpected("`message`"));
        }
        if !self.ahead(1).starts_with(|it: char| it.is_ascii_digit()) {
            let message = self.declared("declared_message_def")?;
            self.expect(";")?;
            return Ok(message);
        }
        self.take();
        let (code, code_at) = self.number()?;
        let digits = code.strip_prefix("0x").or_else(|| code.strip_prefix("0X"));
        let Some(digits) = digits.filter(|it| it.len() == 4) else {
            let message = "a message code has four hexadecimal digits: write it as `0x4B00`";
            return Err(Fault::new(code_at, message));
        };
        let (name, name_at) = self.name()?;
        let mut element = Element::new("message_def", at)
            .with("name", name, name_at)
            .with("message_id", digits, code_at + 2)
            .with("is_command", if is_command { "true" } else { "false" }, at);
        self.fill(&mut element, Place::Message)?;
        one_of_each(&element)?;
        Ok(element)
    }

    fn event(&mut self) -> Read<Element> {
        let (_, at) = self.take();
        let (name, name_at) = self.name()?;
        let mut element = Element::new("event_def", at).with("name", name, name_at);
        self.fill(&mut element, Place::Message)?;
        one_of_each(&element)?;
        Ok(element)
    }

    /// Description, header, body or footer.
    pub(super) fn part_of_message(&mut self) -> Read<Element> {
        let element = match self.next() {
            "description" => self.prose("description"),
            "header" => self.section("header", "declared_header"),
            "body" => self.section("body", "declared_body"),
            "footer" => self.section("footer", "declared_footer"),
            _ => Err(self.unexpected("`description`, `header`, `body` or `footer`")),
        }?;
        self.accept(";");
        Ok(element)
    }

    /// A section with its content, or a reference to one.
    fn section(&mut self, name: &'static str, declared: &'static str) -> Read<Element> {
        if self.ahead(2) != "{" {
            return self.declared(declared);
        }
        let (_, at) = self.take();
        let (title, title_at) = self.name()?;
        let mut section = Element::new(name, at).with("name", title, title_at);
        self.fill(&mut section, Place::Member)?;
        Ok(section)
    }
}

/// Refuses a second element of a kind.
fn one_of_each(element: &Element) -> Read<()> {
    if matches!(
        element.name,
        "references"
            | "declared_const_set"
            | "declared_type_set"
            | "internal_events_set"
            | "protocol_behavior"
    ) {
        return Ok(());
    }
    for (position, child) in element.children.iter().enumerate() {
        if element.children[..position]
            .iter()
            .any(|it| it.name == child.name)
        {
            let message = format!("there is a second `{}`: join them", child.name);
            return Err(Fault::new(child.at, message));
        }
    }
    Ok(())
}
