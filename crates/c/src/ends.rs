//! The ends of components and nodes, with all that belongs to them.

use std::sync::Arc;

use crate::component::COMPONENTS;
use crate::node::NODES;
use crate::status::{Failure, JausStatus, check_may_wait, run};
use crate::types::{JausComponent, JausNode};
use crate::{control, subscription};

fn free(component: u64) -> Result<(), Failure> {
    let entry = COMPONENTS.remove(component)?;
    subscription::free_all_of(&entry)?;
    control::free_all_of(&entry)?;
    entry.end()
}

/// Ends a component and frees it, with its subscriptions and control: it stops what it moves, and
/// releases what it controls. Not in a callback. Waits for callbacks that run, and 2 s at most for the
/// rest. When it returns, no callback of the component runs or will run.
#[unsafe(no_mangle)]
pub extern "C" fn jaus_component_free(component: JausComponent) -> JausStatus {
    run(|| {
        check_may_wait()?;
        free(component.id)
    })
}

/// Stops a node and frees it. Its components stop what they move and release what they control; they
/// are freed, too, with their subscriptions and control. Not in a callback. Waits for callbacks that
/// run, and 2 s at most for the rest. When it returns, no callback runs or will run.
#[unsafe(no_mangle)]
pub extern "C" fn jaus_node_free(node: JausNode) -> JausStatus {
    run(|| {
        check_may_wait()?;
        let entry = NODES.remove(node.id)?;
        for id in COMPONENTS.select(|it| Arc::ptr_eq(&it.node, &entry)) {
            free(id)?;
        }
        entry.end()
    })
}
