//! [`Skips`]: what is left out where a scene doesn't need it, each with a switch, so that what it saves can be measured and
//! that it changes nothing can be seen.

use std::str::FromStr;

/// What a rendering may leave out. All on by default; with one off, the same picture is computed at more cost.
///
/// That a single point is behind a light, or sees it wholly below a horizon, is found by the integral itself and has no switch.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Skips {
    /// Integrals whose weight is zero: no specular work for diffuse materials, no diffuse work for metals.
    pub lobes: bool,
    /// Texture look-ups and what they need, where no material has a texture.
    pub textures: bool,
    /// Clipping, where no light can be cut by the horizon of any surface.
    pub horizons: bool,
    /// Lights that show their dark back to all of a tile.
    pub behind: bool,
    /// Lights that are below the horizon of all of a tile.
    pub below_horizon: bool,
    /// Lights that together light a tile by less than a quarter of the tolerance.
    pub under_tolerance: bool,
    /// Lights of a cluster one by one, where its moments do. The points of a tile share one walk over the clusters.
    pub clusters: bool,
    /// What does not change from one frame of a sequence to the next.
    pub reuse: bool,
}

/// Finds the switch of one skip.
pub type Switch = fn(&mut Skips) -> &mut bool;

impl Skips {
    /// Every skip by its name.
    pub const ALL: [(&'static str, Switch); 8] = [
        ("lobes", |s| &mut s.lobes),
        ("textures", |s| &mut s.textures),
        ("horizons", |s| &mut s.horizons),
        ("behind", |s| &mut s.behind),
        ("below-horizon", |s| &mut s.below_horizon),
        ("under-tolerance", |s| &mut s.under_tolerance),
        ("clusters", |s| &mut s.clusters),
        ("reuse", |s| &mut s.reuse),
    ];

    /// Nothing is left out.
    pub const NONE: Self = Self {
        lobes: false,
        textures: false,
        horizons: false,
        behind: false,
        below_horizon: false,
        under_tolerance: false,
        clusters: false,
        reuse: false,
    };

    /// All but those.
    #[must_use]
    pub fn without(skips: &[SkipName]) -> Self {
        let mut all = Self::default();
        for skip in skips {
            *(Self::ALL[skip.0].1)(&mut all) = false;
        }
        all
    }

    /// Whether anything is decided for whole tiles.
    pub const fn by_tile(&self) -> bool {
        self.behind || self.below_horizon || self.under_tolerance
    }
}

impl Default for Skips {
    fn default() -> Self {
        Self {
            lobes: true,
            textures: true,
            horizons: true,
            behind: true,
            below_horizon: true,
            under_tolerance: true,
            clusters: true,
            reuse: true,
        }
    }
}

/// The name of a skip: an index into [`Skips::ALL`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SkipName(usize);

impl FromStr for SkipName {
    type Err = String;

    fn from_str(name: &str) -> Result<Self, String> {
        let names = Skips::ALL.map(|(name, _)| name);
        let index = names.iter().position(|&known| known == name);
        index.map(Self).ok_or_else(|| format!("must be one of {}", names.join(", ")))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_name_turns_its_own_switch() {
        let mut off = Skips::default();
        for (i, (name, switch)) in Skips::ALL.iter().enumerate() {
            let one = Skips::without(&[name.parse().unwrap()]);
            assert_ne!(one, Skips::default());
            assert!(Skips::ALL[..i].iter().all(|(other, _)| Skips::without(&[other.parse().unwrap()]) != one));
            *switch(&mut off) = false;
        }
        assert_eq!(off, Skips::NONE);
        assert!("lobe".parse::<SkipName>().is_err());
    }
}
