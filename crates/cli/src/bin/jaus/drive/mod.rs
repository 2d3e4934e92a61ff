//! `jaus drive`: drives a vehicle with the arrow keys.
#![expect(
    clippy::disallowed_methods,
    reason = "drives and waits for confirmations in real time"
)]

mod keys;
mod terminal;

use std::time::{Duration, Instant};

use clap::Args;
use jaus::address::JausId;
use jaus::component::{Component, Session, SessionError, SessionSettings, SessionState};
use jaus::messages::mobility::primitive_driver;
use jaus_cli::failure::{Failure, Outcome};
use jaus_cli::network::{self, Network};
use jaus_cli::output::{Output, say};
use jaus_cli::runtime::{self, between};
use jaus_ocu::stick::Push;
use tokio::signal::unix::{SignalKind, signal};
use tokio::time::{MissedTickBehavior, interval, timeout};

use self::keys::{Arrows, Decoder, Key};
use self::terminal::Mode;
use crate::lease::take_control;

/// Drive a vehicle with the arrow keys
///
/// Takes control of a primitive driver and makes it ready. The vehicle moves while an arrow key is
/// pressed, and stops half a second after the last key, on any other key, at the end of the
/// command, and when the terminal is lost. The command ends by releasing control.
#[derive(Args)]
#[command(after_help = "Keys:\n  \
    arrows    drive and turn              e    set an emergency\n  \
    space     stop                        c    clear it\n  \
    q         stop, release and end       r    make the vehicle ready again\n\n\
    Examples:\n  \
    jaus drive 101.2.33\n  \
    jaus drive 101.2.33 --effort 20 --authority 200")]
pub(crate) struct Drive {
    /// The primitive driver: SUBSYSTEM.NODE.COMPONENT
    #[arg(value_name = "ID", value_parser = network::one_component)]
    address: JausId,

    /// The effort ahead and back in percent, from 1 to 100
    #[arg(long, default_value = "50", value_name = "PERCENT", value_parser = |text: &str| between(text, 1.0, 100.0))]
    effort: f64,

    /// The effort of turns in percent, from 1 to 100
    #[arg(long, default_value = "30", value_name = "PERCENT", value_parser = |text: &str| between(text, 1.0, 100.0))]
    turn: f64,

    /// The authority, from 0 to 255; the higher one wins
    #[arg(long, default_value = "127")]
    authority: u8,

    /// How long to wait for control
    #[arg(long, default_value = "5s", value_parser = runtime::duration)]
    timeout: Duration,

    #[command(flatten)]
    network: Network,
}

/// Interval of efforts, which hold for half a second at the vehicle.
const INTERVAL: Duration = Duration::from_millis(100);
/// How long to wait for the services of the component.
const DISCOVERY_LIMIT: Duration = Duration::from_secs(3);
/// How long to wait for the acknowledgement of a stop.
const STOP_LIMIT: Duration = Duration::from_secs(1);

impl Drive {
    pub(crate) fn run(&self) -> Result<Outcome, Failure> {
        runtime::run(async {
            let joined = self.network.component_for_a_moment("jaus drive");
            let (component, _, stay) = joined.await?;
            let ended = self.drive(&component).await;
            drop(component);
            stay.end().await;
            ended.map(|()| Outcome::Done)
        })
    }

    async fn drive(&self, component: &Component) -> Result<(), Failure> {
        let settings = SessionSettings::new(self.authority);
        let taken = async {
            self.check_driver(component).await?;
            take_control(component, self.address, settings, self.timeout).await
        };
        let session = tokio::select! {
            session = taken => session?,
            () = runtime::end(None) => return Ok(()),
        };
        let driven = self.follow_keys(component, &session).await;
        // A stop that is not acknowledged follows from the release.
        let _ = timeout(STOP_LIMIT, stop(&session)).await;
        session.release().await;
        driven
    }

    /// Checks that the component is a primitive driver, if it reports its services in time.
    async fn check_driver(&self, component: &Component) -> Result<(), Failure> {
        let mut changes = component.watch();
        let is_known = || {
            let directory = component.directory();
            let known = directory.component(self.address);
            known.is_some_and(|it| it.services.is_some())
        };
        let known = async { while !is_known() && changes.next().await.is_some() {} };
        // A peer without Discovery may still be a driver.
        let _ = timeout(DISCOVERY_LIMIT, known).await;
        let directory = component.directory();
        let known = directory.component(self.address);
        if known.is_none_or(|it| it.services.is_none() || it.offers(primitive_driver::URN)) {
            return Ok(());
        }
        let address = self.address;
        let drivers = directory.components();
        let drivers = drivers.filter(|it| it.offers(primitive_driver::URN));
        let drivers: Vec<_> = drivers.map(|it| it.id.to_string()).collect();
        Err(Failure::negative(match drivers.len() {
            0 => format!("{address} is no primitive driver"),
            _ => format!(
                "{address} is no primitive driver: choose from {}",
                drivers.join(", ")
            ),
        }))
    }

