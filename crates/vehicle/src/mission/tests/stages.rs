//! The mission state machine: stage order, retries, end, and no resumption on its own.

use std::time::{Duration, Instant};

use proptest::prelude::*;

use crate::mission::{
    Action, Destination, Link, LinkState, LostLink, Mission, NotPlanned, Path, Refusal, Run,
    Settings, Stage,
};

pub(super) const SECOND: Duration = Duration::from_secs(1);
pub(super) const SETTINGS: Settings = Settings {
    attempts: 3,
    retries: 2,
    pause: SECOND,
    patience: Duration::from_secs(10),
    settling: SECOND,
    stall: Duration::from_secs(30),
    speed: 1.0,
    detours: 2,
    lost_link: LostLink::Stop,
};

/// A mission in virtual time.
pub(super) struct World {
    pub(super) mission: Mission,
    pub(super) now: Instant,
    actions: Vec<Action>,
}

fn path() -> Path {
    Path::new(vec![(0.0, 0.0), (3.0, 4.0)])
}

fn blocked(reason: &str) -> LinkState {
    LinkState::Blocked(reason.to_owned())
}

fn passing(reason: &str) -> NotPlanned {
    NotPlanned {
        reason: reason.to_owned(),
        hopeless: false,
    }
}

impl World {
    fn new() -> Self {
        Self::with(LostLink::Stop)
    }

    #[expect(
        clippy::disallowed_methods,
        reason = "virtual time starts at any instant"
    )]
    pub(super) fn with(lost_link: LostLink) -> Self {
        Self {
            mission: Mission::new(Settings {
                lost_link,
                ..SETTINGS
            }),
            now: Instant::now(),
            actions: Vec::new(),
        }
    }

    fn under_way(approved: bool) -> Self {
        let mut world = Self::new();
        world.go(approved);
        world
    }

    pub(super) fn go(&mut self, approved: bool) {
        let to = Destination {
            x: 3.0,
            y: 4.0,
            speed: None,
        };
        self.mission.go_to(self.now, to, approved);
    }

    pub(super) fn stage(&self) -> Stage {
        self.mission.report().stage
    }

    pub(super) fn reason(&self) -> &str {
        &self.mission.report().reason
    }

    pub(super) fn run(&self) -> Run {
        self.mission.report().run
    }

    /// Takes all pending actions.
    pub(super) fn take_actions(&mut self) -> Vec<Action> {
        let actions: Vec<_> = std::iter::from_fn(|| self.mission.poll_action()).collect();
        self.actions.extend(actions.iter().cloned());
        actions
    }

    pub(super) fn pass(&mut self, time: Duration) {
        let end = self.now + time;
        while let Some(wake) = self.mission.poll_timeout().filter(|&wake| wake <= end) {
            self.now = self.now.max(wake);
            self.mission.handle_time(self.now);
        }
        self.now = end;
        self.mission.handle_time(end);
    }

    fn link(&mut self, link: Link, state: LinkState) {
        self.mission.handle_link(self.now, link, state);
    }

    pub(super) fn map(&mut self) {
        let run = self.run();
        self.mission.handle_map(self.now, run, Ok(()));
    }

    pub(super) fn plan(&mut self) {
        let run = self.run();
        self.mission.handle_path(self.now, run, Ok(path()));
    }

    pub(super) fn hand_over(&mut self) {
        let run = self.run();
        self.mission.handle_handed_over(self.now, run, Ok(()));
    }

    pub(super) fn set_back(&mut self, reason: &str) {
        let run = self.run();
        self.mission.handle_setback(self.now, run, reason);
    }

    /// Advances to the driving stage.
    pub(super) fn drive(&mut self) {
        self.map();
        self.plan();
        self.hand_over();
        for link in Link::ALL {
            self.link(link, LinkState::Active);
        }
        assert_eq!(self.stage(), Stage::Driving);
        self.take_actions();
    }
}

