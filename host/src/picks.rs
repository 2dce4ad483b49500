//! Numbers picked from 0 .. `of`: some evenly, or all in random order.

/// At most `most` of them, evenly, in ascending order.
pub fn evenly(of: usize, most: usize) -> impl Iterator<Item = usize> + Clone {
    let count = of.min(most);
    (0..count).map(move |i| i * of / count)
}

/// All of them in random order (Fisher and Yates); `below` draws uniformly from 0 .. its argument.
pub fn in_random_order(of: usize, mut below: impl FnMut(usize) -> usize) -> Vec<usize> {
    let mut order: Vec<usize> = (0..of).collect();
    for i in (1..of).rev() {
        order.swap(i, below(i + 1));
    }
    order
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn even_picks_are_distinct_and_as_many_as_there_are_at_most() {
        assert_eq!(evenly(10, 4).collect::<Vec<_>>(), [0, 2, 5, 7]);
        assert_eq!(evenly(3, 5).collect::<Vec<_>>(), [0, 1, 2]);
        assert_eq!((evenly(0, 5).count(), evenly(5, 0).count()), (0, 0));
    }

    #[test]
    fn every_number_is_in_a_random_order_once() {
        let mut drawn = Vec::new();
        let order = in_random_order(5, |count| (drawn.push(count), count / 2).1);
        assert_eq!(drawn, [5, 4, 3, 2], "each from those that are left");
        let mut sorted = order.clone();
        sorted.sort_unstable();
        assert_eq!(sorted, [0, 1, 2, 3, 4]);
        assert_ne!(order, sorted);
        assert!(in_random_order(0, |_| 0).is_empty());
    }
}
