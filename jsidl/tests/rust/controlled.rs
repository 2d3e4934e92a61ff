use ::jaus::codec;

/// The service `Siren`.
///
/// A siren that sounds while it is controlled.
pub mod siren {
    use super::codec;

    /// What the service is called, whatever its version.
    pub const URN: &str = "urn:example:Siren";

    /// Version 1.0.
    pub const V1_0: codec::ServiceId = codec::ServiceId {
        urn: URN,
        major: 1,
        minor: 0,
    };

    /// The newest version.
    pub const LATEST: codec::ServiceId = V1_0;

    /// The state machine `accessControl.events.transport.ReceiveFSM` of version 1.0, with what it
    /// inherits.
    #[allow(unused_variables, unreachable_patterns)]
    #[allow(clippy::if_same_then_else, clippy::nonminimal_bool)]
    #[allow(clippy::needless_pass_by_value)]
    pub mod machine {
        use super::codec::machine::Outcome;

        /// The states, which hold no others.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
        pub enum State {
            /// `Receiving.Ready.NotControlled.Available`
            NotControlledAvailable,
            /// `Receiving.Ready.Controlled.Available.Silent`
            ControlledAvailableSilent,
            /// `Receiving.Ready.Controlled.Available.Sounding`
            ControlledAvailableSounding,
            /// `Receiving.Ready.NotControlled.NotAvailable`
            NotControlledNotAvailable,
            /// `Receiving.Ready.Controlled.NotAvailable`
            ControlledNotAvailable,
        }

        impl State {
            /// All states.
            pub const ALL: [Self; 5] = [Self::NotControlledAvailable, Self::ControlledAvailableSilent, Self::ControlledAvailableSounding, Self::NotControlledNotAvailable, Self::ControlledNotAvailable];

