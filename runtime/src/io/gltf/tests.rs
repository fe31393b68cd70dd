use serde_json::{Value, json};

use super::*;
use crate::Mesh;
use crate::io::{Attributes, IntegerField, IntegerKind, IoError, Joint, Skin, Texture};

fn write(path: &Path, mesh: &Mesh, attributes: &Attributes) -> Result<(), IoError> {
    crate::io::write_mesh(path, mesh, attributes)
}

/// A GLB file of JSON and binary chunk.
fn glb(document: &Value, binary: &[u8]) -> Vec<u8> {
    let header = gltf::binary::Header { magic: *b"glTF", version: 2, length: 0 };
    let json = document.to_string().into_bytes();
    gltf::Glb { header, json: json.into(), bin: Some(binary.into()) }.to_vec().unwrap()
}

fn floats(values: &[f32]) -> Vec<u8> {
    values.iter().flat_map(|x| x.to_le_bytes()).collect()
}

/// Four corners of the unit square as positions, then the indices 0 to 3.
fn square() -> (Value, Vec<u8>) {
    let mut binary = floats(&[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 1.0, 1.0, 0.0]);
    binary.extend([0, 1, 2, 3]);
    let document = json!({
        "asset": {"version": "2.0"},
        "buffers": [{"byteLength": 52}],
        "bufferViews": [{"buffer": 0, "byteLength": 48}, {"buffer": 0, "byteOffset": 48, "byteLength": 4}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "type": "VEC3", "count": 4},
            {"bufferView": 1, "componentType": 5121, "type": "SCALAR", "count": 4},
        ],
        "meshes": [{"primitives": [
            {"attributes": {"POSITION": 0}, "indices": 1, "mode": 5},
            {"attributes": {"POSITION": 0}, "indices": 1, "mode": 6},
            {"attributes": {"POSITION": 0}, "mode": 0},
        ]}],
        "nodes": [{"mesh": 0}],
    });
    (document, binary)
}

fn read_glb(document: &Value, binary: &[u8]) -> Result<MeshFile, String> {
    read(&glb(document, binary), Path::new("")).map_err(|e| e.in_file(Path::new("a.glb")).to_string())
}

#[test]
fn strips_fans_and_shared_vertices() {
    let (document, binary) = square();
    let file = read_glb(&document, &binary).unwrap();
    assert_eq!(file.mesh.n_vertices(), 4);
    assert_eq!(file.mesh.faces(), [[0, 1, 2], [2, 1, 3], [0, 1, 2], [0, 2, 3]]);
    assert_eq!(file.info.warnings, ["1 primitives of points or lines were left out"]);
}

#[test]
fn node_transforms_are_chained_and_mirrors_turn_the_faces() {
    let (mut document, binary) = square();
    document["meshes"][0]["primitives"] = json!([{"attributes": {"POSITION": 0}, "indices": 1, "mode": 5}]);
    document["nodes"] = json!([
        {"children": [1, 2], "translation": [10.0, 0.0, 0.0]},
        {"mesh": 0, "scale": [2.0, 2.0, 2.0]},
        {"mesh": 0, "matrix": [-1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 5, 1]},
        {"mesh": 0},
    ]);
    document["scenes"] = json!([{"nodes": [0]}]);
    let file = read_glb(&document, &binary).unwrap();
    assert_eq!(file.mesh.vertices()[3], [12.0, 2.0, 0.0]);
    assert_eq!(file.mesh.vertices()[7], [9.0, 1.0, 5.0]);
    assert_eq!(file.mesh.faces(), [[0, 1, 2], [2, 1, 3], [4, 6, 5], [6, 7, 5]]);
}

