//! `lampyris trace --dry-run`: what a run would do, without its rays.

use crate::cli::completion::Completion;
use crate::cli::console::{Console, print};
use crate::cli::failure::Failure;
use crate::cli::output::json::json_text;
use crate::cli::output::rule_table::{left_out_document, left_out_table, rule_document, rule_table};
use crate::cli::output::terminal_tables::table_text;
use crate::model::Part;
use crate::pipeline::{IntersectorKind, PreparedScene};
use crate::report::{bytes, seconds};
use crate::simulate::{RequiredEffects, rays_of_run};
use crate::text::count_of;
use serde_json::json;
use std::path::Path;

/// Prints what would be done, with `--json` as a document; traces and writes nothing.
pub(super) fn run(prepared: &PreparedScene, folder: &Path, console: &Console) -> Result<Completion, Failure> {
    let settings = prepared.run_settings();
    let facets = &prepared.facets;
    let loaded = &prepared.job.loaded;
    let faces: usize = loaded.model.parts.iter().map(Part::face_count).sum();
    let effects = RequiredEffects::new(&prepared.bound);
    // Sources may have numbers of their own.
    let rays = rays_of_run(&prepared.bound, &settings);
    if console.json {
        let document = json!({"dry_run": true, "chosen": prepared.chosen, "rays": rays, "seed": settings.seed, "threads": prepared.threads,
            "faces": faces, "facets": facets.facet_count(), "mesh_bytes": facets.bytes(),
            "intersector": prepared.choice.intersector.to_string(), "normals": prepared.choice.normals.to_string(),
            "rules": rule_document(&prepared.bound, &loaded.model), "left_out": left_out_document(&loaded.left_out),
            "effects": {"simulated": effects.simulated, "not_simulated": effects.not_simulated},
            "seconds": {"read": loaded.seconds, "tessellate": prepared.tessellation_seconds}});
        print(&json_text(&document)?)?;
        return Ok(Completion::Complete);
    }
    let made = format!("{} ({})", count_of(facets.facet_count() as u64, "facet"), bytes(facets.bytes() as u64));
    let faces = count_of(faces as u64, "face");
    let traced_on = match prepared.choice.intersector {
        IntersectorKind::Exact => {
            format!("on the splines of {faces} ({made} are for pictures and the check alone)")
        }
        on_facets => {
            format!("through {made} of {faces}, {on_facets} with {} normals", prepared.choice.normals)
        }
    };
    print(&format!(
        "would trace {} (seed {}) on {} {traced_on},\n\
         and write into {}; reading took {}, tessellation {}\n",
        count_of(rays, "ray"),
        settings.seed,
        count_of(prepared.threads as u64, "thread"),
        folder.display(),
        seconds(loaded.seconds),
        seconds(prepared.tessellation_seconds)
    ))?;
    for because in &effects.simulated {
        print(&format!("simulated: {:?}, because {}\n", because.effect, because.because))?;
    }
    if let Some(table) = left_out_table(&loaded.left_out) {
        print(&table_text(&table, console.width()))?;
    }
    if !prepared.bound.rules().is_empty() {
        print(&table_text(&rule_table(&prepared.bound, &loaded.model), console.width()))?;
    }
    Ok(Completion::Complete)
}