            /// The names of the states around it and its own, from outside inwards.
            #[must_use]
            pub const fn path(self) -> &'static [&'static str] {
                match self {
                    Self::NotControlledAvailable => &["Receiving", "Ready", "NotControlled", "Available"],
                    Self::ControlledAvailableSilent => &["Receiving", "Ready", "Controlled", "Available", "Silent"],
                    Self::ControlledAvailableSounding => &["Receiving", "Ready", "Controlled", "Available", "Sounding"],
                    Self::NotControlledNotAvailable => &["Receiving", "Ready", "NotControlled", "NotAvailable"],
                    Self::ControlledNotAvailable => &["Receiving", "Ready", "Controlled", "NotAvailable"],
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
            /// The message `QuerySiren`, and what the transport knows of it.
            QuerySiren(&'a super::super::QuerySiren, &'a E),
            /// The message `SoundSiren`, and what the transport knows of it.
            SoundSiren(&'a super::super::SoundSiren, &'a E),
            /// `ToneEnded`.
            ToneEnded,
        }

        /// What the machine asks and does: a question for each condition of a guard, and
        /// a method for each action. Questions change nothing.
        pub trait Behaviour {
            /// What the transport knows of a message, such as its sender.
            type Envelope;

            /// `isControllingClient`.
            fn is_controlling_client(&self, envelope: &Self::Envelope) -> bool;

            /// `Send ReportSiren`.
            fn send_report_siren(&mut self, envelope: &Self::Envelope);

            /// `silence`.
            fn silence(&mut self);

            /// `sound`.
            fn sound(&mut self);
        }

        /// The machine: a state, and what it goes back to. It does nothing by itself.
        #[derive(Debug, Clone, PartialEq, Eq)]
        pub struct Machine {
            state: State,
        }

        impl Machine {
            /// Enters the state in which the machine begins.
            pub fn start<B: Behaviour + ?Sized>(_behaviour: &mut B) -> Self {
                Self::at(State::NotControlledAvailable)
            }

            /// A machine in some state, which is entered without any action.
            #[must_use]
            pub const fn at(state: State) -> Self {
                Self {
                    state,
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
                    Event::QuerySiren(message, envelope) => self.on_query_siren(message, envelope, behaviour),
                    Event::SoundSiren(message, envelope) => self.on_sound_siren(message, envelope, behaviour),
                    Event::ToneEnded => self.on_tone_ended(behaviour),
                }
            }

            /// Enters the innermost state on this path, unless the machine is in it.
            pub fn follow<B: Behaviour + ?Sized>(&mut self, path: &[&str], behaviour: &mut B) {
                if path.starts_with(&["Receiving", "Ready", "NotControlled", "Available"]) {
                    if !matches!(self.state, State::NotControlledAvailable) {
                        match self.state {
                            State::ControlledAvailableSilent | State::ControlledAvailableSounding | State::ControlledNotAvailable => {
                                behaviour.silence();
                            }
                            _ => {}
                        }
                        self.state = State::NotControlledAvailable;
                    }
                } else if path.starts_with(&["Receiving", "Ready", "Controlled", "Available"]) {
                    if !matches!(self.state, State::ControlledAvailableSilent | State::ControlledAvailableSounding) {
                        self.state = State::ControlledAvailableSilent;
                    }
                } else if path.starts_with(&["Receiving", "Ready", "NotControlled", "NotAvailable"]) {
                    if !matches!(self.state, State::NotControlledNotAvailable) {
                        match self.state {
                            State::ControlledAvailableSilent | State::ControlledAvailableSounding | State::ControlledNotAvailable => {
                                behaviour.silence();
                            }
                            _ => {}
                        }
                        self.state = State::NotControlledNotAvailable;
                    }
                } else if path.starts_with(&["Receiving", "Ready", "Controlled", "NotAvailable"]) {
                    if !matches!(self.state, State::ControlledNotAvailable) {
                        self.state = State::ControlledNotAvailable;
                    }
                }
            }

            fn on_query_siren<B: Behaviour + ?Sized>(&mut self, message: &super::super::QuerySiren, envelope: &B::Envelope, behaviour: &mut B) -> Outcome {
                behaviour.send_report_siren(envelope);
                Outcome::Handled
            }

            fn on_sound_siren<B: Behaviour + ?Sized>(&mut self, message: &super::super::SoundSiren, envelope: &B::Envelope, behaviour: &mut B) -> Outcome {
                match self.state {
                    State::ControlledAvailableSilent => {
                        if behaviour.is_controlling_client(envelope) {
                            behaviour.sound();
                            self.state = State::ControlledAvailableSounding;
                            Outcome::Handled
                        } else {
                            Outcome::Rejected
                        }
                    }
                    _ => Outcome::Ignored,
                }
            }

            fn on_tone_ended<B: Behaviour + ?Sized>(&mut self, behaviour: &mut B) -> Outcome {
                match self.state {
                    State::ControlledAvailableSounding => {
                        self.state = State::ControlledAvailableSilent;
                        Outcome::Handled
                    }
                    _ => Outcome::Ignored,
                }
            }
        }
    }

    /// The service, as an application implements it. `C` is the type of a call.
    pub trait Service<C> {
        /// `Send ReportSiren`.
        fn send_report_siren(&mut self, call: &mut C) -> super::ReportSiren;

        /// `silence`.
        fn silence(&mut self, call: &mut C);

        /// `sound`.
        fn sound(&mut self, call: &mut C);
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
        /// `ToneEnded`.
        ToneEnded,
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

        fn send_report_siren(&mut self, _: &Self::Envelope) {
            let message = self.service.send_report_siren(self.call);
            self.call.send_report::<super::QuerySiren>(message);
        }

        fn silence(&mut self) {
            self.service.silence(self.call);
        }

        fn is_controlling_client(&self, _: &Self::Envelope) -> bool {
            self.call.is_controlling_client()
        }

        fn sound(&mut self) {
            self.service.sound(self.call);
        }
    }

    impl<T: Service<C>, C: codec::Call> codec::Provider<C> for Server<T> {
        fn offers(&self) -> codec::List<codec::ServiceId> {
            codec::List::from([V1_0])
        }

        fn hazards(&self) -> codec::Hazards {
            codec::Hazards {
                acts_on: None,
                set_up_by: Some("SoundSiren"),
                stops: false,
            }
        }

        fn answers(&self, query: u16) -> bool { [0xE011].contains(&query) }

