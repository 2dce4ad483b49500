//! Lines that carry bytes.

use std::io::{self, ErrorKind, Read, Write};
use std::net::{TcpStream, ToSocketAddrs};
use std::time::Duration;

/// A line to a device.
pub trait Link {
    /// Sends all bytes.
    ///
    /// # Errors
    /// The line is broken.
    fn send(&mut self, bytes: &[u8]) -> io::Result<()>;

    /// Receives at least one byte, or none if `patience` ends first.
    ///
    /// # Errors
    /// The line is broken.
    fn receive(&mut self, bytes: &mut [u8], patience: Duration) -> io::Result<usize>;
}

impl Link for Box<dyn Link + Send> {
    fn send(&mut self, bytes: &[u8]) -> io::Result<()> {
        (**self).send(bytes)
    }

    fn receive(&mut self, bytes: &mut [u8], patience: Duration) -> io::Result<usize> {
        (**self).receive(bytes, patience)
    }
}

impl Link for TcpStream {
    fn send(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.write_all(bytes)
    }

    fn receive(&mut self, bytes: &mut [u8], patience: Duration) -> io::Result<usize> {
        self.set_read_timeout(Some(patience.max(Duration::from_millis(1))))?;
        received(|| self.read(bytes))
    }
}

/// A serial port.
struct Serial(Box<dyn serialport::SerialPort>);

impl Link for Serial {
    fn send(&mut self, bytes: &[u8]) -> io::Result<()> {
        // A frame takes a second at 9600 baud.
        self.0.set_timeout(Duration::from_secs(10))?;
        self.0.write_all(bytes)
    }

    fn receive(&mut self, bytes: &mut [u8], patience: Duration) -> io::Result<usize> {
        self.0.set_timeout(patience.max(Duration::from_millis(1)))?;
        received(|| self.0.read(bytes))
    }
}

/// Silence is no error, the end of the line is one. A program that was stopped and goes on reads again.
fn received(mut read: impl FnMut() -> io::Result<usize>) -> io::Result<usize> {
    loop {
        return match read() {
            Ok(0) => Err(ErrorKind::UnexpectedEof.into()),
            Err(error) if error.kind() == ErrorKind::Interrupted => continue,
            Err(error) if matches!(error.kind(), ErrorKind::TimedOut | ErrorKind::WouldBlock) => Ok(0),
            other => other,
        };
    }
}

/// Opens a serial port.
///
/// # Errors
/// There is no such port, or it is in use.
pub fn serial(path: &str, baud: u32) -> io::Result<impl Link + use<>> {
    Ok(Serial(serialport::new(path, baud).open()?))
}

/// Connects to a TCP address, `host:port`.
///
/// # Errors
/// No address, or nobody there.
pub fn tcp(address: &str) -> io::Result<TcpStream> {
    const PATIENCE: Duration = Duration::from_secs(5);
    let mut last = io::Error::from(ErrorKind::AddrNotAvailable);
    for address in address.to_socket_addrs()? {
        match TcpStream::connect_timeout(&address, PATIENCE) {
            Ok(stream) => {
                stream.set_nodelay(true)?;
                return Ok(stream);
            }
            Err(error) => last = error,
        }
    }
    Err(last)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_read_that_was_interrupted_is_done_again_silence_is_nothing_and_the_end_an_error() {
        let answers = |answers: &[io::Result<usize>]| {
            let mut left = answers.iter().map(|a| a.as_ref().copied().map_err(|error| error.kind().into()));
            received(|| left.next().expect("one read more than answers")).map_err(|error| error.kind())
        };
        let failed = |kind: ErrorKind| Err(kind.into());
        assert_eq!(answers(&[failed(ErrorKind::Interrupted), failed(ErrorKind::Interrupted), Ok(7)]), Ok(7));
        assert_eq!(answers(&[failed(ErrorKind::TimedOut)]), Ok(0));
        assert_eq!(answers(&[failed(ErrorKind::Interrupted), Ok(0)]), Err(ErrorKind::UnexpectedEof));
        assert_eq!(answers(&[failed(ErrorKind::ConnectionReset)]), Err(ErrorKind::ConnectionReset));
    }
}
