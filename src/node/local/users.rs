//! What the programs of each user of the host may do.

use super::Refusal;
use crate::address::JausId;
use crate::link::is_ours;
use crate::link::local::record::Reason;
use crate::node::LocalUser;
use crate::rights::Rules;

/// The rights of a process of this user that attaches with this id; `None` if it has no limits.
pub(super) async fn rights_of(
    users: &[LocalUser],
    uid: Option<u32>,
    id: JausId,
) -> Result<Option<Rules>, Refusal> {
    if users.is_empty() || uid.is_some_and(is_ours) {
        return Ok(None);
    }
    let name = match uid {
        Some(uid) => name_of(uid).await,
        None => None,
    };
    let shown = || match (&name, uid) {
        (Some(name), _) => format!("user {name}"),
        (None, Some(uid)) => format!("user {uid}"),
        (None, None) => "an unknown user: a TCP port does not tell it".to_owned(),
    };
    let Some(user) = users.iter().find(|it| it.is(uid, name.as_deref())) else {
        let why = format!(
            "no entry of `local_users` is about {}: add one to the settings of the node, such as \
             \"{} observe\"",
            shown(),
            name.as_deref().unwrap_or("*")
        );
        return Err((Reason::User, why));
    };
    if !user.may_use(id) {
        let (shown, ids) = (shown(), user.ids());
        let why = format!("`local_users` of the node gives {shown} the ids {ids}, not {id}");
        return Err((Reason::User, why));
    }
    Ok(Some(user.rules().clone()))
}

/// The name of a user. It is looked up at each attachment, because users come and go.
async fn name_of(uid: u32) -> Option<String> {
    #[cfg(unix)]
    {
        // The users of a host may be in a directory on the network.
        let found = tokio::task::spawn_blocking(move || {
            nix::unistd::User::from_uid(nix::unistd::Uid::from_raw(uid))
        });
        found.await.ok()?.ok()?.map(|user| user.name)
    }
    #[cfg(not(unix))]
    {
        let _ = uid;
        None
    }
}

#[cfg(unix)]
#[cfg(test)]
mod tests {
    use super::*;

    fn users(texts: &[&str]) -> Vec<LocalUser> {
        texts.iter().map(|it| it.parse().unwrap()).collect()
    }

    const ID: JausId = JausId::new(101, 1, 40);
    /// A user that is not the one of these tests: `bin` of Debian and its like, which no test runs as.
    const OTHER: Option<u32> = Some(2);

    async fn rights(texts: &[&str], uid: Option<u32>) -> Result<Option<Rules>, Reason> {
        let rights = rights_of(&users(texts), uid, ID).await;
        rights.map_err(|(reason, _)| reason)
    }

    #[tokio::test]
    async fn the_first_entry_for_a_user_counts_and_without_one_it_may_not_attach() {
        let observes = Ok(Some(Rules::default()));
        let entries = ["bin observe", "* control=127"];
        assert_eq!(rights(&entries, OTHER).await, observes);
        assert_eq!(rights(&["2 observe"], OTHER).await, observes);
        let other = rights(&entries, Some(1)).await.unwrap().unwrap();
        assert_eq!(other.control, Some(127));
        assert_eq!(rights(&["bin observe"], Some(1)).await, Err(Reason::User));
        assert_eq!(rights(&["bin observe"], None).await, Err(Reason::User));
    }

    #[tokio::test]
    async fn a_user_has_the_ids_of_its_entry() {
        let right = rights(&["bin 101.1.40 observe"], OTHER).await;
        assert_eq!(right, Ok(Some(Rules::default())));
        let wrong = rights(&["bin 101.1.41 observe"], OTHER).await;
        assert_eq!(wrong, Err(Reason::User));
    }

    #[tokio::test]
    async fn root_and_the_user_of_the_node_have_no_limits_nor_has_anybody_without_entries() {
        let own = rustix::process::geteuid().as_raw();
        for uid in [0, own] {
            assert_eq!(rights(&["bin observe"], Some(uid)).await, Ok(None));
        }
        assert_eq!(rights(&[], OTHER).await, Ok(None));
    }
}
