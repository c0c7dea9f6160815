//! A device to measure on, and work for it.

use caustics_gpu_readback::{read_buffer, uploaded_buffer};
use caustics_wgpu::{CausticsRenderer, FootprintRecord};

use crate::stage::Failure;

/// A device with all that a renderer makes use of, of the adapter that wgpu prefers: a GPU where
/// there is one, else a software adapter.
#[derive(Debug)]
pub struct Gpu {
    /// The adapter's name, and whether it is a GPU.
    pub name: String,
    /// The device.
    pub device: wgpu::Device,
    /// Its queue.
    pub queue: wgpu::Queue,
}

impl Gpu {
    /// Opens a device.
    ///
    /// # Errors
    /// If there is none, or it lacks what a renderer requires.
    pub fn new() -> Result<Self, Failure> {
        let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle());
        let options = wgpu::RequestAdapterOptions {
            power_preference: wgpu::PowerPreference::HighPerformance,
            ..wgpu::RequestAdapterOptions::default()
        };
        let adapter = pollster::block_on(instance.request_adapter(&options))?;
        let descriptor = wgpu::DeviceDescriptor {
            required_features: CausticsRenderer::used_features() & adapter.features(),
            required_limits: CausticsRenderer::required_limits(),
            ..wgpu::DeviceDescriptor::default()
        };
        let (device, queue) = pollster::block_on(adapter.request_device(&descriptor))?;
        let info = adapter.get_info();
        let kind = if info.device_type == wgpu::DeviceType::Cpu {
            "a software adapter"
        } else {
            "a GPU"
        };
        Ok(Self {
            name: format!("{}, {kind}", info.name),
            device,
            queue,
        })
    }

    /// Runs what is recorded, and waits until the GPU has done it.
    ///
    /// # Errors
    /// Those of the recording, and a device that is lost.
    pub fn run<T>(
        &self,
        record: impl FnOnce(&mut wgpu::CommandEncoder) -> Result<T, Failure>,
    ) -> Result<T, Failure> {
        let descriptor = wgpu::CommandEncoderDescriptor::default();
        let mut encoder = self.device.create_command_encoder(&descriptor);
        let value = record(&mut encoder)?;
        self.queue.submit([encoder.finish()]);
        self.device.poll(wgpu::PollType::wait_indefinitely())?;
        Ok(value)
    }

    /// The first `bytes` of a buffer.
    ///
    /// # Errors
    /// If the device is lost.
    pub fn read(&self, source: &wgpu::Buffer, bytes: u64) -> Result<Vec<u8>, Failure> {
        read_buffer(&self.device, &self.queue, source, bytes)
    }

    /// A storage buffer of these bytes, of room for a footprint at least.
    #[must_use]
    pub fn upload(&self, bytes: &[u8]) -> wgpu::Buffer {
        let least = size_of::<FootprintRecord>() as u64;
        uploaded_buffer(&self.device, &self.queue, bytes, least)
    }
}
