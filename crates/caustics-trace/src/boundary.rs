use std::hash::{DefaultHasher, Hash, Hasher};
use std::ops::Range;

use caustics_accel::{BoxTree, Intersect};
use caustics_geometry::{Aabb, Ray};
use caustics_scene::World;
use glam::Vec3;

use crate::photon::{Coverage, Photon};
use crate::sharp_edges::sharp_edges;

/// How far light is followed from a photon to a boundary, in lengths of its axes: three standard
/// deviations of the default footprint.
const REACH: f32 = 1.65;

/// How far from a footprint's plane a boundary may lie, relative to how far the footprint reaches, and
/// the sine of the angle that it may make with the plane.
const IN_PLANE: f32 = 0.05;

/// How far from a boundary is looked for what goes on behind it, relative to how far the footprint
/// reaches; twice as far as that is looked.
const PROBE: f32 = 0.02;

/// A probe that is no longer than so many times the largest coordinate is rounding.
const LEAST_PROBE: f32 = 1e-5;

/// Of two boundaries whose directions outwards have a larger cosine only one counts: the other is a part
/// of the same bend.
const APART_COSINE: f32 = 0.5;

/// As many boundaries reflect one footprint at most: those of a rectangle.
const MOST: usize = 4;

/// An edge at which a receiver's surface ends or bends sharply.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BoundaryEdge {
    /// Indices into [`World::positions`].
    pub vertices: [u32; 2],
    /// Index into [`World::objects`].
    pub object: u32,
}

/// The edges at which the surfaces of receivers end or bend sharply.
///
/// Beyond them footprints light nothing, and what they so lose does not come back from photons out
/// there, as there are none: receivers would be dark along their ends. The method of reflection
/// (Silverman, *Density Estimation for Statistics and Data Analysis*, 1986, section 2.10) gives it back:
/// each footprint that reaches across an end has an image on the other side of it, whose light on this side is
/// what the footprint lost.
#[derive(Clone, Debug, Default)]
pub struct Boundaries {
    /// Of the receivers that they are of.
    fingerprint: u64,
    edges: Vec<BoundaryEdge>,
    /// Where the edges are, and their indices in the order of its places; `None` where there are none.
    tree: Option<(BoxTree, Vec<u32>)>,
    /// Start and end of each edge.
    ends: Vec<[Vec3; 2]>,
}

/// Where a footprint is reflected.
#[derive(Clone, Copy)]
struct Mirror {
    /// A point of it.
    foot: Vec3,
    /// Unit direction outwards, in the footprint's plane.
    outwards: Vec3,
}

impl Boundaries {
    /// Those of all receivers of a world, in the order of their triangles.
    #[must_use]
    pub fn of(world: &World) -> Self {
        let mut edges = Vec::new();
        for (object, triangles) in receivers(world) {
            let sharp = sharp_edges(world, triangles).into_iter();
            edges.extend(sharp.map(|vertices| BoundaryEdge { vertices, object }));
        }
        let place = |vertex: u32| world.positions()[vertex as usize];
        let ends: Vec<_> = edges.iter().map(|it| it.vertices.map(place)).collect();
        let boxes: Vec<_> = ends
            .iter()
            .map(|[start, end]| Aabb {
                min: start.min(*end),
                max: start.max(*end),
            })
            .collect();
        Self {
            fingerprint: fingerprint(world),
            edges,
            // A world's positions are finite.
            tree: BoxTree::new(&boxes).ok(),
            ends,
        }
    }

    /// Whether they are those of a world, but for one chance in 2⁶⁴ where receivers have changed.
    pub(crate) fn are_of(&self, world: &World) -> bool {
        self.fingerprint == fingerprint(world)
    }

    /// The edges.
    #[must_use]
    pub fn edges(&self) -> &[BoundaryEdge] {
        &self.edges
    }

