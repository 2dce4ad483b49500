//! The number types of PLY.

/// The order of the bytes of a number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Endian {
    Little,
    Big,
}

/// The type of a property.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

impl Kind {
    /// The type called `name`, in the old or in the new spelling.
    pub fn named(name: &[u8]) -> Option<Self> {
        Some(match name {
            b"char" | b"int8" => Kind::I8,
            b"uchar" | b"uint8" => Kind::U8,
            b"short" | b"int16" => Kind::I16,
            b"ushort" | b"uint16" => Kind::U16,
            b"int" | b"int32" => Kind::I32,
            b"uint" | b"uint32" => Kind::U32,
            b"float" | b"float32" => Kind::F32,
            b"double" | b"float64" => Kind::F64,
            _ => return None,
        })
    }

    /// Bytes in a binary file.
    pub fn size(self) -> usize {
        match self {
            Kind::I8 | Kind::U8 => 1,
            Kind::I16 | Kind::U16 => 2,
            Kind::I32 | Kind::U32 | Kind::F32 => 4,
            Kind::F64 => 8,
        }
    }

    /// The value of `bytes`, as many as [`Kind::size`]; all types fit into an f64 exactly.
    pub fn decode(self, bytes: &[u8], endian: Endian) -> f64 {
        match self {
            Kind::I8 => f64::from(i8::from_le_bytes(ordered(bytes, endian))),
            Kind::U8 => f64::from(u8::from_le_bytes(ordered(bytes, endian))),
            Kind::I16 => f64::from(i16::from_le_bytes(ordered(bytes, endian))),
            Kind::U16 => f64::from(u16::from_le_bytes(ordered(bytes, endian))),
            Kind::I32 => f64::from(i32::from_le_bytes(ordered(bytes, endian))),
            Kind::U32 => f64::from(u32::from_le_bytes(ordered(bytes, endian))),
            Kind::F32 => f64::from(f32::from_le_bytes(ordered(bytes, endian))),
            Kind::F64 => f64::from_le_bytes(ordered(bytes, endian)),
        }
    }
}

/// The first `N` bytes, the least significant one first.
fn ordered<const N: usize>(bytes: &[u8], endian: Endian) -> [u8; N] {
    let mut ordered = [0; N];
    ordered.copy_from_slice(&bytes[..N]);
    if endian == Endian::Big {
        ordered.reverse();
    }
    ordered
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_type_is_decoded_in_both_orders() {
        let cases: [(&[u8], &[u8], f64); 8] = [
            (b"char", &[0xFF], -1.0),
            (b"uint8", &[0xFF], 255.0),
            (b"short", &[0xFE, 0xFF], -2.0),
            (b"uint16", &[0x02, 0x01], 258.0),
            (b"int32", &[0, 0, 0, 0x80], -2147483648.0),
            (b"uint", &[0, 0, 0, 0x80], 2147483648.0),
            (b"float", &[0, 0, 0xC0, 0x3F], 1.5),
            (b"float64", &[0, 0, 0, 0, 0, 0, 0xF8, 0xBF], -1.5),
        ];
        for (name, bytes, value) in cases {
            let kind = Kind::named(name).unwrap();
            let reversed: Vec<u8> = bytes.iter().rev().copied().collect();
            assert_eq!(kind.size(), bytes.len());
            assert_eq!(kind.decode(bytes, Endian::Little), value);
            assert_eq!(kind.decode(&reversed, Endian::Big), value);
        }
        assert_eq!(Kind::named(b"int64"), None);
    }
}
