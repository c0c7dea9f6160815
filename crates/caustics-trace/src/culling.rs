use caustics_sampling::CounterRng;
use caustics_scene::{Camera, Projection};
use glam::{Vec3, Vec4};

use crate::ledger::{EnergyLedger, Fate};
use crate::photon::{Coverage, Photon};

/// How far a footprint lights, in lengths of its axes: the widest kernel ends at 1.8 of them.
const REACH: f32 = 2.0;

/// Which photons are not stored though they land: nothing by default. The ledger counts every one.
///
/// Photons are culled last, when their footprints have been checked against all that landed beside
/// them, so that those that are kept are what they are without culling. What is dropped is light lost;
/// `docs/emission.md` has what each saves and costs.
///
/// ```
/// use caustics_trace::{Culling, TraceOptions};
///
/// let mut options = TraceOptions::default();
/// assert_eq!(options.culling, Culling::default());
/// options.culling.min_flux = 1e-9;
/// assert!(options.validate().is_ok());
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Culling {
    /// Photons that land with less than this, in watts in their strongest channel, meet Russian
    /// roulette; a survivor has this flux, and a footprint as much wider. Nothing is lost but
    /// detail. 0 turns it off.
    pub min_flux: f32,
    /// Photons whose footprint, the parallelogram of its axes, is larger than this, in square
    /// metres, are dropped and booked as [`Fate::Wide`]: light that is spread so thin that a host
    /// may do without. Infinite turns it off.
    pub max_area: f32,
    /// Photons whose footprint is wider than this, as an eye sees it, are dropped and booked as
    /// [`Fate::Wide`].
    pub max_solid_angle: Option<SolidAngleLimit>,
    /// Photons whose footprint lies outside this view are dropped and booked as
    /// [`Fate::Unseen`]. They may still be seen in mirrors and through glass, and are gone for any
    /// other camera.
    pub view: Option<ViewVolume>,
}

impl Default for Culling {
    fn default() -> Self {
        Self {
            min_flux: 0.0,
            max_area: f32::INFINITY,
            max_solid_angle: None,
            view: None,
        }
    }
}

/// The widest footprint that is kept, as an eye sees it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SolidAngleLimit {
    /// Where the eye is, in metres.
    pub eye: Vec3,
    /// The solid angle of the parallelogram of the footprint's axes, in steradians; at least 0.
    pub steradians: f32,
}

impl SolidAngleLimit {
    /// So many pixels in the middle of a camera's picture; `None` where its rays are parallel, so
    /// that [`Culling::max_area`] says the same.
    #[must_use]
    pub fn of_pixels(camera: &Camera, height: u32, pixels: f32) -> Option<Self> {
        let Projection::Perspective { yfov } = camera.projection else {
            return None;
        };
        let edge = 2.0 * (0.5 * yfov).tan() / height as f32;
        Some(Self {
            eye: camera.position(),
            steradians: pixels * edge * edge,
        })
    }

    fn exceeded_by(&self, photon: &Photon) -> bool {
        let to_eye = self.eye - photon.position;
        let distance = to_eye.length();
        let across = photon.axes[0].cross(photon.axes[1]).dot(to_eye).abs();
        // Of a small parallelogram; beside the eye it is infinite.
        across > self.steradians * distance * distance * distance
    }
}

/// What a camera can see, if nothing stands in the way: the space between four planes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ViewVolume {
    /// Unit normals that point inwards, and distances: a point is inside where
    /// `normal . point + w >= 0` for all.
    pub planes: [Vec4; 4],
}

impl ViewVolume {
    /// The volume of a picture of this size; `None` where the camera's rays span none.
    #[must_use]
    pub fn of(camera: &Camera, width: u32, height: u32) -> Option<Self> {
        let (right, bottom) = (width as f32, height as f32);
        let corners = [(0.0, 0.0), (right, 0.0), (right, bottom), (0.0, bottom)]
            .map(|(x, y)| camera.ray(x, y, width, height));
        let middle = camera.ray(0.5 * right, 0.5 * bottom, width, height);
        let inside = middle.at(1.0);
        let mut planes = [Vec4::ZERO; 4];
        for (side, plane) in planes.iter_mut().enumerate() {
            let (one, other) = (corners[side], corners[(side + 1) % 4]);
            let across = other.at(1.0) - one.origin;
            let normal = one.direction.cross(across).try_normalize()?;
            let offset = -normal.dot(one.origin);
            let sign = if normal.dot(inside) + offset < 0.0 {
                -1.0
            } else {
                1.0
            };
            *plane = sign * normal.extend(offset);
        }
        Some(Self { planes })
    }

