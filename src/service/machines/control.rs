//! Compares the control of a whole component with the state machine of its definition: both get the
//! same random events in virtual time. They must be in the same state, controlled by the same
//! client, and have sent the same messages to the same clients.
//!
//! The state machine does not handle the application's reports during an emergency; see
//! `Condition`. Here they are repeated after the emergency.

use std::collections::BTreeSet;
use std::time::{Duration, Instant};

use proptest::prelude::*;

use super::recorder::of_events;
use crate::address::JausId;
use crate::codec::Message;
use crate::codec::machine::Outcome;
use crate::messages::core::confirm_control::ResponseCode as Confirmation;
use crate::messages::core::management::machine::{self, Behaviour, Event, Machine, State as Place};
use crate::messages::core::reject_control::ResponseCode as Rejection;
use crate::messages::core::*;
use crate::service::stack_rig::{Sent, StackRig};
use crate::service::{AccessControl, Condition, Management as Settings, State, Transport};

/// The lowest authority that gets control, and the timeout of control in seconds.
const DEFAULT_AUTHORITY: u8 = 50;
const TIMEOUT: u8 = 4;

/// The data of the state machine's actions and guards.
struct Component {
    now: Instant,
    initializes: bool,
    controller: Option<(JausId, u8)>,
    /// The client that has taken control and whose authority is not known yet.
    taking: Option<JausId>,
    deadline: Option<Instant>,
    emergencies: BTreeSet<JausId>,
    said: Vec<Sent>,
    state: State,
}

impl Component {
    fn say<M: Message>(&mut self, to: JausId, message: &M) {
        self.said.push((to, message.encode().unwrap()));
    }

    fn holds(&self, _: &str) -> bool {
        false
    }

    fn note(&mut self, action: &str) {
        panic!("{action} was not asked for");
    }
}

impl Behaviour for Component {
    type Envelope = JausId;
    of_events!(machine);

    fn is_default_authority_greater(&self, message: &RequestControl) -> bool {
        DEFAULT_AUTHORITY > message.authority_code
    }

    fn is_controlling_client(&self, client: &JausId) -> bool {
        self.controller.is_some_and(|(id, _)| id == *client)
    }

    fn is_current_authority_less(&self, message: &RequestControl) -> bool {
        self.controller
            .is_none_or(|(_, authority)| authority < message.authority_code)
    }

    fn is_authority_valid(&self, message: &SetAuthority) -> bool {
        let present = self.controller.map_or(0, |(_, authority)| authority);
        (DEFAULT_AUTHORITY..=present).contains(&message.authority_code)
    }

    fn is_id_stored(&self, client: &JausId) -> bool {
        self.emergencies.contains(client)
    }

    fn is_last_id(&self, client: &JausId) -> bool {
        self.emergencies.iter().all(|id| id == client)
    }

    fn initializes(&self) -> bool {
        self.initializes
    }

    fn send_report_status(&mut self, client: &JausId) {
        let status = report_status::Status(self.state as u8);
        self.say(
            *client,
            &ReportStatus {
                status,
                reserved: 0,
            },
        );
    }

    fn send_report_control(&mut self, client: &JausId) {
        let report = self
            .controller
            .map_or_else(ReportControl::default, |(id, authority)| ReportControl {
                subsystem_id: id.subsystem(),
                node_id: id.node(),
                component_id: id.component(),
                authority_code: authority,
            });
        self.say(*client, &report);
    }

    fn send_report_authority(&mut self, client: &JausId) {
        let authority_code = self
            .controller
            .map_or(DEFAULT_AUTHORITY, |(_, authority)| authority);
        self.say(*client, &ReportAuthority { authority_code });
    }

    fn send_report_timeout(&mut self, client: &JausId) {
        let timeout = report_timeout::Timeout(TIMEOUT);
        self.say(*client, &ReportTimeout { timeout });
    }

    fn send_reject_control(&mut self, text: &'static str, client: &JausId) {
        let response_code = match text {
            "CONTROL_RELEASED" => Rejection::CONTROL_RELEASED,
            "NOT_AVAILABLE" => Rejection::NOT_AVAILABLE,
            other => panic!("{other}"),
        };
        self.say(*client, &RejectControl { response_code });
    }

    fn send_confirm_control(&mut self, text: &'static str, client: &JausId) {
        let response_code = match text {
            "CONTROL_ACCEPTED" => Confirmation::CONTROL_ACCEPTED,
            "INSUFFICIENT_AUTHORITY" => Confirmation::INSUFFICIENT_AUTHORITY,
            "NOT_AVAILABLE" => Confirmation::NOT_AVAILABLE,
            other => panic!("{other}"),
        };
        self.say(*client, &ConfirmControl { response_code });
    }

    fn store_address(&mut self, client: &JausId) {
        self.taking = Some(*client);
    }

