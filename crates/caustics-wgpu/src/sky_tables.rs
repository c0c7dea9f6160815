//! An environment as the shaders sample it.

use caustics_scene::Environment;

use crate::GpuError;
use crate::gpu_scene::Triangle;

/// The rows of an environment and its texels, row by row, in the form of the triangles that they lie
/// behind: three floats in the places of vertices, and in that of the body where the part of the
/// samples ends. As `shaders/sky_emission.wgsl` says.
pub(crate) fn packed_sky(sky: &Environment) -> impl Iterator<Item = Triangle> {
    let entry = |[a, b, c]: [f32; 3], end| Triangle {
        a: a.to_bits(),
        b: b.to_bits(),
        c: c.to_bits(),
        body: end,
    };
    let rows = sky.rows().iter();
    let texels = sky.texels().iter();
    rows.map(move |it| entry([it.top, it.bottom, it.solid_angle], it.end))
        .chain(texels.map(move |it| entry(it.radiance.to_array(), it.end)))
}

/// Refuses an environment of another size than the one that buffers were filled with; one that is
/// not there has none.
pub(crate) fn same_size(given: [u32; 2], expected: [u32; 2]) -> Result<(), GpuError> {
    let sides = ["columns of its environment", "rows of its environment"];
    for (what, (given, expected)) in sides.into_iter().zip(given.into_iter().zip(expected)) {
        if given != expected {
            return Err(GpuError::SceneChanged {
                what,
                given: given.into(),
                expected: expected.into(),
            });
        }
    }
    Ok(())
}

/// Width and height; zero where there is no environment.
pub(crate) fn sky_size(sky: Option<&Environment>) -> [u32; 2] {
    sky.map_or([0; 2], Environment::size)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_come_before_texels() {
        let sky = Environment::new(2, 1, vec![[1.0, 2.0, 3.0], [3.0, 0.0, 0.0]]).unwrap();
        let entries: Vec<Triangle> = packed_sky(&sky).collect();
        let floats = |it: &Triangle| [it.a, it.b, it.c].map(f32::from_bits);
        assert_eq!(entries.len(), 3);
        let [top, bottom, solid_angle] = floats(&entries[0]);
        assert_eq!((top, bottom), (1.0, -1.0));
        assert!((solid_angle - 2.0 * std::f32::consts::PI).abs() < 1e-6);
        assert_eq!(floats(&entries[1]), [1.0, 2.0, 3.0]);
        assert_eq!(floats(&entries[2]), [3.0, 0.0, 0.0]);
        let half = Environment::PARTS / 2;
        let ends = [0, 1, 2].map(|it: usize| entries[it].body);
        assert_eq!(ends, [Environment::PARTS, half, Environment::PARTS]);
    }

    #[test]
    fn other_sizes_are_named() {
        assert_eq!(same_size([4, 2], [4, 2]), Ok(()));
        let error = |given| same_size(given, [4, 2]).unwrap_err().to_string();
        assert!(error([8, 1]).contains("8 columns"), "{}", error([8, 1]));
        assert!(error([4, 3]).contains("3 rows"), "{}", error([4, 3]));
    }
}
