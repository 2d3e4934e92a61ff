//! Control of a component for the duration of a command.
#![expect(
    clippy::disallowed_methods,
    reason = "control has a timeout in real time"
)]

use std::time::Duration;

use jaus::address::JausId;
use jaus::component::{Component, Session, SessionSettings, SessionState, TargetState};
use jaus_cli::failure::Failure;
use jaus_cli::{network, runtime};
use tokio::time::timeout;

/// Takes control of a component, and brings it into the target state of the settings.
///
/// # Errors
/// [`Failure::Negative`] with the reason: the component refuses control, is in an emergency, or
/// does not answer within the limit.
pub(crate) async fn take_control(
    component: &Component,
    peer: JausId,
    settings: SessionSettings,
    limit: Duration,
) -> Result<Session, Failure> {
    let begun = component.session(peer, settings).await;
    let mut session = begun.map_err(Failure::negative)?;
    let state = timeout(limit, settled(&mut session)).await;
    match state.unwrap_or_else(|_| Ok(session.state()))? {
        SessionState::Ready(_) => Ok(session),
        SessionState::Standby(_) | SessionState::Disabled { .. }
            if settings.target != TargetState::Ready =>
        {
            Ok(session)
        }
        state => {
            session.release().await;
            let waited = runtime::in_words(limit);
            Err(Failure::negative(match state {
                SessionState::Requesting(_) | SessionState::Seeking => {
                    format!(
                        "{peer} did not answer the request for control within {waited}. {}",
                        network::REMEDY
                    )
                }
                state => state.to_string(),
            }))
        }
    }
}

/// Waits for a state that the session does not leave by itself.
async fn settled(session: &mut Session) -> Result<SessionState, Failure> {
    let mut state = session.state();
    loop {
        match state {
            SessionState::Seeking
            | SessionState::Requesting(_)
            | SessionState::Preparing(_)
            | SessionState::Lost {
                continues: true, ..
            } => {}
            _ => return Ok(state),
        }
        state = session.changed().await.map_err(Failure::negative)?;
    }
}
