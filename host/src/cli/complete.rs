//! `lacuna complete`.

use super::completed::{Clutter, Completed, ExpectedError, OnDevice};
use super::inputs::{self, Subject};
use super::outputs::{self, Output};
use super::{Common, Failure, bar, say};
use crate::check::alternatives::{self, DOUBTFUL};
use crate::complete::merge::MEASURED;
use crate::complete::verdict::Grade;
use crate::complete::{
    self, Completion, GivenPose, Options, Start, complete_by, depth_rows, fit_here, picture, zero_level,
};
use crate::fit::Fit;
use crate::io::{self, COMPLETED, PlyOut};
use crate::mesh::Mesh;
use crate::{render, report, unit};
use lacuna::{Fixed, Model, Schedule};
use std::path::PathBuf;

/// Complete a scan: without arguments, the example scan with the built-in model.
#[derive(clap::Args)]
pub struct Complete {
    #[command(flatten)]
    subject: Subject,
    /// Where the completed mesh goes
    #[arg(short, long, default_value = "completed.ply")]
    output: PathBuf,
    /// Where the picture goes [default: beside the mesh, as .png]
    #[arg(short, long)]
    picture: Option<PathBuf>,
    /// Draw no picture
    #[arg(long, conflicts_with = "picture")]
    no_picture: bool,
    /// Also write a report to look at, one HTML file named after the output, into this folder
    #[arg(long, value_name = "DIR")]
    report: Option<PathBuf>,
    /// Also write the pure model surface of the local fit
    #[arg(long, value_name = "PLY")]
    local_surface: Option<PathBuf>,
    /// Also write the pure model surface of the global fit
    #[arg(long, value_name = "PLY")]
    global_surface: Option<PathBuf>,
    /// The exact pose, in the frame of the training shapes: `identity`, or a JSON file with the 4 x 4 matrix from scan to
    /// model. A model that keeps how its shapes lay (`train --align never`) holds it; of one whose shapes were drawn to
    /// their mean it may move by as much as they were
    #[arg(long, value_name = "POSE")]
    pose: Option<String>,
    /// A rough pose, refined from there: as for --pose
    #[arg(long, value_name = "POSE", conflicts_with = "pose")]
    pose_hint: Option<String>,
    /// How much finer than the model's grid the surface is extracted, 1 to 4
    #[arg(long, default_value_t = 2, value_parser = clap::value_parser!(u8).range(1..=4))]
    finer: u8,
    /// Keep what is not part of the class (hair, collar, table) in the mesh: separate pieces with label 2
    #[arg(long)]
    keep_clutter: bool,
    /// Leave the scan's points where they are, with their noise
    #[arg(long)]
    keep_noise: bool,
    /// Take the points from the depth image itself, row by row, as a scanner sends them: one view, a depth PNG or a
    /// scan.json with one
    #[arg(long)]
    depth_rows: bool,
    /// Keep the previous weights for a heavy-ball term instead of varying the step lengths (a device needs memory for them)
    #[arg(long)]
    momentum: bool,
}

impl Complete {
    /// Runs the subcommand.
    pub fn run(&self, common: &Common) -> Result<(), Failure> {
        let progress = bar(1, "completing");
        progress.tick();
        self.run_by(common, |model, start, options| {
            let fit = fit_here::<Fixed>(model, start, options.schedule);
            progress.finish_and_clear();
            Ok((fit?, None))
        })
    }

    /// Runs the subcommand with a fit made by `fit`, here, or on a device of which it tells.
    pub fn run_by(
        &self,
        common: &Common,
        fit: impl FnOnce(&Model<'_>, &Start, &Options<'_>) -> Result<(Fit, Option<OnDevice>), complete::Error>
        + Send,
    ) -> Result<(), Failure> {
        let bytes = self.subject.model_bytes()?;
        let model = self.subject.model(&bytes)?;
        let factor = self.subject.factor(&model);
        self.check_outputs()?;
        self.check_finer(&model)?;
        let (scan, mut notes) = self.subject.mesh(&model)?;
        notes.extend(self.without_picture());
        let start = std::time::Instant::now();
        let options = self.options(&model)?;
        let image = if self.depth_rows { Some(self.subject.depth_image(&model)?) } else { None };
        let begin = |scan: &Mesh| match &image {
            Some(image) => depth_rows::start(&model, scan, image, &options),
            None => complete::start(&model, scan, &options),
        };
        let mut device = None;
        let fit = |start: &Start| {
            let (fit, told) = fit(&model, start, &options)?;
            device = told;
            Ok(fit)
        };
        let mut completion = complete_by(&model, &scan, &options, begin, fit)
            .map_err(|error| self.told(&model, &scan, &error))?;
        let seconds = start.elapsed().as_secs_f64();
        self.advise(&model, &mut completion);
        self.write(&completion, &model, factor)?;
        self.write_report(&completion, &model, &scan, &notes)?;
        self.tell(common, &completion, &model, (seconds, notes, device))
    }

