//! The device's side of a conversation: frames in, each request executed once, its reply kept for repetition.

use super::frame::{Event, Header, MAX_FRAME, MAX_MESSAGE, Receiver, encode};
use super::message::{Reply, Request, VERSION};
use super::refusal::Refusal;
use embedded_io::{Read, ReadReady, Write};

/// A serial line as HALs offer it. `read_ready` must not wait; `read` may, for at least one byte. What arrives
/// while a piece of work is done (see [`Completion::step`](crate::Completion::step)) has to be buffered by the
/// line, or is sent again.
///
/// An error of `read` or `read_ready` (an overrun, a framing error) means that bytes were lost, as they may be at any
/// time; a line that fails more than [`MOST_FAILURES`] times without a byte in between is taken to be dead, and so is
/// one that cannot be written to.
pub trait Port: Read + ReadReady + Write {}

impl<P: Read + ReadReady + Write> Port for P {}

/// Why a device stopped serving.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Ended<E> {
    /// The line reached its end.
    Closed,
    /// The line failed.
    Failed(E),
}

impl<E> From<E> for Ended<E> {
    fn from(error: E) -> Self {
        Self::Failed(error)
    }
}

/// Failures of a line in a row that are taken for lost bytes.
pub const MOST_FAILURES: u32 = 16;

/// Bytes taken from the line at a time.
const CHUNK: usize = 64;

/// More bytes than the frame of any refusal has.
const REFUSAL: usize = 64;

/// Memory of the line.
#[derive(Debug)]
pub(super) struct LineBuffers {
    receiver: Receiver,
    /// Bytes from the line, and which of them are still to be looked at.
    chunk: [u8; CHUNK],
    next: usize,
    end: usize,
    /// A reply in plain bytes.
    message: [u8; MAX_MESSAGE],
    /// The last reply, ready for the line.
    reply: [u8; MAX_FRAME],
    reply_length: usize,
}

impl LineBuffers {
    pub const fn new() -> Self {
        Self {
            receiver: Receiver::new(),
            chunk: [0; CHUNK],
            next: 0,
            end: 0,
            message: [0; MAX_MESSAGE],
            reply: [0; MAX_FRAME],
            reply_length: 0,
        }
    }
}

/// Whether to wait for a request.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Patience {
    /// Until one comes.
    Wait,
    /// No: there is other work.
    Glance,
}

/// A line with a conversation on it.
#[derive(Debug)]
pub(super) struct Line<'l, P> {
    port: &'l mut P,
    buffers: &'l mut LineBuffers,
    /// Header of the last executed request; of none after a reset.
    last: Header,
    /// Failures since the last byte.
    failures: u32,
}

/// What to do with an intact frame.
enum Verdict {
    Execute,
    Repeat,
    Greet,
    Refuse(Refusal),
}

impl<'l, P: Port> Line<'l, P> {
    /// A line without a conversation; what is left of an earlier one is forgotten.
    pub fn new(port: &'l mut P, buffers: &'l mut LineBuffers) -> Self {
        buffers.receiver.restart();
        (buffers.next, buffers.end, buffers.reply_length) = (0, 0, 0);
        Self { port, buffers, last: Header::default(), failures: 0 }
    }

