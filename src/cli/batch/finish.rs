//! What a batch writes when its items are done: contact sheet and gallery.

use super::Batch;
use crate::batch::errors::Errors;
use crate::batch::inputs::Item;
use crate::batch::ledger::{Entry, Ledger, write_whole};
use crate::batch::worker::{COMPARED, PICTURES};
use crate::error::Error;
use crate::film::sheet::{self, Place, View};
use crate::report::gallery::{Card, Gallery, State};
use crate::scene::Texture;

/// The gallery's file.
pub const PAGE: &str = "index.html";

/// Writes both. The same pictures give the same bytes.
pub fn write(batch: &Batch<'_>, ledger: &Ledger, errors: &Errors) -> Result<(), Error> {
    let folder = ledger.folder();
    let place = |index: usize| {
        let item = &batch.items[index];
        let view = match (errors.of(item.number), entry(batch, ledger, item)) {
            (Some(_), _) => View::Failed,
            (None, Some(entry)) => view(ledger, entry),
            (None, None) => View::Missing,
        };
        Place { label: format!("{} {}", item.number, item.name), view }
    };
    sheet::write(&folder.join("contact.png"), batch.items.len(), place)?;
    let plan = batch.plan;
    let settings = plan.settings;
    let technique = settings.technique.to_string();
    let cards = batch.items.iter().map(|item| card(batch, ledger, errors, item)).collect();
    let gallery = Gallery {
        template: batch.args.scene.display().to_string(),
        about: format!(
            "{} × {} pixels, {} samples, {technique}, tolerance {}. Each drawing is the light of the same scene.",
            settings.width, settings.height, settings.samples, settings.tolerance
        ),
        size: [settings.width, settings.height],
        cards,
    };
    Ok(write_whole(&folder.join(PAGE), gallery.page().as_bytes())?)
}

/// The entry of an item, if it is of that drawing.
fn entry<'l>(batch: &Batch<'_>, ledger: &'l Ledger, item: &Item) -> Option<&'l Entry> {
    ledger.get(&item.name).filter(|entry| entry.settings == batch.settings(item))
}

fn view(ledger: &Ledger, entry: &Entry) -> View {
    let png = entry.pictures.iter().find(|p| p.path.starts_with(PICTURES) && p.path.ends_with(".png"));
    let bytes = png.and_then(|png| std::fs::read(ledger.folder().join(&png.path)).ok());
    match bytes.and_then(|bytes| Texture::decode(&bytes, true).ok()) {
        Some(texture) => View::Picture(texture.width, texture.height, texture.texels),
        None => View::Missing,
    }
}

fn card(batch: &Batch<'_>, ledger: &Ledger, errors: &Errors, item: &Item) -> Card {
    let state = match (errors.of(item.number), entry(batch, ledger, item)) {
        (Some(error), _) => State::Failed(error.reason.clone()),
        (None, None) => State::Missing,
        (None, Some(entry)) => {
            let path = |folder: &str| {
                let found = entry.pictures.iter().find(|p| p.path.starts_with(folder) && p.path.ends_with(".png"));
                found.map(|p| p.path.clone())
            };
            State::Done {
                picture: path(PICTURES).unwrap_or_default(),
                compared: path(COMPARED).zip(entry.difference.map(|d| [d.rmse, d.max])),
                curves: entry.curves,
                was_black: entry.was_black,
                warnings: entry.warnings.iter().map(|(element, message)| format!("{element}: {message}")).collect(),
            }
        }
    };
    let technique = item.technique.unwrap_or(batch.plan.settings.technique).to_string();
    Card { number: item.number, name: item.name.clone(), file: item.file.display().to_string(), technique, state }
}
