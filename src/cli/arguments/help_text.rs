//! What the help and the manual pages say beyond the options: examples to type, the keys of the JSON documents, and what an option that
//! several commands share means in one of them.

use clap::Arg;

macro_rules! facet {
    () => {
        "\
Examples:
  lampyris facet lamp.stp -o lamp.glb                    default tolerance, for any 3-D viewer
  lampyris facet lamp.stp -o lamp.stl --tolerance 0.02   the same distance everywhere
  lampyris facet lamp.stp -o lamp.obj --accuracy 0.1deg  as fine as mirrored rays need"
    };
}

/// Examples under `facet -h`.
pub(crate) const FACET: &str = facet!();

/// The same with the keys of the document.
pub(crate) const FACET_LONG: &str = concat!(
    facet!(),
    "

JSON (--json): facets, quads, triangles, vertices, tolerance_mm, sag_mm (bound_max is proved over certified facets, sampled_max and sampled_mean are \
measured by other code), over_tolerance, normal_error_deg, area_mm2, volume_mm3, shells, open_edges, faces, seconds. \
With --accuracy also 'accuracy': asked_deg, reached_deg (99th percentile of fresh rays at curved faces, against the spline), kept, normals, \
tolerance_mm, and every combination tried."
);

/// Examples under `trace --help`.
pub(crate) const TRACE: &str = "\
Examples:
  lampyris trace lamp.toml                               all as the scene says
  lampyris trace lamp.toml --until-error 0.1%@wall       until the power on 'wall' is known to 0.1 %
  lampyris trace lamp.toml --shard 1/4 -o part1.tally    a quarter of the run; see lampyris merge
  srun lampyris trace lamp.toml --shard auto -o parts    the part that the launcher gives; then lampyris merge parts -o DIR

lampyris schema prints what a scene file may hold.";

macro_rules! check {
    () => {
        "\
Examples:
  lampyris check lamp.stp -o check                            a report, with odd rays in 3-D
  lampyris check lamp.toml --accuracy 0.05deg                 on the scene's own rays
  lampyris check lamp.stp --disagreements odd.rays            keep the rays that differ
  lampyris check lamp.stp --replay odd.rays --tolerance 0.01  and ask only those again"
    };
}

/// Examples under `check -h`.
pub(crate) const CHECK: &str = check!();

/// The same with the keys of the document.
pub(crate) const CHECK_LONG: &str = concat!(
    check!(),
    "

Files of rays (--rays-out, --rays-in and its other name --replay, --disagreements): little-endian f64 records ox oy oz dx dy dz t, \
lengths in mm; t is the octree's answer, infinity for a miss, and ignored on input.

JSON (--json, and check.json of -o): rays, hits, normals (the kind that was measured), octree_vs_bvh, facets_vs_exact with \
'explained' by cause and 'unexplained', exact (certainty of the spline's hits), and for each intersector mrays_per_s, \
build_seconds and bytes_per_facet. For a scene also 'receivers': the power that facets change, from the same rays on facets and on \
the spline. With --accuracy also 'accuracy': asked_deg, reached_deg, kept, normals, tolerance_mm."
);

/// Examples under `study --help`.
pub(crate) const STUDY: &str = "\
Examples:
  lampyris study accuracy                    which tolerance and normals are worth their time
  lampyris study accuracy lamp.toml -o acc   the same for a scene, its receivers included
  lampyris study complexity --rays 100000    facets against every spline surface, three lamps

Every study writes report.html, study.json, figures/ (SVG and PNG) and tables/ (CSV) into its folder, \
lampyris-study-KIND by default.

JSON (--json, and study.json): study, command, time, version, commit, hardware, seed, answer, and rows, one measurement each, null where it \
does not apply. accuracy has 'slopes' and, for a scene, 'receivers' beside the rows: for every tolerance and kind of normals what the \
facets change (geometric) beside the noise of the rays (statistical). The rows of bvh count rays answered otherwise than by the \
octree under 'differs', those of them that were wrong by arithmetic of twice the digits under 'wrong', and those that even it could \
not tell under 'undecided'.";

/// Says of a shared option what `trace` alone takes.
pub(super) fn explain_trace_option(option: Arg) -> Arg {
    match option.get_id().as_str() {
        "ray_range" => option.value_name("N|A..B").help(
            "Number of rays, such as 10k, 5M, 2G, 1_000_000 or 1e6; by default what the scene says; sources with `rays` of their own \
             keep them. A..B: the rays from A up to B, whose tally joins those of the rays before it",
        ),
        _ => option,
    }
}

/// Says of a shared option which studies take it; the others refuse it.
pub(super) fn explain_study_option(option: Arg) -> Arg {
    let help = match option.get_id().as_str() {
        "tolerance" => {
            "`accuracy`, `bvh`: the only distance from facets to the surface, mm, in place of several; `complexity`: that distance, \
             0.05..0.2 by default; `effects`: that of the scene's facets, tight where curved and loose where flat"
        }
        "angle" => "`effects`: largest angle between facet and surface normal, degrees; off by default",
        "part" => "`effects`: tolerance of one part, by name; may be given several times",
        "face" => {
            "`effects`: tolerance of one face, by its name or the number of its entity in the file; may be given several times, and \
             wins over that of its part"
        }
        "role" => {
            "`effects`: tolerance of all faces of one optical role in the scene: mirror, interface, coated or absorber; may be given \
             several times"
        }
        "ray_range" => {
            "All but `stability`: number of rays, such as 10k, 5M, 1_000_000 or 1e6; by default what suits the study; not beside \
             --rays-in"
        }
        "seed" => "All but `stability`: seed of all random numbers",
        "intersector" => "`effects`: what finds the hits",
        "normals" => "`effects`: how the normal at a hit is computed; exact moves the hit to the spline",
        _ => return option,
    };
    option.help(help)
}
