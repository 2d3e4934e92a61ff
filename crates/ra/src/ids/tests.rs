//! Id tables: rules, settings, claims and conflicts.

use std::collections::HashMap;

use proptest::collection::vec;
use proptest::prelude::*;

use super::*;
use jaus::address::JausId;

fn ra(text: &str) -> RaId {
    text.parse().unwrap()
}

fn jaus(text: &str) -> JausId {
    text.parse().unwrap()
}

fn error(settings: &Settings) -> String {
    IdTable::new(settings).expect_err("must not be").to_string()
}

const DRIVER: RaComponent = RaComponent::PRIMITIVE_DRIVER;

#[test]
fn without_settings_the_rules_hold() {
    let ids = IdTable::new(&Settings::default()).unwrap();
    for (there, here) in [
        ("20.1.33.1", "20.1.33"),
        ("20.1.33.2", "20.1.97"),
        ("254.254.63.3", "254.254.191"),
    ] {
        assert_eq!(ids.jaus_of(ra(there)), Some(jaus(here)));
        assert_eq!(ids.ra_behind(jaus(here)), Some(ra(there)));
    }
    let shown = ids.ra_of(jaus("101.1.200"), DRIVER);
    assert_eq!(shown, Some(ra("101.1.33.200")));
    assert_eq!(ids.jaus_behind(ra("101.1.33.200")), Some(jaus("101.1.200")));
}

#[test]
fn what_no_rule_covers_says_which_setting_would_help() {
    let ids = IdTable::new(&Settings::default()).unwrap();
    let of_ra = |id: &str| ids.jaus_id(ra(id)).expect_err(id).to_string();
    assert!(of_ra("20.1.64.1").contains("ra_components"));
    assert!(of_ra("20.1.33.4").contains("ra_components"));
    assert_eq!(
        of_ra("20.255.33.1"),
        "the id does not name a single component"
    );
    let of_ours = |id: &str, part| ids.ra_id(jaus(id), part).expect_err(id).to_string();
    let error = of_ours("1001.1.1", DRIVER);
    assert!(error.contains("JAUS subsystem 1001"), "{error}");
    assert!(
        error.contains("jaus_subsystems") && error.contains("jaus_offset"),
        "{error}"
    );
    assert_eq!(
        ids.ra_id(jaus("101.1.1"), RaComponent::COMMUNICATOR),
        Err(Unmapped::Reserved)
    );
}

#[test]
fn an_entry_overrides_the_rule_and_takes_the_number_from_whom_the_rule_would_give_it() {
    let settings = Settings {
        ra_offset: 1000,
        ra_subsystems: vec![SubsystemEntry { ra: 20, jaus: 1021 }],
        ra_components: vec![ComponentEntry {
            ra: ra("20.1.70.9"),
            jaus: jaus("1021.1.33"),
        }],
        jaus_components: vec![ComponentEntry {
            jaus: jaus("101.1.200"),
            ra: ra("101.1.33.1"),
        }],
        ..Settings::default()
    };
    let ids = IdTable::new(&settings).unwrap();
    assert_eq!(ids.jaus_of(ra("22.1.33.1")), Some(jaus("1022.1.33")));
    assert_eq!(ids.jaus_of(ra("20.1.70.9")), Some(jaus("1021.1.33")));
    assert_eq!(ids.ra_behind(jaus("1021.1.33")), Some(ra("20.1.70.9")));
    assert_eq!(ids.jaus_of(ra("20.1.33.1")), None);
    assert_eq!(ids.jaus_of(ra("21.1.33.1")), None);
    let taken = ids.jaus_id(ra("21.1.33.1")).unwrap_err().to_string();
    assert!(taken.contains("assigns to 20"), "{taken}");
    // Only the component type of the entry has another instance.
    assert_eq!(ids.ra_of(jaus("101.1.200"), DRIVER), Some(ra("101.1.33.1")));
    assert_eq!(ids.ra_of(jaus("101.1.1"), DRIVER), None);
    let pose = RaComponent::GLOBAL_POSE_SENSOR;
    assert_eq!(ids.ra_of(jaus("101.1.200"), pose), Some(ra("101.1.38.200")));
    assert_eq!(ids.ra_of(jaus("101.1.1"), pose), Some(ra("101.1.38.1")));
}

#[test]
fn settings_that_make_no_table_name_the_place_and_the_remedy() {
    let subsystems = |entries: &[(u8, u16)]| Settings {
        ra_subsystems: entries
            .iter()
            .map(|&(ra, jaus)| SubsystemEntry { ra, jaus })
            .collect(),
        ..Settings::default()
    };
    assert_eq!(
        error(&subsystems(&[(255, 3)])),
        "RA subsystem 255 in ra_subsystems is out of range: choose from 1 to 254"
    );
    assert!(error(&subsystems(&[(3, 0)])).contains("choose from 1 to 65534"));
    for twice in [[(3, 300), (3, 301)], [(3, 300), (4, 300)]] {
        assert!(error(&subsystems(&twice)).contains("appears twice in ra_subsystems"));
    }
    let offset = Settings {
        jaus_offset: 254,
        ..Settings::default()
    };
    assert!(
        error(&offset)
            .starts_with("jaus_offset 254 maps no JAUS subsystem to a number from 1 to 254")
    );
    let offset = Settings {
        ra_offset: i32::MAX,
        ..Settings::default()
    };
    assert!(error(&offset).starts_with("ra_offset 2147483647"));
}

