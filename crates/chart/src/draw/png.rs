//! A scene as a PNG image: shapes are filled by a software rasteriser, letters
//! are filled outlines of the bundled font.

use tiny_skia::{FillRule, LineCap, LineJoin, Mask, Paint, Path, PathBuilder, Pixmap, StrokeDash, Transform};
use ttf_parser::OutlineBuilder;

use super::font::{face, for_each_glyph, text_width_px};
use super::{Anchor, Colour, Fill, Pen, Rect, Scene, Shape, Text};
use crate::ChartError;

/// Largest image side, in image points: 16 times a full page.
const SIDE_LIMIT: f64 = 16_384.0;

pub(super) fn render(scene: &Scene, scale: f64) -> Result<Vec<u8>, ChartError> {
    let (width, height) = (scene.width * scale, scene.height * scale);
    let sensible = |side: f64| (1.0..=SIDE_LIMIT).contains(&side);
    if !(sensible(width) && sensible(height)) {
        return Err(ChartError::ImageSize { width_px: width, height_px: height });
    }
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "checked above")]
    let mut pixmap = Pixmap::new(width.ceil() as u32, height.ceil() as u32)
        .ok_or(ChartError::ImageSize { width_px: width, height_px: height })?;
    pixmap.fill(tiny_skia::Color::WHITE);
    let mut canvas = Canvas { transform: Transform::from_scale(f32(scale), f32(scale)), mask: None, pixmap };
    canvas.draw_all(&scene.shapes);
    encode(&canvas.pixmap).map_err(|error| ChartError::Png(error.to_string()))
}

/// Without the fourth channel: a page is opaque.
fn encode(pixmap: &Pixmap) -> Result<Vec<u8>, png::EncodingError> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, pixmap.width(), pixmap.height());
    encoder.set_color(png::ColorType::Rgb);
    let colours: Vec<u8> = pixmap.data().chunks_exact(4).flat_map(|dot| [dot[0], dot[1], dot[2]]).collect();
    let mut writer = encoder.write_header()?;
    writer.write_image_data(&colours)?;
    writer.finish()?;
    Ok(bytes)
}

struct Canvas {
    pixmap: Pixmap,
    transform: Transform,
    mask: Option<Mask>,
}

impl Canvas {
    fn draw_all(&mut self, shapes: &[Shape]) {
        for shape in shapes {
            self.draw(shape);
        }
    }

    fn draw(&mut self, shape: &Shape) {
        match shape {
            Shape::Path { points, fill, stroke } => {
                if let Some(path) = polygon(points, fill.is_some()) {
                    self.paint(&path, *fill, *stroke);
                }
            }
            Shape::Rect { rect, fill, stroke } => {
                if let Some(path) = rectangle(*rect) {
                    self.paint(&path, *fill, *stroke);
                }
            }
            Shape::Circle { centre, radius, fill, stroke } => {
                let circle = PathBuilder::from_circle(f32(centre[0]), f32(centre[1]), f32(*radius));
                if let Some(path) = circle {
                    self.paint(&path, *fill, *stroke);
                }
            }
            Shape::Text(text) => self.draw_text(text),
            Shape::Clipped { window, shapes } => self.draw_clipped(*window, shapes),
        }
    }

    fn draw_clipped(&mut self, window: Rect, shapes: &[Shape]) {
        let outer = self.mask.take();
        if let (Some(mut mask), Some(path)) = (Mask::new(self.pixmap.width(), self.pixmap.height()), rectangle(window))
        {
            mask.fill_path(&path, FillRule::Winding, true, self.transform);
            self.mask = Some(mask);
        }
        self.draw_all(shapes);
        self.mask = outer;
    }

