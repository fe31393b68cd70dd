//! Pictures of meshes, drawn in software: no window, no graphics card.

use super::RenderError;
use super::error::check_map;
use super::facing::facing_alike;
use super::pair::beside;
use crate::Mesh;
use crate::mesh::MeshError;
use crate::point_map::PointMap;

/// An image of 8-bit RGB pixels, row by row from the top left.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Picture {
    /// Number of columns.
    pub width: usize,
    /// Number of rows.
    pub height: usize,
    /// The pixels, `[height * width]`.
    pub pixels: Vec<[u8; 3]>,
}

/// Turn about the vertical axis, in radians: from the front, but not so flatly that depth is lost.
const TURN: f64 = 0.35;
/// Share of the picture that the mesh may fill.
const FILL: f64 = 0.94;
const BACKGROUND: [u8; 3] = [255, 255, 255];

/// Both shapes of a pair side by side, the source on the left, matches in the same colour: `width / 2` rows, 1 or
/// more, twice as many columns. The target faces as the source does. Errors as of [`side_by_side`].
///
/// [`side_by_side`]: super::side_by_side
pub fn pair_picture(
    source: &Mesh,
    target: &Mesh,
    map: &PointMap,
    width: usize,
) -> Result<Picture, RenderError> {
    let half = (width / 2).max(1);
    check_map(map, source, target)?;
    let (left, right) = (turned(source)?, turned(&facing_alike(source, target, map)?)?);
    let (mesh, attributes) = beside(&left, &right, map)?;
    Ok(picture(&mesh, &attributes.vertex_colors.unwrap_or_default(), 2 * half, half))
}

/// A mesh seen along the negative z axis, y up, lit from the viewer's side, with the given colours of its vertices,
/// `[n]` RGBA; vertices beyond these are grey. Faces seen from behind are drawn as well.
pub fn picture(mesh: &Mesh, colors: &[[u8; 4]], width: usize, height: usize) -> Picture {
    let mut canvas = Canvas::new(width, height);
    let points = on_screen(mesh, width, height);
    for &face in mesh.faces() {
        let shades = face.map(|v| colors.get(v as usize).copied().unwrap_or([180, 180, 180, 255]));
        let mixed = |weights: [f64; 3]| {
            [0, 1, 2].map(|channel| (0..3).map(|i| weights[i] * f64::from(shades[i][channel])).sum())
        };
        canvas.triangle(face.map(|v| points[v as usize]), mixed);
    }
    canvas.finish()
}

/// A mesh seen as in [`picture`], with an image on it: `corner_uvs`, `[m, 3, 2]`, are the texture coordinates of its
/// triangles' corners, `(0, 0)` the image's lower left; the image repeats beyond its edges.
pub fn textured_picture(
    mesh: &Mesh,
    corner_uvs: &[[[f32; 2]; 3]],
    image: &Picture,
    width: usize,
    height: usize,
) -> Picture {
    let mut canvas = Canvas::new(width, height);
    let points = on_screen(mesh, width, height);
    for (&face, uvs) in mesh.faces().iter().zip(corner_uvs) {
        let texel = |weights: [f64; 3]| {
            let [u, v] = [0, 1].map(|c| (0..3).map(|i| weights[i] * f64::from(uvs[i][c])).sum::<f64>());
            image.at(u, v).map(f64::from)
        };
        canvas.triangle(face.map(|v| points[v as usize]), texel);
    }
    canvas.finish()
}

impl Picture {
    /// The pixel at texture coordinates; white if there are none.
    fn at(&self, u: f64, v: f64) -> [u8; 3] {
        let place = |x: f64, size: usize| ((x.rem_euclid(1.0) * size as f64) as usize).min(size.max(1) - 1);
        let (column, row) = (place(u, self.width), place(1.0 - v, self.height));
        self.pixels.get(row * self.width + column).copied().unwrap_or(BACKGROUND)
    }

    /// The picture as a PNG file, which has a row and a column at least. Missing pixels are white.
    pub fn to_png(&self) -> Vec<u8> {
        let mut bytes = Vec::new();
        let (width, height) = (self.width.max(1), self.height.max(1));
        let mut pixels = self.pixels.clone();
        pixels.resize(width * height, BACKGROUND);
        let mut encoder = png::Encoder::new(&mut bytes, width as u32, height as u32);
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_depth(png::BitDepth::Eight);
        let written =
            encoder.write_header().and_then(|mut writer| writer.write_image_data(pixels.as_flattened()));
        written.expect("the pixels have the stated size, and memory takes every write");
        bytes
    }
}

