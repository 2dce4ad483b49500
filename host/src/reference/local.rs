//! The local fit, eqs. (6) and (14)-(16), in the form that converges: the definition the core implements.
//!
//! ```text
//! d_j  = Σ_n φ_jn W_n Σ_k g_k b'_kn²
//! e_n  = M_n + Σ_k b'_kn (Σ_j φ_jn V_kj) - t_n                        eq. (15)
//! G_kj = Σ_n φ_jn W_n e_n b'_kn                                       eq. (16)
//! U_kj = B( B(G)_kj / (B(d)_j + λ + δ q³) )
//! V   <- clamp( V + β (V - V_prev) - μ g_k U_kj, ±16 )                eq. (14), descending
//! ```
//!
//! n runs over the hull, where W is 1 (all of it near the surface, one voxel in four elsewhere; half of these where the
//! kernel is wider than a node), j over the nodes; all V start at the global weights.

use super::nodes::Nodes;
use super::{Hull, Model};

/// Largest weight, standard deviations.
const LIMIT: f64 = 16.0;

/// Iterations at one kernel radius.
#[derive(Clone, Debug, PartialEq)]
pub struct Pass {
    /// Radius of the box kernel, nodes.
    pub radius: usize,
    /// μ of each iteration.
    pub steps: Vec<f64>,
    /// One in how many of the modes move, the strongest ones.
    pub part: usize,
}

/// What can be chosen.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// q: voxels between nodes; divides the sides of the grid.
    pub stride: usize,
    /// β.
    pub momentum: f64,
    /// λ, voxel².
    pub ridge: f64,
    /// δ, voxel²: times q³.
    pub voxel_ridge: f64,
    /// Passes, widest kernel first.
    pub passes: Vec<Pass>,
}

/// A field of weights, eq. (6).
#[derive(Clone, Debug)]
pub struct Field {
    /// Where the weights stand.
    pub nodes: Nodes,
    /// V_kj: weights in standard deviations, for each mode one a node; zero at inactive nodes.
    pub weights: Vec<Vec<f64>>,
}

impl Field {
    fn constant(nodes: Nodes, sigmas: &[f64]) -> Self {
        let one =
            |&v: &f64| nodes.active.iter().map(|&a| if a { v.clamp(-LIMIT, LIMIT) } else { 0.0 }).collect();
        let weights = sigmas.iter().map(one).collect();
        Self { nodes, weights }
    }

    /// Φ(w(x)), eq. (6), at every voxel of the mask; 0 elsewhere.
    pub fn distances(&self, model: &Model) -> Vec<f64> {
        let whitened = model.whitened();
        let value = |n: usize| if model.mask[n] { self.distance(model, &whitened, n) } else { 0.0 };
        (0..model.grid.len()).map(value).collect()
    }

    /// M_n + Σ_k b'_kn Σ_j φ_jn V_kj.
    fn distance(&self, model: &Model, whitened: &[Vec<f64>], n: usize) -> f64 {
        let near = self.nodes.trilinear(model.grid.position(n));
        let weight = |field: &Vec<f64>| near.iter().map(|&(j, phi)| phi * field[j]).sum::<f64>();
        model.mean[n] + whitened.iter().zip(&self.weights).map(|(mode, v)| mode[n] * weight(v)).sum::<f64>()
    }
}

/// The fit's constants and intermediate results.
struct Fit<'a> {
    model: &'a Model,
    whitened: Vec<Vec<f64>>,
    gains: Vec<f64>,
    /// Voxels in the hull with their distances.
    known: Vec<(usize, f64)>,
}

