//! The GPU's gather against the CPU's, for the same photons and points.

use crate::stage;

use caustics_gpu_readback::{read_buffer, uploaded_buffer};
use caustics_render::{FootprintGather, FootprintKernel, FootprintOptions};
use caustics_wgpu::glam::Vec3;
use caustics_wgpu::{
    FootprintBatch, Gather, GatherCounts, GatherOptions, GatherPoint, SplatKernel, wgpu,
};
use stage::{Stage, TestError, device_with, upload};

/// Another truncation, which light from an area ends at.
fn overlap_truncation(truncation: f32) -> f32 {
    5.0 - truncation
}

#[test]
fn points_are_lit_as_on_the_cpu() -> Result<(), TestError> {
    let Some((device, queue)) = device_with(wgpu::Features::empty()) else {
        return Ok(());
    };
    let kernels = SplatKernel::ALL.into_iter().zip(FootprintKernel::ALL);
    let (gaussian, its_twin) = (SplatKernel::Gaussian, FootprintKernel::Gaussian);
    let cases = ["p03_cognac", "p07_pool", "p09_cornell"]
        .map(|name| (name, gaussian, its_twin, 3.0))
        .into_iter()
        .chain(kernels.map(|(kernel, twin)| ("p01_sphere", kernel, twin, 3.0)))
        .chain([1.5, 4.0].map(|truncation| ("p01_sphere", gaussian, its_twin, truncation)))
        // An area light's, whose footprints have a truncation of their own.
        .chain([1.5, 3.0].map(|truncation| ("p09_cornell", gaussian, its_twin, truncation)));
    for (name, kernel, twin, truncation) in cases {
        let stage = Stage::load(name, 10_000)?;
        let options = FootprintOptions {
            kernel: twin,
            truncation,
            overlap_truncation: overlap_truncation(truncation),
            ..FootprintOptions::default()
        };
        let expected = FootprintGather::new(&stage.photons, &options)?;
        let options = GatherOptions {
            kernel,
            truncation,
            overlap_truncation: overlap_truncation(truncation),
            least_extent: expected.least_extent(),
            most_extent: 1e7 * expected.least_extent(),
            capacity: stage.photons.len() as u32,
            ..GatherOptions::default()
        };
        let gather = Gather::new(&device, &options)?;
        let (records, count) = upload(&device, &queue, &stage.photons);

        // What the camera sees, and beside where photons landed: the parts of a divided photon lie on
        // the edges of each other's discs, where rounding decides.
        let picture = stage.picture(&stage.camera, [100, 75]);
        let seen = picture.seen.iter().flatten();
        let points: Vec<GatherPoint> = seen
            .map(|it| (it.position, it.normal, it.object))
            .chain(
                stage
                    .photons
                    .iter()
                    .step_by(7)
                    .map(|it| (it.position + 0.1 * it.axes[0], it.normal, it.object)),
            )
            .enumerate()
            // The object of every other one is not known.
            .map(|(index, (position, normal, object))| GatherPoint {
                position: position.to_array(),
                normal: normal.to_array(),
                object_plus_one: if index % 2 == 0 { object + 1 } else { 0 },
                ..GatherPoint::default()
            })
            .collect();
        let points_buffer = uploaded_buffer(&device, &queue, bytemuck::cast_slice(&points), 16);
        let found = uploaded_buffer(&device, &queue, &vec![255; 16 * points.len()], 16);
        let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        let batch = FootprintBatch {
            records: &records,
            count: &count,
        };
        gather.build(&device, &mut encoder, &batch)?;
        gather.evaluate(&device, &mut encoder, &points_buffer, &found)?;
        queue.submit([encoder.finish()]);

        let counts = read_buffer(&device, &queue, gather.counts(), GatherCounts::BYTES)?;
        let counts = GatherCounts::from_bytes(&counts).ok_or("too short")?;
        assert_eq!(
            u64::from(counts.stored),
            expected.stats().stored,
            "{counts:?}"
        );
        assert_eq!(u64::from(counts.invalid), expected.stats().invalid);
        assert_eq!(counts.dropped_entries, 0);
        let found = read_buffer(&device, &queue, &found, found.size())?;
        let found: Vec<[f32; 4]> = bytemuck::pod_collect_to_vec(&found);
        let (mut off, mut sum, mut exact, mut lit) = (0.0f64, 0.0f64, 0, 0);
        for (point, found) in points.iter().zip(&found) {
            let (position, normal) = (point.position.into(), point.normal.into());
            let expected = match point.object_plus_one.checked_sub(1) {
                Some(object) => expected.irradiance_on(object, position, normal),
                None => expected.irradiance(position, normal),
            };
            let difference = (Vec3::new(found[0], found[1], found[2]) - expected).abs();
            off += f64::from(difference.element_sum());
            sum += f64::from(expected.element_sum());
            lit += u32::from(expected != Vec3::ZERO);
            exact += u32::from(
                expected != Vec3::ZERO && difference.element_sum() < 1e-3 * expected.element_sum(),
            );
        }
        println!(
            "{name} {kernel:?} {truncation}: off by {:.2e}, {exact} of {lit} to a thousandth, {counts:?}",
            off / sum
        );
        // A disc is constant up to its edge: rounding decides which side a point on it is, and one
        // disc in a focus may be as bright as a percent of all points together.
        if kernel == SplatKernel::Disc {
            assert!(
                f64::from(exact) > 0.998 * f64::from(lit),
                "{exact} of {lit}"
            );
            continue;
        }
        assert!(
            off < 1e-3 * sum,
            "{name} {kernel:?} {truncation}: {off} of {sum}"
        );
        assert!(f64::from(exact) > 0.99 * f64::from(lit), "{exact} of {lit}");
    }
    Ok(())
}
