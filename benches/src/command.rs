//! A program with options.

use std::process::ExitCode;

use crate::stage::Failure;

/// Runs a program with the options it was given, or says how it is used, or why it stops.
pub fn exit_code<A>(
    name: &str,
    usage: &str,
    options: Result<Option<A>, Failure>,
    run: impl FnOnce(&A) -> Result<(), Failure>,
) -> ExitCode {
    let outcome = options.and_then(|options| match options {
        Some(options) => run(&options),
        None => {
            print!("{usage}");
            Ok(())
        }
    });
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => {
            eprintln!("{name}: {failure}");
            ExitCode::from(2)
        }
    }
}
