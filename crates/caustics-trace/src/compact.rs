use bytemuck::{Pod, Zeroable};
use glam::Vec3;

use crate::photon::Photon;

/// Bits of each channel's mantissa in a shared-exponent flux.
const MANTISSA_BITS: u32 = 9;

/// What is added to the exponent so that it is not negative. A photon's watts are few, so most of the
/// range lies below one.
const BIAS: i32 = 27;

/// The largest code of an exponent.
const LAST_EXPONENT: i32 = 31;

/// A photon in 20 bytes, without its footprint: for storage, and for uploads to a graphics processor.
///
/// Position in full; incoming direction and receiver's normal as points of an octahedron's faces
/// unfolded to a square (Cigolle et al., *Survey of Efficient Representations for Independent Unit
/// Vectors*, 2014), 8 bits for each coordinate; flux as three mantissas of 9 bits with an exponent
/// that they share (as in Ward, *Real Pixels*, Graphics Gems II, 1991).
///
/// What is lost: directions and normals turn by 0.95 degrees at most (0.33 in the mean), the
/// strongest channel of the flux changes by 0.2 % at most and the others by as much of the
/// strongest; below 2^-28 W the steps stay as they are there, so
/// that 2^-37 W vanishes, and what is above 15.9 W is cut. The object and the number of events are
/// not kept, nor what the photon says of its footprint.
///
/// ```
/// use caustics_trace::{CompactPhoton, Coverage, FootprintSource, Photon, glam::Vec3};
///
/// let photon = Photon {
///     position: Vec3::new(1.0, 2.0, 3.0),
///     incoming: Vec3::new(0.6, -0.8, 0.0),
///     flux: Vec3::new(1e-5, 2e-5, 3e-6),
///     normal: Vec3::Y,
///     axes: [Vec3::X, Vec3::Z],
///     object: 0,
///     events: 2,
///     source: FootprintSource::Checked,
///     coverage: Coverage::Cell,
/// };
/// let compact = CompactPhoton::from(&photon);
/// assert_eq!(size_of_val(&compact), 20);
/// assert_eq!(compact.position(), photon.position);
/// assert!(compact.incoming().dot(photon.incoming) > 0.9998);
/// assert!((compact.flux() - photon.flux).abs().max_element() < 0.002 * 2e-5);
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct CompactPhoton {
    position: [f32; 3],
    /// Incoming direction in the lower half, the receiver's normal in the upper.
    directions: u32,
    /// Red, green, blue from the lowest bit, then the exponent.
    flux: u32,
}

/// A photon in 44 bytes, with its footprint's axes in full.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct CompactFootprint {
    photon: CompactPhoton,
    axes: [[f32; 3]; 2],
}

impl CompactPhoton {
    /// Where it landed, in metres: exactly as it was.
    #[must_use]
    pub fn position(&self) -> Vec3 {
        self.position.into()
    }

    /// Unit direction in which it travelled.
    #[must_use]
    pub fn incoming(&self) -> Vec3 {
        direction_of(self.directions as u16)
    }

    /// Unit normal of the receiver, on the side on which it landed.
    #[must_use]
    pub fn normal(&self) -> Vec3 {
        direction_of((self.directions >> 16) as u16)
    }

    /// Flux in watts, for each channel.
    #[must_use]
    pub fn flux(&self) -> Vec3 {
        flux_of(self.flux)
    }
}

impl From<&Photon> for CompactPhoton {
    fn from(photon: &Photon) -> Self {
        let incoming = u32::from(direction_code(photon.incoming));
        let normal = u32::from(direction_code(photon.normal));
        Self {
            position: photon.position.to_array(),
            directions: incoming | normal << 16,
            flux: flux_code(photon.flux),
        }
    }
}

impl CompactFootprint {
    /// The photon.
    #[must_use]
    pub fn photon(&self) -> &CompactPhoton {
        &self.photon
    }

    /// How far away its neighbours landed, as in [`Photon::axes`]: exactly as it was.
    #[must_use]
    pub fn axes(&self) -> [Vec3; 2] {
        self.axes.map(Vec3::from)
    }
}

impl From<&Photon> for CompactFootprint {
    fn from(photon: &Photon) -> Self {
        Self {
            photon: photon.into(),
            axes: photon.axes.map(|it| it.to_array()),
        }
    }
}

/// The signs of coordinates, those of zero positive.
fn sign(value: f32) -> f32 {
    if value < 0.0 { -1.0 } else { 1.0 }
}

fn direction_code(direction: Vec3) -> u16 {
    let size = direction.abs().element_sum();
    let scaled = if size > 0.0 {
        direction / size
    } else {
        Vec3::Z
    };
    // The lower half's faces are folded outwards.
    let (x, y) = if scaled.z < 0.0 {
        (
            (1.0 - scaled.y.abs()) * sign(scaled.x),
            (1.0 - scaled.x.abs()) * sign(scaled.y),
        )
    } else {
        (scaled.x, scaled.y)
    };
    // -127..=127, so that the axes have codes of their own.
    let code = |value: f32| (value * 127.0).round() as i8 as u8;
    u16::from(code(x)) | u16::from(code(y)) << 8
}

fn direction_of(code: u16) -> Vec3 {
    let part = |bits: u16| f32::from(bits as u8 as i8) / 127.0;
    let (x, y) = (part(code), part(code >> 8));
    let z = 1.0 - x.abs() - y.abs();
    let folded = if z < 0.0 {
        Vec3::new((1.0 - y.abs()) * sign(x), (1.0 - x.abs()) * sign(y), z)
    } else {
        Vec3::new(x, y, z)
    };
    folded.normalize_or(Vec3::Z)
}

