//! Memory is asked for before it is taken: an allocation that fails ends the whole process.

use std::fs;

/// Less than this needs no question.
const SMALL: f64 = (64 << 20) as f64;

/// The bytes that some things would take, and the free ones. The message follows the name of the things.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error(
    "take {} GB, for which there is no room: {} GB are free. Ask for less at once",
    gigabytes(*bytes), gigabytes(*free)
)]
pub struct Shortage {
    pub bytes: f64,
    pub free: f64,
}

/// To the megabyte, where a page can hold the number.
fn gigabytes(bytes: f64) -> String {
    let number = bytes * 1e-9;
    if number < 1e9 { format!("{number:.3}") } else { format!("{number:.0e}") }
}

/// How many bytes can be had, as far as the system tells.
pub fn free() -> Option<u64> {
    let text = |path: &str| fs::read_to_string(path).ok();
    let machine = text("/proc/meminfo").and_then(|text| {
        let line = text.lines().find_map(|line| line.strip_prefix("MemAvailable:"))?;
        line.trim().strip_suffix("kB")?.trim().parse::<u64>().ok()
    });
    // A container's own limit; without one the file says "max".
    let number = |path: &str| text(path)?.trim().parse::<u64>().ok();
    let container = number("/sys/fs/cgroup/memory.max")
        .zip(number("/sys/fs/cgroup/memory.current"))
        .map(|(most, taken)| most.saturating_sub(taken));
    // The process's own limit (`ulimit -v`), without which the file says "unlimited".
    let limit = text("/proc/self/limits").and_then(|text| {
        let line = text.lines().find_map(|line| line.strip_prefix("Max address space"))?;
        line.split_whitespace().next()?.parse::<u64>().ok()
    });
    let taken = || {
        let text = text("/proc/self/status")?;
        let line = text.lines().find_map(|line| line.strip_prefix("VmSize:"))?;
        line.trim().strip_suffix("kB")?.trim().parse::<u64>().ok()
    };
    let process = limit.map(|limit| limit.saturating_sub(taken().unwrap_or(0).saturating_mul(1024)));
    machine.map(|kilobytes| kilobytes.saturating_mul(1024)).into_iter().chain(container).chain(process).min()
}

/// Asks for so many bytes, before they are taken.
///
/// # Errors
/// Where there are not as many.
pub fn require(bytes: f64) -> Result<(), Shortage> {
    if bytes <= SMALL {
        return Ok(());
    }
    // Where the system says nothing, what no machine has is refused all the same.
    let free = free().map_or(isize::MAX as f64, |free| free as f64);
    if bytes <= free { Ok(()) } else { Err(Shortage { bytes, free }) }
}

/// Asks for a table of so many rows of so many elements.
///
/// # Errors
/// Where there is no room for it.
pub fn require_rows<T>(rows: usize, width: usize) -> Result<(), Shortage> {
    require(rows as f64 * width as f64 * size_of::<T>() as f64)
}

/// Makes room for so many more elements, in steps that double it; false where there is none.
pub fn grow<T>(list: &mut Vec<T>, more: usize) -> bool {
    if list.capacity() - list.len() >= more {
        return true;
    }
    let added = more.max(list.len());
    require_rows::<T>(list.len() + added, 1).is_ok() && list.try_reserve_exact(added).is_ok()
}

/// Makes room for a table whose size is known.
///
/// # Errors
/// Where there is none.
pub fn reserve<T>(list: &mut Vec<T>, length: usize) -> Result<(), Shortage> {
    require_rows::<T>(length, 1)?;
    let bytes = length as f64 * size_of::<T>() as f64;
    list.try_reserve_exact(length).map_err(|_| Shortage { bytes, free: 0.0 })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn more_than_there_is_is_refused_in_one_sentence() {
        assert_eq!(require(1e3), Ok(()));
        for bytes in [7.2e12, 1e300, f64::INFINITY] {
            let shortage = require(bytes).expect_err("no machine has so much");
            assert!(shortage.free < bytes && shortage.to_string().len() < 300, "{shortage}");
        }
        assert!(require_rows::<f64>(usize::MAX, usize::MAX).is_err());
        let mut list = vec![0_u8];
        assert!(reserve(&mut list, 1 << 60).is_err() && !grow(&mut list, 1 << 60));
        assert!(reserve(&mut list, 100).is_ok() && grow(&mut list, 1000) && list == [0]);
    }
}
