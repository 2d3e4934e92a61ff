//! Named values of signed fields, as tshark prints them.

use jaus_test_kit::tools::has_tshark;
use jsidl::Loader;
use roxmltree::Document;

use super::packets::Packets;
use super::tshark;

/// A report with one field for each of these types; -2 and 3 have names.
const TYPES: [&str; 4] = ["byte", "short integer", "integer", "long integer"];

fn definition() -> String {
    let fields = TYPES.map(|number| {
        format!(
            r#"<fixed_field name="{}" optional="false" field_type="{number}" field_units="one">
            <value_set offset_to_lower_limit="false">
            <value_enum enum_index="-2" enum_const="Reverse"/><value_enum enum_index="3" enum_const="Third"/>
            </value_set></fixed_field>"#,
            number.replace(' ', "_")
        )
    });
    format!(
        r#"<service_def name="Gears" id="urn:example:Gears" version="1.0" xmlns="urn:jaus:jsidl:1.1">
        <message_set><input_set/><output_set>
        <message_def name="ReportGears" message_id="D001" is_command="false"><description>Gears.</description>
        <header name="Header"><record name="HeaderRec" optional="false"><fixed_field name="MessageID"
            optional="false" field_type="unsigned short integer" field_units="one"/></record></header>
        <body name="Body"><record name="GearsRec" optional="false">{}</record></body><footer name="Footer"/>
        </message_def></output_set></message_set></service_def>"#,
        fields.concat()
    )
}

#[test]
fn tshark_prints_the_names_of_negative_values() {
    if !has_tshark() {
        return;
    }
    let mut loader = Loader::new();
    loader.text("gears.xml", &definition());
    let loaded = loader.load();
    assert!(!loaded.diagnostics.has_errors(), "{}", loaded.diagnostics);
    let mut packets = Packets::new();
    let reverse = [&[0x01, 0xD0, 0xFE], &[0xFE, 0xFF][..]].concat();
    let reverse = [
        &reverse[..],
        &(-2_i32).to_le_bytes(),
        &(-2_i64).to_le_bytes(),
    ]
    .concat();
    packets.message(&reverse);
    let directory = tshark::directory("negative");
    let capture = directory.join("packets.pcap");
    packets.write(&capture);
    let pdml = tshark::pdml(&loaded.library, &directory, &capture);
    let document = Document::parse(&pdml).unwrap();
    let message = tshark::messages(tshark::packets(&document)[0])[0];
    let shown = TYPES.map(|number| {
        let field = format!("jaus.reportgears.{}", number.replace(' ', "_"));
        let mut items = message.descendants();
        let item = items.find(|item| tshark::name(*item) == field);
        item.and_then(|item| item.attribute("showname"))
            .unwrap_or_default()
    });
    let wanted = TYPES.map(|number| format!("{}: Reverse (-2)", number.replace(' ', "_")));
    assert_eq!(shown, wanted);
}
