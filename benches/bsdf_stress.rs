//! The BSDF under stress: `cargo bench --bench bsdf_stress -- --triples 10000000 --seed 1`. Fails where anything is wrong.

#![allow(clippy::print_stdout, clippy::print_stderr, reason = "a benchmark's result is its output")]

use std::process::ExitCode;

use pipeline::disney::stress;

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().collect();
    // `cargo bench` adds arguments of its own; what isn't ours is left alone.
    let number = |name: &str, default: u64| {
        let at = arguments.iter().position(|a| a == name);
        let value = at.and_then(|i| arguments.get(i + 1));
        value.map_or(Ok(default), |v| v.parse().map_err(|_| format!("{name} wants a number, not {v:?}")))
    };
    let (triples, seed) = match (number("--triples", 10_000_000), number("--seed", 1)) {
        (Ok(triples), Ok(seed)) => (triples, seed),
        (Err(message), _) | (_, Err(message)) => {
            eprintln!("{message}");
            return ExitCode::from(64);
        }
    };
    let report = stress::run(triples, seed);
    println!("{report}");
    let violations = report.violations();
    for violation in &violations {
        println!("VIOLATION {violation}");
    }
    if violations.is_empty() { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}