        fn receive(&mut self, code: u16, call: &mut C) -> Option<Result<(), codec::DecodeError>> {
            let machine = self.machine.as_mut()?;
            let service = &mut self.service;
            Some(match code {
                0xD011 => call.step(|message: super::SoundSiren, call| {
                    let event = machine::Event::SoundSiren(&message, &());
                    machine.step(event, &mut Step { service, call })
                }),
                0xE011 => call.step(|message: super::QuerySiren, call| {
                    let event = machine::Event::QuerySiren(&message, &());
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
                0 => machine::Event::ToneEnded,
                _ => return,
            };
            let service = &mut self.service;
            let _ = machine.step(event, &mut Step { service, call });
        }

        fn follow(&mut self, path: &[&str], call: &mut C) {
            let service = &mut self.service;
            let mut step = Step { service, call };
            let machine = &mut self.machine;
            machine.get_or_insert_with(|| machine::Machine::start(&mut step)).follow(path, &mut step);
        }
    }
}

/// The services of the set, by URN and version.
pub static SERVICES: &[codec::ServiceInfo] = &[
    codec::ServiceInfo {
        name: "Siren", id: siren::V1_0,
        inherits_from: Some(codec::ServiceId { urn: "urn:jaus:jss:core:AccessControl", major: 1, minor: 1 }),
        inputs: &[0xD011, 0xE011], outputs: &[0xF011],
    },
];

/// The message types of the set, by code; of several with one code the newest first.
pub static MESSAGES: &[codec::MessageInfo] = &[
    codec::MessageInfo::of::<SoundSiren>(&[siren::V1_0]),
    codec::MessageInfo::of_query::<QuerySiren>(&[siren::V1_0]),
    codec::MessageInfo::of::<ReportSiren>(&[siren::V1_0]),
];

/// The messages of services of version 1.0.
pub mod v1_0 {
    use super::codec;

    /// `SoundSiren` (D011h), a command.
    ///
    /// Sounds it.
    ///
    /// Declared by `urn:example:Siren 1.0`.
    #[derive(Debug, Clone, Default, PartialEq)]
    pub struct SoundSiren;

    impl codec::Message for SoundSiren {
        const CODE: u16 = 0xD011;
        const NAME: &'static str = "SoundSiren";
        const IS_COMMAND: bool = true;
        const NEEDS_CONTROL: bool = true;
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

    codec::members!(SoundSiren {});

    /// `QuerySiren` (E011h).
    ///
    /// Asks for the tones so far.
    ///
    /// Declared by `urn:example:Siren 1.0`.
    #[derive(Debug, Clone, Default, PartialEq)]
    pub struct QuerySiren;

    impl codec::Message for QuerySiren {
        const CODE: u16 = 0xE011;
        const NAME: &'static str = "QuerySiren";
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

    codec::members!(QuerySiren {});

    impl codec::Query for QuerySiren { type Report = ReportSiren; }

    /// `ReportSiren` (F011h).
    ///
    /// Reports the tones so far.
    ///
    /// Declared by `urn:example:Siren 1.0`.
    #[derive(Debug, Clone, Default, PartialEq)]
    pub struct ReportSiren {
        /// `Tones`.
        pub tones: u8,
    }

    impl codec::Message for ReportSiren {
        const CODE: u16 = 0xF011;
        const NAME: &'static str = "ReportSiren";
        fn encoded_len(&self) -> usize { 3 }

        fn write(&self, output: &mut codec::Writer<'_>) -> Result<(), codec::EncodeError> {
            let run = output.run::<3>();
            codec::Fixed::put(<Self as codec::Message>::CODE, run, 0);
            codec::Fixed::put(self.tones, run, 2);
            Ok(())
        }

        fn read(input: &mut codec::Reader<'_>) -> Result<Self, codec::DecodeError> {
            input.code(Self::CODE)?;
            let tones = input.member("Tones", codec::Reader::fixed)?;
            Ok(Self { tones })
        }
    }

    codec::members!(ReportSiren { tones: "Tones" });

    impl codec::Report for ReportSiren {}
}

#[doc(inline)]
#[allow(unused_imports)]
pub use v1_0::{SoundSiren, QuerySiren, ReportSiren};
