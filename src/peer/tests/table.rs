use std::fs;
use std::path::Path;

use super::super::*;

/// Set to write the page of the table anew.
const RENEW: &str = "JAUS_RENEW_SNAPSHOTS";

#[test]
fn the_page_shows_the_table_as_it_is() {
    let page = Path::new(env!("CARGO_MANIFEST_DIR")).join("src/peer/departures.md");
    let table = table().to_string();
    if std::env::var_os(RENEW).is_some() {
        fs::write(&page, &table).unwrap();
    }
    assert_eq!(
        fs::read_to_string(page).unwrap(),
        table,
        "set {RENEW} to write it anew"
    );
}

#[test]
fn each_peer_but_the_standard_one_departs_somewhere() {
    for peer in Peer::ALL {
        assert_eq!(
            peer.departures().count() == 0,
            peer == Peer::Standard,
            "{peer}"
        );
        assert_eq!(peer.name().parse(), Ok(peer));
    }
    let error = "jaus".parse::<Peer>().unwrap_err().to_string();
    assert!(
        error.contains("`jaus`") && error.contains("\"jaus++\""),
        "{error}"
    );
}
