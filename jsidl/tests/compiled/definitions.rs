//! Random legal definitions, with the names and sizes that are hardest for the generator.

/// Names that collide with each other, with keywords, or with what generated code uses.
const NAMES: &[&str] = &[
    "Speed",
    "SetSpeed",
    "speed",
    "A",
    "WithA",
    "With_A",
    "withA",
    "Self",
    "self",
    "Vec",
    "Option",
    "Some",
    "None",
    "Box",
    "input",
    "output",
    "run",
    "present",
    "place",
    "value",
    "random",
    "object",
    "at",
    "type",
    "fn",
    "r",
    "codec",
    "Codec",
    "raw",
    "names",
    "Get",
    "Put",
    "Read",
    "Write",
    "ReadSome",
    "EncodedLen",
    "Default",
    "Result",
    "Ok",
    "Err",
    "V1_0",
    "v1_1",
    "_",
    "__",
    "_1",
    "X1",
    "N",
    "Index",
    "Array",
    "i0",
    "Message",
    "Debug",
    "Clone",
    "String",
    "Fn",
    "Iterator",
    "TimeStamp",
    "TimeSeconds",
    "TimeNanoSeconds",
    "PresenceVector",
    "QueryPresenceVector",
    "SpeedPresenceVector",
    "All",
    "WithAll",
    "Machine",
    "Service",
    "Server",
    "Step",
    "State",
    "Event",
    "Behaviour",
    "Outcome",
    "E",
    "T",
    "C",
    "B",
    "Stop",
    "u8",
    "f64",
    "str",
    "usize",
    "bool",
    "core",
    "alloc",
    "std",
    "crate",
    "super",
    "Header",
    "Body",
    "Footer",
    "Report",
    "Latitude",
    "Internal",
    "Provider",
    "Call",
    "message",
    "query",
    "call",
    "event",
    "report",
    "item",
    "request",
    "requests",
];

const TEXTS: &[&str] = &[
    "",
    "A plain sentence.",
    "{ ( [",
    "] ) }",
    "*/ /* // ///",
    "`code [link] *bold* _x_ #1 | &lt;b&gt;",
    "\u{202E}turned\u{202C} \u{2066}isolated\u{2069}",
    "\u{FEFF}zero\u{200B}width",
    "quote \" and \\ \\n {0} {}",
    "http://example.org/[x] https://example.org",
    "fünf µm ≤ 3",
    "---",
    "```",
    "&#13;carriage",
];

const UNITS: &[&str] = &[
    "one",
    "meter",
    "second",
    "radian",
    "percent",
    "meter per second",
];
const INTEGERS: &[&str] = &[
    "byte",
    "short integer",
    "integer",
    "long integer",
    "unsigned byte",
    "unsigned short integer",
    "unsigned integer",
    "unsigned long integer",
];
const UNSIGNED: &[&str] = &[
    "unsigned byte",
    "unsigned short integer",
    "unsigned integer",
    "unsigned long integer",
];
const HEADER: &str = r#"<header name="Header"><record name="HeaderRec" optional="false"><fixed_field name="MessageID" optional="false" field_type="unsigned short integer" field_units="one"/></record></header>"#;

/// The files of a service in one or two versions.
pub(crate) fn random(seed: u64) -> Vec<String> {
    let mut author = Author {
        state: seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1,
        text: String::new(),
    };
    let name = author.name(&mut Scope::default());
    let versions = 0..=author.below(2);
    let service = |version| {
        author.service(&name, version);
        std::mem::take(&mut author.text)
    };
    versions.map(service).collect()
}

struct Author {
    state: u64,
    text: String,
}

/// The names of one scope.
#[derive(Default)]
struct Scope(Vec<String>);

impl Author {
    fn next(&mut self) -> u64 {
        self.state ^= self.state << 13;
        self.state ^= self.state >> 7;
        self.state ^= self.state << 17;
        self.state >> 11
    }

    fn below(&mut self, limit: u64) -> u64 {
        self.next() % limit
    }

    fn one_in(&mut self, number: u64) -> bool {
        self.below(number) == 0
    }

