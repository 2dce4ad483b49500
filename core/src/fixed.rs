//! The one rounding rule of the fixed-point numbers, and factors with an exponent.
//!
//! Rounding is half up: add half a unit, then shift arithmetically. It is the same for both signs'
//! sums on every processor, because two's complement shifts floor.

/// x / 2^shift, rounded half up; `shift` within 0..=31. The addition must not overflow by the caller's bound.
#[inline(always)]
pub const fn round_shift(x: i32, shift: u32) -> i32 {
    let half = (1i32 << (shift & 31)) >> 1;
    x.wrapping_add(half) >> (shift & 31)
}

/// [`round_shift`] of a wide product; `shift` within 0..=62.
#[inline(always)]
pub const fn round_shift_wide(x: i64, shift: u32) -> i64 {
    let half = (1i64 << (shift & 63)) >> 1;
    x.wrapping_add(half) >> (shift & 63)
}

/// The nearest i16.
#[inline(always)]
pub const fn saturate(x: i32) -> i16 {
    if x > i16::MAX as i32 {
        i16::MAX
    } else if x < i16::MIN as i32 {
        i16::MIN
    } else {
        x as i16
    }
}

/// A positive factor: a mantissa of 16 bits and a shift to the right, or of up to five bits to the left.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Factor {
    /// Within 2¹⁵..2¹⁶, or 0.
    mantissa: u16,
    shift: i8,
}

/// Bits by which a factor may be above its mantissa: the largest step, 1024, times the largest gain of a mode, 255, and 2³
/// need five.
const MOST_LIFT: i32 = 5;

impl Factor {
    /// The factor 0, for static buffers.
    pub const ZERO: Self = Self { mantissa: 0, shift: 0 };

    /// The factor nearest to `value`; 0 for anything not positive and finite, saturated below 2²¹.
    pub fn new(value: f64) -> Self {
        if !value.is_finite() || value <= 0.0 {
            return Self::default();
        }
        let (fraction, exponent) = libm::frexp(value);
        let mantissa = libm::floor(fraction * 65536.0 + 0.5).min(65535.0) as u16;
        match 16 - exponent {
            shift if shift < -MOST_LIFT => Self { mantissa: u16::MAX, shift: -MOST_LIFT as i8 },
            shift if shift <= 62 => Self { mantissa, shift: shift as i8 },
            _ => Self::default(),
        }
    }

    /// The same factor, ready to be multiplied by many numbers.
    #[inline(always)]
    pub const fn unpacked(self) -> Multiplier {
        let shift = self.shift as i32;
        let lift = if shift < HIGH { (HIGH - shift) as u32 } else { 0 };
        let most = if shift > HIGH { (shift - HIGH) as u32 } else { 0 };
        let shift = if most < 31 { most } else { 31 };
        Multiplier { mantissa: self.mantissa as i32, limit: i32::MAX >> lift, lift, shift }
    }
}

/// Least shift at which the upper 32 of a product's 48 bits are enough, with one bit left to round.
const HIGH: i32 = 17;

/// A factor's mantissa, and what is shifted before and after the multiplication.
///
/// Nothing but operations of 32 bits and no branch, so that a vector unit takes several numbers at a time.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Multiplier {
    mantissa: i32,
    /// Largest number that can be lifted.
    limit: i32,
    /// Shift to the left before the multiplication, 0..=22.
    lift: u32,
    /// Shift to the right after it, 0..=31, and then one more to round.
    shift: u32,
}

impl Multiplier {
    /// factor · x, rounded half up. Beyond 2²⁷ it may be wrong, but stays beyond, with its sign, and below 2³¹.
    ///
    /// Floor after floor is one floor: the product's lower 16 bits can go before the rest is shifted.
    #[inline(always)]
    pub fn multiply(self, x: i32) -> i32 {
        let lifted = x.max(!self.limit).min(self.limit) << (self.lift & 31);
        let upper = (lifted >> 16).wrapping_mul(self.mantissa);
        let lower = (lifted & 0xffff).wrapping_mul(self.mantissa) as u32 >> 16;
        let high = upper.wrapping_add(lower as i32);
        (high >> (self.shift & 31)).wrapping_add(1) >> 1
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn halves_round_up_for_both_signs() {
        assert_eq!([3, 2, 1, 0, -1, -2, -3].map(|x| round_shift(x, 1)), [2, 1, 1, 0, 0, -1, -1]);
        assert_eq!(round_shift(7, 0), 7);
        assert_eq!(round_shift_wide(-3, 1), -1);
    }

    #[test]
    fn products_are_exact_where_they_matter_and_large_where_they_do_not() {
        let shifts = -MOST_LIFT as i8..63;
        for (mantissa, shift) in shifts.flat_map(|shift| [32_768, 51_234, 65_535].map(|m| (m, shift))) {
            let factor = Factor { mantissa, shift }.unpacked();
            for i in 0..32 {
                for x in
                    [i32::MIN >> i, (i32::MIN >> i) + 1, -98_765_432 >> i, 12_345_678 >> i, i32::MAX >> i]
                {
                    let product = i64::from(x) * i64::from(mantissa);
                    let exact = match u32::try_from(shift) {
                        Ok(shift) => round_shift_wide(product, shift),
                        Err(_) => product << -shift,
                    };
                    let product = i64::from(factor.multiply(x));
                    if exact.abs() < 1 << 27 {
                        assert_eq!(product, exact, "{x} {mantissa} {shift}");
                    } else {
                        assert!(product.abs() >= 1 << 27 && product.signum() == exact.signum());
                    }
                }
            }
        }
        assert_eq!(Factor::ZERO.unpacked().multiply(i32::MIN), 0);
    }

    #[test]
    fn factors_are_good_to_sixteen_bits() {
        for value in [1e-9, 0.03, 0.5, 1.0, 3.7, 40_000.0, 70_000.0, 2e6] {
            let x = if value > 50_000.0 { 20 } else { 1 << 12 };
            let product = f64::from(Factor::new(value).unpacked().multiply(x));
            let exact = value * f64::from(x);
            assert!((product - exact).abs() <= exact / 32768.0 + 0.5, "{value}: {product}");
        }
        assert!(Factor::new(40_000.0).unpacked().multiply(1 << 30) >= 1 << 27);
        assert_eq!(Factor::new(1e300), Factor::new(2_097_120.0));
        assert_eq!(Factor::new(f64::NAN), Factor::default());
        assert_eq!(Factor::new(-1.0), Factor::default());
        assert_eq!(Factor::new(1e-300), Factor::default());
    }
}
