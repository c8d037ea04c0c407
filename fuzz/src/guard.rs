//! Panics: those that the program catches itself are no finding, all others are.

use std::panic::{catch_unwind, set_hook, take_hook};
use std::sync::{Mutex, Once, PoisonError};

static LAST: Mutex<String> = Mutex::new(String::new());

/// Runs `body` over `input`; a panic that comes out of it is shown and ends the process.
///
/// The fuzzer's own hook ends the process at every panic, also at those of decoders that the program guards.
pub fn run(body: fn(&[u8]), input: &[u8]) {
    static ONCE: Once = Once::new();
    ONCE.call_once(|| {
        drop(take_hook());
        set_hook(Box::new(|info| {
            let trace = std::backtrace::Backtrace::force_capture();
            *LAST.lock().unwrap_or_else(PoisonError::into_inner) = format!("{info}\n{trace}");
        }));
    });
    if catch_unwind(|| body(input)).is_err() {
        eprintln!("{}", LAST.lock().unwrap_or_else(PoisonError::into_inner));
        std::process::abort();
    }
}
