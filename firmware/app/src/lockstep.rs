//! The lock-step clock: a step is taken when exactly the announced bytes have come.
