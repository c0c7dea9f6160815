use crate::renderer_error::{MissingLimit, RendererError};
use crate::splat_options::SplatMethod;

/// What a renderer chose by what its device can do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Capabilities {
    /// How footprints become pixels.
    pub splat_method: SplatMethod,
    /// The format in which irradiance is summed.
    pub sum_format: wgpu::TextureFormat,
    /// Layers among which footprints are shared where they are blended in half floats; else 1.
    pub sum_layers: u32,
    /// Whether passes can be timed.
    pub has_timestamps: bool,
    /// Footprints that one batch can hold within the device's limits.
    pub footprints_per_batch: u32,
}

/// What a device must be able to do beyond `wgpu::Limits`: nothing.
pub(crate) const REQUIRED_FEATURES: wgpu::Features = wgpu::Features::empty();

/// What a renderer makes use of where it is offered.
pub(crate) const USED_FEATURES: wgpu::Features =
    wgpu::Features::FLOAT32_BLENDABLE.union(wgpu::Features::TIMESTAMP_QUERY);

/// Asks a device for all that is required.
pub(crate) fn check(device: &wgpu::Device) -> Result<(), RendererError> {
    let features: Vec<String> = (REQUIRED_FEATURES - device.features())
        .iter_names()
        .map(|(name, _)| name.to_owned())
        .collect();
    let limits = missing_limits(&wgpu::Limits::default(), &device.limits());
    if features.is_empty() && limits.is_empty() {
        Ok(())
    } else {
        Err(RendererError::Missing { features, limits })
    }
}

fn missing_limits(required: &wgpu::Limits, offered: &wgpu::Limits) -> Vec<MissingLimit> {
    let mut missing = Vec::new();
    required.check_limits_with_fail_fn(offered, false, |name, required, offered| {
        missing.push(MissingLimit {
            name,
            required,
            offered,
        });
    });
    missing
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_limit_that_is_too_low_is_listed() {
        let required = wgpu::Limits::default();
        assert_eq!(missing_limits(&required, &required), []);
        let offered = wgpu::Limits {
            max_storage_buffers_per_shader_stage: 4,
            max_compute_workgroup_storage_size: 8192,
            ..required.clone()
        };
        let mut names: Vec<_> = missing_limits(&required, &offered)
            .iter()
            .map(|it| (it.name, it.offered))
            .collect();
        names.sort_unstable();
        assert_eq!(
            names,
            [
                ("max_compute_workgroup_storage_size", 8192),
                ("max_storage_buffers_per_shader_stage", 4)
            ]
        );
    }
}
