use super::*;

fn parse(bytes: &[u8]) -> Result<Mesh, Fault> {
    Ok(super::parse(bytes)?.mesh)
}

fn header(fields: &str, sizes: &str, types: &str, points: usize, data: &str) -> String {
    format!(
        "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\nFIELDS {fields}\nSIZE {sizes}\nTYPE {types}\n\
         WIDTH {points}\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS {points}\nDATA {data}\n"
    )
}

fn points() -> Vec<Point> {
    vec![Point::new(1.0, 2.0, 3.0), Point::new(-4.0, 5.5, 6.0)]
}

#[test]
fn text_with_normals_and_other_fields_is_read() {
    let head = header("rgb x y z normal_x normal_y normal_z", "4 4 4 4 4 4 4", "U F F F F F F", 3, "ascii");
    assert!(is_pcd(head.as_bytes()));
    let text = format!("{head}7 1 2 3 0 0 2\n8 nan nan nan 0 0 0\n9 -4 5.5 6 0 1 0\n");
    let Loaded { mesh, repairs } = super::parse(text.as_bytes()).unwrap();
    assert_eq!((mesh.points, mesh.normals), (points(), vec![Vector::z(), Vector::y()]));
    assert_eq!(repairs, ["1 vertex without finite coordinates left out"]);
}

#[test]
fn binary_of_any_type_is_read() {
    let mut bytes = header("x i y z", "8 2 4 2", "F U F I", 2, "binary").into_bytes();
    for (x, y, z) in [(1.0_f64, 2.0_f32, 3_i16), (-4.0, 5.5, 6)] {
        bytes.extend(x.to_le_bytes());
        bytes.extend([9, 9]);
        bytes.extend(y.to_le_bytes());
        bytes.extend(z.to_le_bytes());
    }
    assert_eq!(parse(&bytes).unwrap().points, points());
    let cut = parse(&bytes[..bytes.len() - 1]).unwrap_err();
    assert!(matches!(cut.problem, Problem::Truncated { needed: 32, left: 31, .. }), "{cut:?}");
}

/// Column by column, packed as literals, with one copy: the last four bytes equal the four before.
fn compressed() -> Vec<u8> {
    let columns: Vec<u8> =
        [1.0_f32, -4.0, 2.0, 5.5, 6.0, 6.0].iter().flat_map(|value| value.to_le_bytes()).collect();
    let mut packed = vec![19];
    packed.extend(&columns[..20]);
    packed.extend([2 << 5, 3]);
    let mut bytes = header("x y z", "4 4 4", "F F F", 2, "binary_compressed").into_bytes();
    bytes.extend((packed.len() as u32).to_le_bytes());
    bytes.extend(24_u32.to_le_bytes());
    bytes.extend(packed);
    bytes
}

#[test]
fn compressed_columns_are_read() {
    let expected = [Point::new(1.0, 2.0, 6.0), Point::new(-4.0, 5.5, 6.0)];
    assert_eq!(parse(&compressed()).unwrap().points, expected);
}

#[test]
fn damaged_compressed_data_is_refused_at_every_length_and_byte() {
    let whole = compressed();
    let start = Header::parse(&whole).unwrap().length;
    (0..whole.len()).for_each(|length| assert!(parse(&whole[..length]).is_err(), "{length}"));
    for at in start..start + 8 {
        let mut changed = whole.clone();
        changed[at] ^= 0x40;
        assert!(parse(&changed).is_err(), "byte {at}");
    }
}

#[test]
fn counts_are_not_believed() {
    let huge = header("x y z", "4 4 4", "F F F", 4_000_000_000, "binary");
    assert!(matches!(parse(huge.as_bytes()).unwrap_err().problem, Problem::Truncated { .. }));
    let other = header("x y z", "4 4 4", "F F F", 2, "ascii").replace("WIDTH 2", "WIDTH 3");
    assert!(parse(other.as_bytes()).unwrap_err().problem.to_string().contains("WIDTH times HEIGHT"));
    let short = format!("{}1 2 3\n", header("x y z", "4 4 4", "F F F", 2, "ascii"));
    assert!(parse(short.as_bytes()).unwrap_err().problem.to_string().contains("POINTS says 2, 1 are there"));
}
