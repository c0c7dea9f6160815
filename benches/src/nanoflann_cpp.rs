//! nanoflann itself, in C++: Debian's `libnanoflann-dev`, through a shim compiled with the crate.
#![allow(unsafe_code)]

use std::ffi::c_void;
use std::marker::PhantomData;
use std::ptr::null;

/// A photon found: its index and its squared distance.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Found {
    /// Index of the photon.
    pub index: u32,
    /// In square metres.
    pub distance_squared: f32,
}

unsafe extern "C" {
    fn caustics_nanoflann_new(coordinates: *const f32, count: usize) -> *mut c_void;
    fn caustics_nanoflann_delete(tree: *mut c_void);
    fn caustics_nanoflann_nearest(
        tree: *const c_void,
        point: *const f32,
        wanted: usize,
        indices: *mut u32,
        distances: *mut f32,
    ) -> usize;
    fn caustics_nanoflann_new_found() -> *mut c_void;
    fn caustics_nanoflann_delete_found(found: *mut c_void);
    fn caustics_nanoflann_within(
        tree: *const c_void,
        point: *const f32,
        radius_squared: f32,
        found: *mut c_void,
        pairs: *mut *const c_void,
    ) -> usize;
}

/// A tree with nanoflann's default settings over points that stay where they are.
#[derive(Debug)]
pub struct Nanoflann<'a> {
    tree: *mut c_void,
    points: PhantomData<&'a [[f32; 3]]>,
}

// SAFETY: after it is built, a tree is only read.
unsafe impl Sync for Nanoflann<'_> {}

impl<'a> Nanoflann<'a> {
    /// Builds the tree.
    ///
    /// # Panics
    /// If there is no point, or no memory.
    #[must_use]
    pub fn new(points: &'a [[f32; 3]]) -> Self {
        assert!(!points.is_empty(), "nanoflann wants points");
        // SAFETY: the points are read only while they are borrowed.
        let tree = unsafe { caustics_nanoflann_new(points.as_ptr().cast(), points.len()) };
        assert!(!tree.is_null(), "nanoflann built no tree");
        Self {
            tree,
            points: PhantomData,
        }
    }

    /// The nearest points, nearest first, in memory that is used again.
    pub fn nearest(
        &self,
        point: [f32; 3],
        wanted: usize,
        indices: &mut Vec<u32>,
        distances: &mut Vec<f32>,
    ) {
        indices.resize(wanted, 0);
        distances.resize(wanted, 0.0);
        // SAFETY: both lists have room for all that is written, and the tree is alive.
        let found = unsafe {
            caustics_nanoflann_nearest(
                self.tree,
                point.as_ptr(),
                wanted,
                indices.as_mut_ptr(),
                distances.as_mut_ptr(),
            )
        };
        indices.truncate(found);
        distances.truncate(found);
    }

    /// All points nearer than a radius, in any order, in memory that is used again.
    pub fn within<'b>(&self, point: [f32; 3], radius: f32, list: &'b mut FoundList) -> &'b [Found] {
        let mut pairs = null();
        // SAFETY: both handles are alive. The list's elements are pairs of a u32 and a float,
        // which lie in memory as `Found` does, and stay until it is used again.
        unsafe {
            let (r2, start) = (radius * radius, point.as_ptr());
            let count = caustics_nanoflann_within(self.tree, start, r2, list.0, &mut pairs);
            if count == 0 {
                return &[];
            }
            std::slice::from_raw_parts(pairs.cast(), count)
        }
    }
}

impl Drop for Nanoflann<'_> {
    fn drop(&mut self) {
        // SAFETY: made in `new`, and nothing else has deleted it.
        unsafe { caustics_nanoflann_delete(self.tree) };
    }
}

/// A list that nanoflann writes to.
#[derive(Debug)]
pub struct FoundList(*mut c_void);

impl FoundList {
    /// An empty list.
    #[must_use]
    pub fn new() -> Self {
        // SAFETY: takes nothing.
        Self(unsafe { caustics_nanoflann_new_found() })
    }
}

impl Default for FoundList {
    fn default() -> Self {
        Self::new()
    }
}

impl Drop for FoundList {
    fn drop(&mut self) {
        // SAFETY: made in `new`, and nothing else has deleted it.
        unsafe { caustics_nanoflann_delete_found(self.0) };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn finds_what_lies_near() {
        let points = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 3.0, 0.0]];
        let tree = Nanoflann::new(&points);
        let (mut indices, mut distances) = (Vec::new(), Vec::new());
        tree.nearest([0.75, 0.0, 0.0], 2, &mut indices, &mut distances);
        assert_eq!((indices, distances), (vec![1, 0], vec![0.0625, 0.5625]));
        let mut list = FoundList::new();
        let mut found = tree.within([0.0, 0.0, 0.0], 2.0, &mut list).to_vec();
        found.sort_by_key(|found| found.index);
        let [first, second] = found[..] else {
            panic!("two, and not {found:?}")
        };
        assert_eq!((first.index, first.distance_squared), (0, 0.0));
        assert_eq!((second.index, second.distance_squared), (1, 1.0));
        assert!(tree.within([0.0, 9.0, 0.0], 2.0, &mut list).is_empty());
    }
}
