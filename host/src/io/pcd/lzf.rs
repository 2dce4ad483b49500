//! LZF (Marc Lehmann): literal runs and copies of what was unpacked before.

/// Unpacks to exactly `length` bytes; none if the data is damaged.
pub(super) fn unpack(data: &[u8], length: usize) -> Option<Vec<u8>> {
    // Three bytes make 264 at most: a larger claim is none, and no memory is taken for it.
    if length > data.len().saturating_mul(88) {
        return None;
    }
    let mut out = Vec::with_capacity(length);
    let mut rest = data.iter().copied();
    while let Some(control) = rest.next() {
        let control = usize::from(control);
        if control < 32 {
            for _ in 0..=control {
                out.push(rest.next()?);
            }
        } else {
            let mut run = control >> 5;
            if run == 7 {
                run += usize::from(rest.next()?);
            }
            let back = ((control & 31) << 8 | usize::from(rest.next()?)) + 1;
            let from = out.len().checked_sub(back)?;
            for at in from..from + run + 2 {
                out.push(out[at]);
            }
        }
        if out.len() > length {
            return None;
        }
    }
    (out.len() == length).then_some(out)
}