    fn draw_text(&mut self, text: &Text) {
        let units_per_em = f64::from(face(text.bold).units_per_em());
        let font_scale = text.size / units_per_em;
        let width = text_width_px(&text.content, text.size, text.bold);
        let shift = match text.anchor {
            Anchor::Start => 0.0,
            Anchor::Middle => -width / 2.0,
            Anchor::End => -width,
        };
        let mut outline = Outline { builder: PathBuilder::new(), scale: font_scale, shift };
        for_each_glyph(&text.content, text.bold, |glyph| {
            outline.shift = shift + glyph.offset_units * font_scale;
            glyph.outline(&mut outline);
        });
        let Some(path) = outline.builder.finish() else { return };
        let turn = if text.upright { -90.0 } else { 0.0 };
        let place = Transform::from_translate(f32(text.at[0]), f32(text.at[1]));
        let Some(path) = path.transform(place.pre_rotate(turn)) else { return };
        if text.halo {
            let rim = Pen::solid(Colour(255, 255, 255), 3.0);
            self.paint(&path, None, Some(rim));
        }
        self.paint(&path, Some(Fill { colour: text.colour, opacity: 1.0 }), None);
    }

    fn paint(&mut self, path: &Path, fill: Option<Fill>, stroke: Option<Pen>) {
        if let Some(fill) = fill {
            let paint = paint(fill.colour, fill.opacity);
            let mask = self.mask.as_ref();
            self.pixmap.fill_path(path, &paint, FillRule::Winding, self.transform, mask);
        }
        if let Some(stroke) = stroke {
            let dash = stroke.dash.and_then(|[dash, gap]| StrokeDash::new(vec![f32(dash), f32(gap)], 0.0));
            let pen = tiny_skia::Stroke {
                width: f32(stroke.width),
                line_cap: LineCap::Butt,
                line_join: LineJoin::Round,
                dash,
                ..tiny_skia::Stroke::default()
            };
            let paint = paint(stroke.colour, 1.0);
            let mask = self.mask.as_ref();
            self.pixmap.stroke_path(path, &paint, &pen, self.transform, mask);
        }
    }
}

fn paint(colour: Colour, opacity: f64) -> Paint<'static> {
    let mut paint = Paint { anti_alias: true, ..Paint::default() };
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "in 0..=255")]
    let alpha = (opacity.clamp(0.0, 1.0) * 255.0).round() as u8;
    paint.set_color_rgba8(colour.0, colour.1, colour.2, alpha);
    paint
}

fn rectangle(rect: Rect) -> Option<Path> {
    let rect = tiny_skia::Rect::from_xywh(f32(rect.x), f32(rect.y), f32(rect.width), f32(rect.height))?;
    Some(PathBuilder::from_rect(rect))
}

fn polygon(points: &[[f64; 2]], close: bool) -> Option<Path> {
    let mut builder = PathBuilder::new();
    for (index, point) in points.iter().enumerate() {
        if index == 0 {
            builder.move_to(f32(point[0]), f32(point[1]));
        } else {
            builder.line_to(f32(point[0]), f32(point[1]));
        }
    }
    if close {
        builder.close();
    }
    builder.finish()
}

/// Collects the outlines of letters, turned from y upwards to y downwards.
struct Outline {
    builder: PathBuilder,
    scale: f64,
    shift: f64,
}

impl Outline {
    fn x(&self, x: f32) -> f32 {
        f32(self.shift + f64::from(x) * self.scale)
    }

    fn y(&self, y: f32) -> f32 {
        f32(-f64::from(y) * self.scale)
    }
}

impl OutlineBuilder for Outline {
    fn move_to(&mut self, x: f32, y: f32) {
        self.builder.move_to(self.x(x), self.y(y));
    }

    fn line_to(&mut self, x: f32, y: f32) {
        self.builder.line_to(self.x(x), self.y(y));
    }

    fn quad_to(&mut self, x1: f32, y1: f32, x: f32, y: f32) {
        self.builder.quad_to(self.x(x1), self.y(y1), self.x(x), self.y(y));
    }

    fn curve_to(&mut self, x1: f32, y1: f32, x2: f32, y2: f32, x: f32, y: f32) {
        let (x1, y1, x2, y2) = (self.x(x1), self.y(y1), self.x(x2), self.y(y2));
        self.builder.cubic_to(x1, y1, x2, y2, self.x(x), self.y(y));
    }

    fn close(&mut self) {
        self.builder.close();
    }
}

#[expect(clippy::cast_possible_truncation, reason = "pixels need no more")]
fn f32(value: f64) -> f32 {
    value as f32
}
