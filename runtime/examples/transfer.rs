//! A texture carried to another body over a map of the built-in model, written as OBJ and GLB, and pictured.
//!
//! ```sh
//! cargo run --release --example transfer -- FOLDER
//! ```
//!
//! The giver is painted from the front and from behind, with a seam along its sides: the image has two charts. The
//! program `fmnet-infer` does the same with files: `match RECEIVER GIVER -o map.txt`, then
//! `transfer RECEIVER GIVER --map map.txt`.

use fmnet::Mesh;
use fmnet::io::{Attributes, Texture, read_mesh, write_atomically, write_mesh};
use fmnet::mesh::shapes::{rotation, transformed};
use fmnet::pipeline::{MatchOptions, match_meshes};
use fmnet::render::{Donors, Picture, textured_picture, transfer_attributes};
use std::error::Error;
use std::f64::consts::{FRAC_PI_2, PI, TAU};
use std::path::{Path, PathBuf};

/// Pixels of the texture, of its squares, and of each body's picture.
const TEXTURE: usize = 1024;
const SQUARE: usize = 32;
const PICTURE: [usize; 2] = [360, 520];

fn main() -> Result<(), Box<dyn Error>> {
    let folder = PathBuf::from(std::env::args().nth(1).unwrap_or_else(|| ".".into()));
    let demo = Path::new(env!("CARGO_MANIFEST_DIR")).join("demo");
    let giver = read_mesh(&demo.join("source.ply"))?.mesh;
    let receiver = read_mesh(&demo.join("target.ply"))?.mesh;
    let image = squares();
    let attributes = Attributes {
        corner_uvs: Some(front_and_back(&giver)),
        texture: Some(Texture::Embedded { bytes: image.to_png(), mime: "image/png".into() }),
        ..Attributes::default()
    };
    write_mesh(&folder.join("giver.obj"), &giver, &attributes)?;
    // Each body faces another way; they are turned toward the viewer.
    let mut pictures = vec![pictured(&giver, &attributes, &image, PI + 0.3)];
    let found = match_meshes(&receiver, &giver, &MatchOptions::default())?;
    let donors = Donors::of_source(&found.map).interpolated(&receiver, &giver)?;
    let moved = transfer_attributes(&giver, &attributes, &receiver, &donors)?;
    write_mesh(&folder.join("receiver.glb"), &receiver, &moved)?;
    pictures.push(pictured(&receiver, &moved, &image, 0.6 - FRAC_PI_2));
    write_atomically(&folder.join("transfer.png"), |file| file.write_all(&side_by_side(&pictures).to_png()))?;
    Ok(())
}

/// Seen from the front in the left half of the image, from behind in the right one.
fn front_and_back(mesh: &Mesh) -> Vec<[[f32; 2]; 3]> {
    let bound = |axis: usize, pick: fn(f64, f64) -> f64| {
        mesh.vertices().iter().map(|p| p[axis]).reduce(pick).unwrap_or_default()
    };
    let [left, bottom] = [bound(0, f64::min), bound(1, f64::min)];
    let size = (bound(0, f64::max) - left).max(bound(1, f64::max) - bottom);
    let of_face = |f: usize| {
        let [a, b, c] = mesh.corners(f);
        let toward_viewer = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]) > 0.0;
        let shift = if toward_viewer { 0.0 } else { 0.5 };
        [a, b, c]
            .map(|p| [(shift + 0.49 * (p[0] - left) / size) as f32, (0.98 * (p[1] - bottom) / size) as f32])
    };
    (0..mesh.n_faces()).map(of_face).collect()
}

/// A chequered image, the hue from bottom to top, warmer on the left half than on the right.
fn squares() -> Picture {
    let pixel = |i: usize| {
        let (row, column) = (i / TEXTURE, i % TEXTURE);
        let light = if (row / SQUARE + 2 * column / SQUARE).is_multiple_of(2) { 1.0 } else { 0.55 };
        let height = (row / SQUARE * SQUARE) as f64 / TEXTURE as f64;
        let wave = |phase: f64| 0.6 + 0.4 * (TAU * (height + phase)).cos();
        let back = if column < TEXTURE / 2 { 0.0 } else { 0.5 };
        [0.0, 0.33, 0.67].map(|phase| (255.0 * light * wave(phase + back)) as u8)
    };
    Picture { width: TEXTURE, height: TEXTURE, pixels: (0..TEXTURE * TEXTURE).map(pixel).collect() }
}

fn pictured(mesh: &Mesh, attributes: &Attributes, image: &Picture, turn: f64) -> Picture {
    let turned = transformed(mesh, rotation([0.0, 1.0, 0.0], turn), 1.0, [0.0; 3]);
    let uvs = attributes.corner_uvs.as_deref().unwrap_or_default();
    textured_picture(&turned, uvs, image, PICTURE[0], PICTURE[1])
}

fn side_by_side(pictures: &[Picture]) -> Picture {
    let [width, height] = PICTURE;
    let row = |row: usize| pictures.iter().flat_map(move |p| p.pixels[row * width..(row + 1) * width].iter());
    let pixels = (0..height).flat_map(row).copied().collect();
    Picture { width: width * pictures.len(), height, pixels }
}
