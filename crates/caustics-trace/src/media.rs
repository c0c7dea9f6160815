use caustics_accel::Intersect;
use caustics_geometry::Ray;
use caustics_scene::{Surface, World};
use glam::Vec3;

use crate::optics::{CHANNEL_WAVELENGTHS, dispersed_ior};

/// How many closed dielectrics may enclose one point. Beyond it the outermost are forgotten.
const CAPACITY: usize = 8;

/// Up, but along no axis and no usual edge.
const PROBE_DIRECTION: Vec3 = Vec3::new(0.017_452, 0.999_801, 0.009_599);

/// How many surfaces a probe passes before it is content.
const PROBE_LIMIT: usize = 256;

/// The refractive index of air, which is everywhere where no dielectric is.
const AIR: f32 = 1.0;

/// The closed dielectric objects that a point on a path lies in.
///
/// Where closed bodies overlap, as a liquid does that is modelled a little into the wall of its
/// glass, the one with the highest priority is there and the others are not: a boundary inside a
/// body of higher priority does not exist for light (Schmidt and Budge, *Simple Nested Dielectrics
/// in Ray Traced Images*, Journal of Graphics Tools 2002). Of equal priorities the higher
/// refractive index wins, so that glass displaces water without being told.
///
/// Eight bodies may enclose a point; of more, the outermost are forgotten.
///
/// ```
/// use caustics_scene::{Instance, Material, Scene, Shape, World};
/// use caustics_trace::{Crossing, MediumStack};
/// # use caustics_trace::glam::Vec3;
///
/// let mut scene = Scene::new();
/// for material in [Material::dielectric("glass", 1.5), Material::dielectric("water", 1.33)] {
///     let material = scene.add_material(material)?;
///     let ball = Shape::Sphere { center: Vec3::ZERO, radius: 1.0 };
///     scene.add_instance(Instance::new("ball", ball, material))?;
/// }
/// let world = World::new(&scene)?;
/// let (glass, water) = (0, 1);
///
/// // In the wall of the glass the surface of the water does not exist ...
/// let wall = MediumStack::EMPTY.entered(glass);
/// let both = wall.entered(water);
/// assert_eq!(wall.cross(&world, water, true, None), Crossing::Through(both));
/// // ... and light that leaves the wall there goes from glass to water.
/// assert_eq!(
///     both.cross(&world, glass, false, None),
///     Crossing::Interface {
///         index_from: 1.5,
///         index_to: 1.33,
///         beyond: MediumStack::EMPTY.entered(water),
///     }
/// );
/// # Ok::<(), caustics_scene::SceneError>(())
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct MediumStack {
    objects: [u32; CAPACITY],
    count: u8,
}

/// What a path finds at the boundary of a dielectric object. Refractive indices are those of the
/// colour channel asked for, at least 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Crossing {
    /// The boundary lies inside a body of higher priority: light goes straight on.
    Through(MediumStack),
    /// Light is reflected and refracted.
    Interface {
        /// Refractive index on the side from which the light comes.
        index_from: f32,
        /// Refractive index on the other side.
        index_to: f32,
        /// The media beyond the boundary.
        beyond: MediumStack,
    },
}

/// A dielectric as one path sees it.
#[derive(Clone, Copy)]
struct Medium {
    priority: i32,
    ior: f32,
    dispersion: f32,
    attenuation: Vec3,
}

impl Medium {
    fn of(world: &World, object: u32) -> Option<Self> {
        let material = world.objects().get(object as usize)?.material;
        match world.materials().get(material as usize)?.surface {
            Surface::Dielectric {
                ior,
                attenuation,
                dispersion,
                priority,
            } => Some(Self {
                priority,
                ior,
                dispersion,
                attenuation,
            }),
            _ => None,
        }
    }

    fn displaces(&self, other: &Self) -> bool {
        (self.priority, self.ior) > (other.priority, other.ior)
    }

    fn index(&self, channel: Option<u8>) -> f32 {
        match channel {
            Some(channel) if self.dispersion > 0.0 => {
                let wavelength = CHANNEL_WAVELENGTHS[usize::from(channel.min(2))];
                dispersed_ior(self.ior, self.dispersion, wavelength)
            }
            _ => self.ior,
        }
    }
}

