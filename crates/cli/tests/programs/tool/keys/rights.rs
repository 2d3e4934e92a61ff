//! `jaus keys explain`, and messages of one's own over a secure link.

use jaus_test_kit::tools::workspace;

use super::Host;

/// A host that trusts the key of a console with these rules.
fn host(rules: &[&str]) -> Host {
    let host = Host::new();
    let key = Host::new().new_key();
    let trusted = host.keys(&[&["trust", "console", &key, "60.1.255"], rules].concat());
    assert_eq!(trusted.status, 0, "{trusted:?}");
    host
}

/// What is printed of a message.
fn line<'o>(output: &'o str, name: &str) -> &'o str {
    let mut lines = output.lines();
    let line = lines.find(|it| it.split_whitespace().nth(1) == Some(name));
    line.unwrap_or_else(|| panic!("{name} in {output}"))
}

#[test]
fn what_a_key_may_send_is_explained_message_by_message() {
    let host = host(&["control=127", "except=SetTime"]);
    let all = host.keys(&["explain", "console"]);
    assert_eq!((all.status, &*all.stderr), (0, ""), "{all:?}");
    assert!(all.stdout.lines().count() > 450, "the whole catalogue");
    for (name, needs, may) in [
        ("QueryIdentification", "observe", "yes"),
        ("SetTravelSpeed", "command", "yes"),
        ("SetPlatformMode", "command", "yes"),
        (
            "RequestControl",
            "control",
            "yes, with an authority up to 127",
        ),
        (
            "RequestHandoff",
            "control",
            "yes, with an authority up to 127",
        ),
        ("SetEmergency", "emergency", "yes"),
        (
            "ClearEmergency",
            "clear-emergency",
            "no: its sender may not clear emergencies",
        ),
        ("Shutdown", "configure", "no: its sender may not shut down"),
        ("SetTime", "configure", "no: "),
    ] {
        let line = line(&all.stdout, name);
        let words: Vec<_> = line.split_whitespace().collect();
        assert_eq!(words[2], needs, "{line}");
        assert!(words[3..].join(" ").starts_with(may), "{line}");
    }

    let some = host.keys(&["explain", "console", "PrimitiveDriver", "D1ABh", "--json"]);
    let lines: Vec<serde_json::Value> = some
        .stdout
        .lines()
        .map(|it| serde_json::from_str(it).unwrap())
        .collect();
    let wrench = lines
        .iter()
        .find(|it| it["name"] == "SetWrenchEffort")
        .unwrap();
    assert_eq!(
        (&wrench["code"], &wrench["may"]),
        (&"0405".into(), &true.into())
    );
    let unknown = lines.iter().find(|it| it["code"] == "D1AB").unwrap();
    assert_eq!(
        (&unknown["needs"], &unknown["may"]),
        (&"also".into(), &false.into())
    );
    assert!(
        unknown["why"].as_str().unwrap().contains("no definition"),
        "{unknown}"
    );

    let nobody = host.keys(&["explain", "nobody"]);
    assert_eq!(nobody.status, 1, "{nobody:?}");
    assert!(nobody.stderr.contains("jaus keys list"), "{nobody:?}");
    let wrong = host.keys(&["explain", "console", "SetTravelSped"]);
    assert_eq!(wrong.status, 2, "{wrong:?}");
}

#[test]
fn a_definition_of_ones_own_says_what_its_messages_need_or_is_refused() {
    let host = host(&["command"]);
    let services = workspace("examples/own-service/services");
    let explain = |path: &str| host.keys(&["explain", "console", "D000h", "--jsidl", path]);
    let lamp = explain(services.to_str().unwrap());
    assert_eq!(
        line(&lamp.stdout, "SetLamp").split_whitespace().last(),
        Some("yes"),
        "{lamp:?}"
    );

    // The same definition without its attribute.
    let folder = tempfile::tempdir().unwrap();
    for file in ["Lamp.xml", "LampMessages.xml"] {
        let text = std::fs::read_to_string(services.join(file)).unwrap();
        let text = text.replace(" own:permission=\"command\"", "");
        std::fs::write(folder.path().join(file), text).unwrap();
    }
    let lamp = explain(folder.path().to_str().unwrap());
    assert_eq!(lamp.status, 2, "{lamp:?}");
    assert!(
        lamp.stderr
            .contains("`SetLamp` does not state what its sender needs"),
        "{lamp:?}"
    );
}
