//! Prose broken into lines that fit, numbers kept beside their units.

/// Breaks the lines of a text that are longer than so many columns. Lines with columns of their own (two blanks in
/// them) or indented by four or more are commands, files and tables, and stay as they are.
pub fn wrapped(text: &str, columns: usize) -> String {
    let mut out = String::with_capacity(text.len() + text.len() / 40);
    for line in text.split_inclusive('\n') {
        let (body, end) = line.strip_suffix('\n').map_or((line, ""), |body| (body, "\n"));
        let indent = body.len() - body.trim_start_matches(' ').len();
        if body.chars().count() <= columns || indent >= 4 || body.trim().contains("  ") {
            out.push_str(body);
        } else {
            let bullet = if body[indent..].starts_with("- ") { 2 } else { 0 };
            out.push_str(&broken(&body[indent..], columns, indent, indent + bullet.max(2)));
        }
        out.push_str(end);
    }
    out
}

/// One paragraph in lines, the first and the later ones with an indent of their own.
fn broken(text: &str, columns: usize, first: usize, later: usize) -> String {
    let mut out = " ".repeat(first);
    let mut column = first;
    let mut is_first = true;
    for piece in pieces(text) {
        let width = piece.chars().count();
        if !is_first && column + 1 + width > columns {
            out.push('\n');
            out.push_str(&" ".repeat(later));
            column = later;
        } else if !is_first {
            out.push(' ');
            column += 1;
        }
        out.push_str(&piece);
        column += width;
        is_first = false;
    }
    out
}

/// The words of a paragraph, a number and what belongs to it as one.
pub fn pieces(text: &str) -> Vec<String> {
    let mut pieces: Vec<String> = Vec::new();
    let mut last = "";
    for word in text.split(' ').filter(|word| !word.is_empty()) {
        let number = |word: &str| word.trim_start_matches(['(', '+', '-']).starts_with(|c: char| c.is_ascii_digit());
        let is_unit = |word: &str| word.trim_end_matches([',', ';', ')', '.', ':']).chars().count() <= 4;
        let belongs = (number(last) && !number(word) && is_unit(word) && last.ends_with(|c: char| c.is_ascii_digit()))
            || word == "+-"
            || last == "+-";
        match pieces.last_mut() {
            Some(piece) if belongs => {
                piece.push(' ');
                piece.push_str(word);
            }
            _ => pieces.push(word.to_owned()),
        }
        last = word;
    }
    pieces
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn prose_is_broken_and_numbers_stay_whole() {
        let text = "the model breaks away 59 ms early, and is 0.25 +- 0.01 mm off\n";
        let lines = wrapped(text, 26);
        assert_eq!(lines, "the model breaks away\n  59 ms early, and is\n  0.25 +- 0.01 mm off\n");
        assert_eq!(lines.split_whitespace().collect::<Vec<_>>(), text.split_whitespace().collect::<Vec<_>>());
    }

    #[test]
    fn commands_and_tables_stay() {
        let text = "    valve compare a-long-name.toml another-long-name.toml\nname   of a column   and another one\n";
        assert_eq!(wrapped(text, 20), text);
    }
}
