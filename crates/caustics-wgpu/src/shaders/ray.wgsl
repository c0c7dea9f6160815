// Rays and what they hit. Twins: ray.rs and hit.rs in caustics-geometry.

struct Ray {
    origin: vec3<f32>,
    direction: vec3<f32>,
}

struct Hit {
    t: f32,
    u: f32,
    v: f32,
    // A triangle, or with `SPHERE_BIT` a body that is a sphere.
    primitive: u32,
}

const NO_PRIMITIVE: u32 = 0xffffffffu;
const FAR: f32 = 3.4e38;
