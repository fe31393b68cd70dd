use super::*;
use crate::Mesh;
use crate::io::attributes::{Attributes, IntegerKind};

fn message(bytes: &[u8]) -> String {
    read(bytes, Path::new("")).unwrap_err().in_file(Path::new("a.ply")).to_string()
}

const TEXT: &str = "ply\r\nformat ascii 1.0\r\ncomment TextureFile my skin.png\r\nobj_info none\r\n\
    element vertex 4\r\nproperty float32 x\r\nproperty float32 y\r\nproperty double z\r\n\
    property list uchar int neighbours\r\nproperty uchar red\r\nproperty uchar green\r\nproperty uchar blue\r\n\
    property float quality\r\nproperty float nx\r\nelement camera 1\r\nproperty list uchar float pose\r\nproperty int id\r\n\
    element face 2\r\nproperty uchar flags\r\nproperty list uint8 int32 vertex_index\r\nend_header\r\n\
    0 0 0 2 7 8 255 0 0 0.5 1\r\n1 0 0 0 0 255 0 1.5 1\r\n1 1 0 1 9 0 0 255 nan 1\r\n0 1 0.1 0 1 2 3 -2 1\r\n\
    2 0.5 0.5 3\r\n0 4 0 1 2 3\r\n1 3 0 1 3\r\n";

/// The records of `TEXT` in binary.
fn binary_of_text(little: bool) -> Vec<u8> {
    let encoding = if little { "binary_little_endian" } else { "binary_big_endian" };
    let header_end = TEXT.find("0 0 0 2 7 8").unwrap();
    let mut bytes = TEXT[..header_end].replace("ascii", encoding).into_bytes();
    let put = |bytes: &mut Vec<u8>, value: &[u8]| {
        if little {
            bytes.extend(value);
        } else {
            bytes.extend(value.iter().rev());
        }
    };
    let (f, d, i) = (f32::to_le_bytes, f64::to_le_bytes, i32::to_le_bytes);
    let vertices: [(_, _, &[i32], [u8; 3], _); 4] = [
        ([0.0, 0.0], 0.0, &[7, 8], [255, 0, 0], 0.5),
        ([1.0, 0.0], 0.0, &[], [0, 255, 0], 1.5),
        ([1.0, 1.0], 0.0, &[9], [0, 0, 255], f32::NAN),
        ([0.0, 1.0], 0.1, &[], [1, 2, 3], -2.0),
    ];
    for (xy, z, neighbours, color, quality) in vertices {
        xy.iter().for_each(|&x| put(&mut bytes, &f(x)));
        put(&mut bytes, &d(z));
        bytes.push(neighbours.len() as u8);
        neighbours.iter().for_each(|&n| put(&mut bytes, &i(n)));
        bytes.extend(color);
        put(&mut bytes, &f(quality));
        put(&mut bytes, &f(1.0));
    }
    bytes.push(2);
    put(&mut bytes, &f(0.5));
    put(&mut bytes, &f(0.5));
    put(&mut bytes, &i(3));
    for (flags, corners) in [(0, &[0, 1, 2, 3][..]), (1, &[0, 1, 3])] {
        bytes.extend([flags, corners.len() as u8]);
        corners.iter().for_each(|&c| put(&mut bytes, &i(c)));
    }
    bytes
}

#[test]
fn text_and_both_byte_orders_agree() {
    let text = read(TEXT.as_bytes(), Path::new("folder")).unwrap();
    assert_eq!(text.mesh.vertices()[3], [0.0, 1.0, 0.1]);
    assert_eq!(text.mesh.faces(), [[0, 1, 2], [0, 2, 3], [0, 1, 3]]);
    let attributes = &text.attributes;
    assert_eq!(attributes.vertex_colors.as_ref().unwrap()[3], [1, 2, 3, 255]);
    assert_eq!(attributes.vertex_scalars.len(), 1);
    assert_eq!(attributes.vertex_scalars[0].0, "quality");
    assert_eq!(attributes.vertex_scalars[0].1[1], 1.5);
    assert!(attributes.vertex_scalars[0].1[2].is_nan());
    let left_out = text.info.left_out.join("\n");
    for name in [
        "'my skin.png', since there are no texture coordinates",
        "'neighbours'",
        "1 records of 'camera'",
        "'flags'",
    ] {
        assert!(left_out.contains(name), "{name}: {left_out}");
    }
    for little in [true, false] {
        let binary = read(&binary_of_text(little), Path::new("folder")).unwrap();
        assert_eq!(binary.mesh, text.mesh);
        assert_eq!(binary.attributes.vertex_colors, attributes.vertex_colors);
        assert_eq!(binary.info, text.info);
    }
}

