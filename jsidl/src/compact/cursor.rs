//! Cursor over the tokens of the compact form: names, numbers and texts, and the comments,
//! amendments and interpretations that precede a construct.

use roxmltree::Document;

use super::lexer::{Fault, Kind, Remark, Token, tokens, unquoted};
use super::tree::{Element, REFERENCE, Text, name_of};
use super::words;
use crate::syntax::EXTENSION;

pub(super) type Read<T> = Result<T, Fault>;

/// Maximum nesting of constructs; published definitions need 10.
const DEEPEST: usize = 40;

/// Maximum number of syntax errors that are reported in a text.
const MOST_FAULTS: usize = 20;

/// Reads one text.
pub(super) struct Cursor<'t> {
    pub(super) text: &'t str,
    tokens: Vec<Token>,
    remarks: Vec<Remark>,
    at: usize,
    next_remark: usize,
    depth: usize,
    /// Comments within a construct: they move to the next one.
    pub(super) stray: Vec<String>,
    pub(super) faults: Vec<Fault>,
}

/// Where a construct stands, which decides what it may be.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Place {
    /// A whole file.
    File,
    Service,
    References,
    ConstSet,
    /// A type set, or the incoming or outgoing messages.
    TypeSet,
    Messages,
    Events,
    /// A message or an event.
    Message,
    /// A section or a composite.
    Member,
    /// A variant.
    Alternative,
    ValueSet,
    BitField,
    VariableField,
    VariableFormatField,
    Protocol,
    Machine,
    State,
    Transition,
    /// What happens on entry or exit.
    Reaction,
    Actions,
    SendActions,
}

/// What precedes a construct.
pub(super) struct Start {
    /// Position of its first word.
    pub(super) at: usize,
    /// Whether it begins with `optional`.
    pub(super) optional: bool,
    interpretation: Option<Text>,
    comments: Vec<String>,
    amendments: Vec<(usize, String)>,
}

impl Start {
    pub(super) fn has_interpretation(&self) -> bool {
        self.interpretation.is_some()
    }
}

impl<'t> Cursor<'t> {
    pub(super) fn new(text: &'t str) -> Read<Self> {
        let (tokens, remarks) = tokens(text)?;
        Ok(Self {
            text,
            tokens,
            remarks,
            at: 0,
            next_remark: 0,
            depth: 0,
            stray: Vec::new(),
            faults: Vec::new(),
        })
    }

    fn token(&self, ahead: usize) -> Token {
        let last = self.tokens.len() - 1;
        self.tokens[(self.at + ahead).min(last)]
    }

    /// Kind of the next token.
    pub(super) fn kind(&self) -> Kind {
        self.token(0).kind
    }

    /// Position of the next token.
    pub(super) fn here(&self) -> usize {
        self.token(0).at as usize
    }

    /// End of the last token.
    pub(super) fn end(&self) -> usize {
        let last = self.at.checked_sub(1).map(|it| self.tokens[it]);
        last.map_or(0, |it| it.end as usize)
    }

