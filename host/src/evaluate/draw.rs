//! Random draws of training shapes.

use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;

/// The shapes of a draw, ascending. Draws of one number are nested: a larger count has all of the smaller one's.
pub fn draw(shapes: usize, count: usize, number: usize, seed: u64) -> Vec<usize> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    random.set_stream(number as u64);
    let mut order: Vec<usize> = (0..shapes).collect();
    order.shuffle(&mut random);
    order.truncate(count);
    order.sort_unstable();
    order
}

/// Draws that make sense: of all shapes there is only one.
pub fn draws(shapes: usize, count: usize, wanted: usize) -> usize {
    if count == shapes { 1 } else { wanted }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn draws_are_nested_repeatable_and_different() {
        let (small, large) = (draw(90, 10, 0, 1), draw(90, 30, 0, 1));
        assert!(small.iter().all(|shape| large.contains(shape)));
        assert_eq!(small, draw(90, 10, 0, 1));
        assert_ne!(small, draw(90, 10, 1, 1));
        assert_ne!(small, draw(90, 10, 0, 2));
        assert!(large.is_sorted() && large.windows(2).all(|pair| pair[0] != pair[1]));
    }

    #[test]
    fn all_shapes_are_drawn_once() {
        assert_eq!(draw(5, 5, 3, 9), [0, 1, 2, 3, 4]);
        assert_eq!((draws(5, 5, 3), draws(5, 4, 3)), (1, 3));
    }
}
