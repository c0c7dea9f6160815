use caustics_geometry::Aabb;
use caustics_scene::World;
use glam::Vec3;

use crate::outline::Outline;

/// The most groups that specular objects are divided into, so that one bit of a word can stand for
/// each. Where there are more objects, those near each other are taken together.
pub const MAX_CASTERS: usize = 32;

/// Two objects are one caster where the boxes around them share this part of the smaller one.
///
/// A liquid lies in its glass, a stone in its setting: light that is aimed at the one arrives by way
/// of the other, and two sets of photons for the same directions would be half wasted. Objects that
/// merely touch share little.
const COMMON_PART: f32 = 0.5;

/// The least thickness of a box, relative to its diagonal: flat objects have a volume, too.
const LEAST_THICKNESS: f32 = 0.02;

/// The specular objects of a world, in the groups that lights are aimed at.
///
/// Every specular object belongs to one group. Light that could become a caustic meets one of them
/// first, which says whose it is: so photons aimed at several groups, each counted only if the
/// first object in its way is of the group that it was aimed at, carry every caustic exactly once,
/// however much the groups overlap as the light sees them.
///
/// ```
/// use caustics_scene::{World, builtin};
/// use caustics_trace::Casters;
///
/// // Cognac in a glass is one thing to aim at.
/// let world = World::new(&builtin::cognac_glass())?;
/// let casters = Casters::of(&world);
/// assert_eq!(casters.len(), 1);
/// assert_eq!(casters.objects(0).len(), 2);
/// # Ok::<(), caustics_scene::SceneError>(())
/// ```
#[derive(Clone, Debug, Default)]
pub struct Casters {
    groups: Vec<Group>,
    /// For each object of the world, its group.
    group_of: Vec<Option<u32>>,
}

#[derive(Clone, Debug)]
struct Group {
    objects: Vec<u32>,
    bounds: Aabb,
    outline: Outline,
}

impl Casters {
    /// The casters of a world: objects of glass or metal, those that nest or nearly coincide
    /// together.
    #[must_use]
    pub fn of(world: &World) -> Self {
        let specular: Vec<(u32, Aabb)> = world
            .objects()
            .iter()
            .enumerate()
            .filter(|(_, object)| {
                let material = &world.materials()[object.material as usize];
                material.surface.is_specular() && !object.bounds.is_empty()
            })
            .map(|(index, object)| (index as u32, object.bounds))
            .collect();
        let mut clusters = nested(&specular);
        while clusters.len() > MAX_CASTERS {
            clusters = divided(&clusters);
        }
        let mut casters = Self {
            groups: Vec::new(),
            group_of: vec![None; world.objects().len()],
        };
        for Cluster { objects, bounds } in clusters {
            let Some(outline) = Outline::of(world, &objects) else {
                continue;
            };
            for &object in &objects {
                casters.group_of[object as usize] = Some(casters.groups.len() as u32);
            }
            casters.groups.push(Group {
                objects,
                bounds,
                outline,
            });
        }
        casters
    }

    /// Number of casters, at most [`MAX_CASTERS`].
    #[must_use]
    pub fn len(&self) -> usize {
        self.groups.len()
    }

    /// Whether there is nothing that could throw a caustic.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.groups.is_empty()
    }

    /// The objects of a caster, by their index in the world, in order; none for a number that no
    /// caster has.
    #[must_use]
    pub fn objects(&self, caster: u32) -> &[u32] {
        self.groups
            .get(caster as usize)
            .map_or(&[], |group| &group.objects)
    }

    /// The box around a caster; empty for a number that no caster has.
    #[must_use]
    pub fn bounds(&self, caster: u32) -> Aabb {
        self.groups
            .get(caster as usize)
            .map_or(Aabb::EMPTY, |group| group.bounds)
    }

    /// The caster that an object of the world is part of; `None` for receivers.
    #[must_use]
    pub fn of_object(&self, object: u32) -> Option<u32> {
        self.group_of.get(object as usize).copied().flatten()
    }

    pub(crate) fn outlines(&self) -> impl Iterator<Item = (u32, &Outline)> {
        let numbered = self.groups.iter().enumerate();
        numbered.map(|(number, group)| (number as u32, &group.outline))
    }
}

/// Some objects, and the box around them.
#[derive(Clone, Debug)]
struct Cluster {
    objects: Vec<u32>,
    bounds: Aabb,
}

/// Objects whose boxes nest or nearly coincide, directly or by way of others, in the order of
/// their first objects.
fn nested(objects: &[(u32, Aabb)]) -> Vec<Cluster> {
    let mut parent: Vec<usize> = (0..objects.len()).collect();
    // A sweep along x: only boxes that overlap there are compared.
    let mut order: Vec<usize> = (0..objects.len()).collect();
    let boxes: Vec<Aabb> = objects
        .iter()
        .map(|(_, bounds)| thickened(bounds))
        .collect();
    order.sort_by(|&i, &j| boxes[i].min.x.total_cmp(&boxes[j].min.x).then(i.cmp(&j)));
    for (place, &one) in order.iter().enumerate() {
        for &other in &order[place + 1..] {
            if boxes[other].min.x > boxes[one].max.x {
                break;
            }
            if common_part(&boxes[one], &boxes[other]) >= COMMON_PART {
                let (a, b) = (root(&mut parent, one), root(&mut parent, other));
                parent[a.max(b)] = a.min(b);
            }
        }
    }
    let mut clusters: Vec<Cluster> = Vec::new();
    let mut cluster_of = vec![usize::MAX; objects.len()];
    for (index, (object, bounds)) in objects.iter().enumerate() {
        let first = root(&mut parent, index);
        if first == index {
            cluster_of[index] = clusters.len();
            clusters.push(Cluster {
                objects: Vec::new(),
                bounds: Aabb::EMPTY,
            });
        }
        // A root has the least index of its set, so it came before.
        let cluster = &mut clusters[cluster_of[first]];
        cluster.objects.push(*object);
        cluster.bounds = cluster.bounds.union(bounds);
    }
    clusters
}