    fn written(&self, token: Token) -> &'t str {
        &self.text[token.at as usize..token.end as usize]
    }

    /// The next token as written.
    pub(super) fn next(&self) -> &'t str {
        self.written(self.token(0))
    }

    /// The token after so many others, as written.
    pub(super) fn ahead(&self, count: usize) -> &'t str {
        self.written(self.token(count))
    }

    /// Takes the next token.
    pub(super) fn take(&mut self) -> (&'t str, usize) {
        let token = self.token(0);
        self.collect_remarks();
        if token.kind != Kind::End {
            self.at += 1;
        }
        (self.written(token), token.at as usize)
    }

    /// Remarks before the next token that no construct has claimed.
    fn collect_remarks(&mut self) {
        for (at, text, is_amendment) in self.remarks_here() {
            if is_amendment {
                let message = "`//@` stands before the construct that it amends: move it there";
                self.fault(Fault::new(at, message));
            } else {
                self.stray.push(text);
            }
        }
    }

    pub(super) fn remarks_here(&mut self) -> Vec<(usize, String, bool)> {
        let mut found = Vec::new();
        while let Some(remark) = self
            .remarks
            .get(self.next_remark)
            .filter(|it| it.token <= self.at)
        {
            let text = &self.text[remark.start as usize..remark.end as usize];
            found.push((remark.at as usize, text.to_owned(), remark.is_amendment));
            self.next_remark += 1;
        }
        found
    }

    pub(super) fn fault(&mut self, fault: Fault) {
        if self.faults.len() < MOST_FAULTS {
            self.faults.push(fault);
        }
    }

    /// Takes the next token if it is this word or sign.
    pub(super) fn accept(&mut self, word: &str) -> bool {
        let matches = matches!(self.kind(), Kind::Word | Kind::Sign) && self.next() == word;
        if matches {
            self.take();
        }
        matches
    }

    pub(super) fn expect(&mut self, word: &str) -> Read<()> {
        if self.accept(word) {
            Ok(())
        } else {
            Err(self.unexpected(&format!("`{word}`")))
        }
    }

    /// The fault that something else was expected here.
    pub(super) fn unexpected(&self, what: &str) -> Fault {
        let token = self.token(0);
        let found = match token.kind {
            Kind::End => "the text ends".to_owned(),
            _ => format!(
                "there is `{}`",
                crate::spelling::shortened(self.written(token))
            ),
        };
        Fault::new(token.at as usize, format!("expected {what}, but {found}"))
    }

    /// A name: any word.
    pub(super) fn name(&mut self) -> Read<(&'t str, usize)> {
        match self.kind() {
            Kind::Word => Ok(self.take()),
            _ => Err(self.unexpected("a name")),
        }
    }

    /// Names joined by dots.
    pub(super) fn path(&mut self) -> Read<(String, usize)> {
        let (name, at) = self.name()?;
        let mut path = name.to_owned();
        while self.kind() == Kind::Sign && self.next() == "." {
            self.take();
            let (name, _) = self.name()?;
            path.push('.');
            path.push_str(name);
        }
        Ok((path, at))
    }

    pub(super) fn text(&mut self) -> Read<Text> {
        match self.kind() {
            Kind::Text => {
                let (written, at) = self.take();
                Ok(Text {
                    value: unquoted(written),
                    at: at + 1,
                })
            }
            _ => Err(self.unexpected("a text in quotes")),
        }
    }

    pub(super) fn number(&mut self) -> Read<(&'t str, usize)> {
        match self.kind() {
            Kind::Number => Ok(self.take()),
            _ => Err(self.unexpected("a number")),
        }
    }

    /// An expression up to one of these signs, which is not taken.
    pub(super) fn expression(&mut self, ends: &[&str]) -> Read<(String, usize)> {
        let start = self.here();
        let mut depth = 0_usize;
        while self.kind() != Kind::End {
            let next = self.next();
            if depth == 0 && ends.contains(&next) {
                break;
            }
            match next {
                ";" | "{" | "}" => break,
                "(" => depth += 1,
                ")" => depth = depth.saturating_sub(1),
                _ => {}
            }
            self.take();
        }
        let text = self.text.get(start..self.end()).unwrap_or_default();
        if text.is_empty() || self.kind() == Kind::End {
            return Err(self.unexpected("a number or a constant"));
        }
        Ok((text.to_owned(), start))
    }

    /// The type of a number.
    pub(super) fn number_type(&mut self) -> Read<(&'static str, usize)> {
        let Some(known) = words::number(self.next()).filter(|_| self.kind() == Kind::Word) else {
            return Err(self.unexpected("a type such as `uint8`, `int32` or `double`"));
        };
        let (_, at) = self.take();
        Ok((known, at))
    }

    pub(super) fn unit(&mut self) -> Read<(&'static str, usize)> {
        let Some(known) = words::unit(self.next()).filter(|_| self.kind() == Kind::Word) else {
            return Err(self.unexpected("a unit such as `one` or `meter_per_second`"));
        };
        let (_, at) = self.take();
        Ok((known, at))
    }

    /// Takes an interpretation, if there is one.
    pub(super) fn interpretation(&mut self) -> Option<Text> {
        if self.kind() != Kind::Interpretation {
            return None;
        }
        let (written, at) = self.take();
        let inner = written.get(2..written.len() - 2).unwrap_or_default();
        Some(Text {
            value: inner.split_whitespace().collect::<Vec<_>>().join(" "),
            at: at + 2,
        })
    }

    /// Takes what precedes a construct; some remarks may be taken already.
    pub(super) fn begin(&mut self, before: Vec<(usize, String, bool)>) -> Start {
        let mut comments = std::mem::take(&mut self.stray);
        let mut amendments = Vec::new();
        let mut claim = |found: Vec<(usize, String, bool)>| {
            for (at, text, is_amendment) in found {
                if is_amendment {
                    amendments.push((at, text));
                } else {
                    comments.push(text);
                }
            }
        };
        claim(before);
        claim(self.remarks_here());
        let interpretation = self.interpretation();
        claim(self.remarks_here());
        let at = self.here();
        let optional = self.next() == "optional"
            && self.token(1).kind == Kind::Word
            && self.accept("optional");
        Start {
            at,
            optional,
            interpretation,
            comments,
            amendments,
        }
    }

    /// Adds what preceded a construct to its element.
    pub(super) fn finish(&mut self, start: Start, mut element: Element) -> Read<Element> {
        if let Some(text) = start.interpretation {
            element.set("interpretation", text.value, text.at);
        }
        let mut comments = start.comments;
        comments.append(&mut element.comments);
        element.comments = comments;
        for (at, amendment) in &start.amendments {
            amend(&mut element, amendment, *at)?;
        }
        Ok(element)
    }

    /// Gives back what preceded a construct that is not there.
    pub(super) fn abandon(&mut self, start: Start) -> Read<()> {
        self.stray.extend(start.comments);
        if let Some((at, _)) = start.amendments.first() {
            return Err(Fault::new(
                *at,
                "`//@` stands before the construct that it amends: move it there",
            ));
        }
        match start.interpretation {
            Some(text) => Err(Fault::new(
                text.at,
                "an interpretation stands before what it explains: move it there",
            )),
            None => Ok(()),
        }
    }

    /// Reads the constructs in braces into an element. After a mistake it goes on with the next one.
    pub(super) fn fill(&mut self, element: &mut Element, place: Place) -> Read<()> {
        self.expect("{")?;
        self.deeper()?;
        let depth = self.depth;
        while !(self.kind() == Kind::Sign && self.next() == "}") {
            if self.kind() == Kind::End {
                return Err(self.unexpected("`}`"));
            }
            let first = self.at;
            match self.constructs(place) {
                Ok(mut found) if self.at > first => element.children.append(&mut found),
                Ok(_) => return Err(self.unexpected("`}`")),
                Err(fault) => {
                    self.fault(fault);
                    self.depth = depth;
                    self.skip(first);
                }
            }
        }
        self.depth -= 1;
        element.trailing.append(&mut self.rest());
        self.take();
        Ok(())
    }

    /// Reads what is written as one construct: several elements for a list of actions and for XML.
    pub(super) fn constructs(&mut self, place: Place) -> Read<Vec<Element>> {
        if self.kind() == Kind::Xml {
            return self.xml();
        }
        if place == Place::Transition && matches!(self.next(), "actions" | "send")
            || place == Place::Reaction
        {
            return self.actions();
        }
        let before = self.remarks_here();
        if place == Place::Alternative {
            self.expect("vtag")?;
            self.expect(":")?;
        }
        let start = self.begin(before);
        let element = match place {
            Place::File => self.root(),
            Place::Service => self.section_of_service(),
            Place::References => self.service_reference(),
            Place::ConstSet => self.constant(),
            Place::TypeSet => self.declaration(start.optional),
            Place::Messages => self.direction(),
            Place::Events => self.internal_event(),
            Place::Message => self.part_of_message(),
            Place::Member | Place::Alternative => self.member(start.optional),
            Place::ValueSet => self.value_or_range(),
            Place::BitField => self.sub_field(),
            Place::VariableField => self.choice(),
            Place::VariableFormatField => self.count_or_format(),
            Place::Protocol => self.machine(),
            Place::Machine => self.state(),
            Place::State => self.part_of_state(),
            Place::Transition => self.guard_or_target(&start),
            Place::Reaction | Place::Actions => self.action("action"),
            Place::SendActions => self.action("send_action"),
        }?;
        Ok(vec![self.finish(start, element)?])
    }

    fn deeper(&mut self) -> Read<()> {
        self.depth += 1;
        if self.depth > DEEPEST {
            // Going on would meet it again in each of the outer constructs.
            self.at = self.tokens.len() - 1;
            let message = format!("constructs are nested more than {DEEPEST} deep: flatten them");
            return Err(Fault::new(self.end(), message));
        }
        Ok(())
    }

    /// Goes to the end of the construct whose first token this is.
    fn skip(&mut self, first: usize) {
        let mut depth = 0_usize;
        let reached = self.at;
        self.at = first;
        while self.kind() != Kind::End {
            match (self.kind(), self.next()) {
                (Kind::Sign, "{") => depth += 1,
                (Kind::Sign, "}") if depth == 0 => break,
                (Kind::Sign, "}") => depth -= 1,
                _ => {}
            }
            let ends = depth == 0 && self.kind() == Kind::Sign && matches!(self.next(), ";" | "}");
            self.at += 1;
            if ends {
                break;
            }
        }
        self.at = self.at.max(reached);
        self.remarks_here();
        self.accept(";");
    }

    /// Comments that no construct follows.
    pub(super) fn rest(&mut self) -> Vec<String> {
        self.collect_remarks();
        std::mem::take(&mut self.stray)
    }

    /// Takes elements that are written as XML.
    fn xml(&mut self) -> Read<Vec<Element>> {
        let mut comments = self.rest();
        let (written, at) = self.take();
        let inner = &written[3..written.len() - 2];
        let before = format!("<references xmlns=\"urn:jaus:jsidl:1.1\" xmlns:own=\"{EXTENSION}\">");
        let document = format!("{before}{inner}</references>");
        let position =
            |found: usize| (at + 3 + found.saturating_sub(before.len())).min(at + written.len());
        if let Some((found, message)) = crate::syntax::excess(&document) {
            return Err(Fault::new(position(found), message));
        }
        let root = Element::from_xml(&document)
            .map_err(|(found, message)| Fault::new(position(found), message))?;
        let mut elements = root.children;
        elements.iter_mut().for_each(|it| moved(it, &position));
        match elements.first_mut() {
            Some(first) => first
                .comments
                .splice(0..0, comments.drain(..))
                .for_each(drop),
            None => self.stray.append(&mut comments),
        }
        Ok(elements)
    }
}

