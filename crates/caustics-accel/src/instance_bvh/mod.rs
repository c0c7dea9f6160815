mod placement;
mod stream;
mod traverse;

use std::sync::Arc;

use caustics_geometry::glam::Affine3A;
use caustics_geometry::{Aabb, Hit, Ray};

use self::placement::Placement;
use crate::box_tree::{BoxTree, Member};
use crate::simd::Dispatch;
use crate::triangle_bvh::layout::{Child, Node};
use crate::triangle_bvh::stage::{ClosestHit, ClosestHits, Occlusion};
use crate::triangles::MAX_COORDINATE;
use crate::{AccelError, Instructions, Intersect, TriangleBvh};

/// A mesh in its place.
#[derive(Clone, Debug)]
pub struct BvhInstance {
    /// The mesh, which any number of instances may share.
    pub mesh: Arc<TriangleBvh>,
    /// World from object: any affine map that can be undone.
    pub transform: Affine3A,
}

/// Two levels of hierarchies: one a mesh, and one over meshes in their places.
///
/// An object that moves costs a new upper level, a few microseconds, and none of its triangles is
/// touched. Rays find what they would find if every mesh were transformed and flattened into one,
/// to the bit, because only boxes are met in the objects' frames, and triangles in the world. So it is as watertight as [`TriangleBvh`], also where instances meet at vertices
/// that the transforms take to the same place, and points on it are where [`Affine3A`] takes them.
/// A ray pays for it by transforming the triangles that it is tested against.
///
/// Primitives are numbered as they would be in the flattened mesh: those of the first instance come
/// first, in the order of its mesh, then those of the second. Triangles of a mirrored instance turn
/// round, so that the outside stays outside: a hit's `u` and `v` there are those of the triangle
/// with its last two vertices exchanged.
///
/// ```
/// use std::sync::Arc;
/// use caustics_accel::{BvhInstance, BvhOptions, Instructions, InstanceBvh, Intersect, TriangleBvh};
/// use caustics_geometry::{Ray, glam::{Affine3A, Vec3}};
///
/// let corners = [[-1.0, 0.0, -1.0], [1.0, 0.0, -1.0], [1.0, 0.0, 1.0], [-1.0, 0.0, 1.0]];
/// let tile = TriangleBvh::new(&corners, &[[0, 2, 1], [0, 3, 2]], &BvhOptions::default())?;
/// let tile = Arc::new(tile);
/// let at = |x: f32| BvhInstance {
///     mesh: Arc::clone(&tile),
///     transform: Affine3A::from_translation(Vec3::X * x),
/// };
/// let mut tiles = InstanceBvh::new(vec![at(0.0), at(2.0)], Instructions::Detect)?;
/// let ray = Ray::new([1.5, 1.0, 0.5], Vec3::NEG_Y);
/// let hit = tiles.closest_hit(&ray).expect("the second tile");
/// assert_eq!((hit.primitive, tiles.locate(hit.primitive)), (3, Some((1, 1))));
/// // It moves away.
/// tiles.set_transforms(&[(1, Affine3A::from_translation(Vec3::X * 9.0))])?;
/// assert_eq!(tiles.closest_hit(&ray), None);
/// # Ok::<(), caustics_accel::AccelError>(())
/// ```
///
/// # Limits
/// Those of [`TriangleBvh`], for the meshes both in their own frames and in the world. Boxes grow by
/// what rounding can amount to, 1e-6 of the coordinates times the ratio of the transform's largest
/// to its least scale: far from the origin, or where a transform flattens a mesh to a thousandth,
/// rays are slower.
#[derive(Clone, Debug)]
pub struct InstanceBvh {
    instances: Vec<BvhInstance>,
    /// The first primitive's number of each instance, and one past the last of all.
    firsts: Vec<u32>,
    /// In the order of the leaves.
    placed: Vec<Placed>,
    nodes: Vec<Node>,
    root: Child,
    bounds: Aabb,
    dispatch: Dispatch,
}

/// An instance as traversal wants it.
#[derive(Clone, Copy, Debug)]
struct Placed {
    placement: Placement,
    instance: u32,
    /// Its first primitive's number.
    first: u32,
}

impl InstanceBvh {
    /// The most triangles of all instances together.
    pub const MAX_TRIANGLES: usize = u32::MAX as usize - 1;

    /// The most instances.
    pub const MAX_INSTANCES: usize = TriangleBvh::MAX_TRIANGLES;

    /// Builds the upper level.
    ///
    /// # Errors
    /// [`AccelError::InvalidTransform`], [`AccelError::TooManyTriangles`] or
    /// [`AccelError::TooManyBoxes`].
    pub fn new(
        instances: Vec<BvhInstance>,
        instructions: Instructions,
    ) -> Result<Self, AccelError> {
        if instances.len() > Self::MAX_INSTANCES {
            return Err(AccelError::TooManyBoxes {
                count: instances.len(),
                limit: Self::MAX_INSTANCES,
            });
        }
        let mut firsts = Vec::with_capacity(instances.len() + 1);
        let mut count = 0;
        for instance in &instances {
            firsts.push(count as u32);
            count += instance.mesh.len();
            if count > Self::MAX_TRIANGLES {
                let limit = Self::MAX_TRIANGLES;
                return Err(AccelError::TooManyTriangles { count, limit });
            }
        }
        firsts.push(count as u32);
        let mut tree = Self {
            instances,
            firsts,
            placed: Vec::new(),
            nodes: Vec::new(),
            root: Child::EMPTY,
            bounds: Aabb::EMPTY,
            dispatch: Dispatch::new(instructions),
        };
        tree.build()?;
        Ok(tree)
    }

