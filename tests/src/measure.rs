//! Flux of photons in regions of a horizontal receiver, and its error against an oracle.

use caustics_accel::BvhOptions;
use caustics_sampling::Sequence;
use caustics_scene::{Scene, World};
use caustics_trace::{Branching, Photon, PhotonMap, TraceOptions, trace_photons};
use glam::DVec2;

use crate::TestError;

/// A part of the plane of x and z.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Region {
    /// All of it.
    Everything,
    /// A disc.
    Disc {
        /// Its centre, in metres.
        center: DVec2,
        /// Its radius, in metres.
        radius: f64,
    },
    /// A rectangle along the axes.
    Rectangle {
        /// Its least x and z, in metres.
        min: DVec2,
        /// Its largest x and z, in metres.
        max: DVec2,
    },
}

impl Region {
    /// Whether a point lies in it.
    #[must_use]
    pub fn contains(&self, point: DVec2) -> bool {
        match *self {
            Self::Everything => true,
            Self::Disc { center, radius } => center.distance_squared(point) <= radius * radius,
            Self::Rectangle { min, max } => point.cmpge(min).all() && point.cmple(max).all(),
        }
    }

    /// The flux, in watts, that photons carry into it: that of their first channel.
    pub fn flux<'a>(&self, photons: impl IntoIterator<Item = &'a Photon>) -> f64 {
        photons
            .into_iter()
            .filter(|photon| {
                let position = photon.position.as_dvec3();
                self.contains(DVec2::new(position.x, position.z))
            })
            .map(|photon| f64::from(photon.flux.x))
            .sum()
    }
}

/// Regions with the flux that an oracle says they get.
#[derive(Clone, Debug, PartialEq)]
pub struct FluxProbes(Vec<(Region, f64)>);

impl FluxProbes {
    /// Regions, each with its exact flux in watts, which must not be 0.
    pub fn new(probes: impl IntoIterator<Item = (Region, f64)>) -> Self {
        Self(probes.into_iter().collect())
    }

    /// The same regions with all fluxes times `factor`: a wrong oracle, which must be told from
    /// the right one.
    #[must_use]
    pub fn scaled(&self, factor: f64) -> Self {
        Self(
            self.0
                .iter()
                .map(|&(region, flux)| (region, factor * flux))
                .collect(),
        )
    }

    /// The relative error of the photons' flux in a region, root mean square over the regions.
    ///
    /// Not a number where there is no region or one without flux, which no bound accepts.
    pub fn error<'a>(&self, photons: impl IntoIterator<Item = &'a Photon>) -> f64 {
        let photons: Vec<&Photon> = photons.into_iter().collect();
        let squares = self.0.iter().map(|(region, flux)| {
            let measured = region.flux(photons.iter().copied());
            (measured / flux - 1.0).powi(2)
        });
        (squares.sum::<f64>() / self.0.len() as f64).sqrt()
    }
}

/// The error at one number of photons.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ErrorAt {
    /// Photons emitted.
    pub photons: u32,
    /// The relative error of [`FluxProbes::error`], root mean square over the seeds.
    pub error: f64,
}

/// Traces a scene once for each number of photons and each seed, and measures the photons of
/// `events` specular events against the probes.
///
/// # Errors
/// If the scene cannot be traced.
pub fn convergence(
    scene: &Scene,
    options: &TraceOptions,
    events: u32,
    probes: &FluxProbes,
    counts: &[u32],
    seeds: std::ops::Range<u64>,
) -> Result<Vec<ErrorAt>, TestError> {
    let mut errors = Vec::new();
    for &photons in counts {
        let mut squares = 0.0;
        for seed in seeds.clone() {
            let map = trace(
                scene,
                &TraceOptions {
                    photons,
                    seed,
                    ..*options
                },
            )?;
            let counted = map.photons.iter().filter(|photon| photon.events == events);
            squares += probes.error(counted).powi(2);
        }
        let error = (squares / (seeds.end - seeds.start) as f64).sqrt();
        println!("{photons:>8} photons: error {error:.2e}");
        errors.push(ErrorAt { photons, error });
    }
    Ok(errors)
}

/// Options by which nothing but the points of the sequence decides about the flux: no roulette, and
/// paths that end at the surface number `max_depth`.
#[must_use]
pub fn without_chance(sequence: Sequence, max_depth: u32) -> TraceOptions {
    TraceOptions {
        sequence,
        max_depth,
        branching: Branching::SplitAll,
        min_weight: 0.0,
        ..TraceOptions::default()
    }
}

/// Traces the photons of a scene.
///
/// # Errors
/// If the scene cannot be traced.
pub fn trace(scene: &Scene, options: &TraceOptions) -> Result<PhotonMap, TestError> {
    let world = World::new(scene)?;
    let intersector = world.intersector(&BvhOptions::default())?;
    Ok(trace_photons(&world, &intersector, options, &|_| {})?)
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

    fn photon(x: f32, z: f32, flux: f32) -> Photon {
        Photon {
            position: Vec3::new(x, 7.0, z),
            incoming: Vec3::NEG_Y,
            flux: Vec3::new(flux, 100.0, 100.0),
            normal: Vec3::Y,
            axes: [Vec3::X, Vec3::Z],
            object: 0,
            events: 1,
            source: caustics_trace::FootprintSource::Differential,
            coverage: caustics_trace::Coverage::Cell,
        }
    }

    #[test]
    fn counts_what_lies_inside() {
        let photons = [
            photon(0.0, 0.0, 1.0),
            photon(0.5, 0.2, 2.0),
            photon(-0.5, 0.9, 4.0),
        ];
        let disc = Region::Disc {
            center: DVec2::new(0.5, 0.0),
            radius: 0.5,
        };
        let (min, max) = (DVec2::new(-1.0, 0.1), DVec2::ONE);
        assert_eq!(Region::Everything.flux(&photons), 7.0);
        assert_eq!(disc.flux(&photons), 3.0);
        assert_eq!(Region::Rectangle { min, max }.flux(&photons), 6.0);
    }

    #[test]
    fn error_is_relative_and_never_passes_for_want_of_regions() {
        let photons = [photon(0.0, 0.0, 1.0)];
        let probes = FluxProbes::new([(Region::Everything, 1.0)]);
        assert_eq!(probes.error(&photons), 0.0);
        assert_eq!(probes.scaled(2.0).error(&photons), 0.5);
        assert_eq!(probes.error(&[]), 1.0);
        assert!(FluxProbes::new([]).error(&photons).is_nan());
        assert!(
            FluxProbes::new([(Region::Everything, 0.0)])
                .error(&[])
                .is_nan()
        );
    }
}
