//! Clients that restart, faster than any silence limit.

use std::sync::atomic::{AtomicU32, Ordering::Relaxed};
use std::sync::{Arc, Mutex};
use std::time::Instant;

use super::*;
use crate::codec::ServiceId;
use crate::endpoint::{Outgoing, Received};
use crate::service::life::Life;
use crate::service::stack_rig::US;
use crate::service::{
    Context, Discovery, Handled, Handlers, Kind, Profile, Scope, Service, StopCause, Timing,
};

/// The numbers of two starts of a client.
pub(super) const OLD: u64 = 7;
pub(super) const NEW: u64 = 8;

impl Rig {
    /// The client tells its incarnation, as it does before it requests control.
    pub(super) fn introduce(&mut self, client: JausId, incarnation: u64) -> Vec<Sent> {
        let query = QueryIncarnation {
            sender_incarnation: incarnation,
            stamp: 0,
        };
        self.hear(client, &query)
    }

    /// Handles a message of `FIRST` with this number.
    pub(super) fn hear_numbered<M: Message>(&mut self, number: u16, message: &M) {
        self.number = Some(number);
        self.hear(FIRST, message);
        self.number = None;
    }

    /// Lets the time pass; whenever the client is asked for its incarnation, it answers. Returns
    /// after which time it was asked.
    pub(super) fn answer_for(
        &mut self,
        time: Duration,
        client: JausId,
        incarnation: u64,
    ) -> Vec<Duration> {
        let (start, end) = (self.now, self.now + time);
        let mut asked = Vec::new();
        while let Some(wake) = self.stack.poll_timeout().filter(|wake| *wake <= end) {
            self.now = self.now.max(wake);
            self.stack.handle_timeout(self.now);
            let sent: Vec<Outgoing> = std::iter::from_fn(|| self.stack.poll_transmit()).collect();
            for message in sent.iter().filter(|it| it.destination == client) {
                if let Ok(query) = QueryIncarnation::decode(&message.payload) {
                    asked.push(self.now - start);
                    let stamp = query.stamp;
                    self.hear(client, &ReportIncarnation { incarnation, stamp });
                }
            }
        }
        self.now = end;
        asked
    }

    /// A ready component that the old `FIRST` controls, after some time.
    fn driven() -> Self {
        Self::managed().drive()
    }

    fn drive(self) -> Self {
        let mut rig = self;
        rig.introduce(FIRST, OLD);
        rig.request(FIRST, 100);
        rig.hear(FIRST, &Resume);
        rig.answer_for(Duration::from_millis(900), FIRST, OLD);
        assert_eq!(rig.state(), State::Ready);
        rig
    }

    /// A ready component that `FIRST` controls, which is of another product and has sent messages
    /// with numbers from this one on for 9 s.
    fn driven_by_foreign(first: u16) -> Self {
        let mut rig = Self::managed();
        rig.number = Some(first);
        rig.request(FIRST, 100);
        rig.hear(FIRST, &Resume);
        rig.renew_for_9_s();
        rig
    }

    fn renew_for_9_s(&mut self) {
        for _ in 0..9 {
            self.run(Duration::from_secs(1));
            self.request(FIRST, 100);
        }
        assert_eq!(self.state(), State::Ready);
    }
}

#[test]
fn a_foreign_client_that_restarts_is_noticed_within_half_a_second_by_its_numbers() {
    for first in [30, 20_000, 50_000] {
        let mut rig = Rig::driven_by_foreign(first);
        // The new process answers probes as the old one did, and does nothing else.
        rig.number = Some(1);
        rig.run(Duration::from_millis(500));
        let now = (rig.state(), rig.controller());
        assert_eq!(now, (State::Standby, None), "{first}");
    }
}

#[test]
fn a_foreign_client_whose_request_shows_that_it_has_restarted_gets_control_and_no_rejection() {
    let mut rig = Rig::driven_by_foreign(20_000);
    rig.number = Some(1);
    rig.hear(FIRST, &QueryIdentification::default());
    let granted = confirmed(FIRST, Confirmation::CONTROL_ACCEPTED);
    assert_eq!(rig.request(FIRST, 50), [granted]);
    let now = (rig.state(), rig.controller());
    assert_eq!(now, (State::Standby, Some((FIRST, 50))));
}

#[test]
fn a_foreign_client_whose_numbers_wrap_keeps_control() {
    let mut rig = Rig::driven_by_foreign(65_500);
    assert!(rig.number.is_some_and(|number| number < 1000), "it wrapped");
    rig.renew_for_9_s();
    assert_eq!(rig.controller(), Some((FIRST, 100)));
}

