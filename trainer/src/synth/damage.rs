//! What scans suffer: missing limbs, holes, noise.

use rand::Rng;

use fmnet::mesh::vec3;

use super::adjacency::{Adjacency, components};
use super::math::Vec3;
use super::options::SynthOptions;
use super::random::{normal, uniform};
use super::template::Template;

/// A body while it is made: positions, triangles, and the template vertex that each vertex is.
pub(super) struct Draft {
    pub(super) points: Vec<Vec3>,
    pub(super) faces: Vec<[u32; 3]>,
    pub(super) dense: Vec<u32>,
}

impl Draft {
    /// Cuts, holes and noise, in this order, as `options` ask for; keeps the largest component.
    pub(super) fn damage(&mut self, template: &Template, options: &SynthOptions, rng: &mut impl Rng) {
        let scale = self.area().sqrt();
        for _ in 0..options.cuts {
            self.remove(&self.beyond_a_cut(template, rng));
        }
        for _ in 0..options.holes {
            let radius = options.hole_radius * scale * uniform(rng, 0.5, 1.0);
            self.remove(&self.disc(radius, rng));
        }
        if options.cuts + options.holes > 0 {
            self.remove(&self.smaller_components());
        }
        if options.noise > 0.0 {
            let deviation = options.noise * self.mean_edge();
            self.points.iter_mut().flatten().for_each(|x| *x = normal(rng, *x, deviation));
        }
    }

    /// Takes vertices away, the faces that have them, and the vertices that then have no face.
    fn remove(&mut self, removed: &[bool]) {
        self.faces.retain(|face| !face.iter().any(|&i| removed[i as usize]));
        let mut place = vec![u32::MAX; self.points.len()];
        self.faces.iter().flatten().for_each(|&i| place[i as usize] = 0);
        let kept: Vec<usize> = (0..place.len()).filter(|&i| place[i] == 0).collect();
        kept.iter().enumerate().for_each(|(new, &old)| place[old] = new as u32);
        self.points = kept.iter().map(|&i| self.points[i]).collect();
        self.dense = kept.iter().map(|&i| self.dense[i]).collect();
        self.faces.iter_mut().flatten().for_each(|i| *i = place[*i as usize]);
    }

    fn area(&self) -> f64 {
        let double = |face: &[u32; 3]| {
            let [a, b, c] = face.map(|i| self.points[i as usize]);
            vec3::norm(vec3::cross(vec3::sub(b, a), vec3::sub(c, a)))
        };
        0.5 * self.faces.iter().map(double).sum::<f64>()
    }

    fn mean_edge(&self) -> f64 {
        let ends = self.faces.iter().flat_map(|&[a, b, c]| [(a, b), (b, c), (c, a)]);
        let sum: f64 =
            ends.map(|(i, j)| vec3::distance(self.points[i as usize], self.points[j as usize])).sum();
        sum / (3 * self.faces.len().max(1)) as f64
    }

    /// Vertices of a limb beyond a plane across one of its bones at rest, both random.
    fn beyond_a_cut(&self, template: &Template, rng: &mut impl Rng) -> Vec<bool> {
        let skeleton = &template.recipe.skeleton;
        let limbs = skeleton.limbs();
        let cut = limbs[rng.random_range(0..limbs.len())];
        let (head, tail) = (skeleton.bones[cut].head, skeleton.bones[cut].tail);
        let along = vec3::sub(tail, head);
        let reach = uniform(rng, 0.1, 0.9) * vec3::dot(along, along);
        let beyond = |&vertex: &u32| {
            let bone = template.influences[vertex as usize].strongest();
            let offset = vec3::sub(template.points[vertex as usize], head);
            skeleton.descends(bone, cut) && (bone != cut || vec3::dot(offset, along) > reach)
        };
        self.dense.iter().map(beyond).collect()
    }

    /// Vertices within `radius` of a random vertex, along edges.
    fn disc(&self, radius: f64, rng: &mut impl Rng) -> Vec<bool> {
        let center = rng.random_range(0..self.points.len()) as u32;
        let adjacency = Adjacency::new(self.points.len(), &self.faces);
        let paths = adjacency.nearest_sources(&self.points, &[center], radius);
        paths.into_iter().map(|(_, source)| source.is_some()).collect()
    }

    fn smaller_components(&self) -> Vec<bool> {
        let labels = components(self.points.len(), &self.faces);
        let mut sizes = vec![0usize; labels.len()];
        labels.iter().for_each(|&label| sizes[label as usize] += 1);
        let largest = (0..sizes.len()).max_by_key(|&label| (sizes[label], std::cmp::Reverse(label)));
        labels.iter().map(|&label| Some(label as usize) != largest).collect()
    }
}
