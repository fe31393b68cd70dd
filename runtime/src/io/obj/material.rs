//! The material library: which image the texture coordinates refer to, which colour a face has.

use std::path::{Path, PathBuf};

use crate::io::assemble::MeshBuilder;
use crate::io::attributes::{ReadInfo, Texture};
use crate::io::reference::{find_file, unquoted};
use crate::io::text::{Lines, Words, decode_text, float, quote, without_comment};

/// A library larger than this is not read: materials are a few lines each.
const MAX_LIBRARY_BYTES: u64 = 16 << 20;
/// As many libraries are read.
const MAX_LIBRARIES: usize = 64;
/// As many images are told apart; what matters is whether there is more than one.
const MAX_IMAGES: usize = 16;

/// What is kept of a material.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Material {
    name: Vec<u8>,
    /// The statement behind `map_Kd`.
    diffuse_texture: Option<Vec<u8>>,
    /// `Kd`, each from 0 to 1.
    diffuse: Option<[f32; 3]>,
    /// The folder of its library.
    folder: PathBuf,
}

impl Material {
    pub(super) fn has_image(&self) -> bool {
        self.diffuse_texture.is_some()
    }
}

/// The materials of these names; `None` where no library has one. What could not be read or kept is noted.
pub(super) fn find(
    libraries: &[Vec<u8>],
    used: &[Vec<u8>],
    folder: &Path,
    info: &mut ReadInfo,
) -> Vec<Option<Material>> {
    let (mut materials, mut other_maps) = (Vec::new(), Vec::new());
    for path in libraries
        .iter()
        .flat_map(|names| library_files(folder, names, info))
        .take(MAX_LIBRARIES)
        .collect::<Vec<_>>()
    {
        match read_small_file(&path) {
            Ok(bytes) => {
                let beside = path.parent().unwrap_or(Path::new(""));
                materials.extend(parse(&decode_text(&bytes), beside, &mut other_maps));
                info.files.push(path);
            }
            Err(e) => {
                info.left_out.push(format!("the materials of {}, which cannot be read: {e}", path.display()))
            }
        }
    }
    if !other_maps.is_empty() {
        info.left_out
            .push(format!("the images {} of the materials; map_Kd alone is kept", other_maps.join(", ")));
    }
    let find = |name: &Vec<u8>| {
        let same =
            |spelling: &[u8]| materials.iter().find(|m| spellings(&m.name).contains(&spelling)).cloned();
        spellings(name).into_iter().find_map(same)
    };
    used.iter().map(find).collect()
}

/// A name as it stands, and as it may be meant: without quotes, without a comment behind it.
fn spellings(name: &[u8]) -> [&[u8]; 3] {
    [name, unquoted(name), comment_cut(name)]
}

/// What stands before a `#` that follows white space.
fn comment_cut(text: &[u8]) -> &[u8] {
    let begins = |i: &usize| text[*i] == b'#' && (*i == 0 || text[*i - 1].is_ascii_whitespace());
    (0..text.len()).find(begins).map_or(text, |at| text[..at].trim_ascii())
}

/// The files behind `mtllib`: one whose name may have spaces, or several.
fn library_files(folder: &Path, statement: &[u8], info: &mut ReadInfo) -> Vec<PathBuf> {
    let spellings = [statement, comment_cut(statement)];
    if let Some(path) = spellings.iter().find_map(|name| find_file(folder, name)) {
        return vec![path];
    }
    let mut paths = Vec::new();
    for name in several_names(comment_cut(statement)) {
        match find_file(folder, name) {
            Some(path) => paths.push(path),
            None => info.left_out.push(format!(
                "the materials of {}, which is not there; put it beside the mesh",
                quote(name)
            )),
        }
    }
    paths
}

/// Splits behind each `.mtl` and at quotes; a name of another kind ends at white space.
fn several_names(statement: &[u8]) -> Vec<&[u8]> {
    let mut names = Vec::new();
    let mut rest = statement.trim_ascii();
    while !rest.is_empty() && names.len() < MAX_LIBRARIES {
        let quoted =
            (rest[0] == b'"').then(|| rest[1..].iter().position(|&b| b == b'"')).flatten().map(|end| end + 2);
        let ends = |end: usize| end == rest.len() || rest[end].is_ascii_whitespace();
        let library =
            || (4..=rest.len()).find(|&end| ends(end) && rest[end - 4..end].eq_ignore_ascii_case(b".mtl"));
        let word = || rest.iter().position(u8::is_ascii_whitespace).unwrap_or(rest.len());
        let end = quoted.or_else(library).unwrap_or_else(word);
        names.push(&rest[..end]);
        rest = rest[end..].trim_ascii_start();
    }
    names
}

