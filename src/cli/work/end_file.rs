//! `--ends FILE`: where every ray of a list ended, as NPZ or CSV.

use super::terminal_monitor::TerminalMonitor;
use crate::cli::console::Console;
use crate::cli::failure::Failure;
use crate::formats::{Column, NpzStream, file_name, lower_extension, write_atomic};
use crate::pipeline::PreparedScene;
use crate::simulate::scene::Source;
use crate::simulate::{ListedEnd, MOST_LISTED_RAYS, RunSettings, Scene, listed_ends, ray_lists};
use crate::text::{count_of, grouped};
use std::path::Path;

/// The arrays of an NPZ file, one row per end.
const COLUMNS: [Column; 9] = [
    Column { name: "source", numbers: "<u4", bytes: 4, width: 1 },
    Column { name: "ray", numbers: "<u8", bytes: 8, width: 1 },
    Column { name: "branch", numbers: "<u4", bytes: 4, width: 1 },
    Column { name: "event", numbers: "|u1", bytes: 1, width: 1 },
    Column { name: "face", numbers: "<i8", bytes: 8, width: 1 },
    Column { name: "bounces", numbers: "<u4", bytes: 4, width: 1 },
    Column { name: "point", numbers: "<f8", bytes: 8, width: 3 },
    Column { name: "direction", numbers: "<f8", bytes: 8, width: 3 },
    Column { name: "power", numbers: "<f8", bytes: 8, width: 1 },
];

/// The face of an end that is at none.
const NO_FACE: i64 = -1;

/// Refuses a name that ends neither in `.npz` nor in `.csv`.
pub(crate) fn check_name(file: &Path) -> Result<(), Failure> {
    if matches!(lower_extension(file).as_str(), "csv" | "npz") {
        return Ok(());
    }
    let message = format!("--ends {}: ends of rays are written as .npz or .csv", file.display());
    Err(Failure::arguments(message).with_help("write --ends ends.npz"))
}

/// Refuses, before anything is prepared, a scene without a list of rays.
pub(crate) fn check_scene(scene: &Scene, file: &Path) -> Result<(), Failure> {
    if scene.sources.iter().any(Source::is_ray_list) {
        return Ok(());
    }
    let message = format!("--ends {}: no source of this scene is a list of rays", file.display());
    Err(Failure::arguments(message).with_help("--paths FILE.npz has the paths of any source"))
}

/// Refuses, before anything is traced, lists of too many rays.
pub(crate) fn check_rays(prepared: &PreparedScene, file: &Path) -> Result<(), Failure> {
    let lists = ray_lists(&prepared.bound);
    let rays: u64 = lists.iter().map(|(_, rays)| rays).sum();
    if rays > MOST_LISTED_RAYS {
        let largest = lists.iter().max_by_key(|(_, rays)| rays).map_or(0, |(source, _)| *source as usize);
        let named = prepared.job.scene.sources[largest].file.clone();
        let message = format!(
            "{} has most of the {} rays of this scene, of which at most {} can be followed one by one",
            named.map_or_else(|| format!("source {}", largest + 1), |name| file_name(Path::new(&name))),
            grouped(rays),
            grouped(MOST_LISTED_RAYS)
        );
        let failure = Failure::arguments(format!("--ends {}: {message}", file.display()));
        return Err(failure.with_help("give a shorter list, or take --paths"));
    }
    Ok(())
}

fn is_csv(file: &Path) -> bool {
    lower_extension(file) == "csv"
}

/// Traces every ray of the lists once and writes where each ended.
pub(crate) fn write(prepared: &PreparedScene, file: Option<&Path>, console: &Console) -> Result<(), Failure> {
    let Some(file) = file else { return Ok(()) };
    let settings = RunSettings { threads: prepared.threads, ..prepared.run_settings() };
    let monitor = TerminalMonitor::new(console);
    let ends =
        prepared.with_intersector(&monitor, |intersector, _| listed_ends(&prepared.bound, intersector, &settings));
    if is_csv(file) {
        write_csv(file, &ends)?
    } else {
        write_npz(file, &ends)?
    }
    console.say(format_args!("wrote where {} ended into {}", counted(&ends), file.display()));
    Ok(())
}

/// Counts rays, not rows: a ray that was split has several, which stand together.
fn counted(ends: &[ListedEnd]) -> String {
    let rays = ends.chunk_by(|a, b| (a.source, a.ray) == (b.source, b.ray)).count();
    let rays_text = count_of(rays as u64, "ray");
    if rays == ends.len() {
        return rays_text;
    }
    format!("{rays_text} and what they were split into ({})", count_of(ends.len() as u64, "row"))
}

/// Returns the number of the face where a ray ended, as both files hold it: [`NO_FACE`] for none.
fn face(end: &ListedEnd) -> i64 {
    end.face.map_or(NO_FACE, i64::from)
}

/// Writes a line for each end, events as words.
fn write_csv(file: &Path, ends: &[ListedEnd]) -> Result<(), Failure> {
    write_atomic(file, |out| {
        writeln!(out, "source,ray,branch,event,face,bounces,x_mm,y_mm,z_mm,dx,dy,dz,power")?;
        for end in ends {
            let event = serde_json::to_value(end.event).map_err(std::io::Error::other)?;
            let event = event.as_str().unwrap_or("unknown");
            let ([x, y, z], [dx, dy, dz]) = (end.point.to_array(), end.direction.to_array());
            let ListedEnd { source, ray, branch, bounces, power, .. } = end;
            let face = face(end);
            writeln!(out, "{source},{ray},{branch},{event},{face},{bounces},{x},{y},{z},{dx},{dy},{dz},{power}")?;
        }
        Ok(())
    })?;
    Ok(())
}

/// Writes the arrays of [`COLUMNS`].
fn write_npz(file: &Path, ends: &[ListedEnd]) -> Result<(), Failure> {
    let mut stream = NpzStream::create(file, &COLUMNS)?;
    // In blocks, so that the bytes of all columns need not stand in memory beside the ends.
    for block in ends.chunks(1 << 16) {
        let mut columns: [Vec<u8>; 9] = Default::default();
        for end in block {
            columns[0].extend(end.source.to_le_bytes());
            columns[1].extend(end.ray.to_le_bytes());
            columns[2].extend(end.branch.to_le_bytes());
            columns[3].push(end.event as u8);
            columns[4].extend(face(end).to_le_bytes());
            columns[5].extend(end.bounces.to_le_bytes());
            end.point.to_array().iter().for_each(|x| columns[6].extend(x.to_le_bytes()));
            end.direction.to_array().iter().for_each(|x| columns[7].extend(x.to_le_bytes()));
            columns[8].extend(end.power.to_le_bytes());
        }
        let slices: Vec<&[u8]> = columns.iter().map(Vec::as_slice).collect();
        stream.write(block.len() as u64, &slices)?;
    }
    stream.finish()?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{Point, Vector};
    use crate::simulate::Event;

    #[test]
    fn rays_are_counted_and_not_rows() {
        let end = |ray: u64, branch: u32| ListedEnd {
            source: 0,
            ray,
            branch,
            event: Event::Escaped,
            face: None,
            bounces: 0,
            point: Point::ZERO,
            direction: Vector::Z,
            power: 1.0,
        };
        assert_eq!(counted(&[end(0, 0), end(1, 0)]), "2 rays");
        assert_eq!(counted(&[end(0, 0), end(0, 1), end(1, 0)]), "2 rays and what they were split into (3 rows)");
    }
}
