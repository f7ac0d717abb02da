//! The growth of the powers of a matrix.

use nalgebra::DMatrix;

/// Number of squarings; each halves the remaining error.
const SQUARINGS: u32 = 50;

/// The logarithm of the largest modulus of the eigenvalues of `matrix`, from the size of
/// its powers: Gelfand's formula, which needs no iteration for eigenvalues and therefore
/// always converges. Minus infinity if a power is zero.
pub(super) fn log_spectral_radius(mut matrix: DMatrix<f64>) -> f64 {
    let (mut log_radius, mut weight) = (0.0, 1.0);
    for _ in 0..SQUARINGS {
        let size = matrix.amax();
        if size == 0.0 {
            return f64::NEG_INFINITY;
        }
        log_radius += size.ln() * weight;
        matrix /= size;
        matrix = &matrix * &matrix;
        weight /= 2.0;
    }
    log_radius
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_radius_matches_the_eigenvalues() {
        let rows = |size, rows: &[f64]| DMatrix::from_row_slice(size, size, rows);
        let turn = rows(3, &[0.6, -0.8, 5.0, 0.8, 0.6, 7.0, 0.0, 0.0, 0.5]);
        assert!(log_spectral_radius(turn).abs() < 1e-13);
        let real = rows(2, &[-3.0, 100.0, 0.0, 2.0]);
        assert!((log_spectral_radius(real) - 3.0_f64.ln()).abs() < 1e-13);
        let gone = rows(3, &[0.0, 1.0, 4.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0]);
        assert_eq!(log_spectral_radius(gone), f64::NEG_INFINITY);
    }
}
