//! `jaus view`: serves live messages to Foxglove and other viewers that speak its protocol.

mod source;

use std::net::SocketAddr;

use clap::Args;
use jaus::link::Group;
use jaus_cli::failure::{Failure, Outcome};
use jaus_cli::output::{Output, say};
use jaus_cli::runtime::{self, RunFor};
use jaus_view::Filter;
use jaus_viewers::{Channels, MOST_CHANNELS, Server, ServerSettings};
use tokio::net::TcpListener;

use crate::debug_view::usual_address;
use crate::definitions::Definitions;
use source::{Arrival, Source};

/// Serve live messages to Foxglove, as a Foxglove WebSocket connection
///
/// Each source and message is a channel with its fields by name; poses, positions, range points and
/// images are there in Foxglove's schemas, too. It is read-only: viewers cannot send anything.
/// Messages come from a communicator's debug view, or with --interface from the network itself, as
/// for `jaus watch`. A viewer that reads too slowly loses messages, and shows a warning with
/// their number.
#[derive(Args)]
#[command(after_help = "Examples:\n  \
    jaus view                                   of the communicator of this host\n  \
    jaus view --interface all                   of the network, without a communicator\n  \
    jaus view --filter 'from=101 service=Pose'\n  \
    jaus view --listen 0.0.0.0:8765             for viewers on other hosts\n\n\
    In Foxglove: Open connection, Foxglove WebSocket, ws://localhost:8765.")]
pub(crate) struct View {
    /// Where to serve viewers
    #[arg(long, value_name = "ADDRESS", default_value = "127.0.0.1:8765")]
    listen: SocketAddr,

    /// Let the pages of this site connect, as browsers name it: https://viewer.example (repeatable).
    /// Pages of this host, of Foxglove and of files may always, and programs
    #[arg(long, value_name = "ORIGIN")]
    origin: Vec<String>,

    /// The address of a debug view: the path of its socket, or ADDRESS:PORT [default: that of this
    /// user's communicator]
    #[arg(long, value_name = "ADDRESS")]
    at: Option<String>,

    /// Serve what passes on this network interface, by name or address, instead of a debug view
    /// (repeatable); `all` for all of them, including loopback
    #[arg(long, value_name = "INTERFACE", conflicts_with = "at")]
    interface: Vec<String>,

    /// The multicast group to receive without packet sockets
    #[arg(long, value_name = "ADDRESS", default_value_t, requires = "interface")]
    group: Group,

    /// Only messages that match this filter (repeatable); see `jaus watch --help`
    #[arg(long, value_name = "TERMS")]
    filter: Vec<Filter>,

    #[command(flatten)]
    definitions: Definitions,

    #[command(flatten)]
    run_for: RunFor,
}

/// Says that samples are left out for want of channels, unless it `is_full` already.
fn say_once_when_full(left_out: u64, is_full: &mut bool) {
    if left_out > 0 && !std::mem::replace(is_full, true) {
        say(format_args!(
            "messages are left out: there are {MOST_CHANNELS} channels, at most half of them for one network address; \
             those without messages for 10 s give way; choose some with --filter"
        ));
    }
}

impl View {
    pub(crate) fn run(&self) -> Result<Outcome, Failure> {
        let dictionary = self.definitions.load()?;
        runtime::run(async {
            let listener = self.listen().await?;
            let mut source = self.source(&dictionary).await?;
            let (server, sharing) = Server::new(self.settings());
            let mut channels = Channels::live(&dictionary);
            let mut is_full = false;
            self.announce(&listener)?;
            let serving = server.serve(listener);
            let end = self.run_for.end();
            tokio::pin!(serving, end);
            loop {
                tokio::select! {
                    () = &mut end => return Ok(Outcome::Done),
                    never = &mut serving => match never {},
                    messages = source.next() => {
                        for Arrival { entry, from, time } in messages? {
                            if self.filter.iter().all(|filter| filter.passes(&entry)) {
                                let samples = channels.handle_entry(&entry, from, time);
                                sharing.publish(&channels, &samples);
                                say_once_when_full(channels.left_out(), &mut is_full);
                            }
                        }
                    }
                }
            }
        })
    }

    async fn listen(&self) -> Result<TcpListener, Failure> {
        TcpListener::bind(self.listen).await.map_err(|error| {
            Failure::new(format!(
                "cannot listen on {}: {error}; choose another address with --listen",
                self.listen
            ))
        })
    }

    async fn source<'d>(
        &self,
        dictionary: &'d jaus_view::Dictionary,
    ) -> Result<Source<'d>, Failure> {
        if self.interface.is_empty() {
            let at = self.at.clone().unwrap_or_else(usual_address);
            return Source::debug_view(&at, dictionary).await;
        }
        let chosen: &[String] = match self.interface.iter().any(|name| name == "all") {
            true => &[],
            false => &self.interface,
        };
        Source::interfaces(chosen, self.group, dictionary)
    }

    fn settings(&self) -> ServerSettings {
        let session = source::now().to_string();
        let origins = self.origin.iter();
        origins.fold(
            ServerSettings::new("jaus view").session(session),
            ServerSettings::origin,
        )
    }

    fn announce(&self, listener: &TcpListener) -> Result<(), Failure> {
        let address = listener
            .local_addr()
            .map_err(|error| Failure::new(format!("cannot listen: {error}")))?;
        Output::new().line(format_args!(
            "viewers connect to ws://{address} (in Foxglove: Open connection, Foxglove WebSocket)"
        ))?;
        if !address.ip().is_loopback() {
            say("every host that reaches this address can read all messages");
        }
        Ok(())
    }
}
