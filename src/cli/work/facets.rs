//! From options and scene to the mesher's settings, and to facets.

use crate::cli::arguments::options::MeshingOptions;
use crate::cli::arguments::suggest;
use crate::cli::console::Console;
use crate::cli::failure::Failure;
use crate::model::Model;
use crate::simulate::{BoundScene, Scene};
use crate::tessellate::{self, FaceSelector, Tessellation, ToleranceOverride, tessellate};
use std::time::Instant;

/// The mesher's settings from options and scene.
pub(crate) fn mesh_settings(
    meshing: &MeshingOptions,
    scene: Option<&Scene>,
    model: &Model,
) -> Result<tessellate::Settings, Failure> {
    let mut settings = tessellate::Settings::default();
    let accuracy = scene.map(|s| &s.accuracy);
    if let Some(range) = meshing.tolerance.or(accuracy.and_then(|a| a.tolerance_mm)) {
        settings.tolerance = range;
    }
    settings.angle_deg = meshing.angle.or(accuracy.and_then(|a| a.angle_deg));
    // Faces that are one interface for light are faceted once.
    settings.glue_mm = scene.map_or(0.0, |s| s.run.glue_mm);
    if let Some(plan) = &meshing.plan {
        plan.apply(&mut settings);
    }
    // Later overrides win: roles are the widest, then parts, then single faces.
    for (role, tolerance) in &meshing.role {
        let place = place_of_role(role, scene, model)?;
        settings.overrides.push(ToleranceOverride { place, tolerance: *tolerance, radii: None });
    }
    for (name, tolerance) in &meshing.part {
        let place = place_of_part(name, model)?;
        settings.overrides.push(ToleranceOverride { place, tolerance: *tolerance, radii: None });
    }
    for (name, tolerance) in &meshing.face {
        let place = place_of_face(name, model)?;
        settings.overrides.push(ToleranceOverride { place, tolerance: *tolerance, radii: None });
    }
    Ok(settings)
}

/// The faces of an optical role, which only a scene knows.
fn place_of_role(role: &str, scene: Option<&Scene>, model: &Model) -> Result<FaceSelector, Failure> {
    if !BoundScene::ROLES.contains(&role) {
        let failure = Failure::arguments(format!("--role {role}: there is no such optical role"));
        return Err(failure.with_help(format!("use one of {}", BoundScene::ROLES.join(", "))));
    }
    let Some(scene) = scene else {
        let failure = Failure::arguments(format!("--role {role}: only a scene says what faces are for light"));
        return Err(failure.with_help("name the faces or the part: --face NAME=0.01 or --part NAME=0.01"));
    };
    Ok(FaceSelector::Placed(scene.bind(model)?.faces_in_role(role)))
}

fn place_of_part(name: &str, model: &Model) -> Result<FaceSelector, Failure> {
    if model.parts.iter().any(|p| p.name == name) {
        return Ok(FaceSelector::Part(name.to_owned()));
    }
    let known: Vec<&str> = model.parts.iter().map(|p| p.name.as_str()).filter(|n| !n.is_empty()).collect();
    Err(Failure::arguments(format!("--part {name}: the model has no part of this name"))
        .with_help(suggest::closest_name("its parts are", name, &known)))
}

/// A face by its name or, as `#ID`, by its entity; a face that is called `#17` wins over entity 17.
fn place_of_face(name: &str, model: &Model) -> Result<FaceSelector, Failure> {
    let entity = name.strip_prefix('#').and_then(|id| id.parse().ok());
    let faces = || model.placed_faces().filter_map(|f| f.face);
    if faces().any(|f| f.name == name) {
        return Ok(FaceSelector::Face(name.to_owned()));
    }
    if let Some(id) = entity.filter(|id| faces().any(|f| f.entity == Some(*id))) {
        return Ok(FaceSelector::Entity(id));
    }
    let known: Vec<&str> = faces().map(|f| f.name.as_str()).filter(|n| !n.is_empty()).collect();
    let failure = Failure::arguments(format!("--face {name}: the model has no face of this name or number"));
    Err(failure.with_help(if known.is_empty() {
        "its faces have no names; write the number of the entity in the file, as in #17=0.01".into()
    } else {
        suggest::closest_name("its faces are", name, &known)
    }))
}

/// Facets with the time they took.
pub(crate) fn facets(model: &Model, settings: &tessellate::Settings, console: &Console) -> (Tessellation, f64) {
    let start = Instant::now();
    let spinner = console.spinner("making facets");
    let tessellation = tessellate(model, settings);
    spinner.finish_and_clear();
    (tessellation, start.elapsed().as_secs_f64())
}
