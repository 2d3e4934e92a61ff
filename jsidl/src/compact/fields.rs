//! Reads composites and fields of the compact form.

use super::cursor::{Cursor, Place, Read, reference};
use super::lexer::Kind;
use super::tree::{Element, Text};
use super::words;

impl Cursor<'_> {
    /// A composite, a field or a reference.
    pub(super) fn member(&mut self, optional: bool) -> Read<Element> {
        let element = match (self.next(), self.ahead(1)) {
            ("record" | "list" | "sequence" | "variant", next) if next != "." => {
                self.composite(optional)
            }
            _ => self.field(optional),
        }?;
        self.accept(";");
        Ok(element)
    }

    fn composite(&mut self, optional: bool) -> Read<Element> {
        let (word, at) = self.take();
        let element = match word {
            "record" => "record",
            "list" => "list",
            "sequence" => "sequence",
            _ => "variant",
        };
        let mut element = self.named(element, at, optional)?;
        match word {
            "list" => {
                let count = self.count("count_field", "{")?;
                element.children.push(count);
                self.fill(&mut element, Place::Member)?;
            }
            "variant" => {
                let tag = self.count("vtag_field", "{")?;
                element.children.push(tag);
                self.fill(&mut element, Place::Alternative)?;
            }
            _ => {
                self.fill(&mut element, Place::Member)?;
                let optional = element
                    .children
                    .iter()
                    .filter(|it| it.value("optional") == "true")
                    .count();
                if optional > 0 {
                    let vector = Element::new("presence_vector", at);
                    let vector = vector.with("field_type_unsigned", words::presence(optional), at);
                    element.children.insert(0, vector);
                }
            }
        }
        Ok(element)
    }

    /// A name, and whether the construct is optional.
    fn named(&mut self, element: &'static str, at: usize, optional: bool) -> Read<Element> {
        let (name, name_at) = self.name()?;
        let optional = if optional { "true" } else { "false" };
        Ok(Element::new(element, at)
            .with("name", name, name_at)
            .with("optional", optional, at))
    }

    /// `[least, most]` with an interpretation before it. Limits may be missing where `without`
    /// follows.
    fn count(&mut self, name: &'static str, without: &str) -> Read<Element> {
        let interpretation = self.interpretation();
        let mut count = Element::new(name, self.here());
        if self.next() != without || without == "{" {
            self.expect("[")?;
            let (least, at) = self.expression(&[",", "]"])?;
            count.set("min_count", least, at);
            if self.accept(",") {
                let (most, at) = self.expression(&["]"])?;
                count.set("max_count", most, at);
            }
            self.expect("]")?;
        }
        if let Some(Text { value, at }) = interpretation {
            count.set("interpretation", value, at);
        }
        Ok(count)
    }

    fn field(&mut self, optional: bool) -> Read<Element> {
        let next = self.ahead(1);
        let element = match self.next() {
            _ if next == "." => self.reference_or_array(optional),
            "field" => self.fixed_field(optional),
            "bit_field" => self.bit_field(optional),
            "variable_field" => self.variable_field(optional),
            "string" => self.fixed_string(optional),
            "vstring" => self.variable_string(optional),
            "vfield" => self.variable_length_field(optional),
            "variable_format_field" => self.variable_format_field(optional),
            _ if self.kind() == Kind::Word => self.reference_or_array(optional),
            _ => Err(self.unexpected("a field, a composite or the name of one")),
        }?;
        if self.next() != ";" && !self.text[..self.end()].ends_with('}') {
            return Err(self.unexpected("`;`"));
        }
        Ok(element)
    }

    /// `path name;` or `path name [size];`
    fn reference_or_array(&mut self, optional: bool) -> Read<Element> {
        let (path, at) = self.path()?;
        let (name, name_at) = self.name()?;
        let optional = if optional { "true" } else { "false" };
        if !self.accept("[") {
            return Ok(reference(path, at, name, name_at).with("optional", optional, at));
        }
        let (size, size_at) = self.number()?;
        self.expect("]")?;
        let dimension = Element::new("dimension", size_at);
        let dimension = dimension.with("name", format!("{name}_Dim"), name_at);
        let element = reference(path, at, &format!("{name}_ArrayElement"), name_at);
        Ok(Element::new("array", at)
            .with("name", name, name_at)
            .with("optional", optional, at)
            .holding(element)
            .holding(dimension.with("size", size, size_at)))
    }

    fn fixed_field(&mut self, optional: bool) -> Read<Element> {
        let (_, at) = self.take();
        let (number, number_at) = self.number_type()?;
        let mut field = self.named("fixed_field", at, optional)?;
        field.set("field_type", number, number_at);
        let (unit, unit_at) = self.unit()?;
        field.set("field_units", unit, unit_at);
        field.children = self.meaning()?;
        Ok(field)
    }

    /// A scale, values or nothing.
    fn meaning(&mut self) -> Read<Vec<Element>> {
        let start = self.begin(Vec::new());
        let meaning = match self.next() {
            "<" => self.scale(),
            "{" => self.value_set(),
            "[" | "(" => {
                let range = self.range()?;
                let range = self.finish(start, range)?;
                let at = range.at;
                let set = Element::new("value_set", at).with("offset_to_lower_limit", "false", at);
                return Ok(vec![set.holding(range)]);
            }
            _ => return self.abandon(start).map(|()| Vec::new()),
        }?;
        Ok(vec![self.finish(start, meaning)?])
    }

    fn scale(&mut self) -> Read<Element> {
        let (_, at) = self.take();
        let (lower, lower_at) = self.expression(&[","])?;
        self.expect(",")?;
        let (upper, upper_at) = self.expression(&[">"])?;
        self.expect(">")?;
        let (function, function_at) = self.name()?;
        Ok(Element::new("scale_range", at)
            .with("real_lower_limit", lower, lower_at)
            .with("real_upper_limit", upper, upper_at)
            .with("integer_function", function, function_at))
    }

    /// `{ … ; }`, and `offset` behind it.
    fn value_set(&mut self) -> Read<Element> {
        let at = self.here();
        let mut set = Element::new("value_set", at);
        self.fill(&mut set, Place::ValueSet)?;
        let offset = if self.accept("offset") {
            "true"
        } else {
            "false"
        };
        set.set("offset_to_lower_limit", offset, at);
        Ok(set)
    }

    pub(super) fn value_or_range(&mut self) -> Read<Element> {
        let element = match self.kind() {
            Kind::Text => self.value(),
            _ => self.range(),
        }?;
        self.expect(";")?;
        Ok(element)
    }

    /// `"name" = index`
    fn value(&mut self) -> Read<Element> {
        let at = self.here();
        let name = self.text()?;
        self.expect("=")?;
        let index_at = self.here();
        let sign = if self.accept("-") { "-" } else { "" };
        let (index, _) = self.number()?;
        Ok(Element::new("value_enum", at)
            .with("enum_index", format!("{sign}{index}"), index_at)
            .with("enum_const", name.value, name.at))
    }

    /// `[lower, upper]`; parentheses exclude a limit.
    fn range(&mut self) -> Read<Element> {
        let at = self.here();
        let limit = |excluded: bool| if excluded { "exclusive" } else { "inclusive" };
        let below = match self.next() {
            "(" => true,
            "[" => false,
            _ => return Err(self.unexpected("`[`, `(` or the name of a value in quotes")),
        };
        self.take();
        let (lower, lower_at) = self.expression(&[","])?;
        self.expect(",")?;
        let (upper, upper_at) = self.expression(&["]", ")"])?;
        let (end, _) = self.take();
        Ok(Element::new("value_range", at)
            .with("lower_limit", lower, lower_at)
            .with("lower_limit_type", limit(below), at)
            .with("upper_limit", upper, upper_at)
            .with("upper_limit_type", limit(end == ")"), upper_at))
    }

    fn bit_field(&mut self, optional: bool) -> Read<Element> {
        let (_, at) = self.take();
        let (number, number_at) = self.number_type()?;
        let mut field = self.named("bit_field", at, optional)?;
        field.set("field_type_unsigned", number, number_at);
        self.fill(&mut field, Place::BitField)?;
        Ok(field)
    }

    /// `name [from:to] { … }`
    pub(super) fn sub_field(&mut self) -> Read<Element> {
        let (name, at) = self.name()?;
        self.expect("[")?;
        let (from, from_at) = self.number()?;
        self.expect(":")?;
        let (to, to_at) = self.number()?;
        self.expect("]")?;
        let range = Element::new("bit_range", from_at);
        let range = range
            .with("from_index", from, from_at)
            .with("to_index", to, to_at);
        let mut field = Element::new("sub_field", at)
            .with("name", name, at)
            .holding(range);
        let mut values = self.meaning()?;
        field.children.append(&mut values);
        self.expect(";")?;
        Ok(field)
    }

    fn variable_field(&mut self, optional: bool) -> Read<Element> {
        let (_, at) = self.take();
        let field = self.named("variable_field", at, optional)?;
        let mut choices = Element::new("type_and_units_field", at);
        self.fill(&mut choices, Place::VariableField)?;
        Ok(field.holding(choices))
    }

    /// `tag index: name type unit …;`
    pub(super) fn choice(&mut self) -> Read<Element> {
        let (index, index_at) = self.tag()?;
        let (name, name_at) = self.name()?;
        let (number, number_at) = self.number_type()?;
        let (unit, unit_at) = self.unit()?;
        let mut choice = Element::new("type_and_units_enum", index_at)
            .with("name", name, name_at)
            .with("index", index, index_at)
            .with("field_type", number, number_at)
            .with("field_units", unit, unit_at);
        choice.children = self.meaning()?;
        self.expect(";")?;
        Ok(choice)
    }

    /// `tag index :`
    fn tag(&mut self) -> Read<(String, usize)> {
        self.expect("tag")?;
        let index = self.expression(&[":"])?;
        self.expect(":")?;
        Ok(index)
    }

    fn fixed_string(&mut self, optional: bool) -> Read<Element> {
        let (_, at) = self.take();
        let mut field = self.named("fixed_length_string", at, optional)?;
        self.expect("[")?;
        let (length, length_at) = self.expression(&["]"])?;
        self.expect("]")?;
        field.set("string_length", length, length_at);
        Ok(field)
    }

    fn variable_string(&mut self, optional: bool) -> Read<Element> {
        let (_, at) = self.take();
        let field = self.named("variable_length_string", at, optional)?;
        Ok(field.holding(self.count("count_field", ";")?))
    }

    fn variable_length_field(&mut self, optional: bool) -> Read<Element> {
        let (_, at) = self.take();
        let (format, format_at) = self.format()?;
        let mut field = self.named("variable_length_field", at, optional)?;
        field.set("field_format", format, format_at);
        Ok(field.holding(self.count("count_field", ";")?))
    }

    /// A word, which may have a hyphen and a number, or a text.
    fn format(&mut self) -> Read<(String, usize)> {
        if self.kind() == Kind::Text {
            let text = self.text()?;
            return Ok((text.value, text.at));
        }
        let (word, at) = self.name()?;
        let mut format = word.to_owned();
        if self.accept("-") {
            let (number, _) = self.number()?;
            format = format!("{format}-{number}");
        }
        Ok((words::format(&format).to_owned(), at))
    }

    fn variable_format_field(&mut self, optional: bool) -> Read<Element> {
        let (_, at) = self.take();
        let mut field = self.named("variable_format_field", at, optional)?;
        let mut formats = Element::new("format_field", at);
        self.fill(&mut formats, Place::VariableFormatField)?;
        let is_format = |it: &Element| it.name == "format_enum";
        let (formats_only, count): (Vec<_>, Vec<_>) =
            formats.children.drain(..).partition(is_format);
        formats.children = formats_only;
        field.children = count;
        Ok(field.holding(formats))
    }

    /// The count, or `tag index: format;`.
    pub(super) fn count_or_format(&mut self) -> Read<Element> {
        if self.next() != "tag" {
            return self.typed_count();
        }
        let (index, index_at) = self.tag()?;
        let (format, format_at) = self.format()?;
        self.expect(";")?;
        let element = Element::new("format_enum", index_at);
        Ok(element
            .with("index", index, index_at)
            .with("field_format", format, format_at))
    }

    /// `uint8 tag [0, 10];`
    fn typed_count(&mut self) -> Read<Element> {
        let (number, at) = self.number_type()?;
        self.expect("tag")?;
        let limits = self.meaning()?;
        self.expect(";")?;
        let mut count = Element::new("count_field", at).with("field_type_unsigned", number, at);
        let range = limits.first().and_then(|it| it.child("value_range"));
        for (count_limit, limit) in [("min_count", "lower_limit"), ("max_count", "upper_limit")] {
            if let Some(value) = range.and_then(|it| it.attribute(limit)) {
                count.set(count_limit, &*value.value, value.at);
            }
        }
        Ok(count)
    }
}
