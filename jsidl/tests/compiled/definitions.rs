//! Random legal definitions, with the names and sizes that are hardest for the generator.

use crate::chance::Chance;
use crate::words::{INTEGERS, NAMES, TEXTS, UNITS, UNSIGNED};

const HEADER: &str = r#"<header name="Header"><record name="HeaderRec" optional="false"><fixed_field name="MessageID" optional="false" field_type="unsigned short integer" field_units="one"/></record></header>"#;

/// The files of a service in one or two versions.
pub(crate) fn random(seed: u64) -> Vec<String> {
    let mut author = Author {
        chance: Chance::new(seed),
        text: String::new(),
    };
    let name = author.name(&mut Scope::default());
    let versions = 0..=author.chance.below(2);
    let service = |version| {
        author.service(&name, version);
        std::mem::take(&mut author.text)
    };
    versions.map(service).collect()
}

struct Author {
    chance: Chance,
    text: String,
}

/// The names of one scope.
#[derive(Default)]
struct Scope(Vec<String>);

impl Author {
    fn name(&mut self, scope: &mut Scope) -> String {
        let mut name = self.chance.of(NAMES).to_owned();
        while scope.0.contains(&name) {
            name.push_str(self.chance.of(&["2", "_", "X"]));
        }
        scope.0.push(name.clone());
        name
    }

    fn push(&mut self, text: impl AsRef<str>) {
        self.text.push_str(text.as_ref());
        self.text.push('\n');
    }

    fn interpretation(&mut self) -> String {
        format!(
            r#"interpretation="{}""#,
            self.chance.of(TEXTS).replace('"', "&quot;")
        )
    }

    fn service(&mut self, name: &str, minor: u64) {
        self.push(format!(
            r#"<service_def name="{name}" id="urn:example:{name}" version="1.{minor}" xmlns="urn:jaus:jsidl:1.1">"#
        ));
        let text = self.chance.of(TEXTS);
        self.push(format!(
            "<description>{text}</description><assumptions/><message_set>"
        ));
        let mut messages = Scope::default();
        let mut code = 0xD000;
        let mut inputs = Vec::new();
        for set in ["input_set", "output_set"] {
            self.push(format!("<{set}>"));
            for _ in 0..1 + self.chance.below(3) {
                let stem = self.name(&mut messages);
                let prefix = self.chance.of(&["", "Set", "Query", "Report"]);
                let name = format!("{prefix}{stem}");
                if inputs.contains(&name) {
                    continue;
                }
                code += 1;
                self.message(&name, code);
                inputs.push(name);
            }
            if set == "input_set" {
                self.query(0x2F01);
            } else {
                self.report(0x4F01);
            }
            self.push(format!("</{set}>"));
        }
        self.push("</message_set>");
        self.behaviour(&inputs);
        self.push("</service_def>");
    }

