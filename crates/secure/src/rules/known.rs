//! Every message that the definitions have, whatever sets this program was built with.

// Messages with code, name and whether a definition calls them commands, by code; services with their inputs.
include!(concat!(env!("OUT_DIR"), "/known.rs"));

/// Whether a definition calls the messages with this code commands; `None` if no definition has it.
pub(super) fn is_command(code: u16) -> Option<bool> {
    let rest = &MESSAGES[MESSAGES.partition_point(|(known, ..)| *known < code)..];
    let known = rest.iter().take_while(|(known, ..)| *known == code);
    let are_commands = known.map(|(.., is_command)| *is_command);
    are_commands.reduce(|one, other| one || other)
}

/// The codes of the messages with this name, and of those that the service with it receives. A service's name is its URN,
/// or what follows the last colon of it.
pub(super) fn codes_of(name: &str) -> Vec<u16> {
    let names_service = |urn: &str| urn == name || urn.rsplit(':').next() == Some(name);
    let services = SERVICES.iter().filter(|(urn, _)| names_service(urn));
    let inputs = services.flat_map(|(_, inputs)| inputs.iter().copied());
    let messages = MESSAGES.iter().filter(|(_, known, _)| *known == name);
    inputs.chain(messages.map(|(code, ..)| *code)).collect()
}

/// All messages, with code, name and whether a definition calls them commands.
#[cfg(test)]
pub(super) fn messages() -> impl Iterator<Item = (u16, &'static str, bool)> {
    MESSAGES.iter().copied()
}
