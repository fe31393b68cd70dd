//! What a mesh file carries besides the triangles.

use std::path::PathBuf;

use super::MeshFormat;
use crate::Mesh;

/// A mesh file's content.
#[derive(Clone, Debug, PartialEq)]
pub struct MeshFile {
    /// The triangles.
    pub mesh: Mesh,
    /// What belongs to its vertices and corners.
    pub attributes: Attributes,
    /// How the file was understood.
    pub info: ReadInfo,
}

/// How a mesh file was understood.
#[derive(Clone, Debug, PartialEq)]
pub struct ReadInfo {
    /// The format.
    pub format: MeshFormat,
    /// Polygons of more than three corners, which were split into triangle fans.
    pub n_polygons: usize,
    /// Faces of fewer than three corners (points, edges), which were left out.
    pub n_ignored_faces: usize,
    /// What changes the geometry: places of the file that were understood in a way that may not be meant, or left
    /// out. In sentences for the user of any command.
    pub warnings: Vec<String>,
    /// What the file carries besides the geometry that was not kept, each as a noun: for who wants to carry
    /// attributes over.
    pub left_out: Vec<String>,
    /// Names of groups and objects with faces in them, in the order of the file. They are not kept.
    pub groups: Vec<String>,
    /// The further files that belong to this one: material libraries, images, buffers.
    pub files: Vec<PathBuf>,
}

impl ReadInfo {
    pub(super) fn new(format: MeshFormat) -> Self {
        Self {
            format,
            n_polygons: 0,
            n_ignored_faces: 0,
            warnings: Vec::new(),
            left_out: Vec::new(),
            groups: Vec::new(),
            files: Vec::new(),
        }
    }
}

/// Attributes of a mesh of `n` vertices and `m` triangles. Empty by default.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct Attributes {
    /// Colours, `[n]`: red, green, blue, alpha (255 is opaque), in sRGB as images are.
    pub vertex_colors: Option<Vec<[u8; 4]>>,
    /// Texture coordinates (u, v) of each triangle's three corners, `[m, 3, 2]`; `(0, 0)` is the image's lower left.
    pub corner_uvs: Option<Vec<[[f32; 2]; 3]>>,
    /// The image that `corner_uvs` refers to; it is not written without these.
    pub texture: Option<Texture>,
    /// Named scalar fields, each `[n]`.
    pub vertex_scalars: Vec<(String, Vec<f64>)>,
    /// Named fields of integers: labels, identities, which have no values in between.
    pub vertex_integers: Vec<IntegerField>,
    /// Skin weights.
    pub skin: Option<Skin>,
}

/// A field of integers, `[n]`.
#[derive(Clone, Debug, PartialEq)]
pub struct IntegerField {
    /// Its name.
    pub name: String,
    /// The type that it has in files.
    pub kind: IntegerKind,
    /// The values, each in the range of the type.
    pub values: Vec<i64>,
}

/// A type of integers in files.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs, reason = "the names say it")]
#[non_exhaustive]
pub enum IntegerKind {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
}

impl IntegerKind {
    /// The smallest and the largest number.
    pub fn range(self) -> (i64, i64) {
        match self {
            Self::I8 => (i8::MIN.into(), i8::MAX.into()),
            Self::U8 => (0, u8::MAX.into()),
            Self::I16 => (i16::MIN.into(), i16::MAX.into()),
            Self::U16 => (0, u16::MAX.into()),
            Self::I32 => (i32::MIN.into(), i32::MAX.into()),
            Self::U32 => (0, u32::MAX.into()),
        }
    }

    /// What stands for no value: -1, or without a sign 0.
    pub fn missing(self) -> i64 {
        self.range().0.max(-1)
    }

    /// The bytes of a number of this type, the least significant first.
    pub(super) fn put(self, value: i64, bytes: &mut Vec<u8>) {
        let n = match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 => 4,
        };
        bytes.extend(&value.to_le_bytes()[..n]);
    }
}

/// A colour image.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Texture {
    /// A file. One that does not exist is not referred to by any writer.
    File(PathBuf),
    /// An encoded image that came inside the mesh file.
    Embedded {
        /// The encoded image.
        bytes: Vec<u8>,
        /// `image/png` or `image/jpeg`.
        mime: String,
    },
}