    fn query(&mut self, code: u16) {
        self.begin("QueryThing", code);
        self.push(r#"<body name="Body"><record name="QueryRec" optional="false"><fixed_field name="PresenceVector" optional="false" field_type="unsigned integer" field_units="one"/>"#);
        let mut scope = Scope(vec!["PresenceVector".to_owned()]);
        for _ in 0..self.chance.below(3) {
            self.field(&mut scope, false, 0);
        }
        self.push("</record></body><footer name=\"Footer\"/></message_def>");
    }

    fn report(&mut self, code: u16) {
        self.begin("ReportThing", code);
        self.push(r#"<body name="Body">"#);
        self.record(&mut Scope::default(), false, true);
        self.push("</body><footer name=\"Footer\"/></message_def>");
    }

    fn begin(&mut self, name: &str, code: u16) {
        let (command, deprecated) = (self.chance.one_in(2), self.chance.one_in(3));
        let description = self.chance.of(TEXTS);
        self.push(format!(
            r#"<message_def name="{name}" message_id="{code:04X}" is_command="{command}" deprecated="{deprecated}"><description>{description}</description>{HEADER}"#
        ));
    }

    fn message(&mut self, name: &str, code: u16) {
        self.begin(name, code);
        if self.chance.one_in(6) {
            self.push(r#"<body name="Body"/>"#);
        } else {
            self.push(r#"<body name="Body">"#);
            self.composite(&mut Scope::default(), 3, false);
            self.push("</body>");
        }
        if self.chance.one_in(6) {
            self.push(r#"<footer name="Footer">"#);
            self.record(&mut Scope::default(), false, false);
            self.push("</footer></message_def>");
        } else {
            self.push(r#"<footer name="Footer"/></message_def>"#);
        }
    }

    fn composite(&mut self, scope: &mut Scope, depth: u64, optional: bool) {
        match self.chance.below(if depth == 0 { 2 } else { 5 }) {
            0 | 1 => self.record(scope, optional, false),
            2 => self.list(scope, depth, optional),
            3 => self.variant(scope, depth, optional),
            _ => self.sequence(scope, depth, optional),
        }
    }

    fn record(&mut self, scope: &mut Scope, optional: bool, presence: bool) {
        let (name, text) = (self.name(scope), self.interpretation());
        self.push(format!(
            r#"<record name="{name}" optional="{optional}" {text}>"#
        ));
        let count = 1 + self.chance.below(6);
        let presence = presence || self.chance.one_in(3);
        if presence {
            self.push(r#"<presence_vector field_type_unsigned="unsigned byte"/>"#);
        }
        let mut inner = Scope::default();
        for number in 0..count {
            let optional = presence && (number == 0 || self.chance.one_in(2));
            self.field(&mut inner, optional, 0);
        }
        self.push("</record>");
    }

    fn sequence(&mut self, scope: &mut Scope, depth: u64, optional: bool) {
        let (name, text) = (self.name(scope), self.interpretation());
        self.push(format!(
            r#"<sequence name="{name}" optional="{optional}" {text}>"#
        ));
        let presence = self.chance.one_in(3);
        if presence {
            self.push(r#"<presence_vector field_type_unsigned="unsigned short integer"/>"#);
        }
        let mut inner = Scope::default();
        for number in 0..1 + self.chance.below(4) {
            let optional = presence && (number == 0 || self.chance.one_in(2));
            self.composite(&mut inner, depth - 1, optional);
        }
        self.push("</sequence>");
    }

    fn list(&mut self, scope: &mut Scope, depth: u64, optional: bool) {
        let (name, text) = (self.name(scope), self.interpretation());
        self.push(format!(
            r#"<list name="{name}" optional="{optional}" {text}>"#
        ));
        self.count();
        self.composite(&mut Scope::default(), depth - 1, false);
        self.push("</list>");
    }

    /// A count of an array's elements must not make them too large.
    fn count_in(&mut self, depth: u64) {
        match depth {
            0 => self.count(),
            _ => self.push(r#"<count_field field_type_unsigned="unsigned short integer"/>"#),
        }
    }

    fn count(&mut self) {
        let unsigned = self.chance.of(UNSIGNED);
        let (min, max) = match (self.chance.below(4), unsigned) {
            (0, "unsigned long integer") => (u64::MAX, u64::MAX),
            (0, _) => (3, 200),
            (1, "unsigned long integer") => (1 << 40, 1 << 41),
            _ => (0, 255),
        };
        self.push(format!(
            r#"<count_field min_count="{min}" max_count="{max}" field_type_unsigned="{unsigned}"/>"#
        ));
    }

    fn variant(&mut self, scope: &mut Scope, depth: u64, optional: bool) {
        let (name, text) = (self.name(scope), self.interpretation());
        self.push(format!(
            r#"<variant name="{name}" optional="{optional}" {text}>"#
        ));
        self.push(
            r#"<vtag_field min_count="0" max_count="9" field_type_unsigned="unsigned byte"/>"#,
        );
        let mut inner = Scope::default();
        for _ in 0..self.chance.below(4) {
            self.composite(&mut inner, depth - 1, false);
        }
        self.push("</variant>");
    }

    fn field(&mut self, scope: &mut Scope, optional: bool, depth: u64) {
        let name = self.name(scope);
        let attributes = format!(
            r#"name="{name}" optional="{optional}" {}"#,
            self.interpretation()
        );
        match self.chance.below(if depth == 0 { 9 } else { 7 }) {
            0 | 1 => {
                self.push(format!("<fixed_field {attributes}"));
                self.scalar();
                self.push("</fixed_field>");
            }
            2 => self.bits(&attributes),
            3 => {
                let length = 1 + self.chance.below(2000);
                self.push(format!(
                    r#"<fixed_length_string {attributes} string_length="{length}"/>"#
                ));
            }
            4 => {
                self.push(format!("<variable_length_string {attributes}>"));
                self.count_in(depth);
                self.push("</variable_length_string>");
            }
            5 => {
                let format = self
                    .chance
                    .of(&["JAUS MESSAGE", "JAUS Message", "User Defined"]);
                self.push(format!(
                    r#"<variable_length_field {attributes} field_format="{format}">"#
                ));
                self.count_in(depth);
                self.push("</variable_length_field>");
            }
            6 => self.choices(&attributes, depth),
            _ => self.array(&attributes),
        }
    }

    /// The rest of the tag of a number, and its content.
    fn scalar(&mut self) {
        let units = self.chance.of(UNITS);
        match self.chance.below(4) {
            0 => {
                let number = self.chance.of(&["float", "long float"]);
                self.push(format!(r#"field_type="{number}" field_units="{units}">"#));
                if self.chance.one_in(3) {
                    self.values(100);
                }
            }
            1 => {
                let number = self.chance.of(&UNSIGNED[..3]);
                let (lower, upper) = *[("-1e300", "1e300"), ("0", "1"), ("-0.001", "7e-3")]
                    .get(self.chance.below(3) as usize)
                    .unwrap();
                let function = self.chance.of(&["round", "floor", "ceiling"]);
                self.push(format!(
                    r#"field_type="{number}" field_units="{units}"><scale_range real_lower_limit="{lower}" real_upper_limit="{upper}" integer_function="{function}"/>"#
                ));
            }
            2 => {
                let number = self.chance.of(INTEGERS);
                self.push(format!(r#"field_type="{number}" field_units="{units}">"#));
                self.values(100);
            }
            _ => {
                let number = self.chance.of(INTEGERS);
                self.push(format!(r#"field_type="{number}" field_units="{units}">"#));
            }
        }
    }

    fn values(&mut self, limit: u64) {
        self.push(r#"<value_set offset_to_lower_limit="false">"#);
        let count = self.chance.below(5);
        let mut next = 0;
        for _ in 0..count {
            next += 1 + self.chance.below(3);
            if next >= limit {
                break;
            }
            let name = match self.chance.one_in(3) {
                true => self.chance.of(TEXTS).replace('"', "&quot;"),
                false => self.chance.of(NAMES).to_owned(),
            };
            let text = self.interpretation();
            self.push(format!(
                r#"<value_enum enum_index="{next}" enum_const="x{name}" {text}/>"#
            ));
        }
        let text = self.interpretation();
        let kind = self.chance.of(&["inclusive", "exclusive"]);
        self.push(format!(
            r#"<value_range lower_limit="0" lower_limit_type="inclusive" upper_limit="1" upper_limit_type="{kind}" {text}/></value_set>"#
        ));
    }

    fn bits(&mut self, attributes: &str) {
        let (size, unsigned) = *[
            (8, UNSIGNED[0]),
            (16, UNSIGNED[1]),
            (32, UNSIGNED[2]),
            (64, UNSIGNED[3]),
        ]
        .get(self.chance.below(4) as usize)
        .unwrap();
        self.push(format!(
            r#"<bit_field {attributes} field_type_unsigned="{unsigned}">"#
        ));
        let mut scope = Scope::default();
        let mut from = 0;
        while from < size {
            let to = (from + self.chance.below(9)).min(size - 1);
            let name = self.name(&mut scope);
            self.push(format!(
                r#"<sub_field name="{name}"><bit_range from_index="{from}" to_index="{to}"/>"#
            ));
            self.values(1 << (to - from + 1).min(7));
            self.push("</sub_field>");
            from = to + 1 + self.chance.below(3);
        }
        self.push("</bit_field>");
    }

    fn choices(&mut self, attributes: &str, depth: u64) {
        if self.chance.one_in(2) {
            self.push(format!(
                "<variable_field {attributes}><type_and_units_field>"
            ));
            for index in 0..1 + self.chance.below(4) {
                let name = self.chance.of(NAMES);
                self.push(format!(
                    r#"<type_and_units_enum name="{name}" index="{index}""#
                ));
                self.scalar();
                self.push("</type_and_units_enum>");
            }
            self.push("</type_and_units_field></variable_field>");
            return;
        }
        self.push(format!(
            "<variable_format_field {attributes}><format_field>"
        ));
        for index in 0..1 + self.chance.below(3) {
            let format = self
                .chance
                .of(&["JPEG", "jpeg", "PNG 1", "1", "JAUS message", "VALUES"]);
            self.push(format!(
                r#"<format_enum index="{index}" field_format="{format}"/>"#
            ));
        }
        self.push("</format_field>");
        self.count_in(depth);
        self.push("</variable_format_field>");
    }

    fn array(&mut self, attributes: &str) {
        self.push(format!("<array {attributes}>"));
        self.field(&mut Scope::default(), false, 1);
        let sizes: &[u64] = match self.chance.below(4) {
            0 => &[3],
            1 => &[2, 40],
            2 => &[40, 2, 3],
            _ => &[300],
        };
        for (number, size) in sizes.iter().enumerate() {
            self.push(format!(r#"<dimension name="D{number}" size="{size}"/>"#));
        }
        self.push("</array>");
    }

    /// A machine that reacts to some of the messages.
    fn behaviour(&mut self, messages: &[String]) {
        if self.chance.one_in(3) {
            return;
        }
        self.push(
            r#"<protocol_behavior is_stateless="false"><start state_machine_name="ReceiveFSM" state_name="S0"/><state_machine name="ReceiveFSM">"#,
        );
        let mut scope = Scope::default();
        let mut states = vec!["S0".to_owned()];
        for _ in 0..self.chance.below(3) {
            let name = self.name(&mut scope);
            // Names of states differ in more than case.
            if !states.iter().any(|it| it.eq_ignore_ascii_case(&name)) {
                states.push(name);
            }
        }
        for state in &states {
            self.push(format!(r#"<state name="{state}">"#));
            if self.chance.one_in(2) {
                let action = self.chance.of(NAMES);
                self.push(format!(r#"<entry><action name="{action}"/></entry>"#));
            }
            for message in messages {
                if self.chance.one_in(3) {
                    self.transition(message, &states);
                }
            }
            self.push("</state>");
        }
        self.push("</state_machine></protocol_behavior>");
    }

    fn transition(&mut self, message: &str, states: &[String]) {
        self.push(format!(
            r#"<transition name="Receive"><parameter type="{message}" value="msg"/>"#
        ));
        if self.chance.one_in(2) {
            let question = self.chance.of(NAMES);
            self.push(format!(r#"<guard condition="{question}(msg, 'x')"/>"#));
        }
        let target = &states[self.chance.below(states.len() as u64) as usize];
        let change = match self.chance.one_in(2) {
            true => format!(r#"<simple><end_state state="{target}"/></simple>"#),
            false => "<internal/>".to_owned(),
        };
        self.push(change);
        for _ in 0..self.chance.below(3) {
            let action = self.chance.of(NAMES);
            let argument = self.chance.of(&["msg", "'text'"]);
            self.push(format!(
                r#"<action name="{action}"><argument value="{argument}"/></action>"#
            ));
        }
        self.push("</transition>");
    }
}
