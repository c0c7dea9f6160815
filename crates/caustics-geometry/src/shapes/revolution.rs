use std::f32::consts::FRAC_PI_6;
use std::f64::consts::TAU;

use glam::{Vec2, Vec3};

use super::ShapeError;
use super::error::{check_count, check_vertices};
use crate::TriangleMesh;

/// How [`revolution`] turns a profile into a mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RevolutionOptions {
    /// The number of segments around the axis, at least 3.
    pub segments: u32,
    /// Where the profile bends by more than this angle, in radians, the surface gets a sharp
    /// edge; elsewhere it is smooth. From 0 (all edges sharp) to pi (none).
    pub crease_angle: f32,
}

impl Default for RevolutionOptions {
    /// 64 segments, and sharp edges from 30 degrees.
    fn default() -> Self {
        Self {
            segments: 64,
            crease_angle: FRAC_PI_6,
        }
    }
}

/// A point of a profile with the normal of the surface there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ProfilePoint {
    /// Distance from the axis and height along it, in metres.
    pub position: Vec2,
    /// The normal in the same two axes, of any length but zero.
    pub normal: Vec2,
}

/// The surface that a polyline leaves as it turns around the y axis.
///
/// The points give the distance from the axis as x and the height as y. The outside is on the
/// right of the way along the profile: for a solid, run from the bottom of the axis up along the
/// outside to the top of the axis; for a glass, up the outside, over the rim, and down the inside
/// to the axis. A profile that ends where it began is a ring. Both are closed; any other profile
/// leaves an open edge.
///
/// Normals at a smooth point are the mean of the two segments' normals, each weighted by the
/// inverse of its segment's length, which is exact on a circle whatever the spacing. Where an
/// end on the axis comes in within the crease angle of level, the surface is smooth there;
/// otherwise it is the tip of a cone.
///
/// # Errors
///
/// [`ShapeError`] names the first profile point that is wrong.
pub fn revolution(
    profile: &[Vec2],
    options: &RevolutionOptions,
) -> Result<TriangleMesh, ShapeError> {
    check_count("profile points", profile.len(), 2)?;
    for (point, position) in profile.iter().enumerate() {
        check_position(point, *position)?;
        if point > 0 && *position == profile[point - 1] {
            return Err(ShapeError::RepeatedPoint { point });
        }
    }
    revolution_with_normals(
        &with_normals(profile, options.crease_angle),
        options.segments,
    )
}

/// The surface that a profile leaves as it turns around the y axis, with its normals given.
///
/// As [`revolution`], but a sharp edge is where the same position is given twice in a row, with
/// the normal before it and the one after it. On the axis a normal along the axis makes the
/// surface smooth, any other the tip of a cone.
///
/// # Errors
///
/// [`ShapeError`] names the first profile point that is wrong.
pub fn revolution_with_normals(
    profile: &[ProfilePoint],
    segments: u32,
) -> Result<TriangleMesh, ShapeError> {
    check_count("profile points", profile.len(), 2)?;
    check_count("segments", segments as usize, 3)?;
    check_vertices((profile.len() as u64).saturating_mul(u64::from(segments)))?;
    for (point, ProfilePoint { position, normal }) in profile.iter().enumerate() {
        check_position(point, *position)?;
        if !normal.is_finite() {
            return Err(ShapeError::NonFiniteProfile { point });
        }
        let before = point.checked_sub(1).map(|before| profile[before].position);
        if before.is_some_and(|p| p.x == 0.0 && position.x == 0.0 && p.y != position.y) {
            return Err(ShapeError::SegmentOnAxis { point });
        }
    }
    let mut surface = Surface::default();
    let rings: Vec<Ring> = profile
        .iter()
        .map(|point| surface.add_ring(*point, segments))
        .collect();
    for (pair, ends) in rings.windows(2).zip(profile.windows(2)) {
        if ends[0].position != ends[1].position {
            surface.join(pair[0], pair[1], segments);
        }
    }
    Ok(TriangleMesh::new(
        surface.positions,
        Some(surface.normals),
        surface.triangles,
    )?)
}

fn check_position(point: usize, position: Vec2) -> Result<(), ShapeError> {
    if !position.is_finite() {
        return Err(ShapeError::NonFiniteProfile { point });
    }
    if position.x < 0.0 {
        return Err(ShapeError::NegativeRadius {
            point,
            radius: position.x,
        });
    }
    Ok(())
}

