//! Hosts to test on: network namespaces, where this machine lets us make them.

use std::process::Command;

use jaus_test_kit::evidence::not_tested;

/// Set for a test that was started again in a user namespace.
const INSIDE: &str = "JAUS_TEST_IN_USER_NAMESPACE";

/// Runs a test's body on hosts: made here; or else in a user namespace, where this test binary is
/// started again for the same test; or [not at all](not_tested).
pub(crate) fn on_hosts<H>(
    test: &str,
    make: impl FnOnce() -> Result<H, String>,
    body: impl FnOnce(&H),
) {
    let reason = match make() {
        Ok(hosts) => {
            return body(&hosts);
        }
        Err(reason) => reason,
    };
    if std::env::var_os(INSIDE).is_none()
        && in_user_namespace(&["true"])
            .status()
            .is_ok_and(|s| s.success())
    {
        let again = std::env::current_exe().unwrap();
        let again = [again.to_str().unwrap(), "--exact", test, "--nocapture"];
        assert!(
            in_user_namespace(&again)
                .status()
                .is_ok_and(|s| s.success()),
            "{test} failed in a user namespace"
        );
        return;
    }
    let remedy = "run it as root, with iproute2 installed";
    not_tested(
        test,
        &format!("no network namespaces here: {reason}; {remedy}"),
    );
}

/// A command as root of namespaces of its own, which a plain user may often be.
fn in_user_namespace(command: &[&str]) -> Command {
    let mut unshare = Command::new("unshare");
    unshare
        .args(["--user", "--map-root-user", "--net", "--mount", "sh", "-c"])
        .args(["mount -t tmpfs none /run && exec \"$@\"", "sh"])
        .args(command)
        .env(INSIDE, "1");
    unshare
}

pub(crate) fn ip(arguments: &[&str]) -> Result<(), String> {
    run("ip", arguments)
}

pub(crate) fn run(program: &str, arguments: &[&str]) -> Result<(), String> {
    let output = Command::new(program).args(arguments).output();
    let output = output.map_err(|e| format!("{program}: {e}"))?;
    let said = String::from_utf8_lossy(&output.stderr);
    if output.status.success() {
        Ok(())
    } else {
        Err(said.trim().replace('\n', "; "))
    }
}