    /// Why a scan cannot be completed, and what would make it fit.
    fn told(&self, model: &Model<'_>, scan: &Mesh, error: &complete::Error) -> Failure {
        self.subject.named(&alternatives::told(model, scan, self.subject.seed, error))
    }

    /// After a pose that explains little: what would make the scan fit.
    fn advise(&self, model: &Model<'_>, completion: &mut Completion) {
        let verdict = &mut completion.verdict;
        let explained = verdict.evidence.explained().near();
        let given = [("--pose", &self.pose), ("--pose-hint", &self.pose_hint)];
        let given = given.into_iter().find(|(_, pose)| pose.is_some());
        if let Some((option, _)) = given.filter(|_| verdict.grade == Grade::Reject && explained < DOUBTFUL) {
            let told = format!("the pose was given: is {option} right? Without it one is searched for");
            verdict.reasons.insert(0, told);
        }
        if verdict.grade == Grade::Reject && given.is_none() {
            verdict.reasons.extend(alternatives::advice(
                model,
                &completion.scan,
                self.subject.seed,
                (explained, verdict.evidence.scale),
            ));
        }
    }

    fn options(&self, model: &Model<'_>) -> Result<Options<'static>, Failure> {
        let factor = self.subject.factor(model);
        let pose = match (&self.pose, &self.pose_hint) {
            (Some(pose), _) => GivenPose::Exact(inputs::pose(pose, model, factor)?),
            (None, Some(pose)) => GivenPose::Rough(inputs::pose(pose, model, factor)?),
            (None, None) => GivenPose::None,
        };
        let schedule = if self.momentum { Schedule::with_momentum(model) } else { Schedule::of(model) };
        let (finer, keep_noise) = (usize::from(self.finer), self.keep_noise);
        Ok(Options { pose, seed: self.subject.seed, schedule, finer, keep_noise })
    }

    /// Refuses a surface so fine that it needs more memory than allowed.
    fn check_finer(&self, model: &Model<'_>) -> Result<(), Failure> {
        let needed = zero_level::memory(model.grid().sides(), usize::from(self.finer));
        let limit = io::limit::get();
        if needed <= limit {
            return Ok(());
        }
        Err(format!(
            "a surface {} times as fine as the model's grid may need {needed} bytes of memory, --max-memory allows \
             {limit}; lower --finer, or allow more",
            self.finer
        )
        .into())
    }

    /// Finds outputs that cannot be written, or that would overwrite something, before any work is done, so that none is
    /// written without the others.
    fn check_outputs(&self) -> Result<(), Failure> {
        let picture = self.picture_path();
        let files = [
            ("--output", Some(&self.output), "ply"),
            ("--picture", picture.as_ref(), "png"),
            ("--local-surface", self.local_surface.as_ref(), "ply"),
            ("--global-surface", self.global_surface.as_ref(), "ply"),
        ];
        let files = files.into_iter().filter_map(|(option, path, format)| Some((option, path?, format)));
        let files: Vec<Output<'_>> =
            files.map(|(option, path, format)| Output { option, path, format }).collect();
        let mut read = self.subject.files();
        read.extend(self.pose.iter().chain(&self.pose_hint).map(PathBuf::from));
        outputs::check(&read, &files)?;
        self.report_path().map_or(Ok(()), |path| inputs::check_report(&path))
    }

    /// What is told where no picture is drawn, because nobody named one and something else's is there.
    fn without_picture(&self) -> Option<String> {
        let path = self.beside().filter(|_| self.picture.is_none())?;
        let text =
            format!("no picture: {} may be something else's; --picture names another one", path.display());
        (!outputs::is_own(&path, render::MARK)).then_some(text)
    }

    fn report_path(&self) -> Option<PathBuf> {
        let name = self.output.file_stem().unwrap_or("completed".as_ref());
        self.report.as_ref().map(|folder| folder.join(format!("{}.html", name.display())))
    }

    fn picture_path(&self) -> Option<PathBuf> {
        let named = || self.picture.clone();
        let beside = || self.beside().filter(|path| outputs::is_own(path, render::MARK));
        if self.no_picture { None } else { named().or_else(beside) }
    }

    /// Where a picture goes that nobody named; beside a device there is no place for one.
    fn beside(&self) -> Option<PathBuf> {
        let somewhere = self.output.is_file() || !self.output.exists();
        (somewhere && !self.no_picture).then(|| self.output.with_extension("png"))
    }

    fn write(&self, completion: &Completion, model: &Model<'_>, factor: f64) -> Result<(), Failure> {
        self.write_completed(completion, model, factor)?;
        for (path, mesh) in
            [(&self.local_surface, &completion.local), (&self.global_surface, &completion.global)]
        {
            if let Some(path) = path {
                io::write_ply(path, &PlyOut::new(&back(mesh, factor)))?;
            }
        }
        if let Some(path) = self.picture_path() {
            let png = picture::draw(completion, 480, 560).png()?;
            io::atomic::write(&path, |file| file.write_all(&png))?;
        }
        Ok(())
    }

    /// The completed mesh with labels, colours, distances and expected errors.
    fn write_completed(
        &self,
        completion: &Completion,
        model: &Model<'_>,
        factor: f64,
    ) -> Result<(), Failure> {
        let merged = if self.keep_clutter {
            &completion.clutter.append_to(&completion.merged)
        } else {
            &completion.merged
        };
        let mesh = back(&merged.mesh, factor);
        let colours = picture::colours(&merged.labels);
        let distances: Vec<f32> = merged.distances.iter().map(|d| d / factor as f32).collect();
        let mut expected: Vec<f32> = completion.expected.errors.iter().map(|e| e / factor as f32).collect();
        if !expected.is_empty() {
            // What is kept of the clutter is as good as the scan.
            expected.resize(merged.mesh.points.len(), completion.expected.noise / factor as f32);
        }
        let mut out = PlyOut::new(&mesh);
        out.colours = Some(&colours);
        out.labels = Some(&merged.labels);
        out.distances = Some(&distances);
        out.comments = comments(completion, model);
        if !expected.is_empty() {
            out.properties.push(("expected_error", &expected));
        }
        io::write_ply(&self.output, &out)?;
        Ok(())
    }

    fn write_report(
        &self,
        completion: &Completion,
        model: &Model<'_>,
        scan: &Mesh,
        notes: &[String],
    ) -> Result<(), Failure> {
        let Some(path) = self.report_path() else { return Ok(()) };
        let known = match (&self.pose, &self.pose_hint) {
            (Some(pose), _) => format!("given as {pose}"),
            (None, Some(pose)) => format!("refined from {pose}"),
            (None, None) => format!("searched for, seed {}", self.subject.seed),
        };
        let settings = [
            ("pose", known),
            ("unit of the scan", unit::symbol(self.subject.unit(model)).to_owned()),
            ("step lengths", if self.momentum { "heavy ball" } else { "varying" }.to_owned()),
            ("surface", format!("{} times as fine as the model's grid", self.finer)),
            (
                "noise of the scan",
                if self.keep_noise { "kept" } else { "taken out of dense scans" }.to_owned(),
            ),
        ];
        let subject = report::Subject {
            scan: &self.subject.name(),
            original: scan,
            scan_to_model: inputs::matrix(&completion.placed, model, self.subject.factor(model)),
            notes,
            settings: &settings,
            command: &report::command_line(),
        };
        let html = report::completion::html(completion, model, &subject)?;
        inputs::write_report(&path, &html)
    }

    fn tell(
        &self,
        common: &Common,
        completion: &Completion,
        model: &Model<'_>,
        (seconds, notes, device): (f64, Vec<String>, Option<OnDevice>),
    ) -> Result<(), Failure> {
        let kept = if self.keep_clutter { &completion.clutter.mesh } else { &Mesh::default() };
        let measured = completion.merged.labels.iter().filter(|&&l| l == MEASURED).count();
        let completed = Completed {
            scan: self.subject.name(),
            class: model.header().class,
            model_checksum: format!("{:08x}", model.checksum()),
            output: self.output.display().to_string(),
            picture: self.picture_path().map(|p| p.display().to_string()),
            report: self.report_path().map(|p| p.display().to_string()),
            vertices: completion.merged.mesh.points.len() + kept.points.len(),
            triangles: completion.merged.mesh.triangles.len() + kept.triangles.len(),
            measured_vertices: measured,
            specks_removed: completion.specks,
            noise: completion.noise,
            scan_to_model: inputs::matrix(&completion.placed, model, self.subject.factor(model)),
            verdict: &completion.verdict,
            clutter: Clutter::of(completion, self.keep_clutter),
            expected_error: ExpectedError::of(completion, model),
            hull_voxels: completion.fit.outcome.hull_voxels,
            mirrored_voxels: completion.fit.mirrored(),
            buffer_bytes: completion.fit.buffer_bytes,
            digests: completion.fit.digests,
            device,
            seconds,
            notes,
        };
        if common.json {
            say(&serde_json::to_string_pretty(&completed)?);
            return Ok(());
        }
        completed.lines(unit::symbol(model.header().unit)).iter().for_each(|line| say(line));
        Ok(())
    }
}

/// What the file says about itself.
fn comments(completion: &Completion, model: &Model<'_>) -> Vec<String> {
    let (version, class) = (env!("CARGO_PKG_VERSION"), model.header().class);
    let mut comments = vec![
        format!("{COMPLETED} {version} with the class {class}"),
        "label 1: measured, 0: inferred, 2: not part of the class; distance: to the scan, in its unit".into(),
    ];
    if !completion.expected.errors.is_empty() {
        let how =
            if completion.expected.calibrated { "" } else { ", a guess for a model without calibration" };
        comments.push(format!("expected_error: one sigma, 68 % of the true errors are smaller{how}"));
    }
    comments
}

/// A mesh back in the unit of the scan.
fn back(mesh: &Mesh, factor: f64) -> Mesh {
    inputs::scaled(mesh.clone(), 1.0 / factor)
}
