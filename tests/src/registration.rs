//! Random poses, and how far two poses of a scan are apart.

use lacuna::{Model, Pose};
use lacuna_host::mesh::{Mesh, Point, Vector};
use lacuna_host::register::Placed;
use nalgebra::{Quaternion, Rotation3, Similarity3, Translation3, UnitQuaternion};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

/// How a scan is moved before it is registered.
#[derive(Clone, Copy, Debug)]
pub struct Way {
    /// Any rotation.
    pub turn: UnitQuaternion<f64>,
    /// Its size, 1 is the class's mean.
    pub size: f64,
    /// Shift, sizes of the class.
    pub shift: Vector,
}

impl Way {
    /// Any rotation, 0.8 to 1.25 times the class's size, at most ten sizes away.
    pub fn random(random: &mut ChaCha8Rng) -> Self {
        let turn = loop {
            let [w, i, j, k] = [(); 4].map(|()| random.random_range(-1.0..1.0));
            let drawn = Quaternion::new(w, i, j, k);
            // Within the ball, so that all directions are equally likely.
            if (0.1..1.0).contains(&drawn.norm()) {
                break UnitQuaternion::from_quaternion(drawn);
            }
        };
        let size = f64::exp(random.random_range(f64::ln(0.8)..f64::ln(1.25)));
        let shift = Vector::from([(); 3].map(|()| random.random_range(-10.0..10.0)));
        Self { turn, size, shift }
    }
}

/// The scan in its new place, and the motion back. `truth` is its place in the model's voxels before.
pub fn moved(
    scan: &Mesh,
    way: &Way,
    truth: &Similarity3<f64>,
    model: &Model<'_>,
) -> (Mesh, Similarity3<f64>) {
    let spacing = f64::from(model.header().spacing);
    let scale = way.size * truth.scaling() * spacing;
    let shift = way.shift * spacing * longest(model) * way.size;
    let motion = Similarity3::from_parts(Translation3::from(shift), way.turn, scale);
    let mesh = Mesh {
        points: scan.points.iter().map(|p| motion * p).collect(),
        normals: scan.normals.iter().map(|n| way.turn * n).collect(),
        triangles: scan.triangles.clone(),
    };
    (mesh, motion)
}

fn longest(model: &Model<'_>) -> f64 {
    f64::from(model.grid().sides().into_iter().max().unwrap_or(1))
}

/// How far a pose is from another one.
#[derive(Clone, Copy, Debug)]
pub struct Difference {
    /// Degrees between their rotations.
    pub degrees: f64,
    /// Difference of their scales, a share.
    pub growth: f64,
    /// Root mean square distance that points of the mean shape move, class millimetres.
    pub millimetres: f64,
}

impl Difference {
    /// No pose was found.
    pub const NONE: Self = Self { degrees: 180.0, growth: 9.0, millimetres: 999.0 };

    /// Between two transforms of a scan to voxels.
    pub fn between(a: &Similarity3<f64>, b: &Similarity3<f64>, model: &Model<'_>) -> Self {
        let motion = a * b.inverse();
        let points = lacuna_host::register::field::Field::of_model(model).samples.points;
        let squares = points.iter().map(|p| (motion * p - p).norm_squared()).sum::<f64>();
        let voxels = (squares / points.len().max(1) as f64).sqrt();
        Self {
            degrees: motion.isometry.rotation.angle().to_degrees(),
            growth: motion.scaling() - 1.0,
            millimetres: voxels / f64::from(model.header().scales.millimetre),
        }
    }

    /// Whether both are the same optimum: the next one is more than ten degrees or fifteen millimetres away.
    pub fn same(&self) -> bool {
        self.degrees < 3.0 && self.millimetres < 5.0
    }
}

/// The frame of the training shapes comes before the model's voxels.
pub fn to_voxels(model: &Model<'_>, to_shapes: &Similarity3<f64>) -> Similarity3<f64> {
    let header = model.header();
    let origin = Translation3::from(-Vector::from(header.origin.map(f64::from)));
    Similarity3::from_scaling(1.0 / f64::from(header.spacing)) * origin * to_shapes
}

/// A pose as a similarity to voxels.
pub fn similarity_of(placed: &Placed) -> Similarity3<f64> {
    let pose = &placed.pose;
    let rotation = nalgebra::Matrix3::from_row_slice(&pose.rotation.concat()).map(f64::from);
    let turn = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix(&rotation));
    let translation = Translation3::from(Vector::from(pose.translation.map(f64::from)));
    let centred = Translation3::from(-placed.centre.coords);
    Similarity3::from_parts(translation, turn, f64::from(pose.scale)) * centred
}

/// A similarity to voxels as a pose about the point that it takes to the origin.
pub fn placed(to_voxels: &Similarity3<f64>) -> Placed {
    let centre = to_voxels.inverse() * Point::origin();
    let rotation = to_voxels.isometry.rotation.to_rotation_matrix().matrix().transpose().map(|c| c as f32);
    Placed {
        centre,
        pose: Pose { rotation: rotation.into(), scale: to_voxels.scaling() as f32, translation: [0.0; 3] },
    }
}

/// Time that all threads of this process have run, seconds; 0 where the system does not tell.
pub fn cpu_seconds() -> f64 {
    let tasks = std::fs::read_dir("/proc/self/task").into_iter().flatten().flatten();
    let run = |task: std::fs::DirEntry| {
        let text = std::fs::read_to_string(task.path().join("schedstat")).ok()?;
        text.split(' ').next()?.parse::<f64>().ok()
    };
    tasks.filter_map(run).sum::<f64>() / 1e9
}

/// Degrees and share of scale by which each motion differs from what all have in common.
pub fn deviations(motions: &[Similarity3<f64>]) -> Vec<(f64, f64)> {
    let rotation = |m: &Similarity3<f64>| m.isometry.rotation.to_rotation_matrix().into_inner();
    let svd = motions.iter().map(rotation).sum::<nalgebra::Matrix3<f64>>().svd(true, true);
    let mean = svd.u.expect("asked for") * svd.v_t.expect("asked for");
    let mean = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix(&mean));
    let growth = motions.iter().map(|m| m.scaling().ln()).sum::<f64>() / motions.len() as f64;
    let deviation = |m: &Similarity3<f64>| {
        ((mean.inverse() * m.isometry.rotation).angle().to_degrees(), (m.scaling().ln() - growth).exp() - 1.0)
    };
    motions.iter().map(deviation).collect()
}