/// Fits a field of weights to a hull, from the global weights `start` (standard deviations).
pub fn local(model: &Model, hull: &Hull, start: &[f64], settings: &Settings) -> Field {
    let mut fit = Fit { model, whitened: model.whitened(), gains: model.gains(), known: Vec::new() };
    let mut field = Field::constant(Nodes::new(model, settings.stride), start);
    let mut previous = field.weights.clone();
    for pass in &settings.passes {
        let known = (0..hull.len()).filter(|&n| model.mask[n]).filter_map(|n| Some((n, hull[n]?)));
        let taken = |&(n, distance): &(usize, f64)| {
            is_taken(model.grid.position(n), distance, settings.stride, pass.radius)
        };
        fit.known = known.filter(taken).collect();
        let curvature = fit.curvature(&field.nodes);
        let denominator = fit.denominator(&field.nodes, &curvature, settings, pass.radius);
        for &step in &pass.steps {
            let gradient = fit.gradient(&field);
            let before = field.weights.clone();
            for (k, gradient) in gradient.iter().enumerate().take(gradient.len().div_ceil(pass.part)) {
                let update = smoothed_ratio(&field.nodes, gradient, &denominator, pass.radius);
                let gain = step * fit.gains[k];
                let changes = field.weights[k].iter_mut().zip(&previous[k]).zip(update);
                for ((v, old), u) in changes {
                    *v = (*v + settings.momentum * (*v - old) - gain * u).clamp(-LIMIT, LIMIT);
                }
            }
            previous = before;
        }
    }
    field
}

/// Whether a voxel of the hull is taken, `distance` in voxels: near the surface, or one of four; every other one of
/// these for a kernel of several nodes.
fn is_taken([x, y, z]: [usize; 3], distance: f64, stride: usize, radius: usize) -> bool {
    let near = distance > -0.75 && distance < 0.625;
    stride == 1 || ((near || (x % 2 == 0 && (y + z) % 2 == 0)) && (radius == 0 || (x + y + z) % 2 == 0))
}

/// U = B( B(G) / denominator ), at active nodes.
fn smoothed_ratio(nodes: &Nodes, gradient: &[f64], denominator: &[f64], radius: usize) -> Vec<f64> {
    let boxed = nodes.box_mean(gradient, radius);
    let ratio: Vec<f64> = boxed.iter().zip(denominator).map(|(g, d)| g / d).collect();
    nodes.box_mean(&ratio, radius)
}