fn moved(element: &mut Element, position: &impl Fn(usize) -> usize) {
    element.at = position(element.at);
    for attribute in &mut element.attributes {
        attribute.at = position(attribute.at);
    }
    if let Some(text) = &mut element.text {
        text.at = position(text.at);
    }
    element
        .children
        .iter_mut()
        .for_each(|it| moved(it, position));
}

/// Changes an element as an amendment says: `name="value"` pairs for the element, or after the name
/// of an element in it; an empty value removes the attribute, `no name` the element.
fn amend(element: &mut Element, amendment: &str, at: usize) -> Read<()> {
    let fault = |message: String| Err(Fault::new(at, message));
    let amendment = amendment.trim();
    let (first, rest) = amendment
        .split_once(char::is_whitespace)
        .unwrap_or((amendment, ""));
    if first == "no" {
        let before = element.children.len();
        element.children.retain(|it| it.name != rest.trim());
        return match before == element.children.len() {
            true => fault(format!("there is no `{}` to leave out", rest.trim())),
            false => Ok(()),
        };
    }
    let (inner, pairs) = match first.contains('=') || first.is_empty() {
        true => (None, amendment),
        false => (Some(first), rest),
    };
    let document = format!("<x xmlns:own=\"{EXTENSION}\" {pairs}/>");
    if crate::syntax::excess(&document).is_some() {
        return fault("this changes too many attributes".to_owned());
    }
    let Ok(document) = Document::parse(&document) else {
        return fault(
            "expected the name of an element, if any, and `name=\"value\"` pairs".to_owned(),
        );
    };
    let target = match inner {
        None => element,
        Some("presence_vector") if element.child("presence_vector").is_none() => {
            element
                .children
                .insert(0, Element::new("presence_vector", at));
            &mut element.children[0]
        }
        Some(name) => match element.first_mut(name) {
            Some(found) => found,
            None => return fault(format!("the construct has no `{name}`")),
        },
    };
    for pair in document.root_element().attributes() {
        let Some(name) = name_of(&pair) else {
            continue;
        };
        if pair.value().is_empty() {
            target.attributes.retain(|it| it.name != name);
        } else {
            target.set(&name, pair.value(), at);
        }
    }
    if let Some(uri) = document.root_element().tag_name().namespace() {
        target.set("xmlns", uri, at);
    }
    Ok(())
}

/// An unresolved reference.
pub(super) fn reference(path: String, at: usize, name: &str, name_at: usize) -> Element {
    let name = name.strip_suffix(words::SAME_NAME).unwrap_or(name);
    Element::new(REFERENCE, at)
        .with("name", name, name_at)
        .with("optional", "false", at)
        .with("declared_type_ref", path, at)
}
