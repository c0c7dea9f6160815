use caustics_scene::{Surface, SurfacePoint, World};
use glam::Vec3;

use crate::media::{Crossing, MediumStack};
use crate::optics::{fresnel_dielectric, fresnel_schlick, reflect, refract};

/// What a specular event does to a direction.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Event {
    /// Mirror reflection, at a metal or a dielectric.
    Reflection,
    /// Refraction into or out of a dielectric.
    Refraction,
    /// No event: a boundary that another medium displaces.
    Passage,
}

/// One direction in which light leaves a specular surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Outgoing {
    /// What happened.
    pub event: Event,
    /// Unit direction of travel.
    pub direction: Vec3,
    /// The part of the light that goes this way, for each channel, in 0..=1.
    pub weight: Vec3,
    /// The unit normal that served, on the side from which the light came.
    pub normal: Vec3,
    /// Whether `normal` is the interpolated normal and so changes along the surface.
    pub interpolated: bool,
    /// Refractive index left over refractive index entered; 1 where nothing is refracted.
    pub eta: f32,
    /// The media that the light is in from here.
    pub media: MediumStack,
}

/// All directions in which light leaves a specular surface; their weights and the absorbed part
/// sum to 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scattering {
    outgoing: [Option<Outgoing>; 2],
    /// The part of the light that the surface absorbs, for each channel.
    pub absorbed: Vec3,
    /// For how many directions, at most two, the geometric normal stood in for the interpolated
    /// one: for each outgoing direction that is not [`interpolated`](Outgoing::interpolated) at an
    /// interface, and for a refraction that the geometric normal turned out to forbid.
    pub fallbacks: u32,
}

impl Scattering {
    /// The directions, at most two: the reflected one first.
    pub fn outgoing(&self) -> impl Iterator<Item = &Outgoing> {
        self.outgoing.iter().flatten()
    }
}

/// How a smooth dielectric or a metal scatters light that arrives at `point` along the unit
/// `direction`; `None` on a receiver.
///
/// `media` are those on the light's side of the surface, `channel` is the colour channel (0, 1, 2)
/// of light that dispersion has already split, `None` for all channels together. The interpolated
/// normal serves for directions and Fresnel terms. Where it faces away from the light or sends it
/// to the wrong side of the surface, the geometric normal stands in, which is counted.
///
/// Dielectrics reflect by Fresnel's equations and refract by Snell's law, metals reflect by
/// Schlick's approximation and absorb the rest.
#[must_use]
pub fn scatter(
    world: &World,
    point: &SurfacePoint,
    direction: Vec3,
    media: &MediumStack,
    channel: Option<u8>,
) -> Option<Scattering> {
    let side = if point.from_outside { 1.0 } else { -1.0 };
    let normals = Normals::facing(
        side * point.geometric_normal,
        side * point.shading_normal,
        direction,
    );
    match world.materials()[point.material as usize].surface {
        Surface::Dielectric { .. } => {
            match media.cross(world, point.object, point.from_outside, channel) {
                Crossing::Through(media) => Some(passage(direction, &normals, media)),
                Crossing::Interface {
                    index_from,
                    index_to,
                    beyond,
                } => Some(dielectric(
                    direction,
                    &normals,
                    index_from / index_to,
                    *media,
                    beyond,
                )),
            }
        }
        Surface::Metal { f0 } => Some(metal(direction, &normals, f0, *media)),
        _ => None,
    }
}

/// The two normals on the side from which the light comes.
struct Normals {
    geometric: Vec3,
    serving: Vec3,
    interpolated: bool,
}

impl Normals {
    fn facing(geometric: Vec3, shading: Vec3, direction: Vec3) -> Self {
        let interpolated = shading.dot(direction) < 0.0;
        Self {
            geometric,
            serving: if interpolated { shading } else { geometric },
            interpolated,
        }
    }

