//! `Stage`: a scene in motion, and what has been made of it for one picture that the next can use.

use super::prepared::Prepared;
use super::surfaces::Surfaces;
use super::visibility::Visibility;
use super::{BackendError, Reused, Settings, Stopwatch};
use crate::light::AreaLight;
use crate::scene::{Motion, Scene};
use glam::DVec3;
use std::borrow::Cow;

/// What has changed since the last picture.
#[derive(Clone, Debug, PartialEq)]
pub struct Changes {
    /// The camera stands elsewhere: everything is kept relative to it.
    pub eye: bool,
    /// The camera looks elsewhere, or from elsewhere.
    pub view: bool,
    /// Of each light.
    pub lights: Vec<LightChange>,
}

/// What has changed of a light.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LightChange {
    /// Where it stands, how it is turned and stretched.
    pub placement: bool,
    /// How strongly it shines.
    pub radiance: bool,
    /// What it is: nothing that was made of it is right any more.
    pub whole: bool,
}

/// What is reused and what is made, by name.
#[derive(Clone, Debug, Default)]
pub struct Reuse(Vec<Reused>);

impl Reuse {
    /// Counts something that is used.
    pub fn count(&mut self, what: &str, is_reused: bool) {
        let at = self.0.iter().position(|known| known.what == what).unwrap_or_else(|| {
            self.0.push(Reused { what: what.into(), ..Reused::default() });
            self.0.len() - 1
        });
        self.0[at].reused += u64::from(is_reused);
        self.0[at].made += u64::from(!is_reused);
    }

    /// Whether any of these was made.
    #[cfg(feature = "gpu")]
    pub fn has_made(&self, what: &[&str]) -> bool {
        self.0.iter().any(|known| known.made > 0 && what.contains(&known.what.as_str()))
    }

    /// The counts.
    pub fn finish(self) -> Vec<Reused> {
        self.0
    }
}

/// What was taken over, as it was, from the picture before.
#[cfg(feature = "gpu")]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Kept {
    /// Triangles.
    pub surfaces: bool,
    /// Materials, textures and their texels.
    pub textures: bool,
    /// What all lights are in light space: trees, regions, pictures.
    pub regions: bool,
}

/// What is made of a scene.
pub(super) struct Ready {
    /// The scene made ready for shading.
    pub prepared: Prepared,
    /// Its surfaces as camera rays meet them.
    pub surfaces: Surfaces,
    /// What the camera sees of them.
    pub visibility: Visibility,
    /// What of it is still that of the picture before.
    #[cfg(feature = "gpu")]
    pub kept: Kept,
}

/// A scene that is rendered once or, in motion, picture by picture.
pub(super) struct Stage<'a> {
    scene: Cow<'a, Scene>,
    motion: &'a Motion,
    settings: Settings,
    ready: Option<Ready>,
    /// The light that is filled, and whether it has been since the last picture.
    filled: Option<(usize, bool)>,
}

impl<'a> Stage<'a> {
    /// Nothing is made yet.
    pub const fn new(scene: &'a Scene, motion: &'a Motion, settings: Settings) -> Self {
        Self { scene: Cow::Borrowed(scene), motion, settings, ready: None, filled: None }
    }

    /// What to render and how well.
    pub const fn settings(&self) -> &Settings {
        &self.settings
    }

    /// Puts `light` in the place of the `index`th, for the pictures to come.
    pub fn fill(&mut self, index: usize, light: AreaLight) {
        if let Some(place) = self.scene.to_mut().lights.get_mut(index) {
            *place = light;
            self.filled = Some((index, true));
        }
    }

    /// Makes all ready for the picture at `time`; of a scene without motion, for the only one. What the picture before has left is
    /// reused where nothing it hangs on has changed.
    pub fn at(
        &mut self,
        time: f64,
        watch: &mut Stopwatch,
        reuse: &mut Reuse,
    ) -> Result<(&Scene, &mut Ready), BackendError> {
        let settings = &self.settings;
        let mut changes =
            if self.motion.is_still() { still(&self.scene) } else { moved(self.scene.to_mut(), self.motion, time) };
        if let Some((light, is_new)) = &mut self.filled {
            changes.lights[*light].whole = core::mem::take(is_new);
        }
        let last = self.ready.take().filter(|_| settings.skips.reuse);
        let (known, rest) = last.map(|ready| (ready.prepared, (ready.surfaces, ready.visibility))).unzip();
        let is_first = known.is_none();
        let prepared = Prepared::renewed(&self.scene, settings, known.map(|known| (known, &changes)), reuse)?;
        watch.lap("trees");
        let (surfaces, visibility) = rest.unzip();
        let surfaces = surfaces.filter(|_| !changes.eye);
        reuse.count("hierarchies of surfaces", surfaces.is_some());
        let surfaces = surfaces.unwrap_or_else(|| Surfaces::new(&prepared.triangles));
        let visibility = visibility.filter(|_| !changes.view).unwrap_or_default();
        // It pays where the next picture is likely to have the same view.
        let wanted = if is_first { self.motion.camera.is_none() } else { !changes.view };
        let is_last = self.motion.is_still() && self.filled.is_none();
        let records = wanted && !is_last && settings.skips.reuse;
        let ready = Ready {
            prepared,
            surfaces,
            visibility: visibility.prepared(records, settings),
            #[cfg(feature = "gpu")]
            kept: Kept {
                surfaces: !is_first && !changes.eye,
                textures: !is_first,
                regions: !is_first && !reuse.has_made(&["trees", "regions"]),
            },
        };
        watch.lap("surfaces");
        Ok((&self.scene, self.ready.insert(ready)))
    }
}

/// No change.
fn still(scene: &Scene) -> Changes {
    Changes { eye: false, view: false, lights: vec![LightChange::default(); scene.lights.len()] }
}

/// Moves the scene on to a time.
fn moved(scene: &mut Scene, motion: &Motion, time: f64) -> Changes {
    let camera = scene.camera;
    let lights = |scene: &Scene| -> Vec<_> {
        let radiances = |l: &AreaLight| l.layers.iter().map(|layer| layer.radiance).collect();
        scene.lights.iter().map(|l| (l.placement, radiances(l))).collect::<Vec<(_, Vec<DVec3>)>>()
    };
    let before = lights(scene);
    motion.set(scene, time);
    let change = |(a, b): (&(_, Vec<DVec3>), &(_, Vec<DVec3>))| LightChange {
        placement: a.0 != b.0,
        radiance: a.1 != b.1,
        whole: false,
    };
    Changes {
        eye: camera.position != scene.camera.position,
        view: camera != scene.camera,
        lights: before.iter().zip(&lights(scene)).map(change).collect(),
    }
}
