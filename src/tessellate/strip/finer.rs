//! Where the strip's triangles are divided further.

use super::delaunay::{Node, Work, key};
use super::sector;
use crate::math::Uv;
use crate::tessellate::border::trim::Trim;
use crate::tessellate::proof::flat::from_chord;
use rustc_hash::FxHashMap;

/// Share of the tolerance within which places are one.
const LEAST: f64 = 1e-6;

impl Work<'_, '_> {
    /// The free side of a triangle whose ends' normals differ most, where one of its normals breaks the angle condition.
    pub(super) fn turn(&self, t: [u32; 3]) -> Option<usize> {
        let most = self.sheet.field.angle?;
        let n = t.map(|i| self.nodes[i as usize]);
        let flat = (n[1].place - n[0].place).cross(n[2].place - n[0].place).try_normalize()?;
        let normals = n.map(|x| self.sheet.surface.normal(x.uv));
        let steep = normals.iter().flatten().any(|x| flat.angle_between(*x).min((-flat).angle_between(*x)) > most);
        let between = |k: usize| match (normals[k], normals[(k + 1) % 3]) {
            (Some(a), Some(b)) => a.angle_between(b),
            _ => 0.0,
        };
        let free = (0..3).filter(|&k| !self.odd.contains_key(&key(t[k], t[(k + 1) % 3])));
        let side = free.max_by(|&a, &b| between(a).total_cmp(&between(b)))?;
        (steep && between(side) > most).then_some(side)
    }

    /// Puts a point on the worst free edge of each bad triangle; `false` when nothing can be done.
    pub(super) fn refine(&mut self, bad: &[([u32; 3], (f64, f64))], trims: &FxHashMap<[u32; 2], Trim>) -> bool {
        let mut wanted: Vec<([Uv; 2], [u32; 3], f64)> = Vec::new();
        let mut seen: FxHashMap<[u32; 2], ()> = FxHashMap::default();
        for &(t, (bound, xi)) in bad {
            let sides = [(0, 1), (1, 2), (2, 0)].map(|(i, j)| (t[i], t[j]));
            // A chord stays as it is: no triangle on it can hold whose tolerance it strays beyond. Shorter chords are asked for instead, which at
            // a cone's apex, where the tolerance tightens, takes a tenth of the facets that rings of places between took.
            let lost = |&(a, b): &(u32, u32)| trims.get(&key(a, b)).is_some_and(|trim| trim.deviation > xi);
            // Nor does a corner move that the file puts beside the surface.
            let off =
                |&n: &u32| (self.sheet.point(self.nodes[n as usize].uv) - self.nodes[n as usize].place).length();
            if sides.iter().any(lost) || t.iter().any(|n| off(n) > xi) {
                continue;
            }
            let middles = sector::middles(self.sheet, t.map(|n| self.nodes[n as usize].uv));
            if let Some(k) = self.turn(t).filter(|_| bound <= xi) {
                if seen.insert(key(sides[k].0, sides[k].1), ()).is_none() {
                    wanted.push(([middles[k]; 2], t, xi));
                }
                continue;
            }
            let free = sides.iter().zip(middles).filter(|&(&(a, b), _)| !self.odd.contains_key(&key(a, b)));
            let best = free
                .map(|(&(a, b), m)| {
                    let (x, y) = (self.nodes[a as usize], self.nodes[b as usize]);
                    let sag = from_chord(self.sheet.point(m), &[x.place, y.place]);
                    ((a, b), m, sag)
                })
                .max_by(|a, b| a.2.total_cmp(&b.2));
            let corners = t.map(|n| self.nodes[n as usize]);
            let center = (corners[0].uv + corners[1].uv + corners[2].uv) / 3.0;
            match best {
                Some(((a, b), m, sag)) if sag > 0.2 * xi => {
                    if seen.insert(key(a, b), ()).is_none() {
                        wanted.push(([m, center], t, xi));
                    }
                }
                _ => wanted.push(([center; 2], t, xi)),
            }
        }
        let mut done = false;
        for (places, t, xi) in wanted {
            // The middle of a parameter line into a pole may be a corner already.
            let Some(uv) = places.into_iter().find(|&uv| self.is_free(uv)) else { continue };
            let n = self.nodes.len() as u32;
            let place = self.sheet.point(uv);
            // What does not hold down to such a size does not for its size.
            if t.iter().any(|&n| (self.nodes[n as usize].place - place).length() <= LEAST * xi) {
                continue;
            }
            self.nodes.push(Node { uv, place, position: self.next });
            match self.insert(n) {
                Some(h) => {
                    self.handles.push(Some(h));
                    self.next += 1;
                    done = true;
                }
                None => {
                    self.nodes.pop();
                }
            }
        }
        done
    }
}
