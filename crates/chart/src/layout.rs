//! From a page of panels to a scene: where everything stands.

use super::theme::{INK, MUTED, SUBTITLE_SIZE, TEXT_SIZE, TITLE_SIZE};
use super::{Figure, Panel, legend};
use crate::draw::{Anchor, Colour, Rect, Scene, Shape, Text, text_width_px};

const EDGE: f64 = 14.0;
const COLUMN_GAP: f64 = 18.0;
const ROW_GAP: f64 = 10.0;

pub(super) fn scene(figure: &Figure) -> Scene {
    let mut shapes = Vec::new();
    let mut y = EDGE;
    y = headline(&figure.title, TITLE_SIZE, true, INK, figure.width, y, &mut shapes);
    y = headline(&figure.subtitle, SUBTITLE_SIZE, false, MUTED, figure.width, y, &mut shapes);
    y += 4.0;

    let columns = figure.columns.max(1);
    let slot = (figure.width - 2.0 * EDGE - COLUMN_GAP * (columns - 1) as f64) / columns as f64;
    // Panels of one column share their left edge, so that a shared axis lines up.
    let left: Vec<f64> = (0..columns)
        .map(|column| {
            let panels = figure.panels.iter().skip(column).step_by(columns);
            panels.map(Panel::left_margin).fold(0.0, f64::max)
        })
        .collect();
    let right: Vec<f64> = (0..columns)
        .map(|column| {
            let panels = figure.panels.iter().skip(column).step_by(columns);
            panels.map(|panel| panel.right).fold(6.0, f64::max)
        })
        .collect();

    for row in figure.panels.chunks(columns) {
        let head = row.iter().map(|panel| head_height(panel, slot)).fold(0.0, f64::max);
        let height = row.iter().map(|panel| panel.height).fold(0.0, f64::max);
        let foot = row.iter().map(Panel::bottom_margin).fold(0.0, f64::max);
        for (column, panel) in row.iter().enumerate() {
            let x = EDGE + column as f64 * (slot + COLUMN_GAP);
            let area = Rect { x: x + left[column], y: y + head, width: slot - left[column] - right[column], height };
            draw_head(panel, [x, area.x], y, slot, &mut shapes);
            panel.draw(area, &mut shapes);
        }
        y += head + height + foot + ROW_GAP;
    }
    let description = [figure.title.as_str(), figure.subtitle.as_str()].join(". ").trim_matches(['.', ' ']).to_owned();
    Scene { width: figure.width, height: y + EDGE - ROW_GAP, description, shapes }
}

/// Height of a panel's title and legend.
fn head_height(panel: &Panel, slot: f64) -> f64 {
    let title = if panel.title.is_empty() { 0.0 } else { SUBTITLE_SIZE + 7.0 };
    let left = panel.left_margin();
    let legend = legend::height(&panel.legend, slot - left);
    title + legend + if title + legend > 0.0 { 4.0 } else { 0.0 } + 4.0
}

fn draw_head(panel: &Panel, [outer, inner]: [f64; 2], top: f64, slot: f64, out: &mut Vec<Shape>) {
    let mut y = top;
    if !panel.title.is_empty() {
        out.push(text(&panel.title, [inner, y + SUBTITLE_SIZE], SUBTITLE_SIZE, true, INK));
        y += SUBTITLE_SIZE + 7.0;
    }
    legend::draw(&panel.legend, [inner, y], slot - (inner - outer), out);
}

/// Writes a headline, broken into lines that fit; gives the next y.
fn headline(content: &str, size: f64, bold: bool, colour: Colour, width: f64, mut y: f64, out: &mut Vec<Shape>) -> f64 {
    for line in wrap(content, size, bold, width - 2.0 * EDGE) {
        y += size;
        out.push(text(&line, [EDGE, y], size, bold, colour));
        y += 0.45 * TEXT_SIZE;
    }
    y
}

/// Breaks a text between words into lines no wider than `width`.
fn wrap(content: &str, size: f64, bold: bool, width: f64) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for word in content.split_whitespace() {
        match lines.last_mut() {
            Some(line) if text_width_px(&format!("{line} {word}"), size, bold) <= width => {
                line.push(' ');
                line.push_str(word);
            }
            _ => lines.push(word.to_owned()),
        }
    }
    lines
}

fn text(content: &str, at: [f64; 2], size: f64, bold: bool, colour: Colour) -> Shape {
    Shape::Text(Text {
        content: content.to_owned(),
        at,
        size,
        bold,
        colour,
        anchor: Anchor::Start,
        upright: false,
        halo: false,
    })
}
