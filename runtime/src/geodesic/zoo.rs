//! Small meshes for the tests of this module.

use crate::Mesh;

/// Flat `[0, cols - 1] x [0, rows - 1]` grid, every square cut along the same diagonal.
pub(crate) fn grid(cols: usize, rows: usize) -> Mesh {
    let vertices = (0..rows * cols).map(|i| [(i % cols) as f64, (i / cols) as f64, 0.0]).collect();
    let mut faces = Vec::new();
    for y in 0..rows - 1 {
        for x in 0..cols - 1 {
            let at = |dx, dy| ((y + dy) * cols + x + dx) as u32;
            faces.push([at(0, 0), at(1, 0), at(1, 1)]);
            faces.push([at(0, 0), at(1, 1), at(0, 1)]);
        }
    }
    Mesh::new(vertices, faces).unwrap()
}

/// Surface of the unit cube with `n` by `n` squares a side; vertices 0 and last are opposite corners.
pub(crate) fn cube(n: usize) -> Mesh {
    let mut vertices: Vec<[f64; 3]> = Vec::new();
    let mut ids = std::collections::BTreeMap::new();
    let mut id = |key: [usize; 3]| {
        *ids.entry(key).or_insert_with(|| {
            vertices.push(key.map(|k| k as f64 / n as f64));
            vertices.len() as u32 - 1
        })
    };
    let mut faces = Vec::new();
    id([0, 0, 0]);
    for axis in 0..3 {
        for level in [0, n] {
            for (u, v) in (0..n * n).map(|i| (i % n, i / n)) {
                let mut at = |du: usize, dv: usize| {
                    let mut key = [0; 3];
                    (key[axis], key[(axis + 1) % 3], key[(axis + 2) % 3]) = (level, u + du, v + dv);
                    id(key)
                };
                let [a, b, c, d] = [at(0, 0), at(1, 0), at(1, 1), at(0, 1)];
                let quad = if level == 0 { [[a, c, b], [a, d, c]] } else { [[a, b, c], [a, c, d]] };
                faces.extend(quad);
            }
        }
    }
    let last = id([n, n, n]) as usize;
    let end = vertices.len() - 1;
    vertices.swap(last, end);
    for index in faces.iter_mut().flatten() {
        *index = match *index as usize {
            i if i == last => end as u32,
            i if i == end => last as u32,
            i => i as u32,
        };
    }
    Mesh::new(vertices, faces).unwrap()
}

/// Unit sphere: an octahedron subdivided `levels` times.
pub(crate) fn sphere(levels: usize) -> Mesh {
    let n = 1usize << levels;
    let mut vertices: Vec<[f64; 3]> = Vec::new();
    let mut ids = std::collections::BTreeMap::new();
    let mut faces = Vec::new();
    for octant in 0u32..8 {
        let sign = |axis: usize| if octant >> axis & 1 == 0 { 1i64 } else { -1 };
        let mut at = |u: usize, v: usize| {
            let key = [sign(0) * u as i64, sign(1) * v as i64, sign(2) * (n - u - v) as i64];
            *ids.entry(key).or_insert_with(|| {
                let p = key.map(|x| x as f64);
                let length = crate::mesh::vec3::norm(p);
                vertices.push(p.map(|x| x / length));
                vertices.len() as u32 - 1
            })
        };
        for u in 0..n {
            for v in 0..n - u {
                let mut face = |mut f: [u32; 3]| {
                    if octant.count_ones() % 2 == 1 {
                        f.swap(1, 2);
                    }
                    faces.push(f);
                };
                face([at(u, v), at(u + 1, v), at(u, v + 1)]);
                if u + v + 2 <= n {
                    face([at(u + 1, v), at(u + 1, v + 1), at(u, v + 1)]);
                }
            }
        }
    }
    Mesh::new(vertices, faces).unwrap()
}

/// Three triangles that share the edge 0-1.
pub(crate) fn book() -> Mesh {
    let vertices = vec![[0.0; 3], [1.0, 0.0, 0.0], [0.5, 1.0, 0.0], [0.5, 0.0, 1.0], [0.5, -1.0, 0.0]];
    Mesh::new(vertices, vec![[0, 1, 2], [0, 1, 3], [0, 1, 4]]).unwrap()
}
