//! Buffers of the sizes that a device allows.

use crate::GpuError;
use crate::renderer_error::RendererError;

/// A buffer with these contents: they travel with the buffer and not with the queue, so that a
/// later frame cannot overwrite them before they are read.
///
/// # Errors
/// If the device is lost: it gives no memory to write to.
pub(crate) fn filled_buffer(
    device: &wgpu::Device,
    label: &'static str,
    usage: wgpu::BufferUsages,
    bytes: &[u8],
) -> Result<wgpu::Buffer, RendererError> {
    let buffer = device.create_buffer(&wgpu::BufferDescriptor {
        label: Some(label),
        size: (bytes.len() as u64).next_multiple_of(wgpu::COPY_BUFFER_ALIGNMENT),
        usage,
        mapped_at_creation: true,
    });
    let Ok(mut memory) = buffer.slice(..).get_mapped_range_mut() else {
        return Err(RendererError::DeviceLost);
    };
    memory.slice(..bytes.len()).copy_from_slice(bytes);
    drop(memory);
    buffer.unmap();
    Ok(buffer)
}

/// A buffer of this size, for storage and copies.
pub(crate) fn storage_buffer(
    device: &wgpu::Device,
    label: &'static str,
    size: u64,
    usage: wgpu::BufferUsages,
) -> wgpu::Buffer {
    device.create_buffer(&wgpu::BufferDescriptor {
        label: Some(label),
        size: size.max(16).next_multiple_of(16),
        usage: usage | wgpu::BufferUsages::STORAGE,
        mapped_at_creation: false,
    })
}

/// Likewise, unless the device cannot bind it whole.
pub(crate) fn bound_buffer(
    device: &wgpu::Device,
    what: &'static str,
    size: u64,
    usage: wgpu::BufferUsages,
) -> Result<wgpu::Buffer, GpuError> {
    fits(device, what, size)?;
    Ok(storage_buffer(device, what, size, usage))
}

/// Refuses a storage buffer that the device cannot bind whole.
pub(crate) fn fits(device: &wgpu::Device, what: &'static str, bytes: u64) -> Result<(), GpuError> {
    let limit = largest_binding(&device.limits());
    if bytes > limit {
        return Err(GpuError::BufferTooLarge { what, bytes, limit });
    }
    Ok(())
}

/// Bytes of the largest storage buffer that can be bound whole.
pub(crate) fn largest_binding(limits: &wgpu::Limits) -> u64 {
    limits
        .max_storage_buffer_binding_size
        .min(limits.max_buffer_size)
}
