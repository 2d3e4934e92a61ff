//! The plain links of a node, on which nobody is authenticated.

use jaus::link::Interfaces;
use jaus::node::Node;

/// Says at the start of a node, once, if it has plain links to other hosts, and who may command by them.
pub fn tell(node: &Node) {
    let Some(on) = exposure(node) else {
        return;
    };
    match node.config().access.grants.is_empty() {
        true => tracing::warn!(
            "plain JAUS on {on}: ANY HOST ON THESE NETWORKS MAY COMMAND this node, in any id. Name the \
             network by --interface, say who may command by --grant or [access] grants \
             (docs/hardening.md), or use secure links (docs/secure-links.md)"
        ),
        false => tracing::info!(
            "plain JAUS on {on}: every host on these networks can read messages, and send them in any id \
             that is not bound to an address; secure links prevent that (docs/security.md)"
        ),
    }
}

/// The plain links of a node to other hosts, or `None` if it has none.
fn exposure(node: &Node) -> Option<String> {
    let (config, links) = (node.config(), node.links());
    let open = links.iter().filter(|it| !it.local.ip().is_loopback());
    let mut on: Vec<_> = open.map(|it| it.interface.name.clone()).collect();
    on.dedup();
    // The network may come later than a service.
    let may_come = match &config.interfaces {
        Interfaces::Loopback => false,
        Interfaces::Only(names) => links.is_empty() && !names.is_empty(),
        Interfaces::All => on.is_empty(),
    };
    #[cfg(unix)]
    let junior = config.junior.is_some();
    #[cfg(not(unix))]
    let junior = false;
    match (junior, may_come) {
        (true, _) => on.push("the interfaces of Junior".to_owned()),
        (false, true) => on.push("interfaces that come up".to_owned()),
        (false, false) => {}
    }
    let listening = node.tcp().and_then(|it| it.listening);
    let listening = listening.filter(|it| !it.ip().is_loopback());
    on.extend(listening.map(|it| format!("TCP {it}")));
    let dialled = config.tcp.connect.iter();
    let dialled = dialled.filter(|it| !it.address().ip().is_loopback());
    on.extend(dialled.map(|it| format!("TCP to {it}")));
    on.extend(config.serial.iter().map(|it| it.device.clone()));
    (!on.is_empty()).then(|| on.join(", "))
}
