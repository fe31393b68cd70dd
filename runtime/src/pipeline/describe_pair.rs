//! Both shapes of a pair: what a part needs to know of its whole, and what two shapes at once need of the memory.

use super::{DescribedShape, Matcher};
use crate::Mesh;
use crate::error::Error;
use crate::events::Observer;

/// A mesh and its name for messages.
pub type Named<'a> = (&'a str, &'a Mesh);

impl Matcher {
    /// [`Matcher::describe`] of both shapes of a pair, source first, at the same time; one after the other where both
    /// at once would take more memory than there is.
    ///
    /// With `partial` the source is a part of the target, in its unit: the area of the whole is that of the target as
    /// it is matched, repaired.
    ///
    /// # Errors
    /// As [`Matcher::describe`] and [`Matcher::describe_part`].
    pub fn describe_pair(
        &self,
        source: Named,
        target: Named,
        partial: bool,
        observer: Observer,
    ) -> Result<[DescribedShape; 2], Error> {
        let describe = |(name, mesh): Named| self.describe(name, mesh, observer);
        if partial {
            let whole = describe(target)?;
            let part = self.describe_part(source.0, source.1, whole.shape.full_mesh.area(), observer)?;
            return Ok([part, whole]);
        }
        let (first, second) = rayon::join(|| describe(source), || describe(target));
        let again = |result: Result<DescribedShape, Error>, shape| match result {
            Err(error) if error.is_lack_of_memory() => describe(shape),
            result => result,
        };
        Ok([again(first, source)?, again(second, target)?])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::events::ignore;
    use crate::mesh::shapes::{bumpy_sphere, joined};
    use crate::pipeline::{DescriptorKind, MatchOptions, Refinement};

    fn matcher(refinement: Option<Refinement>) -> Matcher {
        let (descriptor, k) = (DescriptorKind::Shot, Some(20));
        Matcher::new(&MatchOptions { descriptor, k, refinement, ..MatchOptions::default() }).unwrap()
    }

    /// The half of a mesh above the plane `z = 0`.
    fn upper(mesh: &Mesh) -> Mesh {
        let above = |face: &&[u32; 3]| face.iter().all(|&v| mesh.vertices()[v as usize][2] > 0.0);
        Mesh::new(mesh.vertices().to_vec(), mesh.faces().iter().filter(above).copied().collect()).unwrap()
    }

    #[test]
    fn the_area_of_the_whole_is_that_of_the_repaired_target() {
        let whole = bumpy_sphere(3, 1);
        // Every face twice: repair drops the copies, of which the file's area knows nothing.
        let doubled = joined(&[&whole]);
        let faces = [doubled.faces(), doubled.faces()].concat();
        let doubled = Mesh::new(doubled.vertices().to_vec(), faces).unwrap();
        let part = upper(&whole);
        let [described, _] =
            matcher(None).describe_pair(("part", &part), ("whole", &doubled), true, &ignore).unwrap();
        assert!((described.shape.whole_area.unwrap() / whole.area() - 1.0).abs() < 1e-12);
    }

    #[test]
    fn a_part_is_refused_where_it_would_go_wrong() {
        let (matcher, whole) = (matcher(None), bumpy_sphere(3, 1));
        let [part, whole] =
            matcher.describe_pair(("part", &upper(&whole)), ("whole", &whole), true, &ignore).unwrap();
        assert!(matcher.match_shapes(&part, &whole, &ignore).is_ok());
        for source in [&whole, &part] {
            let error = matcher.match_shapes(source, &part, &ignore).unwrap_err().to_string();
            assert!(error.contains("part can only be the source") && error.contains("exchange"), "{error}");
        }
    }

    #[test]
    fn spectral_icp_is_for_whole_shapes() {
        let whole = bumpy_sphere(3, 1);
        let error = matcher(Some(Refinement::Icp))
            .describe_pair(("part", &upper(&whole)), ("whole", &whole), true, &ignore)
            .unwrap_err()
            .to_string();
        assert!(error.contains("part: ") && error.contains("--refine zoomout"), "{error}");
    }
}
