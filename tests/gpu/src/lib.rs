//! Copies to and from a GPU that tests, examples and benchmarks wait for.
//!
//! A game would not wait. `caustics-wgpu` itself neither submits nor polls, so this is its hosts'.

use wgpu::{Buffer, Device, Queue, Texture};

/// Why nothing was read: the device is lost, or the buffer cannot be mapped.
pub type Failure = Box<dyn std::error::Error + Send + Sync>;

/// A storage buffer of these bytes, of `least` at least, that can be copied from.
#[must_use]
pub fn uploaded_buffer(device: &Device, queue: &Queue, bytes: &[u8], least: u64) -> Buffer {
    let buffer = device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("uploaded"),
        size: least.max(bytes.len() as u64),
        usage: wgpu::BufferUsages::STORAGE
            | wgpu::BufferUsages::COPY_DST
            | wgpu::BufferUsages::COPY_SRC,
        mapped_at_creation: false,
    });
    queue.write_buffer(&buffer, 0, bytes);
    buffer
}

/// A texture of these texels, row by row from the top.
#[must_use]
pub fn uploaded_texture(
    device: &Device,
    queue: &Queue,
    [width, height]: [u32; 2],
    format: wgpu::TextureFormat,
    bytes: &[u8],
) -> wgpu::TextureView {
    let size = wgpu::Extent3d {
        width,
        height,
        depth_or_array_layers: 1,
    };
    let texture = device.create_texture(&wgpu::TextureDescriptor {
        label: Some("uploaded"),
        size,
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
        view_formats: &[],
    });
    let layout = wgpu::TexelCopyBufferLayout {
        offset: 0,
        bytes_per_row: Some(bytes.len() as u32 / height.max(1)),
        rows_per_image: None,
    };
    queue.write_texture(texture.as_image_copy(), bytes, layout, size);
    texture.create_view(&wgpu::TextureViewDescriptor::default())
}

/// A buffer to copy to and to [`read`].
#[must_use]
pub fn reading_buffer(device: &Device, bytes: u64) -> Buffer {
    device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("reading"),
        size: bytes,
        usage: wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
        mapped_at_creation: false,
    })
}

/// The bytes of a [`reading_buffer`], once all that was submitted is done.
///
/// # Errors
/// If the device is lost.
pub fn read(device: &Device, buffer: &Buffer) -> Result<Vec<u8>, Failure> {
    let (sender, receiver) = std::sync::mpsc::channel();
    buffer.map_async(wgpu::MapMode::Read, .., move |result| {
        // Nobody waits any more: nothing to tell.
        let _ = sender.send(result);
    });
    device.poll(wgpu::PollType::wait_indefinitely())?;
    receiver.recv()??;
    let bytes = buffer.get_mapped_range(..)?.to_vec();
    buffer.unmap();
    Ok(bytes)
}

/// The first `bytes` of a buffer that may be copied from.
///
/// # Errors
/// If the device is lost.
pub fn read_buffer(
    device: &Device,
    queue: &Queue,
    source: &Buffer,
    bytes: u64,
) -> Result<Vec<u8>, Failure> {
    let target = reading_buffer(device, bytes);
    let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
    encoder.copy_buffer_to_buffer(source, 0, &target, 0, bytes);
    queue.submit([encoder.finish()]);
    read(device, &target)
}

/// The texels of a texture, `texel_bytes` each, row by row from the top.
///
/// # Errors
/// If the device is lost.
pub fn read_texture(
    device: &Device,
    queue: &Queue,
    texture: &Texture,
    texel_bytes: u32,
) -> Result<Vec<u8>, Failure> {
    let row = texture.width() * texel_bytes;
    let padded = row.next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
    let target = reading_buffer(device, u64::from(padded * texture.height()));
    let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
    let layout = wgpu::TexelCopyBufferLayout {
        offset: 0,
        bytes_per_row: Some(padded),
        rows_per_image: None,
    };
    let into = wgpu::TexelCopyBufferInfo {
        buffer: &target,
        layout,
    };
    encoder.copy_texture_to_buffer(texture.as_image_copy(), into, texture.size());
    queue.submit([encoder.finish()]);
    let bytes = read(device, &target)?;
    let rows = bytes.chunks_exact(padded as usize);
    Ok(rows.flat_map(|it| &it[..row as usize]).copied().collect())
}
