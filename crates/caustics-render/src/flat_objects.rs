use glam::Vec3;

use crate::gate::MIN_NORMAL_COSINE;
use crate::gbuffer::{GBuffer, Texel};

/// By how much unit normals of one plane may differ.
const NORMAL_TOLERANCE: f32 = 1e-4;

/// How far off their plane points may be, in their largest coordinate: what rounding does to them.
const PLANE_TOLERANCE: f32 = 1e-5;

/// An object of more planes than this counts as curved: it would take long to tell.
const MOST_PLANES: usize = 8;

/// For each object up to the last that is seen, whether it curves: whether two parts of it that a
/// footprint may light at once lie in different planes. A box does not, since its faces stand upright on
/// each other; stairs and spheres do.
pub(crate) fn curved_objects(buffer: &GBuffer) -> Vec<bool> {
    let mut planes: Vec<Planes> = Vec::new();
    let extras = buffer.extras.iter().map(|(_, texel)| texel);
    for texel in buffer.texels.iter().flatten().chain(extras) {
        let object = texel.object as usize;
        if planes.len() <= object {
            planes.resize_with(object + 1, Planes::default);
        }
        planes[object].add(texel);
    }
    planes.into_iter().map(|it| it.is_curved).collect()
}

/// The planes that an object has been seen in.
#[derive(Clone, Debug, Default)]
struct Planes {
    /// A point of each, and its normal.
    known: Vec<(Vec3, Vec3)>,
    is_curved: bool,
}

impl Planes {
    fn add(&mut self, texel: &Texel) {
        let is_in = |(point, normal): &(Vec3, Vec3)| {
            let off = (texel.position - point).dot(*normal).abs();
            let size = texel.position.abs().max(point.abs()).max_element();
            texel.normal.distance_squared(*normal) <= NORMAL_TOLERANCE * NORMAL_TOLERANCE
                && off <= PLANE_TOLERANCE * size
        };
        // Those seen last are the likeliest.
        if self.is_curved || self.known.iter().rev().any(is_in) {
            return;
        }
        let is_beside = |(_, normal): &(Vec3, Vec3)| texel.normal.dot(*normal) >= MIN_NORMAL_COSINE;
        self.is_curved = self.known.len() == MOST_PLANES || self.known.iter().any(is_beside);
        self.known.push((texel.position, texel.normal));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pixel_samples::PixelSamples;

    fn is_curved(parts: &[(Vec3, Vec3)]) -> bool {
        let mut planes = Planes::default();
        for &(position, normal) in parts {
            planes.add(&Texel {
                position,
                normal: normal.normalize(),
                shading_normal: normal.normalize(),
                coverage: 1.0,
                samples: PixelSamples::ALL,
                material: 0,
                object: 0,
            });
        }
        planes.is_curved
    }

    #[test]
    fn boxes_are_flat_and_stairs_and_bends_are_not() {
        let floor = [(Vec3::ZERO, Vec3::Y), (Vec3::new(3.0, 1e-6, 2.0), Vec3::Y)];
        assert!(!is_curved(&floor));
        let sides = [
            Vec3::X,
            Vec3::Y,
            Vec3::Z,
            Vec3::NEG_X,
            Vec3::NEG_Y,
            Vec3::NEG_Z,
        ];
        assert!(!is_curved(&sides.map(|it| (it, it))));
        assert!(is_curved(&[(Vec3::ZERO, Vec3::Y), (Vec3::Y, Vec3::Y)]));
        let bent = Vec3::new(0.01, 1.0, 0.0);
        assert!(is_curved(&[(Vec3::ZERO, Vec3::Y), (Vec3::ZERO, bent)]));
    }
}