/// Keeps the image of the first material in use that has one; returns the image of each material by number.
pub(super) fn texture(found: &[Option<Material>], builder: &mut MeshBuilder) -> Vec<Option<usize>> {
    let mut images: Vec<&[u8]> = Vec::new();
    let mut image_of = Vec::new();
    for material in found {
        let image = material.as_ref().and_then(|m| m.diffuse_texture.as_deref());
        image_of.push(image.and_then(|image| {
            let known = images.iter().position(|other| *other == image);
            if known.is_none() && images.len() < MAX_IMAGES {
                images.push(image);
                return Some(images.len() - 1);
            }
            known
        }));
    }
    let owner = found.iter().flatten().find(|m| m.has_image());
    let Some((material, statement)) = owner.and_then(|m| Some((m, m.diffuse_texture.as_deref()?))) else {
        return image_of;
    };
    let names = [image_name(statement), image_name(comment_cut(statement))];
    let found = names.iter().flatten().find_map(|name| find_file(&material.folder, name));
    match found {
        Some(path) => {
            builder.info.files.push(path.clone());
            builder.attributes.texture = Some(Texture::File(path));
        }
        None => builder.info.left_out.push(format!(
            "the image {} of material {}, which is not there; put it beside the mesh",
            quote(names[0].unwrap_or_default()),
            quote(&material.name)
        )),
    }
    if images.len() > 1 {
        builder.info.left_out.push(format!(
            "{} images of the materials besides {}, which alone is kept",
            images.len() - 1,
            quote(names[0].unwrap_or_default())
        ));
    }
    image_of
}

/// Says how many triangles belong to another image than the one that is kept.
pub(super) fn count_other_images(
    image_of: &[Option<usize>],
    runs: &[(usize, usize)],
    builder: &mut MeshBuilder,
) {
    let n_faces = builder.faces.len();
    let ends = runs.iter().skip(1).map(|run| run.0).chain([n_faces]);
    let other = |material: usize| image_of[material].is_some_and(|image| image > 0);
    let count: usize =
        runs.iter().zip(ends).filter(|(run, _)| other(run.1)).map(|(run, end)| end - run.0).sum();
    if count > 0 {
        builder
            .info
            .left_out
            .push(format!("the right image of {count} triangles, whose texture coordinates are for another"));
    }
}

/// Gives the vertices the colours of the materials around them, unless these are one shade of grey, which is no more
/// than a default.
pub(super) fn spread_colors(found: &[Option<Material>], runs: &[(usize, usize)], builder: &mut MeshBuilder) {
    let diffuse = |i: usize| found.get(i).and_then(Option::as_ref).and_then(|m| m.diffuse);
    let mut colors: Vec<[f32; 3]> = (0..found.len()).filter_map(diffuse).collect();
    colors.dedup();
    let is_plain = colors.len() < 2 && colors.iter().all(|[r, g, b]| r == g && g == b);
    if is_plain {
        return;
    }
    let byte = |x: f32| (x * 255.0).round() as u8;
    let mut of_face = vec![None; builder.faces.len()];
    for &(first, material) in runs {
        let color = diffuse(material).map(|c| [byte(c[0]), byte(c[1]), byte(c[2]), 255]);
        of_face[first..].fill(color);
    }
    builder.spread_face_colors(&of_face, "materials");
}

/// Reads `newmtl`, `map_Kd` and `Kd`; the names of further maps go to `other_maps`.
fn parse(bytes: &[u8], folder: &Path, other_maps: &mut Vec<String>) -> Vec<Material> {
    let mut materials: Vec<Material> = Vec::new();
    for line in Lines::new(bytes) {
        let line = line.trim_ascii();
        let end = line.iter().position(u8::is_ascii_whitespace).unwrap_or(line.len());
        let (keyword, rest) = (line[..end].to_ascii_lowercase(), line[end..].trim_ascii());
        match (keyword.as_slice(), materials.last_mut()) {
            (b"newmtl", _) => materials.push(Material {
                name: rest.to_vec(),
                diffuse_texture: None,
                diffuse: None,
                folder: folder.into(),
            }),
            (b"map_kd", Some(material)) => {
                material.diffuse_texture = image_name(rest).map(|_| rest.to_vec());
            }
            (b"kd", Some(material)) => material.diffuse = color(rest),
            (map, Some(_)) if map.starts_with(b"map_") || matches!(map, b"bump" | b"norm" | b"disp") => {
                let map = String::from_utf8_lossy(&line[..end]).into_owned();
                if other_maps.len() < MAX_IMAGES && !other_maps.contains(&map) {
                    other_maps.push(map);
                }
            }
            _ => {}
        }
    }
    materials
}

