//! Settings that a modem must have, sent until it confirms them.

use super::{Setting, ToModem};

/// Settings not confirmed are sent again after this, µs.
const RETRY_US: u64 = 5_000_000;
/// After a reboot the modem is left alone for this long, µs.
const REBOOT_US: u64 = 2_000_000;

/// A setting and its value.
pub type Wanted = (&'static str, u8);

/// Which of `N` settings the modem has confirmed.
#[derive(Clone, Copy, Debug)]
pub struct Configuration<const N: usize> {
    confirmed: [bool; N],
    /// The next setting to send, and when.
    next: usize,
    next_us: u64,
}

impl<const N: usize> Configuration<N> {
    /// None is confirmed.
    #[must_use]
    pub const fn new() -> Self {
        Self { confirmed: [false; N], next: 0, next_us: 0 }
    }

    /// The modem started again at `now_us`: it has lost all of them.
    pub fn restart(&mut self, now_us: u64) {
        *self = Self { next_us: now_us.saturating_add(REBOOT_US), ..Self::new() };
    }

    /// All are confirmed.
    #[must_use]
    pub fn is_complete(&self) -> bool {
        self.confirmed.iter().all(|confirmed| *confirmed)
    }

    /// The modem says what a setting is.
    pub fn confirm(&mut self, setting: &Setting<'_>, wanted: &[Wanted; N]) {
        for ((name, value), confirmed) in wanted.iter().zip(&mut self.confirmed) {
            let mut digits = [0; 3];
            if *name == setting.name && text(*value, &mut digits) == setting.value {
                *confirmed = true;
            }
        }
    }

    /// The setting that is due, if any: one a call, unconfirmed ones again after a while.
    pub fn due<'b>(&mut self, now_us: u64, wanted: &[Wanted; N], buffer: &'b mut [u8]) -> Option<&'b [u8]> {
        if now_us < self.next_us {
            return None;
        }
        while let (Some((name, value)), Some(confirmed)) = (wanted.get(self.next), self.confirmed.get(self.next)) {
            self.next += 1;
            if !confirmed {
                let mut digits = [0; 3];
                return ToModem::Configure(Setting { name, value: text(*value, &mut digits) }).emit(buffer).ok();
            }
        }
        self.next = 0;
        self.next_us = now_us.saturating_add(RETRY_US);
        None
    }
}

/// A small number as text.
fn text(value: u8, digits: &mut [u8; 3]) -> &str {
    *digits = [b'0' + value / 100, b'0' + value / 10 % 10, b'0' + value % 10];
    let leading = digits.iter().take(2).take_while(|digit| **digit == b'0').count();
    core::str::from_utf8(digits.get(leading..).unwrap_or_default()).unwrap_or_default()
}
