//! A scene as an SVG document. Numbers carry at most two decimals, so that the
//! text is small and the same everywhere.

use std::fmt::Write;

use super::{Anchor, Colour, Fill, Pen, Scene, Shape, Text};

/// Fonts of a browser, about as wide as the one that the layout is measured with.
const FONTS: &str = "'DejaVu Sans Condensed','Helvetica Neue',Helvetica,Arial,sans-serif";

pub(super) fn render(scene: &Scene) -> String {
    let (w, h) = (num(scene.width), num(scene.height));
    let mut out = String::with_capacity(16 * 1024);
    let _ = write!(
        out,
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{w}\" height=\"{h}\" \
         viewBox=\"0 0 {w} {h}\" font-family=\"{FONTS}\" role=\"img\">\n<title>{}</title>\n\
         <rect width=\"{w}\" height=\"{h}\" fill=\"#ffffff\"/>\n",
        escape(&scene.description)
    );
    for shape in &scene.shapes {
        write_shape(&mut out, shape);
    }
    out.push_str("</svg>\n");
    out
}

fn write_shape(out: &mut String, shape: &Shape) {
    match shape {
        Shape::Path { points, fill, stroke } => {
            out.push_str("<path d=\"");
            for (index, point) in points.iter().enumerate() {
                let _ = write!(out, "{}{} {}", if index == 0 { "M" } else { "L" }, num(point[0]), num(point[1]));
            }
            out.push_str(if fill.is_some() { "Z\"" } else { "\"" });
            write_paint(out, *fill, *stroke);
            out.push_str("/>\n");
        }
        Shape::Rect { rect, fill, stroke } => {
            let _ = write!(
                out,
                "<rect x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\"",
                num(rect.x),
                num(rect.y),
                num(rect.width),
                num(rect.height)
            );
            write_paint(out, *fill, *stroke);
            out.push_str("/>\n");
        }
        Shape::Circle { centre, radius, fill, stroke } => {
            let _ = write!(out, "<circle cx=\"{}\" cy=\"{}\" r=\"{}\"", num(centre[0]), num(centre[1]), num(*radius));
            write_paint(out, *fill, *stroke);
            out.push_str("/>\n");
        }
        Shape::Text(text) => write_text(out, text),
        Shape::Clipped { window, shapes } => {
            // A nested svg element clips what leaves it, and needs no id: several
            // figures can stand in one page.
            let (x, y) = (num(window.x), num(window.y));
            let (w, h) = (num(window.width), num(window.height));
            let _ = writeln!(out, "<svg x=\"{x}\" y=\"{y}\" width=\"{w}\" height=\"{h}\" viewBox=\"{x} {y} {w} {h}\">");
            for shape in shapes {
                write_shape(out, shape);
            }
            out.push_str("</svg>\n");
        }
    }
}

fn write_text(out: &mut String, text: &Text) {
    let (x, y) = (num(text.at[0]), num(text.at[1]));
    let _ = write!(out, "<text x=\"{x}\" y=\"{y}\" font-size=\"{}\" fill=\"{}\"", num(text.size), hex(text.colour));
    match text.anchor {
        Anchor::Start => {}
        Anchor::Middle => out.push_str(" text-anchor=\"middle\""),
        Anchor::End => out.push_str(" text-anchor=\"end\""),
    }
    if text.bold {
        out.push_str(" font-weight=\"bold\"");
    }
    if text.upright {
        let _ = write!(out, " transform=\"rotate(-90 {x} {y})\"");
    }
    if text.halo {
        out.push_str(" stroke=\"#ffffff\" stroke-width=\"3\" stroke-linejoin=\"round\" paint-order=\"stroke\"");
    }
    let _ = writeln!(out, ">{}</text>", escape(&text.content));
}

fn write_paint(out: &mut String, fill: Option<Fill>, stroke: Option<Pen>) {
    match fill {
        None => out.push_str(" fill=\"none\""),
        Some(fill) => {
            let _ = write!(out, " fill=\"{}\"", hex(fill.colour));
            if fill.opacity < 1.0 {
                let _ = write!(out, " fill-opacity=\"{}\"", num(fill.opacity));
            }
        }
    }
    if let Some(stroke) = stroke {
        let _ = write!(
            out,
            " stroke=\"{}\" stroke-width=\"{}\" stroke-linejoin=\"round\"",
            hex(stroke.colour),
            num(stroke.width)
        );
        if let Some([dash, gap]) = stroke.dash {
            let _ = write!(out, " stroke-dasharray=\"{} {}\"", num(dash), num(gap));
        }
    }
}

fn hex(colour: Colour) -> String {
    format!("#{:02x}{:02x}{:02x}", colour.0, colour.1, colour.2)
}

/// At most two decimals, no trailing zeros, no negative zero.
fn num(value: f64) -> String {
    let text = format!("{value:.2}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" { "0".to_owned() } else { text.to_owned() }
}

fn escape(text: &str) -> String {
    // XML has no control characters, not even escaped ones.
    let text: String = text.chars().filter(|letter| !letter.is_control()).collect();
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_short() {
        assert_eq!(num(1.0), "1");
        assert_eq!(num(-0.001), "0");
        assert_eq!(num(12.346), "12.35");
        assert_eq!(num(100.0), "100");
    }

    #[test]
    fn text_cannot_break_the_document() {
        assert_eq!(escape("a<b & \"c\""), "a&lt;b &amp; &quot;c&quot;");
        assert_eq!(escape("red\u{1b}[31m\u{7}"), "red[31m");
    }
}