/// Red, green and blue, or one number for all three.
fn color(statement: &[u8]) -> Option<[f32; 3]> {
    let mut numbers =
        Words::new(without_comment(statement), 0).map(|word| float(word).map(|x| (x as f32).clamp(0.0, 1.0)));
    let r = numbers.next()??;
    match numbers.next() {
        None => Some([r; 3]),
        Some(g) => Some([r, g?, numbers.next()??]),
    }
}

/// The file behind a map's options (`-s 1 1 1`, `-clamp on` and the like); its name may have spaces.
fn image_name(statement: &[u8]) -> Option<&[u8]> {
    let mut rest = statement.trim_ascii();
    while rest.starts_with(b"-") {
        let option;
        (option, rest) = first_word(rest);
        let arguments = match option {
            b"-s" | b"-o" | b"-t" => 3,
            b"-mm" => 2,
            _ => 1,
        };
        for taken in 0..arguments {
            let (word, after) = first_word(rest);
            // The second and third of three numbers may be left out.
            if taken > 0 && float(word).is_none() {
                break;
            }
            rest = after;
        }
    }
    Some(rest).filter(|name| !name.is_empty())
}

fn first_word(text: &[u8]) -> (&[u8], &[u8]) {
    let end = text.iter().position(u8::is_ascii_whitespace).unwrap_or(text.len());
    (&text[..end], text[end..].trim_ascii_start())
}

fn read_small_file(path: &Path) -> std::io::Result<Vec<u8>> {
    let metadata = std::fs::metadata(path)?;
    if !metadata.is_file() || metadata.len() > MAX_LIBRARY_BYTES {
        return Err(std::io::Error::other(format!("not a file of at most {} MiB", MAX_LIBRARY_BYTES >> 20)));
    }
    std::fs::read(path)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn image(material: &Material) -> Option<&str> {
        std::str::from_utf8(image_name(material.diffuse_texture.as_deref()?)?).ok()
    }

    #[test]
    fn names_and_images() {
        let text = b"# two\r\nnewmtl two words\nKa 1\nKd\nmap_Kd -s 1 1 -clamp on my skin.png\nnewmtl b\nmap_kd b.jpg\n\
                     map_Bump -bm 0.2 b.png\nKd 1 0.5 0 # orange\n";
        let mut maps = Vec::new();
        let found = parse(text, Path::new(""), &mut maps);
        assert_eq!(found.len(), 2);
        assert_eq!((found[0].name.as_slice(), image(&found[0])), (&b"two words"[..], Some("my skin.png")));
        assert_eq!((found[1].name.as_slice(), image(&found[1])), (&b"b"[..], Some("b.jpg")));
        assert_eq!((found[0].diffuse, found[1].diffuse), (None, Some([1.0, 0.5, 0.0])));
        assert_eq!(maps, ["map_Bump"]);
        assert_eq!(
            parse(b"map_Kd orphan.png\nnewmtl a\nmap_Kd -bm\n", Path::new(""), &mut maps)[0].diffuse_texture,
            None
        );
    }

    #[test]
    fn several_libraries_and_names_with_spaces() {
        let names = |statement: &str| {
            several_names(statement.as_bytes())
                .into_iter()
                .map(|n| String::from_utf8_lossy(n).into_owned())
                .collect::<Vec<_>>()
        };
        assert_eq!(names("a.mtl b.MTL"), ["a.mtl", "b.MTL"]);
        assert_eq!(names("my body.mtl  other.mtl "), ["my body.mtl", "other.mtl"]);
        assert_eq!(names("\"my body.mtl\" other"), ["\"my body.mtl\"", "other"]);
        assert_eq!(names(""), Vec::<String>::new());
    }
}
