//! Every scene of the fixtures: light closes, none is lost, and leaving effects out changes no bit.

use crate::files::fixture;
use lampyris::intersect::octree::Octree;
use lampyris::model::Model;
use lampyris::simulate::{RunSettings, Scene, verify_pruning};
use lampyris::tessellate::{self, tessellate};

#[test]
fn every_scene_of_the_fixtures_closes() {
    let folder = fixture("scenes");
    let mut files: Vec<_> = std::fs::read_dir(&folder).unwrap().map(|e| e.unwrap().path()).collect();
    files.sort();
    assert!(files.len() >= 7);
    for file in files {
        let scene = Scene::read(&file).unwrap();
        let read = |m: &lampyris::simulate::scene::ModelUse| -> Model {
            lampyris::step::read(&scene.resolve(&m.file), &lampyris::step::Settings::default()).unwrap().model
        };
        let model = scene.assemble(scene.models.iter().map(read).collect()).unwrap();
        let bound = scene.bind(&model).unwrap();
        let made = tessellate(&model, &tessellate::Settings::default());
        let octree = Octree::build(&made.mesh, &Default::default());
        let settings = RunSettings { rays: 8000, threads: 2, ..RunSettings::from(&scene.run) };
        let (r, verified) = verify_pruning(&bound, &octree, &settings, &|_| true);
        let name = file.display();
        assert!(verified.identical, "{name}: {verified:?}");
        assert_eq!(r.lost_rays, 0, "{name}: {:?}", r.ledger.first());
        assert!(r.power.imbalance() < 1e-9, "{name}: {:?}", r.power);
        let ends: Vec<u128> = r.tallies.ends.iter().map(|s| s.total).collect();
        assert_eq!(ends[0], ends[1..].iter().sum::<u128>(), "{name}: to the last quantum");
        for receiver in &r.receivers {
            assert!(receiver.power > 0.0, "{name}: '{}' gets no light", receiver.name);
        }
    }
}