#[test]
fn each_stage_begins_when_the_one_before_has_succeeded() {
    let mut world = World::under_way(false);
    let run = world.run();
    assert_eq!(world.stage(), Stage::Map);
    assert_eq!(world.take_actions(), [Action::FetchMap(run)]);
    world.map();
    assert_eq!(world.stage(), Stage::Planning);
    let to = world.mission.report().destination;
    assert_eq!(world.take_actions(), [Action::Plan(run, to)]);
    world.plan();
    assert_eq!(world.stage(), Stage::AwaitingApproval);
    assert_eq!(world.take_actions(), []);
    world.mission.approve(world.now, run.mission).unwrap();
    assert_eq!(world.stage(), Stage::Path);
    assert_eq!(
        world.take_actions(),
        [Action::HandOver(run, path().into(), SETTINGS.speed)]
    );
    world.hand_over();
    assert_eq!(world.stage(), Stage::Path);
    world.link(Link::Path, LinkState::Active);
    assert_eq!(world.stage(), Stage::Vector);
    world.link(Link::Vector, LinkState::Active);
    assert_eq!(world.stage(), Stage::Primitive);
    world.link(Link::Primitive, LinkState::Active);
    assert_eq!(world.stage(), Stage::Driving);
    world.mission.handle_progress(world.now, run, 40, 3.0);
    assert_eq!(world.mission.report().progress, 40);
    world.link(Link::Path, LinkState::Done);
    assert_eq!(world.stage(), Stage::Arrived);
    assert_eq!(world.mission.report().progress, 100);
    assert_eq!(
        world.take_actions(),
        [Action::Halt],
        "control is given back"
    );
    assert_eq!(world.mission.poll_timeout(), None);
}

#[test]
fn an_approved_mission_drives_without_waiting() {
    let mut world = World::under_way(true);
    world.map();
    world.plan();
    assert_eq!(world.stage(), Stage::Path);
}

#[test]
fn an_operator_may_take_as_long_as_they_like_to_approve() {
    let mut world = World::under_way(false);
    world.map();
    world.plan();
    world.pass(Duration::from_secs(86_400));
    assert_eq!(world.stage(), Stage::AwaitingApproval);
}

#[test]
fn what_drivers_said_before_the_path_was_handed_over_does_not_count() {
    let mut world = World::under_way(true);
    world.link(Link::Path, LinkState::Done);
    world.map();
    world.plan();
    assert_eq!(world.stage(), Stage::Path);
    world.link(Link::Path, blocked("old"));
    world.hand_over();
    assert_eq!(world.stage(), Stage::Path);
    world.pass(SECOND * 2);
    assert_eq!(world.stage(), Stage::Path);
}

#[test]
fn a_blocked_stage_is_tried_again_from_the_start_as_often_as_the_setting_says() {
    let mut world = World::under_way(true);
    for attempt in 1..=3 {
        assert_eq!(world.run().attempt, attempt);
        world.drive();
        world.link(Link::Vector, blocked("no pose"));
        assert_eq!(world.stage(), Stage::Driving, "it may settle");
        world.pass(SECOND);
        assert_eq!(world.take_actions(), [Action::Halt]);
        assert_eq!(world.reason(), "the vector driver: no pose");
        if attempt < 3 {
            assert_eq!(world.stage(), Stage::Map);
            world.pass(SECOND);
            let run = world.run();
            assert_eq!(world.take_actions(), [Action::FetchMap(run)]);
        }
    }
    assert_eq!(world.stage(), Stage::Waiting);
    world.pass(SECOND * 1000);
    assert_eq!(world.take_actions(), []);
}

/// A mission with the default settings, which drives.
fn by_default() -> World {
    let mut world = World::under_way(true);
    world.mission = Mission::new(Settings::default());
    world.go(true);
    world.drive();
    world
}

#[test]
fn a_mission_that_a_fault_has_stopped_moves_again_only_when_it_is_continued() {
    let mut world = by_default();
    world.set_back("the pose is 0.8 s old");
    assert_eq!(world.stage(), Stage::Waiting);
    assert_eq!(world.reason(), "the pose is 0.8 s old");
    assert_eq!(world.take_actions(), [Action::Halt]);
    for link in Link::ALL {
        world.link(link, LinkState::Active);
    }
    world.pass(SECOND * 86_400);
    let refusal = world.mission.approve(world.now, 1);
    assert_eq!(refusal, Err(Refusal::Waiting { mission: 1 }));
    assert_eq!(world.take_actions(), []);
    world.mission.resume(world.now, 1).unwrap();
    let run = world.run();
    assert_eq!(world.take_actions(), [Action::FetchMap(run)]);
    world.drive();
    assert_eq!(world.reason(), "", "it drives well");
    assert!(world.mission.resume(world.now, 1).is_err(), "once");
}

