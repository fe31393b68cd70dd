//! Rounds in which only samples of both shapes are matched: their functional maps are those of all vertices but for
//! little, at a fraction of the time. The last round matches all vertices.

use super::bands::filter_mask;
use super::sampled::Sampled;
use super::{Found, RefineError, filtered};
use crate::Matrix;
use crate::fmap::{BothMaps, scale_free_eigenvalues};
use crate::point_map::Embedding;
use crate::point_map::search::AlongEdges;
use crate::spectral::Eigenbasis;

/// Refines the matches of the samples, source to target first.
pub(super) fn refine(
    mut images: [Vec<u32>; 2],
    bases: [&Eigenbasis; 2],
    anchors: Option<&[Matrix; 2]>,
    edges: &AlongEdges,
    ks: &[usize],
) -> Result<Found, RefineError> {
    let areas = edges.areas(bases.map(|basis| &basis.mass[..]));
    let level = |k: usize| Level::new(bases, anchors, edges, &areas, k);
    let mut current = level(ks[0]);
    for (i, &k) in ks.iter().enumerate() {
        if k != current.k {
            current = level(k);
        }
        if i + 1 < ks.len() {
            images = current.round(&images)?;
        }
    }
    current.all(&images)
}

/// What rounds at `k` eigenfunctions need of both shapes.
struct Level<'a> {
    k: usize,
    edges: &'a AlongEdges,
    shapes: [Sampled<'a>; 2],
    /// `[k, k]`, of maps from source to target.
    mask: Matrix,
}

impl<'a> Level<'a> {
    fn new(
        bases: [&'a Eigenbasis; 2],
        anchors: Option<&[Matrix; 2]>,
        edges: &'a AlongEdges,
        areas: &[Vec<f64>; 2],
        k: usize,
    ) -> Self {
        let samples = edges.samples();
        let of =
            |i: usize| Sampled::new(bases[i], anchors.map(|anchors| &anchors[i]), samples[i], &areas[i], k);
        let (source, target) = rayon::join(|| of(0), || of(1));
        let [of_source, of_target] = bases.map(|basis| scale_free_eigenvalues(basis)[..k].to_vec());
        Self { k, edges, shapes: [source, target], mask: filter_mask(&of_source, &of_target) }
    }

    /// The filtered functional maps of the samples' matches.
    fn functional_maps(&self, [forth, back]: &[Vec<u32>; 2]) -> BothMaps {
        let [source, target] = &self.shapes;
        let (c12, c21) = rayon::join(|| target.pull_back(back, source), || source.pull_back(forth, target));
        filtered(&self.mask, &c12, &c21)
    }

    /// The matches of the samples in the embedding of the filtered functional maps of their matches before.
    fn round(&self, images: &[Vec<u32>; 2]) -> Result<[Vec<u32>; 2], RefineError> {
        let [source, target] = &self.shapes;
        let maps = Rounded::new(&self.functional_maps(images));
        let (of_source, of_target) = rayon::join(
            || (source.queries(&maps.sum), source.half_squares(&maps.forth)),
            || (target.queries(&maps.sum.transposed()), target.half_squares(&maps.back)),
        );
        let queries =
            [source.sample_rows(of_source.0, &of_source.1), target.sample_rows(of_target.0, &of_target.1)];
        let targets = [source.vertex_rows(of_source.1), target.vertex_rows(of_target.1)];
        let before = images.each_ref().map(|images| &images[..]);
        Ok(self.edges.nearest_of_samples(queries.each_ref(), targets.each_ref(), before)?)
    }

    /// The filtered functional maps of the samples' matches, their embedding, and the matches of all vertices in it.
    fn all(&self, of_samples: &[Vec<u32>; 2]) -> Result<Found, RefineError> {
        let [source, target] = &self.shapes;
        let functional_maps = self.functional_maps(of_samples);
        let maps = Rounded::new(&functional_maps);
        let ((queries, rows_source), (targets, rows_target)) = rayon::join(
            || {
                let image = source.transported(&maps.forth);
                (source.transported_rows(&maps.sum, &image), source.embedded(&image, false))
            },
            || {
                let image = target.transported(&maps.back);
                (target.vertex_rows(target.squares_with(&image)), target.embedded(&image, true))
            },
        );
        let of_samples = of_samples.each_ref().map(|images| &images[..]);
        let matches = self.edges.nearest([&queries, &targets], of_samples)?;
        Ok((functional_maps, Embedding::of_rows(rows_source, rows_target)?, matches))
    }
}

/// Both functional maps in single precision, and `C12 + C21^T`.
struct Rounded {
    forth: Matrix<f32>,
    back: Matrix<f32>,
    sum: Matrix<f32>,
}

impl Rounded {
    fn new(maps: &BothMaps) -> Self {
        let [forth, back] = [&maps.forth, &maps.back].map(|c| c.map(|x| x as f32));
        let sum = Matrix::from_fn(forth.rows(), forth.cols(), |i, j| forth[(i, j)] + back[(j, i)]);
        Self { forth, back, sum }
    }
}