/// Linear blend skinning: up to four joints move each vertex.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct Skin {
    /// The joints of the skeleton, parents before children.
    pub joints: Vec<Joint>,
    /// For each vertex four indices into `joints`, `[n, 4]`.
    pub indices: Vec<[u16; 4]>,
    /// For each vertex the weights of the four joints, `[n, 4]`, as in the file, where they mostly sum to 1; 0
    /// where fewer than four act.
    pub weights: Vec<[f32; 4]>,
}

/// A joint of a skeleton, in the pose in which the mesh is given.
#[derive(Clone, Debug, PartialEq)]
pub struct Joint {
    /// Its name, which may be empty.
    pub name: String,
    /// The index of its parent joint, if it has one.
    pub parent: Option<u16>,
    /// Its frame in the mesh's coordinates: a 4 x 4 matrix of four columns, the last the joint's place.
    pub frame: [[f64; 4]; 4],
}

impl Attributes {
    /// Whether every attribute has the mesh's size; if not, what is wrong and what to do.
    pub(crate) fn check(&self, mesh: &Mesh) -> Result<(), (String, &'static str)> {
        let (n, m) = (mesh.n_vertices(), mesh.n_faces());
        self.sizes(n, m).find(|&(_, found, expected)| found != expected).map_or(
            Ok(()),
            |(what, found, expected)| {
                Err((
                    format!("there are {found} {what}, but the mesh calls for {expected}"),
                    "pass attributes made for this mesh",
                ))
            },
        )?;
        self.skin.as_ref().map_or(Ok(()), Skin::check)
    }

    fn sizes(&self, n: usize, m: usize) -> impl Iterator<Item = (String, usize, usize)> {
        let scalars = self
            .vertex_scalars
            .iter()
            .map(move |(name, values)| (format!("values of '{name}'"), values.len(), n));
        let integers = self
            .vertex_integers
            .iter()
            .map(move |field| (format!("values of '{}'", field.name), field.values.len(), n));
        let skin = self.skin.iter().flat_map(move |skin| {
            [
                ("joint indices".to_owned(), skin.indices.len(), n),
                ("joint weights".to_owned(), skin.weights.len(), n),
            ]
        });
        let colors = self.vertex_colors.iter().map(move |c| ("vertex colours".to_owned(), c.len(), n));
        let uvs =
            self.corner_uvs.iter().map(move |c| ("faces with texture coordinates".to_owned(), c.len(), m));
        colors.chain(uvs).chain(scalars).chain(integers).chain(skin)
    }
}

impl Skin {
    fn check(&self) -> Result<(), (String, &'static str)> {
        let n_joints = self.joints.len();
        let exists = |joint: u16| usize::from(joint) < n_joints;
        let acts = |i: usize, c: usize| self.weights[i][c] != 0.0;
        if let Some((vertex, _)) = self
            .indices
            .iter()
            .enumerate()
            .find(|(i, joints)| (0..4).any(|c| acts(*i, c) && !exists(joints[c])))
        {
            let problem = format!("vertex {vertex} has a joint that does not exist; there are {n_joints}");
            return Err((problem, "list every joint that is used"));
        }
        // Parents come first, so that the skeleton is a forest.
        if let Some(joint) =
            (0..n_joints).find(|&j| self.joints[j].parent.is_some_and(|p| usize::from(p) >= j))
        {
            let problem = format!("joint {joint} comes before its parent");
            return Err((problem, "list the joints from the root of the skeleton outward"));
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn attributes_of_another_size_are_refused() {
        let mesh = Mesh::new(vec![[0.0; 3]; 3], vec![[0, 1, 2]]).unwrap();
        assert!(Attributes::default().check(&mesh).is_ok());
        let attributes = Attributes { vertex_colors: Some(vec![[0; 4]; 2]), ..Default::default() };
        assert!(attributes.check(&mesh).unwrap_err().0.contains("2 vertex colours"));
        let attributes =
            Attributes { vertex_scalars: vec![("f".into(), vec![0.0; 4])], ..Default::default() };
        assert!(attributes.check(&mesh).unwrap_err().0.contains("'f'"));
    }
}
