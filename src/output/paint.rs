//! Colours of text on a terminal.

use report::html::Tone;

/// A text in its tone, for terminals (ECMA-48).
pub fn paint(text: &str, tone: Option<Tone>) -> String {
    let Some(tone) = tone else { return text.to_owned() };
    let code = match tone {
        Tone::Strong => "1",
        Tone::Bad => "1;31",
        Tone::Caution => "33",
        Tone::Note => "36",
        Tone::Good => "32",
        Tone::Faint => "2",
    };
    format!("\u{1b}[{code}m{text}\u{1b}[0m")
}
