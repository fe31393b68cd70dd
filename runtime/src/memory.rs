//! Memory that a stage will take, compared with what there is before it starts.
//!
//! A stage that would not fit is refused with its estimate, instead of the machine swapping or the system ending the
//! process. Estimates are of the stage's peak, from the sizes of what it allocates; the test of this module and
//! `docs/robustness.md` compare them with what was measured. On Linux the memory available is the least of what the
//! machine, the control group and the limit of the address space leave, in WebAssembly what 32-bit addresses do;
//! elsewhere it is not known and nothing is refused.

use std::sync::{Mutex, MutexGuard, PoisonError};
use thiserror::Error;

/// A stage would take more memory than there is.
#[derive(Clone, Debug, Error, PartialEq)]
#[error("{stage} would take about {}, but {} are available; {}", size(*.needed), size(*.available),
    remedy.at(*.available as f64 / *.needed as f64))]
pub struct MemoryError {
    /// The stage.
    pub stage: &'static str,
    /// Its estimate, in bytes.
    pub needed: u64,
    /// What there is, in bytes, less what is set aside for stages that run at the same time.
    pub available: u64,
    /// What to do about it.
    pub remedy: Remedy,
}

/// What to do where the memory does not suffice.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Remedy {
    /// Decimate to fewer vertices than the shape has.
    Decimate {
        /// Those that it has.
        vertices: usize,
    },
    /// What this says.
    Other(&'static str),
}

/// The remedy where the full mesh is too large to upscale a map to.
pub(crate) const FULL: Remedy =
    Remedy::Other("decimate the mesh with another program before matching it, or free some memory");

/// Fewer vertices make no map.
const FEWEST: usize = 500;

impl Remedy {
    /// The advice where `share` of the memory is there.
    fn at(&self, share: f64) -> String {
        match self {
            Self::Other(text) => (*text).to_string(),
            // A tenth less than what would just fit, in two digits.
            Self::Decimate { vertices } => match two_digits(0.9 * share * *vertices as f64) {
                fewer if fewer >= FEWEST => format!(
                    "decimate the mesh (--decimate {fewer}), ask for fewer eigenfunctions (-k N) or free some memory"
                ),
                _ => "free some memory".to_string(),
            },
        }
    }
}

/// The number rounded down to two digits.
fn two_digits(number: f64) -> usize {
    let unit = 10f64.powi((number.max(1.0).log10().floor() as i32 - 1).max(0));
    ((number / unit).floor() * unit) as usize
}

fn size(bytes: u64) -> String {
    let mebibytes = bytes as f64 / f64::from(1 << 20);
    if mebibytes < 1024.0 { format!("{mebibytes:.0} MiB") } else { format!("{:.1} GiB", mebibytes / 1024.0) }
}

/// Bytes of the eigenbasis of `k` pairs of a mesh of `n` vertices: the subspace of about 2.3 k + 128 vectors and its
/// panels, the basis, the factor.
pub fn eigenbasis_bytes(n: usize, k: usize) -> u64 {
    let (n, k) = (n as u64, k as u64);
    let subspace = 23 * k / 10 + 128;
    let vectors = 8 * (n * (subspace + k + 32) + 4 * subspace * subspace);
    // The fill of a planar graph's factor grows like n log n (Lipton, Rose and Tarjan 1979).
    let factor = 48 * n * u64::from(n.max(2).ilog2());
    with_margin(vectors + factor)
}

/// Bytes of a described shape: its basis of `k` pairs, SHOT, `[n, 352]` f32, and the network's activations of that
/// size.
pub fn descriptor_bytes(n: usize, k: usize) -> u64 {
    let n = n as u64;
    with_margin(8 * n * k as u64 + 4 * 4 * 352 * n)
}

/// Bytes of a network on `n` vertices, given the widths of its inputs, all f32: the inputs twice, as the caller's and
/// as the back-end's, and activations of some 20 times 128 channels.
pub fn network_bytes(n: usize, input_width: usize) -> u64 {
    with_margin(4 * n as u64 * (2 * input_width as u64 + 20 * 128))
}

/// Allocators and small arrays take their share.
fn with_margin(bytes: u64) -> u64 {
    bytes + bytes / 8
}

/// Bytes of a search among `n_target` rows of width `k` by `n_source` rows, all f64: the transported rows, the sorted
/// copy.
pub fn search_bytes(n_source: usize, n_target: usize, k: usize) -> u64 {
    8 * k as u64 * (2 * n_source as u64 + 2 * n_target as u64)
}

/// Memory set aside for a stage, until dropped.
#[derive(Debug)]
pub struct Reservation(u64);

#[derive(Default)]
struct Ledger {
    /// What there was when nothing was set aside: stages under way take their share of it little by little.
    available: Option<u64>,
    reserved: u64,
}

static LEDGER: Mutex<Ledger> = Mutex::new(Ledger { available: None, reserved: 0 });

fn ledger() -> MutexGuard<'static, Ledger> {
    LEDGER.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Sets memory aside for a stage; hold the result while it runs. `needed` is in bytes, `remedy` what an error advises.
///
/// # Errors
/// Where more is needed than available; never where that is not known.
pub fn reserve(stage: &'static str, needed: u64, remedy: Remedy) -> Result<Reservation, MemoryError> {
    let mut ledger = ledger();
    if ledger.reserved == 0 {
        ledger.available = available();
    }
    let available = ledger.available.map(|all| all.saturating_sub(ledger.reserved));
    if let Some(available) = available.filter(|&available| needed > available) {
        return Err(MemoryError { stage, needed, available, remedy });
    }
    ledger.reserved += needed;
    Ok(Reservation(needed))
}

