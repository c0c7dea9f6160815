//! Questions of rays to a hierarchy, whatever its leaves hold.

use caustics_geometry::{Hit, Ray};

use super::TriangleBvh;
use super::gather::Together;
use super::layout::{Child, Node};
use super::stream::{InPlaceTogether, MeetTogether, trace_all};
use super::traverse::{InPlace, Meet, search, search_any};
use crate::simd::{Kernel, Lanes};
use crate::triangles::{Closest, is_usable};

/// What rays are traced through.
pub(crate) trait Stage {
    fn nodes(&self) -> &[Node];

    fn root(&self) -> Child;

    /// A ray as the boxes and leaves meet it.
    fn alone<'a, L: Lanes>(&'a self, lanes: L, ray: &'a Ray) -> impl Meet<L>;

    /// Rays that keep together, as the leaves meet them.
    fn together<'a, L: Lanes, const ROWS: usize>(
        &'a self,
        rays: Together<'a, ROWS>,
    ) -> impl MeetTogether<L, ROWS>;
}

impl Stage for TriangleBvh {
    #[inline(always)]
    fn nodes(&self) -> &[Node] {
        &self.nodes
    }

    #[inline(always)]
    fn root(&self) -> Child {
        self.root
    }

    #[inline(always)]
    fn alone<'a, L: Lanes>(&'a self, lanes: L, ray: &'a Ray) -> impl Meet<L> {
        InPlace::new(lanes, &self.blocks, ray)
    }

    #[inline(always)]
    fn together<'a, L: Lanes, const ROWS: usize>(
        &'a self,
        rays: Together<'a, ROWS>,
    ) -> impl MeetTogether<L, ROWS> {
        InPlaceTogether {
            tree: self.tree(),
            rays,
        }
    }
}

/// The closest hit of a ray.
pub(crate) struct ClosestHit<'a, S> {
    pub(crate) stage: &'a S,
    pub(crate) ray: &'a Ray,
}

impl<S: Stage> Kernel for ClosestHit<'_, S> {
    type Output = Option<Hit>;

    #[inline(always)]
    fn run<L: Lanes>(self, lanes: L) -> Option<Hit> {
        closest_hit(lanes, self.stage, self.ray)
    }
}

#[inline(always)]
pub(super) fn closest_hit<L: Lanes>(lanes: L, stage: &impl Stage, ray: &Ray) -> Option<Hit> {
    if !is_usable(ray) {
        return None;
    }
    let mut closest = Closest::new(ray);
    let alone = stage.alone(lanes, ray);
    search(lanes, stage.nodes(), stage.root(), &alone, &mut closest);
    closest.hit
}

/// Whether a ray hits anything.
pub(crate) struct Occlusion<'a, S> {
    pub(crate) stage: &'a S,
    pub(crate) ray: &'a Ray,
}

impl<S: Stage> Kernel for Occlusion<'_, S> {
    type Output = bool;

    #[inline(always)]
    fn run<L: Lanes>(self, lanes: L) -> bool {
        let Self { stage, ray } = self;
        if !is_usable(ray) {
            return false;
        }
        let alone = stage.alone(lanes, ray);
        let limit = ray.t_max.next_down();
        search_any(lanes, stage.nodes(), stage.root(), &alone, limit)
    }
}

/// The closest hit of each ray.
pub(crate) struct ClosestHits<'a, S> {
    pub(crate) stage: &'a S,
    pub(crate) rays: &'a [Ray],
    pub(crate) hits: &'a mut [Option<Hit>],
}

impl<S: Stage> Kernel for ClosestHits<'_, S> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self, lanes: L) {
        trace_all(lanes, self.stage, self.rays, self.hits);
    }
}
