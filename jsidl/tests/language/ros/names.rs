//! Names that ROS 2 does not permit, and names that would collide.

use std::sync::Arc;

use jsidl::Library;
use jsidl::model::{BitField, Id, Message, Number, Service, Shape, SubField, Unsigned, Version};
use jsidl::ros::{Package, PackageName};

use super::definitions::{check, constructs, interfaces, package};
use super::interfaces::Count;
use crate::support::{self, catalogue, group, item, list, message, optional, variant};

/// A library with one service, which has these messages.
pub(super) fn library(messages: Vec<Message>) -> Library {
    let location = support::everything().location;
    let mut library = Library::default();
    library.insert(Arc::new(Service {
        name: "Made".to_owned(),
        id: Id {
            urn: "urn:example:made:Made".into(),
            version: Version {
                major: 1,
                minor: 10,
            },
        },
        description: String::new(),
        inherits_from: None,
        client_of: Vec::new(),
        inputs: messages.into_iter().map(Arc::new).collect(),
        outputs: Vec::new(),
        behaviour: Vec::new(),
        location,
    }));
    library
}

/// A message with these members.
fn with(name: &str, members: Vec<jsidl::model::Item>) -> Message {
    message(0xF0B0, name, Some(item("Body", group(members))))
}

/// The fields of a type in a package with one message, as `type name`.
fn fields(message: Message, name: &str) -> Vec<String> {
    let interfaces = interfaces(&package(&library(vec![message])));
    let fields = interfaces[name].iter();
    let shown = fields.map(|field| match field.count {
        Count::One => format!("{} {}", field.ty, field.name),
        count => format!("{} {} {count:?}", field.ty, field.name),
    });
    shown.collect()
}

#[test]
fn fields_with_names_that_ros_reserves_get_others() {
    let names = ["class", "Class", "Self", "_x_", "3D", "\u{E9}", "A__B"];
    let members = names.map(|name| item(name, support::byte()));
    let fields = fields(with("Odd", members.into()), "ExampleMadeOddV1p10");
    let expected = [
        "uint8 class_value",
        "uint8 class_value_2",
        "uint8 self_value",
        "uint8 x",
        "uint8 n3d",
        "uint8 n",
        "uint8 a_b",
    ];
    assert_eq!(fields, expected);
}

#[test]
fn fields_that_the_package_adds_make_room_for_those_of_the_definition() {
    let choice = variant(vec![item("Kind", group(Vec::new()))]);
    let fields_of = |message: Message, name| fields(message, name);
    assert_eq!(
        fields_of(
            with("Odd", vec![item("Choice", choice)]),
            "ExampleMadeOddV1p10Choice"
        ),
        ["uint8 kind_2", "ExampleMadeOddV1p10Kind kind AtMost(1)"]
    );
    let bits = Shape::Bits(BitField {
        base: Unsigned::U16,
        fields: vec![SubField {
            name: "Reserved".to_owned(),
            from: 15,
            to: 15,
            values: support::values(&[]),
            interpretation: String::new(),
        }],
    });
    assert_eq!(
        fields_of(
            with("Odd", vec![item("Bits", bits)]),
            "ExampleMadeOddV1p10Bits"
        ),
        ["bool reserved", "uint16 reserved_2"]
    );
}

#[test]
fn constants_and_types_with_the_same_name_get_numbers() {
    let state = |name: &str, values: &[(u64, &str)]| {
        let scalar = jsidl::model::Scalar {
            meaning: jsidl::model::Meaning::Values(support::values(values)),
            ..support::plain(Number::Unsigned(Unsigned::U8))
        };
        item(name, Shape::Scalar(scalar))
    };
    let members = vec![
        state("A", &[(0, "B C"), (1, "")]),
        state("A_B", &[(2, "C"), (3, "3D")]),
        item(
            "Seq",
            group(vec![item("X", group(vec![item("Y", support::byte())]))]),
        ),
        item("Other", group(vec![item("x", group(Vec::new()))])),
    ];
    let library = library(vec![with("Odd", members)]);
    check(&library);
    let files = package(&library).files();
    let (_, odd) = files
        .iter()
        .find(|(path, _)| path.ends_with("OddV1p10.msg"))
        .unwrap();
    for line in [
        "uint8 A_B_C=0\n",
        "uint8 A_N=1\n",
        "uint8 A_B_C_2=2\n",
        "uint8 A_B_N3D=3\n",
    ] {
        assert!(odd.contains(line), "{line}: {odd}");
    }
    let names = files.iter().filter(|(path, _)| path.contains("V1p10X"));
    assert_eq!(names.count(), 2);
}

