//! The records of the elements: vertices, faces, triangle strips.

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

impl Slot {
    fn of(property: &Property, fields: &mut Vec<(String, Vec<f32>)>) -> Self {
        let Kind::Scalar(kind) = property.kind else { return Self::Skip };
        match property.name.as_str() {
            "x" => Self::Coordinate(0),
            "y" => Self::Coordinate(1),
            "z" => Self::Coordinate(2),
            "red" | "r" | "diffuse_red" => Self::Color(0, kind),
            "green" | "g" | "diffuse_green" => Self::Color(1, kind),
            "blue" | "b" | "diffuse_blue" => Self::Color(2, kind),
            "alpha" | "a" | "diffuse_alpha" => Self::Color(3, kind),
            "u" | "s" | "texture_u" | "texture_s" => Self::Uv(0),
            "v" | "t" | "texture_v" | "texture_t" => Self::Uv(1),
            "nx" | "ny" | "nz" => Self::Skip,
            name => {
                fields.push((name.to_owned(), Vec::new()));
                Self::Field(fields.len() - 1)
            }
        }
    }
}

/// Reads the vertices and their attributes; returns the texture coordinates, if there are any.
pub(super) fn read_vertices<S: Source>(
    source: &mut S,
    element: &Element,
    builder: &mut MeshBuilder,
) -> Parsed<Vec<[f32; 2]>> {
    let mut fields = Vec::new();
    let slots: Vec<Slot> = element.properties.iter().map(|p| Slot::of(p, &mut fields)).collect();
    check_coordinates(&slots)?;
    let has_color = slots.iter().any(|slot| matches!(slot, Slot::Color(..)));
    let has_uv = slots.iter().any(|slot| matches!(slot, Slot::Uv(_)));
    let (mut colors, mut uvs) = (Vec::new(), Vec::new());
    builder.vertices.reserve_exact(element.count);
    for vertex in 0..element.count {
        let (mut position, mut color, mut uv) = ([0.0; 3], [0, 0, 0, 255], [0.0; 2]);
        for (property, slot) in element.properties.iter().zip(&slots) {
            let (Kind::Scalar(kind), false) = (property.kind, matches!(slot, Slot::Skip)) else {
                source.skip_property(property).map_err(|e| e.within(place(element, vertex)))?;
                continue;
            };
            let value = source.number(kind).map_err(|e| e.within(place(element, vertex)))?;
            match slot {
                Slot::Coordinate(axis) => position[*axis] = value,
                Slot::Color(channel, kind) => color[*channel] = color_byte(value, *kind),
                Slot::Uv(axis) => uv[*axis] = value as f32,
                Slot::Field(field) => fields[*field].1.push(value as f32),
                Slot::Skip => {}
            }
        }
        if !position.iter().all(|x| x.is_finite()) {
            let problem = format!("the position is not finite: {position:?}");
            return Err(source.error(problem).within(place(element, vertex)));
        }
        builder.vertices.push(position);
        colors.extend(has_color.then_some(color));
        uvs.extend(has_uv.then_some(uv));
    }
    builder.attributes.vertex_colors = has_color.then_some(colors);
    builder.attributes.vertex_scalars = fields;
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

/// Integer colours count to 255 (16-bit ones to 65535), floating-point ones to 1.
fn color_byte(value: f64, kind: Number) -> u8 {
    let scaled = match kind {
        Number::F32 | Number::F64 => value * 255.0,
        Number::U16 | Number::I16 => value / 257.0,
        _ => value,
    };
    scaled.round() as u8
}

/// Reads polygons and, where there is a list `texcoord`, the texture coordinates of their corners.
pub(super) fn read_faces<S: Source>(
    source: &mut S,
    element: &Element,
    n_vertices: usize,
    builder: &mut MeshBuilder,
) -> Parsed<()> {
    let (mut items, mut corners, mut uvs) = (Vec::new(), Vec::new(), Vec::new());
    // A face takes at least 4 bytes in any encoding of a triangle mesh; others only make the vector grow.
    builder.faces.reserve(element.count.min(source.remaining() / 4));
    for face in 0..element.count {
        corners.clear();
        uvs.clear();
        for property in &element.properties {
            let read = match (property.name.as_str(), property.kind) {
                ("vertex_indices" | "vertex_index", Kind::List { length, item }) => source
                    .list(length, item, &mut items)
                    .and_then(|()| indices(source, &items, n_vertices, &mut corners)),
                ("texcoord", Kind::List { length, item }) => {
                    source.list(length, item, &mut items).map(|()| {
                        uvs.extend(items.chunks_exact(2).map(|uv| [uv[0] as f32, uv[1] as f32]));
                    })
                }
                _ => source.skip_property(property),
            };
            read.map_err(|e| e.within(place(element, face)))?;
        }
        builder.polygon_with_uvs(&corners, Some(uvs.as_slice()).filter(|uvs| !uvs.is_empty()));
    }
    Ok(())
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