#[test]
fn a_foreign_client_that_does_not_count_is_not_asked_all_the_time() {
    for number in [None, Some(0)] {
        let mut rig = Rig::managed();
        let mut probes = 0;
        rig.request(FIRST, 100);
        rig.hear(FIRST, &Resume);
        for _ in 0..40 {
            rig.number = number;
            rig.now += Duration::from_millis(100);
            rig.stack.handle_timeout(rig.now);
            while let Some(message) = rig.stack.poll_transmit() {
                if QueryHeartbeatPulse::decode(&message.payload).is_ok() {
                    probes += 1;
                    rig.hear(FIRST, &ReportHeartbeatPulse {});
                }
            }
        }
        assert!(probes <= 5, "{probes} in 4 s");
    }
}

#[test]
fn a_component_tells_its_own_incarnation_and_always_the_same() {
    let mut rig = Rig::managed();
    let report = told(
        FIRST,
        &ReportIncarnation {
            incarnation: rig.stack.incarnation().number(),
            stamp: 0,
        },
    );
    for _ in 0..2 {
        assert_eq!(rig.introduce(FIRST, 0), std::slice::from_ref(&report));
    }
    assert_ne!(Rig::managed().stack.incarnation(), rig.stack.incarnation());
}

#[test]
fn a_client_in_control_that_restarts_is_noticed_within_half_a_second_although_it_was_never_silent()
{
    let mut rig = Rig::driven();
    // The new process answers probes as the old one did.
    let asked = rig.answer_for(Duration::from_millis(500), FIRST, NEW);
    assert!(asked[0] <= Life::CHECK, "{asked:?}");
    assert_eq!((rig.state(), rig.controller()), (State::Standby, None));
}

#[test]
fn a_client_that_goes_on_keeps_control_and_is_asked_five_times_a_second() {
    let mut rig = Rig::driven();
    let asked = rig.answer_for(Duration::from_secs(2), FIRST, OLD);
    assert!((9..=11).contains(&asked.len()), "{asked:?}");
    assert_eq!(rig.controller(), Some((FIRST, 100)));
}

#[test]
fn a_new_incarnation_that_requests_control_at_once_begins_in_standby() {
    let mut rig = Rig::driven();
    let said = rig.introduce(FIRST, NEW);
    let end = rejected(FIRST, Rejection::CONTROL_RELEASED);
    assert!(
        !said.contains(&end),
        "it could arrive after the next answer"
    );
    assert_eq!(
        rig.request(FIRST, 50),
        [confirmed(FIRST, Confirmation::CONTROL_ACCEPTED)]
    );
    assert_eq!(rig.state(), State::Standby);
    assert_eq!(rig.controller(), Some((FIRST, 50)));
    rig.hear(FIRST, &Resume);
    assert_eq!(rig.state(), State::Ready, "by its own command");
    rig.answer_for(Duration::from_secs(1), FIRST, NEW);
    assert_eq!(rig.state(), State::Ready);
}

#[test]
fn a_new_incarnation_whose_request_arrives_before_its_introduction_keeps_control_in_standby() {
    let mut rig = Rig::driven();
    rig.number = Some(51);
    rig.request(FIRST, 100);
    assert_eq!(rig.state(), State::Ready, "it looks like a renewal");
    rig.number = Some(50);
    let said = rig.introduce(FIRST, NEW);
    let end = rejected(FIRST, Rejection::CONTROL_RELEASED);
    assert!(!said.contains(&end));
    let now = (rig.state(), rig.controller());
    assert_eq!(now, (State::Standby, Some((FIRST, 100))));
}

#[test]
fn a_new_incarnation_that_only_answers_is_told_that_its_control_has_ended() {
    let mut rig = Rig::driven();
    let report = ReportIncarnation {
        incarnation: NEW,
        stamp: 0,
    };
    let said = rig.hear(FIRST, &report);
    assert_eq!(said, [rejected(FIRST, Rejection::CONTROL_RELEASED)]);
}

#[test]
fn a_client_without_the_service_is_never_asked() {
    let mut rig = Rig::ready();
    let asked = rig.answer_for(Duration::from_secs(2), FIRST, OLD);
    assert_eq!((asked.len(), rig.state()), (0, State::Ready));
}

#[test]
fn another_component_that_restarts_changes_nothing() {
    let mut rig = Rig::driven();
    rig.introduce(SECOND, OLD);
    rig.introduce(SECOND, NEW);
    assert_eq!(
        (rig.state(), rig.controller()),
        (State::Ready, Some((FIRST, 100)))
    );
}

