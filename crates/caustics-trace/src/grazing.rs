//! Differentials of photons that graze a surface.

use glam::Vec3;

use crate::differential::RayDifferential;
use crate::scatter::{Event, Outgoing};

/// How near a silhouette differentials still grow, in steps of the lattice and, of light that is blurred, parts
/// of the blur ([`BLUR_EDGE`](crate::BLUR_EDGE)), together: under a wide lamp that is far more than a cell.
///
/// Under a square lamp over a glass sphere it takes 14, 11, 5 and 3 % off the error of 16,384, 65,536,
/// 262,144 and 1,000,000 photons. By steps alone 1.2 is as good.
const NEAREST: f32 = 0.3;

/// By how much the cosines of the angles to the normal, of what comes and of what leaves, are above zero, and
/// how they change with the parameters: of the two, those that end sooner.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Grazing<const N: usize> {
    cosine: f32,
    change: [f32; N],
}

impl<const N: usize> Grazing<N> {
    /// Of light of unit `direction` with this differential at a normal that changes by `normal_change`.
    pub(crate) fn of(
        differential: &RayDifferential<N>,
        direction: Vec3,
        outgoing: &Outgoing,
        normal_change: &[Vec3; N],
    ) -> Self {
        let cosine = direction.dot(outgoing.normal).abs();
        let change = std::array::from_fn(|i| {
            differential.direction[i].dot(outgoing.normal) + direction.dot(normal_change[i])
        });
        let refracted = outgoing.direction.dot(outgoing.normal).abs();
        if outgoing.event == Event::Refraction && refracted < cosine {
            // By Snell's law: the one sine is eta times the other.
            let factor = outgoing.eta * outgoing.eta * cosine / refracted;
            return Self {
                cosine: refracted,
                change: change.map(|it| factor * it),
            };
        }
        Self { cosine, change }
    }

    /// A differential no wider towards the silhouette than that of light [`NEAREST`] to it, and whether it was.
    ///
    /// The cosine, and with it where light goes, changes as the root of the distance to the silhouette: its
    /// derivative is half of it over that distance, and grows without bound. What the photon stands for has a
    /// width, so that what it lights has one, too: nearer than a part of that the derivative there is kept.
    pub(crate) fn bounded(&self, differential: RayDifferential<N>) -> (RayDifferential<N>, bool) {
        let squares = self.change.iter().fold(0.0, |sum, it| sum + it * it);
        let slope = squares.sqrt();
        let distance = self.cosine / (2.0 * slope);
        let is_known = slope > 0.0 && slope < f32::MAX && distance < NEAREST;
        if !is_known {
            return (differential, false);
        }
        let lost = 1.0 - (distance / NEAREST).sqrt();
        let towards = self.change.map(|it| it / slope);
        let kept = |moved: [Vec3; N]| {
            let along = towards
                .iter()
                .zip(&moved)
                .fold(Vec3::ZERO, |sum, (part, moved)| sum + *part * *moved);
            std::array::from_fn(|i| moved[i] - lost * towards[i] * along)
        };
        let kept = RayDifferential {
            position: kept(differential.position),
            direction: kept(differential.direction),
        };
        (kept, true)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::media::MediumStack;

    fn reflected() -> Outgoing {
        Outgoing {
            event: Event::Reflection,
            direction: Vec3::X,
            normal: Vec3::Y,
            eta: 1.0,
            weight: Vec3::ONE,
            interpolated: true,
            media: MediumStack::EMPTY,
        }
    }

    /// Light whose cosine is the root of the distance to a silhouette, in cells along both parameters'
    /// diagonal, and which lands as far away as its cosine says.
    fn at(distance: f32) -> (Grazing<2>, RayDifferential<2>) {
        let cosine = distance.sqrt();
        let direction = Vec3::new((1.0 - distance).sqrt(), -cosine, 0.0);
        let slope = 0.5 / cosine * std::f32::consts::FRAC_1_SQRT_2;
        let before = RayDifferential {
            position: [Vec3::ZERO; 2],
            direction: [-slope * Vec3::Y; 2],
        };
        let landed = RayDifferential {
            position: [slope * Vec3::X + Vec3::Z, slope * Vec3::X - Vec3::Z],
            direction: [Vec3::ZERO; 2],
        };
        let grazing = Grazing::of(&before, direction, &reflected(), &[Vec3::ZERO; 2]);
        (grazing, landed)
    }

    #[test]
    fn nearer_than_a_part_of_a_cell_light_spreads_as_from_there() {
        let spread = |distance: f32| {
            let (grazing, landed) = at(distance);
            let (kept, is_shortened) = grazing.bounded(landed);
            assert_eq!(is_shortened, distance < NEAREST);
            let [one, other] = kept.position;
            // What does not lead to the silhouette stays.
            assert!((one - other).abs_diff_eq(2.0 * Vec3::Z, 1e-5), "{distance}");
            (one + other).length()
        };
        let least = spread(NEAREST);
        for part in [1e-6, 1e-3, 0.1, 0.9] {
            let found = spread(part * NEAREST);
            assert!((found - least).abs() < 1e-3 * least, "{part}: {found}");
        }
        let (grazing, landed) = at(1.01 * NEAREST);
        assert_eq!(grazing.bounded(landed), (landed, false));
    }

    #[test]
    fn what_leaves_ends_sooner_at_a_critical_angle() {
        let (before, _) = at(0.25);
        let grazing = |cosine: f32| {
            let outgoing = Outgoing {
                event: Event::Refraction,
                direction: Vec3::new((1.0 - cosine * cosine).sqrt(), -cosine, 0.0),
                eta: 1.5,
                ..reflected()
            };
            let differential = RayDifferential {
                position: [Vec3::ZERO; 2],
                direction: before.change.map(|it| it * Vec3::Y),
            };
            let direction = Vec3::new(0.75f32.sqrt(), -0.5, 0.0);
            Grazing::of(&differential, direction, &outgoing, &[Vec3::ZERO; 2])
        };
        // d(cos t) = eta^2 (cos i / cos t) d(cos i).
        let found = grazing(0.25);
        assert!((found.change[0] / before.change[0] - 4.5).abs() < 1e-5);
        assert_eq!(found.cosine, 0.25);
        assert_eq!(grazing(0.75).cosine, before.cosine);
    }

    #[test]
    fn nothing_is_kept_back_where_nothing_is_known() {
        let (grazing, landed) = at(0.01);
        for change in [[0.0; 2], [f32::INFINITY; 2], [f32::NAN; 2]] {
            let unknown = Grazing { change, ..grazing };
            assert_eq!(unknown.bounded(landed), (landed, false));
        }
        let touching = Grazing {
            cosine: 0.0,
            ..grazing
        };
        let (kept, _) = touching.bounded(landed);
        assert!(kept.position.iter().all(|it| it.is_finite()));
    }
}
