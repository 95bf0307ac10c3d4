//! From settings and scene to the mesher's settings, and to facets.

use super::error::Error;
use super::monitor::{Monitor, Stage, in_stage};
use super::settings::MeshingSettings;
use crate::model::{Instancing, Model};
use crate::simulate::{BoundScene, Scene};
use crate::tessellate::{self, GroupedFacets, Tessellation, ToleranceOverride, ToleranceScope, tessellate};
use crate::text::{count_of, figures, nearest_or_listed};
use std::sync::Arc;
use std::time::Instant;

/// Makes the mesher's settings from the request, else from the scene, else from the defaults.
///
/// # Errors
/// When a part, face or role is not there, or a role is asked for without a scene.
pub fn mesh_settings(
    meshing: &MeshingSettings,
    scene: Option<&Scene>,
    model: &Model,
) -> Result<tessellate::Settings, Error> {
    let mut settings = tessellate::Settings::default();
    let accuracy = scene.map(|s| &s.accuracy);
    // The request overrides the scene, the scene the defaults.
    if let Some(range) = meshing.tolerance.or(accuracy.and_then(|a| a.tolerance_mm)) {
        settings.tolerance = range;
    }
    settings.angle_deg = meshing.angle_deg.or(accuracy.and_then(|a| a.angle_deg));
    // Faces that are one interface for light are faceted once.
    settings.glue_mm = scene.map_or(0.0, |s| s.run.glue_distance());
    if let Some(plan) = &meshing.plan {
        plan.apply(&mut settings);
    }
    // Later overrides win: roles are the widest, then parts, then single faces.
    for (role, tolerance) in &meshing.role {
        let scope = scope_of_role(role, scene, model)?;
        settings.overrides.push(ToleranceOverride { scope, tolerance: *tolerance, radii: None });
    }
    for (name, tolerance) in &meshing.part {
        let scope = scope_of_part(name, model)?;
        settings.overrides.push(ToleranceOverride { scope, tolerance: *tolerance, radii: None });
    }
    for (name, tolerance) in &meshing.face {
        let scope = scope_of_face(name, model)?;
        settings.overrides.push(ToleranceOverride { scope, tolerance: *tolerance, radii: None });
    }
    Ok(settings)
}

/// Selects the faces of an optical role, which only a scene knows; binds the scene to the model.
///
/// # Errors
/// When the role is not known or no face has it, there is no scene, or the scene does not fit the model.
fn scope_of_role(role: &str, scene: Option<&Scene>, model: &Model) -> Result<ToleranceScope, Error> {
    if !BoundScene::ROLES.contains(&role) {
        let error = Error::setting("role", format!("{role}: there is no such optical role"));
        return Err(error.help(format!("use one of {}", BoundScene::ROLES.join(", "))));
    }
    let Some(scene) = scene else {
        let error = Error::setting("role", format!("{role}: only a scene says what faces are for light"));
        return Err(error
            .help("name the face or the part instead, as the command's --face NAME=0.01 and --part NAME=0.01 do"));
    };
    let bound = scene.bind(model)?;
    let faces = bound.faces_in_role(role);
    if faces.is_empty() {
        let there: Vec<&str> =
            BoundScene::ROLES.into_iter().filter(|role| !bound.faces_in_role(role).is_empty()).collect();
        let error = Error::setting("role", format!("{role}: no face of the scene has this role"));
        return Err(error.help(format!("there are faces of: {}", there.join(", "))));
    }
    Ok(ToleranceScope::Placed(faces))
}

/// Selects a part by its name, letter for letter.
///
/// # Errors
/// When there is none, with the names that are like it.
fn scope_of_part(name: &str, model: &Model) -> Result<ToleranceScope, Error> {
    if model.parts.iter().any(|p| p.name == name) {
        return Ok(ToleranceScope::Part(name.to_owned()));
    }
    let advice = nearest_or_listed(name, model.parts.iter().map(|p| p.name.as_str()));
    Err(Error::setting("part", format!("{name}: the model has no part of this name")).help(advice.unwrap_or_else(
        || "its parts have no names; select faces by the number of their entity, as in --face 17=0.01".into(),
    )))
}

/// Selects a face by its name or by the number of its entity, with or without `#`, which a shell may take for a comment; a face that is
/// called `17` wins over entity 17.
///
/// # Errors
/// When there is none, with the names that are like it.
fn scope_of_face(name: &str, model: &Model) -> Result<ToleranceScope, Error> {
    let entity = name.strip_prefix('#').unwrap_or(name).parse().ok();
    let faces = || model.placed_faces().filter_map(|f| f.face);
    if faces().any(|f| f.name == name) {
        return Ok(ToleranceScope::Face(name.to_owned()));
    }
    if let Some(id) = entity.filter(|id| faces().any(|f| f.entity == Some(*id))) {
        return Ok(ToleranceScope::Entity(id));
    }
    let error = Error::setting("face", format!("{name}: the model has no face of this name or number"));
    Err(error.help(nearest_or_listed(name, faces().map(|f| f.name.as_str())).unwrap_or_else(|| {
        "its faces have no names; write the number of the entity in the file, as in 17=0.01".into()
    })))
}

/// Makes the facets of a model in one piece, notifies the monitor, and returns them with the seconds they took.
pub fn tessellate_model(
    model: &Model,
    settings: &tessellate::Settings,
    monitor: &dyn Monitor,
) -> (Tessellation, f64) {
    let start = Instant::now();
    let tessellation = in_stage(monitor, Stage::Tessellating, || tessellate(model, settings));
    (tessellation, start.elapsed().as_secs_f64())
}

/// Makes the facets of a model, those of parts that are placed often once and in their own coordinates, and notifies the monitor.
pub fn tessellate_by_part(model: &Model, settings: &tessellate::Settings, monitor: &dyn Monitor) -> GroupedFacets {
    let instancing = Instancing::new(model, settings.glue_mm).map(Arc::new);
    in_stage(monitor, Stage::Tessellating, || tessellate_groups(model, instancing.as_ref(), settings).0)
}

/// Returns a sentence about the facets that turn farther from the surface than the settings allow; `None` where none does. `model` is the
/// one that was meshed.
pub fn angle_note(facets: &GroupedFacets, model: &Model, settings: &tessellate::Settings) -> Option<String> {
    let asked = settings.angle_deg?;
    let (count, largest) = facets.facets_over_angle(model, settings)?;
    Some(format!(
        "{} {} farther from the surface than the angle of {}°, at most {}°; within the tolerance they may be all the same: \
         `lampyris facet --angle` names their faces",
        count_of(count as u64, "facet"),
        if count == 1 { "turns" } else { "turn" },
        figures(asked, 3),
        figures(largest, 3)
    ))
}

/// Makes the facets of every group of a model, or without `instancing` of the model in one piece; returns them with the seconds they took.
pub(super) fn tessellate_groups(
    model: &Model,
    instancing: Option<&Arc<Instancing>>,
    settings: &tessellate::Settings,
) -> (GroupedFacets, f64) {
    let start = Instant::now();
    let facets = match instancing {
        None => tessellate(model, settings).into(),
        Some(instancing) => GroupedFacets {
            groups: (instancing.groups.iter().enumerate())
                .map(|(k, group)| tessellate(group, &settings.of_group(instancing, k)))
                .collect(),
            instancing: Some(instancing.clone()),
        },
    };
    (facets, start.elapsed().as_secs_f64())
}
