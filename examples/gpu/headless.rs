//! A device, with or without a window.

use caustics_wgpu::CausticsRenderer;

use crate::Failure;

/// Asks for a device as an engine does: what caustics require, and what they make use of where the
/// adapter has it.
///
/// # Errors
/// If there is no adapter, or it lacks the limits.
pub fn device(
    instance: &wgpu::Instance,
    surface: Option<&wgpu::Surface<'_>>,
) -> Result<(wgpu::Adapter, wgpu::Device, wgpu::Queue), Failure> {
    let options = wgpu::RequestAdapterOptions {
        compatible_surface: surface,
        ..wgpu::RequestAdapterOptions::default()
    };
    let adapter = pollster::block_on(instance.request_adapter(&options))?;
    let used = CausticsRenderer::used_features() & adapter.features();
    let (device, queue) = pollster::block_on(adapter.request_device(&wgpu::DeviceDescriptor {
        label: Some("engine"),
        required_features: CausticsRenderer::required_features() | used,
        required_limits: CausticsRenderer::required_limits(),
        ..wgpu::DeviceDescriptor::default()
    }))?;
    Ok((adapter, device, queue))
}
