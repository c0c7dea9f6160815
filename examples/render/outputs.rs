//! The files that the program writes, and whether it will be able to.

use std::fs::OpenOptions;
use std::path::{Path, PathBuf};

use caustics::filter::{Display, write_exr, write_png};
use caustics::prelude::*;

use crate::arguments::Arguments;

/// Checks that every file can be written, before time is spent on what goes into it.
///
/// A file that is there keeps its contents; one that is not is not left behind.
pub(crate) fn check(arguments: &Arguments) -> Result<(), String> {
    let others = [
        &arguments.caustics_only,
        &arguments.direct_only,
        &arguments.stats,
    ];
    let mut paths: Vec<&PathBuf> = vec![&arguments.out];
    paths.extend(others.into_iter().flatten());
    for (index, path) in paths.iter().enumerate() {
        if arguments.scene.as_ref() == Some(path) {
            return Err(format!(
                "{}: the scene itself would be overwritten",
                path.display()
            ));
        }
        if paths[..index].contains(path) {
            return Err(format!("{}: two outputs into one file", path.display()));
        }
        probe(path).map_err(|error| format!("{}: cannot write: {error}", path.display()))?;
    }
    Ok(())
}

fn probe(path: &Path) -> std::io::Result<()> {
    let existed = path.symlink_metadata().is_ok();
    OpenOptions::new()
        .write(true)
        .create(true)
        .truncate(false)
        .open(path)?;
    if existed {
        Ok(())
    } else {
        std::fs::remove_file(path)
    }
}

/// Writes the pictures that were asked for.
pub(crate) fn write(arguments: &Arguments, picture: &Picture) -> Result<(), String> {
    let display = Display {
        exposure_ev: arguments.exposure,
        ..Display::default()
    };
    write_png(&arguments.out, &picture.total(), &display).map_err(|error| error.to_string())?;
    let exrs: [(&Option<_>, &Image); 2] = [
        (&arguments.caustics_only, &picture.caustics),
        (&arguments.direct_only, &picture.direct),
    ];
    for (path, image) in exrs {
        if let Some(path) = path {
            write_exr(path, image).map_err(|error| error.to_string())?;
        }
    }
    Ok(())
}
