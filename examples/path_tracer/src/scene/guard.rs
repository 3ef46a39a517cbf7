//! A fence around decoders that are not ours.
//!
//! Key decision: a panic of a foreign decoder on a broken file becomes an error like any other. Our profile checks integer overflow in
//! every crate, and decoders written for wrapping arithmetic may then panic where a release build of theirs would not.

use std::panic::{AssertUnwindSafe, catch_unwind};

/// Runs a decoder that shares no state with anything that outlives it.
pub(crate) fn guarded<T>(decode: impl FnOnce() -> Result<T, String>) -> Result<T, String> {
    catch_unwind(AssertUnwindSafe(decode)).unwrap_or_else(|_| Err(String::from("the decoder failed on this content")))
}