    /// Sends efforts until the user ends it or control is lost.
    async fn follow_keys(&self, component: &Component, session: &Session) -> Result<(), Failure> {
        let mode = Mode::by_key()?;
        let mut octets = terminal::octets();
        let mut display = Display::new(mode.is_terminal());
        display.show(session.state(), Push::NONE)?;
        let mut decoder = Decoder::default();
        let mut arrows = Arrows::new(self.effort / 100.0, self.turn / 100.0);
        let mut turns = interval(INTERVAL);
        turns.set_missed_tick_behavior(MissedTickBehavior::Delay);
        let end = runtime::end(None);
        tokio::pin!(end);
        let hangup = signal(SignalKind::hangup());
        let mut hangup = hangup.map_err(|error| Failure::new(error.to_string()))?;
        let mut last = Push::NONE;
        loop {
            tokio::select! {
                () = &mut end => return Ok(()),
                _ = hangup.recv() => return Ok(()),
                octet = octets.recv() => {
                    let Some(octet) = octet else { return Ok(()) };
                    let Some(key) = decoder.key(octet) else { continue };
                    arrows.handle_key(Instant::now(), key);
                    match key {
                        Key::Quit => return Ok(()),
                        Key::Emergency | Key::Clear | Key::Resume => {
                            self.manage(component, session, key).await;
                        }
                        _ => {}
                    }
                }
                _ = turns.tick() => {}
            }
            let push = arrows.push(Instant::now());
            let state = session.state();
            if let SessionState::Lost {
                continues: false, ..
            } = state
            {
                return Err(Failure::negative(state));
            }
            if push != Push::NONE || last != Push::NONE {
                steer(session, push);
            }
            last = push;
            display.show(state, push)?;
        }
    }

    /// Changes the state of the vehicle; a failure does not end the drive.
    async fn manage(&self, component: &Component, session: &Session, key: Key) {
        let done = match key {
            Key::Emergency => component
                .set_emergency(self.address)
                .await
                .map_err(|error| error.to_string()),
            Key::Clear => component
                .clear_emergency(self.address)
                .await
                .map_err(|error| error.to_string()),
            _ => match timeout(self.timeout, session.resume()).await {
                Ok(resumed) => resumed.map(drop).map_err(|error| error.to_string()),
                Err(_) => Err(session.state().to_string()),
            },
        };
        if let Err(error) = done {
            say(error);
        }
    }
}

/// Sends an effort. A vehicle that obeys no commands at present gets none.
fn steer(session: &Session, push: Push) {
    if let Ok(effort) = push.effort()
        && let Err(error) = session.send(&effort)
    {
        tracing::debug!(%error, "not sent");
    }
}

/// Stops the vehicle, with acknowledgement.
async fn stop(session: &Session) -> Result<(), SessionError> {
    match Push::NONE.effort() {
        Ok(effort) => session.deliver(&effort).await,
        Err(_) => Ok(()),
    }
}

/// The line with the state and the efforts: in place on a terminal, otherwise each change.
struct Display {
    output: Output,
    is_terminal: bool,
    shown: String,
}

impl Display {
    fn new(is_terminal: bool) -> Self {
        Self {
            output: Output::new(),
            is_terminal,
            shown: String::new(),
        }
    }

    fn show(&mut self, state: SessionState, push: Push) -> Result<(), Failure> {
        let percent = |share: f64| (100.0 * share).round();
        let line = format!(
            "{state}; ahead {} %, right {} %",
            percent(push.forward()),
            percent(push.turn())
        );
        if line == self.shown {
            return Ok(());
        }
        match self.is_terminal {
            true => self.output.part(&format!("\r{line}\x1b[K"))?,
            false => self.output.line(&line)?,
        }
        self.shown = line;
        Ok(())
    }
}

impl Drop for Display {
    fn drop(&mut self) {
        if self.is_terminal {
            // The terminal may be gone.
            let _ = self.output.part("\r\n");
        }
    }
}
