//! What is lost where photons are stored in few bytes.

use std::fmt::Write as _;

use caustics::filter::relative_mse;
use caustics::prelude::*;
use caustics::render::{FootprintOptions, GBuffer, splat};
use caustics::trace::{CompactFootprint, trace_photons};
use caustics_benches::stage::{Failure, Stage};

const SCENES: [&str; 4] = ["p01_sphere", "p03_cognac", "p07_pool", "p10_torus_cube"];

const PHOTONS: u32 = 1 << 16;

pub(crate) fn section() -> Result<String, Failure> {
    let mut text = format!(
        "## Photons in 20 bytes\n\n\
        Pictures of {PHOTONS} photons that went through `CompactFootprint` ({} bytes with the axes, of \
        {} before) against those of the same photons as they were: relMSE of the one to the other, \
        the ratio of their sums, and for scale the relMSE of the full ones to the reference.\n\n\
        | scene | relMSE | energy | relMSE to the reference |\n| --- | --: | --: | --: |\n",
        size_of::<CompactFootprint>(),
        size_of::<Photon>(),
    );
    for name in SCENES {
        let stage = Stage::load(name)?;
        let (width, height) = (stage.reference.width(), stage.reference.height());
        let (world, rays) = (&stage.world, &stage.intersector);
        let buffer = GBuffer::new(world, rays, &stage.camera, width, height)?;
        let options = TraceOptions {
            photons: PHOTONS,
            ..TraceOptions::default()
        };
        let full = trace_photons(world, rays, &options, &|_| {})?.photons;
        let there_and_back = |photon: &Photon| {
            let compact = CompactFootprint::from(photon);
            Photon {
                position: compact.photon().position(),
                incoming: compact.photon().incoming(),
                normal: compact.photon().normal(),
                flux: compact.photon().flux(),
                axes: compact.axes(),
                ..*photon
            }
        };
        let compact: Vec<Photon> = full.iter().map(there_and_back).collect();
        let picture = |photons: &[Photon]| splat(&buffer, photons, &FootprintOptions::default());
        let (full, compact) = (picture(&full)?.0, picture(&compact)?.0);
        writeln!(
            text,
            "| {name} | {:.1e} | {:.6} | {:.5} |",
            relative_mse(&compact, &full)?,
            compact.mean() / full.mean(),
            relative_mse(&full, &stage.reference)?,
        )?;
    }
    Ok(text)
}