#[test]
fn sparse_and_interleaved_accessors() {
    let (mut document, _) = square();
    // Positions 16 bytes apart with a byte colour between; vertex 3 is replaced.
    let mut binary = Vec::new();
    for i in 0..4u8 {
        binary.extend(floats(&[f32::from(i), 0.0, 0.0]));
        binary.extend([10 * i, 0, 0, 255]);
    }
    binary.extend([3, 0, 0, 0]);
    binary.extend(floats(&[7.0, 8.0, 9.0]));
    document["buffers"] = json!([{"byteLength": 80}]);
    document["bufferViews"] = json!([
        {"buffer": 0, "byteLength": 64, "byteStride": 16},
        {"buffer": 0, "byteOffset": 64, "byteLength": 4},
        {"buffer": 0, "byteOffset": 68, "byteLength": 12},
    ]);
    document["accessors"] = json!([
        {"bufferView": 0, "componentType": 5126, "type": "VEC3", "count": 4, "sparse": {"count": 1,
            "indices": {"bufferView": 1, "componentType": 5121}, "values": {"bufferView": 2}}},
        {"bufferView": 0, "byteOffset": 12, "componentType": 5121, "type": "VEC4", "count": 4, "normalized": true},
    ]);
    let primitive = json!({"attributes": {"POSITION": 0, "COLOR_0": 1}, "mode": 5});
    document["meshes"] = json!([{"primitives": [primitive]}]);
    let file = read_glb(&document, &binary).unwrap();
    assert_eq!(file.mesh.vertices()[2..], [[2.0, 0.0, 0.0], [7.0, 8.0, 9.0]]);
    // 20 of 255 in linear light is 79 in sRGB.
    assert_eq!(file.attributes.vertex_colors.unwrap()[2], [79, 0, 0, 255]);
}

#[test]
fn json_with_a_data_uri_or_a_file_beside() {
    let (mut document, binary) = square();
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("the data.bin"), &binary).unwrap();
    document["buffers"][0]["uri"] = json!("the%20data.bin");
    let read_text = |document: &Value| read(document.to_string().as_bytes(), folder.path());
    assert_eq!(read_text(&document).unwrap().mesh.n_vertices(), 4);
    document["buffers"][0]["uri"] = json!(
        "data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAA\
        AAAAAAAAgD8AAAAAAACAPwAAgD8AAAAAAAECAw=="
    );
    assert_eq!(read_text(&document).unwrap().mesh.faces().len(), 4);
    for (uri, expected) in
        [("absent.bin", "absent.bin"), ("https://a/b", "'https:'"), ("/dev/zero", "regular file")]
    {
        document["buffers"][0]["uri"] = json!(uri);
        let error = read_text(&document).unwrap_err().in_file(Path::new("a.gltf")).to_string();
        assert!(error.contains(expected), "{error}");
    }
}

fn attributes() -> (Mesh, Attributes) {
    let vertices = vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 1.0, 0.5]];
    let mesh = Mesh::new(vertices, vec![[0, 1, 2], [2, 1, 3]]).unwrap();
    let turned = matrix4::from_parts([1.0, 2.0, 3.0], [0.0, 0.0, 0.6, 0.8], [1.0; 3]);
    let joint = |name: &str, parent, frame| Joint { name: name.into(), parent, frame };
    let skin = Skin {
        joints: vec![joint("hip", None, turned), joint("knee", Some(0), matrix4::IDENTITY)],
        indices: vec![[0, 1, 0, 0]; 4],
        weights: vec![[0.25, 0.75, 0.0, 0.0]; 4],
    };
    let attributes = Attributes {
        vertex_colors: Some(vec![[1, 2, 3, 4], [255, 0, 0, 255], [0, 128, 0, 255], [0; 4]]),
        corner_uvs: Some(vec![[[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]], [[0.0, 1.0], [1.0, 0.0], [0.5, 0.25]]]),
        texture: Some(Texture::Embedded { bytes: b"\x89PNG and so on".to_vec(), mime: "image/png".into() }),
        vertex_scalars: vec![("distance".into(), vec![0.0, 1.0, 2.0, 3.5])],
        vertex_integers: vec![IntegerField {
            name: "label".into(),
            kind: IntegerKind::I16,
            values: vec![-1, 2, 300, 7],
        }],
        skin: Some(skin),
    };
    (mesh, attributes)
}

#[test]
fn everything_round_trips() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.glb");
    let (mesh, expected) = attributes();
    write(&path, &mesh, &expected).unwrap();
    let file = crate::io::read_mesh(&path).unwrap();
    assert_eq!(file.mesh.faces(), mesh.faces());
    for (found, expected) in file.mesh.vertices().as_flattened().iter().zip(mesh.vertices().as_flattened()) {
        assert!((found - expected).abs() < 1e-6, "{found} {expected}");
    }
    let (found, wanted) = (file.attributes.skin.as_ref().unwrap(), expected.skin.as_ref().unwrap());
    assert_eq!((&found.indices, &found.weights), (&wanted.indices, &wanted.weights));
    for (found, wanted) in found.joints.iter().zip(&wanted.joints) {
        assert_eq!((&found.name, found.parent), (&wanted.name, wanted.parent));
        let pairs = found.frame.as_flattened().iter().zip(wanted.frame.as_flattened());
        pairs.for_each(|(found, wanted)| assert!((found - wanted).abs() < 1e-6));
    }
    assert_eq!(file.attributes, Attributes { skin: file.attributes.skin.clone(), ..expected });
}

