//! What a receiver counts besides power, and how much of it light of each wavelength brings.

use super::scene;
use crate::optics::xyz_of_watt;

/// What a receiver counts besides power.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Channels {
    None,
    /// Lumens, by the CIE's V(λ), for sources in watts.
    Photometric,
    /// CIE X, Y, Z.
    Xyz,
    /// Power between each two wavelengths, nm.
    Bins(Vec<f64>),
}

/// Lumens that a quantum of a weighted channel stands for: above all values of 683·x̄, 683·ȳ, 683·z̄.
pub(crate) const CHANNEL_LUMENS: f64 = 2048.0;

impl Channels {
    /// Takes the channels of a checked receiver of the scene: its bins, else its photometric or colour channels.
    pub(super) fn new(r: &scene::Receiver) -> Self {
        match (&r.channels, &r.bins_nm) {
            (_, Some(bins)) => Self::Bins(bins.clone()),
            (Some(scene::Channels::Photometric), None) => Self::Photometric,
            (Some(scene::Channels::Xyz), None) => Self::Xyz,
            (None, None) => Self::None,
        }
    }

    /// How many sums a cell has beside its power.
    pub(crate) fn count(&self) -> usize {
        match self {
            Self::None => 0,
            Self::Photometric => 1,
            Self::Xyz => 3,
            Self::Bins(edges) => edges.len() - 1,
        }
    }

    /// Returns the name of a channel by its index: `lm`, `X`, `Y`, `Z`, or the edges of its bin; empty without channels.
    pub(crate) fn name(&self, channel: usize) -> String {
        match self {
            Self::None => String::new(),
            Self::Photometric => "lm".into(),
            Self::Xyz => ["X", "Y", "Z"][channel].into(),
            Self::Bins(edges) => format!("{}-{} nm", edges[channel], edges[channel + 1]),
        }
    }

    /// Calls `add` with the index of each channel that counts light of `nm` and the quanta of the channel to a quantum of power. In a bin
    /// that is 1; in lumens and CIE values it is those of a watt over [`CHANNEL_LUMENS`].
    #[inline]
    pub(crate) fn weigh(&self, nm: f64, mut add: impl FnMut(usize, f64)) {
        match self {
            Self::None => {}
            Self::Photometric => add(0, xyz_of_watt(nm)[1] / CHANNEL_LUMENS),
            Self::Xyz => (0..3).zip(xyz_of_watt(nm)).for_each(|(c, x)| add(c, x / CHANNEL_LUMENS)),
            Self::Bins(edges) => {
                // A bin holds the edge that it begins with, the last one both, as cells do.
                let begun = edges.partition_point(|e| *e <= nm);
                let k = if edges.last() == Some(&nm) { begun - 1 } else { begun };
                if k > 0 && k < edges.len() {
                    add(k - 1, 1.0);
                }
            }
        }
    }

    /// Returns what a quantum of a channel stands for, as a multiple of a quantum of power: lumens to the watt, or 1 for a bin.
    pub(crate) fn worth(&self) -> f64 {
        match self {
            Self::Photometric | Self::Xyz => CHANNEL_LUMENS,
            Self::None | Self::Bins(_) => 1.0,
        }
    }
}