    /// Moves instances, each given by its index, and builds the upper level anew.
    ///
    /// # Errors
    /// [`AccelError::NoSuchInstance`] or [`AccelError::InvalidTransform`]; nothing has moved then.
    pub fn set_transforms(&mut self, moved: &[(usize, Affine3A)]) -> Result<(), AccelError> {
        for &(instance, transform) in moved {
            let Some(BvhInstance { mesh, .. }) = self.instances.get(instance) else {
                return Err(self.no_such(instance));
            };
            if Placement::new(&transform, &mesh.bounds()).is_none() {
                return Err(invalid(instance));
            }
        }
        for &(instance, transform) in moved {
            self.instances[instance].transform = transform;
        }
        self.build()
    }

    /// Gives an instance another mesh of as many triangles, such as the same one refitted, and
    /// builds the upper level anew.
    ///
    /// # Errors
    /// [`AccelError::NoSuchInstance`], [`AccelError::TriangleCountChanged`] or
    /// [`AccelError::InvalidTransform`]; nothing has changed then.
    pub fn set_mesh(&mut self, instance: usize, mesh: Arc<TriangleBvh>) -> Result<(), AccelError> {
        let Some(former) = self.instances.get_mut(instance) else {
            return Err(self.no_such(instance));
        };
        let (given, expected) = (mesh.len(), former.mesh.len());
        if given != expected {
            return Err(AccelError::TriangleCountChanged { given, expected });
        }
        if Placement::new(&former.transform, &mesh.bounds()).is_none() {
            return Err(invalid(instance));
        }
        former.mesh = mesh;
        self.build()
    }

    /// The instances, in the order in which they were given.
    #[must_use]
    pub fn instances(&self) -> &[BvhInstance] {
        &self.instances
    }

    /// How many triangles all instances have together.
    #[must_use]
    pub fn len(&self) -> usize {
        self.firsts.last().map_or(0, |&count| count as usize)
    }

    /// Whether there is no triangle.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The instance that a primitive belongs to, and its number in that instance's mesh; `None`
    /// for a number that no primitive has.
    #[must_use]
    pub fn locate(&self, primitive: u32) -> Option<(usize, u32)> {
        // Of several that start at the same number all but the last are empty.
        let after = self.firsts.partition_point(|&first| first <= primitive);
        let instance = after.checked_sub(1)?;
        (after < self.firsts.len()).then(|| (instance, primitive - self.firsts[instance]))
    }

    /// A box around all triangles that can be hit, widened by what rounding can move them.
    #[must_use]
    pub fn bounds(&self) -> Aabb {
        self.bounds
    }

    /// Memory that the upper level occupies, in bytes; the meshes, which may be shared, come on
    /// top of it.
    #[must_use]
    pub fn memory_bytes(&self) -> usize {
        size_of::<Self>()
            + self.instances.capacity() * size_of::<BvhInstance>()
            + self.firsts.capacity() * size_of::<u32>()
            + self.placed.capacity() * size_of::<Placed>()
            + self.nodes.capacity() * size_of::<Node>()
    }

    fn no_such(&self, instance: usize) -> AccelError {
        AccelError::NoSuchInstance {
            instance,
            instances: self.instances.len(),
        }
    }

    fn build(&mut self) -> Result<(), AccelError> {
        let mut placed = Vec::with_capacity(self.instances.len());
        let mut boxes = Vec::with_capacity(self.instances.len());
        for (index, instance) in self.instances.iter().enumerate() {
            let mesh = instance.mesh.bounds();
            let Some(placement) = Placement::new(&instance.transform, &mesh) else {
                return Err(invalid(index));
            };
            let bounds = placement.bounds(&mesh);
            if !bounds.is_empty() {
                boxes.push(bounds);
                placed.push(Placed {
                    placement,
                    instance: index as u32,
                    first: self.firsts[index],
                });
            }
        }
        let (tree, order) = BoxTree::new(&boxes)?;
        self.nodes.clear();
        self.nodes.extend(tree.nodes().map(|members| {
            let mut node = Node::EMPTY;
            for (lane, member) in members.into_iter().enumerate() {
                if let Some((member, bounds)) = member {
                    let child = match member {
                        Member::Node(place) => Child::node(place),
                        Member::Box(place) => Child::leaf(place, 1),
                    };
                    node.set(lane, bounds.min.to_array(), bounds.max.to_array(), child);
                }
            }
            node
        }));
        self.root = if self.nodes.is_empty() {
            Child::EMPTY
        } else {
            Child::node(0)
        };
        self.placed.clear();
        self.placed
            .extend(order.iter().map(|&place| placed[place as usize]));
        self.bounds = boxes
            .iter()
            .fold(Aabb::EMPTY, |all, bounds| all.union(bounds));
        Ok(())
    }
}

fn invalid(instance: usize) -> AccelError {
    AccelError::InvalidTransform {
        instance,
        limit: MAX_COORDINATE,
    }
}

impl Intersect for InstanceBvh {
    #[inline]
    fn closest_hit(&self, ray: &Ray) -> Option<Hit> {
        self.dispatch.run(ClosestHit { stage: self, ray })
    }

    /// As that of [`TriangleBvh`]: worth it where rays that follow each other lie close together. What
    /// they share is also the transforming of the triangles.
    fn closest_hits(&self, rays: &[Ray], hits: &mut [Option<Hit>]) {
        self.dispatch.run(ClosestHits {
            stage: self,
            rays,
            hits,
        });
    }

    #[inline]
    fn is_occluded(&self, ray: &Ray) -> bool {
        self.dispatch.run(Occlusion { stage: self, ray })
    }
}
