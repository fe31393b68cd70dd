//! Limbs that are exchanged, left and right: what a map tears off and sends elsewhere is tried on the other side of
//! the target.
//!
//! Where the other side is comes from the map of the target to its own mirror image: both have the same distances,
//! and the descriptors tell left from right by the orientation of the surface.

use super::DescribedShape;
use super::Refinement;
use super::candidates::{CLEARLY, Start, Tried};
use super::judge::Judge;
use super::landmarks::Landmarks;
use super::pair::Pair;
use crate::error::Error;
use crate::fmap::functional_map_of;
use crate::point_map::PointMap;
use crate::shape::Context;

impl Pair<'_> {
    /// Tries the map with all displaced regions, if it has any, on the other side, then with each of several alone.
    pub(super) fn try_other_side(
        &self,
        judge: &Judge,
        tried: &mut Tried,
        landmarks: Option<&Landmarks>,
    ) -> Result<(), Error> {
        let regions = judge.displaced_regions(&tried.found);
        if regions.is_empty() {
            return Ok(());
        }
        let other_side = self.timed("mirror image", || self.other_side_of_target())?;
        let first = (tried.found.map.clone(), tried.found.back.clone());
        let mut attempt = |name: &str, region: &[u32]| -> Result<bool, Error> {
            let start = self.exchanged((&first.0, first.1.as_ref()), &other_side, region, landmarks)?;
            let found = self.refine(Refinement::Wavelet, &start)?;
            let judged = judge.judge(&found)?;
            Ok(tried.add(name, found, judged, CLEARLY))
        };
        if !attempt("torn regions on the other side", &regions.concat())? && regions.len() > 1 {
            for (i, region) in regions.iter().enumerate() {
                attempt(&format!("torn region {} on the other side", i + 1), region)?;
            }
        }
        Ok(())
    }

    /// The start from a map and the one back with a region on the other side; descriptors beside it tell front from
    /// back there.
    fn exchanged(
        &self,
        (map, back): (&PointMap, Option<&PointMap>),
        other_side: &PointMap,
        region: &[u32],
        landmarks: Option<&Landmarks>,
    ) -> Result<Start, Error> {
        let [map, back] = exchanged(map, back, other_side, region);
        let [phi, psi] = self.bases(self.matcher.k)?;
        let functional_map = functional_map_of(&map, &phi, &psi)?;
        let own = [&self.source.descriptors, &self.target.descriptors];
        let anchors = self.anchors(Some(own), landmarks);
        Ok(Start { functional_map, map, back, embedding: None, anchors })
    }

    /// For each vertex of the target the one that it is the mirror image of.
    fn other_side_of_target(&self) -> Result<PointMap, Error> {
        let context = Context { cache: None, ..self.context };
        let shape = self.target.shape.mirrored();
        let descriptors = self.matcher.descriptor().describe(&shape, context)?;
        let mirrored = DescribedShape { shape, descriptors, described_by: self.target.described_by };
        let pair = Pair { source: self.target, target: &mirrored, context, ..self.with_source(self.target) };
        Ok(pair.by_first_way(None)?.map)
    }
}

/// The maps of both directions with a region of the source on the other side of the target.
fn exchanged(
    map: &PointMap,
    back: Option<&PointMap>,
    other_side: &PointMap,
    region: &[u32],
) -> [PointMap; 2] {
    let mut inside = vec![false; map.len()];
    let mut forth = map.clone();
    for &v in region {
        inside[v as usize] = true;
        if let Some(mirrored) = map.get(v as usize).and_then(|y| other_side.get(y as usize)) {
            forth.targets[v as usize] = mirrored;
        }
    }
    // What came back into the region does so from the other side now, and what is there takes its place.
    let Some(back) = back else { return [forth, PointMap::new(Vec::new(), map.len())] };
    let comes_from = |y: usize| back.get(y).is_some_and(|x| inside[x as usize]);
    let mut turned = back.clone();
    for y in 0..back.len() {
        let Some(mirrored) = other_side.get(y) else { continue };
        if comes_from(y) || comes_from(mirrored as usize) {
            turned.targets[y] = back.targets[mirrored as usize];
        }
    }
    [forth, turned]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_exchanged_region_goes_to_the_other_side_both_ways() {
        // Vertices 0 and 1 are the left and the right hand, 2 is the head; both maps exchange the hands.
        let exchange = PointMap::new(vec![1, 0, 2], 3);
        let other_side = exchange.clone();
        let identity = PointMap::new(vec![0, 1, 2], 3);
        let both = exchanged(&exchange, Some(&exchange), &other_side, &[0, 1]);
        assert_eq!(both, [identity.clone(), identity.clone()]);
        // Both hands of the source went to the right one of the target: the left one alone is wrong.
        let one = PointMap::new(vec![1, 1, 2], 3);
        let [map, _] = exchanged(&one, Some(&identity), &other_side, &[0]);
        assert_eq!(map, identity);
        let [map, back] = exchanged(&exchange, None, &other_side, &[0, 1]);
        assert_eq!((map, back.len()), (identity, 0));
    }
}
