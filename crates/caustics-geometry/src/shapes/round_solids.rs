use std::f32::consts::FRAC_PI_6;
use std::f64::consts::{PI, TAU};

use glam::Vec2;

use super::error::{check_below, check_count, check_positive, check_vertices};
use super::{ProfilePoint, RevolutionOptions, ShapeError, revolution, revolution_with_normals};
use crate::TriangleMesh;

/// A sphere of `segments` around the y axis and `rings` from pole to pole, with the sphere's own
/// normals.
///
/// # Errors
///
/// [`ShapeError`] where the radius is not positive, there are fewer than 3 segments or 2 rings,
/// or too many.
pub fn uv_sphere(radius: f32, segments: u32, rings: u32) -> Result<TriangleMesh, ShapeError> {
    check_positive("radius", radius)?;
    check_count("rings", rings as usize, 2)?;
    check_vertices((u64::from(rings) + 1).saturating_mul(u64::from(segments)))?;
    let profile: Vec<ProfilePoint> = (0..=rings)
        .map(|ring| {
            let mut point = circle_point(
                Vec2::ZERO,
                radius,
                f64::from(ring) / f64::from(rings) * PI - 0.5 * PI,
            );
            if ring == 0 || ring == rings {
                // On the axis exactly, which the cosine of pi/2 is not.
                point.position.x = 0.0;
                point.normal.x = 0.0;
            }
            point
        })
        .collect();
    revolution_with_normals(&profile, segments)
}

/// A torus around the y axis, with its own normals: a circle of radius `minor_radius` at the
/// distance `major_radius` from the axis.
///
/// # Errors
///
/// [`ShapeError`] where a radius is not positive, the minor one not below the major one, or there
/// are fewer than 3 segments one way or the other.
pub fn torus(
    major_radius: f32,
    minor_radius: f32,
    major_segments: u32,
    minor_segments: u32,
) -> Result<TriangleMesh, ShapeError> {
    check_positive("major radius", major_radius)?;
    check_positive("minor radius", minor_radius)?;
    check_below("minor radius", minor_radius, major_radius)?;
    check_count("minor segments", minor_segments as usize, 3)?;
    check_vertices((u64::from(minor_segments) + 1).saturating_mul(u64::from(major_segments)))?;
    let center = Vec2::new(major_radius, 0.0);
    let mut profile: Vec<ProfilePoint> = (0..minor_segments)
        .map(|k| {
            circle_point(
                center,
                minor_radius,
                f64::from(k) / f64::from(minor_segments) * TAU,
            )
        })
        .collect();
    profile.push(profile[0]);
    revolution_with_normals(&profile, major_segments)
}

/// A solid cylinder around the y axis, from `y = 0` to `y = height`, with sharp rims.
///
/// # Errors
///
/// [`ShapeError`] where a size is not positive or there are fewer than 3 segments.
pub fn cylinder(radius: f32, height: f32, segments: u32) -> Result<TriangleMesh, ShapeError> {
    check_positive("radius", radius)?;
    check_positive("height", height)?;
    let profile = [
        Vec2::ZERO,
        Vec2::new(radius, 0.0),
        Vec2::new(radius, height),
        Vec2::new(0.0, height),
    ];
    revolution(&profile, &creased(segments))
}

/// A flat ring or the wall of a pipe, solid, around the y axis, from `y = 0` to `y = height`,
/// with sharp rims.
///
/// # Errors
///
/// [`ShapeError`] where a size is not positive, the inner radius is not below the outer one, or
/// there are fewer than 3 segments.
pub fn tube(
    inner_radius: f32,
    outer_radius: f32,
    height: f32,
    segments: u32,
) -> Result<TriangleMesh, ShapeError> {
    check_positive("inner radius", inner_radius)?;
    check_positive("outer radius", outer_radius)?;
    check_positive("height", height)?;
    check_below("inner radius", inner_radius, outer_radius)?;
    let profile = [
        Vec2::new(inner_radius, 0.0),
        Vec2::new(outer_radius, 0.0),
        Vec2::new(outer_radius, height),
        Vec2::new(inner_radius, height),
        Vec2::new(inner_radius, 0.0),
    ];
    revolution(&profile, &creased(segments))
}

/// A flat disc in the plane `y = 0`, its front upwards.
///
/// # Errors
///
/// [`ShapeError`] where the radius is not positive or there are fewer than 3 segments.
pub fn disc(radius: f32, segments: u32) -> Result<TriangleMesh, ShapeError> {
    check_positive("radius", radius)?;
    revolution(&[Vec2::new(radius, 0.0), Vec2::ZERO], &creased(segments))
}

fn creased(segments: u32) -> RevolutionOptions {
    RevolutionOptions {
        segments,
        crease_angle: FRAC_PI_6,
    }
}

/// The point at this angle above the level, in radians, of a circle in the profile's plane.
fn circle_point(center: Vec2, radius: f32, angle: f64) -> ProfilePoint {
    let (sin, cos) = angle.sin_cos();
    let radius = f64::from(radius);
    ProfilePoint {
        position: Vec2::new(
            (f64::from(center.x) + radius * cos) as f32,
            (f64::from(center.y) + radius * sin) as f32,
        ),
        normal: Vec2::new(cos as f32, sin as f32),
    }
}