#[test]
fn texture_coordinates_per_vertex_and_per_corner() {
    let vertex = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
        property float s\nproperty float t\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n\
        0 0 0 0 0\n1 0 0 1 0\n0 1 0 0 1\n3 0 1 2\n";
    let uvs = Some(vec![[[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]]);
    assert_eq!(read(vertex.as_bytes(), Path::new("")).unwrap().attributes.corner_uvs, uvs);
    let corner = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
        element face 1\nproperty list uchar int vertex_indices\nproperty list uchar float texcoord\nend_header\n\
        0 0 0\n1 0 0\n0 1 0\n3 0 1 2 6 0 0 1 0 0 1\n";
    assert_eq!(read(corner.as_bytes(), Path::new("")).unwrap().attributes.corner_uvs, uvs);
}

#[test]
fn triangle_strips_and_float_colors() {
    let text = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n\
        property float red\nproperty float green\nproperty float blue\n\
        element tristrips 1\nproperty list int int vertex_indices\nend_header\n\
        0 0 0 1 0 0\n1 0 0 0 .5 0\n0 1 0 0 0 0\n1 1 0 2 -1 0\n8 0 1 2 3 -1 1 0 2\n";
    let file = read(text.as_bytes(), Path::new("")).unwrap();
    assert_eq!(file.mesh.faces(), [[0, 1, 2], [2, 1, 3], [1, 0, 2]]);
    assert_eq!(
        file.attributes.vertex_colors.unwrap(),
        [[255, 0, 0, 255], [0, 128, 0, 255], [0, 0, 0, 255], [255, 0, 0, 255]]
    );
}

/// Text of one vertex for each row, with properties behind the position.
fn with_properties(properties: &str, rows: &[&str]) -> MeshFile {
    let body: String = rows.iter().map(|row| format!("0 0 0 {row}\n")).collect();
    let header = "property float x\nproperty float y\nproperty float z\n";
    let text = format!(
        "ply\nformat ascii 1.0\nelement vertex {}\n{header}{properties}end_header\n{body}",
        rows.len()
    );
    read(text.as_bytes(), Path::new("")).unwrap()
}

#[test]
fn colors_of_every_type_range_and_order() {
    let rgb = |kind: &str| format!("property {kind} red\nproperty {kind} green\nproperty {kind} blue\n");
    for (properties, row, expected) in [
        (rgb("uchar"), "255 128 1", [255, 128, 1, 255]),
        (rgb("float"), "1 0.5 0", [255, 128, 0, 255]),
        (rgb("float"), "255 128 1", [255, 128, 1, 255]),
        (rgb("double"), "65535 32768 0", [255, 128, 0, 255]),
        (rgb("ushort"), "65535 32896 257", [255, 128, 1, 255]),
        (rgb("ushort"), "255 128 1", [255, 128, 1, 255]),
        (rgb("int"), "255 128 1", [255, 128, 1, 255]),
        (rgb("char"), "-1 -128 1", [255, 128, 1, 255]),
        (
            "property uchar blue\nproperty uchar alpha\nproperty uchar red\nproperty uchar green\n".into(),
            "1 9 255 128",
            [255, 128, 1, 9],
        ),
        (
            "property float r\nproperty float g\nproperty float b\nproperty float a\n".into(),
            "255 128 1 1",
            [255, 128, 1, 255],
        ),
    ] {
        let file = with_properties(&properties, &[row]);
        assert_eq!(file.attributes.vertex_colors.unwrap(), [expected], "{properties}");
        assert_eq!(file.attributes.vertex_scalars.len() + file.attributes.vertex_integers.len(), 0);
    }
    // A single letter alone is a field like any other.
    let file = with_properties("property float r\nproperty float u\n", &["7 8"]);
    assert_eq!(file.attributes.vertex_colors, None);
    assert_eq!(file.attributes.vertex_scalars, [("r".into(), vec![7.0]), ("u".into(), vec![8.0])]);
}

#[test]
fn integers_stay_integers_and_doubles_double() {
    let properties = "property int label\nproperty double time\nproperty uchar odd\n";
    let file = with_properties(properties, &["16777217 1700000000.25 1", "-5 nan 1.5"]);
    let field = &file.attributes.vertex_integers[0];
    assert_eq!((field.name.as_str(), field.kind), ("label", IntegerKind::I32));
    assert_eq!(field.values, [16_777_217, -5]);
    assert_eq!(file.attributes.vertex_scalars[0].1[0], 1_700_000_000.25);
    assert_eq!(file.attributes.vertex_scalars[1], ("odd".into(), vec![1.0, 1.5]));
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.ply");
    write(&path, &file.mesh, &file.attributes).unwrap();
    let header = String::from_utf8_lossy(&std::fs::read(&path).unwrap()).into_owned();
    assert!(header.contains("property int label") && header.contains("property double time"), "{header}");
    let again = crate::io::read_mesh(&path).unwrap();
    assert_eq!(again.attributes.vertex_integers, file.attributes.vertex_integers);
    assert_eq!(again.attributes.vertex_scalars[0].1[0], 1_700_000_000.25);
}

#[test]
fn colors_and_images_of_faces() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("b.png"), "").unwrap();
    let text = "ply\nformat ascii 1.0\ncomment TextureFile a.png\ncomment TextureFile b.png\nelement vertex 4\nproperty float x\n\
        property float y\nproperty float z\nelement face 3\nproperty list uchar int vertex_indices\n\
        property list uchar float texcoord\nproperty int texnumber\nproperty uchar red\nproperty uchar green\nproperty uchar blue\n\
        end_header\n0 0 0\n1 0 0\n0 1 0\n1 1 0\n3 0 1 2 6 0 0 1 0 0 1 1 200 0 0\n4 1 3 2 0 8 0 0 1 0 0 1 1 1 1 0 100 0\n\
        3 0 1 2 6 0 0 1 0 0 1 0 200 0 0\n";
    let file = read(text.as_bytes(), folder.path()).unwrap();
    // Most triangles refer to the second image.
    assert_eq!(file.attributes.texture, Some(Texture::File(folder.path().join("b.png"))));
    let left_out = file.info.left_out.join("\n");
    assert!(left_out.contains("'a.png'") && left_out.contains("1 triangles"), "{left_out}");
    assert_eq!(file.attributes.vertex_colors.unwrap()[3], [0, 100, 0, 255]);
}

