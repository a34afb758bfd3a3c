//! A value or none, and nothing but zero bytes while there is none.

use heapless::Vec;

/// An `Option` for the app's statics. The "none" of an `Option` is whatever its content has no use for, which need not
/// be zero, and one such byte moves all of the app's initial value from `.bss` into flash.
#[derive(Clone, Debug)]
pub struct Held<T>(Vec<T, 1>);

impl<T> Default for Held<T> {
    fn default() -> Self {
        Self::none()
    }
}

impl<T> Held<T> {
    pub const fn none() -> Self {
        Self(Vec::new())
    }

    pub fn get(&self) -> Option<&T> {
        self.0.first()
    }

    pub fn get_mut(&mut self) -> Option<&mut T> {
        self.0.first_mut()
    }

    pub fn set(&mut self, value: T) {
        self.0.clear();
        // there is room now
        let _ = self.0.push(value);
    }

    pub fn clear(&mut self) {
        self.0.clear();
    }
}
