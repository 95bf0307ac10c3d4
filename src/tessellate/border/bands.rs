//! Which side of a border places lie on, asked many times.

use crate::math::Uv;
use crate::math::polygon::is_inside_sides;

/// Segments in bands across v, so that a place is compared only with those at its height: a damaged face with 5,000 of them spent nine
/// tenths of its time comparing.
pub(in crate::tessellate) struct BorderBands {
    lowest: f64,
    /// Bands to a unit of v.
    density: f64,
    bands: Vec<Vec<[Uv; 2]>>,
}

impl BorderBands {
    /// Sorts segments of a border, in parameters, into bands; without segments nothing is enclosed.
    pub(in crate::tessellate) fn new(segments: &[[Uv; 2]]) -> Self {
        let heights = || segments.iter().flatten().map(|p| p.y);
        let (lowest, highest) =
            (heights().fold(f64::INFINITY, f64::min), heights().fold(f64::NEG_INFINITY, f64::max));
        let height = highest - lowest;
        // As many bands as segments divided by the mean number that crosses a height: each segment then stands in two bands on average,
        // even where many run along the whole height. Without height that mean is no number, and `max` makes it 1.
        let crossing = segments.iter().map(|[a, b]| (b.y - a.y).abs()).sum::<f64>() / height;
        let count = (segments.len() as f64 / crossing.max(1.0)) as usize;
        let count = count.clamp(1, segments.len().max(1));
        let density = if height > 0.0 { count as f64 / height } else { 0.0 };
        let mut out = Self { lowest, density, bands: vec![Vec::new(); count] };
        for segment in segments {
            let [a, b] = segment.map(|p| out.band(p.y));
            out.bands[a.min(b)..=a.max(b)].iter_mut().for_each(|band| band.push(*segment));
        }
        out
    }

    /// Returns the index of the band at height `v`, the first or last beyond the ends. Never falls as `v` rises, so that a segment is in
    /// every band it crosses.
    fn band(&self, v: f64) -> usize {
        // Beyond either end the first or last band, which crosses nothing there.
        (((v - self.lowest) * self.density) as usize).min(self.bands.len() - 1)
    }

    /// Whether `p` lies inside the closed loops of the border, by the parity of their crossings with the ray along +u. On the border either
    /// answer may come.
    pub(in crate::tessellate) fn encloses(&self, p: Uv) -> bool {
        is_inside_sides(self.bands[self.band(p.y)].iter().copied(), p)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bands_cross_what_all_segments_cross() {
        // A star of 999 corners, and a line along v through all bands.
        let corner =
            |k: usize| Uv::from_angle(k as f64 * 2.4) * (1.0 + 0.5 * (k as f64).sin()) + Uv::new(3.0, -7.0);
        let mut segments: Vec<[Uv; 2]> = (0..999).map(|k| [corner(k), corner((k + 1) % 999)]).collect();
        segments.push([Uv::new(3.1, -9.0), Uv::new(3.1, -5.0)]);
        let bands = BorderBands::new(&segments);
        for k in 0..4000 {
            let p = Uv::new(1.0 + 4.0 * ((k * 37) % 101) as f64 / 101.0, -9.5 + 5.0 * (k % 97) as f64 / 97.0);
            assert_eq!(bands.encloses(p), is_inside_sides(segments.iter().copied(), p), "{p}");
        }
        // All on one height, and none at all.
        assert!(!BorderBands::new(&[[Uv::ZERO, Uv::X]]).encloses(Uv::new(-1.0, 0.0)));
        assert!(!BorderBands::new(&[]).encloses(Uv::ZERO));
    }
}
