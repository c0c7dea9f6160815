//! Measures how photons are emitted: what aiming saves, what flickers, what weak lights get, how
//! progressive pictures converge, what culling saves and costs. Writes `docs/emission.md`.
//!
//! ```text
//! cargo run --release -p caustics-benches --bin emission [section ...]
//! ```
//!
//! Sections are `aim`, `frames`, `share`, `progressive`, `area`, `cull` and
//! `compact`; those that are not named stay as
//! they are. All take some minutes. Every number but the seconds is the same on any machine.

mod aim;
mod area;
mod compact;
mod converge;
mod cull;
mod frames;
mod share;
mod view;

use std::fs;
use std::path::Path;

use caustics_benches::stage::Failure;

const INTRODUCTION: &str = "\
# How photons are emitted

Measured by `cargo run --release -p caustics-benches --bin emission`, which writes this page; the
default estimate (`grid-gaussian`) unless said. relMSE is the mean of `(t - r)² / (r² + (0.1 mean
r)²)` over all pixels and channels. Every number but the seconds is the same on any machine; the
seconds are of two threads of a shared one, so compare them only within a table.
";

type Section = fn() -> Result<String, Failure>;

const SECTIONS: [(&str, Section); 7] = [
    ("aim", aim::section),
    ("frames", frames::section),
    ("share", share::section),
    ("progressive", converge::section),
    ("area", area::section),
    ("cull", cull::section),
    ("compact", compact::section),
];

fn main() -> Result<(), Failure> {
    let wanted: Vec<String> = std::env::args().skip(1).collect();
    if let Some(unknown) = wanted
        .iter()
        .find(|it| SECTIONS.iter().all(|(name, _)| name != it))
    {
        return Err(format!("no section is called {unknown}").into());
    }
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../docs/emission.md");
    for (name, section) in SECTIONS {
        if wanted.is_empty() || wanted.iter().any(|it| it == name) {
            eprintln!("{name}");
            replace(Path::new(path), name, section()?.trim_end())?;
        }
    }
    Ok(())
}

/// Writes one section into the page and leaves the others as they are: at once, so that little is
/// lost when the program is stopped.
fn replace(path: &Path, name: &str, text: &str) -> Result<(), Failure> {
    let old = fs::read_to_string(path).unwrap_or_default();
    let mark = |name: &str| format!("<!-- {name} -->\n");
    let mut page = INTRODUCTION.to_owned();
    for (section, _) in SECTIONS {
        let kept = old
            .split_once(&mark(section))
            .map(|(_, rest)| rest.split("<!-- ").next().unwrap_or_default().trim());
        let body = if section == name { Some(text) } else { kept };
        if let Some(body) = body {
            page.push_str(&format!("\n{}\n{body}\n", mark(section)));
        }
    }
    fs::write(path, page)?;
    Ok(())
}