#[test]
fn errors_say_where() {
    let vertices = "property float x\nproperty float y\nproperty float z\n";
    let text = |body: &str| {
        let faces = "element face 1\nproperty list uchar int vertex_indices\n";
        format!("ply\nformat ascii 1.0\nelement vertex 1\n{vertices}{faces}end_header\n{body}").into_bytes()
    };
    for (bytes, expected) in [
        (b"off".to_vec(), "line 1: the file ends before 'end_header'"),
        (b"off\n".to_vec(), "line 1: the file does not begin with 'ply'"),
        (b"ply\nformat text 1.0\nend_header\n".to_vec(), "line 2: the format 'text' is not one of"),
        (b"ply\nend_header\n".to_vec(), "no 'format' line"),
        (b"ply\nformat ascii 1.0\nelement vertex 0\nend_header\n".to_vec(), "0 scalar properties 'x'"),
        (b"ply\nproperty float x\n".to_vec(), "line 2: a property before any element"),
        (b"ply\nelement a 1\nproperty list float int x\n".to_vec(), "line 3: the length of a list must be"),
        (b"ply\nelement a 1\nelement a 1\n".to_vec(), "line 3: a second element 'a'"),
        (text("0 0\n"), "2 bytes are left" /* "0 0\n" holds no vertex and face */),
        (text("0 0 inf\n3 0 0 0\n"), "line 10: vertex 0 of 1: the position is not finite"),
        (text("0 0 z\n3 0 0 0\n"), "line 10: vertex 0 of 1: 'z' is not a number"),
        (text("0 0 0\n3 0 0 1\n"), "line 11: face 0 of 1: vertex 1 does not exist: there are 1"),
        (text("0 0 0\n-3 0 0 1\n"), "line 11: face 0 of 1: -3 is not the length of a list"),
        (text("0 0 0\n3 0 0\n"), "face 0 of 1: the file ends here; the file is truncated"),
    ] {
        let message = message(&bytes);
        assert!(
            message.contains(expected) || expected.ends_with("left") && message.contains("bytes are left"),
            "{message}"
        );
    }
}

#[test]
fn hostile_counts_are_refused_before_memory_is_taken() {
    for (properties, body) in [
        (
            "element vertex 18446744073709551615\nproperty double x\nproperty double y\nproperty double z\n",
            "",
        ),
        ("element vertex 900719925474099\nproperty double x\nproperty double y\nproperty double z\n", ""),
        ("element other 900719925474099\nproperty list uchar int x\n", "\u{1}"),
        ("element other 1\nproperty list uint double x\n", "\u{7f}\u{7f}\u{7f}\u{7f}"),
        ("element face 900719925474099\n", ""),
        ("element tristrips 900719925474099\n", ""),
    ] {
        let text = format!("ply\nformat binary_little_endian 1.0\n{properties}end_header\n{body}");
        assert!(read(text.as_bytes(), Path::new("")).is_err());
    }
    let empty = "ply\nformat binary_little_endian 1.0\nelement other 900719925474099\nend_header\n";
    assert_eq!(read(empty.as_bytes(), Path::new("")).unwrap().mesh, Mesh::default());
}

#[test]
fn scalar_names_stay_words_and_apart() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.ply");
    let mesh = Mesh::new(vec![[0.1; 3]], vec![]).unwrap();
    let names = ["x", "two words", "two_words", "f"];
    let vertex_scalars = names.iter().map(|name| (name.to_string(), vec![1.0])).collect();
    write(&path, &mesh, &Attributes { vertex_scalars, ..Default::default() }).unwrap();
    let file = crate::io::read_mesh(&path).unwrap();
    assert_eq!(file.mesh, mesh);
    let read: Vec<_> = file.attributes.vertex_scalars.iter().map(|(name, _)| name.as_str()).collect();
    assert_eq!(read, ["x_", "two_words", "two_words_", "f"]);
}
