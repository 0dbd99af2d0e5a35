//! Work on all cores. The code for threads is compiled once for all kinds of work. The place of a result does not
//! depend on which thread made it, or when.

use std::convert::Infallible;
use std::process;
use std::sync::{Mutex, PoisonError};
use std::thread;

use rayon::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};

use crate::integrate::cancel;

/// Work on a part of a list, given the number of its first.
type Parts<'a, T, E> = dyn Fn(usize, &mut [T]) -> Result<(), E> + Sync + 'a;

/// Parts for each thread: not all take equally long.
const PARTS: usize = 8;
/// A part has no more than so many: whoever asks the work to end waits for one.
const MOST_IN_PART: usize = 4096;

/// The threads that share the parts of all lists, and the process that they belong to.
///
/// A process that was forked has none of its parent's threads: work that was given to them would never be done.
static POOL: Mutex<Option<(u32, &'static ThreadPool)>> = Mutex::new(None);

/// This process's threads, one for each core; none where none can be had.
///
/// Nobody waits for the lock: a fork may have left it locked by a thread that is not there.
fn pool() -> Option<&'static ThreadPool> {
    let mut kept = (0..MOST_TRIALS).find_map(|_| POOL.try_lock().map_err(|_| thread::yield_now()).ok())?;
    if let Some((_, pool)) = kept.filter(|(process, _)| *process == process::id()) {
        return Some(pool);
    }
    // It lives as long as the process; that of a parent cannot be dropped, which would wait for its threads.
    let fresh = Box::leak(Box::new(ThreadPoolBuilder::new().build().ok()?));
    *kept = Some((process::id(), fresh));
    Some(fresh)
}

/// A thread keeps the lock for microseconds, so that one of so many trials succeeds.
const MOST_TRIALS: usize = 1000;

/// How many threads work on the parts of a list.
pub fn threads() -> usize {
    match rayon::current_thread_index() {
        Some(_) => rayon::current_num_threads(),
        None => pool().map_or(1, ThreadPool::current_num_threads),
    }
}

/// Runs the work on so many threads at once.
pub fn on_threads(threads: usize, work: &(dyn Fn() + Sync)) {
    if threads <= 1 {
        return work();
    }
    match ThreadPoolBuilder::new().num_threads(threads).build() {
        Ok(pool) => drop(pool.broadcast(|_| work())),
        // No threads to be had: the caller's own will do.
        Err(_) => work(),
    }
}

fn each_index(count: usize, work: &(dyn Fn(usize) + Sync)) {
    let flag = cancel::current();
    let one = |k| {
        if flag.as_ref().is_none_or(|flag| flag.check().is_ok()) {
            cancel::under(flag.clone(), || work(k));
        }
    };
    let share = || (0..count).into_par_iter().for_each(one);
    if rayon::current_thread_index().is_some() {
        // The thread of a pool shares its work with that pool.
        share();
    } else if let Some(pool) = pool() {
        pool.install(share);
    } else {
        (0..count).for_each(one);
    }
    cancel::look();
}

/// Works on a list in parts of at least so many in a row, given the number of a part's first.
pub fn in_parts<T: Send>(list: &mut [T], least: usize, work: &(dyn Fn(usize, &mut [T]) + Sync)) {
    let done = try_in_parts(list, least, &|first, part| -> Result<(), Infallible> {
        work(first, part);
        Ok(())
    });
    let Ok(()) = done;
}

/// The same for work that can fail.
///
/// # Errors
/// That of the first part that fails, which is to be that of the first in it.
pub fn try_in_parts<T: Send, E: Send>(list: &mut [T], least: usize, work: &Parts<'_, T, E>) -> Result<(), E> {
    let size = list.len().div_ceil(PARTS * threads()).min(MOST_IN_PART).max(least).max(1);
    let mut parts = Vec::with_capacity(list.len().div_ceil(size));
    for part in list.chunks_mut(size) {
        parts.push(Mutex::new(part));
    }
    let failed: Mutex<Option<(usize, E)>> = Mutex::new(None);
    let sooner = |k: usize, failed: &Option<(usize, E)>| matches!(failed, Some((first, _)) if *first < k);
    each_index(parts.len(), &|k| {
        // The lock only hands a part over: no other thread uses it.
        let Ok(mut part) = parts[k].lock() else { return };
        if sooner(k, &failed.lock().unwrap_or_else(PoisonError::into_inner)) {
            return;
        }
        if let Err(error) = work(k * size, &mut part) {
            let mut failed = failed.lock().unwrap_or_else(PoisonError::into_inner);
            if !sooner(k, &failed) {
                *failed = Some((k, error));
            }
        }
    });
    match failed.into_inner().unwrap_or_else(PoisonError::into_inner) {
        Some((_, error)) => Err(error),
        None => Ok(()),
    }
}

/// Results for the numbers below `count`, in their order.
///
/// # Errors
/// The error of the first number that fails.
pub fn try_map<T: Send, E: Send>(
    count: usize,
    one: &(dyn Fn(usize) -> Result<T, E> + Sync),
) -> Result<Vec<T>, E> {
    let mut slots: Vec<Option<T>> = Vec::with_capacity(count);
    slots.resize_with(count, || None);
    try_in_parts(&mut slots, 1, &|first, part| {
        for (j, slot) in part.iter_mut().enumerate() {
            *slot = Some(one(first + j)?);
        }
        Ok(())
    })?;
    let mut all = Vec::with_capacity(count);
    for slot in slots {
        all.push(slot.expect("none failed"));
    }
    Ok(all)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_number_has_its_place_and_the_first_error_counts() {
        for count in [0, 1, 7, 1000] {
            let squares: Result<Vec<usize>, ()> = try_map(count, &|i| Ok(i * i));
            assert_eq!(squares, Ok((0..count).map(|i| i * i).collect()));
        }
        for _ in 0..20 {
            let odd = |i: usize| if i > 100 && i % 2 == 1 { Err(i) } else { Ok(()) };
            assert_eq!(try_map(1000, &odd), Err(101));
        }
        let mut list = vec![0; 1000];
        in_parts(&mut list, 64, &|first, part| {
            assert!(part.len() >= 64 || first + part.len() == 1000);
            part.iter_mut().enumerate().for_each(|(j, own)| *own += first + j);
        });
        assert!(list.iter().enumerate().all(|(i, &own)| i == own));
    }
}