fn flux_code(flux: Vec3) -> u32 {
    // `max` turns a NaN into 0.
    let flux = flux.max(Vec3::ZERO);
    let strongest = flux.max_element();
    if strongest <= 0.0 {
        return 0;
    }
    let steps = (1u32 << MANTISSA_BITS) as f32;
    // The least power of two that is not below the strongest channel.
    let least = strongest.log2().floor() as i32 + 1;
    let mut exponent = least.clamp(-BIAS, LAST_EXPONENT - BIAS);
    // One that rounds to the next power needs it.
    if (strongest * steps / exp2(exponent)).round() >= steps {
        exponent = (exponent + 1).min(LAST_EXPONENT - BIAS);
    }
    let mantissa = |value: f32| (value * steps / exp2(exponent)).round().min(steps - 1.0) as u32;
    mantissa(flux.x)
        | mantissa(flux.y) << MANTISSA_BITS
        | mantissa(flux.z) << (2 * MANTISSA_BITS)
        | ((exponent + BIAS) as u32) << (3 * MANTISSA_BITS)
}

fn flux_of(code: u32) -> Vec3 {
    let mask = (1 << MANTISSA_BITS) - 1;
    let exponent = (code >> (3 * MANTISSA_BITS)) as i32 - BIAS;
    let scale = exp2(exponent) / (1u32 << MANTISSA_BITS) as f32;
    let mantissa = |shift: u32| ((code >> shift) & mask) as f32;
    scale
        * Vec3::new(
            mantissa(0),
            mantissa(MANTISSA_BITS),
            mantissa(2 * MANTISSA_BITS),
        )
}

/// A power of two, exactly.
fn exp2(exponent: i32) -> f32 {
    f32::from_bits(((exponent + 127) as u32) << 23)
}

#[cfg(test)]
mod tests {
    use super::*;
    use caustics_sampling::CounterRng;
    use caustics_sampling::warp::square_to_sphere_octahedral;

    #[test]
    fn directions_turn_by_less_than_a_degree() {
        let (mut worst, mut sum) = (0.0f32, 0.0f64);
        let mut rng = CounterRng::new(5, 0);
        const COUNT: u32 = 200_000;
        for _ in 0..COUNT {
            let direction = square_to_sphere_octahedral(rng.next_vec2())
                .value
                .normalize();
            let found = direction_of(direction_code(direction));
            assert!(found.is_normalized());
            let angle = 2.0 * (0.5 * (found - direction).length()).asin().to_degrees();
            worst = worst.max(angle);
            sum += f64::from(angle);
        }
        let mean = sum / f64::from(COUNT);
        println!("{worst} {mean}");
        assert!(worst < 0.95 && worst > 0.6, "{worst}");
        assert!(mean < 0.34 && mean > 0.2, "{mean}");
        for axis in [Vec3::X, Vec3::Y, Vec3::Z] {
            assert_eq!(direction_of(direction_code(axis)), axis);
            assert_eq!(direction_of(direction_code(-axis)), -axis);
        }
    }

    #[test]
    fn flux_keeps_its_strongest_channel_within_a_step() {
        let mut rng = CounterRng::new(6, 0);
        for _ in 0..200_000 {
            let strength = 55.0 * rng.next_f32() - 32.0;
            let colour = Vec3::new(rng.next_f32(), rng.next_f32(), rng.next_f32());
            let flux = colour * strength.min(3.9).exp2();
            let found = flux_of(flux_code(flux));
            let strongest = flux.max_element();
            if strongest < 2.0f32.powi(-28) {
                continue;
            }
            let error = (found - flux).abs().max_element() / strongest;
            assert!(error <= 1.0 / 512.0 + 1e-6, "{flux} {found} {error}");
        }
        assert_eq!(flux_of(flux_code(Vec3::ZERO)), Vec3::ZERO);
        assert_eq!(flux_of(flux_code(Vec3::NAN)), Vec3::ZERO);
        assert_eq!(
            flux_of(flux_code(Vec3::new(-1.0, 1.0, 0.25))),
            Vec3::new(0.0, 1.0, 0.25)
        );
        // Beyond the largest code.
        assert!(flux_of(flux_code(Vec3::splat(1e9))).x > 15.9);
    }

    /// The mean over many photons is right: codes are rounded, not cut off.
    #[test]
    fn flux_of_many_photons_is_unbiased() {
        let mut rng = CounterRng::new(7, 0);
        let (mut exact, mut found) = (0.0f64, 0.0f64);
        for _ in 0..100_000 {
            let flux = 1e-6 * (0.5 + rng.next_f32());
            exact += f64::from(flux);
            found += f64::from(flux_of(flux_code(Vec3::new(flux, 0.3 * flux, 0.0))).x);
        }
        assert!((found / exact - 1.0).abs() < 1e-5, "{}", found / exact);
    }

    #[test]
    fn records_are_plain_bytes() {
        assert_eq!(
            (size_of::<CompactPhoton>(), size_of::<CompactFootprint>()),
            (20, 44)
        );
        let photons = [CompactPhoton::default(); 3];
        let bytes: &[u8] = bytemuck::cast_slice(&photons);
        assert_eq!(bytes.len(), 60);
    }
}
