use glam::Vec3;

/// How a ray's start and direction change with the parameters of its emission.
///
/// `position[i]` and `direction[i]` are the derivatives of the ray's point and of its unit
/// direction in parameter `i`. Point, spot and directional lights have `N = 2` parameters; a ray
/// from an area light has 4, two of its direction and two of its start. The same type serves rays
/// from the eye, whose parameters are the pixel's coordinates.
///
/// The operations are those of Igehy, *Tracing Ray Differentials* (SIGGRAPH 1999): a chain of
/// [`transferred`](Self::transferred), [`reflected`](Self::reflected) and
/// [`refracted`](Self::refracted) is the derivative of the whole path by the chain rule, and
/// everything in it is exact to first order.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RayDifferential<const N: usize = 2> {
    /// Derivatives of the point on the ray, in metres a unit of the parameter.
    pub position: [Vec3; N],
    /// Derivatives of the unit direction, a unit of the parameter.
    pub direction: [Vec3; N],
}

impl<const N: usize> RayDifferential<N> {
    /// The differential of a ray that does not depend on its parameters.
    pub const ZERO: Self = Self { position: [Vec3::ZERO; N], direction: [Vec3::ZERO; N] };

    /// After travelling `distance` along the unit `direction` to a plane with normal
    /// `plane_normal`: each neighbour travels as far as it needs to reach the same plane
    /// (Igehy's equations 10 and 12).
    ///
    /// A ray in the plane itself gives the displacement without the correction of the distance,
    /// since no neighbour's distance exists.
    #[must_use]
    pub fn transferred(&self, direction: Vec3, distance: f32, plane_normal: Vec3) -> Self {
        let along = direction.dot(plane_normal);
        let position = std::array::from_fn(|i| {
            let moved = self.position[i] + distance * self.direction[i];
            if along == 0.0 { moved } else { moved - moved.dot(plane_normal) / along * direction }
        });
        Self { position, direction: self.direction }
    }

    /// After mirror reflection of the unit `direction` at a unit `normal` that changes by
    /// `normal_change[i]` in parameter `i` (Igehy's equation 15).
    #[must_use]
    pub fn reflected(&self, direction: Vec3, normal: Vec3, normal_change: [Vec3; N]) -> Self {
        let along = direction.dot(normal);
        let directions = std::array::from_fn(|i| {
            let (change, bend) = (self.direction[i], normal_change[i]);
            let along_change = change.dot(normal) + direction.dot(bend);
            change - 2.0 * (along * bend + along_change * normal)
        });
        Self { position: self.position, direction: directions }
    }

    /// After refraction of the unit `direction` to the unit `refracted` direction, at a unit
    /// `normal` on the side from which the light comes, which changes by `normal_change[i]`; `eta`
    /// is the ratio of the index left to the index entered (Igehy's equations 17 to 19).
    ///
    /// It grows without bound towards the critical angle, as the true derivative does;
    /// [`bounded`](Self::bounded) keeps it finite.
    #[must_use]
    pub fn refracted(
        &self,
        direction: Vec3,
        refracted: Vec3,
        normal: Vec3,
        eta: f32,
        normal_change: [Vec3; N],
    ) -> Self {
        let along = direction.dot(normal);
        // Never positive: the refracted ray leaves on the other side of the normal.
        let along_refracted = refracted.dot(normal).min(-f32::MIN_POSITIVE);
        let mu = eta * along - along_refracted;
        let mu_slope = eta - eta * eta * along / along_refracted;
        let directions = std::array::from_fn(|i| {
            let (change, bend) = (self.direction[i], normal_change[i]);
            let along_change = change.dot(normal) + direction.dot(bend);
            eta * change - (mu * bend + mu_slope * along_change * normal)
        });
        Self { position: self.position, direction: directions }
    }

    /// The differential with the derivatives of the direction shortened to `limit`, and whether
    /// any was longer or not finite.
    #[must_use]
    pub fn bounded(&self, limit: f32) -> (Self, bool) {
        let mut result = *self;
        let mut shortened = false;
        for change in &mut result.direction {
            let length = change.length();
            if !length.is_finite() {
                *change = Vec3::ZERO;
                shortened = true;
            } else if length > limit {
                *change *= limit / length;
                shortened = true;
            }
        }
        for moved in &mut result.position {
            if !moved.is_finite() {
                *moved = Vec3::ZERO;
                shortened = true;
            }
        }
        (result, shortened)
    }

    /// The differential for a sample spacing `factor` times as wide.
    #[must_use]
    pub fn scaled(&self, factor: f32) -> Self {
        Self {
            position: self.position.map(|it| factor * it),
            direction: self.direction.map(|it| factor * it),
        }
    }

    /// Two axes in the plane with unit `normal` that stand for the displacements in all `N`
    /// parameters: the displacements themselves where there are two, else two axes with the same
    /// covariance `sum of p pᵀ`.
    #[must_use]
    pub fn footprint_axes(&self, normal: Vec3) -> [Vec3; 2] {
        if let [first, second] = self.position[..] {
            return [first, second];
        }
        let (tangent, bitangent) = normal.any_orthonormal_pair();
        let (mut xx, mut xy, mut yy) = (0.0, 0.0, 0.0);
        for moved in &self.position {
            let (x, y) = (moved.dot(tangent), moved.dot(bitangent));
            xx += x * x;
            xy += x * y;
            yy += y * y;
        }
        // The columns of the covariance's Cholesky factor.
        let x = xx.sqrt();
        let shear = if x > 0.0 { xy / x } else { 0.0 };
        let y = (yy - shear * shear).max(0.0).sqrt();
        [x * tangent + shear * bitangent, y * bitangent]
    }
}
