//! Footprints gathered at points of the scene: energy, gates, and agreement with the splat.

use caustics_accel::BvhOptions;
use caustics_geometry::shapes;
use caustics_render::{FootprintGather, FootprintKernel, FootprintOptions, GBuffer, splat};
use caustics_scene::{Camera, Instance, Material, Projection, Scene, Shape, World};
use caustics_trace::Photon;
use glam::{Affine3A, Mat3, Vec3};
use std::f32::consts::PI;

const FLUX: Vec3 = Vec3::new(3.0, 2.0, 1.0);

fn photon(position: Vec3, axes: [Vec3; 2]) -> Photon {
    Photon {
        position,
        incoming: Vec3::new(0.3, -1.0, 0.2).normalize(),
        flux: FLUX,
        normal: Vec3::Y,
        axes,
        object: 0,
        events: 1,
        source: caustics_trace::FootprintSource::Differential,
        coverage: caustics_trace::Coverage::Cell,
    }
}

fn gather(photons: &[Photon], kernel: FootprintKernel) -> FootprintGather {
    let options = FootprintOptions {
        kernel,
        ..FootprintOptions::default()
    };
    FootprintGather::new(photons, &options).expect("valid photons")
}

/// The flux on a horizontal square around `center`, by the midpoint rule in f64.
fn flux_on_square(center: Vec3, half: f32, irradiance: impl Fn(Vec3) -> Vec3) -> f64 {
    const STEPS: u32 = 600;
    let step = 2.0 * half / STEPS as f32;
    let mut sum = 0.0;
    for i in 0..STEPS * STEPS {
        let (column, row) = ((i % STEPS) as f32 + 0.5, (i / STEPS) as f32 + 0.5);
        let offset = Vec3::new(column * step - half, 0.0, row * step - half);
        sum += f64::from(irradiance(center + offset).x);
    }
    sum * f64::from(step).powi(2)
}

#[test]
fn a_floor_receives_the_flux_of_a_footprint_of_any_size_and_shape() {
    for kernel in FootprintKernel::ALL {
        for size in [1e-3, 0.1, 10.0] {
            for slenderness in [1.0, 40.0] {
                let long = size * Vec3::new(0.8, 0.0, 0.6);
                let short = size / slenderness * Vec3::new(-0.5, 0.0, 0.9);
                let center = Vec3::new(0.5, 0.25, -0.5);
                let gather = gather(&[photon(center, [long, short])], kernel);
                // All kernels end within three and a half standard deviations along their axes.
                let half = 3.5 * 0.55 * (long.length() + short.length());
                let flux = flux_on_square(center, half, |p| gather.irradiance(p, Vec3::Y));
                let error = flux / f64::from(FLUX.x) - 1.0;
                assert!(
                    error.abs() < 5e-3,
                    "{kernel:?} {size} {slenderness}: {error:e}"
                );
            }
        }
    }
}

#[test]
fn a_pixel_spreads_a_footprint_and_keeps_its_flux() {
    let pixel = [Vec3::new(0.2, 0.0, 0.05), Vec3::new(-0.1, 0.0, 0.3)];
    for kernel in FootprintKernel::ALL {
        for size in [0.0, 1e-3, 0.1, 1.0] {
            let axes = [size * Vec3::X, size * Vec3::new(0.3, 0.0, 0.2)];
            let gather = gather(&[photon(Vec3::ZERO, axes)], kernel);
            let over = |p| gather.irradiance_over(p, Vec3::Y, pixel);
            let half = 3.5 * (0.55 * size + 0.5);
            let flux = flux_on_square(Vec3::ZERO, half, over);
            let error = flux / f64::from(FLUX.x) - 1.0;
            assert!(error.abs() < 5e-3, "{kernel:?} {size}: {error:e}");
            if size < 0.01 {
                // The footprint alone does not reach as far as the pixel's.
                let aside = 0.4 * pixel[0];
                assert_eq!(gather.irradiance(aside, Vec3::Y), Vec3::ZERO);
                assert!(over(aside).min_element() > 0.0, "{kernel:?} {size}");
            }
        }
    }
}

/// Control: the quadrature tells a flux that is wrong by a hundredth.
#[test]
fn control_a_flux_that_is_a_hundredth_too_high_is_noticed() {
    let mut bright = photon(Vec3::ZERO, [Vec3::X, Vec3::Z]);
    bright.flux *= 1.01;
    let gather = gather(&[bright], FootprintKernel::Gaussian);
    let flux = flux_on_square(Vec3::ZERO, 4.0, |p| gather.irradiance(p, Vec3::Y));
    assert!((flux / f64::from(FLUX.x) - 1.0).abs() > 5e-3);
}

/// A floor of four by four metres, its photons, and a camera that looks straight down on it.
struct Floor {
    world: World,
    photons: Vec<Photon>,
    camera: Camera,
}

const PIXELS: u32 = 64;
const PIXEL: f32 = 2.0 / PIXELS as f32;
const ALBEDO: f32 = 0.5;

