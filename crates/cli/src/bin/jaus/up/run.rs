//! Runs a system: executes the supervisor's orders and reports events to it.
#![expect(
    clippy::disallowed_methods,
    reason = "gives the supervisor its clock and processes"
)]

use std::time::Instant;

use jaus::node::sleep_until;
use jaus_cli::failure::{Failure, Outcome};
use jaus_cli::output::counted;
use nix::sys::signal::Signal;
use tokio::signal::unix::{SignalKind, signal};

use super::Up;
use super::child::Child;
use super::console::{Console, PrefixedConsole};
use super::status::{self, StatusFile, in_words};
use super::supervisor::{Exit, News, Order, Supervisor};
use super::system::{OURSELVES, System};
use super::warden::Guard;

/// Runs a system until it ends.
pub(super) async fn run(flags: &Up, system: System) -> Result<Outcome, Failure> {
    let names = system.parts.iter().map(|part| part.name.len());
    let width = names.max().unwrap_or_default().max(OURSELVES.len());
    let (console, mut printer) = Console::start(width)?;
    let mut shutdown = Shutdown::new(flags)?;
    let mut ended = listen(SignalKind::child())?;
    let mut running = Running::new(flags, system, &console)?;
    drop(console);
    let parts = counted(running.system.parts.len(), "part");
    running.say(&format!("{parts}; press Ctrl-C to end"));
    loop {
        running.settle();
        if running.supervisor.is_over() {
            break;
        }
        let wake = running.supervisor.poll_timeout();
        tokio::select! {
            _ = ended.recv() => running.reap().await,
            () = sleep_until(wake) => {}
            () = shutdown.requested() => running.stop(),
            () = printer.closed(), if !running.unheard => {
                running.unheard = true;
                running.stop();
            }
        }
    }
    let outcome = running.end();
    printer.finish().await;
    Ok(outcome)
}

fn listen(kind: SignalKind) -> Result<tokio::signal::unix::Signal, Failure> {
    signal(kind).map_err(|error| Failure::new(format!("cannot listen for signals: {error}")))
}

/// What ends a run from outside: signals and a time limit.
struct Shutdown {
    signals: [tokio::signal::unix::Signal; 3],
    limit: Option<Instant>,
}

impl Shutdown {
    fn new(flags: &Up) -> Result<Self, Failure> {
        let signals = [
            listen(SignalKind::interrupt())?,
            listen(SignalKind::terminate())?,
            listen(SignalKind::hangup())?,
        ];
        let limit = flags.run_for.limit().map(|limit| Instant::now() + limit);
        Ok(Self { signals, limit })
    }

    async fn requested(&mut self) {
        let [interrupt, terminate, hangup] = &mut self.signals;
        tokio::select! {
            _ = interrupt.recv() => {}
            _ = terminate.recv() => {}
            _ = hangup.recv() => {}
            () = sleep_until(self.limit) => self.limit = None,
        }
    }
}

/// The system and its processes.
struct Running<'f> {
    flags: &'f Up,
    system: System,
    supervisor: Supervisor,
    /// One slot per part.
    children: Vec<Option<Child>>,
    consoles: Vec<PrefixedConsole>,
    own: PrefixedConsole,
    guard: Guard,
    status: Option<StatusFile>,
    stopping: bool,
    /// Whether standard output is closed.
    unheard: bool,
}

impl<'f> Running<'f> {
    fn new(flags: &'f Up, system: System, console: &Console) -> Result<Self, Failure> {
        let restarts = system.parts.iter().map(|part| part.restart);
        let supervisor = Supervisor::new(Instant::now(), restarts, flags.grace);
        let names = system.parts.iter().map(|part| &part.name).enumerate();
        let consoles = names.map(|(number, name)| console.prefixed_console(name, Some(number)));
        let guard = Guard::start(flags.grace)
            .map_err(|error| Failure::new(format!("cannot start a second process: {error}")))?;
        Ok(Self {
            flags,
            supervisor,
            children: system.parts.iter().map(|_| None).collect(),
            consoles: consoles.collect(),
            own: console.prefixed_console(OURSELVES, None),
            guard,
            status: flags.status.clone().map(StatusFile::new),
            stopping: false,
            unheard: false,
            system,
        })
    }

    fn say(&self, words: &str) {
        self.own.say(words);
    }

    fn name(&self, part: usize) -> &str {
        self.system.parts.get(part).map_or("", |it| &it.name)
    }

