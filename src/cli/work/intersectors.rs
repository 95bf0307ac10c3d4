//! From options to the intersector of a run.

use crate::cli::arguments::options::{IntersectorKind, TracingOptions};
use crate::cli::console::Console;
use crate::cli::failure::Failure;
use crate::intersect::bvh::{self, Bvh};
use crate::intersect::exact::{self, Exact};
use crate::intersect::octree::{self, Octree};
use crate::intersect::polish::Polished;
use crate::intersect::{Footprint, Intersector, NormalMode};
use crate::mesh::FacetMesh;
use crate::model::Model;
use crate::simulate::Scene;
use clap::ValueEnum;

/// What finds the hits, and how the normal there is got.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct IntersectorChoice {
    pub(crate) intersector: IntersectorKind,
    pub(crate) normals: NormalMode,
}

impl IntersectorChoice {
    /// The options, else the scene, else octree and bilinear.
    pub(crate) fn new(tracing: &TracingOptions, scene: Option<&Scene>) -> Result<Self, Failure> {
        let accuracy = scene.map(|s| &s.accuracy);
        let intersector = accuracy.and_then(|a| a.intersector.as_deref());
        let normals = accuracy.and_then(|a| a.normals.as_deref());
        Ok(Self {
            intersector: option_or_scene(tracing.intersector, intersector, "intersector")?,
            normals: option_or_scene(tracing.normals, normals, "normals")?,
        })
    }
}

/// A named value of the command line, else of the key in the scene's `[accuracy]`, else the default.
fn option_or_scene<T: ValueEnum + Default>(
    option: Option<T>,
    in_scene: Option<&str>,
    key: &str,
) -> Result<T, Failure> {
    let name = match (option, in_scene) {
        (Some(value), _) => return Ok(value),
        (None, None) => return Ok(T::default()),
        (None, Some(name)) => name,
    };
    T::from_str(name, true).map_err(|_| {
        let known: Vec<String> = (T::value_variants().iter())
            .filter_map(|v| Some(v.to_possible_value()?.get_name().to_owned()))
            .collect();
        Failure::arguments(format!("scene: [accuracy] {key} = \"{name}\" is not known"))
            .with_help(format!("use one of {}", known.join(", ")))
    })
}

/// Builds the chosen intersector and hands it to `work`, with what it took to build.
pub(crate) fn with_intersector<T>(
    choice: IntersectorChoice,
    model: &Model,
    mesh: &FacetMesh,
    console: &Console,
    work: impl FnOnce(&dyn Intersector, Footprint) -> T,
) -> T {
    let spinner = console.spinner(&format!("building {}", choice.intersector));
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
