//! How training shapes in any pose are aligned: `cargo run --release -p lacuna-tests --example alignment`.
//!
//! The ten faces of `../shared/data/faces/train_unaligned` are aligned and compared with `transforms.json`, and with
//! what the same ten faces give whose vertices correspond: generalised Procrustes analysis. A common
//! similarity is taken out. The truth is the frame in which the faces were made, where large faces are large: no
//! alignment can know that, Procrustes is as near as one can come.

use lacuna_host::io;
use lacuna_host::mesh::{Mesh, Point};
use lacuna_host::register::umeyama::similarity;
use lacuna_host::train::align::{Align, align};
use lacuna_tests::real_data;
use lacuna_tests::registration::deviations;
use nalgebra::{Matrix4, Similarity3};
use std::path::Path;
use std::time::Instant;

fn main() {
    let Some(faces) = real_data("faces") else { return };
    let unaligned = faces.join("train_unaligned");
    let mut paths: Vec<_> =
        std::fs::read_dir(&unaligned).expect("the folder").flatten().map(|e| e.path()).collect();
    paths.retain(|path| path.extension().is_some_and(|e| e == "ply"));
    paths.sort();
    let shapes: Vec<Mesh> = paths.iter().map(|path| io::read(path).expect("a face")).collect();
    let truth: Vec<Similarity3<f64>> = paths.iter().map(|path| made_by(&unaligned, path)).collect();
    let name = |path: &Path| path.file_name().expect("a file").to_string_lossy().into_owned();
    let made: Vec<Mesh> =
        paths.iter().map(|path| io::read(&faces.join("train").join(name(path))).expect("a face")).collect();
    let procrustes = procrustes(&made);
    let start = Instant::now();
    let found = align(&shapes, Align::Auto, 1, &|_, _| ()).expect("aligned").motions;
    println!("aligned in {:.1} s\n", start.elapsed().as_secs_f64());
    let found: Vec<Similarity3<f64>> = found.iter().zip(&truth).map(|(found, made)| found * made).collect();
    let to_procrustes: Vec<Similarity3<f64>> =
        found.iter().zip(&procrustes).map(|(f, p)| f * p.inverse()).collect();
    println!(
        "| face | truth: degrees, scale % | Procrustes: degrees, scale % | Procrustes to truth |\n|---|---|---|---|"
    );
    let columns = [deviations(&found), deviations(&to_procrustes), deviations(&procrustes)];
    let cell = |(degrees, growth): (f64, f64)| format!("{degrees:.2}, {:+.2}", 100.0 * growth);
    for (i, path) in paths.iter().enumerate() {
        let [a, b, c] = columns.each_ref().map(|column| cell(column[i]));
        println!("| {} | {a} | {b} | {c} |", name(path));
    }
    let worst = |column: &Vec<(f64, f64)>| {
        cell(column.iter().fold((0.0, 0.0), |(d, g), &(x, y)| (f64::max(d, x), f64::max(g, y.abs()))))
    };
    let [a, b, c] = columns.each_ref().map(worst);
    println!("| worst | {a} | {b} | {c} |");
}

/// From the frame in which a face was made to that of its file.
fn made_by(folder: &Path, path: &Path) -> Similarity3<f64> {
    let text = std::fs::read_to_string(folder.join("transforms.json")).expect("transforms.json");
    let all: serde_json::Value = serde_json::from_str(&text).expect("JSON");
    let name = path.file_name().expect("a file").to_string_lossy().into_owned();
    let rows: [[f64; 4]; 4] = serde_json::from_value(all["transforms"][&name]["model_to_unaligned"].clone())
        .expect("a 4 x 4 matrix");
    nalgebra::try_convert(Matrix4::from_fn(|i, j| rows[i][j]))
        .unwrap_or_else(|| nalgebra::convert_unchecked(Matrix4::from_fn(|i, j| rows[i][j])))
}

/// From each shape, whose vertices correspond, to their common frame.
fn procrustes(shapes: &[Mesh]) -> Vec<Similarity3<f64>> {
    let mut motions = vec![Similarity3::identity(); shapes.len()];
    for _ in 0..50 {
        let mean: Vec<Point> = (0..shapes[0].points.len())
            .map(|v| {
                let moved =
                    shapes.iter().zip(&motions).map(|(shape, motion)| (motion * shape.points[v]).coords);
                Point::from(moved.sum::<lacuna_host::mesh::Vector>() / shapes.len() as f64)
            })
            .collect();
        let to_mean = |shape: &Mesh| {
            let pairs: Vec<(Point, Point)> = shape.points.iter().copied().zip(mean.iter().copied()).collect();
            similarity(&pairs).expect("a similarity")
        };
        motions = shapes.iter().map(to_mean).collect();
    }
    motions
}
