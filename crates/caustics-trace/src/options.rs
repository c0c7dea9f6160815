use caustics_sampling::Sequence;
use thiserror::Error;

use crate::culling::Culling;

/// What happens to a photon where a surface both reflects and refracts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Branching {
    /// It goes one way, chosen with the Fresnel term as the probability, at its full flux.
    Roulette,
    /// It goes both ways at the first such event, each with its part of the flux, and one way at
    /// every later one.
    SplitFirst,
    /// It goes both ways at every such event, each with its part of the flux, until a part falls
    /// below [`TraceOptions::min_weight`]. Each order of reflection is then a caustic of its own,
    /// with as regular a set of photons as the light emits.
    #[default]
    SplitAll,
}

/// Where the lights aim their photons.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Aim {
    /// Into every direction in which the light shines. A directional light covers the bounding
    /// sphere of the scene.
    Everywhere,
    /// At each specular object, or group of objects that nest, into the cone (or, for a directional
    /// light, the rectangle) that just holds it. Nothing that could become a caustic is left out.
    Cones,
    /// Likewise, but only into those parts of the cone or the rectangle where the caster's own
    /// outline is, where finding it costs less than it saves.
    #[default]
    Casters,
}

/// How photons are traced.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TraceOptions {
    /// Photons emitted, by all lights together. With [`Aim::Casters`] a few less, where no lattice
    /// has exactly as many points on a caster's outline.
    pub photons: u32,
    /// Chooses the random numbers; the same seed gives the same bits.
    pub seed: u64,
    /// Surfaces that a path may meet before it is cut off. Long chains of inner reflections carry
    /// real energy: at 24, a scene with several glasses loses 2.5 % of its caustic.
    pub max_depth: u32,
    /// What happens where a surface both reflects and refracts.
    pub branching: Branching,
    /// Paths whose flux falls below this part of their emitted flux meet Russian roulette, at
    /// which a survivor gets exactly this part. In 0..=1; 0 turns it off.
    pub min_weight: f32,
    /// Where the lights aim.
    pub aim: Aim,
    /// The least number of photons that each pair of a light and a caster gets, as a part of an
    /// equal share: a strong light does not starve a weak one. In 0..=1. The default is the largest of
    /// those measured in `docs/emission.md` that costs the strong one at most a quarter in error.
    pub share_floor: f32,
    /// The points that choose emission directions and positions.
    pub sequence: Sequence,
    /// Whether photons are sent more densely where their footprints would be wide, and less where they would
    /// be small, at a caster by a light other than an environment: a few that go ahead tell where
    /// ([`EmissionBatch::density`](crate::EmissionBatch::density)). That is kept from frame to frame while
    /// the light's rays are. Without, the error of the ten scenes of `docs/footprints.md` is 1.22 times as
    /// large in the mean at 262,144 photons, and twice as large at most. It needs
    /// [`differentials`](Self::differentials) and another aim than [`Aim::Everywhere`], and does nothing
    /// without.
    pub guide_emission: bool,
    /// Whether footprints on a lattice are checked against where neighbours landed, shortened where
    /// those are nearer, averaged with them where they agree, and drawn in at the edges of sheets of light.
    pub check_footprints: bool,
    /// Whether the last photons of a lattice's rows are divided, where a sheet of light ends: a few more
    /// rays find where, and what of the cell is left is traced in parts, as is the light of sheets that are
    /// narrower than a cell; light that met more than 28 surfaces is not. Edges become sharp and stand where
    /// they are, and what lands near a silhouette is where it is: without, the error of the ten scenes of
    /// `docs/footprints.md` is 2.4 times as large in the mean. Of 65,536 photons tracing takes a fifth longer for
    /// it in `p06_wave_plane` and twice as long in `p03_cognac`. It needs
    /// [`check_footprints`](Self::check_footprints) and [`Branching::SplitAll`], and does nothing without.
    pub divide_edges: bool,
    /// Whether footprints that [overlap](crate::Coverage::Overlap) are reflected where their receiver ends, so
    /// that what they spread beyond comes back: see [`Boundaries`](crate::Boundaries). Without, receivers are up
    /// to half too dark along their ends. In the Cornell box of `docs/accuracy.md` that halves the error without
    /// the reference's noise at two million photons, for 2 to 7 % more footprints.
    pub reflect_at_boundaries: bool,
    /// Whether photons carry differentials. Without, their footprints have no axes and nothing tells where
    /// more of them are wanted ([`guide_emission`](Self::guide_emission)): enough for estimates from the
    /// nearest photons, at less time.
    pub differentials: bool,
    /// Which photons are not stored though they land.
    pub culling: Culling,
}

