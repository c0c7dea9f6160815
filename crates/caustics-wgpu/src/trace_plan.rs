use std::f32::consts::PI;

use caustics_accel::Intersect;
use caustics_geometry::Frame;
use caustics_sampling::warp::Cone;
use caustics_sampling::{CounterRng, Grid, Rank1Lattice, Rotation, Sequence};
use caustics_scene::{AreaLight, Light, World};
use caustics_trace::{Branching, Emitter, EmitterDomain, MediumStack, TraceOptions};
use glam::{DVec3, Vec2, Vec3};

use crate::GpuError;
use crate::body_order::{BodyOrder, at_most};
use crate::gpu_scene::SPHERE_BIT;
use crate::trace_params;

/// The largest flux of a photon, in units of the ledger's sums.
const LARGEST_FLUX: f32 = (1 << 30) as f32;

/// The photons of all lights, as the shaders emit them: the same light for the same number as
/// [`trace_photons`](caustics_trace::trace_photons) emits with the same options.
#[derive(Clone, Debug)]
pub struct TracePlan {
    pub(crate) emitters: Vec<PlannedEmitter>,
    pub(crate) options: TraceOptions,
    pub(crate) flux_scale: f32,
    power: DVec3,
    photons: u32,
}

/// A light's photons.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PlannedEmitter {
    pub(crate) mirror: trace_params::Emitter,
    /// Parameters of its rays: 2 or 4.
    pub(crate) dimensions: u32,
}

impl TracePlan {
    /// The most photons of one plan.
    pub const MAX_PHOTONS: u32 = 1 << 30;

    /// Aims the lights and shares the photons among them. `intersect` finds the media around them.
    ///
    /// # Errors
    /// [`GpuError::Options`] for options out of range, [`GpuError::Unsupported`] for
    /// [`Refinement`](caustics_trace::Refinement), and [`GpuError::TooMany`].
    pub fn new<I: Intersect + ?Sized>(
        world: &World,
        intersect: &I,
        options: &TraceOptions,
    ) -> Result<Self, GpuError> {
        options.validate()?;
        if options.refinement.levels > 0 {
            let what = "photons whose lattice is refined";
            return Err(GpuError::Unsupported { what });
        }
        let photons = u64::from(options.photons);
        at_most("photons", photons, Self::MAX_PHOTONS.into())?;
        let order = BodyOrder::new(world)?;
        let emitters = Emitter::all(world, options.aim);
        let counts = Emitter::share(&emitters, options.photons);
        let mut plan = Self {
            emitters: Vec::with_capacity(emitters.len()),
            options: *options,
            flux_scale: 1.0,
            power: emitters.iter().map(Emitter::power).sum(),
            photons: 0,
        };
        let mut strongest = 0.0f32;
        for (emitter, &count) in emitters.iter().zip(&counts) {
            let Some(mut mirror) = mirror(world, &order, emitter)? else {
                plan.photons += count;
                continue;
            };
            if count == 0 {
                continue;
            }
            mirror.first = plan.photons;
            mirror.count = count;
            mirror.share = 1.0 / count as f32;
            sample_from(&mut mirror, options);
            if let Some(start) = emitter.start() {
                let media = MediumStack::at(world, intersect, start);
                set_media(&mut mirror, &media, &order);
            }
            strongest = strongest.max(largest_flux(&mirror));
            plan.photons += count;
            plan.emitters.push(PlannedEmitter {
                mirror,
                dimensions: emitter.dimensions() as u32,
            });
        }
        if strongest > 0.0 {
            // A power of two, so that scaling does not round.
            plan.flux_scale = (LARGEST_FLUX / strongest).log2().floor().exp2();
        }
        Ok(plan)
    }

    /// How many photons there are, of all lights together: numbers 0 and up.
    #[must_use]
    pub fn photons(&self) -> u32 {
        self.photons
    }

    /// Everything that the lights emit, in watts: what is aimed and what is not.
    #[must_use]
    pub fn power(&self) -> DVec3 {
        self.power
    }

    pub(crate) fn sequence(&self) -> u32 {
        match self.options.sequence {
            Sequence::Halton => 0,
            Sequence::Sobol => 1,
            Sequence::Fibonacci => 3,
            Sequence::Kronecker => 4,
            _ => 2,
        }
    }

    pub(crate) fn branching(&self) -> u32 {
        match self.options.branching {
            Branching::Roulette => 0,
            Branching::SplitFirst => 1,
            _ => 2,
        }
    }
}

