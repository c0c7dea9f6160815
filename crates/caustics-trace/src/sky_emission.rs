use std::f32::consts::PI;

use caustics_geometry::{Frame, Ray, Sphere};
use caustics_sampling::warp::square_to_disc_concentric;
use caustics_scene::Environment;
use glam::Vec2;

use crate::area_emission::NARROWING;
use crate::emission::{Emission, EmissionSample, differential};

/// A photon from the sky, from a direction by importance, at a place that is even over the
/// cross-section of the target.
///
/// Its neighbours in direction turn about the place where it crosses the disc around the target's
/// middle, so that they meet the target where it does. Of its four-dimensional cell it has as much in
/// direction as blurs a caustic as far as its part in position does, at a distance of the target's
/// own radius: where a bright spot of the sky is sampled finely, most of the cell is position's, as
/// for a sun.
pub(crate) fn emit<const N: usize>(
    sky: &Environment,
    target: &Sphere,
    distance: f32,
    sample: &EmissionSample,
) -> Option<Emission<N>> {
    let from = sky.sample(sample.point);
    if !(from.pdf > 0.0 && from.pdf.is_finite()) {
        return None;
    }
    let frame = Frame::from_normal(from.towards);
    let across = |it: Vec2| frame.to_world((target.radius * it).extend(0.0));
    let place = square_to_disc_concentric(sample.place);
    let area = PI * target.radius * target.radius;
    let count = sample.count as f32;
    let places = (count * PI * from.pdf).sqrt().clamp(1.0, count);
    let edge = NARROWING * places.sqrt().recip();
    let angle = NARROWING * (places / (from.pdf * count)).sqrt();
    let turned = [angle * frame.tangent, angle * frame.bitangent];
    let mut differential = differential(
        &[edge * across(place.d_du), edge * across(place.d_dv)],
        &turned,
    );
    for (moved, turned) in differential.position.iter_mut().zip(turned) {
        *moved = -distance * turned;
    }
    Some(Emission {
        ray: Ray::new(
            target.center + distance * from.towards + across(place.value),
            -from.towards,
        ),
        flux: from.radiance * (area / (from.pdf * count)),
        differential,
    })
}
