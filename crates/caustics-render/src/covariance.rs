use glam::{Mat2, Vec2, Vec3};

use crate::footprint::FootprintOptions;
use crate::footprint_kernel::FootprintKernel;

/// A symmetric matrix of two dimensions.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Covariance {
    pub(crate) xx: f32,
    pub(crate) xy: f32,
    pub(crate) yy: f32,
}

impl Covariance {
    /// The covariance of the kernel over a footprint with `axes`.
    pub(crate) fn of_axes(axes: &[Vec3; 2], normal: Vec3, options: &FootprintOptions) -> Self {
        let (tangent, bitangent) = normal.any_orthonormal_pair();
        let mut covariance = Self::default();
        let squared = options.scale * options.scale;
        for axis in axes {
            covariance.add(squared, axis.dot(tangent), axis.dot(bitangent));
        }
        covariance.limit_anisotropy(options.max_anisotropy);
        if options.kernel == FootprintKernel::Disc {
            covariance = covariance.rounded();
        }
        covariance
    }

    /// Adds a variance along each of a pixel's edges, in squares of them.
    pub(crate) fn add_pixel(&mut self, pixel: &[Vec3; 2], normal: Vec3, variance: f32) {
        let (tangent, bitangent) = normal.any_orthonormal_pair();
        for axis in pixel {
            self.add(variance, axis.dot(tangent), axis.dot(bitangent));
        }
    }

    /// The covariance of what a linear map makes of it.
    pub(crate) fn mapped(&self, map: &Mat2) -> Self {
        let matrix = Mat2::from_cols(Vec2::new(self.xx, self.xy), Vec2::new(self.xy, self.yy));
        let mapped = *map * matrix * map.transpose();
        Self {
            xx: mapped.x_axis.x,
            xy: mapped.y_axis.x,
            yy: mapped.y_axis.y,
        }
    }

    /// Adds to all directions what the shortest lacks to a variance of `least`; whether any.
    pub(crate) fn widen(&mut self, least: f32) -> bool {
        let (short, _) = self.eigenvalues();
        let is_short = short < least;
        if is_short {
            self.xx += least - short;
            self.yy += least - short;
        }
        is_short
    }

    pub(crate) fn add(&mut self, weight: f32, x: f32, y: f32) {
        self.xx += weight * x * x;
        self.xy += weight * x * y;
        self.yy += weight * y * y;
    }

    pub(crate) fn eigenvalues(&self) -> (f32, f32) {
        let mean = 0.5 * (self.xx + self.yy);
        let half = 0.5 * (self.xx - self.yy);
        let spread = (half * half + self.xy * self.xy).sqrt();
        ((mean - spread).max(0.0), mean + spread)
    }

    /// Widens the short axis, all around, until the long one is at most `limit` times as long.
    pub(crate) fn limit_anisotropy(&mut self, limit: f32) {
        if !limit.is_finite() {
            return;
        }
        let (short, long) = self.eigenvalues();
        let least = long / (limit * limit);
        if short < least && limit > 1.0 {
            // Adding w to both eigenvalues: (long + w) / (short + w) = limit².
            let widened = (long - limit * limit * short) / (limit * limit - 1.0);
            self.xx += widened;
            self.yy += widened;
        } else if limit <= 1.0 {
            *self = Self {
                xx: long,
                xy: 0.0,
                yy: long,
            };
        }
    }

    /// A disc of the same area.
    pub(crate) fn rounded(&self) -> Self {
        let (short, long) = self.eigenvalues();
        let variance = (short * long).sqrt();
        Self {
            xx: variance,
            xy: 0.0,
            yy: variance,
        }
    }

    /// The lower triangular matrix whose product with its transpose this is: `[[xx, 0], [xy, yy]]`.
    pub(crate) fn cholesky(&self) -> Option<[[f32; 2]; 2]> {
        let xx = self.xx.sqrt();
        let xy = self.xy / xx;
        let yy = (self.yy - xy * xy).max(1e-6 * self.yy).sqrt();
        (xx > 0.0 && yy > 0.0 && xx.is_finite() && yy.is_finite()).then_some([[xx, 0.0], [xy, yy]])
    }
}
