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
    std::fs::write(folder.path().join("skin.png"), "").unwrap();
    let text = "mtllib two words.mtl\nmtllib absent.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1 0\nusemtl a\n\
                f 1 2 3\nusemtl b\nf 1/1 2/2/7 3/-1\nf 3 2 1\n";
    let file = read(text.as_bytes(), folder.path()).unwrap();
    let uvs = file.attributes.corner_uvs.unwrap();
    assert_eq!(uvs, [[[0.0; 2]; 3], [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]], [[0.0; 2]; 3]]);
    assert_eq!(file.attributes.texture, Some(Texture::File(folder.path().join("skin.png"))));
    assert_eq!(file.info.left_out.len(), 1);
    assert!(file.info.left_out[0].contains("absent.mtl"));
    assert_eq!(file.info.files, [folder.path().join("two words.mtl"), folder.path().join("skin.png")]);
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
        ("v 0 0 1.#INF00\n", "line 1: a coordinate is not finite: '1.#INF00'"),
        ("vt -1.#IND00 0\n", "line 1: a texture coordinate is not finite"),
        ("vt 0 nan(ind)\n", "line 1: a texture coordinate is not finite"),
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
    write(&path, &mesh, &crate::io::Attributes { texture: Some(absent), ..attributes }).unwrap();
    assert_eq!(crate::io::read_mesh(&path).unwrap().attributes.texture, None);
    let text = std::fs::read_to_string(&path).unwrap();
    assert!(!text.contains("mtllib") && !text.contains("usemtl"), "no reference to what is not there");
}

/// Names with `#`, spaces and quotes, several libraries in one statement, paths of other systems.
#[test]
fn references_as_other_programs_write_them() {
    let body = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\n";
    for (statement, library, material, image, file) in [
        ("scan #1.mtl", "scan #1.mtl", "skin", "skin #1.png", "skin #1.png"),
        ("a.mtl # ours", "a.mtl", "skin #2", "skin.png # ours", "skin.png"),
        ("\"my body.mtl\"", "my body.mtl", "my skin", "\"my skin.png\"", "my skin.png"),
        ("other.mtl my body.mtl", "my body.mtl", "skin", "-s 1 1 1 my skin.png", "my skin.png"),
        ("A.MTL", "a.mtl", "skin", "C:\\Users\\someone\\scan\\SKIN.png", "skin.png"),
        ("maps\\a.mtl", "maps/a.mtl", "skin", "..\\skin.png", "skin.png"),
        ("maps/a.mtl", "maps/a.mtl", "skin", "skin.png", "maps/skin.png"),
    ] {
        let folder = tempfile::tempdir().unwrap();
        std::fs::create_dir(folder.path().join("maps")).unwrap();
        std::fs::write(folder.path().join(library), format!("newmtl {material}\r\nmap_Kd {image}\r\n"))
            .unwrap();
        std::fs::write(folder.path().join(file), "").unwrap();
        let text = format!("mtllib {statement}\n{body}usemtl {material}\nf 1/1 2/1 3/1\n");
        let read = read(text.as_bytes(), folder.path()).unwrap();
        let Some(Texture::File(found)) = read.attributes.texture else {
            panic!("{statement}, {image}: {:?}", read.info.left_out)
        };
        let same = |path: &Path| std::fs::canonicalize(path).unwrap();
        assert_eq!(same(&found), same(&folder.path().join(file)), "{statement}, {image}");
    }
}

#[test]
fn an_image_that_is_nowhere_is_named() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("a.mtl"), "newmtl a\nmap_Kd gone.png\nmap_Bump bumps.png\n").unwrap();
    let text = "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nusemtl a\nf 1/1 2/1 3/1\n";
    let file = read(text.as_bytes(), folder.path()).unwrap();
    assert_eq!(file.attributes.texture, None);
    let left_out = file.info.left_out.join("\n");
    assert!(
        left_out.contains("map_Bump") && left_out.contains("'gone.png'") && left_out.contains("not there"),
        "{left_out}"
    );
}

#[test]
fn colors_of_materials_and_of_zbrush_come_to_the_vertices() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("a.mtl"), "newmtl red\nKd 1 0 0\nnewmtl grey\nKd 0.8 0.8 0.8\n")
        .unwrap();
    let vertices = "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\n";
    let two = format!("{vertices}usemtl red\nf 1 2 3\nusemtl grey\nf 2 4 3\n");
    let colors = read(two.as_bytes(), folder.path()).unwrap().attributes.vertex_colors.unwrap();
    assert_eq!(
        (colors[0], colors[1], colors[3]),
        ([255, 0, 0, 255], [230, 102, 102, 255], [204, 204, 204, 255])
    );
    // One shade of grey is the default of most programs and says nothing.
    let grey = format!("{vertices}usemtl grey\nf 1 2 3\n");
    assert_eq!(read(grey.as_bytes(), folder.path()).unwrap().attributes.vertex_colors, None);
    let painted = read_text("v 0 0 0\nv 1 0 0\nv 0 1 0\n#MRGB ffff0000ff00ff00\n#MRGB ff0102fe\nf 1 2 3\n");
    assert_eq!(
        painted.attributes.vertex_colors.unwrap(),
        [[255, 0, 0, 255], [0, 255, 0, 255], [1, 2, 254, 255]]
    );
    let short = read_text("v 0 0 0\nv 1 0 0\nv 0 1 0\n#MRGB ffff0000\nf 1 2 3\n");
    assert!(
        short.attributes.vertex_colors.is_none() && short.info.left_out[0].contains("1 colours of '#MRGB'")
    );
}

#[test]
fn what_is_no_triangle_is_named() {
    let file = read_text(
        "g arm #1\nv 0 0 0 2\nv 1 0 0\nv 0 1 0\nl 1 2\np 1\ncurv 0 1 1 2\nf 1 2 3\ng leg\nf 3 2 1\ng empty\n",
    );
    assert_eq!(file.info.groups, ["arm #1", "leg"]);
    assert_eq!(file.info.left_out, ["2 lines and points ('l' and 'p')"]);
    assert!(
        file.info.warnings[0].contains("1 vertices have a weight")
            && file.info.warnings[1].contains("1 curves")
    );
}
