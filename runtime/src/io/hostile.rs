//! Every decoder over every truncated length of small files, and over seeded changes of their bytes: no panic,
//! whatever comes, and no memory taken for what a header only promises.

use std::path::{Path, PathBuf};

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::*;
use crate::point_map::PointMap;
use crate::{Matrix, Mesh};

/// Files of every format, with all attributes that each can hold.
fn samples() -> Vec<(PathBuf, Vec<u8>)> {
    let vertices = vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.1], [1.0, 1.0, 0.5]];
    let mesh = Mesh::new(vertices, vec![[0, 1, 2], [2, 1, 3]]).unwrap();
    let joint = |parent| Joint {
        name: "j".into(),
        parent,
        frame: [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [0.0, 0.0, 0.0, 1.0]],
    };
    let attributes = Attributes {
        vertex_colors: Some(vec![[1, 2, 3, 4], [255, 0, 0, 255], [0, 128, 0, 255], [0; 4]]),
        corner_uvs: Some(vec![[[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]], [[0.5, 0.5], [1.0, 0.0], [0.5, 0.25]]]),
        texture: Some(Texture::Embedded { bytes: vec![0x89, b'P', b'N', b'G'], mime: "image/png".into() }),
        vertex_scalars: vec![("f".into(), vec![0.0, 1.0, 2.0, 3.0])],
        skin: Some(Skin {
            joints: vec![joint(None), joint(Some(0))],
            indices: vec![[0, 1, 0, 0]; 4],
            weights: vec![[0.5, 0.5, 0.0, 0.0]; 4],
        }),
    };
    let folder = tempfile::tempdir().unwrap();
    let mut samples = Vec::new();
    for name in ["a.off", "a.ply", "a.obj", "a.glb"] {
        let path = folder.path().join(name);
        write_mesh(&path, &mesh, &attributes).unwrap();
        samples.push((PathBuf::from(name), std::fs::read(&path).unwrap()));
    }
    let map =
        PointMap { targets: vec![1, 0, PointMap::UNMATCHED], confidence: Some(vec![0.5; 3]), n_target: 2 };
    for name in ["map.txt", "map.vts", "map.npy", "map.csv"] {
        let path = folder.path().join(name);
        write_point_map(&path, &map).unwrap();
        samples.push((PathBuf::from(name), std::fs::read(&path).unwrap()));
    }
    let path = folder.path().join("matrix.npy");
    write_matrix(&path, &Matrix::from_vec(2, 2, vec![0.0, 1.0, 2.0, 3.0])).unwrap();
    samples.push((PathBuf::from("matrix.npy"), std::fs::read(&path).unwrap()));
    samples.extend(texts().into_iter().map(|(name, text)| (PathBuf::from(name), text)));
    samples
}

/// Variants that the writers here do not write.
fn texts() -> Vec<(&'static str, Vec<u8>)> {
    let ply = |encoding: &str| {
        format!(
            "ply\nformat {encoding} 1.0\nelement vertex 2\nproperty float x\nproperty double y\nproperty short z\n\
             property list uchar int l\nelement tristrips 1\nproperty list int int vertex_indices\n\
             element face 1\nproperty list uint8 int32 vertex_index\nend_header\n"
        )
    };
    let ascii = ply("ascii") + "0 0 0 0\n1 2 3 2 4 5\n3 0 1 0\n4 0 1 0 1\n";
    let mut big = ply("binary_big_endian").into_bytes();
    big.extend([0; 14 + 1 + 14 + 1]);
    big.extend([0, 0, 0, 3, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 3, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0]);
    let mut stl = vec![b' '; 80];
    stl.extend([1, 0, 0, 0]);
    stl.extend([0; 50]);
    let gltf = r#"{"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}],
        "nodes": [{"children": [1], "rotation": [0, 0, 0, 1]}, {"mesh": 0, "skin": 0}], "skins": [{"joints": [0, 1]}],
        "buffers": [{"byteLength": 12, "uri": "data:;base64,AAAAAAAAAAAAAAAA"}],
        "bufferViews": [{"buffer": 0, "byteLength": 12, "byteStride": 12}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "type": "VEC3", "count": 1, "sparse": {"count": 1,
            "indices": {"bufferView": 0, "componentType": 5121}, "values": {"bufferView": 0}}}],
        "images": [{"uri": "a.png"}], "textures": [{"source": 0}],
        "materials": [{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "mode": 5, "material": 0}]}]}"#;
    vec![
        ("text.ply", ascii.into_bytes()),
        ("big.ply", big),
        ("binary.stl", stl),
        ("text.stl", b"solid\nfacet\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\nendsolid\n".to_vec()),
        ("variant.off", b"STCNOFF\n3 1 0\n0 0 0 0 0 1 1 0 0 1 0 0\n1 0 0 0 0 1 0 1 0 1 1 0\n0 1 0 0 0 1 0 0 1 1 0 1\n3 0 1 2\n".to_vec()),
        ("polygon.obj", b"v 0 0 0\nv 1 0 0 1 0 1\nvt 0 1\nvn 0 0 1\nf -1/-1/1 -2/1 1//1 \\\n2\nusemtl a\nmtllib b\n".to_vec()),
        ("text.gltf", gltf.as_bytes().to_vec()),
    ]
}

/// Runs the decoder of a file; what it returns does not matter, only that it returns.
fn decode_any(path: &Path, bytes: &[u8]) -> bool {
    match PointMapFormat::from_path(path) {
        Some(_) if path.starts_with("matrix.npy") => {
            matrix::decode::<f64>(bytes).is_ok() | matrix::decode::<i32>(bytes).is_ok()
        }
        Some(format) => point_map::decode(bytes, format, None).is_ok(),
        None => {
            let file = decode_mesh(bytes, path);
            if let Ok(file) = &file {
                assert_eq!(file.attributes.check(&file.mesh), Ok(()), "{}", path.display());
            }
            file.is_ok()
        }
    }
}

#[test]
fn every_truncated_length() {
    for (path, bytes) in samples() {
        assert!(decode_any(&path, &bytes), "{}", path.display());
        for length in 0..bytes.len() {
            decode_any(&path, &bytes[..length]);
        }
    }
}

#[test]
fn seeded_changes_of_bytes() {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    for (path, original) in samples() {
        for _ in 0..20000 {
            let mut bytes = original.clone();
            for _ in 0..rng.random_range(1..4) {
                let at = rng.random_range(0..bytes.len());
                match rng.random_range(0..6) {
                    0 => bytes[at] ^= 1 << rng.random_range(0..8),
                    1 => bytes[at] = rng.random(),
                    2 => bytes[at] = [0, 0x7f, 0x80, 0xff][rng.random_range(0..4)],
                    // Digits make counts and indices wrong, and keep the syntax.
                    3 => bytes[at] = rng.random_range(b'0'..=b'9'),
                    4 => bytes.insert(at, rng.random_range(b'0'..=b'9')),
                    _ => drop(bytes.remove(at)),
                }
            }
            decode_any(&path, &bytes);
        }
    }
}

#[test]
fn random_bytes_under_every_extension() {
    let mut rng = ChaCha8Rng::seed_from_u64(2);
    for (path, _) in samples() {
        for length in 0..300 {
            let bytes: Vec<u8> = (0..length).map(|_| rng.random()).collect();
            decode_any(&path, &bytes);
        }
    }
}
