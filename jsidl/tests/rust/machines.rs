use ::jaus::codec;

/// The service `Door`.
///
/// A door that can be locked.
pub mod door {
    use super::codec;

    /// What the service is called, whatever its version.
    pub const URN: &str = "urn:example:Door";

    /// Version 1.0.
    pub const V1_0: codec::ServiceId = codec::ServiceId {
        urn: URN,
        major: 1,
        minor: 0,
    };

    /// The newest version.
    pub const LATEST: codec::ServiceId = V1_0;

    /// The state machine `ReceiveFSM` of version 1.0, with what it inherits.
    #[allow(unused_variables, unreachable_patterns)]
    #[allow(clippy::if_same_then_else, clippy::nonminimal_bool)]
    #[allow(clippy::needless_pass_by_value)]
    pub mod machine {
        use super::codec::machine::{Memory, Outcome};

        /// The states, which hold no others.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
        pub enum State {
            /// `Working.Closed`
            WorkingClosed,
            /// `Working.Opened`
            WorkingOpened,
            /// `Stopped`
            Stopped,
        }

        impl State {
            /// All states.
            pub const ALL: [Self; 3] = [Self::WorkingClosed, Self::WorkingOpened, Self::Stopped];

            /// The names of the states around it and its own, from outside inwards.
            #[must_use]
            pub const fn path(self) -> &'static [&'static str] {
                match self {
                    Self::WorkingClosed => &["Working", "Closed"],
                    Self::WorkingOpened => &["Working", "Opened"],
                    Self::Stopped => &["Stopped"],
                }
            }

            /// Whether it is the state with this path, or lies in it.
            #[must_use]
            pub fn is_in(self, path: &[&str]) -> bool {
                self.path().starts_with(path)
            }
        }