fn turned(mesh: &Mesh) -> Result<Mesh, MeshError> {
    let (sine, cosine) = TURN.sin_cos();
    let turn = |p: &[f64; 3]| [cosine * p[0] + sine * p[2], p[1], cosine * p[2] - sine * p[0]];
    Mesh::new(mesh.vertices().iter().map(turn).collect(), mesh.faces().to_vec())
}

/// Columns, rows and heights above the picture of all vertices, in pixels.
fn on_screen(mesh: &Mesh, width: usize, height: usize) -> Vec<[f64; 3]> {
    let range = |axis: usize| {
        let coordinates = mesh.vertices().iter().map(|p| p[axis]);
        coordinates.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), c| (low.min(c), high.max(c)))
    };
    let [x, y] = [range(0), range(1)];
    let extent = |(low, high): (f64, f64)| (high - low).max(f64::MIN_POSITIVE);
    let scale = FILL * (width as f64 / extent(x)).min(height as f64 / extent(y));
    let place = |p: &[f64; 3]| {
        let column = 0.5 * width as f64 + scale * (p[0] - 0.5 * (x.0 + x.1));
        let row = 0.5 * height as f64 - scale * (p[1] - 0.5 * (y.0 + y.1));
        [column, row, scale * p[2]]
    };
    mesh.vertices().iter().map(place).collect()
}

/// Pixels with a depth buffer, drawn at twice the size so that edges are smooth.
struct Canvas {
    width: usize,
    height: usize,
    pixels: Vec<[u8; 3]>,
    depth: Vec<f64>,
}

const OVERSAMPLING: usize = 2;

impl Canvas {
    fn new(width: usize, height: usize) -> Self {
        let (width, height) = (width * OVERSAMPLING, height * OVERSAMPLING);
        Self {
            width,
            height,
            pixels: vec![BACKGROUND; width * height],
            depth: vec![f64::NEG_INFINITY; width * height],
        }
    }

    /// Draws a triangle with depth interpolated between its corners and the colours that belong to barycentric weights.
    fn triangle(&mut self, corners: [[f64; 3]; 3], color: impl Fn([f64; 3]) -> [f64; 3]) {
        let corners = corners.map(|c| c.map(|v| v * OVERSAMPLING as f64));
        let [a, b, c] = corners;
        let area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
        if !area.is_finite() || area == 0.0 {
            return;
        }
        let light = shade(a, b, c);
        let bounds = |axis: usize, size: usize| {
            let low = corners.iter().map(|p| p[axis]).fold(f64::INFINITY, f64::min);
            let high = corners.iter().map(|p| p[axis]).fold(f64::NEG_INFINITY, f64::max);
            (low - 0.5).ceil().max(0.0) as usize..((high + 0.5).floor().max(0.0) as usize).min(size)
        };
        for row in bounds(1, self.height) {
            for column in bounds(0, self.width) {
                let p = [column as f64 + 0.5, row as f64 + 0.5];
                let weight = |q: [f64; 3], r: [f64; 3]| {
                    ((q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0])) / area
                };
                let weights = [weight(b, c), weight(c, a), weight(a, b)];
                let depth: f64 = weights.iter().zip(&corners).map(|(w, corner)| w * corner[2]).sum();
                let pixel = row * self.width + column;
                if weights.iter().all(|&w| w >= 0.0) && depth > self.depth[pixel] {
                    self.depth[pixel] = depth;
                    self.pixels[pixel] = color(weights).map(|c| (light * c).clamp(0.0, 255.0) as u8);
                }
            }
        }
    }

    /// Each pixel is the mean of those it was drawn with.
    fn finish(self) -> Picture {
        let (width, height) = (self.width / OVERSAMPLING, self.height / OVERSAMPLING);
        let mean = |row: usize, column: usize, channel: usize| {
            let samples = (0..OVERSAMPLING * OVERSAMPLING).map(|i| {
                let (r, c) =
                    (row * OVERSAMPLING + i / OVERSAMPLING, column * OVERSAMPLING + i % OVERSAMPLING);
                usize::from(self.pixels[r * self.width + c][channel])
            });
            (samples.sum::<usize>() / (OVERSAMPLING * OVERSAMPLING)) as u8
        };
        let pixels = (0..width * height)
            .map(|i| [0, 1, 2].map(|channel| mean(i / width, i % width, channel)))
            .collect();
        Picture { width, height, pixels }
    }
}

