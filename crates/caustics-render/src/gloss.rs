use caustics_scene::Brdf;
use glam::Vec3;

use crate::columns::ColumnsMut;
use crate::density::Density;
use crate::eye::{reflectance, serving_normal};
use crate::gate::Gate;
use crate::gbuffer::{GBuffer, Texel};

/// The most by which a half vector may turn from one pixel of a level to the next, relative to the
/// width of the lobe, if light is to be interpolated between them.
const TURN: f32 = 0.125;

/// The part of the texels that must not turn more than that.
const STEADY: f32 = 0.95;

/// A glossy texel, ready to be lit.
#[derive(Clone, Copy, Debug, PartialEq)]
struct GlossyTexel {
    position: Vec3,
    normal: Vec3,
    serving_normal: Vec3,
    to_eye: Vec3,
    brdf: Brdf,
    object: u32,
}

impl GlossyTexel {
    fn new(texel: &Texel, buffer: &GBuffer) -> Self {
        let to_eye = buffer.screen.direction_to_eye(texel.position);
        Self {
            position: texel.position,
            normal: texel.normal,
            serving_normal: serving_normal(texel.normal, texel.shading_normal, to_eye),
            to_eye,
            brdf: buffer.brdf(texel),
            object: texel.object,
        }
    }

    /// What a footprint adds to the radiance towards the eye.
    #[inline]
    fn radiance(&self, density: &Density, gate: &Gate) -> Vec3 {
        if !gate.admits(density, self.position, self.normal, Some(self.object)) {
            return Vec3::ZERO;
        }
        let irradiance = density.irradiance(self.position, self.normal);
        if irradiance == Vec3::ZERO {
            return Vec3::ZERO;
        }
        let to_light = -density.incoming;
        reflectance(&self.brdf, self.serving_normal, to_light, self.to_eye) * irradiance
    }
}

/// The glossy texels of a picture, row by row, and those that edges add.
#[derive(Clone, Debug, Default)]
pub(crate) struct GlossyTexels {
    texels: Vec<Option<GlossyTexel>>,
    extras: Vec<GlossyTexel>,
}

impl GlossyTexels {
    pub(crate) fn new(texels: &[Option<Texel>], extras: &[(u32, Texel)], buffer: &GBuffer) -> Self {
        let make = |texel: &Texel| GlossyTexel::new(texel, buffer);
        Self {
            texels: texels.iter().map(|it| it.as_ref().map(make)).collect(),
            extras: extras.iter().map(|(_, texel)| make(texel)).collect(),
        }
    }

    /// Adds a photon's light to the radiance of `count` texels from `first` on; that of the first
    /// is at `target`.
    pub(crate) fn light(
        &self,
        density: &Density,
        gate: &Gate,
        first: usize,
        count: usize,
        radiance: &mut ColumnsMut<'_>,
        target: usize,
    ) {
        for (index, texel) in (target..).zip(&self.texels[first..first + count]) {
            if let Some(texel) = texel {
                radiance.add(index, texel.radiance(density, gate));
            }
        }
    }

    /// What a photon adds to the radiance of an extra texel.
    pub(crate) fn extra_radiance(&self, extra: usize, density: &Density, gate: &Gate) -> Vec3 {
        self.extras[extra].radiance(density, gate)
    }

    /// How often the picture may be halved, at most `levels` times, before its pixels lie too far
    /// apart for the lobes.
    pub(crate) fn halvings(&self, width: usize, levels: u8) -> u8 {
        let mut turns: Vec<f32> = (1..self.texels.len())
            .filter(|index| index % width != 0)
            .filter_map(|index| {
                let (one, other) = (
                    self.texels[index - 1].as_ref()?,
                    self.texels[index].as_ref()?,
                );
                let alpha = one.brdf.alpha()?.min(other.brdf.alpha()?);
                let turn =
                    (other.serving_normal - one.serving_normal) - 0.5 * (other.to_eye - one.to_eye);
                Some(turn.length() / alpha)
            })
            .collect();
        if turns.is_empty() {
            return levels;
        }
        let rank = (STEADY * turns.len() as f32) as usize;
        let rank = rank.min(turns.len() - 1);
        let turn = *turns.select_nth_unstable_by(rank, f32::total_cmp).1;
        let halvings = (TURN / turn).log2().floor();
        // Also where nothing turns and the quotient is infinite.
        halvings.clamp(0.0, f32::from(levels)) as u8
    }
}