impl Drop for Reservation {
    fn drop(&mut self) {
        ledger().reserved -= self.0;
    }
}

/// Bytes that this process may still take; `None` where that is not known.
#[cfg(target_os = "linux")]
pub fn available() -> Option<u64> {
    [linux::machine(), linux::control_group(), linux::address_space()].into_iter().flatten().min()
}

/// Bytes that this process may still take; `None` where that is not known.
#[cfg(target_arch = "wasm32")]
pub fn available() -> Option<u64> {
    let pages = core::arch::wasm32::memory_size::<0>() as u64;
    Some((1 << 32) - (pages << 16))
}

/// Bytes that this process may still take; `None` where that is not known.
#[cfg(not(any(target_os = "linux", target_arch = "wasm32")))]
pub fn available() -> Option<u64> {
    None
}

#[cfg(target_os = "linux")]
mod linux {
    use std::fs::read_to_string;
    use std::path::Path;

    /// What the kernel reckons can be had without swapping.
    pub(super) fn machine() -> Option<u64> {
        kibibytes(&read_to_string("/proc/meminfo").ok()?, "MemAvailable:")
    }

    /// What the limit of the address space leaves (`ulimit -v`).
    pub(super) fn address_space() -> Option<u64> {
        let limit = address_limit(&read_to_string("/proc/self/limits").ok()?)?;
        let used = kibibytes(&read_to_string("/proc/self/status").ok()?, "VmSize:")?;
        Some(limit.saturating_sub(used))
    }

    /// What the control groups leave, version 2 or 1.
    pub(super) fn control_group() -> Option<u64> {
        let groups = read_to_string("/proc/self/cgroup").ok()?;
        let own = groups.lines().find_map(|line| line.strip_prefix("0::/"));
        let root = Path::new("/sys/fs/cgroup");
        let unified = own.map(|own| root.join(own)).into_iter();
        let second = unified.flat_map(|own| {
            let groups: Vec<_> =
                own.ancestors().take_while(|g| g.starts_with(root)).map(Path::to_path_buf).collect();
            groups
                .into_iter()
                .filter_map(|group| left(&group, "memory.max", "memory.current", "inactive_file "))
        });
        let first = root.join("memory");
        let first = left(&first, "memory.limit_in_bytes", "memory.usage_in_bytes", "total_inactive_file ");
        second.chain(first).min()
    }

    /// The limit of a group less what is used of it, where the page cache does not count.
    fn left(group: &Path, limit: &str, usage: &str, cache: &str) -> Option<u64> {
        let number = |file: &str| read_to_string(group.join(file)).ok()?.trim().parse::<u64>().ok();
        let (limit, usage) = (number(limit)?, number(usage)?);
        let statistics = read_to_string(group.join("memory.stat")).unwrap_or_default();
        let cached = statistics.lines().find_map(|line| line.strip_prefix(cache)?.trim().parse().ok());
        Some(limit.saturating_sub(usage.saturating_sub(cached.unwrap_or(0))))
    }

    /// The value in bytes of a line such as `VmSize:   1234 kB`.
    pub(super) fn kibibytes(text: &str, key: &str) -> Option<u64> {
        let value = text.lines().find_map(|line| line.strip_prefix(key))?;
        value.trim().strip_suffix("kB")?.trim().parse::<u64>().ok()?.checked_mul(1024)
    }

    /// The soft limit in `/proc/self/limits`; `None` where it is unlimited.
    pub(super) fn address_limit(text: &str) -> Option<u64> {
        let line = text.lines().find_map(|line| line.strip_prefix("Max address space"))?;
        line.split_whitespace().next()?.parse().ok()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_set_aside_is_not_given_twice() {
        let Some(all) = available() else { return };
        let refused = reserve("a test", u64::MAX / 2, Remedy::Other("ask for less")).unwrap_err();
        assert!(refused.to_string().starts_with("a test would take about"), "{refused}");
        let half = reserve("a test", all / 2, Remedy::Other("ask for less"));
        if let Ok(half) = half {
            let second = reserve("a test", all / 4 * 3, Remedy::Other("ask for less")).unwrap_err();
            assert!(second.available <= all - all / 4, "{second}");
            drop(half);
        }
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn the_kernels_tables_are_understood() {
        assert_eq!(
            linux::kibibytes("MemTotal: 5 kB\nMemAvailable:    7 kB\n", "MemAvailable:"),
            Some(7 << 10)
        );
        let limits = "Max data size             unlimited            unlimited            bytes\n\
                      Max address space         2048                 unlimited            bytes\n";
        assert_eq!(linux::address_limit(limits), Some(2048));
        assert_eq!(linux::address_limit("Max address space  unlimited unlimited bytes\n"), None);
        assert!(linux::machine().is_some_and(|bytes| bytes > 1 << 20));
    }

    #[test]
    fn the_remedy_names_a_number_of_vertices_that_fits() {
        let error = |available, vertices| {
            let remedy = Remedy::Decimate { vertices };
            MemoryError { stage: "a test", needed: 100 << 20, available, remedy }.to_string()
        };
        let text = error(50 << 20, 27_654);
        assert!(text.ends_with("50 MiB are available; decimate the mesh (--decimate 12000), ask for fewer eigenfunctions (-k N) or free some memory"), "{text}");
        assert!(error(50 << 20, 1000).ends_with("available; free some memory"));
        assert_eq!([0.0, 7.9, 99.0, 101.0, 12_444.0].map(two_digits), [0, 7, 99, 100, 12_000]);
    }

    #[test]
    fn sizes_read_well() {
        assert_eq!(size(300 << 20), "300 MiB");
        assert_eq!(size(5 << 30), "5.0 GiB");
    }
}
