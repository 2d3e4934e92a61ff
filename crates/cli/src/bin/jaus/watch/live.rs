//! Follows messages through the debug view of a running node.

use std::time::Duration;

use jaus_cli::failure::{Failure, Outcome};
use jaus_cli::output::say;
use jaus_cli::runtime;
use jaus_view::{Filter, MessageStream};

use super::{Printer, tell_lost};
use crate::debug_view::DebugView;

/// Shows what a debug view sends. What it could not decode is decoded here. `filters_here`: after
/// that, instead of in the debug view.
pub(super) fn watch(
    address: &str,
    filter: &Filter,
    filters_here: bool,
    limit: Option<Duration>,
    printer: &mut Printer<'_>,
) -> Result<Outcome, Failure> {
    let (there, here) = match filters_here {
        true => (Filter::default(), filter.clone()),
        false => (filter.clone(), Filter::default()),
    };
    let stream = MessageStream::new(printer.dictionary, here);
    runtime::run(async {
        let mut view = DebugView::connect(address, &there).await?;
        let end = runtime::end(limit);
        tokio::pin!(end);
        loop {
            let text = tokio::select! {
                () = &mut end => return Ok(Outcome::Done),
                text = view.next() => text,
            };
            let Some(text) = text else { break };
            match stream.read_json(&text) {
                Ok(Some(entry)) => printer.object(&entry)?,
                Ok(None) => tell_lost(&text, printer)?,
                Err(_) => return Err(Failure::new(format!("{address} sends no JSON objects"))),
            }
        }
        say(format_args!("{address} closed the connection"));
        Ok(Outcome::Incomplete)
    })
}