    /// Whether something of a ball may be inside.
    #[must_use]
    pub fn meets(&self, center: Vec3, radius: f32) -> bool {
        self.planes
            .iter()
            .all(|plane| plane.truncate().dot(center) + plane.w >= -radius)
    }
}

impl Culling {
    /// Whether a photon that has been booked as stored stays; it may be given more flux and a wider
    /// footprint. What is lost is booked anew.
    pub(crate) fn keeps(&self, photon: &mut Photon, ledger: &mut EnergyLedger) -> bool {
        // Images carry no light that is booked.
        let is_booked = photon.coverage != Coverage::Reflected;
        if let Some(fate) = self.rejects(photon) {
            if is_booked {
                ledger.rebook(fate, photon.flux);
            }
            return false;
        }
        let survival = photon.flux.max_element() / self.min_flux;
        if survival < 1.0 {
            // Of a stream of its own, so that no other photon depends on it.
            let [x, y, z] = photon.position.to_array().map(|it| u64::from(it.to_bits()));
            let way = u64::from(photon.incoming.x.to_bits());
            let mut rng = CounterRng::new(x << 32 | y, z << 32 | way);
            if rng.next_f32() >= survival {
                if is_booked {
                    ledger.rebook(Fate::Roulette, photon.flux);
                }
                return false;
            }
            let more = photon.flux / survival;
            if is_booked {
                ledger.gain(more - photon.flux);
                ledger.strengthen((more - photon.flux).as_dvec3());
            }
            photon.flux = more;
            // Survivors stand farther apart.
            photon.axes = photon.axes.map(|axis| survival.sqrt().recip() * axis);
        }
        true
    }

    /// Drops from `photons` what is not kept.
    pub(crate) fn apply(&self, photons: &mut Vec<Photon>, ledger: &mut EnergyLedger) {
        if *self != Self::default() {
            photons.retain_mut(|photon| self.keeps(photon, ledger));
        }
    }

    /// Why a photon is dropped, if it is.
    fn rejects(&self, photon: &Photon) -> Option<Fate> {
        let axes = &photon.axes;
        if self.max_area < f32::INFINITY && axes[0].cross(axes[1]).length() > self.max_area {
            return Some(Fate::Wide);
        }
        if self
            .max_solid_angle
            .is_some_and(|limit| limit.exceeded_by(photon))
        {
            return Some(Fate::Wide);
        }
        let reach = || REACH * (axes[0].length() + axes[1].length());
        match &self.view {
            Some(view) if !view.meets(photon.position, reach()) => Some(Fate::Unseen),
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_view_holds_what_projects_into_the_picture() {
        let eye = [1.0, 2.0, 3.0];
        let camera = Camera::look_at("", eye, [0.0, 0.5, -1.0], [0.0, 1.0, 0.0], 0.8).unwrap();
        let view = ViewVolume::of(&camera, 64, 48).unwrap();
        let mut rng = caustics_sampling::CounterRng::new(3, 0);
        let mut seen = 0;
        for _ in 0..20_000 {
            let point = 8.0 * (Vec3::from_array([(); 3].map(|()| rng.next_f32())) - 0.5);
            let pixel = camera.project(point, 64, 48);
            let inside = pixel.is_some_and(|at| {
                at.cmpge(glam::Vec2::splat(-1e-3)).all() && at.x <= 64.001 && at.y <= 48.001
            });
            let outside = pixel.is_none_or(|at| {
                at.cmplt(glam::Vec2::splat(1e-3)).any() || at.x >= 63.999 || at.y >= 47.999
            });
            if view.meets(point, 0.0) {
                assert!(inside, "{point}");
                seen += 1;
            } else {
                assert!(outside, "{point}");
            }
        }
        assert!(seen > 1000, "{seen}");
        // Behind the eye, but as large as the way to it.
        assert!(!view.meets(Vec3::new(2.0, 3.5, 7.0), 0.5));
        assert!(view.meets(Vec3::new(2.0, 3.5, 7.0), 6.0));
    }
}
