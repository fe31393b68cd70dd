//! Spectral ICP (Ovsjanikov et al. 2012, section 6.2).

use super::{RefineError, Refined};
use crate::Matrix;
use crate::fmap::{functional_map_of, multiply, thin_svd};
use crate::point_map::search::NearestRows;
use crate::point_map::{PointMap, check_shape, cosines, transport};
use crate::spectral::Eigenbasis;

/// Options of [`icp`].
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct IcpOptions {
    /// Rounds at most. Range 1 and up, default 10; it stops sooner once no match changes.
    pub max_iterations: usize,
}

impl Default for IcpOptions {
    fn default() -> Self {
        Self { max_iterations: 10 }
    }
}

/// What [`icp`] did.
#[derive(Clone, Debug, PartialEq)]
pub struct IcpInfo {
    /// Whether the matches stopped changing.
    pub converged: bool,
    /// Root of the area-weighted mean over the source of `|C phi(x) - psi(T(x))|^2` at the start of each round and at
    /// the end; it never increases from the second on.
    pub residuals: Vec<f64>,
}

/// Refines the functional map `c`, `[k_target, k_source]`, to a map with orthonormal columns (or rows, if it
/// has fewer) that explains its own point map.
///
/// Each round finds for every source vertex the nearest target row to `C phi(x)`, and then the orthonormal `C` that
/// minimises `sum_x A_x |C phi(x) - psi(T(x))|^2`: with the singular value decomposition `Psi[T]^T A Phi = U S V^T`,
/// it is `U V^T`. An orthonormal functional map between bases at unit area preserves areas, which holds for nearly
/// isometric shapes; for others prefer ZoomOut.
///
/// # Errors
/// If `c` is not of that shape, an option is out of range, or an entry of a basis is not finite.
pub fn icp(
    c: &Matrix,
    basis_source: &Eigenbasis,
    basis_target: &Eigenbasis,
    options: &IcpOptions,
) -> Result<Refined<IcpInfo>, RefineError> {
    check_shape(c, basis_source, basis_target)?;
    if options.max_iterations == 0 {
        let range = "at least 1".to_string();
        return Err(RefineError::Option { option: "max_iterations", value: 0, range });
    }
    let search = NearestRows::new(&basis_target.eigenvectors)?;
    let mut info = IcpInfo { converged: false, residuals: Vec::new() };
    let mut recover = |c: &Matrix| -> Result<PointMap, RefineError> {
        let nearest = search.nearest(&transport(&basis_source.eigenvectors, c))?;
        info.residuals.push(mean_residual(&nearest.squared_distance, &basis_source.mass));
        Ok(PointMap::new(nearest.index, basis_target.n()))
    };
    let mut functional_map = c.clone();
    let mut map = recover(c)?;
    for _ in 0..options.max_iterations {
        let svd = thin_svd(functional_map_of(&map, basis_source, basis_target)?.as_faer())?;
        functional_map = multiply(svd.u.as_ref(), svd.v.transpose());
        let next = recover(&functional_map)?;
        let settled = next == map;
        map = next;
        if settled {
            info.converged = true;
            break;
        }
    }
    let transported = transport(&basis_source.eigenvectors, &functional_map);
    map.confidence = Some(cosines(&transported, &basis_target.eigenvectors, &map.targets));
    Ok(Refined { map, functional_map, info })
}

fn mean_residual(squared_distances: &[f64], mass: &[f64]) -> f64 {
    let total: f64 = squared_distances.iter().zip(mass).map(|(d, a)| a * d).sum();
    (total / mass.iter().sum::<f64>()).sqrt()
}