/// Finds the normals of a polyline, and doubles the points at which it is creased.
fn with_normals(profile: &[Vec2], crease_angle: f32) -> Vec<ProfilePoint> {
    let cos_crease = crease_angle.cos();
    let last = profile.len() - 1;
    let segment = |k: usize| profile[k + 1] - profile[k];
    // The right-hand side of the way is outside. In f64: squares of small steps leave f32.
    let normal = |k: usize| segment(k).as_dvec2().perp().normalize().as_vec2() * -1.0;
    let is_ring = profile[0] == profile[last] && profile[0].x > 0.0;
    let mut points = Vec::with_capacity(profile.len());
    for (k, &position) in profile.iter().enumerate() {
        let before = if k > 0 {
            Some(k - 1)
        } else {
            is_ring.then_some(last - 1)
        };
        let after = if k < last {
            Some(k)
        } else {
            is_ring.then_some(0)
        };
        let mut push = |normal| points.push(ProfilePoint { position, normal });
        match (before, after) {
            (Some(before), Some(after)) if position.x > 0.0 => {
                let (first, second) = (normal(before), normal(after));
                if first.dot(second) >= cos_crease {
                    push(first / segment(before).length() + second / segment(after).length());
                } else {
                    push(first);
                    push(second);
                }
            }
            // An end of the profile, or a waist of no width.
            _ => {
                for normal in [before, after].into_iter().flatten().map(normal) {
                    let level = position.x == 0.0 && normal.y.abs() >= cos_crease;
                    push(if level {
                        Vec2::new(0.0, normal.y.signum())
                    } else {
                        normal
                    });
                }
            }
        }
    }
    points
}

/// The vertices that one profile point leaves.
#[derive(Clone, Copy)]
enum Ring {
    /// A single vertex on the axis.
    Pole { vertex: u32 },
    /// A tip of a cone: a vertex on the axis for each segment, with the normal of its middle.
    Tip { first: u32 },
    /// A circle of one vertex for each segment's start.
    Circle { first: u32 },
}

impl Ring {
    fn is_on_axis(self) -> bool {
        !matches!(self, Self::Circle { .. })
    }

    /// The vertex at which this segment starts.
    fn start(self, segment: u32) -> u32 {
        match self {
            Self::Pole { vertex } => vertex,
            Self::Tip { first } | Self::Circle { first } => first + segment,
        }
    }

    /// The vertex at which this segment ends; the last one ends where the first starts.
    fn end(self, segment: u32, segments: u32) -> u32 {
        match self {
            Self::Circle { first } => first + (segment + 1) % segments,
            Self::Pole { .. } | Self::Tip { .. } => self.start(segment),
        }
    }
}

#[derive(Default)]
struct Surface {
    positions: Vec<Vec3>,
    normals: Vec<Vec3>,
    triangles: Vec<[u32; 3]>,
}

impl Surface {
    fn add_ring(&mut self, point: ProfilePoint, segments: u32) -> Ring {
        let first = self.positions.len() as u32;
        let ProfilePoint { position, normal } = point;
        if position.x == 0.0 && normal.x == 0.0 {
            self.positions.push(Vec3::new(0.0, position.y, 0.0));
            self.normals.push(Vec3::new(0.0, normal.y, 0.0));
            return Ring::Pole { vertex: first };
        }
        let shift = if position.x == 0.0 { 0.5 } else { 0.0 };
        for segment in 0..segments {
            // Counterclockwise as seen from above.
            let angle = TAU * ((f64::from(segment) + shift) / f64::from(segments));
            let around = |along_x: f32, along_y: f32| {
                let (sin, cos) = angle.sin_cos();
                let radius = f64::from(along_x);
                Vec3::new((radius * cos) as f32, along_y, (-radius * sin) as f32)
            };
            self.positions.push(around(position.x, position.y));
            self.normals.push(around(normal.x, normal.y));
        }
        if position.x == 0.0 {
            Ring::Tip { first }
        } else {
            Ring::Circle { first }
        }
    }

    fn join(&mut self, below: Ring, above: Ring, segments: u32) {
        for segment in 0..segments {
            let (below_start, below_end) = (below.start(segment), below.end(segment, segments));
            let (above_start, above_end) = (above.start(segment), above.end(segment, segments));
            if !below.is_on_axis() {
                self.triangles.push([below_start, below_end, above_end]);
            }
            if !above.is_on_axis() {
                self.triangles.push([below_start, above_end, above_start]);
            }
        }
    }
}
