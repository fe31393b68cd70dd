//! An allocator that asks the system for large pages.
//!
//! The stages take and give back matrices of some megabytes. Each page of 4 KiB that is touched for the first time
//! costs the kernel about as long as to fill it; of 2 MiB there are 512 times fewer. Linux gives them to who asks
//! ("transparent huge pages", mode `madvise`, which most distributions have). A program installs the allocator; the
//! library works with any.

use std::alloc::{GlobalAlloc, Layout, System};

/// A large page, in bytes.
#[cfg_attr(not(target_os = "linux"), allow(dead_code))]
const PAGE: usize = 2 << 20;

/// The system's allocator, which asks for large pages for what is large enough.
///
/// ```
/// #[global_allocator]
/// static ALLOCATOR: fmnet::LargePages = fmnet::LargePages;
///
/// fn main() {
///     assert_eq!(vec![7u8; 3 << 20].iter().filter(|&&b| b == 7).count(), 3 << 20);
/// }
/// ```
#[derive(Clone, Copy, Debug, Default)]
pub struct LargePages;

// SAFETY: all memory comes from and goes back to the system's allocator, with the caller's layouts; advice changes no
// content.
unsafe impl GlobalAlloc for LargePages {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        // SAFETY: the caller's promises are those of the system's allocator.
        advised(unsafe { System.alloc(layout) }, layout.size())
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        // SAFETY: as above.
        advised(unsafe { System.alloc_zeroed(layout) }, layout.size())
    }

    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        // SAFETY: as above.
        advised(unsafe { System.realloc(pointer, layout, size) }, size)
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        // SAFETY: as above.
        unsafe { System.dealloc(pointer, layout) }
    }
}

/// Asks for large pages for those that lie within `size` bytes from `start` on as a whole.
#[cfg(target_os = "linux")]
fn advised(start: *mut u8, size: usize) -> *mut u8 {
    let (first, end) = ((start as usize).next_multiple_of(PAGE), (start as usize + size) / PAGE * PAGE);
    if size >= PAGE && !start.is_null() && end > first {
        // SAFETY: the range is within the block that `start` begins. Where the system declines, nothing changes.
        unsafe { libc::madvise(start.add(first - start as usize).cast(), end - first, libc::MADV_HUGEPAGE) };
    }
    start
}

#[cfg(not(target_os = "linux"))]
fn advised(start: *mut u8, _size: usize) -> *mut u8 {
    start
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blocks_of_every_size_keep_their_content() {
        for size in [1, 100, PAGE - 1, PAGE, 3 * PAGE + 5, 9 * PAGE] {
            let layout = Layout::from_size_align(size, 64).unwrap();
            // SAFETY: the layouts are those that the blocks were taken with, and only their bytes are touched.
            unsafe {
                let block = LargePages.alloc_zeroed(layout);
                assert!(!block.is_null() && (block as usize).is_multiple_of(64));
                let bytes = std::slice::from_raw_parts_mut(block, size);
                assert!(bytes.iter().all(|&b| b == 0));
                bytes.fill(7);
                let larger = LargePages.realloc(block, layout, 2 * size);
                let bytes = std::slice::from_raw_parts(larger, size);
                assert!(bytes.iter().all(|&b| b == 7));
                LargePages.dealloc(larger, Layout::from_size_align(2 * size, 64).unwrap());
            }
        }
    }
}