#[test]
fn a_seam_repeats_vertices_behind_the_others() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.glb");
    let (mesh, mut expected) = attributes();
    expected.skin = None;
    if let Some(uvs) = &mut expected.corner_uvs {
        uvs[1][0] = [0.75, 0.75];
    }
    write(&path, &mesh, &expected).unwrap();
    let file = crate::io::read_mesh(&path).unwrap();
    assert_eq!(file.mesh.vertices()[..4], *mesh.vertices());
    assert_eq!(file.mesh.vertices()[4], mesh.vertices()[2]);
    assert_eq!(file.mesh.faces(), [[0, 1, 2], [4, 1, 3]]);
    assert_eq!(file.attributes.corner_uvs, expected.corner_uvs);
    assert_eq!(file.attributes.vertex_scalars[0].1, [0.0, 1.0, 2.0, 3.5, 2.0]);
}

#[test]
fn skinned_vertices_follow_their_joints() {
    let (mut document, mut binary) = square();
    binary.extend([0u8; 16]);
    (0..4).for_each(|_| binary.extend([255, 0, 0, 0]));
    document["buffers"][0]["byteLength"] = json!(84);
    let view = |offset: usize| json!({"buffer": 0, "byteOffset": offset, "byteLength": 16});
    document["bufferViews"].as_array_mut().unwrap().extend([view(52), view(68)]);
    let bytes = |view: usize| json!({"bufferView": view, "componentType": 5121, "type": "VEC4", "count": 4});
    document["accessors"].as_array_mut().unwrap().extend([bytes(2), bytes(3)]);
    let primitive =
        json!({"attributes": {"POSITION": 0, "JOINTS_0": 2, "WEIGHTS_0": 3}, "indices": 1, "mode": 5});
    document["meshes"] = json!([{"primitives": [primitive]}]);
    document["skins"] = json!([{"joints": [2, 1]}]);
    document["nodes"] = json!([
        {"mesh": 0, "skin": 0, "translation": [100.0, 0.0, 0.0]},
        {"name": "root", "children": [2], "translation": [0.0, 5.0, 0.0]},
        {"name": "tip", "scale": [2.0, 2.0, 2.0]},
    ]);
    let file = read_glb(&document, &binary).unwrap();
    // The node's own transform does not count; the joints are listed parents first.
    assert_eq!(file.mesh.vertices()[3], [2.0, 7.0, 0.0]);
    let skin = file.attributes.skin.unwrap();
    assert_eq!(skin.joints.iter().map(|j| j.name.as_str()).collect::<Vec<_>>(), ["root", "tip"]);
    assert_eq!(
        (skin.joints[1].parent, skin.indices[0], skin.weights[0]),
        (Some(0), [1; 4], [1.0, 0.0, 0.0, 0.0])
    );
    binary[52] = 9;
    assert!(read_glb(&document, &binary).unwrap_err().contains("vertex 0 has a joint that does not exist"));
}

