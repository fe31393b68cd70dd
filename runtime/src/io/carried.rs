//! What attributes there are, and what a format cannot hold of them.

use std::path::{Path, PathBuf};

use super::attributes::{Attributes, IntegerField, IntegerKind, Texture};
use super::format::MeshFormat;

impl Attributes {
    /// Whether there is nothing.
    pub fn is_empty(&self) -> bool {
        *self == Self::default()
    }

    /// What there is, each as a noun: `colours`, `the scalar field 'quality'`.
    pub fn names(&self) -> Vec<String> {
        let mut names = Vec::new();
        if self.vertex_colors.is_some() {
            names.push("colours".to_owned());
        }
        if self.corner_uvs.is_some() {
            names.push("texture coordinates".to_owned());
        }
        match &self.texture {
            Some(Texture::File(path)) => names.push(format!("the image {}", path.display())),
            Some(Texture::Embedded { bytes, .. }) => {
                names.push(format!("an embedded image of {} bytes", bytes.len()))
            }
            None => {}
        }
        names.extend(self.vertex_scalars.iter().map(|(name, _)| format!("the scalar field '{name}'")));
        names.extend(self.vertex_integers.iter().map(|field| format!("the integers '{}'", field.name)));
        if let Some(skin) = &self.skin {
            names.push(format!("skin weights of {} joints", skin.joints.len()));
        }
        names
    }

    /// These attributes, and those of `own` that are not among them; with the names of what of `own` they replace.
    /// Both are of one mesh.
    pub fn beside(mut self, own: &Self) -> (Self, Vec<String>) {
        let mut kept = own.clone();
        let mut replaced = Self::default();
        if self.vertex_colors.is_some() {
            replaced.vertex_colors = kept.vertex_colors.take();
        }
        if self.corner_uvs.is_some() {
            replaced.corner_uvs = kept.corner_uvs.take();
            replaced.texture = kept.texture.take();
        }
        if self.skin.is_some() {
            replaced.skin = kept.skin.take();
        }
        let scalars = self.vertex_scalars.iter().map(|(name, _)| name.clone());
        let taken: Vec<String> = scalars.chain(self.vertex_integers.iter().map(|f| f.name.clone())).collect();
        let (gone, stays) = kept.vertex_scalars.drain(..).partition(|(name, _)| taken.contains(name));
        (replaced.vertex_scalars, kept.vertex_scalars) = (gone, stays);
        let (gone, stays) = kept.vertex_integers.drain(..).partition(|field| taken.contains(&field.name));
        (replaced.vertex_integers, kept.vertex_integers) = (gone, stays);
        self.vertex_colors = self.vertex_colors.or(kept.vertex_colors);
        if self.corner_uvs.is_none() {
            (self.corner_uvs, self.texture) = (kept.corner_uvs, kept.texture);
        }
        self.skin = self.skin.or(kept.skin);
        self.vertex_scalars.extend(kept.vertex_scalars);
        self.vertex_integers.extend(kept.vertex_integers);
        (self, replaced.names())
    }

    /// What of these attributes a mesh file at `path` cannot hold, each as a noun with the remedy.
    /// [`write_mesh`](super::write_mesh) leaves it out.
    pub fn not_held_by(&self, path: &Path) -> Vec<String> {
        let Some(format) = MeshFormat::from_path(path) else { return Vec::new() };
        let mut lost = Vec::new();
        let (has_texture, has_fields) = match format {
            MeshFormat::Off | MeshFormat::Stl | MeshFormat::Gltf => (false, false),
            MeshFormat::Obj => (true, false),
            MeshFormat::Ply | MeshFormat::Glb => (true, true),
        };
        if !has_texture && self.corner_uvs.is_some() {
            lost.push("texture coordinates and image; write a .ply, .obj or .glb for them".to_owned());
        }
        if has_texture {
            lost.extend(self.image_not_held());
        }
        if !has_fields {
            let scalars = self.vertex_scalars.iter().map(|(name, _)| format!("the scalar field '{name}'"));
            let integers = self.vertex_integers.iter().map(|field| format!("the integers '{}'", field.name));
            lost.extend(scalars.chain(integers).map(|what| format!("{what}; write a .ply or .glb for it")));
        }
        if format == MeshFormat::Glb {
            let too_large = self.vertex_integers.iter().filter(|field| field.in_glb().is_none());
            lost.extend(
                too_large
                    .map(|f| format!("the integers '{}', too large for glTF; write a .ply for them", f.name)),
            );
        }
        if format == MeshFormat::Obj && self.vertex_colors.iter().flatten().any(|c| c[3] != 255) {
            lost.push("the alpha of the colours; write a .ply, .off or .glb for it".to_owned());
        }
        if format != MeshFormat::Glb && self.skin.is_some() {
            lost.push("the skin weights; write a .glb for them".to_owned());
        }
        lost
    }

    fn image_not_held(&self) -> Option<String> {
        match &self.texture {
            Some(_) if self.corner_uvs.is_none() => {
                Some("the image, since there are no texture coordinates for it".to_owned())
            }
            Some(Texture::File(path)) if !path.is_file() => Some(format!(
                "the image {}, which is not there; put it there and run this again",
                path.display()
            )),
            _ => None,
        }
    }

