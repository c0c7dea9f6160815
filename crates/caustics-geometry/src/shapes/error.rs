use thiserror::Error;

use crate::MeshError;

/// The most vertices that a generator makes: enough for any mesh that fits in memory beside its
/// acceleration structure, and far below the reach of 32-bit indices.
const MOST_VERTICES: u64 = 1 << 27;

/// Why numbers do not make a shape.
#[derive(Clone, Copy, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum ShapeError {
    /// A size is NaN, infinite, zero or negative.
    #[error("{quantity} {value} is not positive and finite")]
    NotPositive {
        /// Which size.
        quantity: &'static str,
        /// The size given, in metres.
        value: f32,
    },
    /// A size must be smaller than another.
    #[error("{quantity} {value} is not below {limit}")]
    NotBelow {
        /// Which size.
        quantity: &'static str,
        /// The size given, in metres.
        value: f32,
        /// The size that it must stay below, in metres.
        limit: f32,
    },
    /// There are too few segments, rings, cells or profile points to enclose anything.
    #[error("{count} {quantity}, fewer than {minimum}")]
    TooFew {
        /// What is counted.
        quantity: &'static str,
        /// The number given.
        count: usize,
        /// The smallest number allowed.
        minimum: usize,
    },
    /// The mesh would have too many vertices.
    #[error("{vertices} vertices, more than {limit}")]
    TooManyVertices {
        /// The number of vertices asked for.
        vertices: u64,
        /// The largest number allowed.
        limit: u64,
    },
    /// A coordinate or the normal of a profile point is NaN or infinite.
    #[error("profile point {point} is not finite")]
    NonFiniteProfile {
        /// Index of the point.
        point: usize,
    },
    /// A profile point lies on the far side of the axis.
    #[error("profile point {point} has the negative radius {radius}")]
    NegativeRadius {
        /// Index of the point.
        point: usize,
        /// Its radius, in metres.
        radius: f32,
    },
    /// A profile point repeats the one before it.
    #[error("profile point {point} repeats the one before it")]
    RepeatedPoint {
        /// Index of the second of the two.
        point: usize,
    },
    /// Two profile points in a row lie on the axis, so that nothing spans between them.
    #[error("profile points {} and {point} both lie on the axis", point - 1)]
    SegmentOnAxis {
        /// Index of the second of the two.
        point: usize,
    },
    /// The vertices do not make a mesh.
    #[error(transparent)]
    Mesh(#[from] MeshError),
}

pub(super) fn check_positive(quantity: &'static str, value: f32) -> Result<(), ShapeError> {
    if value > 0.0 && value.is_finite() {
        Ok(())
    } else {
        Err(ShapeError::NotPositive { quantity, value })
    }
}

pub(super) fn check_below(
    quantity: &'static str,
    value: f32,
    limit: f32,
) -> Result<(), ShapeError> {
    if value < limit {
        Ok(())
    } else {
        Err(ShapeError::NotBelow {
            quantity,
            value,
            limit,
        })
    }
}

pub(super) fn check_count(
    quantity: &'static str,
    count: usize,
    minimum: usize,
) -> Result<(), ShapeError> {
    if count >= minimum {
        Ok(())
    } else {
        Err(ShapeError::TooFew {
            quantity,
            count,
            minimum,
        })
    }
}

pub(super) fn check_vertices(vertices: u64) -> Result<(), ShapeError> {
    if vertices <= MOST_VERTICES {
        Ok(())
    } else {
        Err(ShapeError::TooManyVertices {
            vertices,
            limit: MOST_VERTICES,
        })
    }
}