    /// Calls `store` with the images of a photon behind the boundaries that its footprint reaches, where
    /// nothing goes on there: neither the surface itself nor another that takes its place, nor a wall
    /// that stands there and catches the light.
    pub(crate) fn reflect<I: Intersect + ?Sized>(
        &self,
        intersect: &I,
        photon: &Photon,
        mut store: impl FnMut(Photon),
    ) {
        let Some((tree, order)) = &self.tree else {
            return;
        };
        // Of the longest way from the photon to a boundary that counts, off its plane, too.
        let [a, b] = photon.axes.map(Vec3::length_squared);
        let half = (1.0 + 2.0 * IN_PLANE) * REACH * (a + b).sqrt();
        if !half.is_finite() {
            return;
        }
        let around = Aabb {
            min: photon.position - half,
            max: photon.position + half,
        };
        let mut near = Vec::new();
        tree.for_each_overlapping(&around, |place| {
            let index = order[place];
            if self.edges[index as usize].object == photon.object {
                near.push(index);
            }
        });
        near.sort_unstable();
        let mut mirrors: Vec<Mirror> = Vec::new();
        for index in near {
            if let Some(mirror) = Mirror::of(photon, self.ends[index as usize])
                && mirrors
                    .iter()
                    .all(|it| it.outwards.dot(mirror.outwards) < APART_COSINE)
                && mirror.is_open(intersect, photon)
            {
                mirrors.push(mirror);
                if mirrors.len() == MOST {
                    break;
                }
            }
        }
        if mirrors.is_empty() {
            return;
        }
        // In a corner each image of one side has one of the other.
        let mut images = vec![*photon];
        for mirror in mirrors {
            for index in 0..images.len() {
                images.push(mirror.image(&images[index]));
            }
        }
        for image in images.drain(1..) {
            store(image);
        }
    }
}

impl Mirror {
    /// Of an edge between two points, if a photon's footprint reaches it.
    fn of(photon: &Photon, [start, end]: [Vec3; 2]) -> Option<Self> {
        let edge = end - start;
        let length = edge.length();
        let along = (1.0 / length) * edge;
        let normal = photon.normal;
        let way = along.dot(photon.position - start);
        // No two edges of one straight end have the same photon.
        if !(way >= 0.0 && way < length) || along.dot(normal).abs() > IN_PLANE {
            return None;
        }
        let to_edge = start + way * along - photon.position;
        let height = to_edge.dot(normal);
        let across = to_edge - height * normal;
        let distance = across.length();
        let outwards = (1.0 / distance) * across;
        let reach = reach(photon, outwards);
        // Not of a photon on the edge, either, which has no side.
        (distance < reach && height.abs() < IN_PLANE * reach).then_some(Self {
            foot: photon.position + across,
            outwards,
        })
    }

    /// Whether nothing goes on behind it.
    fn is_open<I: Intersect + ?Sized>(&self, intersect: &I, photon: &Photon) -> bool {
        let step = PROBE * reach(photon, self.outwards);
        if step < LEAST_PROBE * self.foot.abs().max_element() {
            return false;
        }
        let is_free = |side: f32, direction: Vec3| {
            let origin = self.foot + step * (photon.normal + side * self.outwards);
            !intersect.is_occluded(&Ray::with_range(origin, direction, 0.0, 2.0 * step))
        };
        is_free(-1.0, self.outwards) && is_free(1.0, -photon.normal)
    }

    /// What is behind it.
    fn image(&self, photon: &Photon) -> Photon {
        let mirrored = |way: Vec3| way - 2.0 * way.dot(self.outwards) * self.outwards;
        Photon {
            position: self.foot + mirrored(photon.position - self.foot),
            axes: photon.axes.map(mirrored),
            coverage: Coverage::Reflected,
            ..*photon
        }
    }
}

/// The objects that are receivers, and their triangles.
fn receivers(world: &World) -> impl Iterator<Item = (u32, Range<u32>)> {
    let objects = (0u32..).zip(world.objects());
    let are_lit = objects.filter(|(_, object)| {
        let surface = &world.materials()[object.material as usize].surface;
        surface.brdf().is_some()
    });
    are_lit.map(|(number, object)| (number, object.triangles.clone()))
}

/// Another number for other receivers.
fn fingerprint(world: &World) -> u64 {
    // The same in every run.
    let mut hasher = DefaultHasher::new();
    for (object, triangles) in receivers(world) {
        (object, triangles.start, triangles.end).hash(&mut hasher);
        for triangle in triangles {
            for vertex in world.triangles()[triangle as usize] {
                let place = world.positions()[vertex as usize].to_array();
                (vertex, place.map(f32::to_bits)).hash(&mut hasher);
            }
        }
    }
    hasher.finish()
}