#[test]
fn a_continued_mission_that_finds_no_path_waits_again() {
    let mut world = by_default();
    world.set_back("no pose");
    world.mission.resume(world.now, 1).unwrap();
    let run = world.run();
    let why = Err("no store".to_owned());
    world.mission.handle_map(world.now, run, why);
    assert_eq!(
        (world.stage(), world.reason()),
        (Stage::Waiting, "no store")
    );
    world.pass(SECOND * 1000);
    assert_eq!(world.stage(), Stage::Waiting);
}

#[test]
fn the_reason_of_an_attempt_that_failed_is_not_told_of_one_that_drives_well() {
    let mut world = World::under_way(true);
    world.drive();
    world.set_back("no control of 101.3.48");
    assert_eq!(world.reason(), "no control of 101.3.48");
    world.pass(SECOND);
    world.drive();
    assert_eq!((world.stage(), world.reason()), (Stage::Driving, ""));
}

#[test]
fn a_mission_that_waits_can_be_stopped_and_replaced() {
    let mut world = by_default();
    world.set_back("no pose");
    world.mission.stop("enough");
    assert_eq!(world.stage(), Stage::Stopped);
    assert!(world.mission.resume(world.now, 1).is_err());
    world.go(true);
    world.drive();
}

#[test]
fn a_mission_that_waits_keeps_its_first_reason_and_its_attempt() {
    let mut world = by_default();
    world.set_back("no pose");
    let run = world.run();
    world.mission.handle_setback(world.now, run, "later");
    world.pass(60 * SECOND);
    assert_eq!((world.stage(), world.reason()), (Stage::Waiting, "no pose"));
    assert_eq!(world.run(), run);
}

#[test]
fn a_stage_that_is_blocked_for_a_moment_only_goes_on() {
    let mut world = World::under_way(true);
    world.drive();
    world.link(Link::Vector, blocked("no pose"));
    world.pass(SECOND / 2);
    world.link(Link::Vector, LinkState::Active);
    world.pass(SECOND * 2);
    assert_eq!((world.stage(), world.run().attempt), (Stage::Driving, 1));
}

#[test]
fn without_map_and_without_path_it_is_tried_again_but_not_without_hope() {
    let mut world = World::under_way(true);
    let run = world.run();
    world
        .mission
        .handle_map(world.now, run, Err("no store".to_owned()));
    assert_eq!((world.stage(), world.reason()), (Stage::Map, "no store"));
    world.pass(SECOND);
    world.map();
    let run = world.run();
    assert_eq!(run.attempt, 2);
    world
        .mission
        .handle_path(world.now, run, Err(passing("no way")));
    world.pass(SECOND);
    world.map();
    let run = world.run();
    assert_eq!(run.attempt, 3);
    let hopeless = NotPlanned {
        hopeless: true,
        ..passing("not on the map")
    };
    world.mission.handle_path(world.now, run, Err(hopeless));
    assert_eq!(
        (world.stage(), world.reason()),
        (Stage::Failed, "not on the map")
    );
}

#[test]
fn a_stage_that_does_not_end_is_blocked() {
    for approved_steps in 0..3 {
        let mut world = World::under_way(true);
        if approved_steps > 0 {
            world.map();
        }
        if approved_steps > 1 {
            world.plan();
        }
        world.pass(SETTINGS.patience);
        assert_eq!(world.run().attempt, 2, "{approved_steps}");
        assert!(world.reason().ends_with("took longer than 10 s"));
    }
}

#[test]
fn a_driver_that_is_not_heard_is_blocked() {
    let mut world = World::under_way(true);
    world.map();
    world.plan();
    world.hand_over();
    world.link(Link::Path, LinkState::Active);
    world.pass(SETTINGS.patience);
    assert_eq!(world.run().attempt, 2);
    assert_eq!(
        world.reason(),
        "the vector driver has not reported for 10 s"
    );
}

