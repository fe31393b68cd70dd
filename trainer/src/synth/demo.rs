//! The two bodies of `fmnet-infer demo`, as small files.

use std::io::Write as _;
use std::path::Path;

use fmnet::Mesh;
use fmnet::io::{IoError, write_atomically};

use super::{Body, Species, SynthError, SynthOptions, Template, UNMATCHED};

/// Points of the bodies that correspond: vertex `i` of both files, for `i` up to this.
pub const DEMO_LANDMARKS: usize = 1000;
/// Names of the files.
pub const DEMO_FILES: [&str; 2] = ["source.ply", "target.ply"];
const SPECIES: [&str; 2] = ["man", "ape"];
/// Vertices of each body, few enough for 16-bit indices.
const VERTICES: usize = 2400;
/// Seed that no dataset uses, whatever its own seed and size, of the breeds and the individuals.
const UNSEEN: u64 = 1 << 40;

/// Writes `source.ply` and `target.ply` into `folder`, which is made if need be: bodies of two species in
/// different poses, of which vertex `i` corresponds with vertex `i` for `i` below [`DEMO_LANDMARKS`].
///
/// # Errors
/// If a file or the folder cannot be written.
pub fn write_demo(folder: &Path) -> Result<(), SynthError> {
    std::fs::create_dir_all(folder).map_err(|source| IoError::Write { path: folder.into(), source })?;
    let species = SPECIES.iter().filter_map(|name| Species::from_name(name));
    let templates: Vec<Template> = species.map(|species| Template::new(species, UNSEEN)).collect();
    let common = |&i: &usize| templates.iter().all(|template| template.landmarks[i] != UNMATCHED);
    let n_landmarks = templates.iter().map(Template::n_landmarks).min().unwrap_or(0);
    let common: Vec<usize> = (0..n_landmarks).filter(common).take(DEMO_LANDMARKS).collect();
    let options = SynthOptions { min_vertices: VERTICES, max_vertices: VERTICES, ..SynthOptions::default() };
    for (file, template) in DEMO_FILES.into_iter().zip(&templates) {
        let landmarks: Vec<u32> = common.iter().map(|&i| template.landmarks[i]).collect();
        let bytes = ply(&landmarks_first(&template.body_with_landmarks(UNSEEN, &options, &landmarks)));
        write_atomically(&folder.join(file), |file| file.write_all(&bytes))?;
    }
    Ok(())
}

/// The mesh with vertex `i` at landmark `i`, then the other vertices in their order.
fn landmarks_first(body: &Body) -> Mesh {
    let mut place = vec![u32::MAX; body.mesh.n_vertices()];
    body.landmarks.iter().enumerate().for_each(|(i, &vertex)| place[vertex as usize] = i as u32);
    let others = place.iter_mut().filter(|slot| **slot == u32::MAX);
    others.zip(body.landmarks.len() as u32..).for_each(|(slot, next)| *slot = next);
    let mut vertices = vec![[0.0; 3]; place.len()];
    place.iter().zip(body.mesh.vertices()).for_each(|(&i, &p)| vertices[i as usize] = p);
    let faces = body.mesh.faces().iter().map(|face| face.map(|i| place[i as usize])).collect();
    Mesh::new(vertices, faces).expect("a permutation keeps indices in range")
}

/// A binary PLY file with coordinates of 32 bits and indices of 16 bits.
fn ply(mesh: &Mesh) -> Vec<u8> {
    let mut bytes = Vec::new();
    let _ = write!(
        bytes,
        "ply\nformat binary_little_endian 1.0\nelement vertex {}\nproperty float x\nproperty float y\n\
         property float z\nelement face {}\nproperty list uchar ushort vertex_indices\nend_header\n",
        mesh.n_vertices(),
        mesh.n_faces()
    );
    mesh.vertices().iter().flatten().for_each(|&x| bytes.extend((x as f32).to_le_bytes()));
    for face in mesh.faces() {
        bytes.push(3);
        face.iter().for_each(|&i| bytes.extend((i as u16).to_le_bytes()));
    }
    bytes
}
