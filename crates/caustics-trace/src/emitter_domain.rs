use caustics_geometry::{Frame, Sphere};
use caustics_sampling::warp::Cone;
use caustics_scene::{AreaLight, Light};
use glam::Vec3;

/// The rays that an [`Emitter`](crate::Emitter) sends out, as numbers from which the same photons
/// can be made elsewhere, as a shader does.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum EmitterDomain<'a> {
    /// All directions from a point, by
    /// [`square_to_sphere_octahedral`](caustics_sampling::warp::square_to_sphere_octahedral).
    Sphere {
        /// Says the intensity in each direction.
        light: &'a Light,
        /// The point, in metres.
        origin: Vec3,
    },
    /// Directions from a point around an axis, by [`Cone::sample_concentric`].
    Cone {
        /// Says the intensity in each direction.
        light: &'a Light,
        /// The point, in metres.
        origin: Vec3,
        /// Its normal is the axis.
        frame: Frame,
        /// The directions in the frame.
        cone: Cone,
    },
    /// Parallel rays from a rectangle across them: from the corner and the first edge times the
    /// first coordinate of a sample and the second times the second.
    Rectangle {
        /// The corner, in metres.
        corner: Vec3,
        /// The edges, in metres, perpendicular to each other.
        edges: [Vec3; 2],
        /// Unit direction of all rays.
        direction: Vec3,
        /// Irradiance on the rectangle, in W/m².
        irradiance: Vec3,
    },
    /// Rays from one side of an emissive object, evenly over its area: into the cone that holds
    /// the target, evenly, or without one (and from inside it) into the hemisphere, in proportion
    /// to the cosine.
    Area {
        /// The object's primitives and radiance.
        light: &'a AreaLight,
        /// Whether it is the side to which the normals point.
        front: bool,
        /// A sphere that the rays are aimed at.
        target: Option<Sphere>,
    },
    /// No rays: the light cannot reach what it is aimed at.
    Nothing,
}
