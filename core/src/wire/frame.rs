//! Frames: how a message finds its place in a stream of bytes, and how damage is noticed.
//!
//! A frame is `00`, COBS(header, message, CRC-32), `00`. COBS leaves no zero within, so a receiver is in step
//! again at the first zero after any damage. See the [specification](super) for the bytes.

use crate::digest::CRC;
use cobs::{DecodeResult, DecoderState};
use serde::{Deserialize, Serialize};

/// Most bytes of header, message and checksum together.
pub const MAX_MESSAGE: usize = 1024;
/// Most bytes of a frame on the line, with its delimiters.
pub const MAX_FRAME: usize = cobs::max_encoding_length(MAX_MESSAGE) + 2;
/// Bytes of the checksum.
const CHECKSUM: usize = 4;
/// Fewest bytes that header, message and checksum can have: fewer are noise that deserves no answer.
const SHORTEST: usize = 7;

/// What stands before every message.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Header {
    /// The conversation, chosen by the host; 0 is none.
    pub session: u32,
    /// Number of the request in its session; a reply bears its request's.
    pub sequence: u32,
}

/// Puts a message into `frame` (at most [`MAX_FRAME`] bytes); `scratch` is for its plain bytes (at most
/// [`MAX_MESSAGE`]).
///
/// # Returns
/// The bytes for the line, or `None` where they do not fit.
pub fn encode<'f>(
    header: Header,
    message: &impl Serialize,
    scratch: &mut [u8],
    frame: &'f mut [u8],
) -> Option<&'f [u8]> {
    let length = postcard::to_slice(&(header, message), scratch).ok()?.len();
    let (plain, rest) = scratch.split_at_mut_checked(length)?;
    *rest.first_chunk_mut()? = CRC.checksum(plain).to_le_bytes();
    let plain = scratch.get(..length.checked_add(CHECKSUM)?)?;
    let (first, rest) = frame.split_first_mut()?;
    *first = 0;
    let length = cobs::try_encode(plain, rest).ok()?;
    *rest.get_mut(length)? = 0;
    frame.get(..length.checked_add(2)?)
}

/// What a byte from the line completes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Event {
    /// Nothing yet.
    Nothing,
    /// An intact frame: see [`Receiver::message`].
    Frame,
    /// A frame that is damaged or too long.
    Damaged,
}

/// Takes frames out of a stream, byte by byte.
#[derive(Debug)]
pub struct Receiver {
    bytes: [u8; MAX_MESSAGE],
    /// Bytes of the frame so far, those beyond [`MAX_MESSAGE`] too.
    length: usize,
    state: DecoderState,
    /// Whether the bytes are those of an intact frame.
    intact: bool,
}

impl Receiver {
    /// A receiver at the beginning of a stream.
    pub const fn new() -> Self {
        Self { bytes: [0; MAX_MESSAGE], length: 0, state: DecoderState::Idle, intact: false }
    }

    /// Begins a new stream.
    pub fn restart(&mut self) {
        (self.length, self.state, self.intact) = (0, DecoderState::Idle, false);
    }

    /// Takes the next byte of the stream.
    pub fn push(&mut self, byte: u8) -> Event {
        match self.state.feed(byte) {
            Ok(DecodeResult::NoData) => Event::Nothing,
            Ok(DecodeResult::DataStart) => {
                (self.length, self.intact) = (0, false);
                Event::Nothing
            }
            Ok(DecodeResult::DataContinue(value)) => {
                if let Some(place) = self.bytes.get_mut(self.length) {
                    *place = value;
                }
                self.length = self.length.saturating_add(1);
                Event::Nothing
            }
            Ok(DecodeResult::DataComplete) if self.check() => Event::Frame,
            _ if self.length < SHORTEST => Event::Nothing,
            _ => Event::Damaged,
        }
    }