    fn of<'t>(&mut self, choices: &[&'t str]) -> &'t str {
        choices[self.below(choices.len() as u64) as usize]
    }

    fn name(&mut self, scope: &mut Scope) -> String {
        let mut name = self.of(NAMES).to_owned();
        while scope.0.contains(&name) {
            name.push_str(self.of(&["2", "_", "X"]));
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
            self.of(TEXTS).replace('"', "&quot;")
        )
    }

    fn service(&mut self, name: &str, minor: u64) {
        self.push(format!(
            r#"<service_def name="{name}" id="urn:example:{name}" version="1.{minor}" xmlns="urn:jaus:jsidl:1.1">"#
        ));
        let text = self.of(TEXTS);
        self.push(format!(
            "<description>{text}</description><assumptions/><message_set>"
        ));
        let mut messages = Scope::default();
        let mut code = 0xD000;
        let mut inputs = Vec::new();
        for set in ["input_set", "output_set"] {
            self.push(format!("<{set}>"));
            for _ in 0..1 + self.below(3) {
                let stem = self.name(&mut messages);
                let prefix = self.of(&["", "Set", "Query", "Report"]);
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
        for _ in 0..self.below(3) {
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
        let (command, deprecated) = (self.one_in(2), self.one_in(3));
        let description = self.of(TEXTS);
        self.push(format!(
            r#"<message_def name="{name}" message_id="{code:04X}" is_command="{command}" deprecated="{deprecated}"><description>{description}</description>{HEADER}"#
        ));
    }

    fn message(&mut self, name: &str, code: u16) {
        self.begin(name, code);
        if self.one_in(6) {
            self.push(r#"<body name="Body"/>"#);
        } else {
            self.push(r#"<body name="Body">"#);
            self.composite(&mut Scope::default(), 3, false);
            self.push("</body>");
        }
        if self.one_in(6) {
            self.push(r#"<footer name="Footer">"#);
            self.record(&mut Scope::default(), false, false);
            self.push("</footer></message_def>");
        } else {
            self.push(r#"<footer name="Footer"/></message_def>"#);
        }
    }

    fn composite(&mut self, scope: &mut Scope, depth: u64, optional: bool) {
        match self.below(if depth == 0 { 2 } else { 5 }) {
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
        let count = 1 + self.below(6);
        let presence = presence || self.one_in(3);
        if presence {
            self.push(r#"<presence_vector field_type_unsigned="unsigned byte"/>"#);
        }
        let mut inner = Scope::default();
        for number in 0..count {
            let optional = presence && (number == 0 || self.one_in(2));
            self.field(&mut inner, optional, 0);
        }
        self.push("</record>");
    }

    fn sequence(&mut self, scope: &mut Scope, depth: u64, optional: bool) {
        let (name, text) = (self.name(scope), self.interpretation());
        self.push(format!(
            r#"<sequence name="{name}" optional="{optional}" {text}>"#
        ));
        let presence = self.one_in(3);
        if presence {
            self.push(r#"<presence_vector field_type_unsigned="unsigned short integer"/>"#);
        }
        let mut inner = Scope::default();
        for number in 0..1 + self.below(4) {
            let optional = presence && (number == 0 || self.one_in(2));
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
        let unsigned = self.of(UNSIGNED);
        let (min, max) = match (self.below(4), unsigned) {
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
        for _ in 0..self.below(4) {
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
        match self.below(if depth == 0 { 9 } else { 7 }) {
            0 | 1 => {
                self.push(format!("<fixed_field {attributes}"));
                self.scalar();
                self.push("</fixed_field>");
            }
            2 => self.bits(&attributes),
            3 => {
                let length = 1 + self.below(2000);
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
                let format = self.of(&["JAUS MESSAGE", "JAUS Message", "User Defined"]);
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
        let units = self.of(UNITS);
        match self.below(4) {
            0 => {
                let number = self.of(&["float", "long float"]);
                self.push(format!(r#"field_type="{number}" field_units="{units}">"#));
                if self.one_in(3) {
                    self.values(100);
                }
            }
            1 => {
                let number = self.of(&UNSIGNED[..3]);
                let (lower, upper) = *[("-1e300", "1e300"), ("0", "1"), ("-0.001", "7e-3")]
                    .get(self.below(3) as usize)
                    .unwrap();
                let function = self.of(&["round", "floor", "ceiling"]);
                self.push(format!(
                    r#"field_type="{number}" field_units="{units}"><scale_range real_lower_limit="{lower}" real_upper_limit="{upper}" integer_function="{function}"/>"#
                ));
            }
            2 => {
                let number = self.of(INTEGERS);
                self.push(format!(r#"field_type="{number}" field_units="{units}">"#));
                self.values(100);
            }
            _ => {
                let number = self.of(INTEGERS);
                self.push(format!(r#"field_type="{number}" field_units="{units}">"#));
            }
        }
    }

    fn values(&mut self, limit: u64) {
        self.push(r#"<value_set offset_to_lower_limit="false">"#);
        let count = self.below(5);
        let mut next = 0;
        for _ in 0..count {
            next += 1 + self.below(3);
            if next >= limit {
                break;
            }
            let name = match self.one_in(3) {
                true => self.of(TEXTS).replace('"', "&quot;"),
                false => self.of(NAMES).to_owned(),
            };
            let text = self.interpretation();
            self.push(format!(
                r#"<value_enum enum_index="{next}" enum_const="x{name}" {text}/>"#
            ));
        }
        let text = self.interpretation();
        let kind = self.of(&["inclusive", "exclusive"]);
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
        .get(self.below(4) as usize)
        .unwrap();
        self.push(format!(
            r#"<bit_field {attributes} field_type_unsigned="{unsigned}">"#
        ));
        let mut scope = Scope::default();
        let mut from = 0;
        while from < size {
            let to = (from + self.below(9)).min(size - 1);
            let name = self.name(&mut scope);
            self.push(format!(
                r#"<sub_field name="{name}"><bit_range from_index="{from}" to_index="{to}"/>"#
            ));
            self.values(1 << (to - from + 1).min(7));
            self.push("</sub_field>");
            from = to + 1 + self.below(3);
        }
        self.push("</bit_field>");
    }

    fn choices(&mut self, attributes: &str, depth: u64) {
        if self.one_in(2) {
            self.push(format!(
                "<variable_field {attributes}><type_and_units_field>"
            ));
            for index in 0..1 + self.below(4) {
                let name = self.of(NAMES);
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
        for index in 0..1 + self.below(3) {
            let format = self.of(&["JPEG", "jpeg", "PNG 1", "1", "JAUS message", "VALUES"]);
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
        let sizes: &[u64] = match self.below(4) {
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
        if self.one_in(3) {
            return;
        }
        self.push(
            r#"<protocol_behavior is_stateless="false"><start state_machine_name="ReceiveFSM" state_name="S0"/><state_machine name="ReceiveFSM">"#,
        );
        let mut scope = Scope::default();
        let mut states = vec!["S0".to_owned()];
        for _ in 0..self.below(3) {
            states.push(self.name(&mut scope));
        }
        for state in &states {
            self.push(format!(r#"<state name="{state}">"#));
            if self.one_in(2) {
                let action = self.of(NAMES);
                self.push(format!(r#"<entry><action name="{action}"/></entry>"#));
            }
            for message in messages {
                if self.one_in(3) {
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
        if self.one_in(2) {
            let question = self.of(NAMES);
            self.push(format!(r#"<guard condition="{question}(msg, 'x')"/>"#));
        }
        let target = &states[self.below(states.len() as u64) as usize];
        let change = match self.one_in(2) {
            true => format!(r#"<simple><end_state state="{target}"/></simple>"#),
            false => "<internal/>".to_owned(),
        };
        self.push(change);
        for _ in 0..self.below(3) {
            let action = self.of(NAMES);
            let argument = self.of(&["msg", "'text'"]);
            self.push(format!(
                r#"<action name="{action}"><argument value="{argument}"/></action>"#
            ));
        }
        self.push("</transition>");
    }
}
