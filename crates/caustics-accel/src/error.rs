/// Why an acceleration structure could not be built.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum AccelError {
    /// A point has a NaN or infinite coordinate.
    #[error("point {point} is not finite")]
    NonFinitePoint {
        /// Index of the first such point.
        point: usize,
    },
    /// More points than an index can number.
    #[error("{count} points are more than the limit of {limit}")]
    TooManyPoints {
        /// Points given.
        count: usize,
        /// The most that fit.
        limit: usize,
    },
    /// A search radius or cell size is not a positive, finite number.
    #[error("cell size {size} is not positive and finite")]
    InvalidCellSize {
        /// The size given, in metres.
        size: f32,
    },
    /// A vertex has a NaN or infinite coordinate.
    #[error("vertex {vertex} is not finite")]
    NonFiniteVertex {
        /// Index of the first such vertex.
        vertex: usize,
    },
    /// A vertex is so far away that products of three coordinates would overflow.
    #[error("vertex {vertex} has a coordinate of {coordinate}, beyond the limit of {limit}")]
    VertexTooFar {
        /// Index of the first such vertex.
        vertex: usize,
        /// Its largest coordinate, in metres.
        coordinate: f32,
        /// The largest magnitude allowed, in metres.
        limit: f32,
    },
    /// A triangle refers to a vertex that does not exist.
    #[error("triangle {triangle} refers to vertex {vertex}, but there are only {vertices}")]
    VertexOutOfRange {
        /// Index of the first such triangle.
        triangle: usize,
        /// The vertex it names.
        vertex: u32,
        /// How many vertices there are.
        vertices: usize,
    },
    /// More triangles than an index can number.
    #[error("{count} triangles are more than the limit of {limit}")]
    TooManyTriangles {
        /// Triangles given.
        count: usize,
        /// The most that fit.
        limit: usize,
    },
    /// A tree was refitted to another number of triangles than it holds.
    #[error("{given} triangles were given to a tree of {expected}")]
    TriangleCountChanged {
        /// Triangles given.
        given: usize,
        /// Triangles that the tree was built from.
        expected: usize,
    },
    /// A triangle that could not be hit when the tree was built, being a line or a point, now can.
    #[error("triangle {triangle} had no area when the tree was built: build a new one")]
    TriangleAppeared {
        /// Index of the first such triangle.
        triangle: usize,
    },
    /// A box has a NaN or infinite bound, or is empty.
    #[error("box {index} is empty or not finite")]
    InvalidBox {
        /// Index of the first such box.
        index: usize,
    },
    /// More boxes than an index can number.
    #[error("{count} boxes are more than the limit of {limit}")]
    TooManyBoxes {
        /// Boxes given.
        count: usize,
        /// The most that fit.
        limit: usize,
    },
    /// An instance's transform is singular or not finite, or takes its mesh beyond the limit.
    #[error(
        "instance {instance} has a transform that is singular or not finite, or leads beyond {limit}"
    )]
    InvalidTransform {
        /// Index of the first such instance.
        instance: usize,
        /// The largest magnitude that a coordinate may have, in metres.
        limit: f32,
    },
    /// There is no such instance.
    #[error("there is no instance {instance}, but only {instances}")]
    NoSuchInstance {
        /// The index given.
        instance: usize,
        /// How many there are.
        instances: usize,
    },
}
