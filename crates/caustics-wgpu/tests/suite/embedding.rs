//! The renderer inside a host's frame: a device with no more than is required, several views and
//! frames in one encoder, other sizes, and devices that are gone.

use crate::stage;

use caustics_gpu_readback::{read_texture, uploaded_texture};
use caustics_wgpu::glam::Mat4;
use caustics_wgpu::{
    CausticsRenderer, CompositeTarget, FootprintBatch, FrameLight, FrameParams, RendererError,
    RendererOptions, SplatMethod, SplatOptions, SurfaceInput, ViewParams, camera_matrix, wgpu,
};
use stage::{Picture, Stage, TestError, device_with, upload};

const TARGET: CompositeTarget = CompositeTarget::new(wgpu::TextureFormat::Rgba16Float);

fn options(method: SplatMethod) -> RendererOptions {
    RendererOptions {
        splat: SplatOptions {
            method,
            ..SplatOptions::default()
        },
        targets: vec![TARGET],
        ..RendererOptions::default()
    }
}

/// A target of the host's.
fn host_target(device: &wgpu::Device, [width, height]: [u32; 2]) -> wgpu::Texture {
    device.create_texture(&wgpu::TextureDescriptor {
        label: Some("host target"),
        size: wgpu::Extent3d {
            width,
            height,
            depth_or_array_layers: 1,
        },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: TARGET.format,
        usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC,
        view_formats: &[],
    })
}

/// A pass of the host's that clears to a grey of a quarter.
fn host_pass<'a>(
    encoder: &'a mut wgpu::CommandEncoder,
    target: &wgpu::TextureView,
) -> wgpu::RenderPass<'a> {
    let grey = wgpu::Color {
        r: 0.25,
        g: 0.25,
        b: 0.25,
        a: 1.0,
    };
    encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
        color_attachments: &[Some(wgpu::RenderPassColorAttachment {
            view: target,
            depth_slice: None,
            resolve_target: None,
            ops: wgpu::Operations {
                load: wgpu::LoadOp::Clear(grey),
                store: wgpu::StoreOp::Store,
            },
        })],
        ..wgpu::RenderPassDescriptor::default()
    })
}

/// A half float as a number; only those that are not negative.
fn from_half(bits: u16) -> f32 {
    let (exponent, fraction) = (i32::from(bits >> 10), f32::from(bits & 0x3ff));
    match exponent {
        0 => fraction * 2.0f32.powi(-24),
        _ => (1.0 + fraction / 1024.0) * 2.0f32.powi(exponent - 15),
    }
}

/// The red channel of what the host sees.
fn read_red(
    device: &wgpu::Device,
    queue: &wgpu::Queue,
    target: &wgpu::Texture,
) -> Result<Vec<f32>, TestError> {
    let bytes = read_texture(device, queue, target, 8)?;
    let texels: Vec<[u16; 4]> = bytemuck::pod_collect_to_vec(&bytes);
    Ok(texels.iter().map(|texel| from_half(texel[0])).collect())
}

/// Two cameras of one stage.
fn pictures(stage: &Stage) -> Result<[Picture; 2], TestError> {
    let mut other = stage.camera.clone();
    other.transform.translation += 0.05 * other.transform.matrix3.x_axis;
    Ok([
        stage.picture(&stage.camera, [96, 72]),
        stage.picture(&other, [70, 50]),
    ])
}

