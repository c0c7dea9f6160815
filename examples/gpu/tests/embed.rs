//! The engine's picture has the caustics of the CPU's.

use caustics::accel::Intersect;
use caustics::prelude::*;
use caustics::scene::{BvhOptions, builtin};
use caustics_gpu_examples::Failure;
use caustics_gpu_examples::engine::Look;
use caustics_gpu_examples::picture::{Snapshot, main_light};
use caustics_wgpu::SplatOptions;

const SIZE: [u32; 2] = [320, 240];

/// What the CPU says: radiance of the caustics, and the albedo where a receiver is seen directly.
struct Expected {
    caustics: Vec<[f32; 3]>,
    albedo: Vec<Option<[f32; 3]>>,
}

impl Expected {
    fn new(scene: &Scene, trace: TraceOptions) -> Result<Self, Failure> {
        let [width, height] = SIZE;
        let options = CausticsOptions {
            trace,
            ..CausticsOptions::default()
        };
        let size = PictureOptions {
            width,
            height,
            samples: 1,
            visibility: Visibility::Direct,
            ..PictureOptions::default()
        };
        let camera = &scene.cameras()[0];
        let picture = Caustics::new(scene, &options)?.render(camera, &size)?;
        let world = World::new(scene)?;
        let rays = world.intersector(&BvhOptions::default())?;
        let albedo = (0..width * height)
            .map(|pixel| {
                let (x, y) = ((pixel % width) as f32 + 0.5, (pixel / width) as f32 + 0.5);
                let ray = camera.ray(x, y, width, height);
                let point = world.surface(&ray, &rays.closest_hit(&ray)?)?;
                match world.materials()[point.material as usize].surface {
                    Surface::Diffuse { albedo } => Some(albedo.to_array()),
                    _ => None,
                }
            })
            .collect();
        Ok(Self {
            caustics: picture.caustics.into_pixels(),
            albedo,
        })
    }

    /// The sum of the differences over the sum of what is expected, where both sides see a receiver
    /// and nothing before it.
    fn difference(&self, irradiance: &[[f32; 4]]) -> f64 {
        let (mut off, mut sum) = (0.0, 0.0);
        for ((expected, albedo), found) in self.caustics.iter().zip(&self.albedo).zip(irradiance) {
            let Some(albedo) = albedo else { continue };
            for channel in 0..3 {
                let found = albedo[channel] * found[channel] / std::f32::consts::PI;
                off += f64::from((found - expected[channel]).abs());
                sum += f64::from(expected[channel]);
            }
        }
        off / sum
    }
}

#[test]
fn the_engine_shows_the_caustics_of_the_cpu() -> Result<(), Failure> {
    let scene = builtin::cognac_glass();
    let trace = TraceOptions {
        photons: 30_000,
        ..TraceOptions::default()
    };
    let look = Look {
        camera: scene.cameras()[0].clone(),
        light: main_light(&scene).ok_or("no light")?,
        exposure_ev: 0.0,
    };
    let snapshot = Snapshot::take(scene.clone(), &look, SIZE, trace, SplatOptions::default());
    let snapshot = match snapshot {
        Ok(snapshot) => snapshot,
        Err(error) if error.is::<wgpu::RequestAdapterError>() => {
            assert!(std::env::var_os("CI").is_none(), "no GPU adapter: {error}");
            println!("skipped: no GPU adapter: {error}");
            return Ok(());
        }
        Err(error) => return Err(error),
    };
    let expected = Expected::new(&scene, trace)?;
    let off = expected.difference(&snapshot.irradiance);
    println!("off by {off:.2e}");
    assert!(off < 0.01, "{off}");
    // The comparison can fail: neither a darker picture nor one that is moved by a pixel passes.
    let mut broken = snapshot.irradiance.clone();
    for pixel in &mut broken {
        *pixel = pixel.map(|it| 0.95 * it);
    }
    assert!(expected.difference(&broken) > 0.03);
    let mut moved = snapshot.irradiance.clone();
    moved.rotate_left(1);
    assert!(expected.difference(&moved) > 0.03);
    // The picture that is shown has them, too: it is brightest where they are.
    let brightest = |of: &mut dyn Iterator<Item = f32>| {
        of.enumerate()
            .max_by(|a, b| a.1.total_cmp(&b.1))
            .map_or(0, |it| it.0)
    };
    let lit = brightest(&mut snapshot.irradiance.iter().map(|it| it[0]));
    assert!(
        snapshot.pixels[4 * lit] > 250,
        "{:?}",
        &snapshot.pixels[4 * lit..][..4]
    );
    assert_eq!(snapshot.stats.dropped_pairs, 0);
    Ok(())
}
