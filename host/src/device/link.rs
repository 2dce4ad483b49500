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
        received(self.read(bytes))
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
        received(self.0.read(bytes))
    }
}

/// Silence is no error, the end of the line is one.
fn received(result: io::Result<usize>) -> io::Result<usize> {
    match result {
        Ok(0) => Err(ErrorKind::UnexpectedEof.into()),
        Err(error) if matches!(error.kind(), ErrorKind::TimedOut | ErrorKind::WouldBlock) => Ok(0),
        other => other,
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
