use caustics_scene::{Surface, World};

use crate::GpuError;

/// The order in which the shaders number objects: dielectrics first, since the stacks of media number
/// them in 16 bits. What is so numbered is called a body.
#[derive(Clone, Debug)]
pub(crate) struct BodyOrder {
    /// For each body, its index among the world's objects.
    pub(crate) objects: Vec<u32>,
    /// For each object, its body.
    pub(crate) bodies: Vec<u32>,
}

impl BodyOrder {
    const MAX_DIELECTRICS: u64 = 1 << 16;
    /// The highest bit of a primitive's number says that it is a sphere.
    const MAX_BODIES: u64 = 1 << 30;

    pub(crate) fn new(world: &World) -> Result<Self, GpuError> {
        let is_dielectric = |&object: &u32| {
            let material = world.objects()[object as usize].material;
            matches!(
                world.materials()[material as usize].surface,
                Surface::Dielectric { .. }
            )
        };
        let all = 0..world.objects().len() as u32;
        at_most("objects", u64::from(all.end), Self::MAX_BODIES)?;
        let (mut objects, others): (Vec<u32>, Vec<u32>) = all.partition(is_dielectric);
        at_most("dielectrics", objects.len() as u64, Self::MAX_DIELECTRICS)?;
        objects.extend(others);
        let mut bodies = vec![0; objects.len()];
        for (body, &object) in (0..).zip(&objects) {
            bodies[object as usize] = body;
        }
        Ok(Self { objects, bodies })
    }
}

/// Refuses a `count` above the `limit`.
pub(crate) fn at_most(what: &'static str, count: u64, limit: u64) -> Result<(), GpuError> {
    if count > limit {
        return Err(GpuError::TooMany { what, count, limit });
    }
    Ok(())
}
