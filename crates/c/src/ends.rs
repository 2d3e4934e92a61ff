//! The ends of components and nodes, with all that belongs to them.

use std::sync::Arc;

use crate::component::{COMPONENTS, ComponentEntry};
use crate::node::NODES;
use crate::status::{Failure, JausStatus, check_may_wait, run};
use crate::types::{JausComponent, JausNode};
use crate::{control, subscription};

/// Ends a component that was removed from its table, with all that belongs to it.
fn end(component: &Arc<ComponentEntry>) -> Result<(), Failure> {
    subscription::end_all_of(component);
    control::end_all_of(component);
    component.end()
}

/// Ends a component and frees it, with its subscriptions and control: it stops what it moves, and
/// releases what it controls. Not in a callback. Waits for callbacks that run, and 2 s at most for the
/// rest. When it returns, no callback of the component runs or will run.
#[unsafe(no_mangle)]
pub extern "C" fn jaus_component_free(component: JausComponent) -> JausStatus {
    run(|| {
        check_may_wait()?;
        end(&COMPONENTS.remove(component.id)?)
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
        for component in COMPONENTS.remove_all(|it| Arc::ptr_eq(&it.node, &entry)) {
            end(&component)?;
        }
        entry.end()
    })
}
