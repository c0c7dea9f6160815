use glam::Vec3;

/// Three orthonormal axes at a point of a surface, right-handed:
/// `tangent x bitangent = normal`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
    /// First axis in the surface, the x axis of local coordinates.
    pub tangent: Vec3,
    /// Second axis in the surface, the y axis of local coordinates.
    pub bitangent: Vec3,
    /// The unit normal, the z axis of local coordinates.
    pub normal: Vec3,
}

impl Frame {
    /// A frame around a unit normal.
    ///
    /// Without branches and without loss near the poles (Duff et al. 2017, "Building an
    /// Orthonormal Basis, Revisited", Journal of Computer Graphics Techniques 6(1)). The tangents
    /// jump where `normal.z` changes sign: they fit a single point, not a direction field.
    #[must_use]
    pub fn from_normal(normal: Vec3) -> Self {
        let sign = 1.0_f32.copysign(normal.z);
        let a = -1.0 / (sign + normal.z);
        let b = normal.x * normal.y * a;
        Self {
            tangent: Vec3::new(
                1.0 + sign * normal.x * normal.x * a,
                sign * b,
                -sign * normal.x,
            ),
            bitangent: Vec3::new(b, sign + normal.y * normal.y * a, -normal.y),
            normal,
        }
    }

    /// From coordinates in the frame to the world's.
    #[must_use]
    pub fn to_world(&self, local: Vec3) -> Vec3 {
        local.x * self.tangent + local.y * self.bitangent + local.z * self.normal
    }

    /// From the world's coordinates to those in the frame.
    #[must_use]
    pub fn to_local(&self, world: Vec3) -> Vec3 {
        Vec3::new(
            world.dot(self.tangent),
            world.dot(self.bitangent),
            world.dot(self.normal),
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn poles_have_the_plain_axes() {
        let up = Frame::from_normal(Vec3::Z);
        assert_eq!((up.tangent, up.bitangent), (Vec3::X, Vec3::Y));
        let down = Frame::from_normal(Vec3::NEG_Z);
        assert_eq!((down.tangent, down.bitangent), (Vec3::X, Vec3::NEG_Y));
        assert_eq!(
            up.to_world(Vec3::new(1.0, 2.0, 3.0)),
            Vec3::new(1.0, 2.0, 3.0)
        );
        assert_eq!(
            down.to_local(Vec3::new(1.0, 2.0, 3.0)),
            Vec3::new(1.0, -2.0, -3.0)
        );
    }
}
