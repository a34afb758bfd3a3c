//! Vector table of an image that uses no device.

type Handler = unsafe extern "C" fn();

unsafe extern "C" {
    /// cortex-m-rt's: ends up in an endless loop.
    safe fn DefaultHandler();
}

/// Name and section are what cortex-m-rt's linker script expects.
// SAFETY: every entry is a handler.
#[unsafe(no_mangle)]
#[unsafe(link_section = ".vector_table.interrupts")]
static __INTERRUPTS: [Handler; 32] = [DefaultHandler; 32];
