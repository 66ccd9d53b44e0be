//! What is said between a batch and its workers: JSON, one line each.

use crate::backend::Technique;
use crate::scene::slot::Change;
use serde::{Deserialize, Serialize};
use std::path::PathBuf;

/// An item for a worker.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Order {
    /// The item's number.
    pub number: usize,
    /// The SVG file.
    pub file: PathBuf,
    /// The name of its picture.
    pub name: String,
    /// What it has otherwise than the slot.
    pub change: Change,
    /// As `--technique` takes it, if otherwise than the others.
    pub technique: Option<String>,
}

impl Order {
    /// The technique, if it is not that of the others.
    pub fn technique(&self) -> Option<Technique> {
        self.technique.as_ref().and_then(|name| name.parse().ok())
    }
}

/// What has become of it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "outcome", rename_all = "lowercase")]
pub enum Outcome {
    /// Its pictures are written.
    Done(Box<Done>),
    /// There is no picture.
    Failed(Failure),
    /// The folder cannot be written to: nothing more can be done.
    Unwritable {
        /// What the system says, with the file.
        message: String,
    },
}

/// A finished item.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Done {
    /// Digest of the SVG file that was read.
    pub input: String,
    /// The pictures.
    pub pictures: Vec<Written>,
    /// What was left out or simplified: element and what was done about it.
    pub warnings: Vec<(String, String)>,
    /// The drawing is black, and lit in white.
    pub was_black: bool,
    /// Layers of the light.
    pub layers: usize,
    /// Curves of its outlines.
    pub curves: usize,
    /// How far the masked rectangle is off, where it is compared.
    pub difference: Option<Difference>,
    /// Where the time went.
    pub seconds: Seconds,
}

/// A file that was written.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Written {
    /// Below the folder of the batch, parts separated by `/`.
    pub path: String,
    /// Its digest.
    pub digest: String,
}

/// How far two pictures are apart in what surfaces reflect, W·sr⁻¹·m⁻².
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Difference {
    /// Root of the mean square over pixels and channels.
    pub rmse: f64,
    /// The largest.
    pub max: f64,
}

/// Where the time of an item went, seconds of wall clock.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Seconds {
    /// Reading the file: XML, styles, text.
    pub parse: f64,
    /// Drawing it: strokes, overlaps, painter's order.
    pub settle: f64,
    /// Trees, masks or whatever the technique reads.
    pub tree: f64,
    /// Shading and the lights in view.
    pub shade: f64,
    /// Encoding and writing the pictures.
    pub write: f64,
    /// The masked rectangle of a comparison: all of it.
    pub compare: f64,
    /// All of it, from the order to the answer.
    pub total: f64,
}

impl Seconds {
    /// Adds those of another item.
    pub fn add(&mut self, other: &Self) {
        self.parse += other.parse;
        self.settle += other.settle;
        self.tree += other.tree;
        self.shade += other.shade;
        self.write += other.write;
        self.compare += other.compare;
        self.total += other.total;
    }
}

/// Why there is no picture.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Failure {
    /// The element of the drawing that it is about.
    pub element: Option<String>,
    /// What is wrong, with value and limit.
    pub reason: String,
    /// Work goes on in the worker that cannot be stopped: it is to be replaced.
    pub spent: bool,
}