/// How far a footprint reaches in a direction of its plane.
fn reach(photon: &Photon, direction: Vec3) -> f32 {
    let [a, b] = photon.axes.map(|axis| axis.dot(direction));
    REACH * (a * a + b * b).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use caustics_accel::BvhOptions;
    use caustics_geometry::TriangleMesh;
    use caustics_geometry::shapes::{cuboid, disc, quad, uv_sphere};
    use caustics_scene::{Instance, Material, Scene, SceneIntersector, Shape};

    /// What stands there, all of it diffuse.
    fn receivers(meshes: Vec<TriangleMesh>) -> (World, SceneIntersector, Boundaries) {
        let mut scene = Scene::new();
        let white = scene.add_material(Material::diffuse("white", [0.8; 3]));
        let white = white.unwrap();
        for mesh in meshes {
            let mesh = scene.add_mesh(mesh);
            let instance = Instance::new("receiver", Shape::Mesh(mesh), white);
            scene.add_instance(instance).unwrap();
        }
        let world = World::new(&scene).unwrap();
        let intersector = world.intersector(&BvhOptions::default()).unwrap();
        let boundaries = Boundaries::of(&world);
        (world, intersector, boundaries)
    }

    /// The plate [0, 1] x [0, 1] that faces up.
    fn plate() -> TriangleMesh {
        quad(Vec3::ZERO, Vec3::Z, Vec3::X).unwrap()
    }

    fn photon(x: f32, z: f32, axes: [Vec3; 2]) -> Photon {
        Photon {
            incoming: Vec3::new(0.6, -0.8, 0.0),
            coverage: Coverage::Overlap,
            ..Photon::landed(Vec3::new(x, 0.0, z), axes)
        }
    }

    fn images(meshes: Vec<TriangleMesh>, photon: &Photon) -> Vec<Photon> {
        let (_, intersector, boundaries) = receivers(meshes);
        let mut images = Vec::new();
        boundaries.reflect(&intersector, photon, |image| images.push(image));
        images
    }

    const ROUND: [Vec3; 2] = [Vec3::new(0.2, 0.0, 0.0), Vec3::new(0.0, 0.0, 0.2)];

    #[test]
    fn even_light_on_a_plate_stays_even_to_its_ends() {
        let (_, intersector, boundaries) = receivers(vec![plate()]);
        // Askew, four steps of their grid wide each.
        let axes = [Vec3::new(0.16, 0.0, 0.1), Vec3::new(-0.06, 0.0, 0.18)];
        const STEPS: usize = 25;
        let step = 1.0 / STEPS as f32;
        let own: Vec<Photon> = (0..STEPS * STEPS)
            .map(|it| [it % STEPS, it / STEPS].map(|it| (it as f32 + 0.5) * step))
            .map(|[x, z]| photon(x, z, axes))
            .collect();
        let mut all = own.clone();
        for photon in &own {
            boundaries.reflect(&intersector, photon, |image| all.push(image));
        }
        // Gaussians of the default scale.
        let density = |photons: &[Photon], x: f32, z: f32| -> f64 {
            let kernel = |photon: &Photon| {
                let [u, v] = photon.axes;
                let area = u.cross(v).y;
                let way = Vec3::new(x, 0.0, z) - photon.position;
                let (a, b) = (way.cross(v).y / area, u.cross(way).y / area);
                let exponent = f64::from(a * a + b * b) / (2.0 * 0.55 * 0.55);
                let peak = f64::from(area.abs()) * 0.55 * 0.55 * std::f64::consts::TAU;
                (-exponent).exp() / peak
            };
            photons.iter().map(kernel).sum::<f64>() / (STEPS * STEPS) as f64
        };
        for (x, z) in [(0.5, 0.5), (0.0, 0.5), (0.05, 0.4), (0.5, 1.0), (1.0, 0.55)] {
            let found = density(&all, x, z);
            // What lies beyond three deviations is not reflected.
            assert!((found - 1.0).abs() < 0.01, "{found} at {x}, {z}");
        }
        // In a corner the images of askew footprints lie askew to each other.
        for (x, z) in [(0.0, 0.0), (0.02, 0.03), (1.0, 0.0), (1.0, 1.0)] {
            let found = density(&all, x, z);
            assert!((found - 1.0).abs() < 0.15, "{found} at {x}, {z}");
        }
        assert!((density(&own, 0.0, 0.5) - 0.5).abs() < 0.02);
        assert!(density(&own, 1.0, 0.0) < 0.4);
    }

    #[test]
    fn an_image_is_a_mirror_image_and_no_light() {
        let original = photon(
            0.1,
            0.5,
            [Vec3::new(0.2, 0.0, 0.1), Vec3::new(0.0, 0.0, 0.15)],
        );
        let found = images(vec![plate()], &original);
        assert_eq!(found.len(), 1);
        let image = found[0];
        assert!(image.position.abs_diff_eq(Vec3::new(-0.1, 0.0, 0.5), 1e-6));
        assert!(image.axes[0].abs_diff_eq(Vec3::new(-0.2, 0.0, 0.1), 1e-6));
        assert_eq!(image.coverage, Coverage::Reflected);
        let back = Photon {
            position: original.position,
            axes: original.axes,
            coverage: original.coverage,
            ..image
        };
        assert_eq!(back, original);
    }

    #[test]
    fn corners_have_three_images_and_the_middle_has_none() {
        assert_eq!(images(vec![plate()], &photon(0.1, 0.1, ROUND)).len(), 3);
        // On the edge that both triangles share.
        assert_eq!(images(vec![plate()], &photon(0.5, 0.5, ROUND)), []);
        // As far as it reaches along the axis that points there.
        let narrow = [0.02 * Vec3::X, 0.3 * Vec3::Z];
        assert_eq!(images(vec![plate()], &photon(0.1, 0.5, narrow)), []);
        assert_eq!(images(vec![plate()], &photon(0.5, 0.1, narrow)).len(), 1);
    }

    #[test]
    fn there_is_no_image_where_something_goes_on() {
        let at_the_end = photon(0.1, 0.5, ROUND);
        // The next tile, and a wall.
        let tile = quad(-Vec3::X, Vec3::Z, Vec3::X).unwrap();
        assert_eq!(images(vec![plate(), tile], &at_the_end), []);
        let wall = quad(-0.5 * Vec3::Y, Vec3::Y, Vec3::Z).unwrap();
        assert_eq!(images(vec![plate(), wall], &at_the_end), []);
        // What hangs down from the end is not in the way of the light.
        let apron = quad(-0.5 * Vec3::Y, 0.5 * Vec3::Y, Vec3::Z).unwrap();
        assert_eq!(images(vec![plate(), apron], &at_the_end).len(), 1);
        // Nor is what stands beside another part of the end.
        let short = quad(-0.5 * Vec3::Y, Vec3::Y, 0.4 * Vec3::Z).unwrap();
        assert_eq!(images(vec![plate(), short], &at_the_end).len(), 1);
    }

    #[test]
    fn boxes_end_at_their_edges_and_balls_nowhere() {
        let (_, _, boundaries) = receivers(vec![cuboid(Vec3::ONE).unwrap()]);
        assert_eq!(boundaries.edges().len(), 12);
        let (_, _, boundaries) = receivers(vec![uv_sphere(1.0, 32, 16).unwrap()]);
        assert_eq!(boundaries.edges(), []);
        let on_top = Photon {
            position: Vec3::new(0.45, 0.5, 0.0),
            ..photon(0.0, 0.0, ROUND)
        };
        let found = images(vec![cuboid(Vec3::ONE).unwrap()], &on_top);
        assert_eq!(found.len(), 1);
        assert!(
            found[0]
                .position
                .abs_diff_eq(Vec3::new(0.55, 0.5, 0.0), 1e-6)
        );
    }

    #[test]
    fn other_receivers_have_other_boundaries() {
        let (world, _, boundaries) = receivers(vec![plate()]);
        assert!(boundaries.are_of(&world));
        let (again, ..) = receivers(vec![plate()]);
        assert!(boundaries.are_of(&again));
        // As many triangles, of which one has moved, one is cut the other way, or whose ends are apart.
        let moved = quad(1e-3 * Vec3::Y, Vec3::Z, Vec3::X).unwrap();
        let turned = quad(Vec3::X, -Vec3::X, Vec3::Z).unwrap();
        let triangle = |at: f32| {
            let corners = [at * Vec3::X, at * Vec3::X + Vec3::Z, (at + 1.0) * Vec3::X];
            TriangleMesh::new(corners.to_vec(), None, vec![[0, 1, 2]]).unwrap()
        };
        for other in [
            vec![moved],
            vec![turned],
            vec![triangle(0.0), triangle(3.0)],
        ] {
            let (world, ..) = receivers(other);
            assert!(!boundaries.are_of(&world));
        }
    }

    #[test]
    fn a_round_end_of_many_edges_reflects_once() {
        let round = disc(1.0, 64).unwrap();
        let (_, intersector, boundaries) = receivers(vec![round]);
        assert_eq!(boundaries.edges().len(), 64);
        for number in 0..1000 {
            let around = Vec3::new(0.0, 0.0, 0.9).to_array();
            let (sin, cos) = (0.0123 * number as f32).sin_cos();
            let position = Vec3::new(around[2] * cos, 0.0, around[2] * sin);
            let original = Photon {
                position,
                ..photon(0.0, 0.0, ROUND)
            };
            let mut found = Vec::new();
            boundaries.reflect(&intersector, &original, |image| found.push(image.position));
            assert_eq!(found.len(), 1, "{position}");
            assert!(
                found[0].abs_diff_eq(1.1 / 0.9 * position, 0.02),
                "{}",
                found[0]
            );
        }
    }

    #[test]
    fn axes_that_are_no_numbers_have_no_images() {
        for long in [f32::INFINITY, f32::NAN, 1e30] {
            let wild = photon(0.1, 0.1, [long * Vec3::X, Vec3::Z]);
            assert_eq!(images(vec![plate()], &wild), []);
        }
    }
}
