//! A device at a TCP address, for tests of the program.

use crate::device_memory::DeviceMemory;
use embedded_io::{ErrorKind, ErrorType, Read, ReadReady, Write};
use std::io;
use std::net::{TcpListener, TcpStream};

struct Tcp(TcpStream);

/// Starts a device with a model, which serves one connection after the other until the test ends: its address.
pub fn start(model: &'static [u8]) -> String {
    let listener = TcpListener::bind("127.0.0.1:0").expect("a free port");
    let address = listener.local_addr().expect("its address").to_string();
    std::thread::spawn(move || {
        let mut memory = DeviceMemory::new(model, 40_000);
        for stream in listener.incoming().flatten() {
            memory.serve(&mut Tcp(stream), model);
        }
    });
    address
}

fn kind(error: io::Error) -> ErrorKind {
    match error.kind() {
        io::ErrorKind::ConnectionReset => ErrorKind::ConnectionReset,
        _ => ErrorKind::Other,
    }
}

impl ErrorType for Tcp {
    type Error = ErrorKind;
}

impl Read for Tcp {
    fn read(&mut self, bytes: &mut [u8]) -> Result<usize, ErrorKind> {
        io::Read::read(&mut self.0, bytes).map_err(kind)
    }
}

impl ReadReady for Tcp {
    fn read_ready(&mut self) -> Result<bool, ErrorKind> {
        self.0.set_nonblocking(true).map_err(kind)?;
        let peeked = self.0.peek(&mut [0]);
        self.0.set_nonblocking(false).map_err(kind)?;
        match peeked {
            Err(error) if error.kind() == io::ErrorKind::WouldBlock => Ok(false),
            other => other.map(|_| true).map_err(kind),
        }
    }
}

impl Write for Tcp {
    fn write(&mut self, bytes: &[u8]) -> Result<usize, ErrorKind> {
        io::Write::write(&mut self.0, bytes).map_err(kind)
    }

    fn flush(&mut self) -> Result<(), ErrorKind> {
        Ok(())
    }
}
