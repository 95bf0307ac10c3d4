//! From options to facets and intersectors.

use crate::cli::Failure;
use crate::cli::arguments::options::{IntersectorKind, Meshing, Tracing};
use crate::cli::context::Context;
use crate::intersect::bvh::{self, Bvh};
use crate::intersect::exact::{self, Exact};
use crate::intersect::octree::{self, Octree};
use crate::intersect::polish::Polished;
use crate::intersect::{Footprint, Intersector, NormalMode};
use crate::mesh::FacetMesh;
use crate::model::Model;
use crate::simulate::{BoundScene, Scene};
use crate::tessellate::{self, Override, Place, Tessellation, tessellate};
use std::time::Instant;

/// What finds the hits, and how the normal there is got.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Choice {
    pub(crate) intersector: IntersectorKind,
    pub(crate) normals: NormalMode,
}

impl Choice {
    /// The options, else the scene, else octree and bilinear.
    pub(crate) fn new(tracing: &Tracing, scene: Option<&Scene>) -> Result<Self, Failure> {
        use clap::ValueEnum;
        fn named<T: ValueEnum + Default>(
            asked: Option<T>,
            scene: Option<&String>,
            key: &str,
        ) -> Result<T, Failure> {
            match (asked, scene) {
                (Some(x), _) => Ok(x),
                (None, Some(name)) => T::from_str(name, true).map_err(|_| {
                    let known: Vec<String> = (T::value_variants().iter())
                        .filter_map(|v| Some(v.to_possible_value()?.get_name().to_owned()))
                        .collect();
                    Failure::arguments(format!("scene: [accuracy] {key} = \"{name}\" is not known"))
                        .help(format!("use one of {}", known.join(", ")))
                }),
                (None, None) => Ok(T::default()),
            }
        }
        let accuracy = scene.map(|s| &s.accuracy);
        Ok(Self {
            intersector: named(tracing.intersector, accuracy.and_then(|a| a.intersector.as_ref()), "intersector")?,
            normals: named(tracing.normals, accuracy.and_then(|a| a.normals.as_ref()), "normals")?,
        })
    }
}

/// The mesher's settings from options and scene.
pub(crate) fn mesh_settings(
    meshing: &Meshing,
    scene: Option<&Scene>,
    model: &Model,
) -> Result<tessellate::Settings, Failure> {
    let mut settings = tessellate::Settings::default();
    let accuracy = scene.map(|s| &s.accuracy);
    if let Some(range) = meshing.tolerance.or(accuracy.and_then(|a| a.tolerance_mm)) {
        settings.tolerance = range;
    }
    settings.angle_deg = meshing.angle.or(accuracy.and_then(|a| a.angle_deg));
    if let Some(plan) = &meshing.plan {
        plan.apply(&mut settings);
    }
    for (role, tolerance) in &meshing.role {
        if !BoundScene::ROLES.contains(&role.as_str()) {
            let failure = Failure::arguments(format!("--role {role}: there is no such optical role"));
            return Err(failure.help(format!("use one of {}", BoundScene::ROLES.join(", "))));
        }
        let Some(scene) = scene else {
            let failure = Failure::arguments(format!("--role {role}: only a scene says what faces are for light"));
            return Err(failure.help("name the faces or the part: --face NAME=0.01 or --part NAME=0.01"));
        };
        let place = Place::Placed(scene.bind(model)?.faces_in_role(role));
        settings.overrides.push(Override { place, tolerance: *tolerance, radii: None });
    }
    for (name, tolerance) in &meshing.part {
        if !model.parts.iter().any(|p| p.name == *name) {
            let known: Vec<&str> = model.parts.iter().map(|p| p.name.as_str()).filter(|n| !n.is_empty()).collect();
            return Err(Failure::arguments(format!("--part {name}: the model has no part of this name"))
                .help(crate::cli::arguments::suggest::names("its parts are", name, &known)));
        }
        let place = Place::Part(name.clone());
        settings.overrides.push(Override { place, tolerance: *tolerance, radii: None });
    }
    for (name, tolerance) in &meshing.face {
        let entity = name.strip_prefix('#').and_then(|id| id.parse().ok());
        let known = || model.placed_faces().filter_map(|f| f.face);
        if !known().any(|f| f.name == *name || entity.is_some() && f.entity == entity) {
            let names: Vec<&str> = known().map(|f| f.name.as_str()).filter(|n| !n.is_empty()).collect();
            let failure =
                Failure::arguments(format!("--face {name}: the model has no face of this name or number"));
            return Err(failure.help(match names.as_slice() {
                [] => "its faces have no names; write the number of the entity in the file, as in #17=0.01".into(),
                names => crate::cli::arguments::suggest::names("its faces are", name, names),
            }));
        }
        let named = known().any(|f| f.name == *name);
        let place = entity.filter(|_| !named).map_or_else(|| Place::Face(name.clone()), Place::Entity);
        settings.overrides.push(Override { place, tolerance: *tolerance, radii: None });
    }
    Ok(settings)
}

/// Facets with the time they took.
pub(crate) fn facets(model: &Model, settings: &tessellate::Settings, context: &Context) -> (Tessellation, f64) {
    let start = Instant::now();
    let spinner = context.spinner("making facets");
    let tessellation = tessellate(model, settings);
    spinner.finish_and_clear();
    (tessellation, start.elapsed().as_secs_f64())
}

/// Builds the chosen intersector and hands it to `work`, with what it took to build.
pub(crate) fn with_intersector<T>(
    choice: Choice,
    model: &Model,
    mesh: &FacetMesh,
    context: &Context,
    work: impl FnOnce(&dyn Intersector, Footprint) -> T,
) -> T {
    let spinner = context.spinner(&format!("building {}", choice.intersector));
    if choice.intersector == IntersectorKind::Exact {
        let exact = Exact::build(model, &exact::Settings::default());
        spinner.finish_and_clear();
        return work(&exact, exact.footprint());
    }
    let normals = choice.normals.on_facets();
    let facets: Box<dyn Intersector + '_> = match choice.intersector {
        IntersectorKind::Bvh2 => {
            Box::new(Bvh::build(mesh, &bvh::Settings { kind: bvh::Kind::Bvh2, normals, ..Default::default() }))
        }
        IntersectorKind::Cwbvh => Box::new(Bvh::build(mesh, &bvh::Settings { normals, ..Default::default() })),
        IntersectorKind::Octree | IntersectorKind::Exact => {
            Box::new(Octree::build(mesh, &octree::Settings { normals, ..Default::default() }))
        }
    };
    if choice.normals != NormalMode::Exact {
        spinner.finish_and_clear();
        return work(&*facets, facets.footprint());
    }
    let exact = Exact::build(model, &exact::Settings::default());
    let polished = Polished::new(&*facets, mesh, &exact);
    spinner.finish_and_clear();
    work(&polished, polished.footprint())
}

/// Sets the number of threads of everything that runs in parallel; all cores when nothing is asked. Gives the number.
pub(crate) fn threads(asked: Option<usize>) -> Result<usize, Failure> {
    let all = std::thread::available_parallelism().map_or(1, |n| n.get());
    let threads = match asked {
        None => all,
        Some(0) => return Err(Failure::arguments("--threads 0: at least one thread is needed")),
        Some(n) => n.min(4096),
    };
    // The pool can be set once in a process; a second command in the same process keeps the first.
    let _ = rayon::ThreadPoolBuilder::new().num_threads(threads).build_global();
    Ok(threads)
}