#[test]
fn errors_name_the_part() {
    let broken = |change: fn(&mut Value)| {
        let (mut document, binary) = square();
        change(&mut document);
        read_glb(&document, &binary).unwrap_err()
    };
    type Change = fn(&mut Value);
    let cases: [(Change, &str); 19] = [
        (|d| d["accessors"][0]["count"] = json!(5), "accessor 0"),
        (|d| d["accessors"][0]["count"] = json!(u64::MAX), "accessor 0"),
        (|d| d["accessors"][0]["byteOffset"] = json!(u64::MAX), "accessor 0"),
        (|d| d["accessors"][0]["type"] = json!("VEC2"), "2 components instead of 3"),
        (|d| d["accessors"][0]["componentType"] = json!(7), "no valid component type"),
        (
            |d| d["accessors"][1] = json!({"componentType": 5121, "type": "SCALAR", "count": 1u64 << 40}),
            "far larger",
        ),
        (|d| d["bufferViews"][0]["byteOffset"] = json!(u64::MAX), "it reaches beyond its buffer"),
        (|d| d["bufferViews"][0]["byteStride"] = json!(4), "are 4 bytes apart"),
        (|d| d["bufferViews"][0]["buffer"] = json!(1), "its buffer does not exist"),
        (|d| d["buffers"][0]["byteLength"] = json!(999), "buffer 0: it should have 999 bytes"),
        (|d| d["meshes"][0]["primitives"][0]["attributes"] = json!({"POSITION": 77}), "accessor 77"),
        (|d| d["meshes"][0]["primitives"][0]["attributes"] = json!({}), "it has no positions"),
        (|d| d["meshes"][0]["primitives"][0]["mode"] = json!(4), "4 corners do not make triangles"),
        (|d| d["nodes"][0]["mesh"] = json!(1), "node 0: its mesh 1 does not exist"),
        (|d| d["nodes"][0]["children"] = json!([0]), "nodes: some are their own ancestors"),
        (|d| d["nodes"] = json!([{"children": [1, 1]}, {}]), "has another parent"),
        (|d| d["scene"] = json!(3), "scene 3: it does not exist"),
        (
            |d| d["extensionsRequired"] = json!(["KHR_draco_mesh_compression"]),
            "export the mesh without compression",
        ),
        (|d| d["nodes"] = json!([]), "no triangles"),
    ];
    for (change, expected) in cases {
        assert!(broken(change).contains(expected), "{expected}: {}", broken(change));
    }
    let (document, mut binary) = square();
    let index = std::mem::replace(&mut binary[51], 200);
    assert!(
        read_glb(&document, &binary).unwrap_err().contains("accessor 1: primitive 0 of mesh 0: index 200")
    );
    binary[51] = index;
    binary[..4].copy_from_slice(&f32::NAN.to_le_bytes());
    assert!(read_glb(&document, &binary).unwrap_err().contains("vertex 0 is not finite"));
}

#[test]
fn endless_instances_are_refused() {
    let (mut document, binary) = square();
    document["nodes"] = (0..20000).map(|_| json!({"mesh": 0})).collect();
    assert_eq!(read_glb(&document, &binary).unwrap().mesh.n_vertices(), 80000);
    let n = 3000;
    let corners: Vec<u8> = (0..n).flat_map(|_| [0, 1, 2]).collect();
    let binary = [binary, corners].concat();
    document["buffers"][0]["byteLength"] = json!(binary.len());
    document["bufferViews"][1] = json!({"buffer": 0, "byteOffset": 52, "byteLength": 3 * n});
    document["accessors"][1]["count"] = json!(3 * n);
    document["meshes"][0]["primitives"] = json!([{"attributes": {"POSITION": 0}, "indices": 1}]);
    assert!(read_glb(&document, &binary).unwrap_err().contains("far larger than the file"));
}

#[test]
fn what_glb_cannot_hold_is_an_error() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.glb");
    let message =
        |mesh: &Mesh, attributes: &Attributes| write(&path, mesh, attributes).unwrap_err().to_string();
    assert!(message(&Mesh::default(), &Attributes::default()).contains("no empty meshes"));
    let (mesh, mut attributes) = attributes();
    let far = Mesh::new(vec![[1e300, 0.0, 0.0]; 4], mesh.faces().to_vec()).unwrap();
    assert!(message(&far, &attributes).contains("vertex 0 is too far away"));
    attributes.skin.as_mut().unwrap().joints[1].frame = [[0.0; 4]; 4];
    assert!(message(&mesh, &attributes).contains("joint 1 is singular"));
}

/// The square with another primitive, whose attributes are in views behind the first 52 bytes.
fn square_with(primitive: Value, views: &[(&[u8], Value)]) -> (Value, Vec<u8>) {
    let (mut document, mut binary) = square();
    document["meshes"][0]["primitives"] = json!([primitive]);
    for (bytes, accessor) in views {
        binary.resize(binary.len().next_multiple_of(4), 0);
        let view = document["bufferViews"].as_array().unwrap().len();
        let place = json!({"buffer": 0, "byteOffset": binary.len(), "byteLength": bytes.len()});
        document["bufferViews"].as_array_mut().unwrap().push(place);
        let mut accessor = accessor.clone();
        accessor["bufferView"] = json!(view);
        document["accessors"].as_array_mut().unwrap().push(accessor);
        binary.extend(*bytes);
    }
    document["buffers"][0]["byteLength"] = json!(binary.len());
    (document, binary)
}

