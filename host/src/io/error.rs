//! What can be wrong with a file, said so that its owner can act on it.

use std::fmt;
use std::io;
use std::path::{Path, PathBuf};

/// A file that could not be read or written.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The operating system would not hand out the file.
    #[error("cannot read {}: {}", path.display(), reading(cause))]
    Read {
        /// The file or folder asked for.
        path: PathBuf,
        /// What the operating system says.
        cause: io::Error,
    },
    /// The file could not be written; nothing was left behind.
    #[error("cannot write {}: {}", path.display(), writing(cause))]
    Write {
        /// The file to be written.
        path: PathBuf,
        /// What the operating system says.
        cause: io::Error,
    },
    /// The content of the file, or what was to become it, makes no sense.
    #[error("{}{}: {}", path.display(), .fault.place, .fault.problem)]
    Content {
        /// The file.
        path: PathBuf,
        /// What is wrong with it, and where.
        fault: Fault,
    },
}

/// What is wrong in a file, and where in it.
#[derive(Clone, Debug, PartialEq)]
pub struct Fault {
    /// Where the problem was noticed.
    pub place: Place,
    /// The problem.
    pub problem: Problem,
}

/// A position in a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    /// The file as a whole.
    File,
    /// A line of a text file, counted from 1.
    Line(usize),
    /// A byte of a binary file, counted from 0.
    Byte(usize),
}

/// What is wrong, and what to do about it.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Problem {
    /// No bytes at all.
    #[error("the file is empty; export it again")]
    Empty,
    /// A readable file without a single vertex.
    #[error("there are no vertices in it; export the mesh or point cloud itself")]
    NoVertices,
    /// Neither extension nor content name a known format.
    #[error("the format is not known; use PLY, OBJ, STL, PCD, or text with the columns x y z")]
    UnknownFormat,
    /// A known format that holds no mesh as it is.
    #[error("this is {0}")]
    Stranger(&'static str),
    /// A picture where a mesh was expected.
    #[error("this is a picture; a depth image needs its scan.json, give that file or its folder")]
    Picture,
    /// Binary data that ends too early.
    #[error("{what} needs {needed} bytes, but {left} are left; the file is cut off, copy it again")]
    Truncated {
        /// The part of the file that does not fit.
        what: &'static str,
        /// Bytes it needs at least.
        needed: u64,
        /// Bytes there are.
        left: u64,
    },
    /// Text that ends too early.
    #[error("the file ends where {0} should follow; it is cut off, copy it again")]
    EndsEarly(&'static str),
    /// Something that should be a number.
    #[error("{0:?} is not a number; correct it or export the file again")]
    NotANumber(String),
    /// Infinite coordinates, or ones that are not numbers.
    #[error("{}", not_finite(*vertex, *count))]
    NotFinite {
        /// The first vertex with one, counted from 0.
        vertex: usize,
        /// Vertices with one.
        count: usize,
    },
    /// A face with a corner that does not exist.
    #[error("a face names vertex {index}, but there are {vertices} vertices; export the file again")]
    Index {
        /// The index as written in the file.
        index: i64,
        /// How many there are to choose from.
        vertices: usize,
    },
    /// An STL file whose length contradicts its triangle count.
    #[error(
        "the header announces {stated} triangles, the length of the file is that of {present}; \
         it is cut off or damaged, copy it again"
    )]
    TriangleCount {
        /// Triangles according to the header.
        stated: u64,
        /// Whole triangles that the length has room for.
        present: u64,
    },
    /// A line with too few or too many values.
    #[error("{} in a line that should have {expected}; correct the line", values(*found))]
    Columns {
        /// Values needed.
        expected: &'static str,
        /// Values found.
        found: usize,
    },
    /// A line of a table that has not as many values as the others.
    #[error("{} in a line, the first one has {first}; correct the line", values(*found))]
    Ragged {
        /// Values found.
        found: usize,
        /// Values of the first line.
        first: usize,
    },
    /// A text cloud whose length contradicts its first line.
    #[error(
        "the first line announces {stated} points, {found} follow; the file is cut off or damaged, copy it again"
    )]
    PointCount {
        /// Points according to the first line.
        stated: u64,
        /// Points there are.
        found: usize,
    },
    /// More memory than `--max-memory` allows.
    #[error("it may need {needed} bytes of memory, --max-memory allows {limit}; decimate it, or allow more")]
    Memory {
        /// Bytes it may need.
        needed: u64,
        /// Bytes allowed.
        limit: u64,
    },
    /// A device without an end.
    #[error("this is a device, not a file; name a file")]
    Device,
    /// More vertices than indices of 32 bits can name.
    #[error("there are more than 4294967295 vertices; decimate the scan")]
    TooMany,
    /// Anything else, in words.
    #[error("{0}")]
    Other(String),
}

