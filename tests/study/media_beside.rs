//! The indices on both sides of the faces that light meets.

use crate::known_scenes;
use lampyris::intersect::{Cost, Hit, Intersector};
use lampyris::math::{Frame, Point, Ray, Vector};
use lampyris::model::{Instance, PartId};
use lampyris::simulate::{MediaBeside, RunSettings, Scene};
use lampyris::study::{MeshSource, ModelMeshSource};
use std::path::Path;

/// Calls `look` with what finds the indices in a scene, and with the spline.
fn with_media(known: &known_scenes::KnownScene, look: impl FnOnce(&MediaBeside<'_>, &dyn Intersector)) {
    let scene = Scene::parse(&known.text, "known.toml", Path::new(".")).unwrap();
    let bound = scene.bind(&known.model).unwrap();
    let source = ModelMeshSource::new(&known.model);
    let settings = RunSettings::from(&scene.run);
    look(&MediaBeside::new(&bound, source.exact(), &settings), source.exact());
}

/// Of the two faces of a cemented surface either may come first: what is behind it is the other lens, not the air around both.
#[test]
fn behind_a_cemented_face_is_the_other_lens() {
    with_media(&known_scenes::doublet(1.0), |media, spline| {
        let next = |ray: &Ray| -> Option<Hit> { spline.intersect(ray, &mut Cost::default()) };
        let (crown, flint) = (1.5168, 1.62);
        // In front of both lenses, in the crown, in the flint, behind both.
        let [before, first, second, behind] = [-20.0, 3.0, 8.5, 30.0];
        let slanted = Vector::new(0.1, -0.05, 1.0).normalize();
        for d in [Vector::Z, slanted] {
            for (z, direction, ratio) in [
                (before, d, 1.0 / crown),
                (first, d, crown / flint),
                (second, d, flint),
                (behind, -d, 1.0 / flint),
                (second, -d, flint / crown),
                (first, -d, crown),
            ] {
                let ray = Ray::new(Point::new(1.0, 2.5, z), direction);
                let hit = next(&ray).unwrap();
                let found = media.index_ratio(&ray, &hit).unwrap();
                assert!((found - ratio).abs() < 1e-12, "{z} {direction}: {found}, not {ratio}");
                // The other face of the surface, where there is one.
                let from_before = ray.with_departure(hit.departure()).with_range(0.999 * hit.t, 1.001 * hit.t);
                let other = next(&from_before);
                assert_eq!(other.is_some(), ratio == crown / flint || ratio == flint / crown);
                if let Some(other) = other {
                    let found = media.index_ratio(&ray, &other).unwrap();
                    assert!((found - ratio).abs() < 1e-12, "{z} {direction}: {found}, not {ratio}");
                }
            }
        }
    });
}

/// A ball within a ball touches nothing, but stands in glass.
#[test]
fn around_an_enclosed_body_is_what_encloses_it() {
    let mut known = known_scenes::ball(10.0, 1.5);
    let mut inner = known_scenes::ball(4.0, 1.5).model;
    inner.parts[0].name = "core".into();
    known.model.parts.append(&mut inner.parts);
    let (part, placement) = (PartId(1), Frame::translation(Point::new(0.0, 0.0, 2.0)));
    known.model.instances.push(Instance {
        name: "core".into(),
        path: String::new(),
        part,
        placement,
        colour: None,
    });
    known.text = "[[medium]]\nname = 'dense'\nindex = 1.8\n".to_owned()
        + &known.text
        + "[[material]]\npart = 'core'\nmedium = 'dense'\n";
    with_media(&known, |media, spline| {
        for (z, direction, ratio) in [
            (-20.0, Vector::Z, 1.0 / 1.5),
            (-5.0, Vector::Z, 1.5 / 1.8),
            (0.0, Vector::Z, 1.8 / 1.5),
            (8.0, Vector::Z, 1.5),
            (8.0, -Vector::Z, 1.5 / 1.8),
            (-5.0, -Vector::Z, 1.5),
        ] {
            let ray = Ray::new(Point::new(0.5, 0.2, z), direction);
            let hit = spline.intersect(&ray, &mut Cost::default()).unwrap();
            let found = media.index_ratio(&ray, &hit).unwrap();
            assert!((found - ratio).abs() < 1e-12, "{z} {direction}: {found}, not {ratio}");
        }
    });
}