#[test]
fn a_vehicle_that_does_not_get_on_is_blocked() {
    let mut world = World::under_way(true);
    world.drive();
    world.pass(SECOND * 29);
    let run = world.run();
    world.mission.handle_progress(world.now, run, 10, 4.5);
    world.pass(SECOND * 29);
    assert_eq!(world.stage(), Stage::Driving);
    world.pass(SECOND);
    assert_eq!(world.run().attempt, 2);
    assert!(world.reason().contains("made no progress for 30 s at 10 %"));
}

#[test]
fn the_operator_ends_it_at_any_stage() {
    for steps in 0..5 {
        let mut world = World::under_way(true);
        let run = world.run();
        match steps {
            0 => {}
            1 => world.map(),
            2 => world.drive(),
            3 => world.set_back("blocked"),
            _ => {
                world.map();
                world.plan();
            }
        }
        world.take_actions();
        world.mission.stop("42.1.1 has taken over");
        assert_eq!(world.stage(), Stage::Stopped, "{steps}");
        assert_eq!(world.reason(), "42.1.1 has taken over");
        world.mission.handle_map(world.now, run, Ok(()));
        world.mission.handle_path(world.now, run, Ok(path()));
        world.hand_over();
        for link in Link::ALL {
            world.link(link, LinkState::Active);
        }
        world.pass(SECOND * 1000);
        assert_eq!(world.stage(), Stage::Stopped);
        assert!(
            world.take_actions().iter().all(|it| *it == Action::Halt),
            "{steps}"
        );
    }
}

#[test]
fn another_destination_replaces_the_mission() {
    let mut world = World::under_way(true);
    world.drive();
    let old = world.run();
    let to = Destination::default();
    assert_eq!(world.mission.go_to(world.now, to, false), 2);
    let new = world.run();
    assert_eq!(world.take_actions(), [Action::Halt, Action::FetchMap(new)]);
    world.mission.handle_map(world.now, old, Ok(()));
    assert_eq!(world.stage(), Stage::Map, "of the old one");
    let refusal = world.mission.approve(world.now, old.mission);
    assert_eq!(
        refusal,
        Err(Refusal::Replaced {
            wanted: 1,
            current: 2
        })
    );
}

#[test]
fn what_is_no_destination_fails_with_what_would_do() {
    for (x, speed, says) in [
        (f64::NAN, None, "north NaN m, east 0 m is invalid"),
        (f64::INFINITY, None, "set finite numbers"),
        (
            0.0,
            Some(0.0),
            "a speed of 0 m/s is out of range: set one above 0 and up to 100 m/s",
        ),
        (0.0, Some(f64::NAN), "a speed of NaN m/s"),
    ] {
        let mut world = World::under_way(true);
        world.drive();
        world
            .mission
            .go_to(world.now, Destination { x, y: 0.0, speed }, true);
        assert_eq!(world.stage(), Stage::Failed);
        assert!(world.reason().contains(says), "{}", world.reason());
        assert_eq!(world.take_actions(), [Action::Halt]);
    }
}

#[test]
fn what_is_over_cannot_be_approved() {
    let mut world = World::under_way(false);
    world.mission.stop("enough");
    let refusal = world.mission.approve(world.now, 1).unwrap_err();
    assert_eq!(refusal.to_string(), "mission 1 is over (stopped)");
}

/// Any possible event.
#[derive(Debug, Clone)]
enum Event {
    GoTo(bool),
    Approve,
    Stop,
    Map(bool),
    Path(bool, bool),
    HandedOver(bool),
    Link(usize, u8),
    Progress(u8),
    Setback,
    Continue,
    Late,
    Pass(u64),
}

fn event() -> impl Strategy<Value = Event> {
    prop_oneof![
        1 => any::<bool>().prop_map(Event::GoTo),
        2 => Just(Event::Approve),
        1 => Just(Event::Stop),
        4 => any::<bool>().prop_map(Event::Map),
        4 => any::<(bool, bool)>().prop_map(|(good, hope)| Event::Path(good, hope)),
        4 => any::<bool>().prop_map(Event::HandedOver),
        12 => (0..3_usize, 0..6_u8).prop_map(|(link, state)| Event::Link(link, state)),
        2 => any::<u8>().prop_map(Event::Progress),
        1 => Just(Event::Setback),
        2 => Just(Event::Continue),
        2 => Just(Event::Late),
        4 => (0..20_000_u64).prop_map(Event::Pass),
    ]
}

