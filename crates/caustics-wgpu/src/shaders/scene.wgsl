// The scene as the tracer reads it. Twin: gpu_scene.rs.

// A box and what is in it.
struct Node {
    low: vec3<f32>,
    // The left child, which the right one follows; or the leaf's primitive.
    first: u32,
    high: vec3<f32>,
    is_leaf: u32,
}

// Up to four boxes and what is in them, in 255 steps along each axis from the lowest corner of all.
struct WideNode {
    origin: vec3<f32>,
    // Of the steps, powers of two: a byte for each axis, biased by 127.
    exponents: u32,
    // A byte for each child.
    low: vec3<u32>,
    unused_a: u32,
    high: vec3<u32>,
    unused_b: u32,
    // Nodes; or with `LEAF_BIT` primitives; or `NO_PRIMITIVE`.
    children: vec4<u32>,
}

// Set in a wide node's child that is a primitive. All bits of `NO_PRIMITIVE` are.
const LEAF_BIT: u32 = 0x40000000u;

struct Vertex {
    position: vec3<f32>,
    normal_x: f32,
    normal_y: f32,
    normal_z: f32,
    unused_a: f32,
    unused_b: f32,
}

struct Triangle {
    a: u32,
    b: u32,
    c: u32,
    body: u32,
}

// An object with its material. Dielectrics come first, so that 16 bits number them.
struct Body {
    // The dielectric's absorption coefficient, or the metal's reflectance at normal incidence.
    color: vec3<f32>,
    kind: u32,
    // The refractive index for each channel, with dispersion.
    channel_ior: vec3<f32>,
    ior: f32,
    // Of the exact sphere, if it is one.
    center: vec3<f32>,
    radius: f32,
    // Index among the world's objects.
    object: u32,
    priority: i32,
    disperses: u32,
    // What it is a part of that lights aim at; `NO_CASTER` for receivers.
    caster: u32,
}

const BODY_RECEIVER: u32 = 0u;
const BODY_DIELECTRIC: u32 = 1u;
const BODY_METAL: u32 = 2u;

// Set in the number of a primitive that is a sphere; the other bits are its body.
const SPHERE_BIT: u32 = 0x80000000u;
