//! The inverse of a small square matrix.

use nalgebra::DMatrixViewMut;

/// Invert a square matrix, given by its columns, in place; return false if it is singular.
///
/// nalgebra's inverse contains the formulas of all sizes up to four for each type of matrix. They are long: all callers
/// share one copy. A singular matrix of more than four rows is overwritten.
pub(crate) fn invert(numbers: &mut [f64], size: usize) -> bool {
    DMatrixViewMut::from_slice(numbers, size, size).try_inverse_mut()
}

#[cfg(test)]
mod tests {
    use super::invert;

    #[test]
    fn a_matrix_times_its_inverse_is_the_identity() {
        for size in 1..=6 {
            let mut matrix: Vec<f64> = (0..size * size).map(|i| (i as f64 * 1.618).sin()).collect();
            (0..size).for_each(|i| matrix[i * size + i] += 3.0);
            let mut inverse = matrix.clone();
            assert!(invert(&mut inverse, size));
            for row in 0..size {
                for column in 0..size {
                    let terms = (0..size).map(|k| matrix[k * size + row] * inverse[column * size + k]);
                    let (product, expected) = (terms.sum::<f64>(), f64::from(u8::from(row == column)));
                    assert!((product - expected).abs() < 1e-13, "size {size}: {product} at {row}, {column}");
                }
            }
        }
    }

    #[test]
    fn a_matrix_of_zeros_has_no_inverse() {
        for size in 1..=6 {
            assert!(!invert(&mut vec![0.0; size * size], size), "size {size}");
        }
    }
}
