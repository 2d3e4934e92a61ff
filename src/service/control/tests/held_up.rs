//! What a network has held up moves nothing: a client that tells its incarnation shows how old its messages can be.

use std::sync::atomic::Ordering::Relaxed;
use std::time::Duration;

use super::restarts::{NEW, OLD, moving};
use super::*;
use crate::messages::core::{DeleteElement, QueryIncarnation, ReportIncarnation, Resume, Standby};

const fn ms(ms: u64) -> Duration {
    Duration::from_millis(ms)
}

impl Rig {
    /// Lets the time pass in which nothing of the client arrives. Returns the stamps that it got.
    fn stamps_for(&mut self, time: Duration) -> Vec<u32> {
        let end = self.now + time;
        let mut stamps = Vec::new();
        while let Some(wake) = self.stack.poll_timeout().filter(|wake| *wake <= end) {
            self.now = self.now.max(wake);
            self.stack.handle_timeout(self.now);
            while let Some(sent) = self.stack.poll_transmit() {
                let query = QueryIncarnation::decode(&sent.payload);
                stamps.extend(query.map(|it| it.stamp));
            }
        }
        self.now = end;
        stamps
    }

    /// Lets seconds pass in which the client keeps control and echoes each stamp.
    fn go_on_for(&mut self, seconds: u32) {
        for _ in 0..seconds {
            self.answer_for(Duration::from_secs(1), FIRST, OLD);
            self.request(FIRST, 100);
        }
    }

    fn echo(&mut self, stamp: u32) {
        let incarnation = OLD;
        self.hear(FIRST, &ReportIncarnation { incarnation, stamp });
    }
}

#[test]
fn a_setpoint_moves_nothing_when_the_last_echo_is_of_a_second_ago() {
    let (mut rig, commands) = moving();
    let command = DeleteElement::default();
    let moves = |rig: &mut Rig| {
        let before = commands.load(Relaxed);
        rig.hear(FIRST, &command);
        commands.load(Relaxed) > before
    };
    let first = rig.stamps_for(ms(700));
    assert!(first.len() >= 3, "it is asked more often: {first:?}");
    assert!(moves(&mut rig));
    let later = rig.stamps_for(ms(600));
    assert!(!moves(&mut rig));
    // Echoes that are held up as well say that what comes with them is old.
    rig.echo(first[0]);
    assert!(!moves(&mut rig));
    rig.echo(later[0]);
    assert!(moves(&mut rig));
    rig.echo(later[0]);
    rig.stamps_for(ms(600));
    rig.echo(first[1]);
    rig.echo(later[1]);
    assert!(moves(&mut rig));
    rig.stamps_for(ms(500));
    assert!(!moves(&mut rig), "an echo counts once");
}

#[test]
fn what_is_held_up_by_itself_moves_nothing_however_late_it_is_and_stops_all_the_same() {
    for late in [1, 3, 5, 20] {
        let (mut rig, commands) = moving();
        rig.number = Some(500);
        rig.go_on_for(late);
        rig.number = None;
        let before = commands.load(Relaxed);
        rig.hear_numbered(499, &DeleteElement::default());
        assert_eq!(commands.load(Relaxed), before, "{late}");
        rig.hear_numbered(900, &DeleteElement::default());
        assert_eq!(commands.load(Relaxed), before + 1, "{late}");
        rig.hear_numbered(499, &Standby);
        assert_eq!(rig.state(), State::Standby, "{late}");
        rig.hear_numbered(498, &Resume);
        let resumes = late < 5;
        assert_eq!(
            rig.state() == State::Ready,
            resumes,
            "{late}: retransmitted"
        );
    }
}

#[test]
fn a_client_whose_messages_take_another_way_with_a_counter_of_its_own_goes_on() {
    let (mut rig, commands) = moving();
    for first in [500, 100] {
        rig.number = Some(first);
        rig.go_on_for(2);
        let before = commands.load(Relaxed);
        rig.hear(FIRST, &DeleteElement::default());
        assert_eq!(commands.load(Relaxed), before + 1, "{first}");
        rig.go_on_for(8);
    }
}

#[test]
fn a_client_that_has_restarted_must_echo_stamps_of_its_own() {
    let (mut rig, commands) = moving();
    rig.introduce(FIRST, NEW);
    rig.request(FIRST, 100);
    rig.hear(FIRST, &Resume);
    assert_eq!(rig.state(), State::Ready);
    let before = commands.load(Relaxed);
    rig.hear(FIRST, &DeleteElement::default());
    assert_eq!(commands.load(Relaxed), before + 1);
    rig.stamps_for(ms(1200));
    rig.hear(FIRST, &DeleteElement::default());
    assert_eq!(commands.load(Relaxed), before + 1, "it has echoed none");
}