impl Fit<'_> {
    /// d_j.
    fn curvature(&self, nodes: &Nodes) -> Vec<f64> {
        let mut sums = vec![0.0; nodes.grid.len()];
        for &(n, _) in &self.known {
            let square: f64 =
                self.whitened.iter().zip(&self.gains).map(|(mode, g)| g * mode[n] * mode[n]).sum();
            for (j, phi) in nodes.trilinear(self.model.grid.position(n)) {
                sums[j] += phi * square;
            }
        }
        sums
    }

    /// B(d) + λ + δ q³.
    fn denominator(&self, nodes: &Nodes, curvature: &[f64], settings: &Settings, radius: usize) -> Vec<f64> {
        let ridge = settings.ridge + settings.voxel_ridge * settings.stride.pow(3) as f64;
        nodes.box_mean(curvature, radius).into_iter().map(|d| d + ridge).collect()
    }

    /// G_kj.
    fn gradient(&self, field: &Field) -> Vec<Vec<f64>> {
        let mut sums = vec![vec![0.0; field.nodes.grid.len()]; self.whitened.len()];
        for &(n, target) in &self.known {
            let residual = field.distance(self.model, &self.whitened, n) - target;
            let near = field.nodes.trilinear(self.model.grid.position(n));
            for (sum, mode) in sums.iter_mut().zip(&self.whitened) {
                for (j, phi) in near {
                    sum[j] += phi * residual * mode[n];
                }
            }
        }
        sums
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reference::{global, toy};

    fn settings(radius: usize, steps: usize, mu: f64) -> Settings {
        let passes = vec![Pass { radius, steps: vec![mu; steps], part: 1 }];
        Settings { stride: 2, momentum: 0.0, ridge: 0.05, voxel_ridge: 1e-3, passes }
    }

    fn rms(model: &Model, field: &Field, hull: &Hull) -> f64 {
        let distances = field.distances(model);
        let errors: Vec<f64> = distances.iter().zip(hull).filter_map(|(d, t)| Some(d - (*t)?)).collect();
        (errors.iter().map(|e| e * e).sum::<f64>() / errors.len() as f64).sqrt()
    }

    #[test]
    fn a_kernel_over_everything_is_gradient_descent_on_one_weight_vector() {
        let model = toy::model();
        let hull = toy::hull(&model, &model.synthesise(&toy::weights(&model)), 1.5);
        let s = settings(6, 7, 15.0);
        let field = local(&model, &hull, &vec![0.2; model.modes()], &s);

        let (whitened, gains) = (model.whitened(), model.gains());
        let taken = |&n: &usize| hull[n].is_some_and(|d| is_taken(model.grid.position(n), d, 2, 6));
        let known: Vec<usize> = (0..hull.len()).filter(taken).collect();
        let nodes = field.nodes.active.iter().filter(|&&a| a).count() as f64;
        let volume = 13f64.powi(3);
        let square = |n: usize| whitened.iter().zip(&gains).map(|(b, g)| g * b[n] * b[n]).sum::<f64>();
        let curvature: f64 = known.iter().map(|&n| square(n)).sum();
        let denominator = curvature / volume + s.ridge + s.voxel_ridge * 8.0;
        let mut v = vec![0.2; model.modes()];
        for _ in 0..7 {
            let made = model.synthesise(&v);
            for (k, weight) in v.iter_mut().enumerate() {
                let slope: f64 = known.iter().map(|&n| (made[n] - hull[n].unwrap()) * whitened[k][n]).sum();
                *weight -= 15.0 * gains[k] * (slope / volume / denominator) * nodes / volume;
            }
        }
        let same = |k: usize, j: usize| (field.weights[k][j] - v[k]).abs() < 1e-9;
        let active = |j: &usize| field.nodes.active[*j];
        assert!((0..v.len()).all(|k| (0..field.nodes.grid.len()).filter(active).all(|j| same(k, j))));
        assert!(v.iter().any(|w| (w - 0.2).abs() > 0.05), "it moved: {v:?}");
    }

    #[test]
    fn the_true_weights_stay_where_they_are() {
        let model = toy::model();
        let truth = toy::weights(&model);
        let hull = toy::hull(&model, &model.synthesise(&truth), 1.5);
        let field = local(&model, &hull, &truth, &settings(1, 5, 1.0));
        let active =
            |k: usize, j: usize| !field.nodes.active[j] || (field.weights[k][j] - truth[k]).abs() < 1e-9;
        assert!((0..truth.len()).all(|k| (0..field.nodes.grid.len()).all(|j| active(k, j))));
    }

    #[test]
    fn it_follows_what_no_global_weights_explain() {
        let model = toy::model();
        let mut volume = model.synthesise(&toy::weights(&model));
        let bump = |n: usize| 0.3 * (toy::GRID.position(n)[0] as f64 - 3.5).tanh();
        volume.iter_mut().enumerate().for_each(|(n, v)| *v += bump(n));
        let hull = toy::hull(&model, &volume, 1.5);
        let start = global::direct(&model, &hull, 1e-3);
        let mut s = settings(1, 0, 1.0);
        let before = rms(&model, &local(&model, &hull, &start, &s), &hull);
        s.passes = vec![
            Pass { radius: 1, steps: vec![1.0; 10], part: 1 },
            Pass { radius: 0, steps: vec![1.0; 100], part: 1 },
        ];
        let plain = rms(&model, &local(&model, &hull, &start, &s), &hull);
        assert!(plain < 0.4 * before, "{before} to {plain}");
        s.momentum = 0.7;
        let faster = rms(&model, &local(&model, &hull, &start, &s), &hull);
        assert!(faster < plain, "{plain} to {faster}");
    }
}
