//! Light from far away: it arrives as if its source stood beside the scene, or the scene is refused.

use crate::files::fixture;
use crate::support::World;
use lampyris::formats::{LightRay, write_rays};
use lampyris::intersect::octree::{self, Octree};
use lampyris::math::{Point, Vector};
use lampyris::simulate::{RunSettings, Scene, simulate};
use lampyris::{step, tessellate};
use std::path::Path;

/// A black ball of 5 mm in a beam of 10 mm takes a quarter of it, wherever the beam begins.
#[test]
fn a_beam_from_the_sun_casts_the_shadow_of_a_ball() {
    // Whole-numbered directions of whole length, and places that are known to the last bit.
    let au = 2f64.powi(47);
    for (direction, length) in [([0.0, 0.0, 1.0], 1.0), ([2.0, 3.0, 6.0], 7.0), ([-1.0, 4.0, 8.0], 9.0)] {
        for distance in [10.0, 5e12, au, 16.0 * au] {
            let centre = Point::new(3.0, -2.0, 8.0);
            let at = centre - Vector::from_array(direction) * (distance / length).round();
            let mut world = World::default();
            world.sphere("ball", centre, 5.0);
            let text = format!(
                "[run]\nrays = 20_000\n[[material]]\npart = 'ball'\nsurface = 'absorber'\n[[source]]\nkind = 'collimated'\n\
                 at = [{:?}, {:?}, {:?}]\ndirection = {direction:?}\nradius = 10\n\
                 [[receiver]]\nname = 'far'\nkind = 'far_field'\nangles = 'C'\ncells = [4, 4]\n",
                at.x, at.y, at.z
            );
            let r = world.run(&text, |_| ());
            let error = r.receivers[0].power_error;
            assert!(
                (r.power.absorbed - 0.25).abs() < 4.0 * error + 1e-4,
                "{direction:?} {distance:e}: {:?}",
                r.power
            );
            assert_eq!((r.power.cut_off, r.lost_rays), (0.0, 0), "{direction:?} {distance:e}");
        }
    }
}

/// A cone of 1e-8 rad, whose cosine is 1 in an `f64`, fills its disc evenly: a black ball of half the disc's radius takes a quarter.
#[test]
fn a_star_in_a_narrow_cone_casts_the_shadow_of_a_ball() {
    let half_angle_deg = 1e-8f64.to_degrees();
    let mut world = World::default();
    world.sphere("ball", Point::ZERO, 5.0);
    let text = format!(
        "[run]\nrays = 20_000\n[[material]]\npart = 'ball'\nsurface = 'absorber'\n[[source]]\nkind = 'cone'\n\
         half_angle_deg = {half_angle_deg:e}\nat = [0, 0, -1e9]\n"
    );
    let power = world.run(&text, |_| ()).power;
    assert!((power.absorbed - 0.25).abs() < 5e-3, "{power:?}");
}

/// The focus of a lens is the same for the sun as for a beam that begins before it.
#[test]
fn a_lens_on_facets_focuses_the_sun() {
    let folder = fixture("step");
    let lens = step::read(&folder.join("lens_planoconvex_nurbs.stp"), &step::Settings::default()).unwrap();
    let facets = tessellate::tessellate(&lens.model, &tessellate::Settings::default());
    let octree = Octree::build(&facets.mesh, &octree::Settings::default());
    let spot = |z: f64| {
        let text = format!(
            "[[model]]\nfile = 'lens_planoconvex_nurbs.stp'\n[[medium]]\nname = 'glass'\nindex = 1.5168\n\
             [[material]]\npart = '*'\nmedium = 'glass'\n[[source]]\nkind = 'collimated'\nat = [0, 0, {z:e}]\nradius = 10\n\
             [[receiver]]\nname = 'focus'\nat = [0, 0, 107.026853]\nsize = [40, 40]\ncells = [20, 20]\n"
        );
        let scene = Scene::parse(&text, "sun.toml", &folder).unwrap().bind(&lens.model).unwrap();
        let run = RunSettings { rays: 20_000, threads: 2, ..RunSettings::default() };
        simulate(&scene, &octree, &run, &|_| true)
    };
    let near = spot(-10.0);
    for z in [-5e12, -1.496e14] {
        let sun = spot(z);
        assert_eq!(sun.segments, near.segments);
        let [a, b] = [&sun.receivers[0], &near.receivers[0]];
        assert!((a.power - b.power).abs() < 1e-3 && (a.rms[0] / b.rms[0] - 1.0).abs() < 1e-3, "{z:e}");
    }
}

#[test]
fn rays_of_a_list_start_beside_the_scene() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("rays.csv");
    let ray = |x: f64| LightRay {
        origin: Point::new(x, 0.0, -1e13),
        direction: Vector::Z,
        power: 1.0,
        wavelength_nm: None,
    };
    write_rays(&file, &[ray(-4.0), ray(1.0), ray(6.0), ray(7.0)]).unwrap();
    let mut world = World::default();
    world.sphere("ball", Point::ZERO, 5.0);
    let text = format!(
        "[run]\nrays = 4000\n[[material]]\npart = 'ball'\nsurface = 'absorber'\n[[source]]\nkind = 'rays'\nfile = '{}'\n",
        file.display()
    );
    let r = world.run(&text, |_| ());
    assert!((r.power.absorbed - 2.0).abs() < 1e-2 && r.power.cut_off == 0.0, "{:?}", r.power);
}

/// What cannot be right is refused before it is traced, by the key that is at fault.
#[test]
fn what_is_too_far_or_too_strong_is_refused() {
    let mut world = World::default();
    world.sphere("ball", Point::ZERO, 5.0);
    let refusal = |text: &str| {
        let scene = Scene::parse(text, "test.toml", Path::new("."));
        scene.and_then(|s| s.bind(&world.model)).err().map(|e| e.to_string()).unwrap_or_default()
    };
    let far = refusal("[[source]]\nkind = 'point'\nat = [0, 0, -1e18]\n");
    assert!(far.contains("cannot be traced") && far.contains("collimated"), "{far}");
    let beyond = refusal("[[source]]\nkind = 'collimated'\nat = [0, 0, -1e300]\n");
    assert!(beyond.contains("farther away than numbers reach"), "{beyond}");
    // Nothing is wrong with the source of a scene whose receiver lies beyond all reach.
    let receiver = refusal("[[source]]\n[[receiver]]\nname = 'r'\nsize = [1, 1]\nat = [1e200, 0, 0]\n");
    assert!(receiver.contains("test.toml:5:") && receiver.contains("`at` must lie within 1e30 mm"), "{receiver}");
    let model = refusal("[[model]]\nfile = 'a.stp'\nplacement = { at = [1e15, 0, 0] }\n[[source]]\n");
    assert!(model.contains("1e11 mm"), "{model}");
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("rays.csv");
    for powers in ["1e308", "1e20"] {
        let row = format!("0,0,-10,0,0,1,{powers}\n");
        std::fs::write(
            &file,
            format!("x,y,z,dx,dy,dz,power\n{}", row.repeat(if powers == "1e20" { 1 } else { 4 })),
        )
        .unwrap();
        let text = format!("[[source]]\nkind = 'rays'\nfile = '{}'\n", file.display());
        assert_eq!(refusal(&text).is_empty(), powers == "1e20", "{powers}: {}", refusal(&text));
    }
}
