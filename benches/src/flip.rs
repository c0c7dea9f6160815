//! FLIP by the script beside this package: there is no Rust implementation here.

use std::fs;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::stage::Failure;
use caustics::filter::Image;

/// Pictures of one scene, in a folder of their own that goes with this.
#[derive(Debug)]
pub struct Flip {
    folder: PathBuf,
    reference: PathBuf,
    tests: Vec<PathBuf>,
}

impl Flip {
    /// With the reference that the pictures are compared with.
    ///
    /// # Errors
    /// If the folder cannot be written.
    pub fn new(reference: &Image) -> Result<Self, Failure> {
        let folder = std::env::temp_dir().join(format!("scoreboard-{}", std::process::id()));
        fs::create_dir_all(&folder)?;
        let path = folder.join("reference.pfm");
        write_pfm(&path, reference)?;
        Ok(Self {
            folder,
            reference: path,
            tests: Vec::new(),
        })
    }

    /// Adds a picture.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn add(&mut self, name: &str, image: &Image) -> Result<(), Failure> {
        let path = self.folder.join(format!("{name}.pfm"));
        write_pfm(&path, image)?;
        self.tests.push(path);
        Ok(())
    }

    /// FLIP of each picture in their order; nothing without Python or its packages.
    #[must_use]
    pub fn evaluate(&self) -> Vec<Option<f64>> {
        let script = concat!(env!("CARGO_MANIFEST_DIR"), "/scripts/flip.py");
        let output = Command::new("python3")
            .arg(script)
            .arg(&self.reference)
            .args(&self.tests)
            .output();
        let values: Vec<f64> = match &output {
            Ok(output) => {
                if !output.status.success() {
                    let message = String::from_utf8_lossy(&output.stderr);
                    eprintln!(
                        "no FLIP: {}",
                        message.trim().lines().last().unwrap_or_default()
                    );
                }
                String::from_utf8_lossy(&output.stdout)
                    .lines()
                    .filter_map(|line| line.parse().ok())
                    .collect()
            }
            Err(error) => {
                eprintln!("no FLIP: python3: {error}");
                Vec::new()
            }
        };
        (0..self.tests.len())
            .map(|index| values.get(index).copied())
            .collect()
    }
}

impl Drop for Flip {
    fn drop(&mut self) {
        // Nothing depends on the folder any more; what stays of it is the system's to clean.
        let _ = fs::remove_dir_all(&self.folder);
    }
}

/// Portable float map: rows from the bottom up, little endian.
fn write_pfm(path: &Path, image: &Image) -> Result<(), Failure> {
    let mut bytes = format!("PF\n{} {}\n-1.0\n", image.width(), image.height()).into_bytes();
    let rows: Vec<&[[f32; 3]]> = image.rows().collect();
    for row in rows.into_iter().rev() {
        for value in row.as_flattened() {
            bytes.write_all(&value.to_le_bytes())?;
        }
    }
    fs::write(path, bytes)?;
    Ok(())
}
