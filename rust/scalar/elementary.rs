//! The elementary functions, the same bits for every width and instruction set.

use super::Real;

pub fn exp<R: Real>(x: R) -> R {
    x.each(f64::exp)
}
pub fn ln<R: Real>(x: R) -> R {
    x.each(f64::ln)
}
pub fn sin_cos<R: Real>(x: R) -> (R, R) {
    (x.each(f64::sin), x.each(f64::cos))
}
pub fn tanh<R: Real>(x: R) -> R {
    x.each(f64::tanh)
}
