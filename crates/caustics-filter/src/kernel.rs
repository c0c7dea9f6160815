use std::f32::consts::FRAC_1_PI;

/// Reconstruction kernels on the unit disc, each with an integral of one over it.
///
/// They spread the flux of a photon over a disc of radius `R`: at a distance `r` from the centre
/// the photon adds `flux * density(r^2/R^2) / R^2` to the irradiance, in W/m^2. Silverman, *Density
/// Estimation for Statistics and Data Analysis* (1986), has all but the cone; the cone's use for
/// photons is Jensen's, *Realistic Image Synthesis Using Photon Mapping* (2001).
///
/// ```
/// use caustics_filter::Kernel;
///
/// // 2 W over a disc of radius 0.5 m, seen at its centre, in W/m^2.
/// let irradiance = 2.0 * Kernel::Box.density(0.0) / (0.5 * 0.5);
/// assert!((irradiance - 8.0 / std::f32::consts::PI).abs() < 1e-6);
/// assert_eq!("epanechnikov".parse(), Ok(Kernel::Epanechnikov));
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Kernel {
    /// `1/pi`: all photons alike. Least variance, and an edge that shows.
    Box,
    /// `(3/pi) (1 - q)`, with `q = r/R`.
    Cone,
    /// `(2/pi) (1 - q^2)`: the least mean squared error of all on smooth irradiance.
    #[default]
    Epanechnikov,
    /// `exp(-q^2 / (2 sigma^2))` with `sigma = 1/3`, cut off at `q = 1`, where 1.1 % of its height
    /// is left, and divided by what remains of its integral.
    Gaussian,
    /// `(3/pi) (1 - q^2)^2`: Silverman's kernel of second order, smooth at its edge.
    Silverman,
}

/// `1 / (2 sigma^2)` of the Gaussian.
const GAUSSIAN_EXPONENT: f32 = 4.5;

/// `GAUSSIAN_EXPONENT / (1 - exp(-GAUSSIAN_EXPONENT)) / pi`, by which its integral is one.
const GAUSSIAN_PEAK: f32 = 1.448_485_7;

impl Kernel {
    /// All kernels.
    pub const ALL: [Self; 5] = [
        Self::Box,
        Self::Cone,
        Self::Epanechnikov,
        Self::Gaussian,
        Self::Silverman,
    ];

    /// The kernel at `q_squared`, the squared distance from the centre over the squared radius.
    ///
    /// Never negative, and zero beyond the disc (`q_squared > 1`) and for a NaN.
    #[must_use]
    #[inline]
    pub fn density(self, q_squared: f32) -> f32 {
        let q2 = q_squared.max(0.0);
        let inside = q_squared <= 1.0;
        if !inside {
            return 0.0;
        }
        match self {
            Self::Box => FRAC_1_PI,
            Self::Cone => 3.0 * FRAC_1_PI * (1.0 - q2.sqrt()),
            Self::Epanechnikov => 2.0 * FRAC_1_PI * (1.0 - q2),
            Self::Gaussian => GAUSSIAN_PEAK * (-GAUSSIAN_EXPONENT * q2).exp(),
            Self::Silverman => 3.0 * FRAC_1_PI * (1.0 - q2) * (1.0 - q2),
        }
    }

    /// Variance along each axis, for a radius of one: kernels of equal `variance * radius^2` blur
    /// about alike, whatever their shape.
    #[must_use]
    pub const fn variance(self) -> f32 {
        match self {
            Self::Box => 1.0 / 4.0,
            Self::Cone => 3.0 / 20.0,
            Self::Epanechnikov => 1.0 / 6.0,
            // (1/a - 1/(e^a - 1)) / 2 with a = 4.5.
            Self::Gaussian => 0.105_494_21,
            Self::Silverman => 1.0 / 8.0,
        }
    }

    /// The name in lower case, as [`FromStr`](std::str::FromStr) reads it.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Box => "box",
            Self::Cone => "cone",
            Self::Epanechnikov => "epanechnikov",
            Self::Gaussian => "gaussian",
            Self::Silverman => "silverman",
        }
    }
}

impl std::fmt::Display for Kernel {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter.pad(self.name())
    }
}

/// A name that no kernel has.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("unknown kernel `{name}`, not one of box, cone, epanechnikov, gaussian, silverman")]
pub struct UnknownKernel {
    /// The name given.
    pub name: String,
}

impl std::str::FromStr for Kernel {
    type Err = UnknownKernel;

    fn from_str(name: &str) -> Result<Self, UnknownKernel> {
        let found = Self::ALL.into_iter().find(|kernel| kernel.name() == name);
        found.ok_or_else(|| UnknownKernel {
            name: name.to_owned(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Integral of `density(q^2) q^(2 power)` over the disc, by the midpoint rule in `q^2`.
    fn moment(kernel: Kernel, power: i32) -> f64 {
        let steps = 1 << 16;
        let sum: f64 = (0..steps)
            .map(|step| {
                let q2 = (f64::from(step) + 0.5) / f64::from(steps);
                f64::from(kernel.density(q2 as f32)) * q2.powi(power)
            })
            .sum();
        std::f64::consts::PI * sum / f64::from(steps)
    }

    #[test]
    fn integrals_are_one() {
        for kernel in Kernel::ALL {
            approx::assert_abs_diff_eq!(moment(kernel, 0), 1.0, epsilon = 1e-6);
        }
    }

    #[test]
    fn variances_are_half_the_second_moments() {
        for kernel in Kernel::ALL {
            let expected = f64::from(kernel.variance());
            approx::assert_abs_diff_eq!(moment(kernel, 1) / 2.0, expected, epsilon = 1e-6);
        }
    }

    #[test]
    fn densities_fall_and_end_at_the_disc() {
        for kernel in Kernel::ALL {
            for step in 0..1000 {
                let q2 = step as f32 / 1000.0;
                assert!(
                    kernel.density(q2) >= kernel.density(q2 + 0.001),
                    "{kernel} at {q2}"
                );
            }
            assert!(kernel.density(1.0) >= 0.0);
            for outside in [1.0_f32.next_up(), 2.0, f32::INFINITY, f32::NAN] {
                assert_eq!(kernel.density(outside), 0.0, "{kernel} at {outside}");
            }
            assert_eq!(kernel.density(-1e-9), kernel.density(0.0));
        }
    }

    #[test]
    fn hand_values() {
        let halfway = |kernel: Kernel| kernel.density(0.25) * std::f32::consts::PI;
        approx::assert_relative_eq!(halfway(Kernel::Box), 1.0);
        approx::assert_relative_eq!(halfway(Kernel::Cone), 1.5);
        approx::assert_relative_eq!(halfway(Kernel::Epanechnikov), 1.5);
        approx::assert_relative_eq!(halfway(Kernel::Silverman), 1.6875);
        approx::assert_relative_eq!(
            Kernel::Gaussian.density(0.25) / Kernel::Gaussian.density(0.0),
            (-1.125_f32).exp()
        );
    }

    #[test]
    fn names_round_trip() {
        for kernel in Kernel::ALL {
            assert_eq!(kernel.to_string().parse(), Ok(kernel));
        }
        let error = "tent".parse::<Kernel>().unwrap_err();
        assert_eq!(
            error,
            UnknownKernel {
                name: "tent".to_owned()
            }
        );
        for kernel in Kernel::ALL {
            assert!(error.to_string().contains(kernel.name()));
        }
    }
}