#[test]
fn entries_for_components_stay_in_their_node_and_are_unique() {
    let components = |entries: &[(&str, &str)]| Settings {
        ra_components: entries
            .iter()
            .map(|(there, here)| ComponentEntry {
                ra: ra(there),
                jaus: jaus(here),
            })
            .collect(),
        ..Settings::default()
    };
    let leaves = error(&components(&[("20.1.70.1", "21.1.70")]));
    assert!(
        leaves.ends_with("RA subsystem 20 is JAUS subsystem 20"),
        "{leaves}"
    );
    let leaves = error(&components(&[("20.1.70.1", "20.2.70")]));
    assert!(leaves.ends_with("write the same node in both"), "{leaves}");
    assert!(error(&components(&[("20.1.0.1", "20.1.70")])).contains("zeros or wildcards"));
    let twice = [("20.1.70.1", "20.1.64"), ("20.1.71.1", "20.1.64")];
    assert!(error(&components(&twice)).contains("remove one"));
    let reserved = Settings {
        jaus_components: vec![ComponentEntry {
            jaus: jaus("101.1.200"),
            ra: ra("101.1.35.1"),
        }],
        ..Settings::default()
    };
    assert!(error(&reserved).contains("communicator"));
}

#[test]
fn two_subsystems_that_meet_in_a_number_are_told_apart_or_refused() {
    let mut ids = IdTable::new(&Settings::default()).unwrap();
    assert_eq!(ids.claim(Side::Ra, 20), Ok(Some(20)));
    assert_eq!(ids.claim(Side::Ra, 20), Ok(Some(20)), "again");
    let collision = ids.claim(Side::Jaus, 20).unwrap_err().to_string();
    assert!(
        collision.contains("jaus_offset") && collision.contains("jaus_subsystems"),
        "{collision}"
    );
    // The first claim stays valid.
    assert_eq!(ids.claim(Side::Ra, 20), Ok(Some(20)));
    assert_eq!(ids.claim(Side::Jaus, 1001), Ok(None));
    ids.release(Side::Ra, 20);
    assert_eq!(ids.claim(Side::Jaus, 20), Ok(Some(20)));

    let mut ids = IdTable::new(&Settings {
        ra_offset: 1000,
        ..Settings::default()
    })
    .unwrap();
    assert_eq!(ids.claim(Side::Ra, 20), Ok(Some(1020)));
    let collision = ids.claim(Side::Jaus, 1020).unwrap_err();
    assert_eq!(
        (collision.home, collision.number, collision.shown_as),
        (Side::Ra, 20, 1020)
    );
}

#[test]
fn a_component_on_either_side_is_named_by_the_id_that_the_receiver_knows() {
    let mut ids = IdTable::new(&Settings {
        ra_offset: 1000,
        ..Settings::default()
    })
    .unwrap();
    let (theirs, ours) = ("20.1.33.1", "101.1.9");
    assert_eq!(ids.known_to_jaus(ra(theirs)), None);
    assert_eq!(ids.known_to_ra(jaus(ours)), None);
    ids.claim(Side::Ra, 20).unwrap();
    ids.claim(Side::Jaus, 101).unwrap();
    assert_eq!(ids.known_to_jaus(ra(theirs)), Some(jaus("1020.1.33")));
    assert_eq!(ids.known_to_ra(jaus("1020.1.33")), Some(ra(theirs)));
    assert_eq!(ids.known_to_ra(jaus(ours)), Some(ra("101.1.32.9")));
    assert_eq!(ids.known_to_jaus(ra("101.1.32.9")), Some(jaus(ours)));
}

