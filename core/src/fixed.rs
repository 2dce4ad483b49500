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

/// A positive factor: a mantissa of 16 bits and a shift to the right.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Factor {
    /// Within 2¹⁵..2¹⁶, or 0.
    mantissa: u16,
    shift: u8,
}

impl Factor {
    /// The factor 0, for static buffers.
    pub const ZERO: Self = Self { mantissa: 0, shift: 0 };

    /// The factor nearest to `value`; 0 for anything not positive and finite, saturated at 2¹⁶ - 1.
    pub fn new(value: f64) -> Self {
        if !value.is_finite() || value <= 0.0 {
            return Self::default();
        }
        let (fraction, exponent) = libm::frexp(value);
        let mantissa = libm::floor(fraction * 65536.0 + 0.5).min(65535.0) as u16;
        match 16 - exponent {
            ..=-1 => Self { mantissa: u16::MAX, shift: 0 },
            shift @ 0..=62 => Self { mantissa, shift: shift as u8 },
            63.. => Self::default(),
        }
    }

    /// factor · x, rounded half up.
    #[inline(always)]
    pub const fn multiply(self, x: i32) -> i64 {
        round_shift_wide(x as i64 * self.mantissa as i64, self.shift as u32)
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
    fn factors_are_good_to_sixteen_bits() {
        for value in [1e-9, 0.03, 0.5, 1.0, 3.7, 40_000.0] {
            let product = Factor::new(value).multiply(1 << 30) as f64;
            let exact = value * f64::from(1 << 30);
            assert!((product - exact).abs() <= exact / 32768.0 + 0.5, "{value}: {product}");
        }
        assert_eq!(Factor::new(f64::NAN), Factor::default());
        assert_eq!(Factor::new(-1.0), Factor::default());
        assert_eq!(Factor::new(1e-300), Factor::default());
    }
}
