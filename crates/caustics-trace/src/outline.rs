use std::f32::consts::PI;

use caustics_geometry::{Aabb, Sphere};
use caustics_sampling::warp::Cone;
use caustics_scene::World;
use glam::{Vec2, Vec3};

/// Vertices that the shape of an aimed domain is found from; its size is found from all.
const SHAPE_VERTICES: usize = 4096;

/// Steps towards the smallest cone.
const CONE_STEPS: u32 = 24;

/// Orientations of a rectangle that are tried over a quarter turn.
const ORIENTATIONS: u16 = 32;

/// The widest cone that is aimed, as its cosine. Beyond a hemisphere a cone about a triangle's
/// corners need not hold the triangle.
const MIN_CONE_COSINE: f32 = 0.05;

/// By how much an aimed domain is wider than what it holds, so that rounding cuts nothing off.
const MARGIN: f32 = 1e-4;

/// Some objects of a world, as what bounds them: vertices and spheres.
#[derive(Clone, Debug)]
pub(crate) struct Outline {
    vertices: Vec<Vec3>,
    spheres: Vec<Sphere>,
    bounding: Sphere,
}

impl Outline {
    /// The outline of the objects with these indices; `None` where they have no surface.
    pub(crate) fn of(world: &World, objects: &[u32]) -> Option<Self> {
        let mut spheres = Vec::new();
        let mut used: Vec<u32> = Vec::new();
        let mut bounds = Aabb::EMPTY;
        for &object in objects {
            let object = &world.objects()[object as usize];
            let triangles = object.triangles.start as usize..object.triangles.end as usize;
            used.extend(world.triangles()[triangles].as_flattened());
            let range = object.spheres.start as usize..object.spheres.end as usize;
            spheres.extend_from_slice(&world.spheres()[range]);
            bounds = bounds.union(&object.bounds);
        }
        used.sort_unstable();
        used.dedup();
        let vertices: Vec<Vec3> = used
            .into_iter()
            .map(|vertex| world.positions()[vertex as usize])
            .collect();
        if vertices.is_empty() && spheres.is_empty() {
            return None;
        }
        let center = bounds.center();
        let reach = |point: &Vec3| point.distance(center);
        let farthest = vertices.iter().map(reach).fold(0.0, f32::max);
        let radius = spheres
            .iter()
            .map(|it| reach(&it.center) + it.radius)
            .fold(farthest, f32::max);
        let bounding = Sphere {
            center,
            radius: radius * (1.0 + MARGIN),
        };
        Some(Self {
            vertices,
            spheres,
            bounding,
        })
    }

    /// A sphere that holds everything.
    pub(crate) fn bounding(&self) -> &Sphere {
        &self.bounding
    }

    /// A narrow cone of directions from `origin`, with its axis, that holds everything; `None`
    /// where there is none below a hemisphere.
    pub(crate) fn cone_from(&self, origin: Vec3) -> Option<(Vec3, Cone)> {
        let mut axis = (self.bounding.center - origin).try_normalize()?;
        // Bădoiu and Clarkson's smallest enclosing ball, on the sphere of directions.
        for step in 0..CONE_STEPS {
            let farthest = self
                .sampled()
                .filter_map(|vertex| (vertex - origin).try_normalize())
                .min_by(|a, b| a.dot(axis).total_cmp(&b.dot(axis)));
            let Some(farthest) = farthest else { break };
            axis = (axis + (farthest - axis) / (step + 2) as f32).try_normalize()?;
        }
        let mut angle = 0.0f32;
        for vertex in &self.vertices {
            angle = angle.max((vertex - origin).try_normalize()?.angle_between(axis));
        }
        for sphere in &self.spheres {
            let to_center = sphere.center - origin;
            let distance = to_center.length();
            if distance <= sphere.radius {
                return None;
            }
            let around = (sphere.radius / distance).asin();
            angle = angle.max(to_center.angle_between(axis) + around);
        }
        let angle = angle * (1.0 + MARGIN) + MARGIN * MARGIN;
        (angle.cos() > MIN_CONE_COSINE)
            .then(|| Cone::from_half_angle(angle).ok())
            .flatten()
            .map(|cone| (axis, cone))
    }

