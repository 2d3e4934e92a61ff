//! `jaus up` with real processes: our own nodes, and misbehaving shell scripts.

use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdout, Command, Stdio};

use crate::support::{Run, jaus, own_group, run};
use jaus_test_kit::waiting::block_until;
use serde_json::Value as Json;

/// A test's own directory, removed when dropped.
struct Folder(PathBuf);

impl Folder {
    fn new(test: &str) -> Self {
        let name = format!("jaus-up-{}-{test}", std::process::id());
        let folder = std::env::temp_dir().join(name);
        std::fs::create_dir_all(&folder).unwrap();
        Self(folder)
    }

    /// Writes a system file.
    fn system(&self, text: &str) -> String {
        let path = self.0.join("system.toml");
        std::fs::write(&path, text).unwrap();
        path.to_str().unwrap().to_owned()
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        // Nothing depends on it.
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

/// A part that runs a shell script.
fn shell(name: &str, script: &str, besides: &str) -> String {
    format!("[parts.{name}]\nprogram = \"sh\"\narguments = [\"-c\", '''{script}''']\n{besides}\n")
}

/// A running `jaus up`; killed when dropped.
struct System {
    process: Child,
    output: BufReader<ChildStdout>,
    seen: String,
}

impl System {
    fn start(file: &str, flags: &[&str]) -> Self {
        let mut process = jaus()
            .args(["up", file, "--for", "60s"])
            .args(flags)
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        Self {
            output: BufReader::new(process.stdout.take().unwrap()),
            process,
            seen: String::new(),
        }
    }

    /// Reads up to a line that contains `wanted`, and returns that line.
    #[track_caller]
    fn expect(&mut self, wanted: &str) -> String {
        loop {
            let mut line = String::new();
            let length = self.output.read_line(&mut line).unwrap();
            assert_ne!(length, 0, "no {wanted:?} in\n{}", self.seen);
            self.seen.push_str(&line);
            if line.contains(wanted) {
                return line;
            }
        }
    }

    /// The process id that a part has printed after a word.
    #[track_caller]
    fn number(&mut self, word: &str) -> u32 {
        let line = self.expect(word);
        let (_, number) = line.split_once(word).unwrap();
        number.trim().parse().unwrap()
    }

    fn signal(&self, signal: &str) {
        let pid = self.process.id().to_string();
        let sent = Command::new("kill").args([signal, &pid]).status();
        assert!(sent.unwrap().success());
    }

    /// Its remaining output, and its exit status.
    fn end(mut self) -> (String, Option<i32>) {
        while self.output.read_line(&mut self.seen).unwrap() > 0 {}
        let status = self.process.wait().unwrap();
        (std::mem::take(&mut self.seen), status.code())
    }
}

impl Drop for System {
    fn drop(&mut self) {
        // It may have ended by itself.
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

/// Waits until a process has ended, though its parent may not have reaped it.
fn wait_for_end(process: u32) {
    block_until(|| {
        let stat = std::fs::read_to_string(format!("/proc/{process}/stat"));
        let state = stat
            .ok()
            .and_then(|it| it.rsplit(") ").next()?.chars().next());
        state.is_none_or(|state| state == 'Z')
    });
}

#[test]
fn parts_find_each_other_and_one_that_is_killed_is_started_again() {
    let folder = Folder::new("nodes");
    let group = own_group();
    let file = folder.system(&format!(
        "[all]\nflags = {{ loopback = true, port = 0, group = \"{}\" }}\n\
         [parts.first]\nprogram = \"jaus\"\narguments = [\"node\"]\nflags = {{ id = \"101.1.1\" }}\n\
         [parts.second]\nprogram = \"jaus\"\narguments = [\"node\"]\nflags = {{ id = \"102.1.1\" }}\n",
        group[4]
    ));
    let status = folder.0.join("status.json");
    let mut system = System::start(&file, &["--status", status.to_str().unwrap()]);
    let found = system.expect("101.1.1");
    assert!(
        found.starts_with("first  | ") || found.starts_with("second | "),
        "{found}"
    );
    system.expect("Press Ctrl-C to end");

    let second = &read_status(&status)["parts"][1];
    assert_eq!(
        (&second["name"], &second["starts"]),
        (&Json::from("second"), &Json::from(1))
    );
    let process = second["process"].to_string();
    assert!(
        Command::new("kill")
            .args(["-9", &process])
            .status()
            .unwrap()
            .success()
    );
    let told = system.expect("second ended after");
    assert!(
        told.contains("SIGKILL") && told.contains("restarts in 0.5 s"),
        "{told}"
    );
    system.expect("second | on lo");
    let second = &read_status(&status)["parts"][1];
    assert_eq!(
        (&second["state"], &second["starts"]),
        (&Json::from("running"), &Json::from(2))
    );

    system.signal("-TERM");
    let (output, code) = system.end();
    assert!(output.contains("up     | all parts have ended"), "{output}");
    assert_eq!(code, Some(0), "{output}");
    assert_eq!(read_status(&status)["parts"][1]["state"], "stopped");
}

fn read_status(path: &Path) -> Json {
    serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap()
}

#[test]
fn wrong_flags_are_given_up_and_the_others_go_on() {
    let folder = Folder::new("flags");
    let wrong = "[parts.wrong]\nprogram = \"jaus\"\narguments = [\"node\"]\nflags = { prot = 1 }\n";
    let file = folder.system(&(wrong.to_owned() + &shell("right", "echo here; exec sleep 60", "")));
    let mut system = System::start(&file, &[]);
    system.expect("wrong cannot start (status 2)");
    assert!(
        system
            .seen
            .contains("wrong | error: unexpected argument '--prot'"),
        "{}",
        system.seen
    );
    if !system.seen.contains("right | here") {
        system.expect("right | here");
    }
    system.signal("-INT");
    let (output, code) = system.end();
    assert_eq!(code, Some(1), "{output}");
    assert!(!output.contains("and restarts in"), "{output}");
}

#[test]
fn parts_end_in_reverse_order_with_what_they_have_started_and_who_will_not_is_killed() {
    let folder = Folder::new("order");
    let polite = |name: &str| {
        let script = "trap 'echo leaves; exit 0' TERM; echo stays; while :; do sleep 0.05; done";
        shell(name, script, "")
    };
    let deaf = "trap '' TERM; sleep 300 & echo child $!; while :; do sleep 0.05; done";
    let file = folder.system(&(polite("one") + &shell("two", deaf, "") + &polite("three")));
    let mut system = System::start(&file, &["--grace", "500ms"]);
    let mut child = None;
    let mut stay = 0;
    while child.is_none() || stay < 2 {
        let line = system.expect(" | ");
        stay += usize::from(line.contains("stays"));
        if let Some((_, number)) = line.split_once("child ") {
            child = Some(number.trim().parse::<u32>().unwrap());
        }
    }
    system.signal("-TERM");
    let (output, code) = system.end();
    let place = |text: &str| {
        output
            .find(text)
            .unwrap_or_else(|| panic!("{text}: {output}"))
    };
    assert!(place("three | leaves") < place("two did not end within 0.5 s and is killed"));
    assert!(place("two did not end") < place("one   | leaves"));
    assert_eq!(code, Some(0), "{output}");
    wait_for_end(child.unwrap());
}

#[test]
fn nothing_survives_when_jaus_up_itself_is_killed() {
    let folder = Folder::new("orphans");
    let deaf = "trap '' TERM; sleep 300 & echo left $!; echo deaf $$; while :; do sleep 0.05; done";
    let file = folder
        .system(&(shell("deaf", deaf, "") + &shell("plain", "echo plain $$; exec sleep 300", "")));
    let mut system = System::start(&file, &["--grace", "500ms"]);
    let mut processes = Vec::new();
    while processes.len() < 3 {
        let line = system.expect("| ");
        let words: Vec<_> = line.trim().rsplit(' ').collect();
        if let (Ok(number), true) = (
            words[0].parse(),
            ["left", "deaf", "plain"].contains(&words[1]),
        ) {
            processes.push(number);
        }
    }
    system.signal("-KILL");
    for process in processes {
        wait_for_end(process);
    }
}

#[test]
fn a_warden_that_is_killed_is_replaced() {
    let folder = Folder::new("warden");
    let file = folder.system(&shell(
        "part",
        "trap '' TERM; sleep 300 & echo left $!; wait",
        "",
    ));
    let mut system = System::start(&file, &["--grace", "500ms"]);
    let left = system.number("left ");
    let warden = |system: &System| {
        let parent = system.process.id().to_string();
        let found = Command::new("pgrep")
            .args(["-P", &parent, "-f", "up-warden"])
            .output();
        String::from_utf8(found.unwrap().stdout)
            .unwrap()
            .trim()
            .to_owned()
    };
    let first = warden(&system);
    assert!(
        Command::new("kill")
            .args(["-9", &first])
            .status()
            .unwrap()
            .success()
    );
    block_until(|| ![&first, ""].contains(&warden(&system).as_str()));
    system.signal("-KILL");
    wait_for_end(left);
}

#[test]
fn a_part_that_may_end_does_and_then_all_is_over() {
    let folder = Folder::new("once");
    let once = shell("good", "printf 'no end'; exit 0", "restart = \"never\"");
    let (output, code) = System::start(&folder.system(&once), &[]).end();
    assert!(
        output.contains("good | no end") && output.contains("no part is left"),
        "{output}"
    );
    assert_eq!(code, Some(0));
    let bad = once + &shell("bad", "exit 3", "restart = \"never\"");
    let (output, code) = System::start(&folder.system(&bad), &[]).end();
    assert!(output.contains("bad has ended (status 3)"), "{output}");
    assert_eq!(code, Some(1));
}

#[test]
fn a_part_runs_where_and_with_what_the_file_says_and_drives_no_terminal() {
    let folder = Folder::new("where");
    let script =
        r#"echo "$PWD $COLOUR $0 $1"; printf '\033[2Jx\r\n'; head -c 10000 /dev/zero | tr '\0' y"#;
    let besides = "directory = \"a/b\"\nenvironment = { COLOUR = \"blue green\" }\n\
                   restart = \"never\"\nflags = { name = \"it's me\", speed = 2 }";
    let file = folder.system(&shell("part", script, besides));
    let checked = run(&["up", &file, "--check"], b"");
    assert_eq!(checked.status, 0, "{checked:?}");
    for part in [
        "'--name=it'\\''s me' --speed=2",
        "a/b\n",
        "with COLOUR=blue green",
        "1 part, no errors",
    ] {
        assert!(checked.stdout.contains(part), "{part}: {}", checked.stdout);
    }
    assert!(!folder.0.join("a").exists(), "--check makes nothing");
    let (output, _) = System::start(&file, &[]).end();
    let place = format!(
        "{}/a/b blue green --name=it's me --speed=2\n",
        folder.0.display()
    );
    assert!(output.contains(&place), "{output}");
    assert!(output.contains("part | \\u{1b}[2Jx\n"), "{output:?}");
    assert!(
        output.lines().all(|line| line.len() < 4200),
        "a long line is broken"
    );
}

#[test]
fn what_is_wrong_is_told_before_anything_starts() {
    let folder = Folder::new("wrong");
    let file = folder.system("[parts.a]\nprogam = \"sh\"\n[parts.b]\nprogram = \"jaus-nothing\"\n");
    let told = |flags: &[&str]| -> Run { run(&[&["up", file.as_str()][..], flags].concat(), b"") };
    for flags in [&[][..], &["--check"]] {
        let run = told(flags);
        assert!(run.status == 2 && run.stdout.is_empty(), "{run:?}");
        for part in [
            &format!("jaus: {file}:2: `progam = \"sh\"`: there is no setting `parts.a.progam`"),
            "did you mean `parts.a.program`?",
            &format!("jaus: {file}:4: "),
            "there is no program `jaus-nothing`, neither in the directory of jaus",
        ] {
            assert!(run.stderr.contains(part), "{part}: {}", run.stderr);
        }
    }
    folder.system("# Two.\n[parts.a]\nprogram = \"sh\"\n[parts.b]\nprogram = \"jaus\"\narguments = [\"node\"]\nflags = { prot = 1 }\n");
    let flag = told(&["--check"]);
    let wrong = format!("jaus: {file}:4: [parts.b]: unexpected argument '--prot' found; tip: ");
    assert!(flag.status == 2 && flag.stderr.contains(&wrong), "{flag:?}");
    let missing = run(&["up", "/no/such.toml"], b"");
    assert!(
        missing.status == 2 && missing.stderr.contains("/no/such.toml: "),
        "{missing:?}"
    );
    folder.system(&shell("planner", "exit 0", ""));
    let unknown = told(&["--only", "planer"]);
    assert!(
        unknown.status == 2 && unknown.stderr.contains("did you mean `planner`?"),
        "{unknown:?}"
    );
}

#[test]
fn a_reader_that_leaves_ends_the_system() {
    let folder = Folder::new("reader");
    let script = "echo part $$; while :; do echo again; sleep 0.05; done";
    let file = folder.system(&shell("part", script, ""));
    let mut system = System::start(&file, &[]);
    let part = system.number("part | part ");
    drop(std::mem::replace(&mut system.output, {
        let mut other = Command::new("true").stdout(Stdio::piped()).spawn().unwrap();
        let output = BufReader::new(other.stdout.take().unwrap());
        other.wait().unwrap();
        output
    }));
    wait_for_end(part);
    let (_, code) = system.end();
    assert_eq!(code, Some(0));
}