#[test]
fn three_frames_of_two_views_fit_in_one_encoder() -> Result<(), TestError> {
    let stage = Stage::load("p03_cognac", 6_000)?;
    let pictures = pictures(&stage)?;
    let Some((device, queue)) = device_with(wgpu::Features::empty()) else {
        return Ok(());
    };
    for method in [SplatMethod::Tiles, SplatMethod::Quads] {
        let mut renderer = CausticsRenderer::new(&device, &options(method))?;
        let textures = pictures.each_ref().map(|it| it.textures(&device, &queue));
        let (records, count) = upload(&device, &queue, &stage.photons);
        // Light of a frame whose photons are fewer, so that frames differ.
        let (few, few_count) = upload(&device, &queue, &stage.photons[..1000]);
        let all = [FootprintBatch {
            records: &records,
            count: &count,
        }];
        let some = [FootprintBatch {
            records: &few,
            count: &few_count,
        }];
        let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        let mut targets = Vec::new();
        for batches in [&all, &some, &all] {
            let views = [0, 1].map(|view| pictures[view].view(&textures[view]));
            let frame = FrameParams {
                light: FrameLight::Footprints(batches),
                views: &views,
            };
            let prepared = renderer.prepare(&device, &queue, &mut encoder, &frame)?;
            for (view, picture) in pictures.iter().enumerate() {
                let target = host_target(&device, picture.size);
                let into = target.create_view(&wgpu::TextureViewDescriptor::default());
                let mut pass = host_pass(&mut encoder, &into);
                renderer.draw(&mut pass, &prepared, view, &TARGET)?;
                let error = renderer.draw(&mut pass, &prepared, 2, &TARGET);
                assert_eq!(error, Err(RendererError::NoSuchView { view: 2, views: 2 }));
                let other = CompositeTarget::new(wgpu::TextureFormat::Rgba8Unorm);
                let error = renderer.draw(&mut pass, &prepared, 0, &other);
                assert!(matches!(error, Err(RendererError::UnknownTarget { .. })));
                drop(pass);
                targets.push(target);
            }
        }
        queue.submit([encoder.finish()]);
        let seen: Vec<Vec<f32>> = targets
            .iter()
            .map(|target| read_red(&device, &queue, target))
            .collect::<Result<_, _>>()?;
        let light = |pixels: &[f32]| pixels.iter().map(|it| it - 0.25).sum::<f32>();
        for view in [0, 1] {
            let [first, second, third] = [0, 2, 4].map(|frame| &seen[frame + view]);
            // Nothing is darker than what the host drew, and the light is added to it.
            assert!(first.iter().all(|&it| it >= 0.25));
            assert!(light(first) > 1.0, "{}", light(first));
            // The second frame is of other light, the third is the first again.
            assert!(light(second) < 0.5 * light(first));
            if method == SplatMethod::Tiles {
                assert!(first == third);
            }
            // As alone in an encoder.
            let alone = stage::irradiance(
                &device,
                &queue,
                &options(method),
                &pictures[view],
                &[&stage.photons],
            )?;
            let expected: f32 = alone.0.iter().map(|it| it[0]).sum::<f32>() / std::f32::consts::PI;
            assert!(
                (light(first) / expected - 1.0).abs() < 0.01,
                "{} {expected}",
                light(first)
            );
        }
    }
    Ok(())
}

#[test]
fn views_can_change_their_size_and_number() -> Result<(), TestError> {
    let stage = Stage::load("p01_sphere", 4_000)?;
    let Some((device, queue)) = device_with(wgpu::Features::empty()) else {
        return Ok(());
    };
    let mut renderer = CausticsRenderer::new(&device, &options(SplatMethod::Tiles))?;
    let (records, count) = upload(&device, &queue, &stage.photons);
    let batches = [FootprintBatch {
        records: &records,
        count: &count,
    }];
    for sizes in [
        &[[64, 48]][..],
        &[[130, 97], [64, 48]],
        &[[1, 1], [17, 300]],
        &[[64, 48]],
    ] {
        let pictures: Vec<_> = sizes
            .iter()
            .map(|&size| stage.picture(&stage.camera, size))
            .collect();
        let textures: Vec<_> = pictures
            .iter()
            .map(|it| it.textures(&device, &queue))
            .collect();
        let views: Vec<_> = pictures
            .iter()
            .zip(&textures)
            .map(|(picture, textures)| picture.view(textures))
            .collect();
        let frame = FrameParams {
            light: FrameLight::Footprints(&batches),
            views: &views,
        };
        let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        let prepared = renderer.prepare(&device, &queue, &mut encoder, &frame)?;
        queue.submit([encoder.finish()]);
        for (view, picture) in pictures.iter().enumerate() {
            let texture = prepared.irradiance(view)?.texture();
            assert_eq!([texture.width(), texture.height()], picture.size);
            let found = read_texture(&device, &queue, texture, 16)?;
            let found: Vec<[f32; 4]> = bytemuck::pod_collect_to_vec(&found);
            let (alone, _) = stage::irradiance(
                &device,
                &queue,
                &options(SplatMethod::Tiles),
                picture,
                &[&stage.photons],
            )?;
            assert!(found == alone, "{:?}", picture.size);
        }
    }
    let textures = stage
        .picture(&stage.camera, [8, 8])
        .textures(&device, &queue);
    let surface = SurfaceInput::Position(&textures.positions);
    for (size, matrix) in [
        ([0, 8], Mat4::IDENTITY),
        ([8, 9000], Mat4::IDENTITY),
        ([8, 8], Mat4::ZERO),
        ([8, 8], f32::NAN * Mat4::IDENTITY),
    ] {
        let view = ViewParams::new(size, matrix.to_cols_array_2d(), surface, &textures.normals);
        let frame = FrameParams {
            light: FrameLight::Footprints(&batches),
            views: &[view],
        };
        let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        let error = renderer.prepare(&device, &queue, &mut encoder, &frame);
        assert!(
            matches!(
                error,
                Err(RendererError::ViewSize { .. } | RendererError::SingularProjection { view: 0 })
            ),
            "{error:?}"
        );
    }
    Ok(())
}

