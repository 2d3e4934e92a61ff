//! Holds a document against the standard, as a schema validator does: order and number of elements,
//! mandatory attributes and their values, in the edition of its namespace.

use roxmltree::{Attribute as Given, Node as Xml};

use super::{Attribute, Edition, Element, Occurs, Part, Value};
use crate::diagnostic::Report;
use crate::source::{Source, Span};
use crate::spelling::shortened;

/// Namespace of the attribute `xml:space`.
const XML: &str = "http://www.w3.org/XML/1998/namespace";

/// Namespace of attributes that tell a validator where the schema is.
const SCHEMA_INSTANCE: &str = "http://www.w3.org/2001/XMLSchema-instance";

/// JSIDL+: the wrapper of several services, and the data of a diagram editor.
const PLUS: &str = "urn:jaus:jsidl:plus";

/// Reports everything that the standard does not permit. Elements that do not exist at all are left
/// to the reader.
pub(crate) fn check(root: Xml<'_, '_>, source: &Source, report: &mut Report) {
    let namespaces = root.descendants().filter(Xml::is_element);
    let mut editions = namespaces.filter_map(edition);
    let edition = editions.next().unwrap_or(Edition::V1_1);
    let mut check = Check {
        source,
        report,
        edition,
    };
    check.element(root);
}

fn edition(xml: Xml<'_, '_>) -> Option<Edition> {
    Edition::of_namespace(xml.tag_name().namespace()?)
}

/// Whether an element belongs to a definition, and not to a drawing of it.
fn is_of_language(xml: Xml<'_, '_>) -> bool {
    if xml.tag_name().name() == START_ARROW {
        return false;
    }
    let wrapper = xml.tag_name().name() == "service_set";
    edition(xml).is_some() || wrapper && xml.tag_name().namespace() == Some(PLUS)
}

/// The position of the start arrow in a diagram editor, which the schema of the editor permits.
const START_ARROW: &str = "pseudo_start_state";

struct Check<'r> {
    source: &'r Source,
    report: &'r mut Report,
    /// The edition of the first element.
    edition: Edition,
}

impl Check<'_> {
    fn element(&mut self, xml: Xml<'_, '_>) {
        let Some(element) = super::element(xml.tag_name().name()) else {
            return;
        };
        if let Some(other) = edition(xml).filter(|it| *it != self.edition) {
            let message = format!(
                "`{}` is in the namespace `{}`, but the definition in `{}`: use one of them",
                element.name,
                other.namespace(),
                self.edition.namespace()
            );
            self.report.error(self.span(xml), message);
        }
        for given in xml.attributes() {
            self.attribute(element, given);
        }
        self.mandatory_attributes(xml, element);
        let children = xml
            .children()
            .filter(|it| it.is_element() && is_of_language(*it));
        let children: Vec<_> = children.collect();
        self.content(xml, element, &children);
        for child in children {
            self.element(child);
        }
    }

    fn span(&self, xml: Xml<'_, '_>) -> Span {
        self.source.span(xml.range().start)
    }

    fn attribute(&mut self, element: &Element, given: Given<'_, '_>) {
        let at = self.source.span(given.range().start);
        let (name, parent) = (given.name(), element.name);
        if let Some(namespace) = given.namespace() {
            let is_space = namespace == XML && element.text;
            if !is_space && namespace != SCHEMA_INSTANCE {
                let message = format!(
                    "the standard has no attribute `{name}` of the namespace `{namespace}`: other \
                     tools refuse it"
                );
                self.report.error(at, message);
            }
            return;
        }
        let Some(known) = element.attribute(name) else {
            return;
        };
        if known.occurs(self.edition) == Occurs::Never {
            let message =
                format!("the standard has no attribute `{name}` in `{parent}`: remove it");
            self.report.error(at, message);
        } else if !self.admits(known, given.value()) {
            let message = format!(
                "the standard does not permit `{}` as `{name}`: use {}",
                shortened(given.value()),
                known.value.advice()
            );
            let value = self.source.span(given.range_value().start);
            self.report.error(value, message);
        }
    }

    fn admits(&self, attribute: &Attribute, text: &str) -> bool {
        // Patterns apply to the text as written, in other types runs of white space are one blank.
        let as_written = matches!(
            attribute.value,
            Value::Identifier | Value::Path | Value::Version | Value::VersionPattern
        );
        if as_written {
            return attribute.value.admits(text, self.edition);
        }
        let words: Vec<_> = text.split_whitespace().collect();
        attribute.value.admits(&words.join(" "), self.edition)
    }

    fn mandatory_attributes(&mut self, xml: Xml<'_, '_>, element: &Element) {
        for attribute in element.attributes {
            let name = attribute.name;
            if attribute.occurs(self.edition) == Occurs::Once && !xml.has_attribute(name) {
                let message = format!("`{}` lacks the attribute `{name}`: add it", element.name);
                self.report.error(self.span(xml), message);
            }
        }
        // A set has both or none.
        let halves = ["id", "version"];
        let is_optional = |name: &&str| {
            let attribute = element.attribute(name);
            attribute.is_some_and(|it| it.occurs(self.edition) == Occurs::Optional)
        };
        if halves.iter().all(is_optional) {
            let [id, version] = halves.map(|name| xml.has_attribute(name));
            let missing = if id { "version" } else { "id" };
            if id != version {
                let message = format!("`{}` lacks the attribute `{missing}`: add it", element.name);
                self.report.error(self.span(xml), message);
            }
        }
    }

    /// The number and order of the children.
    fn content(&mut self, xml: Xml<'_, '_>, element: &Element, children: &[Xml<'_, '_>]) {
        let mut counts = vec![0_usize; element.parts.len()];
        let mut last: Option<(usize, &str)> = None;
        for child in children {
            let name = child.tag_name().name();
            let Some((position, part)) = element.part(name) else {
                continue;
            };
            let occurs = part.occurs(self.edition);
            if occurs == Occurs::Never || !part.holds(name, self.edition) {
                let message = format!(
                    "the standard has no `{name}` in `{}` of this edition: remove it",
                    element.name
                );
                self.report.error(self.span(*child), message);
                continue;
            }
            counts[position] += 1;
            if counts[position] > 1 && !occurs.is_repeated() {
                let message = format!("`{}` has more than one `{name}`: keep one", element.name);
                self.report.error(self.span(*child), message);
            }
            match last {
                Some((other, before)) if other > position => {
                    let message = format!(
                        "`{name}` comes before `{before}` in `{}`: move it up",
                        element.name
                    );
                    self.report.error(self.span(*child), message);
                }
                _ => last = Some((position, name)),
            }
        }
        for (part, count) in element.parts.iter().zip(counts) {
            if part.occurs(self.edition).is_mandatory() && count == 0 {
                self.missing(xml, element, part);
            }
        }
    }

    fn missing(&mut self, xml: Xml<'_, '_>, element: &Element, part: &Part) {
        let child = part.elements(self.edition).next().unwrap_or_default();
        let message = match part.missing {
            Some(finding) => format!("`{}` {finding}", element.name),
            None => format!("`{}` lacks the element `{child}`: add it", element.name),
        };
        self.report.error(self.span(xml), message);
    }
}
