//! Memory of one stage, lent to an earlier one that keeps numbers of another kind in it; zero is what it begins with.
//!
//! The hull's keys live in the memory of the residuals, distances of the jointly fitted surface in that of the gradient:
//! neither is needed before the hull is finished.

/// Memory that can hold numbers of another kind.
pub trait Lent<T>: Copy + Default {
    /// A number in this memory.
    fn store(number: T) -> Self;
    /// The number that was stored.
    fn load(self) -> T;
}

impl Lent<u16> for i16 {
    #[inline(always)]
    fn store(number: u16) -> Self {
        number as Self
    }

    #[inline(always)]
    fn load(self) -> u16 {
        self as u16
    }
}

impl Lent<u32> for i32 {
    #[inline(always)]
    fn store(number: u32) -> Self {
        number as Self
    }

    #[inline(always)]
    fn load(self) -> u32 {
        self as u32
    }
}

impl Lent<u16> for f64 {
    fn store(number: u16) -> Self {
        Self::from(number)
    }

    fn load(self) -> u16 {
        self as u16
    }
}

impl Lent<u32> for f64 {
    fn store(number: u32) -> Self {
        Self::from(number)
    }

    fn load(self) -> u32 {
        self as u32
    }
}
