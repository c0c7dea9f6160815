//! Mirrors of the structs of `shaders/scene.wgsl`, and a world packed into them.

use bytemuck::{Pod, Zeroable};
use caustics_scene::{Surface, World};
use caustics_trace::{CHANNEL_WAVELENGTHS, Casters, dispersed_ior};

use crate::GpuError;
use crate::body_order::BodyOrder;
use crate::trace_params::NO_CASTER;

/// Set in the number of a primitive that is a sphere; the other bits are its body.
pub(crate) const SPHERE_BIT: u32 = 1 << 31;

/// The number of no primitive and of no node.
pub(crate) const NO_PRIMITIVE: u32 = u32::MAX;

#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Node {
    pub(crate) low: [f32; 3],
    /// The left child, which the right one follows; or the leaf's primitive.
    pub(crate) first: u32,
    pub(crate) high: [f32; 3],
    pub(crate) is_leaf: u32,
}

/// Set in a wide node's child that is a primitive.
pub(crate) const LEAF_BIT: u32 = 1 << 30;

#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct WideNode {
    pub(crate) origin: [f32; 3],
    /// Of the steps: a byte for each axis, biased by 127.
    pub(crate) exponents: u32,
    /// For each axis a byte for each child.
    pub(crate) low: [u32; 3],
    pub(crate) unused_a: u32,
    pub(crate) high: [u32; 3],
    pub(crate) unused_b: u32,
    /// Nodes; or with [`LEAF_BIT`] primitives; or [`NO_PRIMITIVE`].
    pub(crate) children: [u32; 4],
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Vertex {
    pub(crate) position: [f32; 3],
    pub(crate) normal_x: f32,
    pub(crate) normal_y: f32,
    pub(crate) normal_z: f32,
    pub(crate) unused_a: f32,
    pub(crate) unused_b: f32,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Triangle {
    pub(crate) a: u32,
    pub(crate) b: u32,
    pub(crate) c: u32,
    pub(crate) body: u32,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Body {
    pub(crate) color: [f32; 3],
    pub(crate) kind: u32,
    pub(crate) channel_ior: [f32; 3],
    pub(crate) ior: f32,
    pub(crate) center: [f32; 3],
    pub(crate) radius: f32,
    pub(crate) object: u32,
    pub(crate) priority: i32,
    pub(crate) disperses: u32,
    pub(crate) caster: u32,
}

impl Body {
    pub(crate) const RECEIVER: u32 = 0;
    pub(crate) const DIELECTRIC: u32 = 1;
    pub(crate) const METAL: u32 = 2;

    fn of(world: &World, casters: &Casters, object: u32) -> Self {
        let described = &world.objects()[object as usize];
        let mut body = Self {
            object,
            kind: Self::RECEIVER,
            caster: casters.of_object(object).unwrap_or(NO_CASTER),
            ..Self::default()
        };
        match world.materials()[described.material as usize].surface {
            Surface::Dielectric {
                ior,
                attenuation,
                dispersion,
                priority,
            } => {
                body.kind = Self::DIELECTRIC;
                body.color = attenuation.to_array();
                body.ior = ior;
                body.channel_ior = CHANNEL_WAVELENGTHS.map(|wavelength| {
                    if dispersion > 0.0 {
                        dispersed_ior(ior, dispersion, wavelength)
                    } else {
                        ior
                    }
                });
                body.priority = priority;
                body.disperses = u32::from(dispersion > 0.0);
            }
            Surface::Metal { f0 } => {
                body.kind = Self::METAL;
                body.color = f0.to_array();
            }
            _ => {}
        }
        if let Some(sphere) = world.spheres().get(described.spheres.start as usize)
            && !described.spheres.is_empty()
        {
            body.center = sphere.center.to_array();
            body.radius = sphere.radius;
        }
        body
    }
}

/// A world in the form of the shaders' buffers, without its hierarchy.
#[derive(Clone, Debug)]
pub(crate) struct PackedScene {
    pub(crate) vertices: Vec<Vertex>,
    pub(crate) triangles: Vec<Triangle>,
    pub(crate) bodies: Vec<Body>,
}

impl PackedScene {
    pub(crate) fn new(world: &World) -> Result<Self, GpuError> {
        let order = BodyOrder::new(world)?;
        let triangles = (0..).zip(world.triangles()).map(|(primitive, &[a, b, c])| {
            let object = world.object_of(primitive).unwrap_or(0);
            let body = order.bodies[object as usize];
            Triangle { a, b, c, body }
        });
        let casters = Casters::of(world);
        let bodies = order.objects.iter();
        let bodies = bodies.map(|&object| Body::of(world, &casters, object));
        Ok(Self {
            vertices: vertices(world),
            triangles: triangles.collect(),
            bodies: bodies.collect(),
        })
    }
}

/// The world's vertices with their normals.
pub(crate) fn vertices(world: &World) -> Vec<Vertex> {
    let both = world.positions().iter().zip(world.normals());
    both.map(|(position, normal)| Vertex {
        position: position.to_array(),
        normal_x: normal.x,
        normal_y: normal.y,
        normal_z: normal.z,
        ..Vertex::default()
    })
    .collect()
}