#[test]
fn sequences_of_sequences_have_types_between_them() {
    let bytes = |most| support::count(Unsigned::U16, 0, most);
    let blob = Shape::Blob {
        count: bytes(9),
        format: String::new(),
    };
    let inner = item("Inner", list(bytes(5), item("Rec", group(Vec::new()))));
    let members = vec![
        item("Plain", blob.clone()),
        optional("Maybe", blob),
        item("Outer", list(bytes(3), inner.clone())),
        optional("More", inner.shape),
        item("Fits", support::array(&[2, 512], support::byte())),
        item("Large", support::array(&[3, 512], support::byte())),
        optional("Row", support::array(&[2], support::byte())),
    ];
    let odd = message(
        0xF0B0,
        "Odd",
        Some(item(
            "Body",
            support::with_presence(Some(Unsigned::U8), members),
        )),
    );
    let fields = fields(odd.clone(), "ExampleMadeOddV1p10");
    let expected = [
        "uint8 plain Any",
        "ExampleMadeOddV1p10Maybe maybe AtMost(1)",
        "ExampleMadeOddV1p10Inner outer Any",
        "ExampleMadeOddV1p10More more AtMost(1)",
        "uint8 fits Exactly(1024)",
        "uint8 large Any",
        "ExampleMadeOddV1p10Row row AtMost(1)",
    ];
    assert_eq!(fields, expected);
    let of = |name: &str| self::fields(odd.clone(), &format!("ExampleMadeOddV1p10{name}"));
    assert_eq!(of("Maybe"), ["uint8 octets Any"]);
    assert_eq!(of("Inner"), ["ExampleMadeOddV1p10Rec elements Any"]);
    assert_eq!(of("Row"), ["uint8 elements Exactly(2)"]);
}

#[test]
fn versions_with_different_layouts_have_different_types_and_others_share_one() {
    let library = constructs();
    let package = package(&library);
    let mut of_versions = Vec::new();
    for service in library.services() {
        for message in service.messages().filter(|it| it.name == "QueryState") {
            let interface = package.interface(&service.id, message).unwrap();
            of_versions.push(interface.name());
        }
    }
    of_versions.dedup();
    assert_eq!(
        of_versions,
        ["ExampleQueryStateV1p0", "ExampleQueryStateV1p1"]
    );

    let catalogue = catalogue();
    let package = self::package(&catalogue);
    let mut names: Vec<_> = catalogue
        .by_code(0x4002)
        .map(|(service, message)| package.interface(&service.id, message).unwrap().name())
        .collect();
    assert_eq!(names.len(), 2, "Management 1.0 and 1.1");
    names.dedup();
    assert_eq!(names, ["CoreReportStatusV1p0"]);
}

#[test]
fn definitions_of_other_sets_change_no_file_and_newer_versions_no_name() {
    let all = catalogue();
    let selected = |wanted: &dyn Fn(&Service) -> bool| {
        let package = Package::of(&all, wanted, &PackageName::default());
        package.files().split_off(2)
    };
    let files = selected(&|_| true);
    for urn in [":core:", ":mobility:", ":iop:", ":manipulator:"] {
        let few = selected(&|service| service.id.urn.contains(urn));
        assert!(few.len() > 10 && few.len() < files.len(), "{urn}");
        for file in few {
            assert!(files.contains(&file), "{}", file.0);
        }
    }
    let first = Version { major: 1, minor: 0 };
    let older = selected(&|service| service.id.version <= first);
    assert!(older.len() > 100 && older.len() < files.len());
    for (path, _) in older {
        assert!(files.iter().any(|(known, _)| *known == path), "{path}");
    }
}
