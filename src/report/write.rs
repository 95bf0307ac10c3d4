//! A report as a folder: `report.html`, a static picture of every figure, a CSV of every table.

use super::document::{Block, Report};
use super::view::View;
use super::{chart_png, html, raster, static_chart};
use crate::formats::{Error, ErrorKind, printable, write_atomic, write_png};
use std::collections::HashMap;
use std::path::{Path, PathBuf};

impl Report {
    /// Writes the report as one self-contained HTML text; draws every view.
    pub fn to_html(&self) -> String {
        html::page(self, &view_png)
    }

    /// Writes `report.html`, `figures/*.svg` and `.png` and `tables/*.csv` into a folder, which is made when missing; returns the files
    /// written, `report.html` first. Files of the same name are replaced.
    ///
    /// # Errors
    /// When the folder cannot be made or a file cannot be written.
    pub fn write(&self, folder: &Path) -> Result<Vec<PathBuf>, Error> {
        let make = |path: &Path| std::fs::create_dir_all(path).map_err(|e| Error::new(path, ErrorKind::Write(e)));
        make(folder)?;
        let page = folder.join("report.html");
        // `report.html` and the folder have the same pictures: drawn once.
        let views = self.sections.iter().flat_map(|s| &s.blocks).filter_map(|block| match block {
            Block::View(view) => Some((view.name.as_str(), view_png(view))),
            _ => None,
        });
        let pictures: HashMap<&str, Result<Vec<u8>, String>> = views.collect();
        let html =
            html::page(self, &|view| pictures.get(view.name.as_str()).cloned().unwrap_or_else(|| view_png(view)));
        write_atomic(&page, |w| w.write_all(html.as_bytes()))?;
        let mut written = vec![page];
        for block in self.sections.iter().flat_map(|s| &s.blocks) {
            let inside = |kind: &str, file: String| -> Result<PathBuf, Error> {
                make(&folder.join(kind))?;
                Ok(folder.join(kind).join(file))
            };
            match block {
                Block::Text(_) => continue,
                Block::Chart(chart) => {
                    let path = inside("figures", format!("{}.svg", chart.name))?;
                    let drawing = static_chart::draw(chart).svg();
                    write_atomic(&path, |w| w.write_all(printable(&drawing).as_bytes()))?;
                    written.push(path.clone());
                    if let Some(picture) = chart_png::picture(chart) {
                        let path = path.with_extension("png");
                        write_png(&path, &picture)?;
                        written.push(path);
                    }
                }
                Block::View(view) => {
                    let path = inside("figures", format!("{}.png", view.name))?;
                    match pictures.get(view.name.as_str()) {
                        // A view that could not be drawn for it is tried once more, so that its error reaches
                        // the caller.
                        Some(Ok(png)) => write_atomic(&path, |w| w.write_all(png))?,
                        _ => write_png(&path, &raster::render(view))?,
                    }
                    written.push(path);
                }
                Block::Table(table) => {
                    let path = inside("tables", format!("{}.csv", table.name))?;
                    write_atomic(&path, |w| w.write_all(table.to_csv().as_bytes()))?;
                    written.push(path);
                }
            }
        }
        Ok(written)
    }
}

/// Draws a view as the bytes of a PNG file, or returns why it could not be drawn.
fn view_png(view: &View) -> Result<Vec<u8>, String> {
    raster::render(view).to_png().map_err(|e| e.to_string())
}