/// What the shader is told of an emitter's rays; `None` where it has none.
fn mirror(
    world: &World,
    order: &BodyOrder,
    emitter: &Emitter<'_>,
) -> Result<Option<trace_params::Emitter>, GpuError> {
    use trace_params::Emitter as Mirror;
    let everywhere = Mirror {
        // Cones wider than all directions, inside which the light does not fall off.
        inner_cosine: -2.0,
        outer_cosine: -3.0,
        target_radius: -1.0,
        side: 1.0,
        ..Mirror::default()
    };
    let mirror = match emitter.domain() {
        EmitterDomain::Sphere { light, origin } => Mirror {
            kind: Mirror::SPHERE,
            origin: origin.to_array(),
            solid_angle: 4.0 * PI,
            ..with_light(everywhere, light)
        },
        EmitterDomain::Cone {
            light,
            origin,
            frame,
            cone,
        } => in_cone(with_light(everywhere, light), origin, &frame, cone),
        EmitterDomain::Rectangle {
            corner,
            edges: [along, across],
            direction,
            irradiance,
        } => Mirror {
            kind: Mirror::RECTANGLE,
            origin: corner.to_array(),
            tangent: along.to_array(),
            bitangent: across.to_array(),
            axis: direction.to_array(),
            intensity: irradiance.to_array(),
            area: along.length() * across.length(),
            ..everywhere
        },
        EmitterDomain::Area {
            light,
            front,
            target,
        } => {
            let mirror = from_area(everywhere, world, order, light);
            let (center, radius) = target.map_or((Vec3::ZERO, -1.0), |it| (it.center, it.radius));
            Mirror {
                side: if front { 1.0 } else { -1.0 },
                target_center: center.to_array(),
                target_radius: radius,
                ..mirror
            }
        }
        EmitterDomain::Nothing => return Ok(None),
        _ => {
            return Err(GpuError::Unsupported {
                what: "a kind of light",
            });
        }
    };
    Ok(Some(mirror))
}

fn with_light(mirror: trace_params::Emitter, light: &Light) -> trace_params::Emitter {
    match *light {
        Light::Point { intensity, .. } => trace_params::Emitter {
            intensity: intensity.to_array(),
            ..mirror
        },
        Light::Spot {
            direction,
            intensity,
            inner_cos,
            outer_cos,
            ..
        } => trace_params::Emitter {
            intensity: intensity.to_array(),
            spot_axis: direction.to_array(),
            inner_cosine: inner_cos,
            outer_cosine: outer_cos,
            ..mirror
        },
        _ => mirror,
    }
}

fn in_cone(
    mirror: trace_params::Emitter,
    origin: Vec3,
    frame: &Frame,
    cone: Cone,
) -> trace_params::Emitter {
    trace_params::Emitter {
        kind: trace_params::Emitter::CONE,
        origin: origin.to_array(),
        solid_angle: cone.solid_angle(),
        height: cone.height(),
        tangent: frame.tangent.to_array(),
        bitangent: frame.bitangent.to_array(),
        axis: frame.normal.to_array(),
        ..mirror
    }
}

fn from_area(
    mirror: trace_params::Emitter,
    world: &World,
    order: &BodyOrder,
    light: &AreaLight,
) -> trace_params::Emitter {
    let primitives = light.primitives();
    let is_sphere = world.sphere(primitives.start).is_some();
    let first_primitive = if is_sphere {
        SPHERE_BIT | order.bodies[light.object() as usize]
    } else {
        primitives.start
    };
    trace_params::Emitter {
        kind: trace_params::Emitter::AREA,
        intensity: light.radiance().to_array(),
        area: light.area(),
        first_primitive,
        primitive_count: primitives.len() as u32,
        first_cumulative: BodyOrder::cumulative_areas(world, light.object()).start,
        ..mirror
    }
}

/// Sets what chooses the samples; its `count` is set.
fn sample_from(mirror: &mut trace_params::Emitter, options: &TraceOptions) {
    let rotation = if options.seed == 0 {
        Rotation::NONE
    } else {
        Rotation::new(options.seed)
    };
    let mut place = rotation.shift();
    match options.sequence {
        Sequence::Grid => {
            mirror.rows = Grid::new(mirror.count).rows();
            place = if options.seed == 0 {
                Vec2::splat(0.5)
            } else {
                CounterRng::new(options.seed, 0).next_vec2()
            };
        }
        Sequence::Fibonacci => {
            let lattice = Rank1Lattice::fibonacci(mirror.count);
            mirror.generator = lattice.generator();
            let [first, second] = lattice.basis();
            mirror.basis = [first.x, first.y, second.x, second.y];
        }
        _ => {}
    }
    mirror.place = place.to_array();
}

fn set_media(mirror: &mut trace_params::Emitter, media: &MediumStack, order: &BodyOrder) {
    for (place, &object) in media.objects().iter().enumerate() {
        mirror.media[place / 2] |= order.bodies[object as usize] << (16 * (place % 2));
        mirror.media_count += 1;
    }
}

/// What no photon of the emitter exceeds in any channel, in watts.
fn largest_flux(mirror: &trace_params::Emitter) -> f32 {
    let measure = match mirror.kind {
        trace_params::Emitter::RECTANGLE => mirror.area,
        // The widest cone, and more than the cosine-weighted hemisphere.
        trace_params::Emitter::AREA => 2.0 * PI * mirror.area,
        _ => mirror.solid_angle,
    };
    Vec3::from(mirror.intensity).max_element() * measure * mirror.share
}