    /// Header and message of the frame that was just completed; the message is `None` where the bytes are none
    /// of its kind, or more than one has.
    pub fn message<'r, M: Deserialize<'r>>(&'r self) -> Option<(Header, Option<M>)> {
        let (plain, _) = self.frame().filter(|_| self.intact)?;
        let (header, body) = postcard::take_from_bytes(plain).ok()?;
        let message = postcard::take_from_bytes(body).ok();
        Some((header, message.filter(|(_, rest)| rest.is_empty()).map(|(message, _)| message)))
    }

    fn check(&mut self) -> bool {
        self.intact = self.frame().is_some_and(|(plain, sum)| CRC.checksum(plain).to_le_bytes() == *sum);
        self.intact
    }

    /// The frame's bytes and their checksum.
    fn frame(&self) -> Option<(&[u8], &[u8; CHECKSUM])> {
        self.bytes.get(..self.length)?.split_last_chunk()
    }
}

impl Default for Receiver {
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const HEADER: Header = Header { session: 0xdead_beef, sequence: 300 };

    fn framed<'f>(bytes: &[u8], frame: &'f mut [u8; MAX_FRAME]) -> &'f [u8] {
        encode(HEADER, &bytes, &mut [0; MAX_MESSAGE], frame).unwrap()
    }

    fn events(receiver: &mut Receiver, bytes: &[u8]) -> [usize; 2] {
        let mut counts = [0; 2];
        for &byte in bytes {
            match receiver.push(byte) {
                Event::Nothing => {}
                Event::Frame => counts[0] += 1,
                Event::Damaged => counts[1] += 1,
            }
        }
        counts
    }

    #[test]
    fn a_message_of_any_bytes_comes_back() {
        for bytes in [&[0u8; 1000][..], &[255; 1000], &[1, 0, 2, 0, 0], &[]] {
            let (mut receiver, mut frame) = (Receiver::new(), [0; MAX_FRAME]);
            assert_eq!(events(&mut receiver, framed(bytes, &mut frame)), [1, 0]);
            assert_eq!(receiver.message::<&[u8]>(), Some((HEADER, Some(bytes))));
        }
    }

    #[test]
    fn a_message_beyond_the_limit_is_not_sent_and_a_longer_frame_is_damaged() {
        let long = [7; MAX_MESSAGE];
        assert_eq!(encode(HEADER, &&long[..], &mut [0; MAX_MESSAGE], &mut [0; MAX_FRAME]), None);
        let mut receiver = Receiver::new();
        assert_eq!(events(&mut receiver, &[9; 5000]), [0, 0]);
        assert_eq!(events(&mut receiver, &[0]), [0, 1]);
    }

    #[test]
    fn any_changed_byte_is_noticed_and_the_next_frame_is_intact() {
        let mut frame = [0; MAX_FRAME];
        let frame = framed(&[1, 2, 3, 0, 5, 6, 0, 8], &mut frame);
        for at in 1..frame.len() - 1 {
            for flip in [1, 0x80, 0xff] {
                let mut damaged = [0; 64];
                damaged[..frame.len()].copy_from_slice(frame);
                damaged[at] ^= flip;
                let mut receiver = Receiver::new();
                assert_eq!(events(&mut receiver, &damaged[..frame.len()])[0], 0, "byte {at}");
                assert_eq!(events(&mut receiver, frame)[0], 1, "byte {at}");
            }
        }
    }

    #[test]
    fn a_message_with_bytes_behind_it_is_none() {
        let (mut receiver, mut frame) = (Receiver::new(), [0; MAX_FRAME]);
        let longer = encode(HEADER, &(1u16, 9u8), &mut [0; MAX_MESSAGE], &mut frame).unwrap();
        assert_eq!(events(&mut receiver, longer), [1, 0]);
        assert_eq!(receiver.message::<u16>(), Some((HEADER, None)));
        assert_eq!(receiver.message::<(u16, u8)>(), Some((HEADER, Some((1, 9)))));
    }

    #[test]
    fn noise_too_short_for_a_message_is_not_worth_an_answer() {
        assert_eq!(events(&mut Receiver::new(), &[0, 0, 3, 1, 1, 0, 9, 9, 0, 0]), [0, 0]);
    }
}
