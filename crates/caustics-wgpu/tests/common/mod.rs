//! What the tests of this crate share.
#![allow(dead_code, reason = "each test file takes what it needs")]

use caustics_wgpu::wgpu;

/// A device of an adapter of this machine, with no more than WebGPU's default limits.
///
/// Where there is no adapter the test is skipped, by printing so and returning `None`; where `CI`
/// is set in the environment, that is a failure.
///
/// # Panics
/// Without an adapter where `CI` is set.
pub fn test_device() -> Option<(wgpu::Device, wgpu::Queue)> {
    let device = pollster::block_on(device());
    if let Err(error) = &device {
        assert!(std::env::var_os("CI").is_none(), "no GPU adapter: {error}");
        println!("skipped: no GPU adapter: {error}");
    }
    device.ok()
}

async fn device() -> Result<(wgpu::Device, wgpu::Queue), Box<dyn std::error::Error>> {
    let instance = wgpu::Instance::new(wgpu::InstanceDescriptor {
        backends: wgpu::Backends::VULKAN,
        ..wgpu::InstanceDescriptor::new_without_display_handle()
    });
    let adapter = instance
        .request_adapter(&wgpu::RequestAdapterOptions::default())
        .await?;
    let descriptor = wgpu::DeviceDescriptor {
        label: Some("test"),
        required_limits: wgpu::Limits::default(),
        ..wgpu::DeviceDescriptor::default()
    };
    Ok(adapter.request_device(&descriptor).await?)
}
