//! Memory is asked for before it is taken: an allocation that fails ends the whole process.

use std::fs;

/// Less than this needs no question.
const SMALL: usize = 64 << 20;

/// How many bytes can be had, as far as the system tells.
pub fn free() -> Option<u64> {
    let machine = fs::read_to_string("/proc/meminfo").ok().and_then(|text| {
        let line = text.lines().find_map(|line| line.strip_prefix("MemAvailable:"))?;
        line.trim().strip_suffix("kB")?.trim().parse::<u64>().ok()
    });
    // A container's own limit; without one the file says "max".
    let number = |name: &str| fs::read_to_string(name).ok()?.trim().parse::<u64>().ok();
    let container = number("/sys/fs/cgroup/memory.max")
        .zip(number("/sys/fs/cgroup/memory.current"))
        .map(|(most, taken)| most.saturating_sub(taken));
    machine.map(|kilobytes| kilobytes.saturating_mul(1024)).into_iter().chain(container).min()
}

/// Whether an array of so many elements can be had.
pub fn holds<T>(length: usize) -> bool {
    let bytes = length.saturating_mul(size_of::<T>());
    bytes <= SMALL || free().is_none_or(|free| bytes as u64 <= free)
}

/// Makes room for so many more elements, in steps that double it; false where there is none.
pub fn grow<T>(list: &mut Vec<T>, more: usize) -> bool {
    if list.capacity() - list.len() >= more {
        return true;
    }
    let added = more.max(list.len());
    holds::<T>(list.len() + added) && list.try_reserve_exact(added).is_ok()
}

/// Makes room for a table whose size is known; false where there is none.
pub fn reserve<T>(list: &mut Vec<T>, length: usize) -> bool {
    holds::<T>(length) && list.try_reserve_exact(length).is_ok()
}
