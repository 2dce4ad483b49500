//! Writes the results page, `.github/results`: tables and pictures, every number with its command.
//!
//! `cargo run --release -p lacuna-tests --example results`; about ten minutes on two processors with the data in
//! `../shared/data`, two without. Evaluations go on where they were stopped (`target/results`).

use lacuna::{Fixed, Model};
use lacuna_host::complete::{Completion, Options, complete, picture};
use lacuna_host::io::atomic;
use lacuna_host::quantile::median;
use lacuna_tests::nine::nine_names;
use lacuna_tests::program::json;
use lacuna_tests::sample::{Sample, heads, real};
use lacuna_tests::seam::{largest_step, steps};
use lacuna_tests::trained::training_faces;
use lacuna_tests::{model, real_data};
use serde_json::Value;
use std::fmt::Write;
use std::path::{Path, PathBuf};

/// Width and height of a picture's panel, pixels.
const PANEL: [usize; 2] = [220, 260];
const COMMAND: &str = "cargo run --release -p lacuna-tests --example results";

fn main() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let page = root.join(".github/results");
    let work = root.join("target/results");
    for folder in [&page, &work] {
        std::fs::create_dir_all(folder).expect("a folder");
    }
    let mut text = format!(
        "# Results\n\nMade by `{COMMAND}`; not written by hand. Distances are root mean squares in millimetres from \
         the vertices of the true surface to the completed one, apart for what the scanner saw and what it did not. \
         Steps are measured at the seam between the measured and the inferred part: the largest, and what 99 % do \
         not exceed.\n\n## Heads, the built-in class\n\n"
    );
    let built_in = model();
    let samples: Vec<Sample> = heads(1001..=1006).collect();
    text += "```sh\nlacuna synth scan scan --head 1001 --view front --small\nlacuna complete scan/mesh.ply\n```\n\n";
    text += &scans(&built_in, &samples, &page, "head 1001 Front");
    text += &synthetic_evaluation(&work, &page);
    if let (Some(faces), Some(scans), Some(femurs)) =
        (real_data("faces"), real_data("scans"), real_data("femurs"))
    {
        text += &shared(&faces, &scans, &femurs, &work, &page);
    }
    save(&page.join("README.md"), text.as_bytes());
}

fn save(path: &Path, bytes: &[u8]) {
    atomic::write(path, |file| file.write_all(bytes)).expect("the page can be written");
}

fn completed(model: &Model<'_>, sample: &Sample) -> Completion {
    let options = Options::of(model);
    complete::<Fixed>(model, &sample.scan, &options)
        .unwrap_or_else(|error| panic!("{}: {error}", sample.name))
}

/// A table with a row a scan and their median; a picture of the scan called `shown`.
fn scans(model: &Model<'_>, samples: &[Sample], page: &Path, shown: &str) -> String {
    let mut out = String::from(
        "| scan | verdict | pose, degrees | seen | missing | seam: largest | 99 % |\n|---|---|---|---|---|---|---|\n",
    );
    let mut columns: [Vec<f64>; 5] = Default::default();
    for sample in samples {
        let completion = completed(model, sample);
        let merged = &completion.merged;
        let rms = |missing| sample.rms_mm(&merged.mesh, |i| sample.missing[i] == missing);
        let voxel = 1.0 / f64::from(completion.placed.pose.scale);
        let mut all = steps(merged, voxel);
        all.sort_by(f64::total_cmp);
        let p99 = all.get(all.len() * 99 / 100).copied().unwrap_or(0.0);
        let numbers =
            [sample.degrees_off(&completion.placed), rms(false), rms(true), largest_step(merged, voxel), p99];
        columns.iter_mut().zip(numbers).for_each(|(column, number)| column.push(number));
        let grade = format!("{:?}", completion.verdict.grade).to_lowercase();
        let _ = writeln!(out, "| {} | {grade} | {} |", sample.name, row(&numbers));
        if sample.name == shown {
            let name = format!("{}.png", shown.to_lowercase().replace(' ', "-"));
            let png = picture::draw(&completion, PANEL[0], PANEL[1]).png_small().expect("a picture");
            save(&page.join(&name), &png);
        }
    }
    if samples.len() > 2 {
        let _ = writeln!(
            out,
            "| **median** | | {} |",
            row(&columns.map(|column| median(column).unwrap_or(f64::NAN)))
        );
    }
    out + &format!("\n![{shown}: scan, fits, completed]({}.png)\n\n", shown.to_lowercase().replace(' ', "-"))
}

fn row(numbers: &[f64]) -> String {
    numbers.iter().map(|n| format!("{n:.2}")).collect::<Vec<_>>().join(" | ")
}