/// The registration of a component with this service.
fn offers_incarnation() -> RegisterServices {
    let service = register_services::ServiceRec {
        uri: incarnation::URN.into(),
        major_version_number: 1,
        minor_version_number: 0,
    };
    RegisterServices {
        service_list: vec![service],
    }
}

#[test]
fn a_client_that_offers_the_service_and_has_not_told_its_incarnation_is_asked_for_it() {
    let mut rig = Rig::managed();
    // With search, the component knows what its client offers.
    let profile = Profile::new(Kind::Vehicle, "Rover");
    let discovery = Discovery::new(US, profile, Scope::System, Timing::default(), 1);
    rig.stack = Stack::new(discovery, Vec::new()).management(Management::new());
    rig.hear(FIRST, &offers_incarnation());
    rig.request(FIRST, 100);
    rig.hear(FIRST, &Resume);
    let asked = rig.answer_for(Duration::from_secs(1), FIRST, OLD);
    assert!(!asked.is_empty());
    rig.answer_for(Duration::from_millis(500), FIRST, NEW);
    assert_eq!((rig.state(), rig.controller()), (State::Standby, None));
}

/// A ready component of `FIRST` that counts its commands.
pub(super) fn moving() -> (Rig, Arc<AtomicU32>) {
    let (rig, commands) = idle();
    (rig.drive(), commands)
}

/// A component that counts its commands.
fn idle() -> (Rig, Arc<AtomicU32>) {
    let commands = Arc::new(AtomicU32::new(0));
    let count = Arc::clone(&commands);
    let mover = Handlers::new(list_manager::LATEST)
        .command(move |_: DeleteElement, _, _| _ = count.fetch_add(1, Relaxed))
        .on_stop(|_| {});
    let rig = Rig::new(vec![Box::new(mover)], |stack| {
        stack.management(Management::new())
    });
    (rig, commands)
}

/// Notes why it is stopped.
struct Causes(Arc<Mutex<Vec<StopCause>>>);

impl Service for Causes {
    fn offers(&self) -> Vec<ServiceId> {
        vec![list_manager::LATEST]
    }

    fn handle_message(&mut self, _: Instant, _: &Received, _: &mut Context<'_>) -> Handled {
        Handled::No
    }

    fn handle_stop(&mut self, cause: &StopCause, _: &mut Context<'_>) {
        self.0.lock().unwrap().push(cause.clone());
    }
}

#[test]
fn what_moves_is_told_that_its_client_has_restarted() {
    let causes = Arc::new(Mutex::new(Vec::new()));
    let service = Box::new(Causes(Arc::clone(&causes)));
    let rig = Rig::new(vec![service], |stack| stack.management(Management::new()));
    let mut rig = rig.drive();
    causes.lock().unwrap().clear();
    rig.introduce(FIRST, NEW);
    let first = causes.lock().unwrap().first().cloned();
    assert_eq!(first, Some(StopCause::Restarted(FIRST)));
}

#[test]
fn a_new_incarnation_counts_its_messages_anew() {
    let (mut rig, commands) = moving();
    let command = DeleteElement::default();
    rig.hear_numbered(499, &command);
    rig.hear_numbered(500, &Standby);
    rig.introduce(FIRST, NEW);
    rig.request(FIRST, 100);
    rig.hear(FIRST, &Resume);
    rig.answer_for(Duration::from_millis(300), FIRST, NEW);
    rig.hear_numbered(1, &command);
    assert_eq!(commands.load(Relaxed), 2);
}

/// A network may deliver a command seconds after it was sent. Then its client has asked for control
/// again, and to resume, because the component has restarted.
#[test]
fn a_command_that_was_sent_before_its_client_took_the_component_up_moves_nothing() {
    let command = DeleteElement::default();
    let request = RequestControl {
        authority_code: 100,
    };
    let (mut rig, commands) = idle();
    rig.hear_numbered(11, &request);
    rig.hear_numbered(12, &Resume);
    assert_eq!(rig.state(), State::Ready);
    rig.hear_numbered(10, &command);
    assert_eq!(commands.load(Relaxed), 0);
    rig.hear_numbered(13, &command);
    assert_eq!(commands.load(Relaxed), 1);

    // It takes over what another client has made ready.
    let (mut rig, commands) = idle();
    rig.hear(SECOND, &RequestControl { authority_code: 50 });
    rig.hear(SECOND, &Resume);
    rig.hear_numbered(11, &request);
    rig.hear_numbered(10, &command);
    assert_eq!(commands.load(Relaxed), 0);
    rig.hear_numbered(12, &command);
    assert_eq!(commands.load(Relaxed), 1);
}
