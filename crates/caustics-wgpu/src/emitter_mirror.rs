//! What the shaders are told of an emitter of the CPU's plan.

use std::f32::consts::PI;

use caustics_geometry::Frame;
use caustics_sampling::warp::{Cone, DensityTable};
use caustics_sampling::{CounterRng, Grid, Rank1Lattice, Rotation, Sequence};
use caustics_scene::{Light, World};
use caustics_trace::{AreaSurface, EmissionDomain, MediumStack, TraceOptions};
use glam::{Vec2, Vec3};

use crate::GpuError;
use crate::body_order::BodyOrder;
use crate::gpu_scene::SPHERE_BIT;
use crate::trace_params::Emitter as Mirror;

/// What the shader is told of an emitter's rays; `None` where it has none.
pub(crate) fn mirror(
    world: &World,
    order: &BodyOrder,
    domain: &EmissionDomain,
) -> Result<Option<Mirror>, GpuError> {
    let everywhere = Mirror {
        // Cones wider than all directions, inside which the light does not fall off.
        inner_cosine: -2.0,
        outer_cosine: -3.0,
        target_radius: -1.0,
        side: 1.0,
        ..Mirror::default()
    };
    let mirror = match domain {
        EmissionDomain::Sphere { light, origin } => Mirror {
            kind: Mirror::SPHERE,
            origin: origin.to_array(),
            solid_angle: 4.0 * PI,
            ..with_light(everywhere, light)
        },
        EmissionDomain::Cone {
            light,
            origin,
            frame,
            cone,
        } => Mirror {
            kind: Mirror::CONE,
            origin: origin.to_array(),
            ..in_frame(with_light(everywhere, light), frame, Some(cone))
        },
        EmissionDomain::Rectangle {
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
        EmissionDomain::Area { surface, target } => {
            let (center, radius) = target.map_or((Vec3::ZERO, -1.0), |it| (it.center, it.radius));
            Mirror {
                kind: Mirror::AREA,
                intensity: surface.radiance(world).to_array(),
                area: surface.area(world),
                target_center: center.to_array(),
                target_radius: radius,
                ..from_surface(everywhere, world, order, surface)?
            }
        }
        EmissionDomain::Nothing => return Ok(None),
        EmissionDomain::Sky { target, distance } => {
            let Some(sky) = world.environment() else {
                return Ok(None);
            };
            let [sky_width, sky_height] = sky.size();
            Mirror {
                kind: Mirror::SKY,
                intensity: [sky.strongest_sample(); 3],
                area: PI * target.radius * target.radius,
                radius: *distance,
                target_center: target.center.to_array(),
                target_radius: target.radius,
                sky_width,
                sky_height,
                ..everywhere
            }
        }
        _ => {
            return Err(GpuError::Unsupported {
                what: "a kind of light",
            });
        }
    };
    Ok(Some(mirror))
}

fn with_light(mirror: Mirror, light: &Light) -> Mirror {
    match *light {
        Light::Point { intensity, .. } => Mirror {
            intensity: intensity.to_array(),
            ..mirror
        },
        Light::Spot {
            direction,
            intensity,
            inner_cos,
            outer_cos,
            ..
        } => Mirror {
            intensity: intensity.to_array(),
            spot_axis: direction.to_array(),
            inner_cosine: inner_cos,
            outer_cosine: outer_cos,
            ..mirror
        },
        _ => mirror,
    }
}

fn in_frame(mirror: Mirror, frame: &Frame, cone: Option<&Cone>) -> Mirror {
    Mirror {
        tangent: frame.tangent.to_array(),
        bitangent: frame.bitangent.to_array(),
        axis: frame.normal.to_array(),
        height: cone.map_or(0.0, |it| it.height()),
        solid_angle: cone.map_or(0.0, |it| it.solid_angle()),
        ..mirror
    }
}

fn from_surface(
    mirror: Mirror,
    world: &World,
    order: &BodyOrder,
    surface: &AreaSurface,
) -> Result<Mirror, GpuError> {
    Ok(match surface {
        AreaSurface::Rectangle {
            corner,
            edges: [along, across],
            normal,
            ..
        } => Mirror {
            surface: Mirror::SURFACE_RECTANGLE,
            origin: corner.to_array(),
            tangent: along.to_array(),
            bitangent: across.to_array(),
            axis: normal.to_array(),
            ..mirror
        },
        AreaSurface::Disc {
            center,
            frame,
            radius,
            ..
        } => Mirror {
            surface: Mirror::SURFACE_DISC,
            origin: center.to_array(),
            radius: *radius,
            ..in_frame(mirror, frame, None)
        },
        AreaSurface::Cap {
            center,
            radius,
            frame,
            cone,
            ..
        } => Mirror {
            surface: Mirror::SURFACE_CAP,
            origin: center.to_array(),
            radius: *radius,
            ..in_frame(mirror, frame, Some(cone))
        },
        AreaSurface::Object { emitter, front } => {
            let light = &world.emitters()[*emitter as usize];
            let primitives = light.primitives();
            let first_primitive = if world.sphere(primitives.start).is_some() {
                SPHERE_BIT | order.bodies[light.object() as usize]
            } else {
                primitives.start
            };
            Mirror {
                surface: Mirror::SURFACE_OBJECT,
                side: if *front { 1.0 } else { -1.0 },
                first_primitive,
                primitive_count: primitives.len() as u32,
                ..mirror
            }
        }
        AreaSurface::Triangle {
            corners: [a, b, c],
            normal,
            ..
        } => Mirror {
            surface: Mirror::SURFACE_TRIANGLE,
            origin: a.to_array(),
            tangent: (b - a).to_array(),
            bitangent: (c - a).to_array(),
            axis: normal.to_array(),
            ..mirror
        },
        _ => {
            return Err(GpuError::Unsupported {
                what: "a kind of surface that shines",
            });
        }
    })
}

/// Sets what chooses the samples; its `points` are set.
pub(crate) fn sample_from(mirror: &mut Mirror, options: &TraceOptions) {
    let rotation = if options.seed == 0 {
        Rotation::NONE
    } else {
        Rotation::new(options.seed)
    };
    let mut place = rotation.shift();
    match options.sequence {
        Sequence::Grid => {
            mirror.rows = Grid::new(mirror.points).rows();
            place = if options.seed == 0 {
                Vec2::splat(0.5)
            } else {
                CounterRng::new(options.seed, 0).next_vec2()
            };
        }
        Sequence::Fibonacci => {
            let lattice = Rank1Lattice::fibonacci(mirror.points);
            mirror.generator = lattice.generator();
            let [first, second] = lattice.basis();
            mirror.basis = [first.x, first.y, second.x, second.y];
        }
        _ => {}
    }
    mirror.place = place.to_array();
}

/// Sets the media around the emitter's start.
pub(crate) fn set_media(mirror: &mut Mirror, media: &MediumStack, order: &BodyOrder) {
    for (place, &object) in media.objects().iter().enumerate() {
        mirror.media[place / 2] |= order.bodies[object as usize] << (16 * (place % 2));
        mirror.media_count += 1;
    }
}

/// What no photon of the emitter exceeds in any channel, in watts.
pub(crate) fn largest_flux(mirror: &Mirror, density: Option<&DensityTable>) -> f32 {
    let measure = match mirror.kind {
        Mirror::RECTANGLE | Mirror::SKY => mirror.area,
        // The widest cone, and more than the cosine-weighted hemisphere.
        Mirror::AREA => 2.0 * PI * mirror.area,
        _ => mirror.solid_angle,
    };
    let densities = density.map_or(&[1.0][..], DensityTable::densities);
    let least = densities.iter().copied().fold(f32::INFINITY, f32::min);
    Vec3::from(mirror.intensity).max_element() * measure * (mirror.share / least)
}

#[cfg(test)]
mod tests {
    use super::*;
    use caustics_geometry::shapes::icosphere;
    use caustics_scene::{BvhOptions, Environment, Instance, Material, Scene, Shape};
    use caustics_trace::EmissionPlan;

    /// The sums of the ledger are integers in units of it.
    #[test]
    fn no_photon_exceeds_the_largest_flux() {
        let corners = [[0.0, 3.0, 0.0], [1.0, 3.0, 0.2], [0.0, 3.0, 1.0]];
        let edges = [[1.0, 0.0, 0.0], [0.0, 0.2, 1.0]];
        let color = [4.0, 3.0, 2.0];
        // The sun's texel is a millionth of the picture and has nearly all of its light; dim texels
        // have a few parts each, by which their densities are rounded most.
        let mut pixels = vec![[0.2, 0.3, 0.4]; 64 * 32];
        pixels[700] = [1e9, 1e8, 1e7];
        let sky = Environment::new(64, 32, pixels).unwrap();
        let mut lights = vec![None];
        lights.extend(
            [
                Light::point([0.4, 3.0, 0.2], color),
                Light::spot([1.0, 3.0, 0.0], [-0.3, -1.0, 0.0], color, 0.1, 0.4),
                Light::directional([-0.3, -1.0, -0.1], color),
                Light::rectangle([-0.5, 3.0, -0.5], edges, color),
                Light::triangle(corners, color),
                Light::disc([0.3, 3.0, 0.0], [0.1, -1.0, 0.0], 0.4, color),
                Light::sphere([0.3, 3.0, 0.2], 0.3, color),
            ]
            .map(|it| Some(it.unwrap())),
        );
        for light in lights {
            let mut scene = Scene::new();
            let mesh = Shape::Mesh(scene.add_mesh(icosphere(0.7, 2).unwrap()));
            let glass = Material::dielectric("glass", 1.5);
            let glass = scene.add_material(glass).unwrap();
            let ball = Instance::new("ball", mesh, glass);
            scene.add_instance(ball).unwrap();
            match light {
                Some(light) => {
                    scene.add_light(light).unwrap();
                }
                None => scene.set_environment(Some(sky.clone())),
            }
            let world = World::new(&scene).unwrap();
            let rays = world.intersector(&BvhOptions::default()).unwrap();
            let options = TraceOptions {
                photons: 3_000,
                ..TraceOptions::default()
            };
            let plan = EmissionPlan::new(&world, &rays, &options).unwrap();
            let order = BodyOrder::new(&world).unwrap();
            let mut photons = 0;
            for batch in plan.batches() {
                let emitter = batch.emitter();
                let mut mirror = mirror(&world, &order, emitter.domain()).unwrap().unwrap();
                mirror.share = 1.0 / batch.points().count() as f32;
                let bound = (1.0 + 1e-6) * largest_flux(&mirror, batch.density());
                let mut strongest = 0.0f32;
                for index in 0..batch.count() {
                    let emission = emitter.emit::<4>(&world, &batch.sample(index));
                    let flux = emission.map_or(0.0, |it| it.flux.max_element());
                    strongest = strongest.max(flux);
                    photons += u32::from(flux > 0.0);
                }
                assert!(strongest <= bound, "{strongest} > {bound}: {light:?}");
                // And the units are not needlessly coarse.
                assert!(100.0 * strongest > bound, "{strongest} {bound}: {light:?}");
            }
            assert!(photons > 100, "{photons}: {light:?}");
        }
    }
}