    /// The next request to execute, to be answered by [`Line::answer`]. Hello, repetitions and whatever is
    /// damaged or out of order are dealt with here. `None` where nothing is there to execute.
    pub fn receive(&mut self, patience: Patience) -> Result<Option<Request<'_>>, Ended<P::Error>> {
        match self.frame(patience)? {
            Event::Nothing => return Ok(None),
            Event::Damaged => {
                self.refuse(self.last, Refusal::Damaged)?;
                return Ok(None);
            }
            Event::Frame => {}
        }
        let Some((header, request)) = self.buffers.receiver.message::<Request<'_>>() else { return Ok(None) };
        match judge(self.last, header, request.as_ref()) {
            Verdict::Execute => self.last = header,
            Verdict::Repeat => {
                let reply = self.buffers.reply.get(..self.buffers.reply_length).unwrap_or(&[]);
                write(self.port, reply)?;
                return Ok(None);
            }
            Verdict::Greet => {
                self.last = header;
                self.answer(&Reply::Hello { version: VERSION })?;
                return Ok(None);
            }
            Verdict::Refuse(refusal) => {
                self.refuse(header, refusal)?;
                return Ok(None);
            }
        }
        Ok(self.buffers.receiver.message().and_then(|(_, request)| request))
    }

    /// Answers the last request and keeps the reply.
    pub fn answer(&mut self, reply: &Reply<'_>) -> Result<(), Ended<P::Error>> {
        let b = &mut *self.buffers;
        let frame = encode(self.last, reply, &mut b.message, &mut b.reply).unwrap_or(&[]);
        b.reply_length = frame.len();
        write(self.port, frame)
    }

    /// Answers without touching the kept reply.
    fn refuse(&mut self, header: Header, refusal: Refusal) -> Result<(), Ended<P::Error>> {
        let (mut message, mut frame) = ([0; REFUSAL], [0; REFUSAL]);
        let frame = encode(header, &Reply::Refused(refusal), &mut message, &mut frame);
        write(self.port, frame.unwrap_or(&[]))
    }

    /// Takes bytes from the line until a frame ends or, without patience, no more are there.
    fn frame(&mut self, patience: Patience) -> Result<Event, Ended<P::Error>> {
        let b = &mut *self.buffers;
        let mut reads = 0usize;
        loop {
            while let Some(&byte) = b.chunk.get(..b.end).and_then(|chunk| chunk.get(b.next)) {
                b.next = b.next.saturating_add(1);
                let event = b.receiver.push(byte);
                if event != Event::Nothing {
                    return Ok(event);
                }
            }
            // A line that never falls silent must not keep the device from its work.
            if patience == Patience::Glance && reads >= MAX_FRAME {
                return Ok(Event::Nothing);
            }
            reads = reads.saturating_add(1);
            let ready = if patience == Patience::Wait { Ok(true) } else { self.port.read_ready() };
            let received = match ready {
                Ok(false) => return Ok(Event::Nothing),
                Ok(true) => self.port.read(&mut b.chunk),
                Err(error) => Err(error),
            };
            (b.next, b.end) = (0, received.as_ref().copied().unwrap_or(0));
            match received {
                Ok(0) => return Err(Ended::Closed),
                Ok(_) => self.failures = 0,
                Err(error) if self.failures >= MOST_FAILURES => return Err(Ended::Failed(error)),
                // Bytes were lost: the checksum tells whether they mattered.
                Err(_) => self.failures = self.failures.saturating_add(1),
            }
        }
    }
}

/// Whether a request is the one that is due; `last` is the header of the last executed one.
fn judge(last: Header, header: Header, request: Option<&Request<'_>>) -> Verdict {
    let repeated = header == last;
    match request {
        None => Verdict::Refuse(Refusal::BadRequest),
        Some(Request::Hello { version }) if *version != VERSION => {
            Verdict::Refuse(Refusal::UnknownVersion { spoken: VERSION })
        }
        Some(Request::Hello { .. }) if header.session == 0 => Verdict::Refuse(Refusal::BadRequest),
        Some(Request::Hello { .. }) if header.session != last.session => Verdict::Greet,
        _ if header.session != last.session || last.session == 0 => {
            Verdict::Refuse(Refusal::WrongSession { current: last.session })
        }
        _ if repeated => Verdict::Repeat,
        Some(_) if header.sequence == last.sequence.wrapping_add(1) => Verdict::Execute,
        Some(_) => Verdict::Refuse(Refusal::OutOfOrder { expected: last.sequence.wrapping_add(1) }),
    }
}

fn write<P: Port>(port: &mut P, mut bytes: &[u8]) -> Result<(), Ended<P::Error>> {
    while !bytes.is_empty() {
        let written = port.write(bytes)?;
        if written == 0 {
            return Err(Ended::Closed);
        }
        bytes = bytes.get(written..).unwrap_or(&[]);
    }
    Ok(port.flush()?)
}
