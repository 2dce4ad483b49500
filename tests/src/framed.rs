//! A message as it goes over the line.

use lacuna::wire::frame::{Header, MAX_FRAME, MAX_MESSAGE, encode};

/// A frame with a message in it; `None` where the message is too long for one.
pub fn framed(header: Header, message: &impl serde::Serialize) -> Option<Vec<u8>> {
    encode(header, message, &mut [0; MAX_MESSAGE], &mut [0; MAX_FRAME]).map(<[u8]>::to_vec)
}
