//! Loading of files, directories and the catalogue: which parts survive mistakes, which of several
//! declarations counts, and bounded cost for hostile texts.

use std::fmt::Write as _;
use std::fs;
use std::path::PathBuf;

use jsidl::model::{Item, Meaning, Message, Shape};
use jsidl::{Library, Loaded, Loader};

const HEADER: &str = r#"<header name="H"><record name="R"><fixed_field name="Code" field_type="unsigned short integer" field_units="one"/></record></header>"#;

const FIELD: &str = r#"<fixed_field name="A" field_type="unsigned byte" field_units="one"/>"#;

fn load(files: &[(&str, &str)]) -> Loaded {
    let mut loader = Loader::new();
    for (name, text) in files {
        loader.text(name, text);
    }
    loader.load()
}

/// `service_def` with these parts between `references` and `message_set`.
fn service(name: &str, base: &str, types: &str, inputs: &str) -> String {
    let references = match base {
        "" => String::new(),
        base => format!(
            r#"<references><inherits_from name="base" id="urn:{base}" version="1.0"/></references>"#
        ),
    };
    format!(
        r#"<service_def name="{name}" id="urn:{name}" version="1.0" xmlns="urn:jaus:jsidl:1.0">{references}<declared_type_set name="T">{types}</declared_type_set><message_set><input_set>{inputs}</input_set><output_set/></message_set></service_def>"#
    )
}

fn message(name: &str, code: &str, body: &str) -> String {
    format!(
        r#"<message_def name="{name}" message_id="{code}" is_command="false">{HEADER}<body name="B">{body}</body><footer name="F"/></message_def>"#
    )
}

fn type_set(urn: &str, content: &str) -> String {
    format!(
        r#"<declared_type_set name="Set" id="{urn}" version="1.0" xmlns="urn:jaus:jsidl:1.1">{content}</declared_type_set>"#
    )
}

fn names(library: &Library) -> Vec<String> {
    let services = library.services();
    let all = services.flat_map(|s| s.messages().map(|m| format!("{} {}", s.name, m.name)));
    all.collect()
}

fn members(message: &Message) -> &[Item] {
    match message.body.as_ref().map(|body| &body.shape) {
        Some(Shape::Group(group)) => &group.members,
        other => panic!("not a group: {other:?}"),
    }
}

/// A directory for one test, removed at the end.
struct Directory(PathBuf);

impl Directory {
    fn new(name: &str) -> Self {
        let path = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(name);
        drop(fs::remove_dir_all(&path));
        fs::create_dir_all(&path).expect("the directory is ours");
        Self(path)
    }

    fn file(&self, name: &str, octets: &[u8]) -> PathBuf {
        let path = self.0.join(name);
        let parent = path.parent().expect("within the directory");
        fs::create_dir_all(parent).expect("the directory is ours");
        fs::write(&path, octets).expect("the directory is ours");
        path
    }
}

impl Drop for Directory {
    fn drop(&mut self) {
        drop(fs::remove_dir_all(&self.0));
    }
}

