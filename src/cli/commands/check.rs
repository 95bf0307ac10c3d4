//! `lampyris check`: octree against BVH against exact spline, ray by ray, and how fast each is.

use crate::cli::arguments::args::Refusals;
use crate::cli::arguments::options::{Meshing, Tracing};
use crate::cli::context::{Context, print};
use crate::cli::output::look;
use crate::cli::work::engine::Choice;
use crate::cli::work::load::Input;
use crate::cli::work::witness::Witness;
use crate::cli::work::{aim, engine, load, pairs};
use crate::cli::{Failure, Outcome};
use crate::formats::write_atomic;
use crate::intersect::bvh::{self, Bvh};
use crate::intersect::exact::Exact;
use crate::intersect::octree::{self, Octree};
use crate::intersect::polish::Polished;
use crate::intersect::{Cost, Intersector, NormalMode};
use crate::math::Ray;
use crate::mesh::FacetMesh;
use crate::report::{Trial, figures, grouped, verdict};
use crate::simulate::{RunSettings, Scene, simulate};
use crate::study::cross_check::{self, Competitor, CrossCheck, Intersectors, measure};
use crate::study::rays::{Bounces, Camera, Chain, RaySource, Uniform};
use crate::study::{Quantiles, Summary, records};
use std::path::{Path, PathBuf};

/// What `check` was asked for.
pub(crate) struct Asked<'a> {
    pub(crate) file: &'a Path,
    pub(crate) meshing: &'a Meshing,
    pub(crate) tracing: &'a Tracing,
    pub(crate) accuracy: Option<&'a str>,
    pub(crate) rays_out: Option<&'a PathBuf>,
    pub(crate) rays_in: Option<&'a PathBuf>,
    pub(crate) disagreements: Option<&'a PathBuf>,
    pub(crate) output: Option<&'a PathBuf>,
    pub(crate) limits: Refusals,
}

/// Rays when nothing else is asked: a second or two on a lamp.
const RAYS: u64 = 100_000;
/// Rays of a timed round, and rounds.
const TIMED: (usize, usize) = (20_000, 3);