/// A problem in words, with the usual remedy.
pub(super) fn export_again(what: impl Into<String>) -> Problem {
    Problem::Other(format!("{}; export the file again", what.into()))
}

impl Problem {
    /// This problem, concerning the file as a whole.
    pub(super) fn in_whole(self) -> Fault {
        Fault { place: Place::File, problem: self }
    }

    /// This problem, noticed in line `number`, counted from 1.
    pub(super) fn in_line(self, number: usize) -> Fault {
        Fault { place: Place::Line(number), problem: self }
    }

    /// This problem, noticed at byte `offset`.
    pub(super) fn at_byte(self, offset: usize) -> Fault {
        Fault { place: Place::Byte(offset), problem: self }
    }
}

impl Fault {
    /// The error that names the file as well.
    pub fn in_file(self, path: &Path) -> Error {
        Error::Content { path: path.into(), fault: self }
    }
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Place::File => Ok(()),
            Place::Line(number) => write!(f, ", line {number}"),
            Place::Byte(offset) => write!(f, ", byte {offset}"),
        }
    }
}

/// "1 value", "2 values".
fn values(count: usize) -> String {
    if count == 1 { "1 value".into() } else { format!("{count} values") }
}

/// Vertices without finite coordinates, and the remedy.
fn not_finite(vertex: usize, count: usize) -> String {
    if count == 1 {
        return format!(
            "vertex {vertex} (counted from 0) has a coordinate that is not finite; remove the vertex"
        );
    }
    format!(
        "{count} vertices have coordinates that are not finite, the first is vertex {vertex} (counted from 0): too \
         many to leave out; export the file again"
    )
}

/// Cause and remedy of a failed read.
fn reading(cause: &io::Error) -> String {
    match cause.kind() {
        io::ErrorKind::NotFound => "there is no such file; check the name".into(),
        io::ErrorKind::PermissionDenied => "access is denied; check the permissions".into(),
        io::ErrorKind::IsADirectory => "this is a folder; name a file in it".into(),
        io::ErrorKind::OutOfMemory => "it is larger than the memory there is; decimate it".into(),
        io::ErrorKind::TimedOut => format!("{cause}; start what writes into it, or name a file"),
        _ => format!("{cause}; check the disk and try again"),
    }
}

/// Cause and remedy of a failed write.
fn writing(cause: &io::Error) -> String {
    match cause.kind() {
        io::ErrorKind::NotFound | io::ErrorKind::NotADirectory => {
            "its folder does not exist; create the folder first".into()
        }
        io::ErrorKind::PermissionDenied => "access is denied; choose another folder or name".into(),
        io::ErrorKind::ReadOnlyFilesystem => "the disk is read-only; choose another folder".into(),
        io::ErrorKind::StorageFull | io::ErrorKind::QuotaExceeded => {
            "the disk is full; free some space or choose another folder".into()
        }
        io::ErrorKind::IsADirectory => "this is a folder; name a file in it".into(),
        io::ErrorKind::InvalidFilename => "the name is too long; give a shorter one".into(),
        io::ErrorKind::FileTooLarge => {
            "it would be larger than files may be here; allow larger ones (ulimit -f)".into()
        }
        io::ErrorKind::WouldBlock => {
            "another run writes into it; wait for its end, or choose another folder".into()
        }
        _ => format!("{cause}; check the disk and try again"),
    }
}