        /// What happens to the machine.
        #[derive(Debug)]
        pub enum Event<'a, E> {
            /// The message `Stop`.
            Stop(&'a super::super::Stop),
            /// The message `Open`, and what the transport knows of it.
            Open(&'a super::super::Open, &'a E),
            /// The message `Unlock`, whose type is in another set: its octets.
            Unlock(&'a [u8]),
            /// The message `Close`, and what the transport knows of it.
            Close(&'a super::super::Close, &'a E),
            /// `Moved`.
            Moved(i64),
            /// `Timedout`.
            Timedout,
        }

        /// One of several messages that are treated alike.
        #[derive(Debug, Clone, Copy)]
        pub enum OpenOrClose<'a> {
            /// `Open`
            Open(&'a super::super::Open),
            /// `Close`
            Close(&'a super::super::Close),
        }

        /// What the machine asks and does: a question for each condition of a guard, and
        /// a method for each action. Questions change nothing.
        pub trait Behaviour {
            /// What the transport knows of a message, such as its sender.
            type Envelope;

            /// `isAllowed`.
            fn is_allowed(&self, message: &super::super::Open) -> bool;

            /// `isLocked`.
            fn is_locked(&self) -> bool;

            /// `isLate`.
            ///
            /// `text` is one of "night".
            fn is_late(&self, text: &'static str, envelope: &Self::Envelope) -> bool;

            /// `lightOn`.
            fn light_on(&mut self);

            /// `lightOff`.
            fn light_off(&mut self);

            /// `remember`.
            fn remember(&mut self, message: OpenOrClose<'_>);

            /// `Send ReportDoor`.
            ///
            /// `text` is one of "CLOSED", "OPEN".
            fn send_report_door(&mut self, text: &'static str, envelope: &Self::Envelope);

            /// `unlock`.
            fn unlock(&mut self, message: &[u8]);

            /// `startMotor`.
            ///
            /// `text` is one of "down", "up".
            fn start_motor(&mut self, text: &'static str);

            /// `count`.
            fn count(&mut self, number: i64);

            /// `ring`.
            fn ring(&mut self);
        }

        /// The machine: a state, and what it goes back to. It does nothing by itself.
        #[derive(Debug, Clone, PartialEq, Eq)]
        pub struct Machine {
            state: State,
            remembered: Memory<State, 8>,
        }

        impl Machine {
            /// Enters the state in which the machine begins.
            pub fn start<B: Behaviour + ?Sized>(behaviour: &mut B) -> Self {
                behaviour.light_on();
                Self::at(State::WorkingClosed)
            }

            /// A machine in some state, which is entered without any action.
            #[must_use]
            pub const fn at(state: State) -> Self {
                Self {
                    state,
                    remembered: Memory::new(),
                }
            }

            /// The state that it is in.
            #[must_use]
            pub const fn state(&self) -> State {
                self.state
            }

            /// Takes the first transition whose guard holds, and does what it and the states that
            /// are left and entered ask for.
            pub fn step<B: Behaviour + ?Sized>(&mut self, event: Event<'_, B::Envelope>, behaviour: &mut B) -> Outcome {
                match event {
                    Event::Stop(message) => self.on_stop(message, behaviour),
                    Event::Open(message, envelope) => self.on_open(message, envelope, behaviour),
                    Event::Unlock(message) => self.on_unlock(message, behaviour),
                    Event::Close(message, envelope) => self.on_close(message, envelope, behaviour),
                    Event::Moved(number_0) => self.on_moved(number_0, behaviour),
                    Event::Timedout => self.on_timedout(behaviour),
                }
            }

            fn on_stop<B: Behaviour + ?Sized>(&mut self, message: &super::super::Stop, behaviour: &mut B) -> Outcome {
                match self.state {
                    State::WorkingClosed => {
                        if self.remembered.has_room() {
                            self.remembered.push(self.state);
                            behaviour.light_off();
                            self.state = State::Stopped;
                            Outcome::Handled
                        } else {
                            Outcome::Rejected
                        }
                    }
                    State::WorkingOpened => {
                        if self.remembered.has_room() {
                            self.remembered.push(self.state);
                            behaviour.start_motor("down");
                            behaviour.light_off();
                            self.state = State::Stopped;
                            Outcome::Handled
                        } else {
                            Outcome::Rejected
                        }
                    }
                    _ => {
                        if self.remembered.is_used() {
                            if let Some(to) = self.remembered.pop() {
                                behaviour.ring();
                                match to {
                                    State::WorkingClosed => {
                                        behaviour.light_on();
                                    }
                                    State::WorkingOpened => {
                                        behaviour.light_on();
                                        behaviour.start_motor("up");
                                    }
                                    _ => {}
                                }
                                self.state = to;
                            }
                            Outcome::Handled
                        } else {
                            Outcome::Rejected
                        }
                    }
                }
            }

            fn on_open<B: Behaviour + ?Sized>(&mut self, message: &super::super::Open, envelope: &B::Envelope, behaviour: &mut B) -> Outcome {
                match self.state {
                    State::WorkingClosed => {
                        if behaviour.is_allowed(message) && !(behaviour.is_locked() || behaviour.is_late("night", envelope)) {
                            behaviour.remember(OpenOrClose::Open(message));
                            behaviour.send_report_door("OPEN", envelope);
                            behaviour.start_motor("up");
                            self.state = State::WorkingOpened;
                            Outcome::Handled
                        } else {
                            Outcome::Rejected
                        }
                    }
                    _ => Outcome::Ignored,
                }
            }

            fn on_unlock<B: Behaviour + ?Sized>(&mut self, message: &[u8], behaviour: &mut B) -> Outcome {
                match self.state {
                    State::WorkingClosed => {
                        behaviour.unlock(message);
                        Outcome::Handled
                    }
                    _ => Outcome::Ignored,
                }
            }

            fn on_close<B: Behaviour + ?Sized>(&mut self, message: &super::super::Close, envelope: &B::Envelope, behaviour: &mut B) -> Outcome {
                match self.state {
                    State::WorkingOpened => {
                        behaviour.start_motor("down");
                        behaviour.remember(OpenOrClose::Close(message));
                        behaviour.send_report_door("CLOSED", envelope);
                        self.state = State::WorkingClosed;
                        Outcome::Handled
                    }
                    _ => Outcome::Ignored,
                }
            }

            fn on_moved<B: Behaviour + ?Sized>(&mut self, number_0: i64, behaviour: &mut B) -> Outcome {
                match self.state {
                    State::WorkingOpened => {
                        if number_0 == 0 {
                            behaviour.start_motor("down");
                            behaviour.count(number_0);
                            behaviour.start_motor("up");
                            Outcome::Handled
                        } else {
                            Outcome::Rejected
                        }
                    }
                    _ => Outcome::Ignored,
                }
            }

            fn on_timedout<B: Behaviour + ?Sized>(&mut self, behaviour: &mut B) -> Outcome {
                match self.state {
                    State::WorkingOpened => {
                        behaviour.start_motor("down");
                        self.state = State::WorkingClosed;
                        Outcome::Handled
                    }
                    _ => Outcome::Ignored,
                }
            }
        }
    }

    /// The service, as an application implements it. `C` is the type of a call.
    pub trait Service<C> {
        /// `lightOn`.
        fn light_on(&mut self, call: &mut C);

        /// `lightOff`.
        fn light_off(&mut self, call: &mut C);

        /// `isAllowed`.
        fn is_allowed(&self, message: &super::Open) -> bool;

        /// `isLocked`.
        fn is_locked(&self) -> bool;

        /// `isLate`.
        ///
        /// `text` is one of "night".
        fn is_late(&self, text: &'static str, call: &C) -> bool;

        /// `remember`.
        fn remember(&mut self, message: machine::OpenOrClose<'_>, call: &mut C);

        /// `Send ReportDoor`.
        ///
        /// `text` is one of "CLOSED", "OPEN".
        fn send_report_door(&mut self, text: &'static str, call: &mut C) -> super::ReportDoor;

        /// `unlock`.
        fn unlock(&mut self, message: &[u8], call: &mut C);

        /// `startMotor`.
        ///
        /// `text` is one of "down", "up".
        fn start_motor(&mut self, text: &'static str, call: &mut C);

        /// `count`.
        fn count(&mut self, number: i64, call: &mut C);

        /// `ring`.
        fn ring(&mut self, call: &mut C);
    }

    /// Passes to a [`Service`] what its state machine accepts.
    #[derive(Debug)]
    pub struct Server<T> {
        service: T,
        machine: Option<machine::Machine>,
    }

    impl<T> Server<T> {
        /// A server of this service.
        #[must_use]
        pub const fn new(service: T) -> Self {
            Self {
                service,
                machine: None,
            }
        }
    }

    /// The events that the service raises itself.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
    pub enum Internal {
        /// `Timedout`.
        Timedout,
    }

    impl codec::InternalEvent for Internal {
        fn number(self) -> u16 {
            self as u16
        }
    }

    /// A service and a call, as the state machine sees them.
    #[allow(dead_code)]
    struct Step<'a, T, C> {
        service: &'a mut T,
        call: &'a mut C,
    }

    impl<T: Service<C>, C: codec::Call> machine::Behaviour for Step<'_, T, C> {
        type Envelope = ();

        fn light_on(&mut self) {
            self.service.light_on(self.call);
        }

        fn light_off(&mut self) {
            self.service.light_off(self.call);
        }

        fn is_allowed(&self, message: &super::Open) -> bool {
            self.service.is_allowed(message)
        }

        fn is_locked(&self) -> bool {
            self.service.is_locked()
        }

        fn is_late(&self, text: &'static str, _: &Self::Envelope) -> bool {
            self.service.is_late(text, self.call)
        }

        fn remember(&mut self, message: machine::OpenOrClose<'_>) {
            self.service.remember(message, self.call);
        }

        fn send_report_door(&mut self, text: &'static str, _: &Self::Envelope) {
            let message = self.service.send_report_door(text, self.call);
            self.call.send(&message);
        }

        fn unlock(&mut self, message: &[u8]) {
            self.service.unlock(message, self.call);
        }

        fn start_motor(&mut self, text: &'static str) {
            self.service.start_motor(text, self.call);
        }

        fn count(&mut self, number: i64) {
            self.service.count(number, self.call);
        }

        fn ring(&mut self) {
            self.service.ring(self.call);
        }
    }

    impl<T: Service<C>, C: codec::Call> codec::Provider<C> for Server<T> {
        fn offers(&self) -> codec::List<codec::ServiceId> {
            codec::List::from([V1_0])
        }

        fn hazards(&self) -> codec::Hazards {
            codec::Hazards {
                acts_on: None,
                set_up_by: Some("Open"),
                stops: false,
            }
        }

        fn receive(&mut self, code: u16, call: &mut C) -> Option<Result<(), codec::DecodeError>> {
            let machine = self.machine.as_mut()?;
            let service = &mut self.service;
            Some(match code {
                0xD001 => call.step(|message: super::Open, call| {
                    let event = machine::Event::Open(&message, &());
                    machine.step(event, &mut Step { service, call })
                }),
                0xD002 => call.step(|message: super::Close, call| {
                    let event = machine::Event::Close(&message, &());
                    machine.step(event, &mut Step { service, call })
                }),
                0xD003 => call.step(|message: super::Stop, call| {
                    let event = machine::Event::Stop(&message);
                    machine.step(event, &mut Step { service, call })
                }),
                _ => return None,
            })
        }

        fn handle_event(&mut self, number: u16, call: &mut C) {
            let Some(machine) = &mut self.machine else {
                return;
            };
            let event = match number {
                0 => machine::Event::Timedout,
                _ => return,
            };
            let service = &mut self.service;
            let _ = machine.step(event, &mut Step { service, call });
        }

        fn follow(&mut self, _path: &[&str], call: &mut C) {
            let service = &mut self.service;
            let mut step = Step { service, call };
            let machine = &mut self.machine;
            machine.get_or_insert_with(|| machine::Machine::start(&mut step));
        }
    }
}

/// The services of the set, by URN and version.
pub static SERVICES: &[codec::ServiceInfo] = &[
    codec::ServiceInfo {
        name: "Door", id: door::V1_0, inherits_from: None, inputs: &[0xD001, 0xD002, 0xD003],
        outputs: &[0xD004],
    },
];

/// The message types of the set, by code; of several with one code the newest first.
pub static MESSAGES: &[codec::MessageInfo] = &[
    codec::MessageInfo::of::<Open>(&[door::V1_0]),
    codec::MessageInfo::of::<Close>(&[door::V1_0]),
    codec::MessageInfo::of::<Stop>(&[door::V1_0]),
    codec::MessageInfo::of::<ReportDoor>(&[door::V1_0]),
];

/// The messages of services of version 1.0.
pub mod v1_0 {
    use super::codec;

    /// `Open` (D001h), a command.
    ///
    /// Opens it.
    ///
    /// Declared by `urn:example:Door 1.0`.
    #[derive(Debug, Clone, Default, PartialEq)]
    pub struct Open;

    impl codec::Message for Open {
        const CODE: u16 = 0xD001;
        const NAME: &'static str = "Open";
        const IS_COMMAND: bool = true;
        fn encoded_len(&self) -> usize { 2 }

        fn write(&self, output: &mut codec::Writer<'_>) -> Result<(), codec::EncodeError> {
            output.fixed(<Self as codec::Message>::CODE);
            Ok(())
        }

        fn read(input: &mut codec::Reader<'_>) -> Result<Self, codec::DecodeError> {
            input.code(Self::CODE)?;
            Ok(Self)
        }
    }

    codec::members!(Open {});

    /// `Close` (D002h), a command.
    ///
    /// Closes it.
    ///
    /// Declared by `urn:example:Door 1.0`.
    #[derive(Debug, Clone, Default, PartialEq)]
    pub struct Close;

    impl codec::Message for Close {
        const CODE: u16 = 0xD002;
        const NAME: &'static str = "Close";
        const IS_COMMAND: bool = true;
        fn encoded_len(&self) -> usize { 2 }

        fn write(&self, output: &mut codec::Writer<'_>) -> Result<(), codec::EncodeError> {
            output.fixed(<Self as codec::Message>::CODE);
            Ok(())
        }

        fn read(input: &mut codec::Reader<'_>) -> Result<Self, codec::DecodeError> {
            input.code(Self::CODE)?;
            Ok(Self)
        }
    }

    codec::members!(Close {});

    /// `Stop` (D003h), a command.
    ///
    /// Stops it.
    ///
    /// Declared by `urn:example:Door 1.0`.
    #[derive(Debug, Clone, Default, PartialEq)]
    pub struct Stop;

    impl codec::Message for Stop {
        const CODE: u16 = 0xD003;
        const NAME: &'static str = "Stop";
        const IS_COMMAND: bool = true;
        fn encoded_len(&self) -> usize { 2 }

        fn write(&self, output: &mut codec::Writer<'_>) -> Result<(), codec::EncodeError> {
            output.fixed(<Self as codec::Message>::CODE);
            Ok(())
        }

        fn read(input: &mut codec::Reader<'_>) -> Result<Self, codec::DecodeError> {
            input.code(Self::CODE)?;
            Ok(Self)
        }
    }

    codec::members!(Stop {});

    /// `ReportDoor` (D004h).
    ///
    /// Tells how it is.
    ///
    /// Declared by `urn:example:Door 1.0`.
    #[derive(Debug, Clone, Default, PartialEq)]
    pub struct ReportDoor;

    impl codec::Message for ReportDoor {
        const CODE: u16 = 0xD004;
        const NAME: &'static str = "ReportDoor";
        fn encoded_len(&self) -> usize { 2 }

        fn write(&self, output: &mut codec::Writer<'_>) -> Result<(), codec::EncodeError> {
            output.fixed(<Self as codec::Message>::CODE);
            Ok(())
        }

        fn read(input: &mut codec::Reader<'_>) -> Result<Self, codec::DecodeError> {
            input.code(Self::CODE)?;
            Ok(Self)
        }
    }

    codec::members!(ReportDoor {});
}

#[doc(inline)]
#[allow(unused_imports)]
pub use v1_0::{Open, Close, Stop, ReportDoor};
