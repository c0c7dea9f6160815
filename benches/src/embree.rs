//! The little of Embree 3 that a comparison needs; links to the system's `libembree3`.
#![allow(unsafe_code)]

use std::ffi::{CString, c_void};
use std::ptr::{null, null_mut};

use caustics_geometry::{Hit, Ray};
use glam::Vec3;

use crate::meshes::Mesh;

#[repr(C, align(16))]
#[derive(Clone, Copy)]
struct RtcRayHit {
    origin: [f32; 3],
    t_near: f32,
    direction: [f32; 3],
    time: f32,
    t_far: f32,
    mask: u32,
    id: u32,
    flags: u32,
    normal: [f32; 3],
    u: f32,
    v: f32,
    primitive: u32,
    geometry: u32,
    instance: u32,
}

#[repr(C, align(32))]
struct RtcRayHit8 {
    origin: [[f32; 8]; 3],
    t_near: [f32; 8],
    direction: [[f32; 8]; 3],
    time: [f32; 8],
    t_far: [f32; 8],
    mask: [u32; 8],
    id: [u32; 8],
    flags: [u32; 8],
    normal: [[f32; 8]; 3],
    u: [f32; 8],
    v: [f32; 8],
    primitive: [u32; 8],
    geometry: [u32; 8],
    instance: [u32; 8],
}

#[repr(C)]
struct Context {
    flags: u32,
    filter: *const c_void,
    instance: u32,
    min_width: f32,
}

const COHERENT: u32 = 1;
const NONE: u32 = u32::MAX;

#[link(name = "embree3")]
unsafe extern "C" {
    fn rtcNewDevice(config: *const i8) -> *mut c_void;
    fn rtcReleaseDevice(device: *mut c_void);
    fn rtcNewScene(device: *mut c_void) -> *mut c_void;
    fn rtcReleaseScene(scene: *mut c_void);
    fn rtcSetSceneFlags(scene: *mut c_void, flags: u32);
    fn rtcSetSceneBuildQuality(scene: *mut c_void, quality: u32);
    fn rtcCommitScene(scene: *mut c_void);
    fn rtcNewGeometry(device: *mut c_void, kind: u32) -> *mut c_void;
    fn rtcReleaseGeometry(geometry: *mut c_void);
    fn rtcCommitGeometry(geometry: *mut c_void);
    fn rtcAttachGeometry(scene: *mut c_void, geometry: *mut c_void) -> u32;
    fn rtcSetNewGeometryBuffer(
        geometry: *mut c_void,
        kind: u32,
        slot: u32,
        format: u32,
        stride: usize,
        count: usize,
    ) -> *mut c_void;
    fn rtcIntersect1(scene: *mut c_void, context: *mut Context, ray: *mut RtcRayHit);
    fn rtcOccluded1(scene: *mut c_void, context: *mut Context, ray: *mut RtcRayHit);
    fn rtcIntersect8(
        valid: *const i32,
        scene: *mut c_void,
        context: *mut Context,
        ray: *mut RtcRayHit8,
    );
}

// SAFETY: a committed scene may be traced by several threads at a time, says Embree's manual, and
// nothing changes one after `new`.
unsafe impl Sync for Embree {}

/// How Embree builds and traces.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mode {
    /// Its default.
    Default,
    /// `RTC_SCENE_FLAG_ROBUST`.
    Robust,
    /// Default traversal over a tree of high build quality.
    HighQuality,
}

/// A scene of one mesh.
pub struct Embree {
    device: *mut c_void,
    scene: *mut c_void,
}

impl Embree {
    /// Builds the scene on one thread.
    #[must_use]
    pub fn new(mesh: &Mesh, mode: Mode) -> Self {
        Self::with_threads(mesh, mode, 1)
    }