#[test]
fn depth_serves_as_well_as_positions() -> Result<(), TestError> {
    let stage = Stage::load("p01_sphere", 10_000)?;
    let picture = stage.picture(&stage.camera, [160, 120]);
    let Some((device, queue)) = device_with(wgpu::Features::empty()) else {
        return Ok(());
    };
    let textures = picture.textures(&device, &queue);
    let (records, count) = upload(&device, &queue, &stage.photons);
    let batches = [FootprintBatch {
        records: &records,
        count: &count,
    }];
    let (near, far) = (0.1, 20.0);
    let [forward, reversed] =
        [(near, far, 1.0), (far, near, 0.0)].map(|(near, far, background)| {
            let matrix = camera_matrix(&picture.camera, picture.size, near, far);
            let projection = Mat4::from_cols_array_2d(&matrix);
            let depths: Vec<f32> = picture
                .seen
                .iter()
                .map(|seen| seen.map_or(background, |it| projection.project_point3(it.position).z))
                .collect();
            let bytes = bytemuck::cast_slice(&depths);
            let format = wgpu::TextureFormat::R32Float;
            let depth = uploaded_texture(&device, &queue, picture.size, format, bytes);
            (matrix, depth, background)
        });
    let draw = |view: ViewParams<'_>| -> Result<Vec<[f32; 4]>, TestError> {
        let mut renderer = CausticsRenderer::new(&device, &options(SplatMethod::Tiles))?;
        let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        let frame = FrameParams {
            light: FrameLight::Footprints(&batches),
            views: &[view],
        };
        let prepared = renderer.prepare(&device, &queue, &mut encoder, &frame)?;
        queue.submit([encoder.finish()]);
        let texture = prepared.irradiance(0)?.texture();
        Ok(bytemuck::pod_collect_to_vec(&read_texture(
            &device, &queue, texture, 16,
        )?))
    };
    let expected = draw(picture.view(&textures))?;
    let sum: f32 = expected.iter().map(|it| it[0]).sum();
    assert!(sum > 0.0);
    for (matrix, depth, background_depth) in [&forward, &reversed] {
        let found = draw(ViewParams {
            view_projection: *matrix,
            surface: SurfaceInput::Depth(depth),
            background_depth: *background_depth,
            ..picture.view(&textures)
        })?;
        let off: f32 = expected
            .iter()
            .zip(&found)
            .map(|(a, b)| (a[0] - b[0]).abs())
            .sum();
        assert!(off < 2e-3 * sum, "{off} of {sum}");
    }
    Ok(())
}

#[test]
fn a_destroyed_device_gives_an_error_and_a_new_one_serves() -> Result<(), TestError> {
    let stage = Stage::load("p01_sphere", 1_000)?;
    let picture = stage.picture(&stage.camera, [32, 24]);
    for is_lost in [true, false] {
        let Some((device, queue)) = device_with(wgpu::Features::empty()) else {
            return Ok(());
        };
        let mut renderer = CausticsRenderer::new(&device, &options(SplatMethod::Tiles))?;
        let textures = picture.textures(&device, &queue);
        let (records, count) = upload(&device, &queue, &stage.photons);
        let batches = [FootprintBatch {
            records: &records,
            count: &count,
        }];
        let frame = FrameParams {
            light: FrameLight::Footprints(&batches),
            views: &[picture.view(&textures)],
        };
        if is_lost {
            device.destroy();
        }
        let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        let prepared = renderer.prepare(&device, &queue, &mut encoder, &frame);
        if is_lost {
            assert!(
                matches!(prepared, Err(RendererError::DeviceLost)),
                "{prepared:?}"
            );
            let renderer = CausticsRenderer::new(&device, &options(SplatMethod::Tiles));
            assert!(
                matches!(renderer, Err(RendererError::DeviceLost)),
                "{renderer:?}"
            );
        } else {
            assert!(prepared.is_ok(), "{prepared:?}");
            queue.submit([encoder.finish()]);
        }
    }
    Ok(())
}

#[test]
fn what_a_host_gives_wrongly_is_an_error() -> Result<(), TestError> {
    let stage = Stage::load("p01_sphere", 1_000)?;
    let picture = stage.picture(&stage.camera, [32, 24]);
    let Some((device, queue)) = device_with(wgpu::Features::empty()) else {
        return Ok(());
    };
    let integers = CompositeTarget::new(wgpu::TextureFormat::R32Uint);
    let error = CausticsRenderer::new(
        &device,
        &RendererOptions {
            targets: vec![integers],
            ..RendererOptions::default()
        },
    );
    assert!(matches!(error, Err(RendererError::UnknownTarget { .. })));
    let mut renderer = CausticsRenderer::new(&device, &options(SplatMethod::Tiles))?;
    let textures = picture.textures(&device, &queue);
    let (records, count) = upload(&device, &queue, &stage.photons);
    let batches = [FootprintBatch {
        records: &records,
        count: &count,
    }];
    // Normals that are integers.
    let view = ViewParams {
        normals: &textures.objects,
        ..picture.view(&textures)
    };
    let frame = FrameParams {
        light: FrameLight::Footprints(&batches),
        views: &[view],
    };
    let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
    let error = renderer.prepare(&device, &queue, &mut encoder, &frame);
    assert!(
        matches!(error, Err(RendererError::Device { .. })),
        "{error:?}"
    );
    Ok(())
}
