//! Requests and their replies: sends a request again until its reply arrives intact.

use super::{Error, Link};
use lacuna::wire::frame::{Event, Header, MAX_FRAME, MAX_MESSAGE, Receiver, encode};
use lacuna::wire::message::{Reply, Request, Status, VERSION};
use lacuna::wire::{Refusal, message::Info};
use std::time::{Duration, Instant};

/// How long is waited for what.
#[derive(Clone, Copy, Debug)]
pub struct Timing {
    /// For a reply, before the request is sent again.
    pub reply: Duration,
    /// Between two questions how far the fit is.
    pub pause: Duration,
    /// Times a request is sent at most.
    pub attempts: u32,
    /// For a device that answers to get any further.
    pub standstill: Duration,
}

impl Default for Timing {
    fn default() -> Self {
        Self {
            reply: Duration::from_secs(2),
            pause: Duration::from_millis(100),
            attempts: 10,
            standstill: Duration::from_secs(120),
        }
    }
}

/// What the line was like.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize)]
pub struct Statistics {
    /// Requests sent, repetitions included.
    pub sent: u64,
    /// Of these, repetitions.
    pub repeated: u64,
    /// Damaged replies, and requests the device found damaged.
    pub damaged: u64,
    /// Sessions opened.
    pub sessions: u64,
}

/// A host's end of a line.
#[derive(Debug)]
pub struct Client<L> {
    link: L,
    /// Waiting times.
    pub timing: Timing,
    /// What has happened so far.
    pub statistics: Statistics,
    header: Header,
    receiver: Receiver,
    /// Bytes received and not looked at, last one first.
    waiting: Vec<u8>,
}

/// What came in answer to a request.
enum Heard {
    Reply,
    /// Nothing in time.
    Nothing,
    /// A damaged frame, or the device's word that the request was one.
    Damage,
}

/// How long is waited after a damaged frame that came after so many in a row: what disturbs a line may last longer than all the
/// attempts, which damage answers at once. Between ten it is half a second together.
fn calm(damaged: u32) -> Duration {
    Duration::from_millis(1 << damaged.min(8)).saturating_sub(Duration::from_millis(1))
}

impl<L: Link> Client<L> {
    /// A client that has not said hello.
    pub fn new(link: L, timing: Timing) -> Self {
        let header = Header { session: rand::random(), sequence: 0 };
        let statistics = Statistics::default();
        Self { link, timing, statistics, header, receiver: Receiver::new(), waiting: vec![] }
    }

    /// Opens a new session.
    ///
    /// # Errors
    /// No device, or one of another version.
    pub fn hello(&mut self) -> Result<(), Error> {
        self.header = Header { session: self.header.session.wrapping_add(1).max(1), sequence: 0 };
        self.statistics.sessions += 1;
        self.exchange(&Request::Hello { version: VERSION })?;
        match self.reply()? {
            Reply::Hello { version: VERSION } => Ok(()),
            _ => Err(Error::Unexpected),
        }
    }

    /// The reply to the next request of the session.
    ///
    /// # Errors
    /// The device refuses, or does not answer.
    pub fn ask(&mut self, request: &Request<'_>) -> Result<Reply<'_>, Error> {
        self.header.sequence = self.header.sequence.wrapping_add(1);
        self.exchange(request)?;
        if matches!(self.reply(), Err(Error::Refused(Refusal::BadRequest))) {
            // It was not executed: its number is still due.
            self.header.sequence = self.header.sequence.wrapping_sub(1);
        }
        self.reply()
    }

    /// The status in answer to a request that has one.
    ///
    /// # Errors
    /// As for [`Client::ask`].
    pub fn status(&mut self, request: &Request<'_>) -> Result<Status, Error> {
        match self.ask(request)? {
            Reply::Status(status) => Ok(status),
            _ => Err(Error::Unexpected),
        }
    }

    /// What the device is.
    ///
    /// # Errors
    /// As for [`Client::ask`].
    pub fn info(&mut self) -> Result<Info<'_>, Error> {
        match self.ask(&Request::Info)? {
            Reply::Info(info) => Ok(info),
            _ => Err(Error::Unexpected),
        }
    }

    /// Sends a request until its reply has come.
    fn exchange(&mut self, request: &Request<'_>) -> Result<(), Error> {
        let (mut scratch, mut frame) = ([0; MAX_MESSAGE], [0; MAX_FRAME]);
        let frame = encode(self.header, request, &mut scratch, &mut frame).ok_or(Error::TooLong)?;
        let attempts = self.timing.attempts;
        // Times something was damaged, in all and in a row.
        let (mut damaged, mut run) = (0, 0);
        for attempt in 0..attempts {
            self.statistics.sent += 1;
            self.statistics.repeated += u64::from(attempt > 0);
            self.link.send(frame)?;
            match self.listen()? {
                Heard::Reply => return Ok(()),
                Heard::Nothing => run = 0,
                Heard::Damage => {
                    self.statistics.damaged += 1;
                    damaged += 1;
                    if attempt + 1 < attempts {
                        std::thread::sleep(calm(run));
                    }
                    run += 1;
                }
            }
        }
        let mostly = 2 * damaged >= attempts;
        Err(if mostly { Error::Damaged { attempts, damaged } } else { Error::Silent(attempts) })
    }

    fn reply(&self) -> Result<Reply<'_>, Error> {
        match self.receiver.message() {
            Some((_, Some(Reply::Refused(refusal)))) => Err(Error::Refused(refusal)),
            Some((_, Some(reply))) => Ok(reply),
            _ => Err(Error::Unexpected),
        }
    }

    /// Waits for the reply to the last request; drops replies to others.
    fn listen(&mut self) -> Result<Heard, Error> {
        let deadline = Instant::now() + self.timing.reply;
        loop {
            while let Some(byte) = self.waiting.pop() {
                match self.receiver.push(byte) {
                    Event::Nothing => continue,
                    Event::Damaged => {}
                    Event::Frame => match self.receiver.message::<Reply<'_>>() {
                        Some((_, Some(Reply::Refused(Refusal::Damaged)))) => {}
                        Some((header, _)) if header == self.header => return Ok(Heard::Reply),
                        _ => continue,
                    },
                }
                return Ok(Heard::Damage);
            }
            let mut chunk = [0; 4096];
            let patience = deadline.saturating_duration_since(Instant::now());
            // A line that never falls silent has had its time as well.
            if patience.is_zero() {
                return Ok(Heard::Nothing);
            }
            let received = self.link.receive(&mut chunk, patience)?;
            if received == 0 {
                return Ok(Heard::Nothing);
            }
            self.waiting.extend(chunk[..received].iter().rev());
        }
    }
}