    /// The files that [`write_mesh`](super::write_mesh) writes at `path` with these attributes: the mesh, its
    /// materials, its image.
    pub fn files_written(&self, path: &Path) -> Vec<PathBuf> {
        let mut files = vec![path.to_path_buf()];
        let Some(texture) = self.texture.as_ref().filter(|t| self.corner_uvs.is_some() && t.exists()) else {
            return files;
        };
        match MeshFormat::from_path(path) {
            Some(MeshFormat::Obj) => {
                files.push(path.with_extension("mtl"));
                files.extend(texture.written_beside(path));
            }
            Some(MeshFormat::Ply) => files.extend(texture.written_beside(path)),
            Some(MeshFormat::Glb) if !texture.is_embeddable() => files.extend(texture.written_beside(path)),
            _ => {}
        }
        files
    }
}

/// How integers are stored in glTF.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum GlbIntegers {
    /// As they are, in a type of 8 or 16 bits.
    As(IntegerKind),
    /// As single-precision numbers, which hold them exactly: glTF has no larger integers for vertices.
    Floats,
}

impl IntegerField {
    /// The way that glTF holds all values exactly, if there is one.
    pub(super) fn in_glb(&self) -> Option<GlbIntegers> {
        let within = |low: i64, high: i64| self.values.iter().all(|v| (low..=high).contains(v));
        let small = [IntegerKind::U8, IntegerKind::I8, IntegerKind::U16, IntegerKind::I16];
        let signed = self.kind.range().0 < 0;
        let same_sign = small.into_iter().filter(|kind| (kind.range().0 < 0) == signed);
        let fitting = same_sign.into_iter().find(|kind| within(kind.range().0, kind.range().1));
        fitting.map(GlbIntegers::As).or_else(|| within(-(1 << 24), 1 << 24).then_some(GlbIntegers::Floats))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn attributes() -> Attributes {
        let integers = |name: &str, largest| IntegerField {
            name: name.into(),
            kind: IntegerKind::I32,
            values: vec![0, largest],
        };
        Attributes {
            vertex_colors: Some(vec![[1, 2, 3, 4]]),
            corner_uvs: Some(Vec::new()),
            texture: Some(Texture::File("/absent/skin.png".into())),
            vertex_scalars: vec![("quality".into(), Vec::new())],
            vertex_integers: vec![integers("label", 300), integers("id", 16_777_217)],
            skin: Some(Default::default()),
        }
    }

    #[test]
    fn every_format_names_what_it_cannot_hold() {
        let lost = |name: &str| attributes().not_held_by(Path::new(name)).join("\n");
        for (name, words, others) in [
            ("a.off", &["texture", "quality", "label", "id", "skin"][..], &["alpha"][..]),
            ("a.obj", &["/absent/skin.png", "quality", "label", "alpha", "skin"], &["coordinates"]),
            ("a.ply", &["/absent/skin.png", "skin weights"], &["quality", "label", "alpha"]),
            ("a.glb", &["/absent/skin.png", "'id', too large"], &["quality", "label", "skin weights"]),
        ] {
            let text = lost(name);
            assert!(words.iter().all(|word| text.contains(word)), "{name}: {text}");
            assert!(!others.iter().any(|word| text.contains(word)), "{name}: {text}");
        }
        assert_eq!(Attributes::default().not_held_by(Path::new("a.off")), Vec::<String>::new());
        assert_eq!(attributes().names().len(), 7);
    }

    #[test]
    fn what_one_has_and_the_other_has_not() {
        let given = Attributes {
            skin: Some(Default::default()),
            vertex_scalars: vec![("quality".into(), vec![7.0])],
            ..Attributes::default()
        };
        let (both, replaced) = given.clone().beside(&attributes());
        assert_eq!(
            (&both.vertex_colors, &both.texture),
            (&attributes().vertex_colors, &attributes().texture)
        );
        assert_eq!(both.vertex_scalars, given.vertex_scalars);
        assert_eq!(both.vertex_integers, attributes().vertex_integers);
        assert_eq!(replaced, ["the scalar field 'quality'", "skin weights of 0 joints"]);
        let (same, replaced) = Attributes::default().beside(&attributes());
        assert_eq!((same, replaced.len()), (attributes(), 0));
    }

    #[test]
    fn every_file_that_is_written_is_known_before() {
        let folder = tempfile::tempdir().unwrap();
        let mesh =
            crate::Mesh::new(vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]], vec![[0, 1, 2]]).unwrap();
        let elsewhere = tempfile::tempdir().unwrap();
        let image = elsewhere.path().join("skin.tga");
        std::fs::write(&image, "TGA").unwrap();
        for (i, texture) in [
            None,
            Some(Texture::File(image.clone())),
            Some(Texture::File("/absent/skin.png".into())),
            Some(Texture::Embedded { bytes: vec![1], mime: "image/png".into() }),
        ]
        .into_iter()
        .enumerate()
        {
            for extension in ["off", "obj", "ply", "glb"] {
                let inner = folder.path().join(format!("{i}{extension}"));
                std::fs::create_dir(&inner).unwrap();
                let attributes = Attributes {
                    corner_uvs: Some(vec![[[0.0; 2]; 3]]),
                    texture: texture.clone(),
                    ..Default::default()
                };
                let path = inner.join(format!("a.{extension}"));
                let mut expected = attributes.files_written(&path);
                crate::io::write_mesh(&path, &mesh, &attributes).unwrap();
                let mut found: Vec<PathBuf> =
                    std::fs::read_dir(&inner).unwrap().map(|entry| entry.unwrap().path()).collect();
                expected.sort();
                found.sort();
                assert_eq!(found, expected, "{texture:?}");
            }
        }
    }
}
