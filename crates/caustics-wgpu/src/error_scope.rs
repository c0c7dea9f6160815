use std::future::Future;
use std::pin::pin;
use std::task::{Context, Poll, Waker};

use crate::renderer_error::RendererError;

/// Catches what a device has to say while a closure talks to it.
///
/// Native devices answer as a scope is popped. A browser's answer is a promise that is kept after the
/// call has returned, and an error that a scope has caught does not reach the host's handlers any
/// more: it would be lost. So in a browser no scope is pushed, and errors go where the host looks for
/// them: to its own scopes, or to what it gave to `on_uncaptured_error`.
pub(crate) fn caught<T>(
    device: &wgpu::Device,
    work: impl FnOnce() -> Result<T, RendererError>,
) -> Result<T, RendererError> {
    if cfg!(target_family = "wasm") {
        return work();
    }
    let scopes = [
        wgpu::ErrorFilter::Internal,
        wgpu::ErrorFilter::OutOfMemory,
        wgpu::ErrorFilter::Validation,
    ]
    .map(|filter| device.push_error_scope(filter));
    let result = work();
    let mut first = None;
    // Popped in the reverse order.
    for scope in scopes.into_iter().rev() {
        if let Some(Some(error)) = answer(scope.pop()) {
            first = Some(match error {
                wgpu::Error::OutOfMemory { .. } => RendererError::OutOfMemory,
                other => RendererError::Device {
                    message: other.to_string(),
                },
            });
        }
    }
    first.map_or(result, Err)
}

/// What a native device has answered already.
fn answer<T>(future: impl Future<Output = T>) -> Option<T> {
    match pin!(future).poll(&mut Context::from_waker(Waker::noop())) {
        Poll::Ready(value) => Some(value),
        Poll::Pending => None,
    }
}
