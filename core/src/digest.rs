//! CRC-32/ISO-HDLC: of files, of messages, and of what a stage computed, so that two machines can compare it.

pub(crate) static CRC: crc::Crc<u32> = crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC);

/// A CRC-32 that grows piece by piece.
pub struct Digest(crc::Digest<'static, u32>);

impl Digest {
    /// The digest of nothing.
    pub fn new() -> Self {
        Self(CRC.digest())
    }

    /// Appends bytes.
    pub fn add(&mut self, bytes: &[u8]) {
        self.0.update(bytes);
    }

    /// The CRC-32 of all bytes added.
    pub fn value(self) -> u32 {
        self.0.finalize()
    }
}

impl Default for Digest {
    fn default() -> Self {
        Self::new()
    }
}

/// CRC-32 of many small pieces: the digest of a stage's result.
pub fn digest(chunks: impl Iterator<Item = [u8; 2]>) -> u32 {
    let mut digest = Digest::new();
    chunks.for_each(|chunk| digest.add(&chunk));
    digest.value()
}