    fn set_authority(&mut self, message: machine::RequestControlOrSetAuthority<'_>) {
        let authority = match message {
            machine::RequestControlOrSetAuthority::RequestControl(it) => it.authority_code,
            machine::RequestControlOrSetAuthority::SetAuthority(it) => it.authority_code,
        };
        let present = self.controller.map(|(id, _)| id);
        let client = self.taking.take().or(present);
        self.controller = client.map(|client| (client, authority));
    }

    fn reset_timer(&mut self) {
        let timeout = Duration::from_secs(TIMEOUT.into());
        self.deadline = Some(self.now + timeout + timeout / 4);
    }

    fn release_controller(&mut self) {
        self.deadline = None;
        if let Some((client, _)) = self.controller.take() {
            let response_code = Rejection::CONTROL_RELEASED;
            self.say(client, &RejectControl { response_code });
        }
    }

    fn store_id(&mut self, client: &JausId) {
        self.emergencies.insert(*client);
    }

    fn delete_id(&mut self, client: &JausId) {
        self.emergencies.remove(client);
    }

    fn remember_failure(&mut self) {
        self.release_controller();
    }
}

/// A random event; clients by number.
#[derive(Debug, Clone)]
enum Happening {
    Request(u8, u8),
    Release(u8),
    Authority(u8, u8),
    Ask(u8, u8),
    Command(u8, u8),
    Emergency(u8),
    Clear(u8),
    Condition(Condition),
    Pass(u16),
}

fn happening() -> impl Strategy<Value = Happening> {
    let client = || 0..3_u8;
    let authority = || prop::sample::select(vec![10_u8, 50, 60, 90, 200]);
    let condition = prop::sample::select(vec![
        Condition::Initialized,
        Condition::Failed,
        Condition::Safe,
    ]);
    prop_oneof![
        4 => (client(), authority()).prop_map(|(who, code)| Happening::Request(who, code)),
        1 => client().prop_map(Happening::Release),
        1 => (client(), authority()).prop_map(|(who, code)| Happening::Authority(who, code)),
        1 => (client(), 0..4_u8).prop_map(|(who, what)| Happening::Ask(who, what)),
        6 => (client(), 0..8_u8).prop_map(|(who, what)| Happening::Command(who, what)),
        1 => client().prop_map(Happening::Emergency),
        3 => client().prop_map(Happening::Clear),
        1 => condition.prop_map(Happening::Condition),
        2 => (0..3000_u16).prop_map(Happening::Pass),
    ]
}

fn client(number: u8) -> JausId {
    JausId::new(42, 2, number + 1)
}

/// A component and the state machine to compare it with.
struct Pair {
    rig: StackRig,
    machine: Machine,
    component: Component,
    /// The application's reports during the emergency.
    later: Vec<Condition>,
}

impl Pair {
    fn new(initializes: bool) -> Self {
        let access = AccessControl::new()
            .authority(DEFAULT_AUTHORITY)
            .timeout(TIMEOUT);
        let mut settings = Settings::new().access_control(access);
        if initializes {
            settings = settings.initializes();
        }
        let rig = StackRig::new(vec![Box::new(Transport)], |stack| {
            stack.management(settings)
        });
        let mut component = Component {
            now: rig.now,
            initializes,
            controller: None,
            taking: None,
            deadline: None,
            emergencies: BTreeSet::new(),
            said: Vec::new(),
            state: State::Standby,
        };
        let machine = if initializes {
            Machine::at(Place::NotControlledNotAvailableInit)
        } else {
            Machine::start(&mut component)
        };
        let mut pair = Self {
            rig,
            machine,
            component,
            later: Vec::new(),
        };
        pair.settle();
        pair
    }

    /// The state, as in Report Status.
    fn state(&self) -> State {
        match self.machine.state() {
            Place::NotControlledAvailableStandby | Place::ControlledAvailableStandby => {
                State::Standby
            }
            Place::NotControlledNotAvailableInit => State::Initialize,
            Place::NotControlledNotAvailableFailure => State::Failure,
            Place::NotControlledNotAvailableShutdown => State::Shutdown,
            Place::ControlledAvailableReady => State::Ready,
            Place::NotControlledNotAvailableEmergency | Place::ControlledNotAvailableEmergency => {
                State::Emergency
            }
        }
    }

    /// After each step: outside the controlled states there is no controller.
    fn settle(&mut self) {
        if !self
            .machine
            .state()
            .is_in(&["Receiving", "Ready", "Controlled"])
        {
            self.component.controller = None;
            self.component.deadline = None;
        }
        self.component.state = self.state();
    }

    fn step(&mut self, event: Event<'_, JausId>) -> Outcome {
        let outcome = self.machine.step(event, &mut self.component);
        self.settle();
        outcome
    }

