//! Tests of the supervisor, in virtual time.

use super::*;

const GRACE: Duration = Duration::from_secs(5);

/// A supervisor with simulated processes and clock.
struct Bench {
    now: Instant,
    supervisor: Supervisor,
}

impl Bench {
    #[expect(
        clippy::disallowed_methods,
        reason = "virtual time starts at any instant"
    )]
    fn new(parts: &[Restart]) -> Self {
        let now = Instant::now();
        Self {
            now,
            supervisor: Supervisor::new(now, parts.iter().copied(), GRACE),
        }
    }

    /// All parts are running.
    fn running(parts: &[Restart]) -> Self {
        let mut bench = Self::new(parts);
        let all: Vec<Order> = (0..parts.len()).map(Order::Start).collect();
        assert_eq!(bench.orders(), all);
        for part in 0..parts.len() {
            bench.supervisor.handle_started(bench.now, part);
        }
        bench
    }

    /// The due orders.
    fn orders(&mut self) -> Vec<Order> {
        self.supervisor.handle_timeout(self.now);
        std::iter::from_fn(|| self.supervisor.poll_order()).collect()
    }

    fn news(&mut self) -> Vec<News> {
        std::iter::from_fn(|| self.supervisor.poll_news()).collect()
    }

    /// Advances time to the next timer.
    fn wait(&mut self) -> Duration {
        let due = self.supervisor.poll_timeout().expect("something is due");
        let waited = due.saturating_duration_since(self.now);
        self.now = due;
        waited
    }

    fn exit(&mut self, part: usize, exit: Exit) {
        self.supervisor.handle_exit(self.now, part, exit);
    }

    /// Starts the part, lets it run and fail; returns the pause that follows.
    fn fails_after(&mut self, ran: Duration) -> Duration {
        assert_eq!(self.orders(), [Order::Start(0)]);
        self.supervisor.handle_started(self.now, 0);
        self.now += ran;
        self.exit(0, Exit::Status(1));
        self.wait()
    }
}

#[test]
fn what_dies_is_started_again_after_ever_longer_pauses_up_to_a_bound() {
    let mut bench = Bench::new(&[Restart::Always]);
    let pauses: Vec<u128> = (0..9)
        .map(|_| bench.fails_after(Duration::from_secs(1)).as_millis())
        .collect();
    let expected = [500, 1000, 2000, 4000, 8000, 16_000, 30_000, 30_000, 30_000];
    assert_eq!(pauses, expected);
}

#[test]
fn a_part_that_has_run_for_a_while_begins_with_the_first_pause_again() {
    let mut bench = Bench::new(&[Restart::Always]);
    for _ in 0..5 {
        bench.fails_after(Duration::from_secs(1));
    }
    assert_eq!(bench.fails_after(SETTLED), FIRST_PAUSE);
    assert_eq!(bench.fails_after(Duration::ZERO), FIRST_PAUSE * 2);
}

#[test]
fn a_part_that_dies_takes_nobody_along() {
    let mut bench = Bench::running(&[Restart::Always; 3]);
    bench.exit(1, Exit::Signal(9));
    assert!(bench.orders().is_empty());
    bench.wait();
    assert_eq!(bench.orders(), [Order::Start(1)]);
}

#[test]
fn a_program_that_cannot_begin_is_given_up_and_the_others_go_on() {
    let mut bench = Bench::running(&[Restart::Always; 2]);
    bench.exit(0, Exit::Status(2));
    assert_eq!(bench.news(), [News::GaveUp { part: 0 }]);
    assert_eq!(bench.supervisor.poll_timeout(), None);
    assert!(!bench.supervisor.is_over() && !bench.supervisor.went_well());
    bench.exit(1, Exit::Status(2));
    assert!(bench.supervisor.is_over());
}

#[test]
fn flags_that_have_worked_are_not_given_up() {
    let mut bench = Bench::running(&[Restart::Always]);
    bench.now += SETTLED;
    bench.exit(0, Exit::Signal(11));
    bench.wait();
    assert_eq!(bench.orders(), [Order::Start(0)]);
    bench.supervisor.handle_started(bench.now, 0);
    bench.exit(0, Exit::Status(2));
    bench.wait();
    assert_eq!(bench.orders(), [Order::Start(0)]);
}

