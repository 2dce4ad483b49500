//! A later stage's buffer serves an earlier stage as scratch, so that it needs no memory of its own.
//!
//! The stages of a completion come one after the other, and the buffers of the last one, the local fit, hold nothing while
//! the hull is built. So the hull keeps its keys (u16) where the residuals will be (i16, or f64 in floating point), and the
//! jointly fitted surface keeps its voxels' numbers and distances (u32) where the gradients will be (i32 or f64). [`Lent`]
//! says how a number of the earlier stage is kept in an element of the later one, without unsafe code. Default elements hold
//! the number 0; the later stage writes an element before it reads it.

/// An element of a later stage's buffer, lent to an earlier stage that keeps a `T` in it.
pub trait Lent<T>: Copy + Default {
    /// An element that keeps the number.
    fn store(number: T) -> Self;
    /// The number that was stored; 0 of the default.
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
