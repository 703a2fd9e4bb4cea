//! Requests of memory before its use. A batch of many environments does not fit into the caches of a core: while one of them
//! steps, the memory of the next ones arrives.
//!
//! The functions change no result. On processors without a known instruction they do nothing.

/// A layer of the memory of a run. The addresses of a layer are in the layer before, so each must have arrived before the
/// next one is requested.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Layer {
    /// The fields of the run itself.
    Fields,
    /// The lists and objects of these fields.
    Lists,
    /// The lists and objects of the elements of lists, such as the controllers of robots.
    Elements,
    /// The lists of these objects.
    Contents,
}

impl Layer {
    pub const ALL: [Self; 4] = [Self::Fields, Self::Lists, Self::Elements, Self::Contents];
}

/// Requests all cache lines of a value or a slice.
#[inline]
pub fn prefetch<T: ?Sized>(value: &T) {
    /// The size of a cache line, bytes.
    const LINE: usize = 64;
    let (start, size) = ((&raw const *value).cast::<u8>(), size_of_val(value));
    if size == 0 {
        return;
    }
    let before = start.addr() % LINE;
    for at in (0..before + size).step_by(LINE) {
        request_line(start.wrapping_add(at));
    }
}

/// Requests the first cache line of a value.
#[inline]
pub fn prefetch_start<T>(value: &T) {
    request_line((&raw const *value).cast());
}

#[cfg(target_arch = "x86_64")]
#[inline(always)]
#[expect(unsafe_code)]
fn request_line(address: *const u8) {
    use std::arch::x86_64::{_MM_HINT_T1, _mm_prefetch};
    // SAFETY: the instruction is part of every x86-64 processor. It reads no value, and an invalid address has no effect.
    unsafe { _mm_prefetch::<_MM_HINT_T1>(address.cast()) }
}

#[cfg(not(target_arch = "x86_64"))]
#[inline(always)]
fn request_line(_: *const u8) {}
