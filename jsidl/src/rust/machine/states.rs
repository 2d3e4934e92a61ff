//! States of a generated machine, with short names for long paths.

use std::collections::HashMap;

use super::super::ident::Names;
use crate::behaviour::Name;
use crate::machine::{Machine, StateIndex};

/// The leaf states with their names.
pub(super) struct States {
    leaves: Vec<StateIndex>,
    idents: HashMap<StateIndex, String>,
}

impl States {
    pub(super) fn of(machine: &Machine<'_>) -> Self {
        let leaf = machine
            .states()
            .filter(|(_, state)| state.children.is_empty());
        let leaves: Vec<_> = leaf.map(|(index, _)| index).collect();
        let paths: Vec<_> = leaves
            .iter()
            .map(|leaf| &machine.state(*leaf).path)
            .collect();
        let shared = shared_names(&paths);
        let mut names = Names::default();
        let named = leaves.iter().zip(paths);
        let idents = named.map(|(&leaf, path)| {
            let own = path.parts().get(shared..).unwrap_or_default();
            (leaf, names.camel(&own.join("_")))
        });
        let idents = idents.collect();
        Self { leaves, idents }
    }

    pub(super) fn leaves(&self) -> &[StateIndex] {
        &self.leaves
    }

    pub(super) fn ident(&self, leaf: StateIndex) -> &str {
        self.idents.get(&leaf).map_or("", String::as_str)
    }
}

/// Number of leading names common to all paths; the last one of each is kept.
fn shared_names(paths: &[&Name]) -> usize {
    let Some((first, rest)) = paths.split_first() else {
        return 0;
    };
    let most = paths.iter().map(|path| path.parts().len() - 1).min();
    let same = |position: &usize| {
        let part = first.parts().get(*position);
        rest.iter().all(|path| path.parts().get(*position) == part)
    };
    (0..most.unwrap_or(0)).take_while(same).count()
}
