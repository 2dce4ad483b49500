//! Figure 2 as a drawing: boxes of the quartiles over the number of training shapes, a dot at the median.

use super::{Approximation, Record};
use crate::quantile::quantile;
use plotters::coord::Shift;
use plotters::prelude::*;
use std::collections::BTreeMap;

const SIZE: (u32, u32) = (900, 560);
/// What is drawn, from left to right at every number of shapes, with its colour.
const MODELS: [(Approximation, &str, RGBColor); 3] = [
    (Approximation::Correspondence, "correspondence model", RGBColor(96, 125, 139)),
    (Approximation::Global, "global volumetric model", RGBColor(30, 118, 179)),
    (Approximation::Local, "local volumetric model", RGBColor(224, 122, 30)),
];
/// Half the width of a box, and the distance between boxes, in numbers of shapes' places.
const BOX: (f64, f64) = (0.11, 0.27);

type Failure = Box<dyn std::error::Error + Send + Sync>;
type Values = BTreeMap<(usize, Approximation), Vec<f64>>;

/// Root mean square distances as boxplots: an SVG. `unit` is that of the targets.
///
/// # Errors
/// Whatever the drawing library refuses; nothing is known that it does.
pub fn figure(records: &[Record], unit: &str) -> Result<String, Failure> {
    let mut text = String::new();
    let values = values(records);
    {
        let area = SVGBackend::with_string(&mut text, SIZE).into_drawing_area();
        draw(&area, &values, unit).map_err(|error| error.to_string())?;
        area.present().map_err(|error| error.to_string())?;
    }
    Ok(text)
}

/// Ascending root mean squares by number of shapes and model.
fn values(records: &[Record]) -> Values {
    let mut values = Values::new();
    for record in records {
        for (&kind, score) in &record.scores {
            values.entry((record.count, kind)).or_default().push(score.rms);
        }
    }
    values.values_mut().for_each(|list| list.sort_by(f64::total_cmp));
    values
}

fn draw<B: DrawingBackend>(
    area: &DrawingArea<B, Shift>,
    values: &Values,
    unit: &str,
) -> Result<(), DrawingAreaErrorKind<B::ErrorType>> {
    area.fill(&WHITE)?;
    let mut counts: Vec<usize> = values.keys().map(|&(count, _)| count).collect();
    counts.dedup();
    let drawn = |kind| MODELS.iter().any(|&(model, ..)| model == kind);
    let highest = values.iter().filter(|((_, kind), _)| drawn(*kind)).flat_map(|(_, list)| list.last());
    let top = 1.08 * highest.copied().fold(0.0, f64::max).max(f64::MIN_POSITIVE);
    let mut chart = ChartBuilder::on(area)
        .margin(16)
        .x_label_area_size(48)
        .y_label_area_size(64)
        .build_cartesian_2d(-0.5..counts.len() as f64 - 0.5, 0.0..top)?;
    let label = |x: &f64| {
        let whole = (x - x.round()).abs() < 1e-9 && *x >= 0.0;
        counts.get(x.round() as usize).filter(|_| whole).map_or(String::new(), ToString::to_string)
    };
    chart
        .configure_mesh()
        .disable_x_mesh()
        .light_line_style(TRANSPARENT)
        .x_labels(2 * counts.len() + 1)
        .x_label_formatter(&label)
        .x_desc("training shapes")
        .y_desc(format!("rms distance, {unit}"))
        .label_style(("sans-serif", 16))
        .draw()?;
    for (place, (kind, name, colour)) in MODELS.into_iter().enumerate() {
        // Meshes that do not correspond have no correspondence model: no name without boxes.
        let parts = boxplots(values, &counts, kind, (place as f64 - 1.0) * BOX.1);
        if parts.is_empty() {
            continue;
        }
        let series = chart.draw_series(parts.iter().flat_map(|part| part.elements(colour)))?;
        let key = move |(x, y)| Rectangle::new([(x, y - 5), (x + 14, y + 5)], colour.mix(0.6).filled());
        series.label(name).legend(key);
        let dots = parts.iter().filter_map(|part| part.median());
        chart.draw_series(dots.map(|at| Circle::new(at, 3, BLACK.filled())))?;
    }
    let mut labels = chart.configure_series_labels();
    let labels = labels.position(SeriesLabelPosition::UpperRight);
    labels.background_style(WHITE).border_style(BLACK.mix(0.2)).label_font(("sans-serif", 16)).draw()
}

