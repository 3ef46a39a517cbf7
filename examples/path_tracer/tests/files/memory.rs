//! How much memory a thread holds, and the most it has held: a global allocator that counts.
//!
//! Key decision: one count for each thread, because tests run side by side and a reader is one thread.

#![allow(unsafe_code, reason = "the trait of allocators is unsafe; every call is handed to the system's allocator as it came")]

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

struct Counting;

#[global_allocator]
static ALLOCATOR: Counting = Counting;

thread_local! {
    static HELD: Cell<isize> = const { Cell::new(0) };
    static MOST: Cell<isize> = const { Cell::new(0) };
}

fn count(bytes: isize) {
    // A thread that ends may free after its counters are gone.
    let _ = HELD.try_with(|held| {
        held.set(held.get().wrapping_add(bytes));
        let _ = MOST.try_with(|most| most.set(most.get().max(held.get())));
    });
}

// SAFETY: all methods pass their arguments on unchanged and return what they get.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        count(layout.size() as isize);
        // SAFETY: the caller's promise.
        unsafe { System.alloc(layout) }
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        count(layout.size() as isize);
        // SAFETY: the caller's promise.
        unsafe { System.alloc_zeroed(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        count(-(layout.size() as isize));
        // SAFETY: the caller's promise.
        unsafe { System.dealloc(pointer, layout) }
    }

    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, new_size: usize) -> *mut u8 {
        // Both exist for a moment, unless the system is lucky.
        count(new_size as isize);
        // SAFETY: the caller's promise.
        let new = unsafe { System.realloc(pointer, layout, new_size) };
        count(-(layout.size() as isize));
        new
    }
}

/// What `work` returns, and the bytes it held at most beyond what was there before.
pub(crate) fn most_held<T>(work: impl FnOnce() -> T) -> (T, usize) {
    let before = HELD.with(Cell::get);
    MOST.with(|most| most.set(before));
    let made = work();
    (made, usize::try_from(MOST.with(Cell::get) - before).unwrap_or(0))
}

/// Kills: a count that forgets what was freed again, zeroed memory, or growth.
#[test]
fn the_peak_is_seen() {
    let (kept, most) = most_held(|| {
        drop(vec![1u8; 1 << 20]);
        vec![0u8; 1 << 10]
    });
    assert!((1 << 20..1 << 21).contains(&most), "{most}");
    assert_eq!(kept.len(), 1 << 10);
    let (_, zeroed) = most_held(|| vec![0u8; 1 << 20]);
    assert!(zeroed >= 1 << 20, "{zeroed}");
    let (_, grown) = most_held(|| {
        let mut grown = vec![1u8; 1 << 20];
        grown.reserve_exact(1 << 20);
    });
    assert!(grown >= 3 << 20, "{grown}");
}
