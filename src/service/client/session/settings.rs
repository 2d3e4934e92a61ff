//! What an application wants of a session: authority, policy and the state of the peer.

/// When a session takes control again after losing it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Retake {
    /// Only when the application asks for it.
    Never,
    /// After restarts, silence and emergencies, but not after another client took control or was
    /// found to have it: it may have had a reason. Then only when the application asks for it.
    #[default]
    Unopposed,
    /// As `Unopposed`, and once the other client has released the peer.
    WhenFree,
    /// Whenever the peer grants it. Two such clients with equal authorities share a vehicle in
    /// turns.
    Always,
}

/// The state into which a session brings its peer.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum TargetState {
    /// The state in which the session finds the peer, and any that the peer enters by itself.
    AsFound,
    /// Ready: the peer obeys commands.
    #[default]
    Ready,
    /// Standby: the peer is under control, and does not act.
    Standby,
}

/// The settings of a session. An authority alone, from 0 to 255, is a setting, too: all others have
/// their defaults then.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub struct SessionSettings {
    /// From 0 to 255. The client with the higher one gets control.
    pub authority: u8,
    /// When to take control again. Default: [`Retake::Unopposed`].
    pub retake: Retake,
    /// The state of the peer. Default: [`TargetState::Ready`].
    pub target: TargetState,
}

impl SessionSettings {
    /// Settings with this authority, from 0 to 255, and defaults.
    #[must_use]
    pub const fn new(authority: u8) -> Self {
        Self {
            authority,
            retake: Retake::Unopposed,
            target: TargetState::Ready,
        }
    }

    /// Sets when to take control again.
    #[must_use]
    pub const fn retake(self, retake: Retake) -> Self {
        Self { retake, ..self }
    }

    /// Sets the state of the peer.
    #[must_use]
    pub const fn target(self, target: TargetState) -> Self {
        Self { target, ..self }
    }
}

impl From<u8> for SessionSettings {
    fn from(authority: u8) -> Self {
        Self::new(authority)
    }
}

/// What the application orders a session to do.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SessionOrder {
    /// Bring the peer into this state, now and after restarts. Ready is refused while the peer
    /// reports an emergency.
    Target(TargetState),
    /// Take control again.
    Retake,
}