fn shorts(values: &[u16]) -> Vec<u8> {
    values.iter().flat_map(|x| x.to_le_bytes()).collect()
}

#[test]
fn quantised_texture_coordinates_are_placed_by_the_extension() {
    let uvs = shorts(&[0, 0, 4095, 0, 0, 4095, 4095, 4095]);
    let primitive = json!({"attributes": {"POSITION": 0, "TEXCOORD_0": 2}, "mode": 5, "material": 0});
    for (normalized, scale) in [(false, 1.0 / 4095.0), (true, 65535.0 / 4095.0)] {
        let accessor = json!({"componentType": 5123, "type": "VEC2", "count": 4, "normalized": normalized});
        let (mut document, binary) = square_with(primitive.clone(), &[(&uvs, accessor)]);
        let placed = json!({"KHR_texture_transform": {"scale": [scale, scale]}});
        document["images"] = json!([{"bufferView": 2, "mimeType": "image/png"}]);
        document["textures"] = json!([{"source": 0}]);
        document["materials"] =
            json!([{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0, "extensions": placed}}}]);
        document["extensionsRequired"] = json!(["KHR_mesh_quantization", "KHR_texture_transform"]);
        let file = read_glb(&document, &binary).unwrap();
        let corners = file.attributes.corner_uvs.unwrap()[0];
        for (found, expected) in corners.as_flattened().iter().zip([0.0, 1.0, 1.0, 1.0, 0.0, 0.0]) {
            assert!((found - expected).abs() < 1e-6, "{corners:?}");
        }
        assert_eq!(file.info.left_out, Vec::<String>::new());
    }
    // Integers without a scale are coordinates far outside of the image, as the file says.
    let accessor = json!({"componentType": 5123, "type": "VEC2", "count": 4});
    let (document, binary) = square_with(primitive, &[(&uvs, accessor)]);
    let mut document = document;
    document["materials"] = json!([{}]);
    let file = read_glb(&document, &binary).unwrap();
    assert_eq!(file.attributes.corner_uvs.unwrap()[0][1], [4095.0, 1.0]);
}

#[test]
fn morph_targets_are_applied_with_the_weights_of_the_file() {
    let primitive =
        json!({"attributes": {"POSITION": 0}, "mode": 5, "targets": [{"POSITION": 0}, {"POSITION": 0}]});
    let (mut document, binary) = square_with(primitive, &[]);
    let last = |document: &Value| read_glb(document, &binary).unwrap().mesh.vertices()[3];
    assert_eq!(last(&document), [1.0, 1.0, 0.0]);
    document["meshes"][0]["weights"] = json!([1.0, 0.5]);
    assert_eq!(last(&document), [2.5, 2.5, 0.0]);
    document["nodes"][0]["weights"] = json!([0.0, 2.0]);
    assert_eq!(last(&document), [3.0, 3.0, 0.0]);
    let left_out = read_glb(&document, &binary).unwrap().info.left_out;
    assert!(left_out[0].contains("2 morph targets"), "{left_out:?}");
}

#[test]
fn instances_are_repeated_and_hidden_nodes_named() {
    let moves = floats(&[0.0, 0.0, 0.0, 5.0, 0.0, 0.0, 10.0, 0.0, 0.0]);
    let accessor = json!({"componentType": 5126, "type": "VEC3", "count": 3});
    let (mut document, binary) =
        square_with(json!({"attributes": {"POSITION": 0}, "mode": 5}), &[(&moves, accessor)]);
    let listed = json!({"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": 2}}});
    document["nodes"] =
        json!([{"mesh": 0, "scale": [2.0, 2.0, 2.0], "extensions": listed}, {"mesh": 0, "name": "spare"}]);
    document["scenes"] = json!([{"nodes": [0]}, {"nodes": [1]}]);
    document["extensionsUsed"] = json!(["EXT_mesh_gpu_instancing"]);
    let file = read_glb(&document, &binary).unwrap();
    assert_eq!((file.mesh.n_vertices(), file.mesh.n_faces()), (12, 6));
    assert_eq!(file.mesh.vertices()[11], [22.0, 2.0, 0.0]);
    let warnings = file.info.warnings.join("\n");
    assert!(
        warnings.contains("3 times") && warnings.contains("1 nodes") && warnings.contains("'spare'"),
        "{warnings}"
    );
}

