//! An assessment as the document that `assess --json` prints and `results.json` holds.

use super::assessment::Assessment;
use serde_json::{Value, json};

impl Assessment {
    /// The assessment as JSON: regulation, aim, photometer, and every row with both errors and its verdict; angles in degrees, intensities
    /// in cd, null for what is `None`. For left-hand traffic directions and aim are those of the mirrored lamp, as in the tables.
    pub fn document(&self) -> Value {
        let rows = self.rows.iter().map(|r| {
            let settles = r.settles.map(
                |s| json!({"rays": s.rays, "tolerance_share": s.tolerance_share, "tolerance_mm": s.tolerance_mm}),
            );
            json!({
                "id": r.row.id, "kind": r.row.kind,
                "h_deg": r.direction.map(|d| d[0]), "v_deg": r.direction.map(|d| d[1]),
                "min": r.row.min, "max": r.row.max,
                "value": r.reading.map(|x| x.value),
                "statistical": r.reading.map(|x| x.statistical),
                "geometric": r.reading.and_then(|x| x.geometric),
                "cells": r.reading.map(|x| x.cells),
                "verdict": r.verdict.map(|v| v.to_string()),
                "settles": settles, "unseen": r.unseen, "when": r.row.when, "note": r.row.note,
                "source": r.row.source, "evidence": r.row.evidence,
            })
        });
        json!({
            "regulation": self.regulation.id, "title": self.regulation.title, "checked": self.regulation.checked(),
            "traffic": self.traffic.word(), "aim": {"h_deg": self.aim.h_deg, "v_deg": self.aim.v_deg, "gradient": self.aim.gradient,
                "how": self.aim.how, "rivals_deg": self.aim.rivals, "moved_deg": self.aim.moved,
                "blurred_deg": self.aim.blurred},
            "sensor_deg": self.sensor_deg, "rows": rows.collect::<Vec<_>>(), "verdict": self.verdict.to_string(),
        })
    }
}
