//! Arrays over a scalar.

/// The array `[element; D]` over a scalar `S`, where `element` may use the index.
macro_rules! vector {
    ($S:ty, $D:tt; $n:ident => $element:expr) => {{
        let mut all = [<$S as $crate::scalar::Scalar>::zero(); $D];
        $crate::unroll::unroll!($n in 0 .. $D => { all[$n] = $element; });
        all
    }};
}
pub(crate) use vector;
