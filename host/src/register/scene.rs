//! A scene: what is searched for the class, and the things beside the best of it. Where shoulders are most of a scan hardly a
//! pair of points is drawn on the face, so what lies beside the best pose is searched by itself, and the likeliest thing wins.

use super::field::Field;
use super::joint::refined;
use super::rank::{Scored, convincing, finals, hopeless, likeliest, ranked};
use super::resize::resized;
use super::search::{Effort, Search};
use super::trim::{beside, settled};
use super::{FEWEST_POINTS, GLANCE};
use crate::points::OrientedPoints;
use lacuna::Model;
use rayon::prelude::*;
use std::ops::Range;

/// Efforts of the first turn of the search, and of the others.
const EFFORTS: [Effort; 2] =
    [Effort { draws: 300, kept: 24, candidates: 8 }, Effort { draws: 1500, kept: 64, candidates: 24 }];
/// Candidates that are refined with many points, for what is best with few need not be with many; and the next best.
const FINALS: usize = 3;
/// As many of them in all, where several poses explain nearly as much.
const MOST_FINALS: usize = 8;
/// Things beside the best of a scene that are searched for.
const THINGS: usize = 2;

/// What is searched through.
pub struct Scene<'a> {
    /// The class.
    pub model: &'a Model<'a>,
    /// Its mean shape.
    pub field: &'a Field,
    /// All of the foreground.
    pub points: &'a OrientedPoints,
    /// Seed of the pairs that are drawn.
    pub seed: u64,
}

impl Scene<'_> {
    /// A search for some of the scene's points.
    pub fn search<'s>(&'s self, among: &'s OrientedPoints) -> Search<'s> {
        Search::new(self.field, among, 1.0 / f64::from(self.model.header().spacing), self.seed)
    }

    /// The poses that turns of a search find among some of the points, best first, and those that were not worth many points.
    pub fn searched(
        &self,
        among: &OrientedPoints,
        search: &Search<'_>,
        turns: Range<u64>,
    ) -> [Vec<Scored>; 2] {
        let Self { model, field, points, .. } = *self;
        let mut found: Vec<Scored> = Vec::new();
        for turn in turns {
            let candidates = search.candidates(turn, EFFORTS[usize::from(turn > 0)]);
            found.extend(refined(model, field, among, &candidates));
            found = ranked(found);
            if convincing(field, &found) {
                break;
            }
        }
        let [finals, rest] = finals(field, found, FINALS, MOST_FINALS);
        // One that drifts off the model on the way leaves the others.
        let last = |other: &Scored| settled(model, field, points, other.pose).ok();
        let finals = ranked(finals.par_iter().filter_map(last).collect());
        [resized(model, field, points, finals), rest]
    }

    /// The poses, the likeliest thing's in front, with those of the things beside the best.
    pub fn with_other_things(&self, mut poses: Vec<Scored>) -> Vec<Scored> {
        let misled = |best: &&Scored| best.is_one_of_several_things() && !hopeless(best);
        let Some(mut thing) = poses.first().filter(misled).cloned() else { return poses };
        let mut others = self.points.clone();
        for _ in 0..THINGS {
            others = others.chosen(&beside(self.model, &others, &thing));
            if others.points.len() < FEWEST_POINTS {
                break;
            }
            let [more, _] = self.searched(&others, &self.search(&others), 0..GLANCE);
            let Some(best) = more.first().cloned() else { break };
            thing = best;
            poses.extend(more);
        }
        likeliest(self.field, ranked(poses))
    }
}