fn root(parent: &mut [usize], mut index: usize) -> usize {
    while parent[index] != index {
        parent[index] = parent[parent[index]];
        index = parent[index];
    }
    index
}

fn thickened(bounds: &Aabb) -> Aabb {
    let least = LEAST_THICKNESS * bounds.diagonal().length();
    let missing = (Vec3::splat(least) - bounds.diagonal()).max(Vec3::ZERO);
    Aabb {
        min: bounds.min - 0.5 * missing,
        max: bounds.max + 0.5 * missing,
    }
}

/// The volume that two boxes share, as a part of the smaller one.
fn common_part(a: &Aabb, b: &Aabb) -> f32 {
    let shared = (a.max.min(b.max) - a.min.max(b.min)).max(Vec3::ZERO);
    let smaller = a
        .diagonal()
        .element_product()
        .min(b.diagonal().element_product());
    if smaller > 0.0 {
        shared.element_product() / smaller
    } else {
        0.0
    }
}

/// Groups of clusters that are near each other, at most [`MAX_CASTERS`]: the box with the largest
/// surface is halved at the middle one of its clusters, again and again.
fn divided(clusters: &[Cluster]) -> Vec<Cluster> {
    let around = |members: &[Cluster]| {
        let boxes = members.iter().map(|it| it.bounds);
        boxes.fold(Aabb::EMPTY, |all, it| all.union(&it))
    };
    let mut parts = vec![clusters.to_vec()];
    while parts.len() < MAX_CASTERS {
        let size = |members: &[Cluster]| {
            if members.len() > 1 {
                around(members).surface_area()
            } else {
                -1.0
            }
        };
        let largest = (0..parts.len())
            .max_by(|&i, &j| size(&parts[i]).total_cmp(&size(&parts[j])).then(j.cmp(&i)));
        let Some(largest) = largest else { break };
        let diagonal = around(&parts[largest]).diagonal();
        let axis = diagonal.max_position();
        let members = &mut parts[largest];
        members.sort_by(|a, b| {
            let place = |it: &Cluster| it.bounds.center()[axis];
            place(a)
                .total_cmp(&place(b))
                .then(a.objects.cmp(&b.objects))
        });
        let rest = members.split_off(members.len() / 2);
        parts.push(rest);
    }
    let mut merged: Vec<Cluster> = parts
        .into_iter()
        .map(|members| {
            let bounds = around(&members);
            let mut objects: Vec<u32> = members.into_iter().flat_map(|it| it.objects).collect();
            objects.sort_unstable();
            Cluster { objects, bounds }
        })
        .collect();
    merged.sort_by_key(|it| it.objects.first().copied());
    merged
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cube(center: Vec3, size: f32) -> Aabb {
        Aabb {
            min: center - 0.5 * size,
            max: center + 0.5 * size,
        }
    }

    fn numbered(boxes: &[Aabb]) -> Vec<(u32, Aabb)> {
        (0u32..).zip(boxes.iter().copied()).collect()
    }

    #[test]
    fn what_nests_is_one_caster_and_what_touches_is_two() {
        let glass = cube(Vec3::ZERO, 2.0);
        let liquid = cube(Vec3::new(0.0, -0.3, 0.0), 1.0);
        let beside = cube(Vec3::new(2.0, 0.0, 0.0), 2.0);
        let groups = nested(&numbered(&[beside, glass, liquid]));
        let objects: Vec<&[u32]> = groups.iter().map(|it| it.objects.as_slice()).collect();
        assert_eq!(objects, [&[0][..], &[1, 2]]);
        assert_eq!(groups[1].bounds, glass);
        // A flat mirror against another in its place, and beside it.
        let flat = |x: f32| Aabb::new([x, 0.0, 0.0], [x + 1.0, 0.0, 1.0]);
        assert_eq!(nested(&numbered(&[flat(0.0), flat(0.1)])).len(), 1);
        assert_eq!(nested(&numbered(&[flat(0.0), flat(0.9)])).len(), 2);
    }

    #[test]
    fn many_objects_become_as_many_casters_as_there_may_be() {
        let boxes: Vec<Aabb> = (0u16..1000)
            .map(|i| cube(Vec3::new(f32::from(i % 40), 0.0, f32::from(i / 40)), 0.5))
            .collect();
        let single = nested(&numbered(&boxes));
        assert_eq!(single.len(), 1000);
        let groups = divided(&single);
        assert_eq!(groups.len(), MAX_CASTERS);
        let mut all: Vec<u32> = groups.iter().flat_map(|it| it.objects.clone()).collect();
        all.sort_unstable();
        assert_eq!(all, (0..1000).collect::<Vec<u32>>());
        for group in &groups {
            for &object in &group.objects {
                let inside = group.bounds.union(&boxes[object as usize]);
                assert_eq!(inside, group.bounds);
            }
        }
    }
}
