use super::*;
use crate::io::attributes::Texture;

fn read_text(text: &str) -> MeshFile {
    read(text.as_bytes(), Path::new("")).unwrap()
}

#[test]
fn vertices_keep_their_order_and_polygons_are_split() {
    let text = "# header\\\no first\nv 9 9 9\nv 0 0 0 1.0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvn 0 0 1\nl 1 2\n\
                s off\nf 5//1 4//1 3//1 2//1\no second\nf -4 -3\\\n -2 # the last three\n";
    let file = read_text(text);
    assert_eq!(file.mesh.vertices()[0], [9.0; 3]);
    assert_eq!(file.mesh.faces(), [[4, 3, 2], [4, 2, 1], [1, 2, 3]]);
    assert_eq!(file.info.n_polygons, 1);
    assert_eq!(file.attributes, Default::default());
}

#[test]
fn vertex_colors_of_either_range() {
    let file = read_text("v 0 0 0\nv 1 0 0 1 0.5 0\n");
    assert_eq!(file.attributes.vertex_colors.unwrap(), [[255; 4], [255, 128, 0, 255]]);
    let file = read_text("v 0 0 0 255 1 0 7\nv 1 0 0 1 0 0 8\n");
    assert_eq!(file.attributes.vertex_colors.unwrap(), [[255, 1, 0, 7], [1, 0, 0, 8]]);
}

#[test]
fn texture_coordinates_and_material() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("two words.mtl"), "newmtl a\nKd 1 0 0\nnewmtl b\nmap_Kd skin.png\n")
        .unwrap();
    let text = "mtllib two words.mtl\nmtllib absent.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1 0\nusemtl a\n\
                f 1 2 3\nusemtl b\nf 1/1 2/2/7 3/-1\nf 3 2 1\n";
    let file = read(text.as_bytes(), folder.path()).unwrap();
    let uvs = file.attributes.corner_uvs.unwrap();
    assert_eq!(uvs, [[[0.0; 2]; 3], [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]], [[0.0; 2]; 3]]);
    assert_eq!(file.attributes.texture, Some(Texture::File(folder.path().join("skin.png"))));
    assert_eq!(file.info.warnings.len(), 1);
    assert!(file.info.warnings[0].contains("absent.mtl"));
}

#[test]
fn an_embedded_texture_is_written_beside() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.obj");
    let mesh = read_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").mesh;
    let attributes = crate::io::Attributes {
        corner_uvs: Some(vec![[[0.0, 0.25], [1.0, 0.0], [0.0, 0.25]]]),
        texture: Some(Texture::Embedded { bytes: vec![1, 2, 3], mime: "image/jpeg".into() }),
        ..Default::default()
    };
    write(&path, &mesh, &attributes).unwrap();
    let file = crate::io::read_mesh(&path).unwrap();
    assert_eq!((file.mesh, file.attributes.corner_uvs), (mesh, attributes.corner_uvs));
    assert_eq!(file.attributes.texture, Some(Texture::File(folder.path().join("a_texture.jpg"))));
    assert_eq!(std::fs::read(folder.path().join("a_texture.jpg")).unwrap(), [1, 2, 3]);
}

/// `tobj` numbers vertices by first use; face by face it must give the same positions and texture coordinates.
#[test]
fn agrees_with_tobj_on_the_corners() {
    let text = "v 9 9 9\nv 0 0 0\nv 1 0 0\nv 1 1 0.5\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n\
                f 2/1 3/2 4/3 5/4\nf -1/-1 -2/-2 -3/-3\n";
    let options = tobj::LoadOptions { triangulate: true, ..Default::default() };
    let (models, _) =
        tobj::load_obj_buf(&mut text.as_bytes(), &options, |_| Err(tobj::LoadError::OpenFileFailed)).unwrap();
    let theirs = &models[0].mesh;
    let file = read_text(text);
    let corners =
        file.mesh.faces().as_flattened().iter().zip(file.attributes.corner_uvs.unwrap().into_flattened());
    assert_eq!(theirs.indices.len(), 3 * file.mesh.n_faces());
    for (c, (&vertex, uv)) in corners.enumerate() {
        let (i, j) = (theirs.indices[c] as usize, theirs.texcoord_indices[c] as usize);
        let position: Vec<f64> = theirs.positions[3 * i..3 * i + 3].iter().map(|&x| x.into()).collect();
        assert_eq!(position, file.mesh.vertices()[vertex as usize]);
        assert_eq!(theirs.texcoords[2 * j..2 * j + 2], uv);
    }
}

#[test]
fn errors_say_line_and_range() {
    for (text, expected) in [
        ("", "no vertices"),
        ("v 0 0\n", "line 1: a coordinate is missing"),
        ("v 0 0 nan\n", "line 1: a coordinate is not finite"),
        ("v 0 0 0\n\nf 1 2 1\n", "line 3: vertex 2 does not exist: there are 1, counted from 1"),
        ("v 0 0 0\nf 1 1 -2\n", "line 2: vertex -2 does not exist"),
        ("v 0 0 0\nf 1 1 0\n", "line 2: '0' is not a face's corner"),
        ("v 0 0 0\nf 1/1 1 1\n", "line 2: texture coordinate 1 does not exist: there are 0"),
        ("v 0 0 0\nf 99999999999999999999 1 1\n", "is not a face's corner"),
        ("v 0 0 0\nf 1 1 -9223372036854775808\n", "does not exist"),
        ("v 0 0 0 red\n", "a colour component is not a number"),
    ] {
        let error = read(text.as_bytes(), Path::new("")).unwrap_err().in_file(Path::new("a.obj")).to_string();
        assert!(error.contains(expected), "{error}");
    }
}

#[test]
fn a_texture_from_elsewhere_is_copied() {
    let (from, to) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    let (image, path) = (from.path().join("skin.jpeg"), to.path().join("b.obj"));
    std::fs::write(&image, [1, 2, 3]).unwrap();
    let mesh = read_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").mesh;
    let attributes = crate::io::Attributes {
        corner_uvs: Some(vec![[[0.0, 0.25], [1.0, 0.0], [0.0, 0.5]]]),
        texture: Some(Texture::File(image)),
        ..Default::default()
    };
    write(&path, &mesh, &attributes).unwrap();
    let file = crate::io::read_mesh(&path).unwrap();
    assert_eq!(file.attributes.texture, Some(Texture::File(to.path().join("b_texture.jpeg"))));
    assert_eq!(std::fs::read(to.path().join("b_texture.jpeg")).unwrap(), [1, 2, 3]);
    let absent = Texture::File(from.path().join("absent.png"));
    write(&path, &mesh, &crate::io::Attributes { texture: Some(absent.clone()), ..attributes }).unwrap();
    assert_eq!(crate::io::read_mesh(&path).unwrap().attributes.texture, Some(absent));
}
