//! Tests of the system file and its error messages.

use super::*;

/// Programs that exist on every test system.
fn programs() -> Programs {
    Programs::within(["/bin".into(), "/usr/bin".into()])
}

fn parse(text: &str) -> Result<System, Vec<Mistake>> {
    System::parse(text, Path::new("/etc/jaus"), &programs())
}

fn mistakes(text: &str) -> Vec<String> {
    let mistakes = parse(text).expect_err("a mistake");
    mistakes.iter().map(Mistake::to_string).collect()
}

#[track_caller]
fn only_mistake(text: &str) -> String {
    let mut mistakes = mistakes(text);
    assert_eq!(mistakes.len(), 1, "{mistakes:#?}");
    mistakes.remove(0)
}

#[test]
fn a_part_is_a_program_with_flags_environment_directory_and_restart() {
    let system = parse(
        "[all]\nflags = { loopback = true, port = 0, verbose = true }\n\
         environment = { JAUS_LOG = \"info\" }\n\n\
         [parts.zulu]\nprogram = \"sh\"\narguments = [\"-c\", \"x y\"]\n\
         flags = { peer = [\"a\", \"b\"], port = 3794, verbose = false, speed = 1.5 }\n\
         environment = { JAUS_LOG = \"debug\", TZ = \"UTC\" }\n\
         directory = \"state\"\nrestart = \"never\"\n\n\
         [parts.alpha]\nprogram = \"sh\"\n",
    );
    let system = system.expect("a system");
    let names: Vec<_> = system.parts.iter().map(|part| part.name.as_str()).collect();
    assert_eq!(names, ["zulu", "alpha"], "in the order of the file");
    let zulu = &system.parts[0];
    let flags = [
        "--loopback",
        "--peer=a",
        "--peer=b",
        "--port=3794",
        "--speed=1.5",
    ];
    assert_eq!(zulu.arguments, [&["-c", "x y"][..], &flags].concat());
    assert_eq!(zulu.program, Path::new("/bin/sh"));
    let environment = [("JAUS_LOG", "debug"), ("TZ", "UTC")];
    assert_eq!(
        zulu.environment,
        environment.map(|(name, value)| (name.into(), value.into()))
    );
    assert_eq!(
        zulu.directory.as_deref(),
        Some(Path::new("/etc/jaus/state"))
    );
    assert_eq!(zulu.restart, Restart::Never);
    let alpha = &system.parts[1];
    assert_eq!(alpha.arguments, ["--loopback", "--port=0", "--verbose"]);
    assert_eq!((alpha.restart, &alpha.directory), (Restart::Always, &None));
}

#[test]
fn every_mistake_is_told_at_once_with_its_line_and_the_nearest_key() {
    let text = "[all]\nflag = { loopback = true }\n\n[parts.one]\nprogam = \"sh\"\n\
                restart = \"sometimes\"\n[parts.two]\nprogram = \"sh\"\nflags = { --id = \"1.1.1\" }\n\
                environment = { A = 1 }\n[partz.three]\n";
    let said = mistakes(text);
    for (line, part) in [
        (
            2,
            "there is no setting `all.flag`; did you mean `all.flags`?",
        ),
        (5, "did you mean `parts.one.program`?"),
        (6, "write \"always\", \"on-failure\" or \"never\""),
        (9, "without dashes"),
        (10, "write a string in double quotes"),
        (11, "did you mean `parts`?"),
    ] {
        let told = |it: &String| it.starts_with(&format!("{line}: `")) && it.contains(part);
        assert!(said.iter().any(told), "{line}, {part}: {said:#?}");
    }
}

#[test]
fn a_program_that_is_not_there_is_told_with_where_it_was_looked_for() {
    let said = only_mistake("[parts.planner]\n");
    for part in [
        "1: `[parts.planner]`: ",
        "no program `jaus-planner`",
        "(/bin)",
        "PATH",
    ] {
        assert!(said.contains(part), "{part}: {said}");
    }
    let said = only_mistake("[parts.a]\nprogram = \"./planner\"");
    assert!(said.contains("/etc/jaus/./planner"), "{said}");
    // A file without execute permission is not a program.
    let said = only_mistake("[parts.a]\nprogram = \"/etc/passwd\"");
    assert!(said.contains("/etc/passwd"), "{said}");
}

#[test]
fn two_parts_with_one_id_and_names_that_cannot_be_are_refused() {
    let part = |name: &str, id: &str| {
        format!("[parts.{name}]\nprogram = \"sh\"\nflags = {{ id = \"{id}\" }}\n")
    };
    let twice = part("a", "101.2.33") + &part("b", "101.2.33");
    assert!(only_mistake(&twice).contains("`a` has the id 101.2.33 already"));
    assert!(parse(&(part("a", "101.2.33") + &part("b", "101.2.34"))).is_ok());
    assert!(only_mistake(&part("up", "1.1.1")).contains("choose another"));
    assert!(only_mistake(&part("\"a b\"", "1.1.1")).contains("letters, digits"));
}

#[test]
fn a_file_that_is_no_system_says_what_one_is() {
    for (text, told) in [
        ("", "write a section [parts.NAME]"),
        (
            "parts = 3",
            "1: `parts = 3`: write [parts.NAME] for each part",
        ),
        ("[parts]\na = 1", "2: `a = 1`: write a section [parts.NAME]"),
        ("[parts.a", "1: `[parts.a`: "),
    ] {
        let said = only_mistake(text);
        assert!(said.contains(told), "{text}: {said}");
    }
}

#[test]
fn a_choice_of_parts_keeps_the_order_and_knows_a_slip_of_the_finger() {
    let text = "[parts.planner]\nprogram = \"sh\"\n[parts.tester]\nprogram = \"sh\"\n";
    let only = |names: &[&str]| {
        let names: Vec<String> = names.iter().map(|&name| name.to_owned()).collect();
        parse(text).expect("a system").only(&names)
    };
    assert_eq!(only(&[]).map(|it| it.parts.len()).ok(), Some(2));
    let chosen = only(&["tester"]).expect("a part");
    assert_eq!(chosen.parts[0].name, "tester");
    let said = only(&["planer"]).expect_err("no part").to_string();
    assert!(said.contains("did you mean `planner`?"), "{said}");
}
