//! A place in the larger RAM for what is too big for the board's.

use core::cell::UnsafeCell;
use core::mem::MaybeUninit;

/// Not initialised at start: put it into section `.axisram`.
pub struct Slot<T>(UnsafeCell<MaybeUninit<T>>);

// SAFETY: the images that use it have one thread, and no interrupt of theirs touches it.
unsafe impl<T> Sync for Slot<T> {}

impl<T> Slot<T> {
    pub const fn new() -> Self {
        Self(UnsafeCell::new(MaybeUninit::uninit()))
    }

    /// Copies `initial` there, from flash: by value it would pass over the stack.
    ///
    /// # Safety
    /// Only once, and nobody else holds `initial`'s parts.
    #[allow(clippy::mut_from_ref)] // what the caller promises
    pub unsafe fn fill(&'static self, initial: &'static T) -> &'static mut T {
        let place = self.0.get().cast::<T>();
        // SAFETY: `place` is valid and not referenced by anything else, as the caller says.
        unsafe {
            place.copy_from_nonoverlapping(initial, 1);
            &mut *place
        }
    }
}
