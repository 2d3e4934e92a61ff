//! Reads messages off this host's network interfaces, without a communicator.

use std::time::Duration;

use jaus::link::Group;
use jaus_cli::failure::{Failure, Outcome};
use jaus_cli::runtime;
use jaus_view::{Filter, MessageStream, Network};

use super::Printer;
use crate::packets::Source;

pub(super) fn watch(
    interfaces: &[String],
    group: Group,
    filter: &Filter,
    limit: Option<Duration>,
    printer: &mut Printer<'_>,
) -> Result<Outcome, Failure> {
    runtime::run(async {
        let mut source = Source::open(interfaces, group)?;
        let mut network = Network::by_content();
        let mut stream = MessageStream::new(printer.dictionary, filter.clone());
        let end = runtime::end(limit);
        tokio::pin!(end);
        loop {
            let packets = tokio::select! {
                () = &mut end => return Ok(Outcome::Done),
                packets = source.next() => packets?,
            };
            for packet in &packets {
                let frame = packet.frame();
                for datagram in network.handle_frame(&frame) {
                    for entry in stream.read_datagram(frame.time, &datagram) {
                        printer.entry(&entry)?;
                    }
                }
            }
        }
    })
}
