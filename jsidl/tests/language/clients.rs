//! The client services of the catalogue: they mirror the services that they use, and are loaded only
//! on request or if a definition refers to them.

use jsidl::build::Build;
use jsidl::model::{Message, Service};
use jsidl::{Library, Loader};

/// Messages that a client service receives or sends although its service does not send or receive
/// them.
const EXTRA: &[&str] = &[
    // Clients of Discovery identify themselves.
    "DiscoveryClient QueryIdentification",
    // Public collections disagree on whether the list drivers receive waypoints.
    "GlobalWaypointListDriverClient SetGlobalWaypoint",
    "LocalWaypointListDriverClient SetLocalWaypoint",
];

fn load(fill: impl FnOnce(&mut Loader) -> &mut Loader) -> Library {
    let mut loader = Loader::new();
    fill(&mut loader);
    let loaded = loader.load();
    assert_eq!(loaded.diagnostics.to_string(), "");
    loaded.library
}

fn clients(library: &Library) -> Vec<&Service> {
    let services = library.services().map(AsRef::as_ref);
    services
        .filter(|it: &&Service| it.id.urn.ends_with("Client"))
        .collect()
}

/// An example service with this reference.
fn example(reference: &str) -> String {
    format!(
        r#"<service_def name="Mine" id="urn:example:Mine" version="1.0" xmlns="urn:jaus:jsidl:1.1">
        <references>{reference}</references><message_set><input_set/><output_set/></message_set></service_def>"#
    )
}

#[test]
fn the_catalogue_has_its_client_services_on_request() {
    let without = load(Loader::catalogue);
    let with = load(Loader::clients);
    assert!(clients(&without).is_empty());
    let clients = clients(&with);
    assert_eq!(clients.len(), 43);
    let others = with.services().count() - clients.len();
    assert_eq!(without.services().count(), others);
}

#[test]
fn a_client_service_is_loaded_with_its_bases_if_a_definition_refers_to_it() {
    let base =
        r#"<inherits_from name="base" id="urn:jaus:jss:core:ManagementClient" version="1.1"/>"#;
    let library = load(|loader| loader.catalogue().text("mine.xml", &example(base)));
    let mine = library.versions("urn:example:Mine").next().unwrap();
    let lineage = library.lineage(mine).map(|it| it.name.as_str());
    assert_eq!(
        lineage.collect::<Vec<_>>(),
        [
            "Mine",
            "ManagementClient",
            "AccessControlClient",
            "EventsClient",
            "Transport"
        ]
    );
    let clients = clients(&library).into_iter().map(|it| &*it.name);
    let unused = clients.filter(|name| name.starts_with("Discovery") || name.starts_with("Local"));
    assert_eq!(unused.count(), 0);
}

#[test]
fn the_compact_form_finds_client_services_and_their_newest_version() {
    let text = "service Mine (id = urn.example.Mine, version = 1.0) {\n  references {\n    \
        inherits_from import urn.jaus.jss.core.EventsClient as base;\n  }\n  \
        messages { input { } output { } }\n}\n";
    let mut loader = Loader::new();
    loader.catalogue().text("mine.csd", text);
    let library = loader.load().library;
    let mine = library.versions("urn:example:Mine").next().unwrap();
    let base = mine.inherits_from.as_ref().unwrap();
    assert_eq!(base.id.to_string(), "urn:jaus:jss:core:EventsClient 1.1");
}

#[test]
fn a_client_service_sends_what_its_service_receives_and_the_other_way_round() {
    let library = load(Loader::clients);
    for client in clients(&library) {
        let [server] = &client.client_of[..] else {
            panic!("{} is a client of one service", client.id);
        };
        assert_eq!(format!("{}Client", server.id.urn), &*client.id.urn);
        assert_eq!(server.id.version, client.id.version);
        let server = library.service(&server.id).unwrap();
        for (theirs, ours) in [
            (&server.outputs, &client.inputs),
            (&server.inputs, &client.outputs),
        ] {
            for message in ours {
                let extra = format!("{} {}", client.name, message.name);
                let is_there = theirs.iter().any(|it| is_same(it, message));
                assert!(is_there || EXTRA.contains(&extra.as_str()), "{extra}");
            }
        }
        let queries = server.inputs.iter();
        let missing = queries.filter(|it| !client.outputs.iter().any(|sent| is_same(it, sent)));
        assert_eq!(missing.count(), 0, "{}", client.id);
    }
}

fn is_same(a: &Message, b: &Message) -> bool {
    (a.code, &a.name, &a.body) == (b.code, &b.name, &b.body)
}

#[test]
fn every_message_that_a_client_service_receives_triggers_a_transition() {
    let library = load(Loader::clients);
    for client in clients(&library) {
        let machines = client.behaviour.iter();
        let transitions = machines.flat_map(|it| it.transitions());
        let triggers: Vec<_> = transitions.filter_map(|it| it.trigger.message()).collect();
        for message in &client.inputs {
            let is_handled = triggers.contains(&message.name.as_str());
            assert!(is_handled, "{} {}", client.id, message.name);
        }
    }
}

#[test]
fn client_services_are_generated_if_they_are_named_in_full() {
    let core = "urn:jaus:jss:core:";
    let build = Build::new()
        .module("core", core)
        .module("client", &format!("{core}EventsClient"));
    let (files, diagnostics) = build.generate();
    assert_eq!(diagnostics.to_string(), "");
    let [(_, core), (_, client)] = &files[..] else {
        panic!("two modules");
    };
    assert!(core.contains("pub mod events ") && !core.contains("pub mod events_client "));
    assert!(client.contains("pub mod events_client ") && !client.contains("pub mod events "));
}