#[test]
fn of_many_joints_the_strongest_four_are_kept_and_all_of_them_move_the_mesh() {
    let joints = [[0u8, 1, 2, 3], [4, 5, 0, 0]].map(|set| set.repeat(4));
    let weights = [[0.1f32, 0.2, 0.3, 0.15], [0.2, 0.05, 0.0, 0.0]].map(|set| floats(&set.repeat(4)));
    let bytes = json!({"componentType": 5121, "type": "VEC4", "count": 4});
    let numbers = json!({"componentType": 5126, "type": "VEC4", "count": 4});
    let primitive = json!({"attributes":
        {"POSITION": 0, "JOINTS_0": 2, "JOINTS_1": 3, "WEIGHTS_0": 4, "WEIGHTS_1": 5}, "mode": 5});
    let views = [
        (&joints[0][..], bytes.clone()),
        (&joints[1], bytes),
        (&weights[0], numbers.clone()),
        (&weights[1], numbers),
    ];
    let (mut document, binary) = square_with(primitive, &views);
    let joint = |i: usize| json!({"name": format!("j{i}"), "translation": [i, 0, 0]});
    document["nodes"] =
        json!([{"mesh": 0, "skin": 0}, joint(0), joint(1), joint(2), joint(3), joint(4), joint(5)]);
    document["skins"] = json!([{"joints": [1, 2, 3, 4, 5, 6]}]);
    let file = read_glb(&document, &binary).unwrap();
    // 0.1 x 0 + 0.2 x 1 + 0.3 x 2 + 0.15 x 3 + 0.2 x 4 + 0.05 x 5
    assert!((file.mesh.vertices()[0][0] - 2.3).abs() < 1e-6, "{:?}", file.mesh.vertices()[0]);
    let skin = file.attributes.skin.unwrap();
    assert_eq!(skin.indices[0], [2, 1, 4, 3]);
    let expected = [0.3, 0.2, 0.2, 0.15].map(|w: f32| w / 0.85);
    assert!(skin.weights[0].iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-6), "{:?}", skin.weights[0]);
    assert!(
        file.info.left_out.iter().any(|what| what.contains("4 vertices' weaker joints")),
        "{:?}",
        file.info.left_out
    );
    document["nodes"][0] = json!({"mesh": 0});
    let left_out = read_glb(&document, &binary).unwrap().info.left_out;
    assert!(left_out[0].contains("whose node has no skin"), "{left_out:?}");
}

#[test]
fn colors_of_materials_and_images_of_extensions() {
    let uvs = floats(&[0.0; 8]);
    let accessor = json!({"componentType": 5126, "type": "VEC2", "count": 4});
    let primitive = json!({"attributes": {"POSITION": 0, "TEXCOORD_0": 2}, "mode": 5, "material": 0});
    let (mut document, binary) = square_with(primitive, &[(&uvs, accessor)]);
    document["materials"] =
        json!([{"pbrMetallicRoughness": {"baseColorFactor": [1.0, 0.2158605, 0.0, 0.5]}}]);
    let color = |document: &Value| read_glb(document, &binary).unwrap().attributes.vertex_colors.unwrap()[0];
    assert_eq!(color(&document), [255, 128, 0, 128]);
    document["materials"] = json!([{"extensions": {"KHR_materials_pbrSpecularGlossiness": {"diffuseFactor": [0.0, 1.0, 0.0, 1.0]}}}]);
    assert_eq!(color(&document), [0, 255, 0, 255]);
    document["images"] = json!([{"bufferView": 2, "mimeType": "image/png"}]);
    document["textures"] = json!([{"source": 0}]);
    let glossy = json!({"diffuseTexture": {"index": 0}});
    document["materials"] = json!([{"extensions": {"KHR_materials_pbrSpecularGlossiness": glossy}}]);
    assert!(read_glb(&document, &binary).unwrap().attributes.texture.is_some());
    document["textures"] = json!([{"extensions": {"EXT_texture_webp": {"source": 0}}}]);
    document["materials"][0]["normalTexture"] = json!({"index": 0});
    document["extensionsUsed"] = json!(["EXT_texture_webp", "VRMC_vrm"]);
    let file = read_glb(&document, &binary).unwrap();
    let left_out = file.info.left_out.join("\n");
    assert_eq!(file.attributes.texture, None);
    for part in ["EXT_texture_webp", "the normal map", "'VRMC_vrm'"] {
        assert!(left_out.contains(part), "{part}: {left_out}");
    }
}

