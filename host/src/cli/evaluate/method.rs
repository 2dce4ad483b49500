//! Which method `lacuna evaluate` looks at.

use crate::cli::Failure;
use crate::cli::outputs::Usage;
use crate::cli::train::positive;
use crate::evaluate::{Method, Smooth, Solver};

/// A method, and single steps of it that are done otherwise.
#[derive(clap::Args)]
pub struct Switches {
    /// lacuna, or the paper's own scheme; the options below change single steps of it
    #[arg(long, default_value = "lacuna", value_parser = method)]
    method: Method,
    /// The global fit: direct, or fixed-point (eqs. 11-13)
    #[arg(long, value_parser = solver)]
    solver: Option<Solver>,
    /// What the local fit smooths: update, or field (eq. 14 as printed)
    #[arg(long, value_parser = smooth)]
    smooth: Option<Smooth>,
    /// Radius of the hyper-ellipse of eq. 3, standard deviations
    #[arg(long, value_parser = positive)]
    radius: Option<f64>,
    /// Voxels between the nodes of the weight field
    #[arg(long, value_parser = clap::value_parser!(u8).range(1..=4))]
    stride: Option<u8>,
    /// Side of the last smoothing kernel, class millimetres (the paper: 2.5 or 16.5)
    #[arg(long, value_parser = positive)]
    kernel: Option<f64>,
}

impl Switches {
    /// The method with its single switches.
    pub fn chosen(&self) -> Result<Method, Failure> {
        let base = self.method;
        let smooth = self.smooth.unwrap_or(base.smooth);
        let stride = self.stride.or(base.stride.filter(|_| smooth == base.smooth));
        if smooth == Smooth::Field && stride.is_some_and(|q| q != 1) {
            let text = "a smoothed field has a weight vector at every voxel: use --stride 1";
            return Err(Usage(text.into()).into());
        }
        Ok(Method {
            solver: self.solver.unwrap_or(base.solver),
            smooth,
            radius: self.radius.or(base.radius),
            stride,
            kernel: self.kernel.or(base.kernel),
        })
    }
}

fn method(text: &str) -> Result<Method, String> {
    match text {
        "lacuna" => Ok(Method::default()),
        "paper" => Ok(Method::PAPER),
        _ => Err("use lacuna or paper".into()),
    }
}

fn solver(text: &str) -> Result<Solver, String> {
    match text {
        "direct" => Ok(Solver::Direct),
        "fixed-point" => Ok(Solver::FixedPoint),
        _ => Err("use direct or fixed-point".into()),
    }
}

fn smooth(text: &str) -> Result<Smooth, String> {
    match text {
        "update" => Ok(Smooth::Update),
        "field" => Ok(Smooth::Field),
        _ => Err("use update or field".into()),
    }
}
