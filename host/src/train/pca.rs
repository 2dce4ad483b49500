//! Principal components of the training volumes by the m × m Gram matrix, eqs. (4)-(5).
//!
//! The sums are taken over blocks of `BLOCK` voxels in f32 and over blocks in f64: plain f32 sums are
//! 15 % wrong on weak modes.

use rayon::prelude::*;

const BLOCK: usize = 8192;
/// Modes weaker than this share of the strongest one are rounding, not shape.
const WEAKEST: f64 = 1e-4;

/// Mean and whitened modes over a list of voxels.
pub struct Pca {
    /// M.
    pub mean: Vec<f32>,
    /// b'_k = s_k B_k: one standard deviation of mode k, strongest first.
    pub modes: Vec<Vec<f32>>,
    /// Share of the variance in `modes`.
    pub explained: f64,
}

/// The components of equally long volumes, at most `most` of them.
pub fn pca(volumes: &[Vec<f32>], most: usize) -> Pca {
    let m = volumes.len();
    let voxels = volumes.first().map_or(0, Vec::len);
    let mut mean = vec![0.0f32; voxels];
    mean.par_iter_mut().enumerate().for_each(|(x, value)| {
        *value = (volumes.iter().map(|v| f64::from(v[x])).sum::<f64>() / m as f64) as f32;
    });
    let eigen = nalgebra::SymmetricEigen::new(gram(volumes, &mean));
    let mut order: Vec<usize> = (0..m).collect();
    order.sort_by(|&a, &b| eigen.eigenvalues[b].total_cmp(&eigen.eigenvalues[a]));
    let strongest = order.first().map_or(0.0, |&i| eigen.eigenvalues[i]);
    let total: f64 = eigen.eigenvalues.iter().map(|v| v.max(0.0)).sum();
    let kept: Vec<usize> = order
        .into_iter()
        .take(most.min(m.saturating_sub(1)))
        .filter(|&i| eigen.eigenvalues[i] > strongest * WEAKEST * WEAKEST && eigen.eigenvalues[i] > 0.0)
        .collect();
    let explained = kept.iter().map(|&i| eigen.eigenvalues[i]).sum::<f64>() / total.max(f64::MIN_POSITIVE);
    let scale = 1.0 / (m.saturating_sub(1).max(1) as f64).sqrt();
    let modes = kept
        .par_iter()
        .map(|&k| {
            // The sign of an eigenvector is arbitrary: the largest coefficient is made positive.
            let column = eigen.eigenvectors.column(k);
            let sign = if column[column.iamax()] < 0.0 { -scale } else { scale };
            mode(volumes, &mean, &column.iter().map(|u| u * sign).collect::<Vec<_>>())
        })
        .collect();
    Pca { mean, modes, explained }
}

/// Σ_i u_i (Φ_i - M): whitened already, because the Gram matrix's eigenvectors have unit length.
fn mode(volumes: &[Vec<f32>], mean: &[f32], coefficients: &[f64]) -> Vec<f32> {
    let mut sums = vec![0.0f64; mean.len()];
    for (volume, &u) in volumes.iter().zip(coefficients) {
        for ((sum, &value), &mean) in sums.iter_mut().zip(volume).zip(mean) {
            *sum += u * (f64::from(value) - f64::from(mean));
        }
    }
    sums.into_iter().map(|s| s as f32).collect()
}

fn gram(volumes: &[Vec<f32>], mean: &[f32]) -> nalgebra::DMatrix<f64> {
    let m = volumes.len();
    let blocks = mean.len().div_ceil(BLOCK);
    let parts: Vec<Vec<f64>> = (0..blocks).into_par_iter().map(|b| gram_block(volumes, mean, b)).collect();
    let mut sums = vec![0.0; m * m];
    for part in parts {
        sums.iter_mut().zip(part).for_each(|(sum, p)| *sum += p);
    }
    nalgebra::DMatrix::from_fn(m, m, |i, j| sums[i.max(j) * m + i.min(j)])
}

fn gram_block(volumes: &[Vec<f32>], mean: &[f32], block: usize) -> Vec<f64> {
    let m = volumes.len();
    let range = block * BLOCK..((block + 1) * BLOCK).min(mean.len());
    let centred: Vec<Vec<f32>> = volumes
        .iter()
        .map(|v| v[range.clone()].iter().zip(&mean[range.clone()]).map(|(a, b)| a - b).collect())
        .collect();
    let mut sums = vec![0.0; m * m];
    for i in 0..m {
        for j in 0..=i {
            sums[i * m + j] = f64::from(dot(&centred[i], &centred[j]));
        }
    }
    sums
}

/// A dot product in eight lanes: a fixed order of summation that vectorises.
fn dot(a: &[f32], b: &[f32]) -> f32 {
    let (a8, a1) = a.as_chunks::<8>();
    let (b8, b1) = b.as_chunks::<8>();
    let mut lanes = [0.0f32; 8];
    for (a, b) in a8.iter().zip(b8) {
        for ((lane, x), y) in lanes.iter_mut().zip(a).zip(b) {
            *lane += x * y;
        }
    }
    let tail: f32 = a1.iter().zip(b1).map(|(x, y)| x * y).sum();
    lanes.iter().sum::<f32>() + tail
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn modes_of_two_shapes_are_half_their_difference_over_root_two() {
        let result = pca(&[vec![1.0, 5.0, 0.0], vec![3.0, 1.0, 0.0]], 10);
        assert_eq!(result.mean, [2.0, 3.0, 0.0]);
        assert_eq!(result.modes.len(), 1);
        let expected = [1.0f32, -2.0, 0.0].map(|x| x * std::f32::consts::SQRT_2);
        let same = |sign: f32| result.modes[0].iter().zip(expected).all(|(a, b)| (a - sign * b).abs() < 1e-5);
        assert!(same(1.0) || same(-1.0), "{:?}", result.modes[0]);
        assert!((result.explained - 1.0).abs() < 1e-9);
    }

    #[test]
    fn identical_shapes_have_no_modes() {
        assert!(pca(&[vec![1.0, 2.0], vec![1.0, 2.0], vec![1.0, 2.0]], 10).modes.is_empty());
    }
}
