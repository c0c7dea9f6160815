//! The software adapter that the tests run on.

use crate::common;

#[test]
fn a_device_has_the_default_limits() {
    let Some((device, _)) = common::test_device() else {
        return;
    };
    let limits = device.limits();
    assert_eq!(limits.max_storage_buffer_binding_size, 128 << 20);
    assert_eq!(limits.max_storage_buffers_per_shader_stage, 8);
}
