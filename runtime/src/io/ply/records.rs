//! The records of the elements: vertices, faces, triangle strips.

use super::columns::{self, Colors, Field};
use super::header::{Element, Kind, Number, Property};
use super::source::Source;
use crate::io::assemble::{MeshBuilder, strip_triangles};
use crate::io::error::{ParseError, Parsed};

/// Where a vertex property goes.
enum Slot {
    Coordinate(usize),
    Color(usize, Number),
    Uv(usize),
    Field(usize),
    Skip,
}

/// The slot of each property. Lists are noted as left out, normals passed over.
fn slots(
    element: &Element,
    colors: Option<&Colors>,
    uvs: Option<[usize; 2]>,
    fields: &mut Vec<Field>,
    left_out: &mut Vec<String>,
) -> Vec<Slot> {
    let slot = |(i, property): (usize, &Property)| {
        let Kind::Scalar(kind) = property.kind else {
            left_out.push(format!("the list '{}' of the vertices", property.name));
            return Slot::Skip;
        };
        if let Some(channel) = colors.and_then(|c| c.at.iter().position(|at| *at == Some(i))) {
            return Slot::Color(channel, kind);
        }
        if let Some(axis) = uvs.and_then(|uvs| uvs.iter().position(|at| *at == i)) {
            return Slot::Uv(axis);
        }
        match property.name.as_str() {
            "x" => Slot::Coordinate(0),
            "y" => Slot::Coordinate(1),
            "z" => Slot::Coordinate(2),
            "nx" | "ny" | "nz" => Slot::Skip,
            name => {
                fields.push(Field { name: name.to_owned(), kind: kind.integer_kind(), values: Vec::new() });
                Slot::Field(fields.len() - 1)
            }
        }
    };
    element.properties.iter().enumerate().map(slot).collect()
}

/// Reads the vertices and their attributes; returns the texture coordinates, if there are any.
pub(super) fn read_vertices<S: Source>(
    source: &mut S,
    element: &Element,
    builder: &mut MeshBuilder,
) -> Parsed<Vec<[f32; 2]>> {
    let (mut fields, mut colors, has_uv) = (Vec::new(), Colors::of(element), columns::uvs(element));
    let slots = slots(element, colors.as_ref(), has_uv, &mut fields, &mut builder.info.left_out);
    check_coordinates(&slots)?;
    let mut uvs = Vec::new();
    builder.vertices.reserve_exact(element.count);
    for vertex in 0..element.count {
        let (mut position, mut color, mut uv) = ([0.0; 3], [0.0; 4], [0.0; 2]);
        for (property, slot) in element.properties.iter().zip(&slots) {
            let (Kind::Scalar(kind), false) = (property.kind, matches!(slot, Slot::Skip)) else {
                source.skip_property(property).map_err(|e| e.within(place(element, vertex)))?;
                continue;
            };
            let value = source.number(kind).map_err(|e| e.within(place(element, vertex)))?;
            match slot {
                Slot::Coordinate(axis) => position[*axis] = value,
                Slot::Color(channel, kind) => color[*channel] = Colors::value(value, *kind),
                Slot::Uv(axis) => uv[*axis] = value as f32,
                Slot::Field(field) => fields[*field].values.push(value),
                Slot::Skip => {}
            }
        }
        let problem = (!position.iter().all(|x| x.is_finite())).then(|| {
            let problem = format!("the position is not finite: {position:?}");
            source.error(problem).within(place(element, vertex))
        });
        builder.vertex((position, problem));
        if let Some(colors) = &mut colors {
            colors.values.push(color);
        }
        uvs.extend(has_uv.is_some().then_some(uv));
    }
    builder.attributes.vertex_colors = colors.map(|colors| colors.to_bytes());
    for field in fields {
        match field.into_integers() {
            Ok(field) => builder.attributes.vertex_integers.push(field),
            Err(scalars) => builder.attributes.vertex_scalars.push(scalars),
        }
    }
    Ok(uvs)
}

fn check_coordinates(slots: &[Slot]) -> Parsed<()> {
    let found = |axis| slots.iter().filter(|slot| matches!(slot, Slot::Coordinate(a) if *a == axis)).count();
    match (0..3).find(|&axis| found(axis) != 1) {
        None => Ok(()),
        Some(axis) => {
            let name = ["x", "y", "z"][axis];
            let problem =
                format!("the vertices have {} scalar properties '{name}' instead of one", found(axis));
            Err(ParseError::part("header", problem))
        }
    }
}

/// What the faces carry besides corners and their texture coordinates.
#[derive(Default)]
pub(super) struct FaceColumns {
    colors: Option<Colors>,
    /// The number of each face's image.
    images: Vec<u32>,
    /// The face that each triangle is of; empty where nothing is carried.
    face_of_triangle: Vec<u32>,
}