impl MediumStack {
    /// Air alone.
    pub const EMPTY: Self = Self {
        objects: [0; CAPACITY],
        count: 0,
    };

    /// The media around `point`, found by looking along one ray to the end of the world: the point
    /// lies inside each dielectric whose surface the ray first meets from within.
    ///
    /// Lights and cameras may stand in water or glass; this is how their paths start. The ray goes
    /// up: below an open sheet of water there is water, however deep. It passes 256 surfaces at
    /// most, and what it meets beyond is not found.
    #[must_use]
    pub fn at<I: Intersect + ?Sized>(world: &World, intersect: &I, point: Vec3) -> Self {
        let mut stack = Self::EMPTY;
        let mut seen: Vec<u32> = Vec::new();
        let mut ray = Ray::new(point, PROBE_DIRECTION);
        for _ in 0..PROBE_LIMIT {
            let Some(hit) = intersect.closest_hit(&ray) else {
                break;
            };
            let Some(surface) = world.surface(&ray, &hit) else {
                break;
            };
            if !seen.contains(&surface.object) {
                seen.push(surface.object);
                if !surface.from_outside && Medium::of(world, surface.object).is_some() {
                    stack = stack.entered(surface.object);
                }
            }
            let origin = surface
                .spawn
                .origin_towards(surface.geometric_normal, PROBE_DIRECTION);
            ray = Ray::new(origin, PROBE_DIRECTION);
        }
        stack
    }

    /// The objects that enclose the point, in the order in which the path entered them.
    #[must_use]
    pub fn objects(&self) -> &[u32] {
        &self.objects[..usize::from(self.count)]
    }

    /// The stack after entering `object`.
    #[must_use]
    pub fn entered(&self, object: u32) -> Self {
        let mut next = *self;
        if usize::from(next.count) == CAPACITY {
            next.objects.copy_within(1.., 0);
            next.count -= 1;
        }
        next.objects[usize::from(next.count)] = object;
        next.count += 1;
        next
    }

    /// The stack after leaving `object`; unchanged if the path never entered it, as happens to one
    /// that starts inside.
    #[must_use]
    pub fn left(&self, object: u32) -> Self {
        let mut next = *self;
        if let Some(place) = self.objects().iter().rposition(|&inside| inside == object) {
            next.objects.copy_within(place + 1.., place);
            next.count -= 1;
        }
        next
    }

    /// The absorption coefficient of the medium that is here, per metre; zero in air.
    #[must_use]
    pub fn attenuation(&self, world: &World) -> Vec3 {
        self.current(world)
            .map_or(Vec3::ZERO, |medium| medium.attenuation)
    }

    /// What a path with these media finds where it meets `object`, coming `from_outside` of it or
    /// not, in one colour channel (0, 1, 2; more is taken as 2) or in all.
    ///
    /// `object` is an index into [`World::objects`]; one that is no dielectric has no boundary
    /// here, and light goes straight on.
    #[must_use]
    pub fn cross(
        &self,
        world: &World,
        object: u32,
        from_outside: bool,
        channel: Option<u8>,
    ) -> Crossing {
        let Some(medium) = Medium::of(world, object) else {
            return Crossing::Through(*self);
        };
        let beyond = if from_outside {
            self.entered(object)
        } else {
            self.left(object)
        };
        // The media around the boundary, the object itself left out.
        let around = if from_outside { *self } else { beyond };
        let surrounding = around.current(world);
        if surrounding.is_some_and(|other| other.displaces(&medium)) {
            return Crossing::Through(beyond);
        }
        let outside = surrounding.map_or(AIR, |other| other.index(channel));
        let inside = medium.index(channel);
        let (index_from, index_to) = if from_outside {
            (outside, inside)
        } else {
            (inside, outside)
        };
        Crossing::Interface {
            index_from,
            index_to,
            beyond,
        }
    }

    fn current(&self, world: &World) -> Option<Medium> {
        self.objects()
            .iter()
            .filter_map(|&object| Medium::of(world, object))
            .reduce(|a, b| if b.displaces(&a) { b } else { a })
    }
}