#[test]
fn a_wrong_message_costs_neither_its_service_nor_others() {
    let inputs = [
        message("Good", "0001", ""),
        message("Bad", "0002", r#"<record name="R"/>"#),
        message("Better", "0003", ""),
    ];
    let loaded = load(&[
        ("a.xml", &service("A", "", "", &inputs.concat())),
        (
            "b.xml",
            &service("B", "A", "", &message("More", "0004", "")),
        ),
    ]);
    assert_eq!(loaded.diagnostics.len(), 1, "{}", loaded.diagnostics);
    assert_eq!(names(&loaded.library), ["A Good", "A Better", "B More"]);
    let heir = loaded.library.versions("urn:B").next().expect("B is kept");
    let vocabulary: Vec<_> = loaded
        .library
        .vocabulary(heir)
        .map(|(declaring, message)| format!("{} {}", declaring.name, message.name))
        .collect();
    assert_eq!(vocabulary, ["B More", "A Good", "A Better"]);
}

#[test]
fn what_is_misspelt_is_left_out_and_not_guessed() {
    let misspelt = FIELD.replace("name=", "optinal=\"true\" name=");
    let body = |field: &str| format!(r#"<record name="R">{field}</record>"#);
    let inputs = [
        message("Good", "0001", &body(FIELD)),
        message("Bad", "0002", &body(&misspelt)),
    ];
    let loaded = load(&[("s.xml", &service("S", "", "", &inputs.concat()))]);
    assert_eq!(
        loaded.diagnostics.errors().count(),
        1,
        "{}",
        loaded.diagnostics
    );
    assert_eq!(names(&loaded.library), ["S Good"]);
}

#[test]
fn a_service_without_its_base_is_left_out_and_others_stay() {
    let loaded = load(&[
        ("a.xml", &service("A", "Missing", "", "")),
        ("b.xml", &service("B", "", "", "")),
    ]);
    assert!(loaded.diagnostics.has_errors());
    let services: Vec<_> = loaded.library.services().map(|s| s.name.as_str()).collect();
    assert_eq!(services, ["B"]);
}

#[test]
fn a_reference_overrides_name_optionality_and_interpretation() {
    let types = type_set(
        "urn:types",
        r#"<fixed_field name="Speed" optional="true" field_type="byte" field_units="one" interpretation="of the target"/>"#,
    );
    let body = r#"<record name="R"><declared_fixed_field name="Wind" optional="false" declared_type_ref="x.Speed" interpretation="of  the reference"/><declared_fixed_field name="Gust" optional="false" declared_type_ref="x.Speed"/></record>"#;
    let alias = r#"<declared_type_set_ref name="x" id="urn:types" version="1.0"/>"#;
    let loaded = load(&[
        (
            "s.xml",
            &service("S", "", alias, &message("M", "0001", body)),
        ),
        ("t.xml", &types),
    ]);
    assert_eq!(loaded.diagnostics.to_string(), "");
    let (_, message) = loaded.library.by_code(1).next().expect("M is kept");
    let [wind, gust] = members(message) else {
        panic!("two members");
    };
    assert_eq!((wind.name.as_str(), wind.optional), ("Wind", false));
    assert_eq!(wind.interpretation, "of the reference");
    assert_eq!(gust.interpretation, "of the target");
    assert_eq!(wind.location.file.to_str(), Some("s.xml"));
}

#[test]
fn constants_are_found_in_other_files_and_in_the_service_itself() {
    let constants = r#"<declared_const_set name="K" id="urn:k" version="1.0" xmlns="urn:jaus:jsidl:1.0"><const_def name="PI" const_type="long float" const_value="3.5" field_units="one"/><const_def name="TAU" const_type="long float" const_value="2*PI" field_units="one"/></declared_const_set>"#;
    let field = |lower: &str, upper: &str| {
        format!(
            r#"<record name="R"><fixed_field name="A" field_type="unsigned byte" field_units="one"><scale_range real_lower_limit="{lower}" real_upper_limit="{upper}" integer_function="round"/></fixed_field></record>"#
        )
    };
    let alias = r#"<declared_const_set_ref name="k" id="urn:k" version="1.0"/>"#;
    let elsewhere = service(
        "S",
        "",
        alias,
        &message("M", "0001", &field("-10*k.PI", "k.TAU/2")),
    );
    let own = r#"<declared_const_set name="own"><const_def name="N" const_type="integer" const_value="1,000" field_units="one"/></declared_const_set><message_set>"#;
    let here = service(
        "T",
        "",
        "",
        &message("M", "0001", &field("-own.N", "(N + 1)*2")),
    )
    .replace("<message_set>", own);
    let loaded = load(&[
        ("k.xml", constants),
        ("s.xml", &elsewhere),
        ("t.xml", &here),
    ]);
    assert_eq!(loaded.diagnostics.to_string(), "");
    let limits: Vec<_> = loaded
        .library
        .by_code(1)
        .map(|(_, message)| match &members(message)[0].shape {
            Shape::Scalar(scalar) => match scalar.meaning {
                Meaning::Scaled(scale) => (scale.lower, scale.upper),
                _ => panic!("scaled"),
            },
            _ => panic!("a number"),
        })
        .collect();
    assert_eq!(limits, [(-35.0, 3.5), (-1000.0, 2002.0)]);
}

#[test]
fn of_several_copies_of_a_type_set_the_nearest_counts() {
    let set = |name: &str| {
        let record = format!(
            r#"<record name="Rec">{}</record>"#,
            FIELD.replace("\"A\"", name)
        );
        type_set("urn:types", &record)
    };
    let alias = r#"<declared_type_set_ref name="x" id="urn:types" version="1.0"/>"#;
    let body = r#"<declared_record name="R" declared_type_ref="x.Rec"/>"#;
    let asking = service("S", "", alias, &message("M", "0001", body));
    let loaded = load(&[
        ("core/Types.xml", &set("\"Far\"")),
        ("iop/messages/Types.xml", &set("\"Near\"")),
        ("iop/S.xml", &asking),
    ]);
    assert_eq!(loaded.diagnostics.to_string(), "");
    let (_, message) = loaded.library.by_code(1).next().expect("M is kept");
    assert_eq!(members(message)[0].name, "Near");

    let twice = load(&[("a/1.xml", &set("\"A\"")), ("a/2.xml", &set("\"B\""))]);
    assert_eq!(
        twice.diagnostics.to_string(),
        "a/2.xml:1:1: warning: the type set `urn:types 1.0` is declared twice in this directory; \
         the first one is used: remove one, or give it another id or version\n  a/1.xml:1:1: \
         note: the other one\n"
    );
}

#[test]
fn what_a_user_declares_counts_before_the_catalogue() {
    let mine = r#"<service_def name="Liveness" id="urn:jaus:jss:core:Liveness" version="1.0" xmlns="urn:jaus:jsidl:1.0"><message_set><input_set/><output_set/></message_set></service_def>"#;
    let mut loader = Loader::new();
    loader.catalogue();
    loader.text("mine.xml", mine);
    let loaded = loader.load();
    let found: Vec<_> = loaded
        .diagnostics
        .iter()
        .map(|d| d.message.as_str())
        .collect();
    assert_eq!(
        found,
        [
            "`urn:jaus:jss:core:Liveness 1.0` is declared with other messages at mine.xml:1:1, which takes precedence because it was loaded first"
        ]
    );
    let liveness = loaded.library.versions("urn:jaus:jss:core:Liveness").next();
    assert_eq!(liveness.expect("is kept").messages().count(), 0);
}

#[test]
fn files_with_a_mark_and_any_line_ends_are_read() {
    let text = service("S", "", "", &message("M", "0001", "")).replace("><", ">\r\n<");
    let loaded = load(&[("s.xml", &format!("\u{feff}{text}"))]);
    assert_eq!(loaded.diagnostics.to_string(), "");
    assert_eq!(names(&loaded.library), ["S M"]);
}

#[test]
fn the_wrapper_of_several_services_and_its_drawing_data_are_understood() {
    let one = service("A", "", "", &message("M", "0001", ""));
    let drawn = service("B", "A", "", "").replace(
        "<message_set>",
        r#"<p:mxCell xmlns:p="urn:jaus:jsidl:plus"><p:mxGeometry x="1"/></p:mxCell><message_set>"#,
    );
    let set = format!(
        r#"<p:service_set xmlns:p="urn:jaus:jsidl:plus" xmlns="urn:jaus:jsidl:1.0" name="S" id="urn:set" version="0.1"><description>Two.</description>{one}{drawn}</p:service_set>"#
    );
    let loaded = load(&[("set.xml", &set)]);
    assert_eq!(loaded.diagnostics.to_string(), "");
    assert_eq!(loaded.library.services().count(), 2);
}

#[test]
fn directories_are_read_recursively_and_strangers_in_them_are_passed_over() {
    let directory = Directory::new("directories");
    directory.file("a/S.XML", service("S", "", "", "").as_bytes());
    directory.file("b/c/T.xml", service("T", "S", "", "").as_bytes());
    directory.file("b/notes.txt", b"not XML");
    let stranger = directory.file("b/pom.xml", b"<project/>");
    let mut loader = Loader::new();
    loader.path(&directory.0);
    let loaded = loader.load();
    assert_eq!(loaded.library.services().count(), 2);
    assert_eq!(
        loaded.diagnostics.to_string(),
        format!(
            "{}:1:1: warning: ignored: `project` is not the root element of a JSIDL file\n",
            stranger.display()
        )
    );
}

#[test]
fn what_cannot_be_read_is_a_finding() {
    let directory = Directory::new("unreadable");
    let latin = directory.file("latin.xml", b"<a>\xfc</a>");
    let empty = directory.file("empty/readme.txt", b"").with_file_name("");
    let mut loader = Loader::new();
    loader.path(directory.0.join("absent.xml"));
    loader.path(&latin);
    loader.path(&empty);
    let loaded = loader.load();
    let found: Vec<_> = loaded
        .diagnostics
        .errors()
        .map(|d| d.message.as_str())
        .collect();
    assert!(found[0].starts_with("cannot read the file: "), "{found:?}");
    assert_eq!(
        found[1..],
        [
            "the file is not UTF-8 at octet 3: convert it",
            "this directory has no service definitions: their files end in `.xml`, `.csd` or `.cjsidl`"
        ]
    );
}

/// Each sequence refers to the previous one twice: twenty of them would be a million fields.
#[test]
fn references_that_double_again_and_again_are_stopped() {
    let mut types = format!(r#"<sequence name="S0"><record name="R">{FIELD}</record></sequence>"#);
    for step in 1..=20 {
        let last = step - 1;
        write!(
            types,
            r#"<sequence name="S{step}"><declared_sequence name="A" declared_type_ref="S{last}"/><declared_sequence name="B" declared_type_ref="S{last}"/></sequence>"#
        )
        .expect("memory");
    }
    let found = load(&[("s.xml", &service("S", "", &types, ""))]).diagnostics;
    let errors: Vec<_> = found.errors().map(|d| d.message.as_str()).collect();
    assert_eq!(
        errors,
        [
            "the references of these definitions add up to more than 200000 fields: load fewer of them at once"
        ]
    );
}

/// A copy counts with the length of its texts.
#[test]
fn long_texts_that_are_referred_to_again_and_again_are_stopped() {
    let long = FIELD.replace(
        "name=",
        &format!("interpretation=\"{}\" name=", "x".repeat(1 << 20)),
    );
    let reference = r#"<declared_fixed_field name="B" declared_type_ref="A"/>"#;
    let records = (0..1000).map(|n| format!(r#"<record name="R{n}">{reference}</record>"#));
    let types = long + &records.collect::<String>();
    let found = load(&[("s.xml", &service("S", "", &types, ""))]).diagnostics;
    assert!(
        found.to_string().contains("more than 200000 fields"),
        "{found}"
    );
}

#[test]
fn chains_of_references_and_nested_elements_are_stopped() {
    let mut types = String::new();
    for step in 0..10_000 {
        let next = step + 1;
        write!(
            types,
            r#"<list name="L{step}"><count_field field_type_unsigned="unsigned byte"/><declared_list name="N" declared_type_ref="L{next}"/></list>"#
        )
        .expect("memory");
    }
    let found = load(&[("s.xml", &service("S", "", &types, ""))]).diagnostics;
    assert!(found.to_string().contains("nested more than 32 deep"));

    let count = r#"<count_field field_type_unsigned="unsigned byte"/>"#;
    for depth in [60, 100_000] {
        let open = format!(r#"<list name="L">{count}"#).repeat(depth);
        let nested = format!("{open}{}", "</list>".repeat(depth));
        let found = load(&[("s.xml", &service("S", "", &nested, ""))]).diagnostics;
        assert!(found.to_string().contains("deep"), "{depth}: {found}");
    }
}

#[test]
fn long_lineages_are_stopped() {
    let mut set = String::new();
    for step in 0..1_000 {
        set += &service(&format!("S{step}"), &format!("S{}", step + 1), "", "");
    }
    set += &service("S1000", "", "", "");
    let set = format!(r#"<service_set xmlns="urn:jaus:jsidl:plus">{set}</service_set>"#);
    let loaded = load(&[("s.xml", &set)]);
    assert_eq!(loaded.library.services().count(), 33);
    assert_eq!(loaded.diagnostics.errors().count(), 1_001 - 33);
}