    /// Executes all due orders.
    fn settle(&mut self) {
        self.supervisor.handle_timeout(Instant::now());
        while let Some(order) = self.supervisor.poll_order() {
            self.obey(order);
        }
        while let Some(news) = self.supervisor.poll_news() {
            let words = self.in_words(news);
            self.say(&words);
        }
        self.tell_status();
    }

    fn obey(&mut self, order: Order) {
        let signalled = |part: usize| self.children.get(part).and_then(Option::as_ref);
        match order {
            Order::Start(part) => self.start(part),
            Order::Terminate(part) => {
                if let Some(child) = signalled(part) {
                    child.signal(Signal::SIGTERM);
                }
            }
            Order::Kill(part) => {
                if let Some(child) = signalled(part) {
                    child.signal(Signal::SIGKILL);
                }
            }
        }
    }

    fn start(&mut self, part: usize) {
        let places = (self.system.parts.get(part), self.consoles.get(part));
        let (Some(plan), Some(prefixed_console)) = places else {
            return;
        };
        let started = Child::start(plan, prefixed_console.clone());
        let now = Instant::now();
        match (started, self.children.get_mut(part)) {
            (Ok(child), Some(place)) => {
                self.guard.guard(child.id());
                *place = Some(child);
                self.supervisor.handle_started(now, part);
            }
            (Err(error), _) => {
                self.say(&format!("{} cannot be started: {error}", self.name(part)));
                self.supervisor.handle_exit(now, part, Exit::NotStarted);
            }
            (Ok(_), None) => {}
        }
    }

    /// Reaps processes that have ended, and replaces a warden that has.
    async fn reap(&mut self) {
        for part in 0..self.children.len() {
            let place = self.children.get_mut(part);
            let ended = place.and_then(|place| place.take_if(|child| child.has_ended()));
            if let Some(child) = ended {
                self.guard.release(child.id());
                let exit = child.reap().await;
                self.supervisor.handle_exit(Instant::now(), part, exit);
            }
        }
        if self.guard.has_ended() && !self.stopping {
            self.replace_guard();
        }
    }

    fn replace_guard(&mut self) {
        match Guard::start(self.flags.grace) {
            Ok(mut guard) => {
                let groups = self.children.iter().flatten().map(Child::id);
                groups.for_each(|group| guard.guard(group));
                self.guard = guard;
            }
            Err(error) => self.say(&format!("cannot start a second process: {error}")),
        }
    }

    /// Stops all parts; at the second request kills them.
    fn stop(&mut self) {
        let now = Instant::now();
        if std::mem::replace(&mut self.stopping, true) {
            self.say("kills the remaining parts");
            self.supervisor.hurry(now);
        } else {
            self.say("stops all parts in reverse order");
            self.supervisor.stop(now);
        }
    }

    fn tell_status(&mut self) {
        let Some(file) = &mut self.status else {
            return;
        };
        let parts = self.system.parts.iter().zip(&self.children).enumerate();
        let told = parts.filter_map(|(place, (part, child))| {
            let (state, starts, last) = self.supervisor.look(place)?;
            let process = child.as_ref().map(|child| child.id().as_raw());
            Some(status::of_part(part, state, starts, last, process))
        });
        if let Some(problem) = file.update(&told.collect::<Vec<_>>()) {
            self.say(&problem);
        }
    }

    /// The outcome when all parts have ended.
    fn end(self) -> Outcome {
        let well = self.supervisor.went_well();
        if self.stopping {
            self.say("all parts have ended");
        } else {
            self.say("no part is left");
        }
        self.guard.dismiss();
        Outcome::complete_if(well)
    }

    fn in_words(&self, news: News) -> String {
        match news {
            News::Restarts {
                part,
                exit,
                ran,
                pause,
            } => format!(
                "{} ended after {:.1} s ({}) and restarts in {:.1} s",
                self.name(part),
                ran.as_secs_f64(),
                in_words(exit),
                pause.as_secs_f64()
            ),
            News::Ended { part, exit } => {
                format!("{} has ended ({})", self.name(part), in_words(exit))
            }
            News::GaveUp { part } => format!(
                "{} cannot start (status 2) and is given up; the others continue. See its output, \
                 correct its flags in {}, and start again",
                self.name(part),
                self.flags.file.display()
            ),
            News::Killed { part } => format!(
                "{} did not end within {:.1} s and is killed",
                self.name(part),
                self.flags.grace.as_secs_f64()
            ),
            News::Stuck { part } => {
                format!(
                    "{} cannot be killed: it is blocked in the kernel",
                    self.name(part)
                )
            }
        }
    }
}
