//! What the tests of this crate share.
#![allow(
    clippy::unwrap_used,
    reason = "a test that cannot be set up has failed"
)]

pub(crate) mod scenes;
pub(crate) mod tracing;

use std::sync::OnceLock;

use caustics_gpu_readback::read_buffer;
use caustics_wgpu::wgpu;

/// A device of an adapter of this machine, with no more than WebGPU's default limits.
///
/// Where there is no adapter the test is skipped, by printing so and returning `None`; where `CI`
/// is set in the environment, that is a failure.
///
/// # Panics
/// Without an adapter where `CI` is set.
pub(crate) fn test_device() -> Option<(wgpu::Device, wgpu::Queue)> {
    limited_device(wgpu::Limits::default())
}

/// As [`test_device`], with other limits.
///
/// # Panics
/// Without an adapter where `CI` is set.
pub(crate) fn limited_device(limits: wgpu::Limits) -> Option<(wgpu::Device, wgpu::Queue)> {
    let device = pollster::block_on(device(limits));
    if let Err(error) = &device {
        assert!(std::env::var_os("CI").is_none(), "no GPU adapter: {error}");
        println!("skipped: no GPU adapter: {error}");
    }
    device.ok()
}

/// The device that the tests of one file share, as [`test_device`] gives it: the shaders of the
/// software adapter take seconds to compile.
///
/// # Panics
/// Without an adapter where `CI` is set.
pub(crate) fn shared_device() -> Option<&'static (wgpu::Device, wgpu::Queue)> {
    static DEVICE: OnceLock<Option<(wgpu::Device, wgpu::Queue)>> = OnceLock::new();
    DEVICE.get_or_init(test_device).as_ref()
}

async fn device(
    limits: wgpu::Limits,
) -> Result<(wgpu::Device, wgpu::Queue), Box<dyn std::error::Error>> {
    let instance = wgpu::Instance::new(wgpu::InstanceDescriptor {
        backends: wgpu::Backends::VULKAN,
        ..wgpu::InstanceDescriptor::new_without_display_handle()
    });
    let adapter = instance
        .request_adapter(&wgpu::RequestAdapterOptions::default())
        .await?;
    let descriptor = wgpu::DeviceDescriptor {
        label: Some("test"),
        required_limits: limits,
        ..wgpu::DeviceDescriptor::default()
    };
    Ok(adapter.request_device(&descriptor).await?)
}

/// The words of a buffer that may be copied from.
pub(crate) fn words(device: &wgpu::Device, queue: &wgpu::Queue, buffer: &wgpu::Buffer) -> Vec<u32> {
    let bytes = read_buffer(device, queue, buffer, buffer.size()).unwrap();
    bytemuck::pod_collect_to_vec(&bytes)
}
