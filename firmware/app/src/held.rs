//! An optional value whose bytes are all zero while it is absent.

use heapless::Vec;

/// An `Option` for the app's statics. The compiler may represent `None` by bytes that are not zero; one such byte moves
/// the app's whole initial value from `.bss` into flash.
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

    /// The value, once.
    pub fn take(&mut self) -> Option<T> {
        self.0.pop()
    }

    pub fn clear(&mut self) {
        self.0.clear();
    }
}