impl World {
    fn happen(&mut self, event: &Event) {
        let (now, run) = (self.now, self.run());
        let mission = &mut self.mission;
        let result = |good: bool| if good { Ok(()) } else { Err("bad".to_owned()) };
        match *event {
            Event::GoTo(approved) => _ = mission.go_to(now, Destination::default(), approved),
            Event::Approve => _ = mission.approve(now, run.mission),
            Event::Stop => mission.stop("enough"),
            Event::Map(good) => mission.handle_map(now, run, result(good)),
            Event::Path(true, _) => mission.handle_path(now, run, Ok(path())),
            Event::Path(false, hopeless) => {
                let why = NotPlanned {
                    hopeless,
                    ..passing("no way")
                };
                mission.handle_path(now, run, Err(why));
            }
            Event::HandedOver(good) => mission.handle_handed_over(now, run, result(good)),
            Event::Link(link, state) => {
                let state = match state {
                    0 => LinkState::Silent,
                    1 => LinkState::Idle,
                    2 => LinkState::Engaging,
                    3 => LinkState::Active,
                    4 => blocked("stuck"),
                    _ => LinkState::Done,
                };
                mission.handle_link(now, Link::ALL[link], state);
            }
            Event::Progress(progress) => mission.handle_progress(now, run, progress, 1.0),
            Event::Setback => mission.handle_setback(now, run, "gone"),
            Event::Continue => _ = mission.resume(now, run.mission),
            Event::Late => {
                let late = Run {
                    attempt: run.attempt.wrapping_sub(1),
                    ..run
                };
                mission.handle_map(now, late, Ok(()));
                mission.handle_path(now, late, Ok(path()));
                mission.handle_handed_over(now, late, Ok(()));
            }
            Event::Pass(time) => self.pass(Duration::from_millis(time)),
        }
    }
}

proptest! {
    #[test]
    fn whatever_happens_it_keeps_the_order_and_ends(events in prop::collection::vec(event(), 1..200)) {
        let mut world = World::new();
        // Whether the drivers may be driving, according to the actions so far.
        let mut driving = false;
        for event in &events {
            let before = world.mission.report().clone();
            world.happen(event);
            let after = world.mission.report().clone();
            let actions = world.take_actions();
            prop_assert!(after.run.attempt <= after.attempts);
            if before.stage == Stage::Waiting && after.stage != Stage::Waiting {
                let is_told = matches!(event, Event::Continue | Event::GoTo(_) | Event::Stop);
                prop_assert!(is_told, "it waits: {:?}", event);
            }
            prop_assert!(after.progress <= 100);
            let is_new = matches!(event, Event::GoTo(_));
            prop_assert!(is_new || before.run.mission == after.run.mission);
            if !before.stage.is_under_way() && !is_new {
                prop_assert_eq!(&before, &after, "what is over stays over: {:?}", event);
                prop_assert!(actions.is_empty(), "{:?}", actions);
            }
            if after.run == before.run && after.stage > before.stage && after.stage < Stage::Arrived
                && !matches!(event, Event::Link(..) | Event::Path(..) | Event::Pass(_))
            {
                prop_assert_eq!(after.stage as u8, before.stage as u8 + 1);
            }
            for action in &actions {
                match action {
                    Action::Halt => driving = false,
                    Action::HandOver(..) => {
                        prop_assert!(!driving, "halted before it is handed over again");
                        driving = true;
                    }
                    _ => {}
                }
            }
            prop_assert!(!driving || after.stage.is_handed_over(), "{:?}", after);
        }
        // Without further events, the mission ends or waits for the operator.
        world.pass(Duration::from_secs(600));
        let stage = world.stage();
        prop_assert!(!stage.is_under_way() || stage == Stage::AwaitingApproval || stage == Stage::Waiting
            || world.mission.poll_timeout().is_some() || stage == Stage::Idle);
        prop_assert_ne!(stage, Stage::Map);
    }
}