impl Floor {
    /// With photons whose neighbours are about `spacing` pixels away, more or less so from place
    /// to place, and sheared.
    fn new(spacing: f32) -> Self {
        let mut scene = Scene::new();
        let mesh = shapes::quad(Vec3::new(-2.0, 0.0, 2.0), 4.0 * Vec3::X, -4.0 * Vec3::Z);
        let mesh = scene.add_mesh(mesh.expect("a quad"));
        let material = scene.add_material(Material::diffuse("grey", Vec3::splat(ALBEDO)));
        let floor = Instance::new("floor", Shape::Mesh(mesh), material.expect("valid"));
        scene.add_instance(floor).expect("valid");
        let down = Mat3::from_cols(Vec3::X, Vec3::NEG_Z, Vec3::Y);
        let pose = Affine3A::from_mat3_translation(down, Vec3::new(0.0, 3.0, 0.0));
        let projection = Projection::Orthographic {
            xmag: 1.0,
            ymag: 1.0,
        };
        let side = (1.8 / (spacing * PIXEL)).ceil();
        let step = 1.8 / side;
        let photons = (0..(side * side) as u32)
            .map(|index| {
                let (i, j) = (index as f32 % side, (index as f32 / side).floor());
                let (x, z) = (step * (i + 0.5) - 0.9, step * (j + 0.5) - 0.9);
                // (x, z) -> (x + 0.1 sin 3 z, z + 0.1 sin 4 x), and its derivatives.
                let position = Vec3::new(x + 0.1 * (3.0 * z).sin(), 0.0, z + 0.1 * (4.0 * x).sin());
                let along_x = step * Vec3::new(1.0, 0.0, 0.4 * (4.0 * x).cos());
                let along_z = step * Vec3::new(0.3 * (3.0 * z).cos(), 0.0, 1.0);
                photon(position, [along_x, along_z])
            })
            .collect();
        Self {
            world: World::new(&scene).expect("valid"),
            photons,
            camera: Camera::new("above", pose, projection).expect("valid"),
        }
    }

    /// The largest difference between splat and gather in any pixel at least `border` pixels from
    /// the picture's border, relative to the brightest.
    fn difference(&self, kernel: FootprintKernel, gathered: &[Photon], border: u32) -> f32 {
        let options = FootprintOptions {
            kernel,
            ..FootprintOptions::default()
        };
        let intersector = self
            .world
            .intersector(&BvhOptions::default())
            .expect("valid");
        let buffer = GBuffer::new(&self.world, &intersector, &self.camera, PIXELS, PIXELS);
        let (image, _) = splat(&buffer.expect("valid"), &self.photons, &options).expect("valid");
        let gather = FootprintGather::new(gathered, &options).expect("valid");
        let edges = [PIXEL * Vec3::X, PIXEL * Vec3::Z];
        let (mut worst, mut brightest) = (0.0f32, 0.0f32);
        let inside = border..PIXELS - border;
        for (index, pixel) in image.pixels().iter().enumerate() {
            let (x, y) = (index as u32 % PIXELS, index as u32 / PIXELS);
            if !(inside.contains(&x) && inside.contains(&y)) {
                continue;
            }
            let at = |i: u32| (i as f32 + 0.5) * PIXEL - 1.0;
            let position = Vec3::new(at(x), 0.0, at(y));
            let irradiance = gather.irradiance_over(position, Vec3::Y, edges);
            let radiance = ALBEDO / PI * irradiance;
            worst = worst.max((radiance - Vec3::from(*pixel)).abs().max_element());
            brightest = brightest.max(radiance.max_element());
        }
        assert!(brightest > 0.0);
        worst / brightest
    }
}

/// All but the disc, whose edge falls on this side of a pixel's middle or that by rounding alone.
const CONTINUOUS: [FootprintKernel; 3] = [
    FootprintKernel::Gaussian,
    FootprintKernel::Ellipse,
    FootprintKernel::Tent,
];

#[test]
fn gather_and_splat_agree_within_a_hundredth_in_every_pixel() {
    for spacing in [2.5, 4.0, 6.0] {
        let floor = Floor::new(spacing);
        for kernel in CONTINUOUS {
            let difference = floor.difference(kernel, &floor.photons, 0);
            assert!(
                difference < 0.01,
                "{kernel:?}, {spacing} pixels: {difference}"
            );
        }
    }
}

#[test]
fn gather_and_splat_agree_where_the_splat_interpolates() {
    // Wide footprints are drawn coarsely, and interpolated up to the picture's border.
    let floor = Floor::new(20.0);
    let difference = floor.difference(FootprintKernel::Gaussian, &floor.photons, 0);
    assert!(difference < 0.02, "{difference}");
    // Control: a shift of a pixel.
    let mut moved = floor.photons.clone();
    for photon in &mut moved {
        photon.position.x += PIXEL;
    }
    assert!(floor.difference(FootprintKernel::Gaussian, &moved, 0) > 0.02);
}

