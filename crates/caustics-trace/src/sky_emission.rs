use std::f32::consts::PI;

use caustics_geometry::{Frame, Ray, Sphere};
use caustics_sampling::warp::square_to_disc_concentric;
use caustics_scene::Environment;
use glam::Vec2;

use crate::differential::{BLUR_EDGE, RayDifferential};
use crate::emission::{Emission, EmissionSample};

/// A photon from the sky, from a direction by importance, at a place that is even over the
/// cross-section of the target.
///
/// Positions are the lattice's steps, as for a sun; directions, a [`BLUR_EDGE`] of the square that the
/// inverse of their density spans, are what blurs: little where the sky has a bright spot. They turn
/// about the place where the photon crosses the disc around the target's middle.
pub(crate) fn emit<const N: usize>(
    sky: &Environment,
    target: &Sphere,
    distance: f32,
    sample: &EmissionSample,
) -> Option<Emission<N>> {
    let from = sky.sample(sample.place);
    if !(from.pdf > 0.0 && from.pdf.is_finite()) {
        return None;
    }
    let frame = Frame::from_normal(from.towards);
    let across = |it: Vec2| frame.to_world((target.radius * it).extend(0.0));
    let place = square_to_disc_concentric(sample.point);
    let area = PI * target.radius * target.radius;
    let count = sample.count as f32;
    let edge = count.sqrt().recip() * sample.weight.sqrt();
    let angle = BLUR_EDGE * from.pdf.sqrt().recip();
    let turned = [angle * frame.tangent, angle * frame.bitangent];
    let steps = [edge * across(place.d_du), edge * across(place.d_dv)];
    // The steps come first, as for every light with four parameters.
    let mut differential = RayDifferential::ZERO;
    let moved = steps.into_iter().chain(turned.map(|it| -distance * it));
    for (slot, moved) in differential.position.iter_mut().zip(moved) {
        *slot = moved;
    }
    for (slot, turned) in differential.direction.iter_mut().skip(2).zip(turned) {
        *slot = turned;
    }
    Some(Emission {
        ray: Ray::new(
            target.center + distance * from.towards + across(place.value),
            -from.towards,
        ),
        flux: from.radiance * (area / (from.pdf * count) * sample.weight),
        differential,
    })
}