impl Default for TraceOptions {
    fn default() -> Self {
        Self {
            photons: 262_144,
            seed: 0,
            max_depth: 128,
            branching: Branching::SplitAll,
            min_weight: 0.03,
            aim: Aim::Casters,
            share_floor: 0.25,
            sequence: Sequence::Grid,
            guide_emission: true,
            check_footprints: true,
            divide_edges: true,
            reflect_at_boundaries: true,
            differentials: true,
            culling: Culling::default(),
        }
    }
}

impl TraceOptions {
    /// Checks every number.
    ///
    /// # Errors
    /// A weight out of range, or a depth at which no photon could be stored.
    pub fn validate(&self) -> Result<(), TraceError> {
        if !(0.0..=1.0).contains(&self.min_weight) {
            return Err(TraceError::MinWeight {
                min_weight: self.min_weight,
            });
        }
        if !(self.culling.min_flux >= 0.0 && self.culling.min_flux.is_finite()) {
            return Err(TraceError::MinFlux {
                min_flux: self.culling.min_flux,
            });
        }
        if self.culling.max_area.is_nan() || self.culling.max_area < 0.0 {
            return Err(TraceError::MaxArea {
                max_area: self.culling.max_area,
            });
        }
        if let Some(limit) = self.culling.max_solid_angle
            && !(limit.steradians >= 0.0 && limit.eye.is_finite())
        {
            return Err(TraceError::MaxSolidAngle {
                steradians: limit.steradians,
                eye: limit.eye.to_array(),
            });
        }
        if !(0.0..=1.0).contains(&self.share_floor) {
            return Err(TraceError::ShareFloor {
                share_floor: self.share_floor,
            });
        }
        if self.max_depth < 2 {
            return Err(TraceError::MaxDepth {
                max_depth: self.max_depth,
            });
        }
        Ok(())
    }
}

/// What can be wrong with the options of a tracing.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum TraceError {
    /// A roulette threshold that is not a part of the whole.
    #[error("the least weight {min_weight} is not between 0 and 1")]
    MinWeight {
        /// The threshold.
        min_weight: f32,
    },
    /// A floor that is not a part of an equal share.
    #[error("the floor of shares {share_floor} is not between 0 and 1")]
    ShareFloor {
        /// The floor, in parts of an equal share.
        share_floor: f32,
    },
    /// A flux below which photons are thinned that is none.
    #[error("the least flux {min_flux} is not a finite number of at least 0")]
    MinFlux {
        /// The flux, in watts.
        min_flux: f32,
    },
    /// An area of footprints that is none.
    #[error("the largest area of footprints {max_area} is not a number of at least 0")]
    MaxArea {
        /// The area, in square metres.
        max_area: f32,
    },
    /// A solid angle of footprints that is none, or an eye that is nowhere.
    #[error("the largest solid angle {steradians} from {eye:?} is not a number of at least 0")]
    MaxSolidAngle {
        /// The solid angle, in steradians.
        steradians: f32,
        /// The eye, in metres.
        eye: [f32; 3],
    },
    /// A depth at which no path reaches a receiver after a specular surface.
    #[error("the maximum depth {max_depth} is less than 2, so no caustic could be stored")]
    MaxDepth {
        /// The depth.
        max_depth: u32,
    },
}
