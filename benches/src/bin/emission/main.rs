//! Measures how photons are emitted: what aiming saves, what flickers, what weak lights get, how
//! progressive pictures converge. Writes `docs/emission.md`.
//!
//! ```text
//! cargo run --release -p caustics-benches --bin emission [file.md]
//! ```
//!
//! It takes some minutes. Every number but the seconds is the same on any machine.

mod aim;
mod area;
mod converge;
mod frames;
mod share;
mod view;

use std::fmt::Write as _;
use std::fs;

use caustics_benches::stage::Failure;

const INTRODUCTION: &str = "\
# How photons are emitted

Measured by `cargo run --release -p caustics-benches --bin emission`, which writes this page; the
default estimate (`grid-gaussian`) unless said. relMSE is the mean of `(t - r)² / (r² + (0.1 mean
r)²)` over all pixels and channels. Every number but the seconds is the same on any machine; the
seconds are of two threads of a shared one, so compare them only within a table.

";

fn main() -> Result<(), Failure> {
    let path = std::env::args()
        .nth(1)
        .unwrap_or_else(|| concat!(env!("CARGO_MANIFEST_DIR"), "/../docs/emission.md").to_owned());
    let mut page = INTRODUCTION.to_owned();
    for (name, section) in [
        ("aim", aim::section as fn() -> Result<String, Failure>),
        ("frames", frames::section),
        ("share", share::section),
        ("progressive", converge::section),
        ("area lights", area::section),
    ] {
        eprintln!("{name}");
        writeln!(page, "{}", section()?.trim_end())?;
        writeln!(page)?;
    }
    fs::write(&path, format!("{}\n", page.trim_end()))?;
    eprintln!("wrote {path}");
    Ok(())
}
