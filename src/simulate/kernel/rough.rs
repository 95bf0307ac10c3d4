//! Scatter at rough surfaces.

use super::step::Meeting;
use super::{Carry, Context, Local, Path, key};
use crate::math::Vector;
use crate::optics::polarised::Stokes;
use crate::optics::{Scatter, reflect};
use crate::simulate::bind::Coated;
use crate::simulate::random::Purpose;

/// The direction after scatter at a rough surface; `specular` when it is smooth or this light stays specular.
#[inline(always)]
pub(super) fn rough<C: Carry>(
    context: &Context<'_>,
    coated: Option<&Coated>,
    path: &mut Path<C>,
    specular: Vector,
    normal: Vector,
    at: &Meeting<'_>,
    local: &mut Local,
) -> Vector {
    match coated.and_then(|c| c.scatter.as_ref()) {
        Some(scatter) => scattered(context, scatter, path, specular, normal, at, local),
        None => specular,
    }
}

/// The direction after scatter at a rough surface.
#[inline(never)]
fn scattered<C: Carry>(
    context: &Context<'_>,
    scatter: &Scatter,
    path: &mut Path<C>,
    specular: Vector,
    normal: Vector,
    at: &Meeting<'_>,
    local: &mut Local,
) -> Vector {
    let flat = at.hit.geometric_normal;
    // Both normals on the side that the light leaves to.
    let side = flat * specular.dot(flat).signum();
    let normal = normal * normal.dot(side).signum();
    let numbers = key(context, path);
    let [u, v] = numbers.pair(Purpose::Scatter);
    let Some(going) = scatter.sample(specular, normal, [numbers.unit(Purpose::Lobe), u, v]) else {
        return specular;
    };
    if let Some(stokes) = path.carry.stokes() {
        *stokes = Stokes::unpolarised(1.0, going);
    }
    if going.dot(side) > 0.0 {
        return going;
    }
    local.counts.corrected_normals += 1;
    reflect(going, side)
}