impl FaceColumns {
    /// Gives the colours to the vertices; returns the number of each triangle's image.
    pub(super) fn finish(self, builder: &mut MeshBuilder) -> Vec<u32> {
        if let Some(colors) = self.colors {
            let bytes = colors.to_bytes();
            let of_triangle = |&face: &u32| bytes.get(face as usize).copied();
            let of_face: Vec<Option<[u8; 4]>> = self.face_of_triangle.iter().map(of_triangle).collect();
            builder.spread_face_colors(&of_face, "faces");
        }
        self.face_of_triangle.iter().filter_map(|&face| self.images.get(face as usize).copied()).collect()
    }
}

/// Reads polygons and, where there is a list `texcoord`, the texture coordinates of their corners.
pub(super) fn read_faces<S: Source>(
    source: &mut S,
    element: &Element,
    n_vertices: usize,
    builder: &mut MeshBuilder,
) -> Parsed<FaceColumns> {
    let (mut items, mut corners, mut uvs) = (Vec::new(), Vec::new(), Vec::new());
    let mut faces = FaceColumns { colors: Colors::of(element), ..Default::default() };
    let image = columns::scalar(element, "texnumber").map(|(i, _)| i);
    let colors_at = faces.colors.as_ref().map_or([None; 4], |colors| colors.at);
    let carried = |i: usize| image == Some(i) || colors_at.contains(&Some(i));
    for (i, property) in element.properties.iter().enumerate() {
        let known = matches!(
            property.name.as_str(),
            "vertex_indices" | "vertex_index" | "texcoord" | "nx" | "ny" | "nz"
        );
        if !known && !carried(i) {
            builder.info.left_out.push(format!("the property '{}' of the faces", property.name));
        }
    }
    // A face takes at least 4 bytes in any encoding of a triangle mesh; others only make the vector grow.
    builder.faces.reserve(element.count.min(source.remaining() / 4));
    for face in 0..element.count {
        corners.clear();
        uvs.clear();
        let mut color = [0.0; 4];
        for (i, property) in element.properties.iter().enumerate() {
            let read = match (property.name.as_str(), property.kind) {
                ("vertex_indices" | "vertex_index", Kind::List { length, item }) => source
                    .list(length, item, &mut items)
                    .and_then(|()| indices(source, &items, n_vertices, &mut corners)),
                ("texcoord", Kind::List { length, item }) => {
                    source.list(length, item, &mut items).map(|()| {
                        uvs.extend(items.chunks_exact(2).map(|uv| [uv[0] as f32, uv[1] as f32]));
                    })
                }
                (_, Kind::Scalar(kind)) if carried(i) => {
                    source.number(kind).map(|value| match colors_at.iter().position(|at| *at == Some(i)) {
                        Some(channel) => color[channel] = Colors::value(value, kind),
                        None => faces.images.push(value as u32),
                    })
                }
                _ => source.skip_property(property),
            };
            read.map_err(|e| e.within(place(element, face)))?;
        }
        builder.polygon_with_uvs(&corners, Some(uvs.as_slice()).filter(|uvs| !uvs.is_empty()));
        if let Some(colors) = &mut faces.colors {
            colors.values.push(color);
        }
        if faces.colors.is_some() || image.is_some() {
            faces.face_of_triangle.resize(builder.faces.len(), face as u32);
        }
    }
    Ok(faces)
}

/// Reads triangle strips: vertex indices, with -1 between two strips.
pub(super) fn read_strips<S: Source>(
    source: &mut S,
    element: &Element,
    n_vertices: usize,
    builder: &mut MeshBuilder,
) -> Parsed<()> {
    let (mut items, mut corners) = (Vec::new(), Vec::new());
    for strip in 0..element.count {
        for property in &element.properties {
            let Kind::List { length, item } = property.kind else {
                source.skip_property(property).map_err(|e| e.within(place(element, strip)))?;
                continue;
            };
            source.list(length, item, &mut items).map_err(|e| e.within(place(element, strip)))?;
            let strip_items: Vec<i64> = items.iter().map(|&i| i as i64).collect();
            for triangle in strip_triangles(&strip_items) {
                corners.clear();
                let triangle = triangle.map(|i| i as f64);
                indices(source, &triangle, n_vertices, &mut corners)
                    .map_err(|e| e.within(place(element, strip)))?;
                builder.polygon(&corners);
            }
        }
    }
    Ok(())
}

/// Passes over an element that is not used.
pub(super) fn skip<S: Source>(source: &mut S, element: &Element) -> Parsed<()> {
    if element.properties.is_empty() {
        return Ok(());
    }
    (0..element.count).try_for_each(|i| {
        element
            .properties
            .iter()
            .try_for_each(|p| source.skip_property(p))
            .map_err(|e| e.within(place(element, i)))
    })
}

fn indices<S: Source>(source: &S, items: &[f64], n_vertices: usize, corners: &mut Vec<u32>) -> Parsed<()> {
    for &item in items {
        if item < 0.0 || item >= n_vertices as f64 || item.fract() != 0.0 {
            return Err(
                source.error(format!("vertex {item} does not exist: there are {n_vertices}, counted from 0"))
            );
        }
        corners.push(item as u32);
    }
    Ok(())
}

fn place(element: &Element, i: usize) -> String {
    format!("{} {i} of {}", element.name, element.count)
}