    /// The rectangle across `direction` that holds everything seen along it: a corner and two
    /// perpendicular edges.
    pub(crate) fn rectangle_across(&self, direction: Vec3) -> (Vec3, [Vec3; 2]) {
        let (tangent, bitangent) = direction.any_orthonormal_pair();
        let flat = |point: Vec3| Vec2::new(point.dot(tangent), point.dot(bitangent));
        let area = |turn: f32| {
            let (low, high) = extent(self.sampled().map(flat), turn);
            (high - low).element_product()
        };
        let turn = (0..ORIENTATIONS)
            .map(|step| f32::from(step) / f32::from(ORIENTATIONS) * std::f32::consts::FRAC_PI_2)
            .min_by(|&a, &b| area(a).total_cmp(&area(b)))
            .unwrap_or(0.0);
        let (mut low, mut high) = extent(self.vertices.iter().copied().map(flat), turn);
        let axes = Vec2::from_angle(turn);
        let back = |point: Vec2| {
            let turned = axes.rotate(point);
            turned.x * tangent + turned.y * bitangent
        };
        for sphere in &self.spheres {
            let center = turned_back(axes, flat(sphere.center));
            low = low.min(center - sphere.radius);
            high = high.max(center + sphere.radius);
        }
        let margin = MARGIN * (high - low).max_element();
        let (low, size) = (low - margin, high - low + 2.0 * margin);
        (back(low), [back(Vec2::X) * size.x, back(Vec2::Y) * size.y])
    }

    /// Whether everything lies in a cone from `origin`.
    pub(crate) fn is_in_cone(&self, origin: Vec3, axis: Vec3, cone: Cone) -> bool {
        let angle = half_angle(cone) * (1.0 - MARGIN);
        let chord = 2.0 * (0.5 * angle).sin();
        self.vertices.iter().all(|vertex| {
            (vertex - origin)
                .try_normalize()
                .is_some_and(|direction| direction.distance_squared(axis) < chord * chord)
        }) && self.spheres.iter().all(|sphere| {
            let to_center = sphere.center - origin;
            let distance = to_center.length();
            distance > sphere.radius
                && to_center.angle_between(axis) + (sphere.radius / distance).asin() < angle
        })
    }

    /// Whether everything lies before a rectangle, seen along its normal.
    pub(crate) fn is_in_rectangle(&self, corner: Vec3, edges: &[Vec3; 2]) -> bool {
        edges.iter().all(|&edge| {
            let length = edge.length();
            let range = 0.0..=length;
            let along = |point: Vec3| (point - corner).dot(edge) / length;
            self.vertices.iter().all(|&it| range.contains(&along(it)))
                && self.spheres.iter().all(|sphere| {
                    let center = along(sphere.center);
                    center >= sphere.radius && center + sphere.radius <= length
                })
        })
    }

    /// Some of the vertices, and the outermost points of the spheres.
    fn sampled(&self) -> impl Iterator<Item = Vec3> {
        let stride = self.vertices.len().div_ceil(SHAPE_VERTICES).max(1);
        let poles = [
            Vec3::X,
            Vec3::Y,
            Vec3::Z,
            Vec3::NEG_X,
            Vec3::NEG_Y,
            Vec3::NEG_Z,
        ];
        let around = self
            .spheres
            .iter()
            .flat_map(move |sphere| poles.map(|pole| sphere.center + sphere.radius * pole));
        self.vertices.iter().step_by(stride).copied().chain(around)
    }
}

/// The half angle of a cone in radians, with all its digits where it is narrow.
pub(crate) fn half_angle(cone: Cone) -> f32 {
    // 1 - cos a = 2 sin² (a / 2), and the solid angle is 2 pi of it.
    2.0 * (cone.solid_angle() / (4.0 * PI)).sqrt().min(1.0).asin()
}

/// The box around points in a frame turned by `turn` radians.
fn extent(points: impl Iterator<Item = Vec2>, turn: f32) -> (Vec2, Vec2) {
    let axes = Vec2::from_angle(turn);
    points.fold(
        (Vec2::INFINITY, Vec2::NEG_INFINITY),
        |(low, high), point| {
            let turned = turned_back(axes, point);
            (low.min(turned), high.max(turned))
        },
    )
}

/// A point rotated by the opposite of the angle of the unit vector `axes`.
fn turned_back(axes: Vec2, point: Vec2) -> Vec2 {
    Vec2::new(axes.x, -axes.y).rotate(point)
}
