//! Ctrl-C: the first asks for what is finished, the second ends at once.

use std::sync::atomic::{AtomicBool, Ordering};

use super::Failure;

/// As shells have it for a process that was interrupted.
pub(crate) const EXIT_CODE: u8 = 130;

static IS_ASKED: AtomicBool = AtomicBool::new(false);
static LISTENS: AtomicBool = AtomicBool::new(false);

/// From here on Ctrl-C is counted instead of ending the process; once is enough.
pub(crate) fn listen() -> Result<(), Failure> {
    if LISTENS.swap(true, Ordering::Relaxed) {
        return Ok(());
    }
    ctrlc::set_handler(|| {
        if IS_ASKED.swap(true, Ordering::Relaxed) {
            std::process::exit(i32::from(EXIT_CODE));
        }
        eprintln!("stopping; what is finished will be written (Ctrl-C again ends at once)");
    })
    .map_err(|error| Failure::Runtime(format!("Ctrl-C cannot be listened to: {error}")))
}

/// True after the first one.
pub(crate) fn is_asked() -> bool {
    IS_ASKED.load(Ordering::Relaxed)
}
