//! The library as a WebAssembly module for the page's workers.
//!
//! A match is three runs: [`describe`] of either shape, which may go on at the same time in two workers, and
//! [`match_described`]. Each run has an instance of the module to itself, so that nothing is left over from the last
//! one. It sends back everything by one imported function, `page.send(kind, data)`: while it runs `event`, a stage or
//! a warning in JSON, and at the end what it made; or instead `error`, a text for people, of bad input, or `panic`,
//! of a failure of the library.

mod run;

use std::slice;

#[link(wasm_import_module = "page")]
unsafe extern "C" {
    #[link_name = "send"]
    fn page_send(kind: *const u8, kind_len: usize, data: *const u8, len: usize);
}

/// Gives something to the page, which copies it.
fn send(kind: &str, data: &[u8]) {
    // SAFETY: the page only reads the two slices, before it returns.
    unsafe { page_send(kind.as_ptr(), kind.len(), data.as_ptr(), data.len()) }
}

/// Memory for an argument, which the function called takes back.
#[unsafe(no_mangle)]
pub extern "C" fn allocate(len: usize) -> *mut u8 {
    Box::leak(vec![0; len].into_boxed_slice()).as_mut_ptr()
}

/// # Safety
/// The pointer is of [`allocate`] with this length, and is not used again.
unsafe fn taken(data: *mut u8, len: usize) -> Box<[u8]> {
    // SAFETY: as the caller promises.
    unsafe { Box::from_raw(slice::from_raw_parts_mut(data, len)) }
}

/// Describes the shape of a file, whose name is in UTF-8; as a part of a shape of the given area where that is above 0. Sends
/// `described`, bytes for [`match_described`], and `shape`, in JSON its area.
///
/// # Safety
/// Each pointer is of [`allocate`] with the length that follows it, and none is used again.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn describe(
    name: *mut u8,
    name_len: usize,
    file: *mut u8,
    len: usize,
    whole_area: f64,
) {
    // SAFETY: as the caller promises.
    let (name, file) = unsafe { (taken(name, name_len), taken(file, len)) };
    let name = String::from_utf8_lossy(&name).into_owned();
    answered(|| run::describe(&name, file, (whole_area > 0.0).then_some(whole_area)));
}

/// Matches two shapes that [`describe`] sent. Sends `summary` (JSON), `viewer` (HTML) and the files `map.txt`,
/// `map.csv` and `pair.glb`.
///
/// # Safety
/// As for [`describe`].
#[unsafe(no_mangle)]
pub unsafe extern "C" fn match_described(
    source: *mut u8,
    source_len: usize,
    target: *mut u8,
    target_len: usize,
) {
    // SAFETY: as the caller promises.
    let (source, target) = unsafe { (taken(source, source_len), taken(target, target_len)) };
    answered(|| run::match_described(source, target));
}

/// Tells the page where the work fails.
fn answered(work: impl FnOnce() -> Result<(), Box<dyn std::error::Error>>) {
    std::panic::set_hook(Box::new(|info| send("panic", info.to_string().as_bytes())));
    if let Err(error) = work() {
        send("error", fmnet::causes(error.as_ref()).as_bytes());
    }
}
