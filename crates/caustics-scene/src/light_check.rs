use glam::Vec3;
use thiserror::Error;

/// A light that makes no physical sense.
#[derive(Clone, Copy, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum LightError {
    /// A coordinate that is not finite.
    #[error("position {position:?} is not finite")]
    Position {
        /// The position.
        position: [f32; 3],
    },
    /// A direction that is zero, not finite, or, in a light put together by hand, not of unit
    /// length.
    #[error("direction {direction:?} is not a usable unit vector")]
    Direction {
        /// The direction.
        direction: [f32; 3],
    },
    /// An intensity or irradiance that is negative or not finite.
    #[error("intensity {value} is not a finite number of at least 0")]
    Intensity {
        /// The offending channel.
        value: f32,
    },
    /// A radius that is not above zero or not finite.
    #[error("radius {radius} is not a finite number above 0")]
    Radius {
        /// The radius, in metres.
        radius: f32,
    },
    /// A shape whose area is zero (edges that are parallel, lengths whose square is too small for
    /// an f32) or not finite.
    #[error("area {area} is not a finite number above 0")]
    Area {
        /// The area, in square metres.
        area: f32,
    },
    /// Cone angles out of range or out of order.
    #[error("cone angles {inner} and {outer} break 0 <= inner < outer <= pi/2")]
    ConeAngles {
        /// Where the light begins to fall off, in radians.
        inner: f32,
        /// Where it ends, in radians.
        outer: f32,
    },
}

pub(crate) fn unit(direction: Vec3) -> Result<Vec3, LightError> {
    // Scaled first, so that neither tiny nor huge vectors lose their length in its square.
    let largest = direction.abs().max_element();
    if direction.is_finite() && largest > 0.0 {
        Ok((direction / largest).normalize())
    } else {
        Err(LightError::Direction {
            direction: direction.to_array(),
        })
    }
}

pub(crate) fn is_unit(direction: Vec3) -> Result<(), LightError> {
    // A NaN is not normalised either.
    if direction.is_normalized() {
        Ok(())
    } else {
        Err(LightError::Direction {
            direction: direction.to_array(),
        })
    }
}

pub(crate) fn finite(position: Vec3) -> Result<(), LightError> {
    if position.is_finite() {
        Ok(())
    } else {
        Err(LightError::Position {
            position: position.to_array(),
        })
    }
}

pub(crate) fn positive(intensity: Vec3) -> Result<(), LightError> {
    match intensity
        .to_array()
        .into_iter()
        .find(|v| !(v.is_finite() && *v >= 0.0))
    {
        Some(value) => Err(LightError::Intensity { value }),
        None => Ok(()),
    }
}

pub(crate) fn is_radius(radius: f32) -> Result<(), LightError> {
    if radius > 0.0 && radius.is_finite() {
        Ok(())
    } else {
        Err(LightError::Radius { radius })
    }
}

pub(crate) fn has_area(area: Option<f32>) -> Result<(), LightError> {
    match area {
        Some(area) if !(area >= f32::MIN_POSITIVE && area.is_finite()) => {
            Err(LightError::Area { area })
        }
        _ => Ok(()),
    }
}
