//! Results that are kept for equal calls.

use std::sync::{Mutex, PoisonError};

/// The results of the latest calls, each with what it depends on.
#[derive(Debug)]
pub struct Latest<K, V>(Mutex<Vec<(K, V)>>);

impl<K: PartialEq, V: Clone> Latest<K, V> {
    /// So many are kept.
    const MOST: usize = 16;

    #[allow(clippy::new_without_default, reason = "statics need a constant function")]
    pub const fn new() -> Self {
        Self(Mutex::new(Vec::new()))
    }

    /// The result of an equal call among the latest, or the result of `make`. Errors are not kept.
    ///
    /// # Errors
    /// That of `make`.
    pub fn get<E>(&self, key: K, make: impl FnOnce() -> Result<V, E>) -> Result<V, E> {
        if let Some(value) = self.recall(&key) {
            return Ok(value);
        }
        // Other threads need not wait: at worst two make the same.
        let value = make()?;
        let mut latest = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if latest.len() == Self::MOST {
            latest.remove(0);
        }
        latest.push((key, value.clone()));
        Ok(value)
    }

    fn recall(&self, key: &K) -> Option<V> {
        let mut latest = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let i = latest.iter().position(|(other, _)| other == key)?;
        latest[i..].rotate_left(1);
        latest.last().map(|(_, value)| value.clone())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_latest_are_kept() {
        let latest = Latest::new();
        let calls = std::cell::Cell::new(0);
        let square = |x: u64| {
            latest.get(x, || {
                calls.set(calls.get() + 1);
                if x == 0 { Err("zero") } else { Ok(x * x) }
            })
        };
        for x in 1..=16 {
            assert_eq!(square(x), Ok(x * x));
        }
        assert_eq!((square(1), calls.get()), (Ok(1), 16));
        // The second is the oldest now.
        assert_eq!((square(17), square(1), calls.get()), (Ok(289), Ok(1), 17));
        assert_eq!((square(2), calls.get()), (Ok(4), 18));
        assert_eq!((square(0), square(0), calls.get()), (Err("zero"), Err("zero"), 20));
    }
}