/// Runs `lacuna evaluate` and shows its figure and its medians.
fn evaluation(work: &Path, page: &Path, name: &str, arguments: &[&str], shown: &str) -> String {
    let mut all = vec!["evaluate", "--json", "-o", name];
    all.extend_from_slice(arguments);
    let result = json(work, &all);
    let figure = std::fs::read(work.join(name).join("figure2.svg")).expect("the figure");
    save(&page.join(format!("{name}.svg")), &figure);
    let mut out = format!(
        "```sh\n{shown}\n```\n\nMedian rms [quartiles]:\n\n| shapes | local | global | eq. (9) | correspondence | floor |\n|---|---|---|---|---|---|\n"
    );
    let counts = result["counts"].as_object().expect("counts");
    let mut sorted: Vec<(&String, &Value)> = counts.iter().collect();
    sorted.sort_by_key(|(count, _)| count.parse::<u32>().unwrap_or(0));
    for (count, models) in sorted {
        let cell = |model: &str| {
            let rms = &models[model]["rms"];
            let number = |key: &str| rms[key].as_f64();
            match [number("median"), number("q1"), number("q3")] {
                [Some(m), Some(a), Some(b)] => format!("{m:.3} [{a:.3} {b:.3}]"),
                _ => "-".into(),
            }
        };
        let cells = ["local", "global", "eq9", "correspondence", "floor"].map(cell);
        let _ = writeln!(out, "| {count} | {} |", cells.join(" | "));
    }
    out + &format!("\n![Boxplots over the number of training shapes]({name}.svg)\n\n")
}

fn synthetic_evaluation(work: &Path, page: &Path) -> String {
    let folders = [("heads", "1", "40"), ("others", "2", "6")];
    for (folder, seed, count) in folders {
        json(work, &["synth", "heads", folder, "--seed", seed, "--count", count, "--json"]);
    }
    let arguments = [
        "--train",
        "heads",
        "--targets",
        "others",
        "--counts",
        "10,20,40",
        "--spacing",
        "3.3",
        "--draws",
        "1",
    ];
    let command = "lacuna synth heads heads --seed 1 --count 40\nlacuna synth heads others --seed 2 --count 6\nlacuna evaluate --train heads --targets others --counts 10,20,40 --spacing 3.3 --draws 1";
    format!(
        "Complete heads of another seed:\n\n{}",
        evaluation(work, page, "heads-evaluation", &arguments, command)
    )
}

fn shared(faces: &Path, folder: &Path, femurs: &Path, work: &Path, page: &Path) -> String {
    let mut out = String::from(
        "## Faces and femurs that are not part of this repository\n\nFaces: samples of the ICT FaceKit (ICT-VGL, MIT). \
         Femurs: Melbourne Femur Collection, CT segmentations from the GIAS2 tutorial (MPL-2.0). Scans of them are \
         simulated structured light. Expected at `../shared/data`.\n\n",
    );
    let absolute = |path: PathBuf| std::fs::canonicalize(path).expect("a path").display().to_string();
    let train: Vec<String> = training_faces(&faces.join("train"), 0..30).into_iter().map(absolute).collect();
    let mut arguments: Vec<&str> = vec!["train", "--json", "-o", "face.lacuna", "--spacing", "3.3"];
    arguments.extend(train.iter().map(String::as_str));
    json(work, &arguments);
    out += "```sh\nlacuna train ../shared/data/faces/train/train_0[0-2]*.ply -o face.lacuna --spacing 3.3\nlacuna complete ../shared/data/scans/target_00_front/mesh.ply --model face.lacuna -o done.ply\npython3 ../shared/score.py scan ../shared/data/scans/target_00_front done.ply\n```\n\n";
    let samples: Vec<Sample> = nine_names().map(|name| real(&folder.join(name))).collect();
    out += &by_model(&work.join("face.lacuna"), &samples, page, "target_00_side");
    let [train, targets] = ["train", "targets"].map(|place| absolute(faces.join(place)));
    let arguments = ["--train", &train, "--targets", &targets, "--spacing", "3.3", "--draws", "1"];
    let command = "lacuna evaluate --train ../shared/data/faces/train --targets ../shared/data/faces/targets --spacing 3.3 --draws 1";
    out += &format!("Complete faces:\n\n{}", evaluation(work, page, "faces-evaluation", &arguments, command));
    let bones: Vec<String> = (0..8).map(|i| absolute(femurs.join(format!("train_{i:02}.ply")))).collect();
    let mut arguments: Vec<&str> = vec!["train", "--json", "-o", "femur.lacuna"];
    arguments.extend(bones.iter().map(String::as_str));
    json(work, &arguments);
    out += "```sh\nlacuna train ../shared/data/femurs/train_0*.ply -o femur.lacuna\nlacuna complete ../shared/data/scans/femur_target_00_side/mesh.ply --model femur.lacuna -o done.ply\n```\n\n";
    let names = ["femur_target_00_side", "femur_target_01_fragment"];
    out + &by_model(&work.join("femur.lacuna"), &names.map(|name| real(&folder.join(name))), page, names[0])
}

fn by_model(path: &Path, samples: &[Sample], page: &Path, shown: &str) -> String {
    let bytes = std::fs::read(path).expect("the model");
    scans(&Model::from_bytes(&bytes).expect("the model"), samples, page, shown)
}
