use caustics_sampling::warp::Cone;
use caustics_scene::Light;
use glam::Vec3;

use crate::area_emission::AreaSurface;
use crate::domain::EmissionDomain;
use crate::outline::{Outline, half_angle};

/// By how much a domain is wider than need be that should hold a moving caster for some frames.
const SLACK: f32 = 1.05;

/// A domain is given up for one that is smaller than it by this factor.
const LARGEST: f32 = 1.4;

/// Whether a domain still serves: for the same light, with the caster in it, and not too large.
pub(crate) fn is_kept(old: &EmissionDomain, tight: &EmissionDomain, outline: &Outline) -> bool {
    match (*old, *tight) {
        (
            EmissionDomain::Cone {
                light,
                origin,
                frame,
                cone,
            },
            EmissionDomain::Cone {
                light: same_light,
                cone: least,
                ..
            },
        ) => {
            light == same_light
                && cone.solid_angle() <= LARGEST * least.solid_angle()
                && outline.is_in_cone(origin, frame.normal, cone)
        }
        (
            EmissionDomain::Rectangle {
                corner,
                edges,
                direction,
                irradiance,
            },
            EmissionDomain::Rectangle {
                corner: fresh_corner,
                edges: least,
                direction: same_direction,
                irradiance: same_irradiance,
            },
        ) => {
            let area = |edges: &[Vec3; 2]| edges[0].length() * edges[1].length();
            direction == same_direction
                && irradiance == same_irradiance
                // Outside the scene still.
                && corner.dot(direction) <= fresh_corner.dot(direction)
                && area(&edges) <= LARGEST * area(&least)
                && outline.is_in_rectangle(corner, &edges)
        }
        (
            EmissionDomain::Area {
                surface: AreaSurface::Cap { .. },
                ..
            },
            _,
        ) => false,
        (
            EmissionDomain::Area {
                surface,
                target: Some(target),
            },
            EmissionDomain::Area {
                surface: same_surface,
                target: Some(least),
            },
        ) => {
            surface == same_surface
                && target.center.distance(least.center) + least.radius <= target.radius
                && target.radius * target.radius <= LARGEST * least.radius * least.radius
        }
        (
            EmissionDomain::Sky { target, distance },
            EmissionDomain::Sky {
                target: least,
                distance: same_distance,
            },
        ) => {
            distance == same_distance
                && target.center.distance(least.center) + least.radius <= target.radius
                && target.radius * target.radius <= LARGEST * least.radius * least.radius
        }
        _ => false,
    }
}

/// A domain with some room around its caster.
pub(crate) fn widened(domain: &EmissionDomain) -> EmissionDomain {
    let mut wider = *domain;
    match &mut wider {
        EmissionDomain::Cone { light, cone, .. } => {
            let is_own =
                matches!(light, Light::Spot { outer_cos, .. } if cone.cosine() <= *outer_cos);
            let angle = SLACK * half_angle(*cone);
            if !is_own && angle < std::f32::consts::FRAC_PI_2 {
                *cone = Cone::from_half_angle(angle).unwrap_or(*cone);
            }
        }
        EmissionDomain::Rectangle { corner, edges, .. } => {
            let more = edges.map(|edge| (SLACK - 1.0) * edge);
            *corner -= 0.5 * (more[0] + more[1]);
            *edges = [edges[0] + more[0], edges[1] + more[1]];
        }
        EmissionDomain::Area {
            surface:
                AreaSurface::Rectangle { .. }
                | AreaSurface::Triangle { .. }
                | AreaSurface::Disc { .. }
                | AreaSurface::Object { .. },
            target: Some(target),
        } => target.radius *= SLACK,
        EmissionDomain::Sky { target, .. } => target.radius *= SLACK,
        _ => {}
    }
    wider
}