#[test]
fn attributes_that_are_not_kept_are_named_and_integers_stay() {
    let labels = shorts(&[7, 0, 300, 65535]);
    let pairs = floats(&[0.0; 8]);
    let short = json!({"componentType": 5123, "type": "SCALAR", "count": 4});
    let pair = json!({"componentType": 5126, "type": "VEC2", "count": 4});
    let attributes =
        json!({"POSITION": 0, "_LABEL": 2, "_PAIR": 3, "TEXCOORD_0": 3, "TEXCOORD_1": 3, "COLOR_1": 0});
    let (document, binary) =
        square_with(json!({"attributes": attributes, "mode": 5}), &[(&labels, short), (&pairs, pair)]);
    let file = read_glb(&document, &binary).unwrap();
    let field = &file.attributes.vertex_integers[0];
    assert_eq!((field.name.as_str(), field.kind), ("LABEL", IntegerKind::U16));
    assert_eq!(field.values, [7, 0, 300, 65535]);
    let left_out = file.info.left_out.join("\n");
    for part in ["'_PAIR'", "TEXCOORD_1", "COLOR_1"] {
        assert!(left_out.contains(part), "{part}: {left_out}");
    }
}

#[test]
fn compressed_data_without_a_plain_copy_is_refused_by_name() {
    let (mut document, binary) = square();
    let draco = json!({"KHR_draco_mesh_compression": {"bufferView": 0, "attributes": {"POSITION": 0}}});
    document["meshes"][0]["primitives"] =
        json!([{"attributes": {"POSITION": 0}, "mode": 5, "extensions": draco}]);
    assert!(read_glb(&document, &binary).is_ok());
    document["accessors"][0] = json!({"componentType": 5126, "type": "VEC3", "count": 4});
    let message = read_glb(&document, &binary).unwrap_err();
    assert!(
        message.contains("KHR_draco_mesh_compression") && message.contains("without compression"),
        "{message}"
    );
    let (mut document, binary) = square();
    let fallback = json!({"EXT_meshopt_compression": {"fallback": true}});
    document["buffers"].as_array_mut().unwrap().push(json!({"byteLength": 48, "extensions": fallback}));
    let message = read_glb(&document, &binary).unwrap_err();
    assert!(message.contains("buffer 1") && message.contains("without compression"), "{message}");
}

#[test]
fn a_mesh_far_from_the_origin_keeps_its_shape_and_place() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.glb");
    let (near, mut attributes) = attributes();
    let at = [512_345.678, 5_412_345.678, 0.25];
    let vertices = near.vertices().iter().map(|p| [p[0] + at[0], p[1] + at[1], p[2] + at[2]]).collect();
    let far = Mesh::new(vertices, near.faces().to_vec()).unwrap();
    for joint in &mut attributes.skin.as_mut().unwrap().joints {
        (0..3).for_each(|axis| joint.frame[3][axis] += at[axis]);
    }
    for skin in [attributes.skin.clone(), None] {
        write(&path, &far, &Attributes { skin, ..attributes.clone() }).unwrap();
        let file = crate::io::read_mesh(&path).unwrap();
        for (found, expected) in file.mesh.vertices().as_flattened().iter().zip(far.vertices().as_flattened())
        {
            assert!((found - expected).abs() < 1e-5, "{found} {expected}");
        }
        for (found, wanted) in
            file.attributes.skin.iter().flat_map(|s| &s.joints).zip(&attributes.skin.as_ref().unwrap().joints)
        {
            let pairs = found.frame.as_flattened().iter().zip(wanted.frame.as_flattened());
            pairs.for_each(|(found, wanted)| assert!((found - wanted).abs() < 1e-5, "{found} {wanted}"));
        }
    }
}