#[test]
fn a_program_that_the_system_does_not_start_is_tried_again() {
    let mut bench = Bench::new(&[Restart::Always]);
    assert_eq!(bench.orders(), [Order::Start(0)]);
    bench.exit(0, Exit::NotStarted);
    assert_eq!(bench.wait(), FIRST_PAUSE);
    assert_eq!(bench.orders(), [Order::Start(0)]);
}

#[test]
fn who_is_not_to_be_restarted_is_not() {
    for (restart, status, ends) in [
        (Restart::Never, 0, true),
        (Restart::Never, 1, true),
        (Restart::OnFailure, 0, true),
        (Restart::OnFailure, 1, false),
        (Restart::Always, 0, false),
    ] {
        let mut bench = Bench::running(&[restart]);
        bench.exit(0, Exit::Status(status));
        assert_eq!(bench.supervisor.is_over(), ends, "{restart:?} {status}");
        if ends {
            assert_eq!(bench.supervisor.went_well(), status == 0);
        }
    }
}

#[test]
fn all_are_stopped_in_reverse_order_each_when_the_next_has_ended() {
    let mut bench = Bench::running(&[Restart::Always; 3]);
    bench.supervisor.stop(bench.now);
    for part in [2, 1, 0] {
        assert_eq!(bench.orders(), [Order::Terminate(part)]);
        assert!(!bench.supervisor.is_over());
        bench.exit(part, Exit::Status(0));
    }
    assert!(bench.orders().is_empty());
    assert!(bench.supervisor.is_over() && bench.supervisor.went_well());
}

#[test]
fn what_does_not_end_is_killed_after_the_grace_and_holds_nobody_up() {
    let mut bench = Bench::running(&[Restart::Always; 2]);
    bench.supervisor.stop(bench.now);
    assert_eq!(bench.orders(), [Order::Terminate(1)]);
    assert_eq!(bench.wait(), GRACE);
    assert_eq!(bench.orders(), [Order::Kill(1), Order::Terminate(0)]);
    assert_eq!(bench.news(), [News::Killed { part: 1 }]);
    bench.exit(0, Exit::Status(0));
    assert!(!bench.supervisor.is_over());
    bench.exit(1, Exit::Signal(9));
    assert!(bench.supervisor.is_over());
}

#[test]
fn a_process_that_cannot_even_be_killed_is_told_of_and_left() {
    let mut bench = Bench::running(&[Restart::Always]);
    bench.supervisor.stop(bench.now);
    for _ in 0..2 {
        bench.orders();
        bench.wait();
    }
    bench.orders();
    let last = bench.news().pop();
    assert_eq!(last, Some(News::Stuck { part: 0 }));
    assert!(bench.supervisor.is_over());
}

#[test]
fn what_waits_to_be_started_again_is_not_started_once_all_is_to_end() {
    let mut bench = Bench::running(&[Restart::Always; 2]);
    bench.exit(1, Exit::Status(1));
    bench.wait();
    bench.supervisor.stop(bench.now);
    assert_eq!(bench.orders(), [Order::Terminate(0)]);
    bench.exit(0, Exit::Status(0));
    assert!(bench.supervisor.is_over() && bench.orders().is_empty());
    // A part that was due at the same moment does not start either.
    let mut bench = Bench::new(&[Restart::Always]);
    bench.supervisor.handle_timeout(bench.now);
    bench.supervisor.stop(bench.now);
    assert!(bench.orders().is_empty() && bench.supervisor.is_over());
}

#[test]
fn the_second_request_kills_all_at_once() {
    let mut bench = Bench::running(&[Restart::Always; 3]);
    bench.supervisor.stop(bench.now);
    assert_eq!(bench.orders(), [Order::Terminate(2)]);
    bench.supervisor.hurry(bench.now);
    assert_eq!(
        bench.orders(),
        [Order::Kill(2), Order::Kill(1), Order::Kill(0)]
    );
    for part in 0..3 {
        bench.exit(part, Exit::Signal(9));
    }
    assert!(bench.supervisor.is_over());
}