#[test]
fn settings_are_read_from_text_and_unknown_keys_are_refused() {
    let text = r#"{"ra_offset": 1000, "ra_subsystems": [{"ra": 20, "jaus": 1200}],
        "ra_components": [{"ra": "20.1.70.1", "jaus": "1200.1.200"}]}"#;
    let settings: Settings = serde_json::from_str(text).unwrap();
    let ids = IdTable::new(&settings).unwrap();
    assert_eq!(ids.jaus_of(ra("20.1.70.1")), Some(jaus("1200.1.200")));
    assert!(serde_json::from_str::<Settings>(r#"{"offset": 1}"#).is_err());
    let wrong =
        serde_json::from_str::<Settings>(r#"{"ra_components": [{"ra": "20.1", "jaus": "1.1.1"}]}"#);
    assert!(wrong.unwrap_err().to_string().contains("is not an RA id"));
}

/// Settings from a small range of numbers, so that they collide; invalid settings are left out.
fn tables() -> impl Strategy<Value = (Settings, IdTable)> {
    let subsystem = || (1..8_u8, 1..8_u16).prop_map(|(ra, jaus)| SubsystemEntry { ra, jaus });
    let component = || {
        let ra = (1..8_u8, 1..3_u8, 30..34_u8, 1..5_u8);
        (ra, 1..8_u16, 30..102_u8).prop_map(|((s, node, component, instance), subsystem, c)| {
            let ra = RaId {
                subsystem: s,
                node,
                component,
                instance,
            };
            ComponentEntry {
                ra,
                jaus: JausId::new(subsystem, node, c),
            }
        })
    };
    (
        (-3..4_i32, -3..4_i32),
        vec(subsystem(), 0..3),
        vec(subsystem(), 0..3),
        vec(component(), 0..12),
        vec(component(), 0..12),
    )
        .prop_map(
            |(
                (ra_offset, jaus_offset),
                ra_subsystems,
                jaus_subsystems,
                ra_components,
                jaus_components,
            )| {
                let mut settings = Settings {
                    ra_offset,
                    jaus_offset,
                    ra_subsystems,
                    jaus_subsystems,
                    ..Settings::default()
                };
                if IdTable::new(&settings).is_err() {
                    settings.ra_subsystems.clear();
                    settings.jaus_subsystems.clear();
                }
                // Entries one by one, so that some are valid.
                for entry in ra_components {
                    settings.ra_components.push(entry);
                    if IdTable::new(&settings).is_err() {
                        settings.ra_components.pop();
                    }
                }
                for entry in jaus_components {
                    settings.jaus_components.push(entry);
                    if IdTable::new(&settings).is_err() {
                        settings.jaus_components.pop();
                    }
                }
                let table = IdTable::new(&settings).unwrap();
                (settings, table)
            },
        )
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn no_two_ids_share_a_counterpart_and_each_leads_back((settings, table) in tables()) {
        let again = IdTable::new(&settings).unwrap();
        let mut seen_by_jaus = HashMap::new();
        let mut seen_by_ra = HashMap::new();
        for subsystem in 0..=12_u8 {
            for node in [0, 1, 2, 255] {
                for component in (0..=2).chain(29..=36).chain(63..=65).chain([255]) {
                    for instance in (0..=4).chain(29..=33).chain([97, 191, 254, 255]) {
                        let id = RaId { subsystem, node, component, instance };
                        if let Some(shown) = table.jaus_of(id) {
                            prop_assert!(shown.is_unicast());
                            prop_assert_eq!(seen_by_jaus.insert(shown, id), None);
                            prop_assert_eq!(table.ra_behind(shown), Some(id));
                            prop_assert_eq!(again.jaus_of(id), Some(shown));
                        }
                        let (ours, part) = (JausId::new(subsystem.into(), node, instance), RaComponent(component));
                        if let Some(shown) = table.ra_of(ours, part) {
                            let octets = [shown.subsystem, shown.node, shown.component, shown.instance];
                            prop_assert!(octets.iter().all(|octet| !matches!(octet, 0 | 255)));
                            prop_assert_eq!(shown.component, component);
                            prop_assert_eq!(seen_by_ra.insert(shown, ours), None);
                            prop_assert_eq!(table.jaus_behind(shown), Some(ours));
                            prop_assert_eq!(again.ra_of(ours, part), Some(shown));
                        }
                    }
                }
            }
        }
    }

    #[test]
    fn what_is_behind_an_id_is_shown_by_that_id((_, table) in tables(), id in any::<u32>(), low in any::<u32>()) {
        for id in [id, low & 0x070F_3FFF] {
            let here = JausId::from_u32(id);
            if let Some(there) = table.ra_behind(here) {
                prop_assert_eq!(table.jaus_of(there), Some(here));
            }
            let there = RaId::from(here);
            if let Some(here) = table.jaus_behind(there) {
                prop_assert_eq!(table.ra_of(here, RaComponent(there.component)), Some(there));
            }
        }
    }

    #[test]
    fn counterparts_do_not_depend_on_who_appears_first(mut order in Just((1..=6_u16).collect::<Vec<_>>()).prop_shuffle()) {
        let settings = Settings { ra_offset: 3, jaus_offset: 100, ..Settings::default() };
        let mut table = IdTable::new(&settings).unwrap();
        let fresh = table.clone();
        for number in order.drain(..) {
            let side = if number % 2 == 0 { Side::Ra } else { Side::Jaus };
            if let Ok(shown) = table.claim(side, number) {
                prop_assert_eq!(shown, fresh.subsystem(side, number).ok());
            }
        }
        for component in 1..=63 {
            let id = RaId { subsystem: 2, node: 1, component, instance: 1 };
            prop_assert_eq!(table.jaus_of(id), fresh.jaus_of(id));
        }
    }
}
