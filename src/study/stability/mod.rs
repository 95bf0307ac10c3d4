//! Numerical stability: generated models with rays whose right answer is known in closed form.
//!
//! Each [`Case`] is one difficulty (grazing rays, poles, knot lines, ratios of weights, cusps, sheets that cross, starts on
//! the surface, slivers, thin gaps, ten thousand reflections …). Each is asked at home, moved by 1000 km, a thousand times
//! smaller and larger, and turned by an odd angle ([`Variant`]). An answer is *right*, *flagged* (the intersector says that
//! it is not sure) or *wrong* (in silence).
//!
//! Guarantee: truths come from how the rays were built or from the surface's equation, never from an intersector.
//! Facets are right when their hit lies within their sag of the true surface and no full crossing of that band was missed.
//! Known weakness: where the truth itself hangs on the last bits of the input ([`Scene::resolution`]) any answer near it
//! is accepted.

mod case;
mod curves;
mod grade;
mod practice;
mod solids;
mod spheres;

pub use case::{Case, Geometry, Scene, Variant};
pub use grade::{Grade, Row};

/// Writes one sentence: what is wrong in silence, by intersector.
pub fn answer(rows: &[Row]) -> String {
    let mut names: Vec<&str> = Vec::new();
    for r in rows {
        if !names.contains(&r.intersector.as_str()) {
            names.push(&r.intersector);
        }
    }
    let part = |name: &&str| {
        let own = || rows.iter().filter(|r| r.intersector == *name);
        let sum = |of: fn(&Row) -> u64| own().map(of).sum::<u64>();
        let (rays, flagged, wrong) = (sum(|r| r.rays), sum(|r| r.flagged), sum(|r| r.wrong));
        let mut cases: Vec<&str> = own().filter(|r| r.wrong > 0).map(|r| r.case.as_str()).collect();
        cases.dedup();
        let flags = if flagged > 0 { format!(", {flagged} more said to be unproved") } else { String::new() };
        match wrong {
            0 => format!("**{name} none** of {rays}{flags}"),
            _ => format!("{name} {wrong} of {rays} in {} of the cases{flags}", cases.len()),
        }
    };
    format!(
        "Rays through edges, corners, poles and silhouettes, the truth known by construction. Answered wrongly without a warning: {}.",
        names.iter().map(part).collect::<Vec<_>>().join("; ")
    )
}

/// Makes all cases; the first thirteen are the hard cases of spline intersection, the others belong to facets and trees, and to what users
/// do.
pub fn cases() -> Vec<Case> {
    let mut all = spheres::cases();
    all.extend(curves::cases());
    all.extend(solids::cases());
    all.extend(practice::cases());
    all
}