/// Brightness of a face by its angle to the viewer; both sides are lit.
fn shade(a: [f64; 3], b: [f64; 3], c: [f64; 3]) -> f64 {
    let (u, v) = ([0, 1, 2].map(|i| b[i] - a[i]), [0, 1, 2].map(|i| c[i] - a[i]));
    let normal = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
    let length = normal.iter().map(|n| n * n).sum::<f64>().sqrt();
    0.35 + 0.65 * (normal[2] / length).abs()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::shapes::icosphere;

    #[test]
    fn a_sphere_is_a_disk_lit_in_the_middle() {
        let mesh = icosphere(4);
        let picture = picture(&mesh, &vec![[200, 100, 0, 255]; mesh.n_vertices()], 100, 100);
        let inside = picture.pixels.iter().filter(|&&p| p != BACKGROUND).count() as f64;
        let disk = std::f64::consts::PI * (0.5 * FILL * 100.0).powi(2);
        assert!((inside / disk - 1.0).abs() < 0.05, "{inside} pixels, a disk has {disk}");
        let (middle, edge) = (picture.pixels[50 * 100 + 50], picture.pixels[50 * 100 + 8]);
        assert!(middle[0] > edge[0] && middle[0] >= 195 && middle[2] == 0, "{middle:?} {edge:?}");
    }

    #[test]
    fn what_is_nearer_hides_what_is_behind() {
        let square =
            |z: f64, size: f64| [[-size, -size, z], [size, -size, z], [size, size, z], [-size, size, z]];
        let vertices = [square(1.0, 0.5), square(0.0, 1.0)].concat();
        let faces = vec![[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]];
        let mesh = Mesh::new(vertices, faces).unwrap();
        let colors: Vec<[u8; 4]> =
            (0..8).map(|i| if i < 4 { [250, 0, 0, 255] } else { [0, 0, 250, 255] }).collect();
        let picture = picture(&mesh, &colors, 40, 40);
        assert_eq!(picture.pixels[20 * 40 + 20], [250, 0, 0]);
        assert_eq!(picture.pixels[20 * 40 + 4], [0, 0, 250]);
        assert_eq!(picture.pixels[0], BACKGROUND);
    }

    #[test]
    fn an_image_lies_on_the_mesh_the_right_way_up() {
        let vertices =
            [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]].map(|[x, y]| [x, y, 0.0]).to_vec();
        let mesh = Mesh::new(vertices, vec![[0, 1, 2], [0, 2, 3]]).unwrap();
        let uvs = [[[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]], [[0.0, 0.0], [1.0, 1.0], [0.0, 1.0]]];
        let image = Picture { width: 2, height: 2, pixels: (1..5).map(|i| [50 * i, 0, 0]).collect() };
        let drawn = textured_picture(&mesh, &uvs, &image, 40, 40);
        let quarters =
            [(10, 10), (10, 30), (30, 10), (30, 30)].map(|(row, column)| drawn.pixels[row * 40 + column]);
        assert_eq!(quarters.to_vec(), image.pixels);
        let nothing = Picture { width: 0, height: 0, pixels: Vec::new() };
        assert_eq!(textured_picture(&mesh, &uvs, &nothing, 40, 40).pixels[20 * 40 + 20], BACKGROUND);
    }

    #[test]
    fn png_reads_back() {
        let read = |picture: Picture| {
            let mut reader = png::Decoder::new(std::io::Cursor::new(picture.to_png())).read_info().unwrap();
            let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
            reader.next_frame(&mut pixels).unwrap();
            pixels
        };
        let pixels = vec![[1, 2, 3], [4, 5, 6]];
        assert_eq!(read(Picture { width: 2, height: 1, pixels }), [1, 2, 3, 4, 5, 6]);
        assert_eq!(read(Picture { width: 0, height: 0, pixels: Vec::new() }), BACKGROUND);
    }

    #[test]
    fn a_pair_shows_both_shapes() {
        let mesh = icosphere(2);
        let map = PointMap::new((0..mesh.n_vertices() as u32).collect(), mesh.n_vertices());
        let picture = pair_picture(&mesh, &mesh, &map, 200).unwrap();
        assert_eq!((picture.width, picture.height), (200, 100));
        assert_eq!(pair_picture(&mesh, &mesh, &map, 1).unwrap().pixels.len(), 2);
        let row = &picture.pixels[50 * 200..51 * 200];
        assert!(row[50] != BACKGROUND && row[150] != BACKGROUND && row[100] == BACKGROUND);
    }
}