/// The boxplots of a model at all numbers of shapes, `shift` beside these.
fn boxplots(values: &Values, counts: &[usize], kind: Approximation, shift: f64) -> Vec<Part> {
    let places = counts.iter().enumerate();
    let list_at = |(at, &count): (usize, &usize)| Some((at as f64 + shift, values.get(&(count, kind))?));
    places.filter_map(list_at).flat_map(|(at, list)| boxplot(at, list)).collect()
}

/// Parts of a boxplot.
enum Part {
    Box([(f64, f64); 2]),
    Line([(f64, f64); 2]),
    Median((f64, f64)),
}

impl Part {
    fn elements<B: DrawingBackend>(&self, colour: RGBColor) -> Option<DynElement<'static, B, (f64, f64)>> {
        match *self {
            Self::Box(corners) => Some(Rectangle::new(corners, colour.mix(0.6).filled()).into_dyn()),
            Self::Line(ends) => Some(PathElement::new(ends.to_vec(), colour.stroke_width(2)).into_dyn()),
            Self::Median(_) => None,
        }
    }

    fn median(&self) -> Option<(f64, f64)> {
        if let Self::Median(at) = *self { Some(at) } else { None }
    }
}

/// A box from quartile to quartile, whiskers to the last values within 1.5 box heights, a dot at the median.
fn boxplot(x: f64, ascending: &[f64]) -> Vec<Part> {
    let quartiles = [0.25, 0.5, 0.75].map(|share| quantile(ascending, share));
    let [Some(q1), Some(median), Some(q3)] = quartiles else { return Vec::new() };
    let reach = 1.5 * (q3 - q1);
    let within = || ascending.iter().copied().filter(|v| (q1 - reach..=q3 + reach).contains(v));
    let (low, high) = (within().fold(q1, f64::min), within().fold(q3, f64::max));
    let half = BOX.0;
    let line = |from, to| Part::Line([from, to]);
    vec![
        line((x, low), (x, q1)),
        line((x, q3), (x, high)),
        line((x - half / 2.0, low), (x + half / 2.0, low)),
        line((x - half / 2.0, high), (x + half / 2.0, high)),
        Part::Box([(x - half, q1), (x + half, q3)]),
        Part::Median((x, median)),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::evaluate::{Score, Scores};

    #[test]
    fn the_figure_names_counts_models_and_unit() {
        let record = |count, rms| {
            let scores = MODELS.map(|(kind, ..)| (kind, Score { rms, p95: rms }));
            Record { count, draw: 0, target: String::new(), digest: 0, scores: Scores::from(scores) }
        };
        let text = figure(&[record(10, 1.0), record(10, 1.5), record(70, 0.5)], "mm").unwrap();
        assert!(text.starts_with("<svg") && text.trim_end().ends_with("</svg>"));
        for word in
            ["training shapes", "local volumetric model", "correspondence model", "\n10\n", "\n70\n", "mm"]
        {
            assert!(text.contains(word), "{word}\n{text}");
        }
        assert_eq!(text.matches("<circle").count(), 6);
    }

    #[test]
    fn a_model_without_results_has_no_name_in_the_figure() {
        let score = Score { rms: 1.0, p95: 1.0 };
        let scores = Scores::from([(Approximation::Local, score)]);
        let record = Record { count: 10, draw: 0, target: String::new(), digest: 0, scores };
        let text = figure(&[record], "mm").unwrap();
        assert!(text.contains("local volumetric model") && !text.contains("correspondence model"), "{text}");
    }

    #[test]
    fn whiskers_end_at_values_and_leave_outliers_out() {
        let parts = boxplot(0.0, &[1.0, 2.0, 3.0, 4.0, 99.0]);
        let highest = parts.iter().filter_map(|p| if let Part::Line([_, b]) = p { Some(b.1) } else { None });
        assert_eq!(highest.fold(0.0, f64::max), 4.0);
    }
}
