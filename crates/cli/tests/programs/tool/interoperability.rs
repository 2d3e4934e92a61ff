//! Checks docs/interoperability.md: it covers every peer with a profile.

use jaus::peer::Implementation;

const PAGE: &str = include_str!("../../../../../docs/interoperability.md");

#[test]
fn every_profile_has_its_row() {
    for peer in Implementation::ALL
        .into_iter()
        .filter(|&peer| peer != Implementation::Standard)
    {
        assert!(PAGE.contains(&format!("| `{peer}` |")), "{peer}");
    }
}
