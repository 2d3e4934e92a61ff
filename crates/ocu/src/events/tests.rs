//! The log with observations of vehicles that are made up.

use super::*;

const VEHICLE: u16 = 101;

struct Bench {
    log: EventLog,
    now: EventTime,
}

impl Bench {
    fn new() -> Self {
        Self {
            log: EventLog::default(),
            now: EventTime {
                at: Instant::now(),
                since_1970: Duration::from_secs(1_800_000_000),
            },
        }
    }

    fn wait(&mut self, time: Duration) {
        self.now.at += time;
        self.now.since_1970 += time;
    }

    /// Observes these facts 10 s later, so that no rate limits them. Returns the new events.
    fn observe(&mut self, facts: Facts) -> Vec<String> {
        self.wait(Duration::from_secs(10));
        let before = self.log.latest();
        self.log.handle_facts(self.now, VEHICLE, facts);
        self.texts(before)
    }

    fn request(&mut self, user: &str, on: bool) {
        let user = Arc::from(user);
        self.log.handle_request(self.now, &[VEHICLE], &user, on);
    }

    fn texts(&self, after: u64) -> Vec<String> {
        let events = self.log.state(self.now.at, after).events;
        events
            .into_iter()
            .map(|it| format!("{} {}: {}", it.level, it.kind, it.text))
            .collect()
    }
}

#[test]
fn control_and_drives_are_logged_with_who_and_why_they_ended() {
    let mut bench = Bench::new();
    let alice = || Some(("alice".to_owned(), true));
    let held = || Facts {
        holder: alice(),
        ..Facts::default()
    };
    assert_eq!(bench.observe(held()), ["info control: alice has control"]);
    assert!(bench.observe(held()).is_empty());
    let drives = Facts {
        driver: Some("alice".to_owned()),
        ..held()
    };
    assert_eq!(bench.observe(drives), ["info drive: alice drives"]);
    let ended = Facts {
        drive_reason: "no new pose for 1 s".to_owned(),
        ..held()
    };
    let said = ["bad drive: alice has stopped driving: no new pose for 1 s"];
    assert_eq!(bench.observe(ended), said);
    let taken = Facts {
        holder: Some(("43.1.1 (authority 220)".to_owned(), false)),
        handover: "43.1.1 has taken control".to_owned(),
        ..Facts::default()
    };
    let said = [
        "warn control: control of alice ended: 43.1.1 has taken control",
        "info control: 43.1.1 (authority 220) has control",
    ];
    assert_eq!(bench.observe(taken), said);
}

#[test]
fn an_emergency_is_logged_with_who_has_requested_it() {
    let mut bench = Bench::new();
    let stopped = |emergency| Facts {
        emergency,
        ..Facts::default()
    };
    let said = ["bad emergency: emergency reported, not requested at this station"];
    assert_eq!(bench.observe(stopped(true)), said);
    bench.observe(stopped(false));
    let before = bench.log.latest();
    // A page repeats the request until it is confirmed.
    for _ in 0..8 {
        bench.request("alice", true);
        bench.wait(Duration::from_millis(500));
    }
    bench.log.handle_facts(bench.now, VEHICLE, stopped(true));
    let said = [
        "bad emergency: emergency stop requested by alice",
        "bad emergency: emergency reported, requested by alice",
    ];
    assert_eq!(bench.texts(before), said);
    let before = bench.log.latest();
    bench.request("bob", false);
    bench.log.handle_facts(bench.now, VEHICLE, stopped(false));
    let said = [
        "warn emergency: end of the emergency requested by bob",
        "warn emergency: emergency is over, requested by bob",
    ];
    assert_eq!(bench.texts(before), said);
}

#[test]
fn missions_faults_runaways_and_missing_parts_are_logged() {
    let mut bench = Bench::new();
    let id = JausId::new(101, 2, 33);
    let facts = Facts {
        mission: Some((7, "failed")),
        mission_reason: "no path".to_owned(),
        runaway: true,
        missing: [(id, ("Primitive Driver".to_owned(), Absence::Silent))].into(),
        faults: [(
            id,
            "Primitive Driver 101.2.33 reports a failure: line closed".to_owned(),
        )]
        .into(),
        ..Facts::default()
    };
    let said = [
        "bad mission: mission 7: failed: no path",
        "bad missing: Primitive Driver 101.2.33 is silent",
        "bad fault: Primitive Driver 101.2.33 reports a failure: line closed",
        "bad emergency: the vehicle moves although it is in emergency",
    ];
    assert_eq!(bench.observe(facts), said);
    let said = [
        "info missing: Primitive Driver 101.2.33 is not missing any more",
        "info fault: 101.2.33 reports no failure any more",
    ];
    assert_eq!(bench.observe(Facts::default()), said);
}

#[test]
fn holds_and_refused_setpoints_whose_words_change_are_logged_once_in_10_s() {
    let mut bench = Bench::new();
    let before = bench.log.latest();
    for step in 0..100 {
        let facts = Facts {
            hold: (step % 2 == 0).then(|| format!("an obstacle is {step} cm away")),
            drive_reason: format!("the picture is {step} ms old"),
            ..Facts::default()
        };
        bench.log.handle_facts(bench.now, VEHICLE, facts);
        bench.wait(Duration::from_millis(190));
    }
    let texts = bench.texts(before);
    assert_eq!(texts.len(), 4, "{texts:#?}");
}

#[test]
fn a_vehicle_that_flaps_does_not_push_out_the_events_of_the_others() {
    let mut bench = Bench::new();
    let on = |emergency| Facts {
        emergency,
        ..Facts::default()
    };
    bench.log.handle_facts(bench.now, 102, on(true));
    for step in 0..10_000 {
        bench
            .log
            .handle_facts(bench.now, VEHICLE, on(step % 2 == 0));
        bench.wait(Duration::from_millis(50));
    }
    assert!(bench.log.latest() < 600, "{}", bench.log.latest());
    let said = bench.texts(0);
    assert!(said.len() <= EventLog::MOST_SENT);
    assert!(
        said.iter().any(|it| it.contains("came too fast")),
        "{said:?}"
    );
    for _ in 0..EventLog::MOST {
        bench.observe(on(true));
        bench.observe(on(false));
    }
    assert_eq!(bench.log.events.len(), EventLog::MOST);
    assert_eq!(bench.log.events.front().unwrap().vehicle, 102);
}

#[test]
fn a_page_gets_what_is_new_with_its_time_and_its_age() {
    let mut bench = Bench::new();
    let long = "x".repeat(5000);
    let hold = Facts {
        hold: Some(long),
        ..Facts::default()
    };
    bench.observe(hold);
    let first = bench.log.latest();
    bench.wait(Duration::from_secs(3));
    // The clock is set back, and the age does not care.
    bench.now.since_1970 -= Duration::from_secs(3600);
    bench.observe(Facts {
        emergency: true,
        ..Facts::default()
    });
    let all = bench.log.state(bench.now.at, 0);
    assert_eq!((all.latest, all.events.len()), (2, 2));
    assert_eq!(all.events[0].age_ms, 13_000);
    assert_eq!(all.events[0].text.chars().count(), EventLog::MOST_TEXT);
    assert!(
        all.events[0].time.starts_with("2027-01-15T08:00:10"),
        "{}",
        all.events[0].time
    );
    let new = bench.log.state(bench.now.at, first);
    assert_eq!(new.events, all.events[1..]);
}
