//! The search for other components by what they offer.

use std::fmt;
use std::time::Duration;

use super::{Audience, Component, FindError};
use crate::address::JausId;
use crate::codec::ServiceId;
use crate::node::now;
use crate::service::{ComponentEntry, Directory, Offer};

impl Component {
    /// The default time limit of [`find`](Self::find).
    pub const FIND_LIMIT: Duration = Duration::from_secs(10);
    /// How many services of other versions a [`FindError`] lists.
    const MOST_INSTEAD: usize = 8;

    /// Waits until another component is known that belongs to an audience, for at most
    /// [`FIND_LIMIT`](Self::FIND_LIMIT). A string means the providers of the service with that URN, in
    /// any version; a [`ServiceId`] those of a version that a client made for it can use: the same
    /// major version, and at least the same minor one. The [`directory`](Self::directory) holds the
    /// version.
    ///
    /// ```no_run
    /// # use jaus::component::{Audience, Component, FindError};
    /// # use jaus::messages::mobility::{local_pose_sensor, primitive_driver};
    /// # async fn find(client: Component) -> Result<(), FindError> {
    /// let driver = client.find(primitive_driver::LATEST).await?;
    /// let on_board = Audience::providers(local_pose_sensor::URN).in_subsystem(101);
    /// let sensor = client.find(on_board).await?;
    /// # Ok(())
    /// # }
    /// ```
    ///
    /// # Errors
    /// [`FindError`] gives the time of the search, and the components with other versions.
    pub async fn find(&self, audience: impl Into<Audience>) -> Result<JausId, FindError> {
        self.find_within(audience, Self::FIND_LIMIT).await
    }

    /// Like [`find`](Self::find), with another time limit.
    ///
    /// # Errors
    /// Those of [`find`](Self::find).
    pub async fn find_within(
        &self,
        audience: impl Into<Audience>,
        limit: Duration,
    ) -> Result<JausId, FindError> {
        let audience = audience.into();
        self.search(&Sought::Member(&audience), limit, |others| {
            who(others, |it| audience.includes(it))
        })
        .await
    }

    /// Waits until another component is known that offers exactly one of `versions`, and returns
    /// the version to use with it. For services whose versions differ on the wire. `versions` lists
    /// what the client supports, in order of preference; the first one that is offered wins.
    ///
    /// # Errors
    /// [`FindError`] gives the time of the search, and the components with other versions.
    pub async fn find_common_version(
        &self,
        versions: &[ServiceId],
    ) -> Result<(JausId, ServiceId), FindError> {
        self.find_common_version_within(versions, Self::FIND_LIMIT)
            .await
    }

    /// Like [`find_common_version`](Self::find_common_version), with another time limit.
    ///
    /// # Errors
    /// Those of [`find_common_version`](Self::find_common_version).
    pub async fn find_common_version_within(
        &self,
        versions: &[ServiceId],
        limit: Duration,
    ) -> Result<(JausId, ServiceId), FindError> {
        self.search(&Sought::OneOf(versions), limit, |others| {
            versions.iter().find_map(|&version| {
                let exactly = Offer::from(version);
                let found = who(others, |it| it.offered().any(|offer| *offer == exactly));
                Some((found?, version))
            })
        })
        .await
    }

    /// Waits until `found` returns a result for the other components.
    async fn search<T>(
        &self,
        sought: &Sought<'_>,
        limit: Duration,
        found: impl Fn(&Others<'_>) -> Option<T>,
    ) -> Result<T, FindError> {
        let start = now();
        let own = self.id();
        let mut result = None;
        let mut directories = self.shared.directories.clone();
        let known = directories.wait_for(|()| {
            let directory = &self.directory();
            result = found(&Others { directory, own });
            result.is_some()
        });
        match tokio::time::timeout(limit, known).await {
            Ok(Ok(_)) => result.ok_or(FindError::Stopped),
            Ok(Err(_)) => Err(FindError::Stopped),
            Err(_) => Err(self.not_found(sought, now() - start)),
        }
    }

    fn not_found(&self, sought: &Sought<'_>, waited: Duration) -> FindError {
        let directory = self.directory();
        let others = directory.components().filter(|it| it.id != self.id());
        let offers = others.flat_map(|it| it.offered().map(move |offer| (it.id, offer)));
        FindError::NotFound {
            service: sought.to_string(),
            waited,
            others: directory.len().saturating_sub(1),
            instead: offers
                .filter(|(_, offer)| sought.is_of(&offer.urn))
                .map(|(id, offer)| (id, offer.clone()))
                .take(Self::MOST_INSTEAD)
                .collect(),
        }
    }
}

/// What a search is for.
enum Sought<'a> {
    /// A member of an audience.
    Member(&'a Audience),
    /// A service in one of several versions.
    OneOf(&'a [ServiceId]),
}

impl Sought<'_> {
    /// Whether a service with this URN is wanted.
    fn is_of(&self, urn: &str) -> bool {
        match self {
            Self::Member(audience) => audience.requires(urn),
            Self::OneOf(versions) => versions.iter().any(|version| version.urn == urn),
        }
    }
}

impl fmt::Display for Sought<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Member(audience) => audience.fmt(f),
            Self::OneOf(versions) => {
                let versions: Vec<_> = versions.iter().map(ToString::to_string).collect();
                f.write_str(&versions.join(" or "))
            }
        }
    }
}

/// All known components except the searching one.
struct Others<'a> {
    directory: &'a Directory,
    own: JausId,
}

/// The first of them that will do.
fn who(others: &Others<'_>, will_do: impl Fn(&ComponentEntry) -> bool) -> Option<JausId> {
    let mut components = others.directory.components();
    let found = components.find(|it| it.id != others.own && will_do(it));
    found.map(|component| component.id)
}
