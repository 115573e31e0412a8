//! The widest registers of the machine for the loops that take most of a row.
//!
//! The one place of this crate with `unsafe`: calling a function compiled for more instructions than the baseline is
//! sound only where the machine has them, which is asked first. Nothing is fused, so that the bits are the same.

/// A loop over numbers side by side. `run` must be inlined to be compiled for the registers of whoever calls it.
pub(crate) trait Wide {
    type Out;

    fn run(self) -> Self::Out;
}

/// Runs a loop with registers of four numbers where the machine has them.
#[inline]
pub(crate) fn widely<W: Wide>(work: W) -> W::Out {
    #[cfg(target_arch = "x86_64")]
    if is_x86_feature_detected!("avx2") {
        // SAFETY: the machine has AVX2.
        #[expect(unsafe_code, reason = "asked first whether the machine has the instructions")]
        return unsafe { with_avx2(work) };
    }
    work.run()
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn with_avx2<W: Wide>(work: W) -> W::Out {
    work.run()
}
