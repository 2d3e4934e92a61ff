//! The objects of the program. A handle is the number of an object, so a handle that is zero, freed or
//! of another type is an error rather than undefined behaviour.

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard};

use crate::status::{Failure, JausStatus};
use jaus_binding::lock;

/// All tables share it, so that no two objects have the same number.
static LAST: AtomicU64 = AtomicU64::new(0);

/// The objects of one type.
pub(crate) struct Table<T> {
    /// For people.
    name: &'static str,
    objects: Mutex<BTreeMap<u64, Arc<T>>>,
}

impl<T> Table<T> {
    /// Limit of objects of one type.
    const MOST: usize = 4096;

    pub(crate) const fn new(name: &'static str) -> Self {
        Self {
            name,
            objects: Mutex::new(BTreeMap::new()),
        }
    }

    /// A number for an object that is not in the table yet.
    pub(crate) fn reserve() -> u64 {
        LAST.fetch_add(1, Ordering::Relaxed) + 1
    }

    /// Fails if there is no room for another object.
    pub(crate) fn check_room(&self) -> Result<(), Failure> {
        if self.lock().len() < Self::MOST {
            return Ok(());
        }
        let text = format!("there are {} {}s: free some", Self::MOST, self.name);
        Err(Failure::new(JausStatus::TooMany, text))
    }

    pub(crate) fn insert(&self, id: u64, object: T) -> Arc<T> {
        let object = Arc::new(object);
        self.lock().insert(id, object.clone());
        object
    }

    pub(crate) fn get(&self, id: u64) -> Result<Arc<T>, Failure> {
        self.lock()
            .get(&id)
            .cloned()
            .ok_or_else(|| self.unknown(id))
    }

    pub(crate) fn remove(&self, id: u64) -> Result<Arc<T>, Failure> {
        let removed = self.lock().remove(&id);
        removed.ok_or_else(|| self.unknown(id))
    }

    /// Removes the objects that belong to another one, all at once: none of them is freed meanwhile by
    /// another thread.
    pub(crate) fn remove_all(&self, belongs: impl Fn(&T) -> bool) -> Vec<Arc<T>> {
        let mut objects = self.lock();
        let mut removed = Vec::new();
        objects.retain(|_, object| {
            let is_kept = !belongs(object);
            if !is_kept {
                removed.push(object.clone());
            }
            is_kept
        });
        removed
    }

    fn unknown(&self, id: u64) -> Failure {
        let text = match id {
            0 => format!("the handle of the {} is zero", self.name),
            id => format!("{id} is no {}, or it was freed", self.name),
        };
        Failure::new(JausStatus::InvalidHandle, text)
    }

    fn lock(&self) -> MutexGuard<'_, BTreeMap<u64, Arc<T>>> {
        lock(&self.objects)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_handle_that_is_zero_freed_or_of_another_table_is_invalid() {
        let (numbers, words) = (Table::new("number"), Table::new("word"));
        let id = Table::<i32>::reserve();
        numbers.insert(id, 7);
        words.insert(Table::<&str>::reserve(), "seven");
        assert_eq!(*numbers.get(id).unwrap(), 7);
        for (result, text) in [
            (
                words.get(id).map(drop),
                format!("{id} is no word, or it was freed"),
            ),
            (
                numbers.get(0).map(drop),
                "the handle of the number is zero".to_owned(),
            ),
        ] {
            let failure = result.unwrap_err();
            assert_eq!(failure.status, JausStatus::InvalidHandle);
            assert_eq!(failure.text, text);
        }
        numbers.remove(id).unwrap();
        assert!(numbers.get(id).is_err() && numbers.remove(id).is_err());
    }

    #[test]
    fn objects_that_belong_to_another_one_are_removed_together() {
        let table = Table::new("number");
        let ids = [0, 1, 2, 3].map(|number| {
            let id = Table::<i32>::reserve();
            table.insert(id, number);
            id
        });
        table.remove(ids[0]).unwrap();
        let removed = table.remove_all(|number| number % 2 == 0);
        assert_eq!(removed, [Arc::new(2)]);
        assert!(table.get(ids[2]).is_err() && table.get(ids[3]).is_ok());
    }

    #[test]
    fn a_table_has_a_bound() {
        let table = Table::new("number");
        for _ in 0..Table::<u64>::MOST {
            table.check_room().unwrap();
            let id = Table::<u64>::reserve();
            table.insert(id, id);
        }
        assert_eq!(table.check_room().unwrap_err().status, JausStatus::TooMany);
    }
}