    /// The reflected direction, the normal that it took, and whether that is the interpolated one.
    fn reflection(&self, direction: Vec3) -> (Vec3, Vec3, bool) {
        let reflected = reflect(direction, self.serving);
        if !self.interpolated || reflected.dot(self.geometric) > 0.0 {
            (
                reflected.normalize_or_zero(),
                self.serving,
                self.interpolated,
            )
        } else {
            (
                reflect(direction, self.geometric).normalize_or_zero(),
                self.geometric,
                false,
            )
        }
    }

    /// Likewise for refraction.
    fn refraction(&self, direction: Vec3, eta: f32) -> Refraction {
        let by = |normal: Vec3, interpolated: bool| {
            refract(direction, normal, eta).map_or(
                Refraction::Total { interpolated },
                |refracted| Refraction::Transmitted {
                    refracted,
                    normal,
                    interpolated,
                },
            )
        };
        match by(self.serving, self.interpolated) {
            Refraction::Transmitted { refracted, .. }
                if self.interpolated && refracted.dot(self.geometric) >= 0.0 =>
            {
                by(self.geometric, false)
            }
            refraction => refraction,
        }
    }
}

/// What the boundary of a dielectric lets through, and whether the interpolated normal said so.
enum Refraction {
    Transmitted {
        refracted: Vec3,
        normal: Vec3,
        interpolated: bool,
    },
    Total {
        interpolated: bool,
    },
}

fn passage(direction: Vec3, normals: &Normals, media: MediumStack) -> Scattering {
    let straight = Outgoing {
        event: Event::Passage,
        direction,
        weight: Vec3::ONE,
        normal: normals.geometric,
        interpolated: false,
        eta: 1.0,
        media,
    };
    Scattering {
        outgoing: [Some(straight), None],
        absorbed: Vec3::ZERO,
        fallbacks: 0,
    }
}

fn metal(direction: Vec3, normals: &Normals, f0: Vec3, media: MediumStack) -> Scattering {
    let weight = fresnel_schlick(-direction.dot(normals.serving), f0);
    let (reflected, normal, interpolated) = normals.reflection(direction);
    let outgoing = Outgoing {
        event: Event::Reflection,
        direction: reflected,
        weight,
        normal,
        interpolated,
        eta: 1.0,
        media,
    };
    Scattering {
        outgoing: [Some(outgoing), None],
        absorbed: Vec3::ONE - weight,
        fallbacks: u32::from(!interpolated),
    }
}

fn dielectric(
    direction: Vec3,
    normals: &Normals,
    eta: f32,
    before: MediumStack,
    beyond: MediumStack,
) -> Scattering {
    let mut fallbacks = 0;
    let (reflectance, refracted) = match normals.refraction(direction, eta) {
        Refraction::Transmitted {
            refracted,
            normal,
            interpolated,
        } => {
            fallbacks += u32::from(!interpolated);
            let reflectance = fresnel_dielectric(-direction.dot(normals.serving), eta);
            let refracted = Outgoing {
                event: Event::Refraction,
                direction: refracted,
                weight: Vec3::splat(1.0 - reflectance),
                normal,
                interpolated,
                eta,
                media: beyond,
            };
            (reflectance, Some(refracted))
        }
        Refraction::Total { interpolated } => {
            // Where the serving normal is the geometric one, the reflection below counts it.
            fallbacks += u32::from(normals.interpolated && !interpolated);
            (1.0, None)
        }
    };
    let reflected = (reflectance > 0.0).then(|| {
        let (reflected, normal, interpolated) = normals.reflection(direction);
        fallbacks += u32::from(!interpolated);
        Outgoing {
            event: Event::Reflection,
            direction: reflected,
            weight: Vec3::splat(reflectance),
            normal,
            interpolated,
            eta: 1.0,
            media: before,
        }
    });
    Scattering {
        outgoing: [reflected, refracted],
        absorbed: Vec3::ZERO,
        fallbacks,
    }
}
