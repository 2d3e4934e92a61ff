//! Text of the package's files.

use super::definitions::{Arity, Constant, Definition, Definitions, Element, Field};
use super::package_name::PackageName;
use crate::model::{Number, Signed, Unsigned};
use crate::typed::notes;

/// Columns of a comment.
const WIDTH: usize = 98;

/// The interface definition (`.msg`) of a type.
pub(super) fn interface(definitions: &Definitions, definition: &Definition) -> String {
    let mut out = String::new();
    comment(&mut out, &definition.notes);
    for field in &definition.fields {
        out.push('\n');
        for constant in &field.constants {
            self::constant(&mut out, constant);
        }
        comment(&mut out, &field.notes);
        out.push_str(&format!(
            "{} {}\n",
            type_of(definitions, field),
            field.ident
        ));
    }
    out
}

fn constant(out: &mut String, constant: &Constant) {
    comment(out, &constant.notes);
    let ty = number(constant.number);
    out.push_str(&format!("{ty} {}={}\n", constant.name, constant.value));
}

fn comment(out: &mut String, paragraphs: &[String]) {
    for line in notes::wrapped(paragraphs, WIDTH) {
        // ROS reads escape sequences in comments.
        let line = line.replace('\\', "/");
        out.push_str(format!("# {line}").trim_end());
        out.push('\n');
    }
}

fn type_of(definitions: &Definitions, field: &Field) -> String {
    let element = match field.element {
        Element::Bool => "bool",
        Element::Number(number) => self::number(number),
        Element::Scaled(..) => "float64",
        Element::Text => "string",
        Element::Octets => "uint8[]",
        Element::Message(place) => definitions.get(place).map_or("", |it| &it.name),
    };
    match field.arity {
        Arity::One => element.to_owned(),
        Arity::Optional => format!("{element}[<=1]"),
        Arity::Many => format!("{element}[]"),
        Arity::Exactly(count) => format!("{element}[{count}]"),
    }
}

const fn number(number: Number) -> &'static str {
    match number {
        Number::Unsigned(Unsigned::U8) => "uint8",
        Number::Unsigned(Unsigned::U16) => "uint16",
        Number::Unsigned(Unsigned::U32) => "uint32",
        Number::Unsigned(Unsigned::U64) => "uint64",
        Number::Signed(Signed::I8) => "int8",
        Number::Signed(Signed::I16) => "int16",
        Number::Signed(Signed::I32) => "int32",
        Number::Signed(Signed::I64) => "int64",
        Number::F32 => "float32",
        Number::F64 => "float64",
    }
}

/// The package's manifest. ROS requires a maintainer and a licence, which only the user knows.
pub(super) fn manifest(name: &PackageName) -> String {
    let version = env!("CARGO_PKG_VERSION");
    // ROS permits numbers only.
    let version = version.split(['-', '+']).next().unwrap_or(version);
    format!(
        r#"<?xml version="1.0"?>
<?xml-model href="http://download.ros.org/schema/package_format3.xsd" schematypens="http://www.w3.org/2001/XMLSchema"?>
<!-- Written by `jaus jsidl msg`. Enter maintainer and license before you publish the package. -->
<package format="3">
  <name>{name}</name>
  <version>{version}</version>
  <description>JAUS messages as ROS 2 interfaces</description>
  <maintainer email="maintainer@example.com">maintainer</maintainer>
  <license>unspecified</license>

  <buildtool_depend>ament_cmake</buildtool_depend>
  <buildtool_depend>rosidl_default_generators</buildtool_depend>
  <exec_depend>rosidl_default_runtime</exec_depend>
  <member_of_group>rosidl_interface_packages</member_of_group>

  <export>
    <build_type>ament_cmake</build_type>
  </export>
</package>
"#
    )
}

/// The package's `CMakeLists.txt`, with the names of all types.
pub(super) fn build_file(name: &PackageName, types: &[&str]) -> String {
    let interfaces = types.iter().map(|it| format!("  \"msg/{it}.msg\"\n"));
    let interfaces = interfaces.collect::<String>();
    format!(
        r#"# Written by `jaus jsidl msg`.
cmake_minimum_required(VERSION 3.8)
project({name})

find_package(ament_cmake REQUIRED)
find_package(rosidl_default_generators REQUIRED)

rosidl_generate_interfaces(${{PROJECT_NAME}}
{interfaces})

ament_export_dependencies(rosidl_default_runtime)
ament_package()
"#
    )
}
