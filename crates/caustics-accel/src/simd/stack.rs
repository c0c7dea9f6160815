#![allow(unsafe_code)]

use std::mem::MaybeUninit;

/// A last-in-first-out list of at most `N` entries whose memory is not cleared for each query.
pub(crate) struct Stack<T, const N: usize> {
    entries: [MaybeUninit<T>; N],
    /// All entries below this one have been written.
    height: usize,
}

impl<T: Copy, const N: usize> Stack<T, N> {
    #[inline(always)]
    pub(crate) fn new() -> Self {
        Self {
            entries: [const { MaybeUninit::uninit() }; N],
            height: 0,
        }
    }

    /// Adds an entry; panics when there are `N` already.
    #[inline(always)]
    pub(crate) fn push(&mut self, entry: T) {
        self.entries[self.height].write(entry);
        self.height += 1;
    }

    #[inline(always)]
    pub(crate) fn pop(&mut self) -> Option<T> {
        self.height = self.height.checked_sub(1)?;
        // SAFETY: the index is below the former height, so the entry has been written.
        Some(unsafe { self.entries[self.height].assume_init() })
    }
}

impl<T: Copy + Ord, const N: usize> Stack<T, N> {
    /// Adds an entry below those of the last `pushed` ones that are smaller.
    #[inline(always)]
    pub(crate) fn insert(&mut self, entry: T, pushed: usize) {
        let bottom = self.height - pushed;
        self.push(entry);
        let mut at = self.height - 1;
        while at > bottom {
            // SAFETY: `at - 1 < height`, so the entry has been written.
            let below = unsafe { self.entries[at - 1].assume_init() };
            if below >= entry {
                break;
            }
            self.entries[at].write(below);
            at -= 1;
        }
        self.entries[at].write(entry);
    }
}