    /// Builds the scene on some threads.
    ///
    /// # Panics
    /// If Embree makes no device.
    #[must_use]
    pub fn with_threads(mesh: &Mesh, mode: Mode, threads: usize) -> Self {
        let config = CString::new(format!("threads={threads},isa=avx2")).expect("no zero in it");
        // SAFETY: handles go only where Embree's API wants them; the buffers have the size asked
        // for, plus the padding that Embree adds itself.
        unsafe {
            let device = rtcNewDevice(config.as_ptr().cast());
            assert!(!device.is_null(), "no Embree device");
            let scene = rtcNewScene(device);
            if mode == Mode::Robust {
                rtcSetSceneFlags(scene, 1 << 2);
            }
            rtcSetSceneBuildQuality(scene, if mode == Mode::HighQuality { 2 } else { 1 });
            let geometry = rtcNewGeometry(device, 0);
            let positions =
                rtcSetNewGeometryBuffer(geometry, 1, 0, 0x9003, 12, mesh.positions.len());
            std::slice::from_raw_parts_mut(positions.cast::<Vec3>(), mesh.positions.len())
                .copy_from_slice(&mesh.positions);
            let indices = rtcSetNewGeometryBuffer(geometry, 0, 0, 0x5003, 12, mesh.triangles.len());
            std::slice::from_raw_parts_mut(indices.cast::<[u32; 3]>(), mesh.triangles.len())
                .copy_from_slice(&mesh.triangles);
            rtcCommitGeometry(geometry);
            rtcAttachGeometry(scene, geometry);
            rtcReleaseGeometry(geometry);
            rtcCommitScene(scene);
            Self { device, scene }
        }
    }

    fn ray(ray: &Ray) -> RtcRayHit {
        RtcRayHit {
            origin: ray.origin.to_array(),
            t_near: ray.t_min,
            direction: ray.direction.to_array(),
            time: 0.0,
            t_far: ray.t_max,
            mask: u32::MAX,
            id: 0,
            flags: 0,
            normal: [0.0; 3],
            u: 0.0,
            v: 0.0,
            primitive: NONE,
            geometry: NONE,
            instance: NONE,
        }
    }

    fn context(flags: u32) -> Context {
        Context {
            flags,
            filter: null(),
            instance: NONE,
            min_width: 0.0,
        }
    }

    /// `rtcIntersect1`.
    #[must_use]
    pub fn closest_hit(&self, ray: &Ray) -> Option<Hit> {
        let mut query = Self::ray(ray);
        // SAFETY: the ray is aligned and laid out as the API wants it.
        unsafe { rtcIntersect1(self.scene, &mut Self::context(0), &mut query) };
        (query.geometry != NONE).then_some(Hit {
            t: query.t_far,
            u: query.u,
            v: query.v,
            primitive: query.primitive,
        })
    }

    /// `rtcOccluded1`.
    #[must_use]
    pub fn is_occluded(&self, ray: &Ray) -> bool {
        let mut query = Self::ray(ray);
        // SAFETY: the call reads and writes only the ray at the head of the query.
        unsafe { rtcOccluded1(self.scene, &mut Self::context(0), &mut query) };
        query.t_far == f32::NEG_INFINITY
    }

    /// `rtcIntersect8`, for each eight of the rays; their number is a multiple of eight.
    pub fn closest_hits(&self, rays: &[Ray], hits: &mut [Option<Hit>]) {
        let valid = Valid([-1; 8]);
        let mut context = Self::context(COHERENT);
        for (rays, hits) in rays.chunks_exact(8).zip(hits.chunks_exact_mut(8)) {
            let lanes = |of: &dyn Fn(&Ray) -> f32| std::array::from_fn(|lane| of(&rays[lane]));
            let mut query = RtcRayHit8 {
                origin: [
                    lanes(&|r| r.origin.x),
                    lanes(&|r| r.origin.y),
                    lanes(&|r| r.origin.z),
                ],
                t_near: lanes(&|r| r.t_min),
                direction: [
                    lanes(&|r| r.direction.x),
                    lanes(&|r| r.direction.y),
                    lanes(&|r| r.direction.z),
                ],
                time: [0.0; 8],
                t_far: lanes(&|r| r.t_max),
                mask: [u32::MAX; 8],
                id: [0; 8],
                flags: [0; 8],
                normal: [[0.0; 8]; 3],
                u: [0.0; 8],
                v: [0.0; 8],
                primitive: [NONE; 8],
                geometry: [NONE; 8],
                instance: [NONE; 8],
            };
            // SAFETY: both structures are aligned and laid out as the API wants them.
            unsafe { rtcIntersect8(valid.0.as_ptr(), self.scene, &mut context, &mut query) };
            for (lane, hit) in hits.iter_mut().enumerate() {
                *hit = (query.geometry[lane] != NONE).then_some(Hit {
                    t: query.t_far[lane],
                    u: query.u[lane],
                    v: query.v[lane],
                    primitive: query.primitive[lane],
                });
            }
        }
    }
}

#[repr(align(32))]
struct Valid([i32; 8]);

impl Drop for Embree {
    fn drop(&mut self) {
        // SAFETY: both were created in `new` and nothing else has released them.
        unsafe {
            rtcReleaseScene(self.scene);
            rtcReleaseDevice(self.device);
        }
        self.scene = null_mut();
    }
}