pub(crate) fn run(asked: &Asked, context: &Context) -> Result<Outcome, Failure> {
    let threads = engine::threads(asked.tracing.threads)?;
    let given = asked.rays_in.map(|p| read_rays(p)).transpose()?;
    let input = load::either(asked.file, context)?;
    let (scene, loaded) = match &input {
        Input::Step(loaded) => (None, loaded),
        Input::Scene(scene, loaded) => (Some(&**scene), loaded),
    };
    let model = &loaded.model;
    let options = (asked.meshing, asked.tracing);
    let (meshing, tracing, aimed) = aim::meshing(asked.accuracy, options, scene, model, context)?;
    let settings = engine::mesh_settings(&meshing, scene, model)?;
    let (made, _) = engine::facets(model, &settings, context);
    let mesh = &made.mesh;
    let chosen = Choice::new(&tracing, scene)?.normals;
    let normals = chosen.on_facets();
    let spinner = context.spinner("building octree, BVHs and spline");
    let octree = Octree::build(mesh, &octree::Settings { normals, ..Default::default() });
    let wide = bvh::Settings { normals, ..Default::default() };
    let cwbvh = Bvh::build(mesh, &wide);
    let bvh2 = Bvh::build(mesh, &bvh::Settings { kind: bvh::Kind::Bvh2, ..wide });
    let shipped = Bvh::build(mesh, &bvh::Settings { cured: false, ..wide });
    let exact = Exact::build(model, &Default::default());
    let polish = Polished::new(&octree, mesh, &exact);
    spinner.finish_and_clear();
    let lift = 4.0 * settings.loosest();
    let rays = match given {
        Some(rays) => rays,
        None => own_rays(scene, model, mesh, &octree, &tracing, lift)?,
    };
    let bar = context.bar("judging", "rays", rays.len() as u64);
    let intersectors = Intersectors { model, mesh, octree: &octree, bvh: &cwbvh, exact: &exact };
    let band = cross_check::Settings { fallback_band_mm: settings.loosest(), ..Default::default() };
    let total = rays.len() as f64;
    let mut found =
        cross_check::cross_check(&intersectors, &rays, &band, &|p| bar.set_position((p.done * total) as u64));
    bar.finish_and_clear();
    if chosen == NormalMode::Exact {
        let [t, normal] = polished_errors(&polish, &exact, &rays, settings.loosest());
        (found.facets_vs_exact.t_error_mm, found.facets_vs_exact.normal_error_deg) = (t, normal);
    }
    let spinner = context.spinner("timing");
    let race = |name: &'static str, who: &dyn Intersector| -> (&'static str, f64, f64) {
        let f = who.footprint();
        (name, f.build_seconds, f.bytes as f64 / f.primitives.max(1) as f64)
    };
    for (name, build, bytes) in [
        race("octree", &octree),
        race("octree_single", &octree),
        race("bvh2", &bvh2),
        race("cwbvh", &cwbvh),
        race("cwbvh_as_shipped", &shipped),
        race("polish", &polish),
        race("exact", &exact),
    ] {
        found.build_seconds.set(name, build);
        found.bytes_per_facet.set(name, bytes);
    }
    let entrant = |name, who, batch| Competitor { name, who, batch };
    let competitors = [
        entrant("octree", &octree as &dyn Intersector, true),
        entrant("octree_single", &octree, false),
        entrant("bvh2", &bvh2, true),
        entrant("cwbvh", &cwbvh, true),
        entrant("cwbvh_as_shipped", &shipped, true),
        entrant("polish", &polish, true),
        entrant("exact", &exact, true),
    ];
    // Evenly over the rays, so that every kind of them is among the timed.
    let timed: Vec<Ray> = rays.iter().copied().step_by(rays.len().div_ceil(TIMED.0).max(1)).collect();
    for (name, timing) in measure(&competitors, &timed, TIMED.1) {
        found.mrays_per_s.set(&name, timed.len() as f64 / timing.median.max(1e-12) / 1e6);
    }
    spinner.finish_and_clear();
    if let Some(path) = asked.rays_out {
        let mut hits = vec![None; rays.len()];
        octree.intersect_batch(&rays, &mut hits, &mut Cost::default());
        write_atomic(path, |mut w| {
            records::write(&mut w, rays.iter().copied().zip(hits.iter().map(|h| h.map(|h| h.t))))
        })?;
        context.say(format_args!("wrote {}", path.display()));
    }
    if let Some(path) = asked.disagreements {
        let kept = found.disagreements.iter().map(|d| (d.ray, d.octree.map(|h| h.t)));
        write_atomic(path, |mut w| records::write(&mut w, kept.clone()))?;
        context.say(format_args!("wrote {}", path.display()));
    }
    let pairs = match scene {
        Some(scene) => {
            let facets: &dyn Intersector = if chosen == NormalMode::Exact { &polish } else { &octree };
            pairs::find(scene, &scene.bind(model)?, [facets, &exact], &tracing, context)
        }
        None => Vec::new(),
    };
    let wrong = |e: serde_json::Error| Failure::running(e.to_string());
    let mut document = serde_json::to_value(&found).map_err(wrong)?;
    document["normals"] = chosen.to_string().into();
    if scene.is_some() {
        document["receivers"] = serde_json::to_value(&pairs).map_err(wrong)?;
    }
    if let Some(aimed) = &aimed {
        document["accuracy"] = serde_json::to_value(aimed).map_err(wrong)?;
    }
    let text = serde_json::to_string_pretty(&document).map_err(wrong)? + "\n";
    if let Some(folder) = asked.output {
        let seed = tracing.seed.or(scene.map(|s| s.run.seed)).unwrap_or(1);
        let trial = Trial {
            title: asked.file.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default(),
            check: &found,
            facets: &look::facets(model, mesh, scene),
            normals: &chosen.to_string(),
            tables: if pairs.is_empty() { Vec::new() } else { vec![pairs::table(&pairs)] },
            also: aimed.iter().map(|a| a.answer.clone()).collect(),
            provenance: context.provenance(Some(seed), threads),
        };
        trial.report().write(folder)?;
        write_atomic(&folder.join("check.json"), |w| w.write_all(text.as_bytes()))?;
    }
    if context.json {
        print(&text)?;
    } else {
        print(&(described(&found, chosen) + &pairs::described(&pairs)))?;
    }
    if asked.output.is_none() && !found.disagreements.is_empty() && !context.json {
        context.say(context.faint("  -o DIR writes a page with the rays that differ in 3-D"));
    }
    if let Some(folder) = asked.output {
        context.say(format_args!("\n  {}", context.strong(&folder.join("report.html").display().to_string())));
        context.say(format_args!("  {}", folder.join("check.json").display()));
    }
    Ok(load::account(&loaded.reports, asked.limits.max_refused, context))
}

fn read_rays(path: &Path) -> Result<Vec<Ray>, Failure> {
    let open = std::fs::File::open(path);
    let read = open.and_then(|f| records::read(&mut std::io::BufReader::new(f)));
    match read {
        Ok(list) if list.is_empty() => Err(Failure::input(format!("{}: no rays in it", path.display()))),
        Ok(list) => Ok(list.into_iter().map(|(ray, _)| ray).collect()),
        Err(e) => Err(Failure::input(format!("{}: cannot be read as a file of rays: {e}", path.display()))),
    }
}