#[test]
fn control_photons_that_moved_by_a_pixel_do_not_agree() {
    let floor = Floor::new(6.0);
    let mut moved = floor.photons.clone();
    for photon in &mut moved {
        photon.position.x += PIXEL;
    }
    assert!(floor.difference(FootprintKernel::Gaussian, &moved, 0) > 0.01);
    let mut dimmed = floor.photons.clone();
    dimmed.iter_mut().for_each(|photon| photon.flux *= 0.985);
    assert!(floor.difference(FootprintKernel::Gaussian, &dimmed, 0) > 0.01);
}

#[test]
fn light_stays_on_its_side_of_a_thin_wall() {
    let photons = [photon(Vec3::ZERO, [Vec3::X, Vec3::Z])];
    for kernel in FootprintKernel::ALL {
        let gather = gather(&photons, kernel);
        for place in [Vec3::ZERO, Vec3::new(0.3, 0.0, 0.2)] {
            // Control: the lit side is lit.
            assert!(gather.irradiance(place, Vec3::Y).min_element() > 0.0);
            for thickness in [0.0, 1e-4, 0.01, 0.1] {
                let behind = place - thickness * Vec3::Y;
                assert_eq!(gather.irradiance(behind, Vec3::NEG_Y), Vec3::ZERO);
            }
        }
    }
}

#[test]
fn light_does_not_fall_past_an_edge() {
    // A table's top at height 0, lit up to its edge at x = 0.
    let photons = [photon(
        Vec3::new(-0.1, 0.0, 0.0),
        [0.2 * Vec3::X, 0.2 * Vec3::Z],
    )];
    let gather = gather(&photons, FootprintKernel::Gaussian);
    assert!(gather.irradiance(Vec3::new(-0.01, 0.0, 0.0), Vec3::Y).x > 0.0);
    for depth in [0.001, 0.01, 0.1, 0.3] {
        // The table's sides below the top.
        let side = Vec3::new(0.0, -depth, 0.0);
        assert_eq!(gather.irradiance(side, Vec3::X), Vec3::ZERO);
        assert_eq!(gather.irradiance(side, Vec3::NEG_X), Vec3::ZERO);
    }
    // The floor below the table.
    for depth in [0.2, 0.5, 1.0] {
        let floor = Vec3::new(0.05, -depth, 0.0);
        assert_eq!(gather.irradiance(floor, Vec3::Y), Vec3::ZERO);
    }
}

#[test]
fn a_sphere_is_lit_by_its_own_slope() {
    // Parallel light of 1 W/m² straight down on a unit sphere: E is the normal's cosine.
    const SPACING: f32 = 0.05;
    let mut photons = Vec::new();
    for i in -16..=16 {
        for j in -16..=16 {
            let (x, z) = (i as f32 * SPACING, j as f32 * SPACING);
            let squared_height = 1.0 - x * x - z * z;
            if squared_height < 0.2 {
                continue;
            }
            let normal = Vec3::new(x, squared_height.sqrt(), z);
            // Down to the tangent plane.
            let slide = |d: Vec3| d - Vec3::Y * d.dot(normal) / normal.y;
            photons.push(Photon {
                position: normal,
                incoming: Vec3::NEG_Y,
                flux: Vec3::splat(SPACING * SPACING),
                normal,
                axes: [slide(SPACING * Vec3::X), slide(SPACING * Vec3::Z)],
                object: 0,
                events: 1,
                source: caustics_trace::FootprintSource::Differential,
                coverage: caustics_trace::Coverage::Cell,
            });
        }
    }
    let gather = gather(&photons, FootprintKernel::Gaussian);
    let worst = |radius: f32| {
        let mut worst = 0.0f32;
        for i in 0..400 {
            let (sine, cosine) = (2.4 * i as f32).sin_cos();
            let off = 0.6 * (i as f32 / 400.0).sqrt();
            let normal = Vec3::new(off * cosine, (1.0 - off * off).sqrt(), off * sine);
            let irradiance = gather.irradiance(radius * normal, normal).x;
            worst = worst.max((irradiance / normal.y - 1.0).abs());
        }
        worst
    };
    // The lattice's own ripple at a standard deviation of 0.55 spacings is 1 %.
    assert!(worst(1.0) < 0.02, "{}", worst(1.0));
    // Control: a smaller sphere inside, out of reach beyond the planes.
    assert!(worst(0.9) > 0.5);
}

#[test]
fn the_same_photons_give_the_same_bits() {
    let floor = Floor::new(1.0);
    let probe = |gather: &FootprintGather| -> Vec<Vec3> {
        (0..1000)
            .map(|i| {
                let place = Vec3::new((0.37 * i as f32).sin(), 0.0, (0.73 * i as f32).cos());
                gather.irradiance(place, Vec3::Y)
            })
            .collect()
    };
    let once = probe(&gather(&floor.photons, FootprintKernel::Gaussian));
    assert!(once.iter().any(|irradiance| *irradiance != Vec3::ZERO));
    for _ in 0..3 {
        assert_eq!(
            probe(&gather(&floor.photons, FootprintKernel::Gaussian)),
            once
        );
    }
}