    /// Both handle a message, and must send the same.
    fn hear<'m, M: Message>(
        &mut self,
        source: &'m JausId,
        message: &'m M,
        event: impl FnOnce(&'m M, &'m JausId) -> Event<'m, JausId>,
    ) {
        let said = self.rig.hear(*source, message);
        let _ = self.step(event(message, source));
        self.resume();
        assert_eq!(said, std::mem::take(&mut self.component.said));
    }

    fn condition(&mut self, condition: Condition) {
        self.rig.stack.set_condition(self.rig.now, condition);
        if condition == Condition::Safe {
            for client in self.component.emergencies.clone() {
                let _ = self.step(Event::ClearEmergency(&ClearEmergency::default(), &client));
            }
            self.resume();
        } else {
            self.tell(condition);
        }
        assert_eq!(self.rig.said(), std::mem::take(&mut self.component.said));
    }

    fn tell(&mut self, condition: Condition) {
        if self.state() == State::Emergency {
            self.later.push(condition);
        }
        let _ = match condition {
            Condition::Initialized => self.step(Event::Initialized),
            Condition::Failed => self.step(Event::Failure),
            Condition::Stopped | Condition::StopReleased | Condition::Safe => return,
        };
    }

    /// Applies the reports that were made during an emergency.
    fn resume(&mut self) {
        if self.state() != State::Emergency {
            for condition in std::mem::take(&mut self.later) {
                self.tell(condition);
            }
        }
    }

    fn pass(&mut self, milliseconds: u16) {
        let end = self.rig.now + Duration::from_millis(milliseconds.into());
        let told = self.rig.run(Duration::from_millis(milliseconds.into()));
        while let Some(deadline) = self.component.deadline.filter(|&deadline| deadline <= end) {
            self.component.now = deadline;
            let _ = self.step(Event::Timedout);
        }
        self.component.now = end;
        let told: Vec<_> = told.into_iter().map(|(_, to, said)| (to, said)).collect();
        assert_eq!(told, std::mem::take(&mut self.component.said));
    }

    fn happen(&mut self, happening: &Happening) {
        match *happening {
            Happening::Request(who, authority_code) => {
                self.hear(
                    &client(who),
                    &RequestControl { authority_code },
                    Event::RequestControl,
                );
            }
            Happening::Release(who) => {
                self.hear(&client(who), &ReleaseControl, Event::ReleaseControl);
            }
            Happening::Authority(who, authority_code) => {
                self.hear(
                    &client(who),
                    &SetAuthority { authority_code },
                    Event::SetAuthority,
                );
            }
            Happening::Ask(who, 0) => self.hear(&client(who), &QueryStatus, Event::QueryStatus),
            Happening::Ask(who, 1) => self.hear(&client(who), &QueryControl, Event::QueryControl),
            Happening::Ask(who, 2) => {
                self.hear(&client(who), &QueryAuthority, Event::QueryAuthority);
            }
            Happening::Ask(who, _) => self.hear(&client(who), &QueryTimeout, Event::QueryTimeout),
            Happening::Command(who, 0) => self.hear(&client(who), &Reset, Event::Reset),
            Happening::Command(who, 1) => self.hear(&client(who), &Shutdown, Event::Shutdown),
            Happening::Command(who, 2) => self.hear(&client(who), &Standby, Event::Standby),
            Happening::Command(who, _) => self.hear(&client(who), &Resume, Event::Resume),
            Happening::Emergency(who) => {
                self.hear(&client(who), &SetEmergency::default(), Event::SetEmergency);
            }
            Happening::Clear(who) => {
                self.hear(
                    &client(who),
                    &ClearEmergency::default(),
                    Event::ClearEmergency,
                );
            }
            Happening::Condition(condition) => self.condition(condition),
            Happening::Pass(milliseconds) => self.pass(milliseconds),
        }
    }

    fn agree(&self) {
        let standing = self.rig.stack.standing();
        assert_eq!(standing.state, self.state());
        let controller = standing.controller.map(|it| (it.id, it.authority));
        assert_eq!(controller, self.component.controller);
        assert!(standing.state != State::Ready || controller.is_some());
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(128))]

    #[test]
    fn a_component_is_where_the_machine_of_management_is(
        initializes in any::<bool>(),
        happenings in prop::collection::vec(happening(), 1..80),
    ) {
        let mut pair = Pair::new(initializes);
        for happening in &happenings {
            pair.happen(happening);
            pair.agree();
        }
    }
}

/// The random events are sufficient: they bring a component into every state of the machine.
#[test]
fn a_component_reaches_every_state_of_the_machine() {
    let life = [
        Happening::Emergency(1),
        Happening::Condition(Condition::Initialized),
        Happening::Clear(1),
        Happening::Request(0, 90),
        Happening::Command(0, 3),
        Happening::Emergency(1),
        Happening::Pass(6000),
        Happening::Clear(1),
        Happening::Condition(Condition::Failed),
        Happening::Condition(Condition::Initialized),
        Happening::Request(0, 90),
        Happening::Command(0, 0),
        Happening::Condition(Condition::Initialized),
        Happening::Request(0, 90),
        Happening::Command(0, 1),
    ];
    let mut pair = Pair::new(true);
    let mut reached = vec![pair.machine.state()];
    for happening in &life {
        pair.happen(happening);
        pair.agree();
        reached.push(pair.machine.state());
    }
    for place in Place::ALL {
        assert!(reached.contains(&place), "{place:?} among {reached:?}");
    }
}
