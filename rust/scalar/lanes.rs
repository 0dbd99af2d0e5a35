//! Arithmetic on arrays of lanes by the vector instructions of a set, which give the same bits as plain
//! loops. The compiler finds such instructions in plain loops too, but loses them in long formulas.

#[cfg(target_arch = "x86_64")]
use std::arch::x86_64::*;

use super::isa::{InstructionSet, Isa};

/// Functions of arrays, lane by lane: what they do to one lane, to four with AVX2 and to eight with AVX-512.
macro_rules! lanewise {
    ($($(#[$doc:meta])* $name:ident($($a:ident),+) = $lane:expr, $four:expr, $eight:expr;)+) => {$(
        $(#[$doc])*
        #[inline(always)]
        pub fn $name<const L: usize, V: InstructionSet>($($a: &[f64; L]),+) -> [f64; L] {
            let mut result = [0.0; L];
            #[cfg(target_arch = "x86_64")]
            if const { matches!(V::ISA, Isa::Avx512) && L.is_multiple_of(8) } {
                let mut i = 0;
                while i < L {
                    // SAFETY: the arrays have eight lanes from `i` on, and `V` exists only where the machine
                    // has been seen to have it.
                    unsafe {
                        let value = $eight($(_mm512_loadu_pd($a.as_ptr().add(i))),+);
                        _mm512_storeu_pd(result.as_mut_ptr().add(i), value);
                    }
                    i += 8;
                }
                return result;
            }
            #[cfg(target_arch = "x86_64")]
            if const { !matches!(V::ISA, Isa::Baseline) && L.is_multiple_of(4) } {
                let mut i = 0;
                while i < L {
                    // SAFETY: the same for four lanes.
                    unsafe {
                        let value = $four($(_mm256_loadu_pd($a.as_ptr().add(i))),+);
                        _mm256_storeu_pd(result.as_mut_ptr().add(i), value);
                    }
                    i += 4;
                }
                return result;
            }
            for i in 0..L {
                $(let $a = $a[i];)+
                result[i] = $lane;
            }
            result
        }
    )+};
}

lanewise! {
    add(a, b) = a + b, _mm256_add_pd, _mm512_add_pd;
    sub(a, b) = a - b, _mm256_sub_pd, _mm512_sub_pd;
    mul(a, b) = a * b, _mm256_mul_pd, _mm512_mul_pd;
    div(a, b) = a / b, _mm256_div_pd, _mm512_div_pd;
    /// `a b + c`, rounded once.
    fused(a, b, c) = a.mul_add(b, c), _mm256_fmadd_pd, _mm512_fmadd_pd;
    sqrt(a) = a.sqrt(), _mm256_sqrt_pd, _mm512_sqrt_pd;
    neg(a) = -a, |a| _mm256_xor_pd(a, _mm256_set1_pd(-0.0)), |a| _mm512_xor_pd(a, _mm512_set1_pd(-0.0));
    abs(a) = a.abs(), |a| _mm256_andnot_pd(_mm256_set1_pd(-0.0), a), |a| _mm512_abs_pd(a);
    /// `a` where it is larger, else `b`, also where either is not a number.
    max(a, b) = if a > b { a } else { b }, _mm256_max_pd, _mm512_max_pd;
    /// `a` where it is smaller, else `b`, also where either is not a number.
    min(a, b) = if a < b { a } else { b }, _mm256_min_pd, _mm512_min_pd;
    /// All bits set where `a < b`, none elsewhere.
    less(a, b) = f64::from_bits(if a < b { !0 } else { 0 }),
        |a, b| _mm256_cmp_pd::<_CMP_LT_OQ>(a, b),
        |a, b| _mm512_castsi512_pd(_mm512_movm_epi64(_mm512_cmp_pd_mask::<_CMP_LT_OQ>(a, b)));
    /// `a` where all bits of the mask are set, `b` where none is.
    select(mask, a, b) = if mask.to_bits() != 0 { a } else { b },
        |mask, a, b| _mm256_blendv_pd(b, a, mask),
        |mask, a, b| _mm512_mask_blend_pd(_mm512_movepi64_mask(_mm512_castpd_si512(mask)), b, a);
    /// Of the bits.
    and(a, b) = f64::from_bits(a.to_bits() & b.to_bits()), _mm256_and_pd, _mm512_and_pd;
    or(a, b) = f64::from_bits(a.to_bits() | b.to_bits()), _mm256_or_pd, _mm512_or_pd;
    not(a) = f64::from_bits(!a.to_bits()),
        |a| _mm256_xor_pd(a, _mm256_castsi256_pd(_mm256_set1_epi64x(-1))),
        |a| _mm512_xor_pd(a, _mm512_castsi512_pd(_mm512_set1_epi64(-1)));
}

/// A bit for every lane, the lowest for the first: whether its bits are set.
#[inline(always)]
pub fn bits<const L: usize, V: InstructionSet>(mask: &[f64; L]) -> u64 {
    #[cfg(target_arch = "x86_64")]
    if const { matches!(V::ISA, Isa::Avx512) && L.is_multiple_of(8) } {
        let mut bits = 0;
        let mut i = 0;
        while i < L {
            // SAFETY: as above.
            let own =
                unsafe { _mm512_movepi64_mask(_mm512_castpd_si512(_mm512_loadu_pd(mask.as_ptr().add(i)))) };
            bits |= u64::from(own) << i;
            i += 8;
        }
        return bits;
    }
    #[cfg(target_arch = "x86_64")]
    if const { !matches!(V::ISA, Isa::Baseline) && L.is_multiple_of(4) } {
        let mut bits = 0;
        let mut i = 0;
        while i < L {
            // SAFETY: as above.
            bits |= (unsafe { _mm256_movemask_pd(_mm256_loadu_pd(mask.as_ptr().add(i))) } as u64) << i;
            i += 4;
        }
        return bits;
    }
    let mut bits = 0;
    for i in 0..L {
        bits |= (mask[i].to_bits() >> 63) << i;
    }
    bits
}
