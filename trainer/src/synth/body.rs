//! Individuals: their meshes, and where the landmarks are on them.

use rand::Rng;

use fmnet::Mesh;

use super::damage::Draft;
use super::random::{Purpose, generator};
use super::remesh::remesh;
use super::template::Template;
use super::{SynthError, SynthOptions, UNMATCHED};

/// An individual: its mesh, in metres, standing on y = 0 with y upwards, and its place on the template.
///
/// The order of vertices and faces, the connectivity, and all vertices but the landmarks are the individual's own.
#[derive(Clone, Debug)]
pub struct Body {
    /// The surface, closed unless damaged.
    pub mesh: Mesh,
    /// Of every landmark of the family its vertex, `[n_landmarks]`, or [`UNMATCHED`] where the breed does not have it
    /// or damage took it away.
    pub landmarks: Vec<u32>,
    /// Of every vertex the vertex of the template's dense surface ([`Template::rest_mesh`]) it is, `[n]`.
    pub template_vertices: Vec<u32>,
}

impl Template {
    /// The individual with the given seed: body, pose, triangulation and damage are all drawn from it. The same seed
    /// and options give the same bytes, whatever the number of threads.
    ///
    /// # Errors
    /// If an option is out of range.
    pub fn body(&self, seed: u64, options: &SynthOptions) -> Result<Body, SynthError> {
        options.check()?;
        Ok(self.body_with_landmarks(seed, options, &self.landmarks))
    }

    /// [`Template::body`] with the given vertices of the template as its landmarks; `options` are taken as they are.
    pub(super) fn body_with_landmarks(&self, seed: u64, options: &SynthOptions, landmarks: &[u32]) -> Body {
        let dense = self.individual(seed);
        let mut keep = vec![false; dense.len()];
        landmarks.iter().filter(|&&i| i != UNMATCHED).for_each(|&i| keep[i as usize] = true);
        let mut rng = generator(self.species.index(), seed, Purpose::Remesh);
        let target = rng.random_range(options.min_vertices..=options.max_vertices);
        let remeshed = remesh(&dense, &self.faces, &keep, target, &mut rng);
        let points = remeshed.dense.iter().map(|&i| dense[i as usize]).collect();
        let mut draft = Draft { points, faces: remeshed.faces, dense: remeshed.dense };
        draft.damage(self, options, &mut generator(self.species.index(), seed, Purpose::Damage));
        let mut vertex_of = vec![UNMATCHED; dense.len()];
        draft.dense.iter().enumerate().for_each(|(vertex, &i)| vertex_of[i as usize] = vertex as u32);
        let landmarks =
            landmarks.iter().map(|&i| vertex_of.get(i as usize).copied().unwrap_or(UNMATCHED)).collect();
        let mesh = Mesh::new(draft.points, draft.faces).expect("remeshing keeps indices in range");
        Body { mesh, landmarks, template_vertices: draft.dense }
    }
}