/// The rays of a scene's own run, or a camera's, random and bouncing ones for a bare model.
fn own_rays(
    scene: Option<&Scene>,
    model: &crate::model::Model,
    mesh: &FacetMesh,
    octree: &dyn Intersector,
    tracing: &Tracing,
    lift: f64,
) -> Result<Vec<Ray>, Failure> {
    let count = tracing.rays.unwrap_or(RAYS);
    let Some(scene) = scene else {
        let seed = tracing.seed.unwrap_or(1);
        let (bounds, third) = (mesh.bounds(), (count / 3).max(1));
        let camera = Camera::new(&bounds, third.min(count));
        let uniform = Uniform::new(&bounds, seed, third.min(count - camera.len()));
        let bounces = Bounces::new(&bounds, octree, lift, seed, count - camera.len() - uniform.len());
        let chain = Chain(vec![&camera, &uniform, &bounces]);
        return Ok(chain.rays(0..chain.len()));
    };
    let bound = scene.bind(model)?;
    // About four segments a ray; a few more rays, so that there are enough.
    let settings = RunSettings {
        rays: count.div_ceil(2).max(64),
        seed: tracing.seed.unwrap_or(scene.run.seed),
        ..RunSettings::from(&scene.run)
    };
    let witness = Witness::new(octree, count, count);
    simulate(&bound, &witness, &settings, &|_| true);
    Ok(witness.rays(count as usize, model, lift))
}

/// How far hits moved to the spline are from it, along the ray in mm and in the normal in degrees. Beyond `near` mm it is another
/// crossing, which the facets' own verdict counts.
fn polished_errors(polish: &dyn Intersector, exact: &dyn Intersector, rays: &[Ray], near: f64) -> [Summary; 2] {
    let ask = |who: &dyn Intersector| {
        let mut hits = vec![None; rays.len()];
        who.intersect_batch(rays, &mut hits, &mut Cost::default());
        hits
    };
    let (mut distance, mut angle) = (Quantiles::default(), Quantiles::default());
    for (p, e) in ask(polish).into_iter().zip(ask(exact)).filter_map(|(p, e)| p.zip(e)) {
        let apart = (p.t - e.t).abs();
        if p.face == e.face && apart <= near {
            distance.add(apart);
            angle.add(p.normal.cross(e.normal).length().atan2(p.normal.dot(e.normal)).to_degrees());
        }
    }
    [distance.summary(), angle.summary()]
}

fn spread(q: &Summary, unit: &str) -> String {
    let [p50, p99, max] = [q.p50, q.p99, q.max].map(|x| figures(x, 2));
    format!("off by {p50}{unit} (median), {p99}{unit} (99 %), {max}{unit} (largest)")
}

fn described(c: &CrossCheck, normals: NormalMode) -> String {
    let f = &c.facets_vs_exact;
    let e = &f.explained;
    let mut text = format!("  {}\n\n", verdict(c).replace("**", ""));
    let mut line = |name: &str, what: String| text += &format!("  {name:<12} {what}\n");
    line(
        "rays",
        format!(
            "{} asked, {} hit; {} facets, {} patches",
            grouped(c.rays),
            grouped(c.hits),
            grouped(c.scene.facets as u64),
            grouped(c.scene.patches as u64)
        ),
    );
    line(
        "differences",
        format!("{} hit or miss, {} another face, {} unexplained", f.hit_miss, f.other_face, f.unexplained),
    );
    line(
        "explained",
        format!(
            "{} within sag, {} silhouette, {} trim edge, {} coincident, {} tangent, {} unproved facet, {} without facets or surface",
            e.within_sag,
            e.silhouette,
            e.trim_edge,
            e.coincident,
            e.tangent,
            e.unproved,
            e.unmeshed + e.no_surface
        ),
    );
    let moved = if normals == NormalMode::Exact { "moved to the spline, " } else { "" };
    line("distance", format!("{moved}{}", spread(&f.t_error_mm, " mm")));
    line("normals", format!("{normals}, {}", spread(&f.normal_error_deg, "°")));
    line(
        "spline",
        format!(
            "{} hits certified, {} tangent, {} uncertified",
            grouped(c.exact.certified),
            c.exact.tangent,
            c.exact.uncertified
        ),
    );
    let mut table = crate::cli::output::tables::blank(100);
    table.set_header(["", "Mrays/s, 1 thread", "build", "bytes per facet"]);
    let (m, b, s) = (&c.mrays_per_s, &c.build_seconds, &c.bytes_per_facet);
    for (((name, rate), (_, build)), (_, size)) in m.named().into_iter().zip(b.named()).zip(s.named()) {
        let shown = |x: Option<f64>| x.map_or("–".into(), |x| figures(x, 3));
        let time = build.map_or("–".into(), crate::report::seconds);
        table.add_row([name.to_owned(), shown(rate), time, shown(size)]);
    }
    text += &format!("\n{table}\n");
    text
}
