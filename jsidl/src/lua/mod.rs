//! A Wireshark dissector in Lua for everything in a library.
//!
//! [`dissector`] writes one self-contained script. Most of it is an interpreter that is the same for
//! all definitions (`runtime/*.lua`); what is generated is tables: the fields that a filter can
//! name, and the layout of every message. The script knows JUDP and JTCP, the older headers, and
//! puts large messages together across packets.
//!
//! A field is called `jaus.<message>.<field>` in filters, in lower case, wherever in the message it
//! stands; a message is `jaus.<message>`.

mod fields;
mod shapes;
mod text;

use std::cmp::Reverse;
use std::collections::{BTreeMap, HashMap};
use std::fmt::Write as _;

use self::fields::{Fields, Kind};
use crate::catalogue;
use crate::library::Library;
use crate::model::{Message, Service};

/// The parts of the interpreter, in the order in which they need each other.
const RUNTIME: [&str; 6] = [
    include_str!("runtime/fields.lua"),
    include_str!("runtime/read.lua"),
    include_str!("runtime/show.lua"),
    include_str!("runtime/large.lua"),
    include_str!("runtime/transport.lua"),
    include_str!("runtime/dissect.lua"),
];

/// The script for every message of a library.
///
/// Where several definitions share a code, Wireshark tries those first that do not come with this
/// crate, then newer versions before older ones, and shows the first that fits the octets.
///
/// ```
/// let mut loader = jsidl::Loader::new();
/// loader.catalogue();
/// let script = jsidl::lua::dissector(&loader.load().library);
/// assert!(script.contains("jaus.reportidentification.querytype"));
/// ```
pub fn dissector(library: &Library) -> String {
    let mut fields = Fields::default();
    // Once to learn which names are claimed by what, once to write.
    layouts(library, &mut fields);
    fields.settle();
    let layouts = layouts(library, &mut fields);
    let mut out = introduction(library, layouts.len());
    fields.write(&mut out);
    out.push_str("local message_table = {\n");
    for layout in &layouts {
        layout.write(&mut out);
    }
    out.push_str("}\n");
    for part in RUNTIME {
        out.push('\n');
        out.push_str(part);
    }
    out
}

/// One layout of a message, and who declares it.
struct Layout<'m> {
    message: &'m Message,
    /// The field that stands for the message.
    field: usize,
    sections: String,
    services: Vec<String>,
}

impl Layout<'_> {
    fn write(&self, out: &mut String) {
        let services: Vec<_> = self.services.iter().map(|id| text::quoted(id)).collect();
        // Writing to a string does not fail.
        let _ = writeln!(
            out,
            "{{0x{:04X},{},{},{{{}}},{{{}}}}},",
            self.message.code,
            text::quoted(&self.message.name),
            self.field,
            services.join(","),
            self.sections
        );
    }
}

/// All layouts, those of one code in the order in which they are to be tried.
fn layouts<'m>(library: &'m Library, fields: &mut Fields) -> Vec<Layout<'m>> {
    let mut by_code: BTreeMap<u16, Vec<Layout<'m>>> = BTreeMap::new();
    let mut known: HashMap<(u16, String), usize> = HashMap::new();
    for service in in_order(library) {
        let id = service.id.to_string();
        for message in service.messages() {
            let prefix = fields::prefix(&message.name);
            let field = fields.field(prefix.clone(), &message.name, Kind::None, None);
            let sections = shapes::sections(message, &prefix, fields);
            let layouts = by_code.entry(message.code).or_default();
            let key = (message.code, format!("{}:{sections}", message.name));
            let place = *known.entry(key).or_insert(layouts.len());
            match layouts.get_mut(place) {
                Some(same) if same.services.contains(&id) => {}
                Some(same) => same.services.push(id.clone()),
                None => layouts.push(Layout {
                    message,
                    field,
                    sections,
                    services: vec![id.clone()],
                }),
            }
        }
    }
    by_code.into_values().flatten().collect()
}

/// Services in the order in which their messages are to be tried.
fn in_order(library: &Library) -> Vec<&Service> {
    let mut services: Vec<_> = library.services().map(AsRef::<Service>::as_ref).collect();
    services.sort_by_key(|service| {
        (
            catalogue::holds(&service.location),
            Reverse(service.id.version),
        )
    });
    services
}

fn introduction(library: &Library, layouts: usize) -> String {
    let mut out = format!(
        "-- A Wireshark dissector for JAUS, made by `jaus jsidl lua` from {} services with {layouts}\n\
         -- message layouts. Put it into Wireshark's folder of personal Lua plugins (Help, About,\n\
         -- Folders), or name it: wireshark -X lua_script:FILE.\n\
         --\n\
         -- Filters: jaus.source == \"101.1.1\", jaus.address, jaus.destination.subsystem, jaus.code,\n\
         -- jaus.message == \"ReportIdentification\", jaus.reportidentification.identification, and so\n\
         -- on for every field; jaus.malformed for what does not fit its definition.\n\
         --\n-- Services:\n",
        library.services().count(),
    );
    for service in library.services() {
        let _ = writeln!(out, "--   {}", text::one_line(&service.id.to_string()));
    }
    out.push('\n');
    out
}
