//! Generates a Wireshark dissector in Lua for every message of a library.
//!
//! [`dissector`] writes one self-contained script. Most of it is an interpreter that is the same
//! for all definitions (`runtime/*.lua`). The generated part is tables: the filter fields and the
//! layout of every message. The script decodes JUDP and JTCP, the older headers, and reassembles
//! large messages across packets.
//!
//! Filters address a field as `jaus.<message>.<field>`, in lower case, at any depth in the message;
//! a message is `jaus.<message>`. Reference Architecture messages reuse the codes and names of
//! others, so they have a table of their own and are `jaus.ra.<message>`. Header and source decide
//! between the two.

mod fields;
mod shapes;
mod text;

use std::cmp::Reverse;
use std::collections::{BTreeMap, HashMap};
use std::fmt::Write as _;

use self::fields::{Fields, Kind};
use crate::catalogue::{self, Entry};
use crate::library::Library;
use crate::model::{Message, Service};

/// The parts of the interpreter, dependencies first.
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
/// If several definitions share a code, Wireshark tries definitions from outside this crate first,
/// then newer versions before older ones, and shows the first that fits the octets. The definitions
/// of the [Reference Architecture](crate::catalogue::Entry::of_reference_architecture) are tried
/// only for its own messages.
///
/// ```
/// let mut loader = jsidl::Loader::new();
/// loader.catalogue().reference_architecture();
/// let script = jsidl::lua::dissector(&loader.load().library);
/// assert!(script.contains("jaus.reportidentification.querytype"));
/// assert!(script.contains("jaus.ra.reportidentification.queryfield"));
/// ```
pub fn dissector(library: &Library) -> String {
    let (of_ra, services): (Vec<_>, Vec<_>) = in_order(library).into_iter().partition(is_of_ra);
    let mut fields = Fields::default();
    let both = |fields: &mut Fields| {
        let services = layouts(&services, fields::prefix, fields);
        let of_ra = layouts(&of_ra, fields::ra_prefix, fields);
        [("message_table", services), ("ra_message_table", of_ra)]
    };
    // First pass: learn which names are claimed. Second pass: write.
    both(&mut fields);
    fields.settle();
    let tables = both(&mut fields);
    let count = tables.iter().map(|(_, layouts)| layouts.len()).sum();
    let mut out = introduction(library, count);
    fields.write(&mut out);
    for (name, layouts) in &tables {
        // Writing to a string does not fail.
        let _ = writeln!(out, "local {name} = {{");
        for layout in layouts {
            layout.write(&mut out);
        }
        out.push_str("}\n");
    }
    for part in RUNTIME {
        out.push('\n');
        out.push_str(part);
    }
    out
}

/// One layout of a message, with its declaring services.
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

/// All layouts of services; layouts with one code in trial order. `prefix` gives a message's filter
/// prefix.
fn layouts<'m>(
    services: &[&'m Service],
    prefix: fn(&str) -> String,
    fields: &mut Fields,
) -> Vec<Layout<'m>> {
    let mut by_code: BTreeMap<u16, Vec<Layout<'m>>> = BTreeMap::new();
    let mut known: HashMap<(u16, String), usize> = HashMap::new();
    for service in services {
        let id = service.id.to_string();
        for message in service.messages() {
            let prefix = prefix(&message.name);
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

/// Services in the order in which their messages are tried.
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

/// Whether a service belongs to the Reference Architecture.
fn is_of_ra(service: &&Service) -> bool {
    catalogue::find(&service.id).is_some_and(Entry::of_reference_architecture)
}

fn introduction(library: &Library, layouts: usize) -> String {
    let mut out = format!(
        "-- A Wireshark dissector for JAUS, made by `jaus jsidl lua` from {} services with {layouts}\n\
         -- message layouts. Put it into Wireshark's folder of personal Lua plugins (Help, About,\n\
         -- Folders), or name it: wireshark -X lua_script:FILE.\n\
         --\n\
         -- Filters: jaus.source == \"101.1.1\", jaus.address, jaus.destination.subsystem, jaus.code,\n\
         -- jaus.message == \"ReportIdentification\", jaus.reportidentification.identification, and so\n\
         -- on for every field; jaus.ra for messages of the Reference Architecture (OpenJAUS 3.x), as\n\
         -- in jaus.ra.reportglobalpose.latitude; jaus.malformed for what does not fit its definition.\n\
         --\n-- Services:\n",
        library.services().count(),
    );
    for service in library.services() {
        let _ = writeln!(out, "--   {}", text::one_line(&service.id.to_string()));
    }
    out.push('\n');
    out
}
